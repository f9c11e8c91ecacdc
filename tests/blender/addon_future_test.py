"""What a later Blender takes away is told on node and panel, never by a traceback: names that are there are taken away here."""
import contextlib
import io
from unittest import mock

import bpy

from addon_case import AddonCase, addon, main


class Layout:
    """A panel's layout that remembers its labels; everything else may be asked of it and does nothing."""

    def __init__(self):
        self.labels = []

    def label(self, text="", **_):
        self.labels.append(text)

    def __getattr__(self, _name):
        return lambda *_, **__: self

    @property
    def told(self):
        return " ".join(self.labels)


class Future(AddonCase):
    def setUp(self):
        super().setUp()
        self.shot, self.made = self.tree()
        self.result, = self.results(self.shot)
        self.bake(self.shot)
        self.output = io.StringIO()
        newest = mock.patch.object(addon("base.blender_versions"), "NEWEST", (3, 3))
        newest.start()
        self.addCleanup(newest.stop)

    def gone(self, module, name):
        """A name of Blender's that a function asks for in vain."""
        return mock.patch.object(addon(module), name, side_effect=AttributeError(f"'Mesh' object has no attribute '{name}'"))

    def tearDown(self):
        self.assertTrue(addon("base.runtime").handler_errors)  # kept for who looks for it
        addon("base.runtime").handler_errors.clear()
        self.assertNotIn("Traceback", self.output.getvalue())
        super().tearDown()

    def test_a_mesh_that_cannot_be_written_is_told_on_its_node(self):
        with self.gone("base.blender_versions", "write_corner_normals"), contextlib.redirect_stdout(self.output), \
                contextlib.redirect_stderr(self.output):
            self.scene.frame_set(3)
        self.assertRegex(self.made["deformer"].note, r"frame 3 cannot be shown: Blender .* is newer than 3\.3.*write_corner_normals")
        self.scene.frame_set(4)  # and the next frame is shown, once it can be
        self.assertIn("baked 1 to 6", self.made["deformer"].note)

    def test_a_node_and_a_panel_tell_what_they_could_not_draw(self):
        layout, panel = Layout(), mock.Mock(layout=Layout())
        with self.gone("interface.bake_buttons", "draw_bake"), contextlib.redirect_stdout(self.output), \
                contextlib.redirect_stderr(self.output):
            type(self.made["solver"]).draw_buttons(self.made["solver"], bpy.context, layout)
            addon("interface.panels").SUNDER_PT_tree.draw(panel, mock.Mock())
        self.assertRegex(layout.told, "is newer than 3.3, and something that Sunder")
        self.assertRegex(panel.layout.told, "is newer than 3.3, and something that Sunder")

    def test_an_operator_reports_it(self):
        with self.gone("results.results", "add_missing"), contextlib.redirect_stdout(self.output), \
                contextlib.redirect_stderr(self.output), self.assertRaisesRegex(RuntimeError, "is newer than 3.3"):
            bpy.ops.sunder.add_results(tree=self.shot.name)

    def test_a_handler_says_so_in_a_line(self):
        with self.gone("results.player", "show_all"), contextlib.redirect_stdout(self.output), \
                contextlib.redirect_stderr(self.output):
            self.scene.frame_set(5)
        self.assertRegex(self.output.getvalue(), "sunder: error: Blender .* is newer than 3.3")


if __name__ == "__main__":
    main()
