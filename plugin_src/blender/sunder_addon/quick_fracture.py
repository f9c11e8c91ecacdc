"""Quick Fracture: from a mesh object to a working tree, its bake and its result in one step."""
import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from . import drawing, nodes, pickers, presets, results, scene_input, tree as trees

_HOLES = 0.125  # share of the edges that may lie at holes


def add_node(tree, node_type, location):
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


def has_holes(thing):
    """Whether its surface bounds a solid but for holes: few of its edges have a face on one side alone. (Most of a sheet's.)"""
    source = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = source.to_mesh()
    edges = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("edge_index", edges)
    source.to_mesh_clear()
    faces = np.bincount(edges)
    return 0 < np.count_nonzero(faces == 1) < _HOLES * len(faces)


def build(thing, preset, pieces=100, seed=0, fall_speed=0.0, has_floor=True):
    """A tree that drops `thing` on a floor; returns it."""
    _, _, material, steps = presets.PRESETS[preset]
    tree = bpy.data.node_groups.new(f"{thing.name} Fracture", trees.SunderTree.bl_idname)
    mesh = add_node(tree, "mesh_file", (0, 0))
    mesh.source, mesh.object = pickers.OBJECT, thing
    cut = add_node(tree, "prefracture", (260, 0))
    cut.set_parameters(pieces=pieces, seed=seed)
    if has_holes(thing):
        cut.set_parameters(repair="wrap")
    body = add_node(tree, "body", (520, 0))
    body.set_parameters(velocity=(0, 0, -fall_speed), **material)
    solver = add_node(tree, "solver", (800, 0))
    solver.set_parameters(**steps)
    skin = add_node(tree, "deformer", (1080, 0))
    connect(tree, mesh, "mesh", cut, "mesh")
    connect(tree, cut, "fragments", body, "fragments")
    connect(tree, body, "body", solver, "bodies")
    connect(tree, body, "body", skin, "body")
    connect(tree, solver, "state", skin, "state")
    if has_floor:
        floor = add_node(tree, "collider", (520, 460))  # above the others, which are tall
        floor.set_parameters(shape="plane", position=(0, 0, floor_height(thing)))
        floor.name = floor.label = "Floor"
        connect(tree, floor, "collider", solver, "colliders")
    return tree


class SUNDER_OT_quick_fracture(bpy.types.Operator):
    """Cut the active mesh, give it a material, drop it on a floor and bake what happens"""

    bl_idname = "sunder.quick_fracture"
    bl_label = "Quick Fracture"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(name="Material", items=presets.items(), default="CLAY", options={"SKIP_SAVE"})
    pieces: IntProperty(name="Pieces", description="Number of fragments", min=1, max=100000, soft_max=2000, default=100)
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
        return context.object is not None and pickers.has_mesh(None, context.object) and context.mode == "OBJECT"

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

    def execute(self, context):
        thing = context.object
        tree = build(thing, self.preset, self.pieces, self.seed, self.fall_speed, self.has_floor)
        if any(n.sunder_type == "prefracture" and n.repair == "wrap" for n in tree.nodes):
            self.report({"INFO"}, f"Sunder: '{thing.name}' has holes and gets a closed skin (Repair in the pre-fracture node)")
        made = results.add_missing(tree, context.scene, self.preset)
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
