"""Draws a bake with Blender, without the add-on: mesh frames, rigid bodies, colliders, light, and a contact sheet.

    blender -b --factory-startup --python-exit-code 9 --python render_bake.py -- BAKE_DIR OUT_DIR [options]

Outer surfaces are drawn in lead grey (first mesh) and clay (further ones), break surfaces in bright orange.
"""
import argparse
import os
import signal
import subprocess
import sys
from math import radians, tan

import bpy
from mathutils import Quaternion, Vector

try:
    import numpy as np
except ImportError:
    print(f"render_bake: error: Blender's Python in {sys.prefix} has no numpy; where Blender takes the first python3 on PATH for "
          "its own (Debian's does), start it with PATH=/usr/bin:$PATH", file=sys.stderr, flush=True)
    sys.exit(3)

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import blender_versions  # noqa: E402
from bake_reader import Bake, BakeError, read_ply  # noqa: E402

OUTER_COLORS = [(0.30, 0.33, 0.38), (0.46, 0.20, 0.11), (0.27, 0.42, 0.40), (0.50, 0.44, 0.28)]  # linear RGB
INNER_COLOR = (1.0, 0.42, 0.03)
RIGID_COLOR = (0.07, 0.08, 0.10)
COLLIDER_COLOR = (0.20, 0.23, 0.30)
FLOOR_COLOR = (0.42, 0.43, 0.45)
LABEL_FONT = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf"


def arguments():
    parser = argparse.ArgumentParser(prog="render_bake.py")
    parser.add_argument("bake")
    parser.add_argument("out")
    parser.add_argument("--frames", help="numbers and ranges, as 1,5,10:20 (default: 12, most of them where most breaks)")
    parser.add_argument("--sheet", help="write a contact sheet of the rendered frames to this PNG")
    parser.add_argument("--inputs", default=".", help="folder that mesh files of the graph are seen from (default: the one at work)")
    parser.add_argument("--width", type=int, default=640, help="pixels; the picture is 16:9")
    parser.add_argument("--engine", choices=["cycles", "eevee", "workbench"], default="cycles")
    parser.add_argument("--samples", type=int, default=24, help="light paths per pixel")
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])


def telling_frames(bake, count=12):
    """Frames at equal shares of what happens: half of it is time that passes, half is edges that break."""
    broken = np.array([bake.edges_broken(f) for f in bake.frames], float)
    happens = 1 / len(broken) + broken / max(broken.sum(), 1)
    done = np.cumsum(happens) - happens[0]
    count = min(count, len(broken))
    picked = np.searchsorted(done, np.linspace(0, done[-1], count) - 1e-9)
    for i in range(1, count):  # no frame twice
        picked[i] = max(picked[i], picked[i - 1] + 1)
    return [bake.frames[i] for i in np.minimum(picked, len(broken) - count + np.arange(count))]


def chosen_frames(text, bake):
    there = bake.frames
    if not text:
        return telling_frames(bake)
    frames = []
    for part in text.split(","):
        first, _, last = part.partition(":")
        frames += range(int(first), int(last or first) + 1)
    missing = sorted(set(frames) - set(there))
    if missing:
        raise BakeError(f"frames {missing} are not in the bake, which has {there[0]} to {there[-1]}")
    return frames


def material(name, color, roughness=0.6, metallic=0.0):
    made = bpy.data.materials.new(name)
    blender_versions.turn_on_nodes(made)
    made.diffuse_color = (*color, 1)  # what Workbench shows
    made.roughness, made.metallic = roughness, metallic
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Metallic"].default_value = metallic
    return made


def add_object(name, mesh, *materials):
    for m in materials:
        mesh.materials.append(m)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def write_mesh(mesh, positions, triangles, corner_normals, face_material):
    """Replaces the geometry of `mesh`; materials stay. Corners must be given as float32 and int32."""
    blender_versions.replace_triangles(mesh, positions, triangles)
    mesh.polygons.foreach_set("material_index", face_material)
    blender_versions.write_corner_normals(mesh, corner_normals)


def solid_mesh(node, name):
    """The shape of a rigid body or collider about its own origin; None for a mesh file that is not found."""
    import bmesh
    shape, mesh = bmesh.new(), bpy.data.meshes.new(name)
    kind, radius = node.get("shape", "sphere"), node.get("radius", 0.5)
    if kind == "box":
        bmesh.ops.create_cube(shape, size=1)
        bmesh.ops.scale(shape, vec=Vector(node.get("size", (1, 1, 1))), verts=shape.verts)
    elif kind == "mesh":
        file = node.get("path", "")
        if not os.path.isfile(file):
            return None
        read_solid(file, shape)
        bmesh.ops.scale(shape, vec=Vector((1, 1, 1)) * node.get("scale", 1.0), verts=shape.verts)
    else:
        bmesh.ops.create_uvsphere(shape, u_segments=64, v_segments=32, radius=radius)
        for vertex in shape.verts if kind == "capsule" else ():
            vertex.co.z += (node.get("height", 1.0) / 2) * (1 if vertex.co.z > -1e-9 * radius else -1)
        for face in shape.faces:
            face.smooth = True
    shape.to_mesh(mesh)
    shape.free()
    return mesh


def read_solid(file, shape):
    """A PLY file (binary, as bakes from Blender hold their inputs) or an OBJ file, z up, into a BMesh."""
    if file.lower().endswith(".obj"):
        before = set(bpy.data.objects)
        bpy.ops.wm.obj_import(filepath=file, forward_axis="Y", up_axis="Z")
        for thing in set(bpy.data.objects) - before:
            shape.from_mesh(thing.data)
            bpy.data.objects.remove(thing)
        return
    ply, mesh = read_ply(file), bpy.data.meshes.new("solid")
    points = np.stack([ply["vertex"][n] for n in "xyz"], 1)
    mesh.from_pydata(points.tolist(), [], ply["face"]["vertex_indices"].tolist())
    shape.from_mesh(mesh)
    bpy.data.meshes.remove(mesh)


def add_colliders(bake, inputs, distance):
    """[(node, object)]: planes as wide floors, all others as the solids that they are, where their files are found."""
    floor, wall = material("floor", FLOOR_COLOR, 0.9), material("collider", COLLIDER_COLOR, 0.8)
    made = []
    for node in bake.colliders:
        if node.get("shape", "plane") == "plane":
            mesh, s = bpy.data.meshes.new("floor"), 20 * distance
            mesh.from_pydata([(-s, -s, 0), (s, -s, 0), (s, s, 0), (-s, s, 0)], [], [(0, 1, 2, 3)])
            made.append((node, add_object("floor", mesh, floor)))
            continue
        places = [os.path.join(folder, node.get("path", "")) for folder in (bake.folder, inputs)]
        file = next((p for p in places if os.path.isfile(p)), "")
        mesh = solid_mesh({**node, "path": file}, "collider")
        if mesh is None:
            told = f"{node['path']} is not in {inputs} (name its folder with --inputs)" if node.get("path") else "its mesh is wired"
            print(f"render_bake: warning: a collider is not drawn: {told}", file=sys.stderr, flush=True)
        else:
            made.append((node, add_object("collider", mesh, wall)))
    return made


def place(thing, position, degrees):
    thing.location, thing.rotation_euler = Vector(position), [radians(a) for a in degrees]


def floor_height(bake):
    """Of the first plane that lies flat, at the first frame."""
    for node in bake.colliders:
        position, rotation = bake.collider_pose(node, bake.frames[0])
        if node.get("shape", "plane") == "plane" and not any(rotation):
            return position[2]
    return 0.0


def subject_box(bake, frames):
    """What the camera must see: the bodies whole at first, later most of them (5th to 95th percentile), but nothing
    farther than a seventh of their size from where they began: a few pieces that fly off must not make the rest small."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for pattern in bake.meshes:
        positions = bake.mesh_frame(pattern, bake.frames[0])[0]
        low, high = np.minimum(low, positions.min(0)), np.maximum(high, positions.max(0))
    reach = np.linalg.norm(high - low) / 7
    nearest, farthest = low - reach, high + reach
    for frame in {frames[len(frames) // 2], frames[-1]}:
        for pattern in bake.meshes:
            most = np.percentile(bake.mesh_frame(pattern, frame)[0], (5, 95), axis=0)
            low, high = np.minimum(low, most[0]), np.maximum(high, most[1])
        for node, position in zip(bake.rigid_bodies, bake.rigid_body_poses(frame)[0]):
            high[2] = max(high[2], position[2] + node.get("radius", 0.5))
    low, high = np.maximum(low, nearest), np.minimum(high, farthest)
    high[2] += 0.12 * (high[2] - low[2])  # room for what falls from above
    return low, high


def add_camera(low, high):
    """Looks down from the front (-Y) and stands just far enough back for the whole box."""
    scene = bpy.context.scene
    data = bpy.data.cameras.new("camera")
    data.lens = 60
    camera = bpy.data.objects.new("camera", data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.rotation_mode = "QUATERNION"
    view = Vector((0.0, 1.0, -0.38)).normalized()
    camera.rotation_quaternion = view.to_track_quat("-Z", "Y")
    right, up = camera.rotation_quaternion @ Vector((1, 0, 0)), camera.rotation_quaternion @ Vector((0, 1, 0))
    half_width = tan(data.angle / 2)
    half_height = half_width * scene.render.resolution_y / scene.render.resolution_x
    center = Vector((low + high) / 2)
    corners = [Vector((x, y, z)) - center for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    distance = max(max(abs(c.dot(right)) / half_width, abs(c.dot(up)) / half_height) - c.dot(view) for c in corners)
    camera.location = center - 1.04 * distance * view
    data.clip_end = 100 * distance
    return distance


def add_light(low, high, distance):
    """A large soft key light from the left, a weak fill from the right, and a bright even sky."""
    center = Vector((low + high) / 2)
    for name, place, size, power in (("key", (-0.9, -0.8, 1.3), 0.5, 26), ("fill", (1.2, -0.9, 0.5), 1.0, 3)):
        data = bpy.data.lights.new(name, "AREA")
        data.size = size * distance
        data.energy = power * distance ** 2
        light = bpy.data.objects.new(name, data)
        light.location = center + Vector(place) * distance
        light.rotation_euler = (center - light.location).to_track_quat("-Z", "Y").to_euler()
        bpy.context.scene.collection.objects.link(light)
    world = bpy.data.worlds.new("world")
    blender_versions.turn_on_nodes(world)
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.80, 0.86, 0.95, 1)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.25
    bpy.context.scene.world = world


def set_engine(options):
    scene = bpy.context.scene
    scene.render.resolution_x = options.width
    scene.render.resolution_y = options.width * 9 // 16
    scene.render.image_settings.file_format = "PNG"
    scene.view_settings.view_transform = "Filmic"
    scene.view_settings.look = "Medium High Contrast"
    if options.engine == "cycles":
        scene.render.engine = "CYCLES"
        scene.cycles.samples = options.samples
        scene.cycles.use_denoising = False  # Debian's Blender is built without the denoiser
        scene.cycles.max_bounces = 3
        scene.cycles.seed = 1
        scene.render.use_persistent_data = True
    elif options.engine == "eevee":
        blender_versions.set_eevee(scene)
        scene.eevee.taa_render_samples = options.samples
    else:
        scene.render.engine = "BLENDER_WORKBENCH"
        shading = scene.display.shading
        shading.light, shading.color_type = "STUDIO", "MATERIAL"
        shading.show_cavity = shading.show_shadows = True
        shading.cavity_type = "BOTH"


def contact_sheet(pictures, path):
    command = ["montage", "-font", LABEL_FONT, "-pointsize", "18", "-fill", "#dddddd", "-background", "#202226"]
    for frame, picture in pictures:
        command += ["-label", f"frame {frame}", picture]
    columns = min(3 if len(pictures) <= 9 else 4, len(pictures))
    subprocess.run([*command, "-tile", f"{columns}x", "-geometry", "+4+4", path], check=True)


def main():
    options = arguments()
    bake = Bake(options.bake)
    frames = chosen_frames(options.frames, bake)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    set_engine(options)
    low, high = subject_box(bake, frames)
    low[2] = min(low[2], floor_height(bake))
    distance = add_camera(low, high)
    add_light(low, high, distance)

    inner = material("inside", INNER_COLOR, 0.7)
    bodies = []
    for i, pattern in enumerate(bake.meshes):
        mesh = bpy.data.meshes.new(pattern)
        outer = material(f"outside {i}", OUTER_COLORS[i % len(OUTER_COLORS)], 0.5)
        bodies.append((pattern, add_object(pattern, mesh, outer, inner), bake.interior_material(pattern)))
    iron = material("iron", RIGID_COLOR, 0.35, 0.6)
    if bake.rigid_bodies and not bake.states:
        print("rigid bodies are not drawn: where they are stands in states, which this bake has none of (bake_state)")
    weights = [add_object("rigid body", solid_mesh(node, "rigid body"), iron) for node in bake.rigid_bodies if bake.states]
    colliders = add_colliders(bake, options.inputs, distance)

    os.makedirs(options.out, exist_ok=True)
    pictures = []
    for frame in frames:
        for pattern, body, interior in bodies:
            positions, triangles, normals, face_material, _ = bake.mesh_frame(pattern, frame)
            write_mesh(body.data, positions, triangles, normals, (face_material >= interior).astype(np.int32))
        for weight, position, orientation in zip(weights, *bake.rigid_body_poses(frame)):
            weight.rotation_mode = "QUATERNION"
            weight.location, weight.rotation_quaternion = Vector(position), Quaternion(orientation)
        for node, thing in colliders:
            place(thing, *bake.collider_pose(node, frame))
        picture = os.path.join(options.out, f"frame_{frame:04d}.png")
        bpy.context.scene.render.filepath = os.path.abspath(picture)
        bpy.ops.render.render(write_still=True)
        pictures.append((frame, picture))
        print(f"render_bake: frame {frame}", flush=True)
    if options.sheet:
        contact_sheet(pictures, options.sheet)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Blender's own handler in background mode ignores Ctrl-C
    try:
        main()
    except BakeError as error:
        print(f"render_bake: error: {error}", file=sys.stderr, flush=True)
        sys.exit(3)
