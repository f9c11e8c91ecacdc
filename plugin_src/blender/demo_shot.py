"""Builds the demo shot with the add-on's nodes, bakes it and renders it, all without a window:

    blender -b --factory-startup --addons sunder_addon --python-exit-code 9 --python demo_shot.py -- BUNNY.obj OUT
        [--frames 1:48] [--pieces 300] [--width 480] [--engine workbench|cycles]

A heavy ball falls on each of two bunnies that share one set of pieces: a brittle one and a ductile one. OUT gets shot.blend, its
sunder_cache and render/frame_####.png. Run again, it opens shot.blend's bake and goes on where it was.
"""
import argparse
import os
import sys

import bpy
from mathutils import Vector

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import blender_versions  # noqa: E402

BRITTLE = {"youngs_modulus": 5e7, "yield": None, "toughness": 0.006}
DUCTILE = {"youngs_modulus": 5e5, "poisson_ratio": 0.3, "yield": 0.01, "flow_rate": 300, "hardening": 0.1, "toughness": 0.05}


def arguments():
    parser = argparse.ArgumentParser(prog="demo_shot.py")
    parser.add_argument("bunny")
    parser.add_argument("out")
    parser.add_argument("--frames", default="1:48")
    parser.add_argument("--pieces", type=int, default=300)
    parser.add_argument("--width", type=int, default=480)
    parser.add_argument("--engine", choices=("workbench", "cycles"), default="workbench")
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])


def material(name, color):
    made = bpy.data.materials.new(name)
    made.diffuse_color = (*color, 1)
    blender_versions.turn_on_nodes(made)
    made.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1)
    return made


def bunny(path):
    """The mesh file as an object whose up is z."""
    bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
    thing = bpy.context.selected_objects[0]
    thing.name = "Bunny"
    thing.data.materials.clear()
    thing.data.materials.append(material("Glaze", (0.55, 0.30, 0.18)))
    return thing


def ball(name, location):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.3, location=location)
    thing = bpy.context.object
    thing.name = name
    thing.data.materials.append(material(name, (0.2, 0.22, 0.25)))
    bpy.ops.object.shade_smooth()
    return thing


def node(tree, kind, x, y, **parameters):
    """A node by its name in docs/nodes.md, parameters as in graph files."""
    words = "".join(word.title() for word in kind.split("_"))
    made = tree.nodes.new(f"Sunder{words}Node")
    made.location = (x, y)
    made.set_parameters(**parameters)
    return made


def wire(tree, source, output, target, name):
    sockets = {s.identifier: s for s in source.outputs}, {s.identifier: s for s in target.inputs}
    tree.links.new(sockets[0][output], sockets[1][name])


def build(path, pieces):
    source = bunny(path)
    tree = bpy.data.node_groups.new("Demo", "SunderTree")
    mesh = node(tree, "mesh_file", 0, 0)
    mesh.object = source
    cut = node(tree, "prefracture", 260, 0, method="kmeans", pieces=pieces, seed=7)
    solver = node(tree, "solver", 800, 0, substeps=16)
    floor = node(tree, "collider", 520, -1300, shape="plane", friction=0.6)
    wire(tree, mesh, "mesh", cut, "mesh"), wire(tree, floor, "collider", solver, "colliders")
    for i, (x, look) in enumerate(((-1, BRITTLE), (1, DUCTILE))):
        body = node(tree, "body", 520, -620 * i, density=1000, position=(x, 0, 0), rotation=(0, 0, 30), **look)
        body.source = "VALUES"  # not where the bunny stands: there are two of it
        weight = node(tree, "rigid_body", 260, -340 - 400 * i, shape="sphere", mass=800, velocity=(0, 0, -8))
        weight.object = ball(f"Ball {i + 1}", (x + 0.05, 0.12, 1.7))
        skin = node(tree, "deformer", 1080, -300 * i)
        wire(tree, cut, "fragments", body, "fragments"), wire(tree, body, "body", solver, "bodies")
        wire(tree, weight, "rigid_body", solver, "rigid_bodies")
        wire(tree, body, "body", skin, "body"), wire(tree, solver, "state", skin, "state")
    return tree


def stage():
    bpy.ops.mesh.primitive_plane_add(size=40)
    bpy.context.object.data.materials.append(material("Floor", (0.35, 0.36, 0.38)))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.6, -6.5, 2.4)
    camera.rotation_euler = (Vector((0, 0, 0.7)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    light = bpy.data.objects.new("Key", bpy.data.lights.new("Key", "AREA"))
    light.data.energy, light.data.size, light.location = 900, 4, (-4, -4, 6)
    light.rotation_euler = (-light.location).to_track_quat("-Z", "Y").to_euler()
    scene = bpy.context.scene
    for thing in (camera, light):
        scene.collection.objects.link(thing)
    scene.camera = camera


def set_render(scene, options):
    scene.frame_start, scene.frame_end = map(int, options.frames.split(":"))
    scene.render.resolution_x, scene.render.resolution_y = options.width, options.width * 9 // 16
    scene.render.filepath = os.path.join(os.path.abspath(options.out), "render", "frame_")
    if options.engine == "cycles":
        scene.render.engine = "CYCLES"
        scene.cycles.samples, scene.cycles.use_denoising = 32, False  # Debian's Blender has no denoiser
    else:
        scene.render.engine = "BLENDER_WORKBENCH"
        scene.display.shading.color_type, scene.display.shading.show_shadows = "MATERIAL", True


def main():
    options = arguments()
    os.makedirs(options.out, exist_ok=True)
    path = os.path.join(os.path.abspath(options.out), "shot.blend")
    if os.path.exists(path):
        bpy.ops.wm.open_mainfile(filepath=path)
        tree = bpy.data.node_groups["Demo"]
        set_render(bpy.context.scene, options)
    else:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        set_render(bpy.context.scene, options)
        tree = build(os.path.abspath(options.bunny), options.pieces)
        stage()
        bpy.ops.sunder.add_results(tree=tree.name)
    bpy.ops.wm.save_as_mainfile(filepath=path)  # the cache lies beside the file
    bpy.ops.sunder.bake(tree=tree.name)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.render.render(animation=True)


if __name__ == "__main__":
    main()
