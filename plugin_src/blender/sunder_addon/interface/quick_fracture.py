"""Quick Fracture: from selected objects to a working tree, its bake and its results in one step."""
import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ..base import drawing
from ..tree import nodes, pickers, trees, verbs, wiring
from ..scene import mesh_export, scene_input
from ..results import results
from . import presets, tree_layout

_HOLES = 0.1  # larger ones are the open side of a sheet, not holes of a solid
_SHEET = 0.02  # thickness that a sheet gets, as a share of its size


def add_node(tree, node_type, location=(0, 0)):
    node = tree.nodes.new(nodes.class_name(node_type))
    node.location = location
    return node


def connect(tree, source, output, target, name):
    """Wires by the names of the library's descriptions."""
    outputs = {s.identifier: s for s in source.outputs}
    inputs = {s.identifier: s for s in target.inputs}
    return tree.links.new(outputs[output], inputs[name])


def floor_height(thing):
    """z = 0, or the object's lowest point if that lies below: what begins inside a floor bursts out of it."""
    return min(0.0, scene_input.world_bounds(thing, bpy.context.evaluated_depsgraph_get())[0].z)


def open_share(thing):
    """How large the holes of a surface are, as a share of its area: 0 if it is closed, 1 if it is a flat sheet."""
    source = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = source.to_mesh()
    around = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("edge_index", around)
    if len(around) and np.bincount(around, minlength=len(mesh.edges)).min() > 1:  # closed by index already
        source.to_mesh_clear()
        return 0.0
    mesh.calc_loop_triangles()
    positions, corners = np.empty(3 * len(mesh.vertices), np.float32), np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.vertices.foreach_get("co", positions)
    mesh.loop_triangles.foreach_get("vertices", corners)
    source.to_mesh_clear()
    # Vertices at one place are one, as the library has it: Blender makes texts of caps and walls apart.
    points, welded = np.unique(positions.reshape(-1, 3).astype(float) + 0.0, axis=0, return_inverse=True)
    triangles = welded.ravel()[corners].reshape(-1, 3)
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    edges = edges[edges[:, 0] != edges[:, 1]]
    key = edges.min(1).astype(np.int64) * len(points) + edges.max(1)  # rows as one number each: sorted ten times as quickly
    _, which, faces = np.unique(key, return_inverse=True, return_counts=True)
    follows = {int(a): int(b) for a, b in edges[faces[which.ravel()] == 1]}
    holes = 0.0
    while follows:
        rim = [next(iter(follows))]
        while rim[-1] in follows:
            rim.append(follows.pop(rim[-1]))
        loop = points[rim] - points[rim].mean(0)
        holes += np.linalg.norm(np.cross(loop[:-1], loop[1:]).sum(0)) / 2
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return holes / area if area else 0.0


def _add_body(tree, thing, solver, pieces, seed, fall_speed, material):
    """The nodes of one object, from its mesh to its deformer."""
    mesh = add_node(tree, "mesh_file")
    mesh.source, mesh.object = pickers.OBJECT, thing
    cut = add_node(tree, "prefracture")
    cut.set_parameters(pieces=pieces, seed=seed)
    share = open_share(thing)
    if 0 < share < _HOLES:
        cut.set_parameters(repair="wrap")
    elif share:
        low, high = scene_input.bounds(thing, bpy.context.evaluated_depsgraph_get())
        cut.set_parameters(thickness=float(f"{_SHEET * max(high - low):.3g}"))
    body = add_node(tree, "body")
    body.set_parameters(velocity=(0, 0, -fall_speed), **material)
    skin = add_node(tree, "deformer")
    connect(tree, mesh, "mesh", cut, "mesh")
    connect(tree, cut, "fragments", body, "fragments")
    connect(tree, body, "body", solver, "bodies")
    connect(tree, body, "body", skin, "body")
    connect(tree, solver, "state", skin, "state")
    return mesh, cut, body, skin


def build(things, preset, pieces=100, seed=0, fall_speed=0.0, has_floor=True):
    """A tree that drops an object, or several, on a floor; returns it."""
    things = things if isinstance(things, (list, tuple)) else [things]
    _, _, material, steps = presets.PRESETS[preset]
    tree = bpy.data.node_groups.new(f"{things[0].name} Fracture", trees.SunderTree.bl_idname)
    tree.preset = preset
    solver = add_node(tree, "solver")
    solver.set_parameters(**steps)
    for thing in things:
        made = _add_body(tree, thing, solver, pieces, seed, fall_speed, material)
        if len(things) > 1:
            for node in made:
                node.label = f"{thing.name}: {node.bl_label}"
    if has_floor:
        floor = add_node(tree, "collider")
        floor.set_parameters(shape="plane", position=(0, 0, min(map(floor_height, things))))
        floor.name = floor.label = "Floor"
        connect(tree, floor, "collider", solver, "colliders")
    tree_layout.arrange(tree)
    return tree


class SUNDER_OT_quick_fracture(bpy.types.Operator):
    """Cut the selected objects, give them a material, drop them on a floor and bake what happens"""

    bl_idname = "sunder.quick_fracture"
    bl_label = "Quick Fracture"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(name="Material", items=presets.items(), default="CLAY", options={"SKIP_SAVE"})
    pieces: IntProperty(name="Pieces", description="Number of fragments of each object", min=1, max=100000, soft_max=2000, default=100)
    seed: IntProperty(name="Seed", description="Chooses among cuts of the same kind", min=0)
    fall_speed: FloatProperty(
        name="Fall Speed", description="Speed downwards at the first frame", min=0, max=1000, default=10,
        unit="VELOCITY",
    )
    has_floor: BoolProperty(
        name="Floor", description="At z = 0, or at the object's lowest point if that lies below", default=True
    )
    bake: BoolProperty(name="Bake", description="Bake the scene's frame range at once", default=True)

    @classmethod
    def poll(cls, context):
        thing = context.object
        why = None
        if thing is None or thing.type not in pickers.SURFACES:
            why = "Select an object with a surface: a mesh, a text or a curve with depth"
        elif thing.sunder.tree:
            why = "This is a result already: select the object that it was made from, or change its tree"
        elif context.mode != "OBJECT":
            why = "Go to object mode first"
        if why:
            cls.poll_message_set(why)
        return why is None

    @verbs.told
    def invoke(self, context, event):
        if bpy.app.background:
            return self.execute(context)
        return context.window_manager.invoke_props_dialog(self, width=drawing.DIALOG)

    def draw(self, _context):
        column = self.layout.column()
        column.use_property_split = True
        column.prop(self, "preset")
        drawing.sentence(self.layout, presets.PRESETS[self.preset][1], "INFO", width=drawing.DIALOG)
        column = self.layout.column()
        column.use_property_split = True
        for name in ("pieces", "seed", "fall_speed", "has_floor", "bake"):
            column.prop(self, name)

    @verbs.told
    def execute(self, context):
        others = [o for o in context.selected_objects if o != context.object and pickers.has_mesh(None, o)]
        things = [context.object, *sorted(others, key=lambda o: o.name)]
        context.evaluated_depsgraph_get()  # a script may just have moved them
        for thing in things:
            mesh_export.check_scale(thing, thing.matrix_world)
        tree = build(things, self.preset, self.pieces, self.seed, self.fall_speed, self.has_floor)
        for node in tree.nodes:
            thing = wiring.upstream(node, "mesh_file").object if node.sunder_type == "prefracture" else None
            if thing and node.repair == "wrap":
                self.report({"INFO"}, f"Sunder: '{thing.name}' has holes and gets a closed skin (Repair in the pre-fracture node)")
            elif thing and node.thickness > 0:
                self.report({"INFO"}, f"Sunder: '{thing.name}' is a sheet and gets walls {node.thickness:g} m apart (Thickness in "
                            "the pre-fracture node)")
        made = results.add_missing(tree, context.scene)
        tree_layout.arrange(tree)  # deformers name what they made
        tree_layout.show(tree)
        for other in context.selected_objects:
            other.select_set(False)
        made[0].select_set(True)
        context.view_layer.objects.active = made[0]
        if not self.bake:
            return {"FINISHED"}
        how = "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"
        try:
            bpy.ops.sunder.bake(how, tree=tree.name)
        except RuntimeError as error:  # what the bake reported; the tree stays, to be mended
            self.report({"ERROR"}, str(error).removeprefix("Error: ").strip())
        return {"FINISHED"}


classes = [SUNDER_OT_quick_fracture]
