"""Exports of a bake: by the library (USD, glTF, point caches, sequences), or by Blender's own exporters where it has them."""
import os

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from . import blender_versions, cache, core, looks, operators, player

HOST_FORMATS = {"ABC": ("alembic_export", ".abc"), "USD": ("usd_export", ".usdc")}


def host_formats():
    """Formats that this Blender was built with: some builds have neither."""
    return [name for name, (operator, _) in HOST_FORMATS.items() if blender_versions.has_operator("wm", operator)]


class SUNDER_OT_export(operators._OnTree, bpy.types.Operator, ExportHelper):
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

    @operators.told
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
        self.report({"INFO"}, f"Sunder: {len(done['files'])} files exported" + (f"; {done['note']}" if done["note"] else ""))
        return {"FINISHED"}


class SUNDER_OT_export_host(operators._OnTree, bpy.types.Operator):
    """Write the result objects with Blender's own Alembic or USD exporter, where this Blender was built with it"""

    bl_idname = "sunder.export_host"
    bl_label = "Export Result Objects"

    filepath: StringProperty(name="File", subtype="FILE_PATH")
    format: EnumProperty(name="Format", items=[("ABC", "Alembic", ""), ("USD", "USD", "")])

    @operators.told
    def execute(self, context):
        tree = self.find(context)
        if tree is None:
            return {"CANCELLED"}
        if self.format not in host_formats():
            self.report({"ERROR"}, f"this Blender was built without {self.format}; sunder.export writes .usda, .glb and .pc2")
            return {"CANCELLED"}
        things = [t for t in player.result_objects(tree) if context.scene in t.users_scene]
        if not things:
            self.report({"ERROR"}, "the tree has no result object in this scene")
            return {"CANCELLED"}
        operator, ending = HOST_FORMATS[self.format]
        path = os.path.splitext(bpy.path.abspath(self.filepath))[0] + ending
        selected, active = context.selected_objects, context.view_layer.objects.active
        bpy.ops.object.select_all(action="DESELECT")
        marks = []
        previews = [(thing, thing.sunder.preview) for thing in things]
        try:
            for thing in things:
                thing.sunder.preview = "OFF"  # meshes behind a preview are written late, for the exporter too late
                thing.select_set(True)
                if thing.type == "MESH":  # exporters take a mesh without modifiers for one that does not move
                    marks.append((thing, thing.modifiers.new("sunder export", "TRIANGULATE")))
            getattr(bpy.ops.wm, operator)(**self._options(path, context.scene))
        finally:
            for thing, mark in marks:
                thing.modifiers.remove(mark)
            for thing, preview in previews:
                thing.sunder.preview = preview
            for thing in context.view_layer.objects:
                thing.select_set(thing in selected)
            context.view_layer.objects.active = active
        self.report({"INFO"}, f"Sunder: {path}")
        return {"FINISHED"}

    def _options(self, path, scene):
        if self.format == "USD":
            return {"filepath": path, "selected_objects_only": True, "export_animation": True}
        return {"filepath": path, "selected": True, "start": scene.frame_start, "end": scene.frame_end,
                "as_background_job": False}


def draw_export_menu(self, _context):
    self.layout.operator("sunder.export", text="Sunder Bake (.usda/.glb/.pc2/.ply/.obj)")


classes = [SUNDER_OT_export, SUNDER_OT_export_host]


def register():
    bpy.types.TOPBAR_MT_file_export.append(draw_export_menu)


def unregister():
    bpy.types.TOPBAR_MT_file_export.remove(draw_export_menu)
