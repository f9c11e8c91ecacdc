"""What a Blender without Sunder makes of a file: writes it as arrays, for the test that started it (addon_share_test.py).

    blender -b --factory-startup --python read_shared.py -- HOW FILE.blend OUT.npz FRAMES

HOW: open the file, or link or append the one collection it has into an empty one that is saved far away, or show an instance.
OUT of each mesh that the scene shows: NAME/FRAME/points, triangles, and material, velocity, uv, what keys change.
"""
import os
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector


def numbers(sequence, attribute, width, kind=np.float32):
    found = np.empty(width * len(sequence), kind)
    sequence.foreach_get(attribute, found)
    return found.reshape(-1, width) if width > 1 else found


def of_corners(mesh, name):
    """(corners, 4) of a colour or a number."""
    attribute = mesh.attributes.get(name)
    if attribute is None:
        return np.zeros(0)
    if "COLOR" in attribute.data_type:
        found = numbers(attribute.data, "color", 4)
    else:
        found = np.repeat(numbers(attribute.data, "value", 1)[:, None], 4, 1)
    return found[numbers(mesh.loops, "vertex_index", 1, np.int32)] if attribute.domain == "POINT" else found


def read(instance):
    thing, place = instance.object, np.array(instance.matrix_world)
    mesh = thing.data
    points = numbers(mesh.vertices, "co", 3) @ place[:3, :3].T + place[:3, 3]
    names = [slot.material.name if slot.material else "" for slot in thing.material_slots] or [""]
    slots = np.minimum(numbers(mesh.polygons, "material_index", 1, np.int32), len(names) - 1)
    found = {"points": points, "material": np.array(names)[slots],
             "triangles": numbers(mesh.loops, "vertex_index", 1, np.int32).reshape(-1, 3)
             if all(n == 3 for n in numbers(mesh.polygons, "loop_total", 1, np.int32)) else np.zeros(0),
             "paint": of_corners(mesh, "paint"), "toughness_left": of_corners(mesh, "toughness_left")}
    found["color"], found["is_rendered"] = np.array(thing.color), np.array(not thing.hide_render)
    found["glow"] = np.array(thing.get("glow", -1.0))
    if "velocity" in mesh.attributes:
        found["velocity"] = numbers(mesh.attributes["velocity"].data, "vector", 3)
    for layer in mesh.uv_layers:
        found[f"uv {layer.name}"] = numbers(layer.data, "uv", 2)
    if hasattr(mesh, "corner_normals"):  # from 4.1 on
        found["normal"] = numbers(mesh.corner_normals, "vector", 3)
    else:
        mesh.calc_normals_split()
        found["normal"] = numbers(mesh.loops, "normal", 3)
    return found


def pick_up(how, path):
    if how == "open":
        bpy.ops.wm.open_mainfile(filepath=path)
        return
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    away = Path(path).parent / "far/away"
    away.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(away / "other.blend"))
    with bpy.data.libraries.load(path, link=how != "append", relative=True) as (there, wanted):
        wanted.collections = there.collections
    shared, = wanted.collections
    if how == "instance":
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", shared, Vector((3, 1, 2))
        bpy.context.scene.collection.objects.link(empty)
    else:
        bpy.context.scene.collection.children.link(shared)
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(away / "other.blend"))


def main(how, path, out, *frames):
    assert not hasattr(bpy.types.Object, "sunder"), "the add-on is on"
    pick_up(how, path)
    scene, found = bpy.context.scene, {}
    found["range"] = np.array([scene.frame_start, scene.frame_end, scene.render.fps])
    for frame in map(int, frames):
        scene.frame_set(frame)
        for instance in scene.view_layers[0].depsgraph.object_instances:
            if instance.object.type == "MESH":
                for field, values in read(instance).items():
                    found[f"{instance.object.name}/{frame}/{field}"] = values
    np.savez(out, **found)
    print("READ", flush=True)
    os._exit(0)


main(*sys.argv[sys.argv.index("--") + 1:])
