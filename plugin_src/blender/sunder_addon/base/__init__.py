"""What every room uses: the library and its descriptions, what is remembered while Blender runs, how things are drawn.

The packaging puts bake_reader.py and blender_versions.py here, which scripts outside the add-on use, too.
"""
