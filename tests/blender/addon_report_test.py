"""What broke, when and why, by Blender's lists: what the library tells, in rows that go to their frame and select fragments."""
import json
import shutil
from pathlib import Path
from unittest.mock import patch

import bmesh
import bpy
import numpy as np

from addon_case import AddonCase, addon, attribute, main
from addon_rows_test import Recorder

OLD = Path(__file__).resolve().parents[1] / "data/version_0_1_0"


def report():
    return addon("interface.report")


class Layout(Recorder):
    """As drawn, and whether each operator's button can be pressed."""

    def template_list(self, kind, _id, data, name, *_at, **_how):
        cells = Layout()
        for row in getattr(data, name):
            getattr(addon("interface.report_panels"), kind).draw_item(None, bpy.context, cells, data, row, 0, data, "")
        self.drawn.append(cells.drawn)

    def row(self, **_how):
        return Layout(self.drawn)

    split = column = row


class Told(AddonCase):
    def baked(self, **material):
        tree, nodes = self.tree(material={"toughness": 0.01, **material})
        result, = self.results(tree)
        self.bake(tree)
        return tree, nodes, result

    def drawn(self, tree, width=175):
        """What both panels show."""
        layout = Layout()
        addon("interface.report_panels")._draw_breaks(layout, tree, width)
        addon("interface.report_panels")._draw_loads(layout, tree, width)
        return layout.drawn

    def selected(self, thing):
        return addon("results.fragment_faces").selected(thing)

    def edit(self, thing, mode="EDIT"):
        bpy.context.view_layer.objects.active = thing
        bpy.ops.object.mode_set(mode=mode)

    def refused(self, operator, **given):
        with self.assertRaises(RuntimeError) as caught:
            operator(**given)
        return str(caught.exception)

    def test_the_rows_are_what_the_library_tells(self):
        tree, nodes, _ = self.baked()
        self.assertEqual(bpy.ops.sunder.report(tree=tree.name), {"FINISHED"})
        told = addon("base.core").sunder().report(str(self.cached(tree)))
        lists = report().lists()
        self.assertGreater(told["broken"], 0)
        self.assertEqual(sum(row.edges for row in lists.breaks), told["broken"])
        self.assertEqual([row.frame for row in lists.breaks], sorted(row.frame for row in lists.breaks))
        self.assertEqual(lists.breaks[0].frame, told["first"]["frame"])
        self.assertEqual(lists.breaks[0].by, nodes["collider"].name)  # the floor
        for row in lists.breaks:
            edges = [e for e in told["breaks"] if e["frame"] == row.frame]
            self.assertTrue(addon("bake.break_report").numbers(row.fragments) <= {f for e in edges for f in e["fragments"]})
            self.assertIn(np.float32(row.strain), np.float32([e["strain"] for e in edges]))
            self.assertAlmostEqual(row.toughness, 0.01, delta=1e-6)
        self.assertIn(f"{told['broken']} edges broke", lists.summary)
        self.assertIn(f"{told['pieces'][-1]['pieces']} pieces", lists.summary)
        drawn = self.drawn(tree)
        self.assertIn(lists.summary.split(";")[0], " ".join(t for t in drawn if isinstance(t, str)))
        cells, = [t for t in drawn if isinstance(t, list)]
        self.assertEqual(cells[:2], [str(lists.breaks[0].frame), str(lists.breaks[0].edges)])
        self.assertEqual(len(cells), 3 * len(lists.breaks))
        with patch.object(addon("base.drawing"), "sidebar_width", lambda _context: 300):  # drawn wider
            cells, = [t for t in self.drawn(tree, 300) if isinstance(t, list)]
        self.assertEqual(len(cells), 5 * len(lists.breaks))
        self.assertEqual(cells[2:4], [f"{lists.breaks[0].strain:.2g}", "0.01"])

    def test_a_row_goes_to_its_frame_and_selects_its_fragments(self):
        tree, _, result = self.baked()
        bpy.ops.sunder.report(tree=tree.name)
        lists = report().lists()
        for i, row in enumerate(lists.breaks):
            self.scene.frame_set(1)
            lists.at_break = i  # as a click in the list
            wanted = addon("bake.break_report").numbers(row.fragments)
            self.assertEqual([self.scene.frame_current, self.selected(result)], [row.frame, wanted])
            edges, vertices = (np.empty(len(e), bool) for e in (result.data.edges, result.data.vertices))
            result.data.edges.foreach_get("select", edges)
            result.data.vertices.foreach_get("select", vertices)
            ends = np.array([e.vertices[:] for e in result.data.edges])[edges]
            self.assertTrue(edges.any() and vertices[ends].all())
            self.edit(result)  # what is selected is so there, no neighbour more
            self.assertEqual(self.selected(result), wanted)
            self.edit(result, "OBJECT")
        self.assertIn(row.sentence.split(":")[0], " ".join(t for t in self.drawn(tree) if isinstance(t, str)))

    def test_in_edit_mode_a_row_selects_at_once(self):
        tree, _, result = self.baked()
        bpy.ops.sunder.report(tree=tree.name)
        self.edit(result)
        lists = report().lists()
        bpy.ops.sunder.go_to_break(row=len(lists.breaks) - 1)
        self.assertEqual(self.scene.frame_current, lists.breaks[-1].frame)
        wanted = addon("bake.break_report").numbers(lists.breaks[-1].fragments)
        self.assertEqual(self.selected(result), wanted)
        self.edit(result, "OBJECT")
        self.assertIn("there are", self.refused(bpy.ops.sunder.go_to_break, row=99))

    def test_selected_faces_tell_how_close_their_fragments_came(self):
        tree, _, result = self.baked()
        self.assertIn("select faces", self.refused(bpy.ops.sunder.ask_fragments, tree=tree.name))
        self.scene.tool_settings.mesh_select_mode = (False, False, True)
        addon("results.fragment_faces").select(result, {2, 5})
        bpy.context.view_layer.objects.active = result
        lists = report().lists()
        for mode in ("OBJECT", "EDIT"):
            self.edit(result, mode)
            bpy.ops.sunder.ask_fragments(tree=tree.name)
            self.assertEqual(sorted(row.fragments for row in lists.loads), ["2", "5"])
        self.edit(result, "OBJECT")
        told = {str(f["fragment"]): f for f in addon("base.core").sunder().report(str(self.cached(tree)), "all")["fragments"]}
        bpy.ops.sunder.ask_fragments(tree=tree.name, fragments="all")
        self.assertEqual(sorted(row.fragments for row in lists.loads), sorted(told))
        self.assertEqual([row.share for row in lists.loads], sorted((row.share for row in lists.loads), reverse=True))
        for row in lists.loads:
            self.assertAlmostEqual(row.share, told[row.fragments]["share"], delta=1e-6 * row.share)
            self.assertEqual(row.is_broken, told[row.fragments]["broken_edges"] > 0)
        lists.at_load = 0
        self.assertEqual([self.scene.frame_current, self.selected(result)],
                         [lists.loads[0].frame, {int(lists.loads[0].fragments)}])
        drawn = self.drawn(tree)
        self.assertIn("bore", " ".join(t for t in drawn if isinstance(t, str)))
        self.assertIn("broke", drawn[-1] if isinstance(drawn[-1], list) else [t for t in drawn if isinstance(t, list)][-1])
        for wrong in ("x", "4-2", "1,", "-1", "99999999999"):
            self.assertIn("names no fragments", self.refused(bpy.ops.sunder.ask_fragments, tree=tree.name, fragments=wrong))
        self.assertIn("none is chosen", self.refused(bpy.ops.sunder.ask_fragments, tree=tree.name, fragments="8000"))

    def test_a_vertex_group_of_the_source_can_be_asked_for(self):
        block = self.cube(size=1, location=(0, 0, 1))
        edit = bmesh.new()
        edit.from_mesh(block.data)
        bmesh.ops.subdivide_edges(edit, edges=edit.edges, cuts=5, use_grid_fill=True)
        edit.to_mesh(block.data)
        edit.free()
        right = block.vertex_groups.new(name="right")
        right.add([v.index for v in block.data.vertices if v.co.x > 0.1], 1, "REPLACE")
        tree, _ = self.tree(block, pieces=40)
        result, = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(1)
        self.scene.tool_settings.mesh_select_mode = (False, False, True)
        self.edit(result)
        bpy.ops.mesh.select_all(action="DESELECT")
        result.vertex_groups.active = result.vertex_groups["right"]
        bpy.ops.object.vertex_group_select()
        bpy.ops.sunder.ask_fragments(tree=tree.name)
        self.edit(result, "OBJECT")
        asked = {int(row.fragments) for row in report().lists().loads}
        at = {f["fragment"]: f["position"][0] for f in addon("base.core").sunder().report(str(self.cached(tree)), "all")["fragments"]}
        self.assertLessEqual({n for n, x in at.items() if x > 0.2}, asked)
        self.assertFalse({n for n, x in at.items() if x < -0.2} & asked)

    def test_what_held_says_how_much_more_it_wants(self):
        why = addon("bake.break_report").why
        held = {"broken_edges": 0, "toughness": 0.1, "strain": 0.025, "share": 0.25}
        self.assertEqual(why(held), "wants 4 times the load, or a toughness below 0.025")
        self.assertIn("another seed", why({**held, "share": 0.95}))
        self.assertIn("pressed", why({**held, "share": 1.2}))
        self.assertIn("never breaks", why({**held, "toughness": None, "share": 0}))
        self.assertIn("never strained", why({**held, "share": 0}))
        self.assertIn("3 of its edges broke", why({**held, "broken_edges": 3, "first_broken": 0.1}))
        numbers, as_text = addon("bake.break_report").numbers, addon("bake.break_report").as_text
        self.assertEqual(as_text({9, 3, 8, 7}), "3, 7-9")
        self.assertEqual(numbers("3, 7-9"), {3, 7, 8, 9})
        tree, nodes, result = self.baked(toughness=0.9)
        bpy.ops.sunder.ask_fragments(tree=tree.name, fragments="all", body="body")
        self.assertIn("nothing broke in frames 1 to 6", report().lists().summary)
        self.assertEqual(len(report().lists().breaks), 0)
        self.assertIn("times the load", report().lists().loads[0].sentence)
        self.assertFalse(bpy.ops.sunder.go_to_break.poll())

    def test_bakes_that_are_missing_old_damaged_or_at_work_are_told(self):
        self.assertFalse(bpy.ops.sunder.report.poll())
        tree, nodes = self.tree()
        self.assertFalse(bpy.ops.sunder.report.poll())
        self.assertEqual(self.drawn_lack(tree), "nothing baked yet")
        self.results(tree)
        job = addon("bake.bake_job").BakeJob(tree, self.scene)
        job.start()
        while not (self.manifest(tree) and self.manifest(tree).numbers) and job.is_running:
            job.wait(0.02)
        bpy.ops.sunder.report(tree=tree.name)  # of the frames that are there
        first = report().lists().summary
        self.drawn(tree)
        job.wait()
        job.finish(tree)
        self.assertIn("frames 1 to", first)
        if not first.endswith("to 6"):
            self.drawn(tree)
        bpy.ops.sunder.report(tree=tree.name)
        self.assertIn("frames 1 to 6", report().lists().summary)
        log = next((self.cached(tree) / "breaks").iterdir())
        content = log.read_text()
        for text in ("", "{", content.replace("collider", "kollider"), content[:-20]):
            log.write_text(text)
            self.assertIn("has changed since it was baked", self.refused(bpy.ops.sunder.report, tree=tree.name))
            self.assertEqual(len(report().lists().breaks), 0)
            self.drawn(tree)
        log.unlink()
        self.assertIn("Error", self.refused(bpy.ops.sunder.report, tree=tree.name))
        manifest = self.cached(tree) / "manifest.json"
        content = json.loads(manifest.read_text())
        del content["log"]
        manifest.write_text(json.dumps(content))
        self.assertIn("an earlier Sunder baked it", self.drawn_lack(tree))
        self.assertFalse(bpy.ops.sunder.report.poll())
        manifest.write_text("{")
        self.assertEqual(self.drawn_lack(tree), "nothing baked yet")
        bpy.ops.sunder.free_bake(tree=tree.name)
        self.assertEqual(self.drawn_lack(tree), "nothing baked yet")

    def drawn_lack(self, tree):
        layout = Layout()
        addon("interface.report_panels")._draw_breaks(layout, tree, 175)
        return " ".join(layout.drawn)

    def test_a_bake_of_an_earlier_version_plays_and_says_that_it_keeps_no_log(self):
        tree, _, result = self.baked()
        folder = self.cached(tree)
        shutil.copy(next(OLD.rglob("manifest.json")), folder / "manifest.json")
        self.assertIn("earlier Sunder", self.drawn_lack(tree))
        self.assertFalse(bpy.ops.sunder.report.poll())
        report().lists().at_break = 3  # a row that is none

    def test_lists_survive_undo_bakes_and_files(self):
        bpy.context.preferences.edit.use_global_undo = True
        tree, nodes, result = self.baked()
        name, thing = tree.name, result.name
        bpy.ops.sunder.report(tree=name)
        lists = report().lists()
        rows, stamp = len(lists.breaks), lists.stamp
        bpy.ops.ed.undo_push(message="read")
        bpy.ops.sunder.go_to_break(row=0)
        bpy.ops.ed.undo_push(message="gone to")
        bpy.ops.ed.undo()
        tree, result = bpy.data.node_groups[name], bpy.data.objects[thing]
        self.assertEqual([len(report().lists().breaks), report().lists().stamp], [rows, stamp])
        report().lists().at_break = rows - 1
        self.assertEqual(self.selected(result), addon("bake.break_report").numbers(report().lists().breaks[-1].fragments))
        # Another bake of the tree that is looked at is read again.
        next(n for n in tree.nodes if n.sunder_type == "body").set_parameters(toughness=0.012)
        self.bake(tree)
        self.assertNotEqual(report().lists().stamp, stamp)
        self.assertAlmostEqual(report().lists().breaks[0].toughness, 0.012, delta=1e-6)
        self.drawn(tree)
        bpy.data.objects.remove(result)  # nothing is there to select on
        report().lists().at_break = 0
        self.assertEqual(bpy.context.scene.frame_current, report().lists().breaks[0].frame)
        bpy.data.node_groups.remove(tree)
        report().lists().at_break = 0
        self.save()
        self.reopen()
        self.assertEqual([len(report().lists().breaks), report().lists().stamp], [0, ""])

    def test_a_sentence_names_few_fragments(self):
        tree, nodes = self.tree(pieces=60, fall_speed=12, material={"toughness": 0.001, "fracture_energy": None})
        self.bake(tree)
        bpy.ops.sunder.report(tree=tree.name)
        counts = [len(addon("bake.break_report").numbers(row.fragments)) for row in report().lists().breaks]
        self.assertGreater(max(counts), 20)
        for n, row in zip(counts, report().lists().breaks):
            self.assertEqual(row.sentence.endswith(f"; {n} fragments"), n > 20)
            self.assertLess(len(row.sentence), 250)

    def test_two_bodies_of_one_tree_are_told_apart(self):
        blocks = [self.cube(location=(x, 0, 0.5), name=f"Block {x}") for x in (0, 1)]
        tree, nodes = self.tree(blocks[0])
        mesh = self.node(tree, "mesh_file")
        mesh.object = blocks[1]
        cut = self.node(tree, "prefracture", pieces=8)
        body = self.node(tree, "body", toughness=0.005, velocity=(0, 0, -6), angular_velocity=(0, 300, 0))
        skin = self.node(tree, "deformer")
        self.connect(mesh, "mesh", cut, "mesh")
        self.connect(cut, "fragments", body, "fragments")
        self.connect(body, "body", nodes["solver"], "bodies")
        self.connect(nodes["solver"], "state", skin, "state")
        self.connect(body, "body", skin, "body")
        body.label = "Right Block"
        things = {thing.sunder.node: thing for thing in self.results(tree)}
        self.bake(tree)
        bpy.ops.sunder.report(tree=tree.name)
        lists = report().lists()
        self.assertEqual({row.body for row in lists.breaks}, {"body", "body_2"})
        at = next(i for i, row in enumerate(lists.breaks) if row.body == "body_2")
        self.assertTrue(lists.breaks[at].sentence.startswith("Right Block, "))
        lists.at_break = at
        self.assertEqual(self.selected(things["deformer"]), set())
        wanted = addon("bake.break_report").numbers(lists.breaks[at].fragments)
        self.assertEqual(self.selected(things["deformer_2"]), wanted)
        bpy.ops.object.select_all(action="DESELECT")
        things["deformer_2"].select_set(True)
        bpy.context.view_layer.objects.active = things["deformer_2"]
        bpy.ops.sunder.ask_fragments(tree=tree.name)
        self.assertEqual({(row.body, int(row.fragments)) for row in lists.loads}, {("body_2", n) for n in wanted})


if __name__ == "__main__":
    main()
