"""Objects that play a bake: made, and written anew at each frame. They need files alone, and no library to play."""
