"""Sunder's package alone or with another's libraries in one process: `beside.py NAME...`, of `sunder`, `debian` and `bpy`, used in
this order, and then again; prints what Sunder said and made, as JSON."""
import ctypes
import json
import sys
import tempfile
from pathlib import Path

CUBE = "".join(f"v {x} {y} {z}\n" for z in (0, 1) for y in (0, 1) for x in (0, 1)) + \
    "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"


def sunder():
    """OpenVDB and TBB (the collider's distances), CGAL and GMP (the cut; in a cube's ties it throws and catches), assimp."""
    import sunder as package

    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "cube.obj").write_text(CUBE)
        Path(folder, "broken.fbx").write_bytes(b"Kaydara FBX Binary  \0\x1a\0" + 60 * b"\xff")
        g = package.Graph()
        for name in ("cube.obj", "broken.fbx"):
            g.add("mesh_file", name[:-4], path=str(Path(folder, name)))
        g.add("prefracture", "pieces", mesh="@cube.mesh", pieces=8)
        g.add("body", "clay", fragments="@pieces.fragments")
        g.add("collider", "floor", shape="mesh", path=str(Path(folder, "cube.obj")), position=[0, 0, -1.5])
        g.add("solver", "sim", bodies=["@clay.body"], colliders=["@floor.collider"])
        told = []
        for use in (lambda: g.evaluate("broken.mesh"), lambda: package.Graph.from_dict("{")):
            try:
                use()
            except package.Error as error:
                told.append(str(error).replace(folder, ""))
        state = g.evaluate("sim.state", frame=3)
        return {"told": told, "positions": state.position.tobytes().hex()}


def debian():
    """OpenVDB with the libraries that it needs, for every library loaded after it to see."""
    for name in ("libtbb.so.12", "libImath-3_1.so.29", "libopenvdb.so.10.0"):
        library = ctypes.CDLL(name, ctypes.RTLD_GLOBAL)
    library._ZN7openvdb5v10_010initializeEv()
    library._ZN7openvdb5v10_012uninitializeEv()


def bpy():
    """Blender's OpenVDB and TBB."""
    import bpy as blender

    blender.ops.wm.read_factory_settings()
    cube = blender.data.objects["Cube"]
    cube.modifiers.new("Voxels", "REMESH").mode = "VOXEL"
    cube.modifiers[0].voxel_size = 0.2
    shape = cube.evaluated_get(blender.context.evaluated_depsgraph_get()).data
    assert len(shape.vertices) > 100, len(shape.vertices)


uses = {function.__name__: function for function in (sunder, debian, bpy)}
results = [uses[name]() for name in 2 * sys.argv[1:]]
first, again = (result for result in results if result)
assert first == again
print("RESULT", json.dumps(first), flush=True)
if "bpy" in sys.argv:
    import os
    os._exit(0)  # 4.5 waits for a thread of its own for ever
