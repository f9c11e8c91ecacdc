"""Makes a Blender file of an example: its graph as a tree, and objects for meshes, colliders and rigid bodies.

    blender -b --addons sunder_addon --python-exit-code 9 --python examples/blend.py -- NAME OUT.blend

NAME is that of a graph file beside this script. Open OUT.blend and press Bake.
"""
import json
import math
import sys
from pathlib import Path

import bpy
from mathutils import Euler, Vector

HERE = Path(__file__).resolve().parent
BAKES = ("bake_mesh", "bake_state")  # the add-on bakes what its results need by itself
PLACED = {"body": ("position", "rotation"), "rigid_body": ("position", "rotation"), "collider": ("position", "rotation")}
SIZES = ("radius", "size", "height")


def addon(name):
    """A module of the add-on, wherever Blender keeps it."""
    package = next(m for m in sys.modules if m.split(".")[-1] == "sunder_addon")
    return __import__(f"{package}.{name}", fromlist=["*"])


def is_keyed(value):
    return isinstance(value, dict) and "keys" in value


def at_first(value):
    return value["keys"][0][1] if is_keyed(value) else value


def add_object(name, data):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def source_object(name, graph):
    """What a mesh node reads, as an object: triangles and vertices as the library has them, so that it is cut alike."""
    mesh = graph.evaluate(f"{name}.mesh")
    data = bpy.data.meshes.new(name)
    data.from_pydata(mesh.positions.tolist(), [], mesh.triangles.tolist())
    return add_object(name.title(), data)


def primitive(name, fields):
    """The shape of a collider or rigid body about its own origin."""
    shape, radius = fields.get("shape", "plane" if fields["type"] == "collider" else "sphere"), fields.get("radius", 0.5)
    if shape == "plane":
        bpy.ops.mesh.primitive_plane_add(size=40)
    elif shape == "box":
        bpy.ops.mesh.primitive_cube_add(size=1)
        for vertex in bpy.context.object.data.vertices:
            vertex.co = [c * s for c, s in zip(vertex.co, fields.get("size", (1, 1, 1)))]
    elif shape in ("sphere", "capsule"):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, segments=32, ring_count=16)
        for vertex in bpy.context.object.data.vertices if shape == "capsule" else ():
            vertex.co.z += math.copysign(fields.get("height", 1.0) / 2, vertex.co.z)
        bpy.ops.object.shade_smooth()
    else:
        raise ValueError(f"{name}: no object is made of a collider of shape {shape}")
    thing = bpy.context.object
    thing.name = name.title()
    return thing


def place(thing, fields):
    """Puts an object where position and rotation say, with their keys."""
    for path, value, convert in (("location", fields.get("position", (0, 0, 0)), Vector),
                                 ("rotation_euler", fields.get("rotation", (0, 0, 0)), lambda v: Euler(map(math.radians, v)))):
        setattr(thing, path, convert(at_first(value)))
        for frame, key in value["keys"] if is_keyed(value) else ():
            setattr(thing, path, convert(key))
            thing.keyframe_insert(path, frame=frame)
        set_interpolation(thing.animation_data, value)


def set_interpolation(data, value):
    """Keys between which values go as the graph file has them, and not as Blender eases them."""
    if not is_keyed(value):
        return
    kind = {"linear": "LINEAR", "step": "CONSTANT"}[value.get("interpolation", "linear")]
    for curve in addon("base.blender_versions").curves_of(data):
        for key in curve.keyframe_points:
            key.interpolation = kind


def set_parameter(node, name, value):
    node.set_parameters(**{name: at_first(value)})
    if not is_keyed(value):
        return
    for frame, key in value["keys"]:
        node.set_parameters(**{name: key})
        node.keyframe_insert(addon("tree.parameters").attribute(name), frame=frame)
    set_interpolation(node.id_data.animation_data, value)


def wires(fields):
    """[(input, name of the node, its output)] of a node of a graph file."""
    for name, value in fields.items():
        for wire in value if isinstance(value, list) else [value]:
            if isinstance(wire, str) and wire.startswith("@"):
                yield (name, *wire[1:].split("."))


def add_node(tree, name, fields, graph):
    kind = fields["type"]
    node = tree.nodes.new(addon("tree.nodes").class_name(kind))
    node.graph_name = node.name = name
    left_out = {"type", *(socket for socket, *_ in wires(fields)), *PLACED.get(kind, ())}
    if kind == "mesh_file":
        node.object = source_object(name, graph)
        left_out |= {"path", "scale", "rotation"}
    elif kind in ("collider", "rigid_body"):
        node.source, node.object = "OBJECT", primitive(name, fields)
        place(node.object, fields)
        left_out |= set(SIZES)
    elif kind == "follow" and fields.get("motion") == "vertices":
        node.from_object = False
        fields = {**fields, "path": str(HERE / fields["path"])}
    elif kind == "follow":
        raise ValueError(f"{name}: key the object of the mesh, and let the body follow it")
    for parameter, value in fields.items():
        if parameter not in left_out:
            set_parameter(node, parameter, value)
    return node


def build(name):
    """The tree of an example in the present scene; returns it."""
    path = HERE / (name + ".json")
    description = json.loads(path.read_text(encoding="utf-8"))
    graph = addon("base.core").sunder().Graph.load(str(path))
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = description["frame_range"]
    scene.render.fps, scene.render.fps_base = description["frame_rate"], 1
    tree = bpy.data.node_groups.new(name.title(), "SunderTree")
    kept = {n: fields for n, fields in description["nodes"].items() if fields["type"] not in BAKES}
    nodes = {n: add_node(tree, n, fields, graph) for n, fields in kept.items()}
    for n, fields in kept.items():
        for socket, source, output in wires(fields):
            ends = {s.identifier: s for s in nodes[source].outputs}[output], {s.identifier: s for s in nodes[n].inputs}[socket]
            tree.links.new(*ends)
        if fields["type"] == "body":
            place(addon("tree.wiring").upstream(nodes[n], "mesh_file").object, fields)
    addon("interface.tree_layout").arrange(tree)
    return tree


def stage(tree):
    """A camera that sees what is cut, and light."""
    bpy.context.view_layer.update()
    things = [node.object for node in tree.nodes if node.sunder_type == "mesh_file"]
    corners = [thing.matrix_world @ Vector(c) for thing in things for c in thing.bound_box]
    low, high = (Vector(pick(c[i] for c in corners) for i in range(3)) for pick in (min, max))
    size, middle = (high - low).length, (low + high) / 2
    camera = add_object("Camera", bpy.data.cameras.new("Camera"))
    camera.location = middle + Vector((0, -1.6, 0.55)) * size
    camera.rotation_euler = (middle - camera.location).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.camera = camera
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    world.color = (0.05, 0.055, 0.065)
    sun = add_object("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.rotation_euler = 3, 0.2, (math.radians(50), 0, math.radians(-35))


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    if len(arguments) != 2 or not (HERE / (arguments[0] + ".json")).is_file():
        names = ", ".join(sorted(p.stem for p in HERE.glob("*.json")))
        sys.exit(f"blend.py: error: NAME OUT.blend are wanted behind --; examples are {names}")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    tree = build(arguments[0])
    stage(tree)
    bpy.ops.sunder.add_results(tree=tree.name)
    for node in tree.nodes:
        if node.sunder_type == "mesh_file":
            node.object.hide_set(True)
            node.object.hide_render = True
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(arguments[1]).resolve()))


if __name__ == "__main__":
    main()
