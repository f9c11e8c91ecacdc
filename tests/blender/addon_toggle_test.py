"""The add-on is turned off and on, reloaded, and files are opened and undone, with a tree, a bake and a preview: Blender lives.

A crash ends the process, so that the number of tests passed is never told (run_in_blender.py).
"""
import bpy
import numpy as np

from addon_case import AddonCase, addon, main, positions

TIMES = 50
NAME = "sunder_addon"


class Toggle(AddonCase):
    def setUp(self):
        super().setUp()
        self.scene.frame_end = 3
        self.shot, _ = self.tree()
        self.cached_name = self.shot.name
        self.results(self.shot)
        self.save()
        self.bake(self.shot)
        self.save()
        self.preview()
        self.torn = self.at(3)

    @property
    def result(self):
        return addon("tree.trees").result_objects()[0]

    def preview(self):
        """What a viewport's preview holds of the library's, up to the graphics card."""
        self.result.sunder.preview = "PIECES"
        key, manifest, folder = addon("preview.preview")._frame_key(self.result, bpy.context.scene)
        addon("preview.preview")._source(folder, manifest, self.result.sunder.node)

    def at(self, frame):
        bpy.context.scene.frame_set(frame)
        return positions(self.result)

    def plays(self):
        self.at(1)
        np.testing.assert_array_equal(self.at(3), self.torn)
        self.assertEqual(addon("base.runtime").handler_errors, [])

    def off_and_on(self):
        bpy.ops.preferences.addon_disable(module=NAME)
        self.assertIsNone(bpy.types.NodeTree.bl_rna_get_subclass_py("SunderTree"))
        bpy.context.view_layer.update()
        bpy.ops.preferences.addon_enable(module=NAME)

    def test_turned_off_and_on(self):
        for _ in range(TIMES):
            self.off_and_on()
            self.plays()
            self.preview()

    def test_opened_while_off(self):
        for _ in range(TIMES):
            bpy.ops.preferences.addon_disable(module=NAME)
            self.reopen()
            bpy.context.view_layer.update()
            bpy.ops.preferences.addon_enable(module=NAME)
            self.plays()

    def test_opened_while_on(self):
        for _ in range(TIMES):
            self.reopen()
            self.plays()
            self.preview()

    def test_scripts_are_reloaded(self):
        for _ in range(TIMES):
            bpy.ops.script.reload()
            self.plays()
            self.preview()

    def test_undone_and_done_again(self):
        bpy.ops.ed.undo_push(message="start")
        for i in range(TIMES):
            self.result.location.x = i
            bpy.data.node_groups[self.cached_name].nodes.new("SunderForceNode")
            bpy.ops.ed.undo_push(message="edit")
            bpy.ops.ed.undo()
            self.plays()
            bpy.ops.ed.redo()
            self.plays()
            self.preview()

    def test_undone_beyond_the_time_it_was_off(self):
        for i in range(TIMES):
            bpy.ops.ed.undo_push(message="before")
            self.off_and_on()
            bpy.ops.ed.undo_push(message="after")
            bpy.ops.ed.undo()
            self.plays()
            bpy.ops.ed.redo()
            self.plays()

    def test_the_tree_is_looked_at_once_all_is_there(self):
        """While classes register nothing looks at it: its wires are known afterwards."""
        addon("base.runtime").wires.clear()
        self.off_and_on()
        self.assertFalse(addon("base.runtime").wires)
        addon("interface.handlers")._refresh()
        self.assertTrue(addon("base.runtime").wires)


if __name__ == "__main__":
    main()
