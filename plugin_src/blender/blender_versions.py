"""What differs between versions of Blender, 3.4 to 5.2: every interface that came, went or changed is used here alone.

Each function tells which versions have what. What a later Blender removes is to be met here, too: callers get what they ask
for, or None, never an exception about a name (tests/blender/test_versions.py holds them to it).
"""
import gc

import bmesh
import bpy
import numpy as np

NEWEST = (5, 2)  # the last that Sunder was tried in
# An attribute of vectors counts as normals of corners from 4.5 on: written in 2 ms where the call takes a second.
HAS_QUICK_NORMALS = bpy.app.version >= (4, 5, 0)
# Where Cycles takes one normal of each point but splits points at sharp edges; normals by attribute mark none.
HAS_SPLITTING_CYCLES = (4, 5, 0) <= bpy.app.version < (5, 2, 0)
# Names that a Principled BSDF's sockets have, or had: the first that is there.
TRANSMISSION = ("Transmission Weight", "Transmission")  # 4.0 and later; before


def corner_normals(mesh):
    """(corners, 3) f32."""
    if hasattr(mesh, "corner_normals"):  # 4.1 and later
        return _read(mesh.corner_normals, "vector")
    mesh.calc_normals_split()  # gone in 4.1
    return _read(mesh.loops, "normal")


def _read(sequence, attribute):
    array = np.empty(3 * len(sequence), np.float32)
    sequence.foreach_get(attribute, array)
    return array.reshape(-1, 3)


def write_corner_normals(mesh, normals, set_property=setattr):
    """Makes `normals` (corners, 3), unit vectors, what renders and viewports show. `set_property`: how properties are set."""
    if getattr(mesh, "use_auto_smooth", True) is False:  # the switch for them, until 4.0
        set_property(mesh, "use_auto_smooth", True)
    if HAS_QUICK_NORMALS:
        attribute = mesh.attributes.get("custom_normal")
        if attribute is not None and (attribute.data_type, attribute.domain) != ("FLOAT_VECTOR", "CORNER"):
            mesh.attributes.remove(attribute)  # normals as the call of before writes them
            attribute = None
        attribute = attribute or mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
        attribute.data.foreach_set("vector", np.ascontiguousarray(normals, np.float32).ravel())
        _mark_sharp_edges(mesh, normals)
        return
    was_collecting = gc.isenabled()
    gc.disable()  # a list for each corner, and no cycle among them: looking for one would take longer than the rest
    try:
        mesh.normals_split_custom_set(normals.tolist())
    finally:
        if was_collecting:
            gc.enable()


def _mark_sharp_edges(mesh, normals):
    """Of a closed mesh of triangles: edges at one of whose ends the normals (corners, 3) of its two faces differ."""
    if not HAS_SPLITTING_CYCLES or "sharp_edge" in mesh.attributes:  # gone where faces are new
        return
    vertex, edge = np.empty(len(mesh.loops), np.int32), np.empty(len(mesh.loops), np.int32)
    mesh.attributes[".corner_vert"].data.foreach_get("value", vertex)  # as attributes in a tenth of the time
    mesh.attributes[".corner_edge"].data.foreach_get("value", edge)  # to the next corner of the face
    normals, corner = np.asarray(normals, np.float32), np.arange(len(vertex), dtype=np.int32)
    here, there = np.zeros(len(mesh.edges), np.int32), np.zeros(len(mesh.edges), np.int32)
    here[edge], there[edge[::-1]] = corner, corner[::-1]  # the last and the first corner of each edge: of its two faces
    after = (corner.reshape(-1, 3)[:, [1, 2, 0]]).ravel()
    turned = vertex[here] == vertex[there]  # both faces go along it the same way
    begin, end = np.where(turned, there, after[there]), np.where(turned, after[there], there)

    def differ(a, b):
        return np.abs(normals[a] - normals[b]).max(1) > 1e-3

    sharp = differ(here, begin) | differ(after[here], end)
    mesh.attributes.new("sharp_edge", "BOOLEAN", "EDGE").data.foreach_set("value", sharp)


def let_normals_count(mesh):
    """What a modifier reads of normals is what renders and viewports show; a switch until 4.0."""
    if hasattr(mesh, "use_auto_smooth"):
        mesh.use_auto_smooth = True


def keeps_corner_normals(mesh):
    """Whether only new geometry brings back normals that Blender works out: before 4.5 it drops written ones in no other way,
    and keeps and works out even those that are set to nothing."""
    return not HAS_QUICK_NORMALS and mesh.has_custom_normals


def clear_corner_normals(mesh):
    """Back to normals that Blender works out, of a mesh that does not keep the others."""
    for name in ("custom_normal", "sharp_edge") if HAS_QUICK_NORMALS else ():
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            mesh.attributes.remove(attribute)


def is_of_geometry(name):
    """Whether an attribute of that name says what a mesh's geometry is: from 3.5 on more and more of it stands among the
    artist's. Names that begin with a dot are Blender's own; creases and bevel weights are for modifiers."""
    return name.startswith(".") or name in {
        "position", "material_index", "sharp_face", "crease_vert", "bevel_weight_vert", "freestyle_face",
    } or HAS_QUICK_NORMALS and name == "custom_normal"


def copy_geometry(source, target, set_property=setattr):
    """Replaces the geometry of a mesh, with all that its points, edges, corners and faces have, to the bit. `set_property`:
    how properties are set."""
    whole = bmesh.new()
    try:
        whole.from_mesh(source, face_normals=False, vertex_normals=False)
        whole.to_mesh(target)
    finally:
        whole.free()
    if hasattr(target, "use_auto_smooth"):  # the switch for custom normals, until 4.0
        set_property(target, "use_auto_smooth", source.has_custom_normals)


def _write(quick, slow, values):
    """foreach_set by an attribute where there is one: in 0.3 ms what takes 20 to 80 by items. Both: (sequence, name)."""
    sequence, name = quick or slow
    sequence.foreach_set(name, np.ascontiguousarray(values).ravel())


def write_positions(mesh, positions):
    """(vertices, 3) f32; as an attribute from 3.5 on."""
    attribute = mesh.attributes.get("position")
    _write(attribute and (attribute.data, "vector"), (mesh.vertices, "co"), positions)


def write_uvs(layer, uvs):
    """(corners, 2) f32 of a UV map; as an attribute from 3.5 on."""
    _write((layer.uv, "vector") if hasattr(layer, "uv") else None, (layer.data, "uv"), uvs)


def write_selection(mesh, faces, edges, vertices):
    """What is selected, bool. As attributes from 3.5 on. Where 5.0 makes edges, it makes that of edges of pairs of numbers, and
    crashes where one is selected."""
    parts = ((".select_poly", "FACE", mesh.polygons, faces), (".select_edge", "EDGE", mesh.edges, edges),
             (".select_vert", "POINT", mesh.vertices, vertices))
    for name, domain, items, values in parts:
        if bpy.app.version < (3, 5, 0):
            items.foreach_set("select", values)
        else:
            attribute = mesh.attributes.get(name)
            if attribute is not None and attribute.data_type != "BOOLEAN":
                mesh.attributes.remove(attribute)
                attribute = None
            attribute = attribute or mesh.attributes.new(name, "BOOLEAN", domain)
            attribute.data.foreach_set("value", values)


def replace_triangles(mesh, positions, triangles):
    """Makes a mesh smooth triangles, (t, 3) int32, and nothing else; materials stay.

    Polygon i has corners 3i to 3i + 2: their number is written until 3.5; later it follows from where they start. Corners are
    an attribute from 3.6 on. What is not said to be sharp is smooth from 4.1 on.
    """
    mesh.clear_geometry()
    fill_with_triangles(mesh, positions, triangles)


def fill_with_triangles(mesh, positions, triangles):
    """As replace_triangles, of a mesh that is empty: what attributes it has it keeps, of what is new."""
    n = len(triangles)
    mesh.vertices.add(len(positions))
    mesh.loops.add(3 * n)
    mesh.polygons.add(n)
    attribute = mesh.attributes.get(".corner_vert")
    _write(attribute and (attribute.data, "value"), (mesh.loops, "vertex_index"), triangles)
    if bpy.app.version < (4, 1, 0):
        mesh.polygons.foreach_set("use_smooth", np.ones(n, bool))
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * n, 3, dtype=np.int32))
    if not bpy.types.MeshPolygon.bl_rna.properties["loop_total"].is_readonly:
        mesh.polygons.foreach_set("loop_total", np.full(n, 3, np.int32))
    write_positions(mesh, positions)
    mesh.update(calc_edges=True)


def has_nodes(thing):
    """Whether the nodes of a material or world count. From 5.0 on they do always, and the switch is to go in 6.0."""
    return thing.node_tree is not None and (bpy.app.version >= (5, 0, 0) or thing.use_nodes)


def turn_on_nodes(thing):
    if bpy.app.version < (5, 0, 0):
        thing.use_nodes = True


def turn_on_refraction(material):
    """EEVEE shows what lies behind: a switch of its own until 4.1, another one from 4.2 on."""
    for switch in ("use_screen_space_refraction", "use_raytrace_refraction"):
        if hasattr(material, switch):
            setattr(material, switch, True)


def set_eevee(scene):
    """EEVEE with what shadows and occlusion it has a switch for: until 4.1."""
    try:
        scene.render.engine = "BLENDER_EEVEE"
    except TypeError:
        scene.render.engine = "BLENDER_EEVEE_NEXT"  # 4.2 to 4.4
    for name in ("use_gtao", "use_soft_shadows"):
        if hasattr(scene.eevee, name):
            setattr(scene.eevee, name, True)


def set_motion_blur(scene, shutter):
    """Motion blur of renders, `shutter` in frames: EEVEE has settings of its own until 4.1."""
    for owner in (scene.render, scene.eevee):
        if hasattr(owner, "use_motion_blur"):
            owner.use_motion_blur, owner.motion_blur_shutter = True, shutter


def socket_color(color):
    """{name: what a class of sockets has} for the colour of its wires: of the class from 4.0 on, of each socket before."""
    if bpy.app.version >= (4, 0, 0):
        return {"draw_color_simple": classmethod(lambda cls: color)}
    return {"draw_color": lambda self, _context, _node: color}


def describe_socket(socket, sentence):
    """What a socket's tooltip says: 3.4 has one, later versions again from 4.1."""
    if hasattr(socket, "description"):
        socket.description = sentence


def text_size(points):
    """Arguments of blf.size after the font: with a resolution until 3.x."""
    return (points,) if bpy.app.version >= (4, 0, 0) else (int(points), 72)


def flat_color_shader_in_space():
    """Name of the built-in shader for coloured shapes in the scene."""
    return "FLAT_COLOR" if bpy.app.version >= (4, 0, 0) else "3D_FLAT_COLOR"


def flat_color_shader():
    """(name, number of coordinates) of the built-in shader for coloured shapes on the screen."""
    return ("FLAT_COLOR", 3) if bpy.app.version >= (4, 0, 0) else ("2D_FLAT_COLOR", 2)


def curves_of(user):
    """The curves by which animation data or a strip animates. From 4.4 on an action has slots, each for one user; from 5.0 on
    curves are there alone."""
    action = user.action
    if action is None:
        return []
    slot = getattr(user, "action_slot", None)
    if slot is None:
        return list(getattr(action, "fcurves", ()))
    bags = [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]
    return [c for bag in bags if bag.slot_handle == slot.handle for c in bag.fcurves]


def has_operator(group, name):
    """Whether an operator is there: some builds lack exporters, and versions drop them."""
    return name in dir(getattr(bpy.ops, group))


def light_collections(thing):
    """Collections that an object's light is linked to; from 4.0 on."""
    linking = getattr(thing, "light_linking", None)
    found = (linking.receiver_collection, linking.blocker_collection) if linking else ()
    return [collection for collection in found if collection is not None]


def clear_light_collections(thing):
    if light_collections(thing):
        thing.light_linking.receiver_collection = thing.light_linking.blocker_collection = None


def new_geometry_nodes(name):
    """(Node group of a modifier, its input's and its output's socket). Sockets are the group's interface's from 4.0 on."""
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    if hasattr(group, "interface"):
        for direction in ("INPUT", "OUTPUT"):
            group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    else:
        for sockets in (group.inputs, group.outputs):
            sockets.new("NodeSocketGeometry", "Geometry")
    return group, group.nodes.new("NodeGroupInput").outputs[0], group.nodes.new("NodeGroupOutput").inputs[0]
