"""Exports of a bake: by the library (USD, glTF, point caches, sequences), or by Blender's own exporters where it has them."""
import os

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..base import blender_versions, core
from ..tree import trees, verbs
from ..bake import cache, looks
from ..results import parts, player

HOST_FORMATS = {"ABC": ("alembic_export", ".abc"), "USD": ("usd_export", ".usdc")}


def host_formats():
    """Formats that this Blender was built with: some builds have neither."""
    return [name for name, (operator, _) in HOST_FORMATS.items() if blender_versions.has_operator("wm", operator)]


class SUNDER_OT_export(verbs.OnTree, bpy.types.Operator, ExportHelper):
    """Write what is baked as a file that other programs read"""

    bl_idname = "sunder.export"
    bl_label = "Export Bake"

    filename_ext = ".usda"
    check_extension = None  # the ending tells the format
    filter_glob: StringProperty(default="*.usda;*.glb;*.pc2;*.ply;*.obj", options={"HIDDEN"})
    node: StringProperty(
        name="Node", description="Name of a deformer or bake node in the bake; empty: all meshes", options={"SKIP_SAVE"},
    )
    tolerance: FloatProperty(
        name="Tolerance", default=0.005, min=0, soft_max=0.1, precision=4,
        description="glTF: how far vertices may be from their rigid fragments, as a share of their body's size",
    )
    overwrite: BoolProperty(name="Overwrite", default=True, options={"SKIP_SAVE"})

    @verbs.told
    def execute(self, context):
        tree = self.find(context)
        if tree is None:
            return {"CANCELLED"}
        folder = cache.folder(tree)
        manifest = cache.manifest(folder)
        is_ours = tree.library is None and not cache.is_elsewhere(tree) and not cache.is_anothers(tree)
        if manifest and is_ours:  # in another file's bake nothing is written
            try:
                looks.write(tree, folder)
            except OSError as error:
                self.report({"WARNING"}, f"names and materials may be old: {error.filename or folder}: {error.strerror}")
        known = manifest.graph["nodes"] if manifest else {}
        node = next((n for n in (f"{self.node}:bake", self.node) if n in known), self.node)
        try:
            package = core.sunder()
        except core.Unusable as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        try:
            done = package.export(folder, bpy.path.abspath(self.filepath), node=node or None, tolerance=self.tolerance,
                                  overwrite=self.overwrite)
        except package.Error as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        notes = [done["note"]] if done["note"] else []
        if any(str(file).endswith(".usda") for file in done["files"]):
            notes.append("imported by Blender itself, break surfaces have the outer material; 0 or more in 'interface' tells them")
        self.report({"INFO"}, "; ".join([f"Sunder: {len(done['files'])} files exported", *notes]))
        return {"FINISHED"}


class _OnResults(verbs.OnTree):
    def results(self, context):
        """The tree's result objects in the scene; [] and a report if there are none."""
        tree = self.find(context)
        things = [t for t in trees.result_objects(tree) if context.scene in t.users_scene] if tree else []
        if tree and not things:
            self.report({"ERROR"}, "the tree has no result object in this scene")
        return things


class SUNDER_OT_split_inside(_OnResults, bpy.types.Operator):
    """Make the break surfaces of result objects objects of their own. Exporters write at the first frame alone which faces
    have which material, and break surfaces are not there yet; an object of one material keeps it"""

    bl_idname = "sunder.split_inside"
    bl_label = "Break Surfaces Apart"
    bl_options = {"REGISTER", "UNDO"}

    @verbs.told
    def execute(self, context):
        things = [t for t in self.results(context) if parts.can_split(t)]
        for thing in things:
            parts.split(thing)
        return _shown(context, things)


class SUNDER_OT_unite_inside(_OnResults, bpy.types.Operator):
    """Take break surfaces back into the result objects that they were split from"""

    bl_idname = "sunder.unite_inside"
    bl_label = "Break Surfaces Back"
    bl_options = {"REGISTER", "UNDO"}

    @verbs.told
    def execute(self, context):
        things = [t for t in self.results(context) if t.sunder.part == "OUTSIDE"]
        insides = {inside.name_full: inside for thing in things for inside in trees.insides(thing)}
        for thing in things:
            parts.unite(thing, next(iter(trees.insides(thing)), None))
        for inside in insides.values():
            parts.remove(inside)
        return _shown(context, things)


def _shown(context, things):
    if not things:
        return {"CANCELLED"}
    player.show_all(context.scene, things[0].sunder.tree)
    return {"FINISHED"}


class SUNDER_OT_export_host(_OnResults, bpy.types.Operator):
    """Write the result objects with Blender's own Alembic or USD exporter, where this Blender was built with it"""

    bl_idname = "sunder.export_host"
    bl_label = "Export Result Objects"

    filepath: StringProperty(name="File", subtype="FILE_PATH")
    format: EnumProperty(name="Format", items=[("ABC", "Alembic", ""), ("USD", "USD", "")])
    split_inside: BoolProperty(
        name="Break Surfaces Apart", default=True,
        description="Write break surfaces as objects of their own, NAME inside: as one with the outer surface they lose their "
        "material",
    )

    @verbs.told
    def execute(self, context):
        if self.format not in host_formats():
            self.report({"ERROR"}, f"this Blender was built without {self.format}; sunder.export writes .usda, .glb and .pc2")
            return {"CANCELLED"}
        things = self.results(context)
        if not things:
            return {"CANCELLED"}
        whole = [thing for thing in things if parts.can_split(thing)]
        operator, ending = HOST_FORMATS[self.format]
        path = os.path.splitext(bpy.path.abspath(self.filepath))[0] + ending
        selected, active = context.selected_objects, context.view_layer.objects.active
        bpy.ops.object.select_all(action="DESELECT")
        previews, split = [(t, t.sunder.preview) for t in things], []
        try:
            for thing in things:
                thing.sunder.preview = "OFF"  # meshes behind a preview are written late, for the exporter too late
                parts.count_as_moving(thing)
            for thing in whole if self.split_inside else ():
                split.append((thing, thing.data, parts.split(thing)))
            for thing in things + [inside for _, _, inside in split]:
                thing.select_set(True)
            getattr(bpy.ops.wm, operator)(**self._options(path, context.scene))
        finally:
            for thing, mesh, inside in split:
                parts.unite(thing, inside)
                parts.remove(inside)
                parts.give_back(thing, mesh)
            for thing, preview in previews:
                thing.sunder.preview = preview
            for thing in context.view_layer.objects:
                thing.select_set(thing in selected)
            context.view_layer.objects.active = active
            player.show_all(context.scene, things[0].sunder.tree)
        self._tell(path, whole)
        return {"FINISHED"}

    def _tell(self, path, whole):
        if whole and not self.split_inside:
            self.report({"WARNING"}, f"Sunder: {path}: break surfaces have lost their material there, for Blender writes that "
                                     "of the first frame; with Break Surfaces Apart they keep it")
        else:
            apart = "".join(f"; break surfaces of '{t.name}' are '{t.name} inside'" for t in whole)
            self.report({"INFO"}, f"Sunder: {path}{apart}")

    def _options(self, path, scene):
        if self.format == "USD":
            return {"filepath": path, "selected_objects_only": True, "export_animation": True}
        return {"filepath": path, "selected": True, "start": scene.frame_start, "end": scene.frame_end, "face_sets": True,
                "as_background_job": False}


def draw_export_menu(self, _context):
    self.layout.operator("sunder.export", text="Sunder Bake (.usda/.glb/.pc2/.ply/.obj)")


classes = [SUNDER_OT_export, SUNDER_OT_split_inside, SUNDER_OT_unite_inside, SUNDER_OT_export_host]


def register():
    bpy.types.TOPBAR_MT_file_export.append(draw_export_menu)


def unregister():
    bpy.types.TOPBAR_MT_file_export.remove(draw_export_menu)
