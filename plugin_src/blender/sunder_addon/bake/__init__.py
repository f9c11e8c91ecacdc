"""One bake: compiled from a tree, run by the library, kept in its folder."""
