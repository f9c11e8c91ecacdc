"""Writes a frame of a bake into a Blender mesh: geometry, normals, UVs, materials, attributes."""
import contextlib
import hashlib
import threading
import time

import bpy
import numpy as np

from ..base import bake_reader, blender_versions, runtime

_PATIENCE, _PAUSE = 500, 0.004  # tries, and s between them


def set_property(thing, name, value):
    """thing.name = value, or thing["name"] for names that start with "sunder".

    While Blender's main thread draws a panel, properties cannot be written, not even by the thread in which an
    animation is rendered: that one waits for its turn.
    """
    tries = 1 if threading.current_thread() is threading.main_thread() else _PATIENCE
    while True:
        try:
            if name.startswith("sunder"):
                thing[name] = value
            else:
                setattr(thing, name, value)
            return
        except AttributeError as error:
            tries -= 1
            if tries == 0 or "not allowed" not in str(error):
                raise
            time.sleep(_PAUSE)


_STAGE = "Sunder stage"  # a mesh that nothing uses, empty but for moments: files do not keep it


def is_local(mesh):
    """Whether a mesh is this file's own, neither linked nor the override of one that is."""
    return mesh.library is None and mesh.override_library is None


@contextlib.contextmanager
def written(mesh):
    """What to write a frame into: the mesh itself. Blender drops arrays that are written into one that is not local, but a
    whole mesh arrives: what is to be there is written into a local one, empty at first, and copied in the end."""
    if is_local(mesh):
        yield mesh
        return
    stage = bpy.data.meshes.get((_STAGE, None)) or bpy.data.meshes.new(_STAGE)
    stage.clear_geometry()
    try:
        yield stage
        blender_versions.copy_geometry(stage, mesh, set_property)
        if (len(mesh.vertices), len(mesh.loops)) != (len(stage.vertices), len(stage.loops)):
            raise bake_reader.BakeError(f"mesh '{mesh.name}' is linked, and this Blender drops what is written into it: "
                                        "make object and mesh local")
    finally:
        stage.clear_geometry()


def stage_object(stage):
    """An object of the mesh that `written` gives in place of a linked one: weights are written through objects."""
    thing = bpy.data.objects.get((_STAGE, None)) or bpy.data.objects.new(_STAGE, stage)
    if thing.data != stage:
        thing.data = stage
    return thing


def drop_stage_object():
    """Before a file is saved: the mesh would count as used, and be kept."""
    thing = bpy.data.objects.get((_STAGE, None))
    if thing is not None:
        bpy.data.objects.remove(thing)


def _foreach(sequence, attribute, values):
    sequence.foreach_set(attribute, np.ascontiguousarray(values).ravel())


FACES = "sunder_faces"  # on the mesh, so that undo and files carry it along: what its faces were written from


def face_stamp(frame, source, *names, mesh_name=""):
    """Of all that faces and their corners have but normals, and of rest positions; equal stamps, equal faces. `source`: hash of
    the file that they come from; `names`: what else they are written from, slots and layers. Most frames have the faces of
    the frame before: where mesh `mesh_name` was stamped last with the same ones, that stamp stays."""
    layers = [(layer.name, layer.domain, layer.kind) for layer in frame.mesh_layers]
    names = repr((len(frame.positions), names, *layers))
    parts = (frame.triangles, frame.material, frame.fragment, frame.hidden, frame.uvs, frame.interface, frame.rim,
             frame.colors, frame.rest, *(layer.values for layer in frame.mesh_layers))
    known_names, known_parts, stamp = runtime.face_stamps.get(mesh_name, ("", (), ""))
    if names != known_names or not all(_is_same(a, b) for a, b in zip(parts, known_parts)):
        stamp = f"{source} {hashlib.blake2b(names.encode(), digest_size=16).hexdigest()}"
        runtime.face_stamps[mesh_name] = names, parts, stamp
    return stamp


def _is_same(a, b):
    return a is None and b is None or a is not None and b is not None and np.array_equal(a, b)


def write_geometry(mesh, frame, stamp=""):
    """Replaces the geometry; positions alone are written where the faces are those of `stamp` already, and then False
    is returned: what faces and corners have is still there. Materials stay."""
    n = len(frame.triangles)
    counts = (len(mesh.vertices), len(mesh.loops), len(mesh.polygons))
    if stamp and mesh.get(FACES) == stamp and counts == (len(frame.positions), 3 * n, n):
        blender_versions.write_positions(mesh, frame.positions)
        mesh.update()
        return False
    set_property(mesh, FACES, "")  # until all is written
    blender_versions.replace_triangles(mesh, frame.positions, frame.triangles)
    return True


def write_normals(mesh, corner_normals):
    """The library's normals: smooth outside, sharp at break surfaces. None: as Blender works them out."""
    if corner_normals is None:
        blender_versions.clear_corner_normals(mesh)
    else:
        blender_versions.write_corner_normals(mesh, corner_normals, set_property)


def write_uvs(mesh, uvs, name):
    if uvs is None:
        return
    layer = mesh.uv_layers.get(name) or mesh.uv_layers.new(name=name, do_init=False)
    blender_versions.write_uvs(layer, uvs)


def write_materials(mesh, material, interior, interior_slot):
    """Outer faces keep their slot; break surfaces (material `interior` of the bake and above) get the interior one."""
    slots = np.where(material >= interior, interior_slot, np.minimum(material, max(interior_slot - 1, 0)))
    if "material_index" in mesh.attributes or mesh.attributes.new("material_index", "INT", "FACE").name == "material_index":
        write_attribute(mesh, "material_index", "INT", "FACE", slots.astype(np.int32))  # 25 times as quick as by polygons
    else:
        _foreach(mesh.polygons, "material_index", slots.astype(np.int32))


def write_attribute(mesh, name, kind, domain, values):
    """kind: of Blender's types those that mesh_layers.py writes, among them INT, FLOAT, BOOLEAN, FLOAT_VECTOR and FLOAT_COLOR,
    or BYTE_COLOR (in: linear floats); domain: POINT, FACE or CORNER."""
    attribute = mesh.attributes.get(name)
    if attribute is not None and (attribute.data_type != kind or attribute.domain != domain):
        mesh.attributes.remove(attribute)
        attribute = None
    attribute = attribute or mesh.attributes.new(name, kind, domain)
    if attribute is None:  # a name that Blender keeps for itself
        return
    fields = {"FLOAT2": "vector", "FLOAT_VECTOR": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color"}
    _foreach(attribute.data, fields.get(kind, "value"), values)


def fragment_damage(state, body):
    """Of each particle of a body, 0 to 1: the mean damage of its edges, those that broke being 1. state: elements of a state frame."""
    mine = state["particle"]["body"] == body
    edge = state["edge"]
    fading = state["damage"]["damage"] if len(state.get("damage", ())) else 0.0
    damage = np.where(edge["intact"] != 0, fading, 1.0)
    ends = np.concatenate([edge["a"], edge["b"]]).astype(np.int64)
    edges = np.bincount(ends, minlength=len(mine))
    return (np.bincount(ends, np.tile(damage, 2), len(mine)) / np.maximum(edges, 1))[mine]


def state_attributes(state, body, frame, toughness=None):
    """{name: (kind, values)} a vertex, from the particle that it follows first.

    state: elements of a state frame; body: number of the mesh's body in it; toughness: its own at that frame, or of each of its
    particles, None for never. Strain is the largest principal elastic logarithmic strain, toughness left what is missing to the toughness, as a
    share of it; damage is that of the fragment's edges; plastic strain sqrt(2/3) |ln U| of the plastic deformation, U its stretch; velocity in m/s is
    the frame file's; where that has none, of the particle's rigid motion at the vertex. Acceleration in m/s2 is there where the
    file has it.
    """
    own = state["particle"][state["particle"]["body"] == body]
    particle = np.empty(int(own["fragment"].max(initial=0)) + 1, np.int64)
    particle[own["fragment"]] = np.arange(len(own))
    follows = particle[frame.vertex_fragment]
    at_vertex = frame.velocities
    if at_vertex is None:
        center, velocity, spin = (np.stack([own[p + n] for n in "xyz"], 1)[follows] for p in ("", "v", "w"))
        at_vertex = (velocity + np.cross(spin, frame.positions - center)).astype(np.float32)
    plastic = np.stack([own[f"fp{i}{j}"] for i in range(3) for j in range(3)], 1).reshape(-1, 3, 3)
    squared = np.linalg.eigvalsh(np.swapaxes(plastic, 1, 2) @ plastic)
    log_stretch = np.log(np.maximum(squared, 1e-30)) / 2
    plastic_strain = np.sqrt(2 / 3) * np.linalg.norm(log_stretch, axis=1)
    strain = own["strain"][follows]
    share = 0 if toughness is None else own["strain"] / toughness
    left = np.broadcast_to(1 - np.clip(share, 0, 1), len(own))[follows]
    accelerations = {} if frame.accelerations is None else {"acceleration": ("FLOAT_VECTOR", frame.accelerations)}
    return {
        "velocity": ("FLOAT_VECTOR", at_vertex),
        **accelerations,
        "strain": ("FLOAT", strain.astype(np.float32)),
        "toughness_left": ("FLOAT", left.astype(np.float32)),
        "damage": ("FLOAT", fragment_damage(state, body)[follows].astype(np.float32)),
        "plastic_strain": ("FLOAT", plastic_strain[follows].astype(np.float32)),
    }
