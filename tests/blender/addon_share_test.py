"""Where others pick a shot up without Sunder it plays: what one click writes, read by a Blender that has no add-on."""
import shutil
from unittest import mock

import bpy
import numpy as np

from addon_case import addon, main, positions
from share_case import FRAMES, SHARE, PlayCase, ShareCase


class Whole(PlayCase):
    def test_a_cache_plays_everywhere(self):
        if not self.has_alembic():
            with self.assertRaisesRegex(RuntimeError, "built without Alembic"):
                self.click(kind="CACHE")
            self.assertEqual([path.exists() for path in self.paths()], [False, False])
            return
        self.assertEqual(self.click(), {"FINISHED"})
        self.assertEqual([path.exists() for path in self.paths()], [True, True])
        self.everywhere()

    def test_meshes_play_everywhere(self):
        self.assertEqual(self.click(kind="MESHES"), {"FINISHED"})
        self.assertEqual([path.exists() for path in self.paths()], [False, True])
        self.everywhere()

    def test_textures_stick_to_the_pieces(self):
        """By Generated coordinates and by rest positions, as UV maps that materials of the shared file read."""
        if not self.has_alembic():
            return
        material = bpy.data.materials["Primer"]
        self.reads(material, "rest_position")
        nodes, links = material.node_tree.nodes, material.node_tree.links
        texture = nodes.new("ShaderNodeTexNoise")
        links.new(texture.outputs[0], nodes["Principled BSDF"].inputs["Metallic"])
        before = {n.name for n in nodes}, len(links)
        self.assertEqual(self.click(), {"FINISHED"})
        self.assertEqual(({n.name for n in nodes}, len(links)), before)
        found, result = self.elsewhere("link"), bpy.data.objects["Block fractured"]
        for frame in FRAMES:
            self.scene.frame_set(frame)
            mesh = result.data
            rest = np.array([v.vector for v in mesh.attributes["rest_position"].data])[self.wanted[frame]["triangles"]]
            generated = (rest - np.array(mesh.texspace_location)) / (2 * np.array(mesh.texspace_size)) + 0.5
            mine = self.wanted[frame]["material"] != "Sunder Interior"
            shown = found[frame]["Block fractured shared"]
            self.assertEqual(set(shown["material"]), {"Paint", "Primer shared"})
            for name, wanted in (("rest_position", rest[mine]), ("generated", generated[mine])):
                maps = [shown[f"uv {name}_{axes}"].reshape(-1, 3, 2) for axes in ("xy", "z")]
                vectors = np.concatenate([maps[0], maps[1][:, :, :1]], 2)
                turns = [np.abs(np.roll(vectors, turn, 1) - wanted).max((1, 2)) for turn in range(3)]
                self.assertLess(np.min(turns, 0).max(), 1e-5)

    def test_both_are_moved_together(self):
        self.click()
        away = self.folder / "moved"
        away.mkdir()
        for path in self.paths():
            if path.exists():
                shutil.move(path, away / path.name)
        self.plays(self.elsewhere("link", away / self.paths()[1].name))

    def test_from_where_it_is_linked(self):
        self.save("a.blend")
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.save("b.blend")
        with bpy.data.libraries.load(str(self.folder / "a.blend"), link=True) as (there, wanted):
            wanted.objects = ["Block fractured", "Crate moving"]
        for thing in wanted.objects:
            bpy.context.scene.collection.objects.link(thing)
        self.assertEqual(bpy.ops.sunder.make_shareable(), {"FINISHED"})
        self.plays(self.elsewhere("link", self.folder / "b-Block_Fracture_shared.blend"))

    def test_where_break_surfaces_are_apart(self):
        bpy.ops.sunder.split_inside(tree=self.block_tree.name)
        self.assertEqual(self.click(), {"FINISHED"})
        if not self.has_alembic():
            return
        found = self.elsewhere("open")
        for shown in found.values():
            shown["Block fractured shared inside"] = shown.pop("Block fractured inside shared")
        self.plays(found)

    def test_a_result_that_is_moved(self):
        thing = bpy.data.objects["Block fractured"]
        handle = bpy.data.objects.new("Handle", None)
        self.scene.collection.objects.link(handle)
        thing.parent = handle
        for frame in (1, 6):
            handle.location = (frame, 0, 2)
            handle.keyframe_insert("location", frame=frame)
        for kind in ("AUTO", "MESHES"):
            self.click(kind=kind)
            found = self.elsewhere("open")
            for frame in FRAMES:
                self.scene.frame_set(frame)
                place = np.array(thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)[:3, 3]
                points = np.concatenate([s["points"] for n, s in found[frame].items() if "Block" in n])
                wanted = self.wanted[frame]["points"] + place
                for side in (np.min, np.max):
                    np.testing.assert_allclose(side(points, 0), side(wanted, 0), atol=SHARE * self.size)


class Click(ShareCase):
    def files(self):
        return {path.name: path.read_bytes() for path in self.folder.iterdir() if path.is_file()}

    def things(self):
        return {kind: [thing.name for thing in getattr(bpy.data, kind)] for kind in addon("exports.share")._MADE}

    def refuses(self, sentence, **options):
        before, things = self.files(), self.things()
        with self.assertRaisesRegex(RuntimeError, sentence):
            self.click(**options)
        self.assertEqual(self.files(), before)
        self.assertEqual(self.things(), things)

    def test_this_file_stays_as_it_is(self):
        self.scene.frame_set(4)
        thing = bpy.data.objects["Block fractured"]
        thing.sunder.preview, thing.hide_select = "PIECES", True
        bpy.data.objects.new("Block fractured shared", None)  # a name that is made, too
        bpy.data.meshes.new("Block fractured shared 0001")
        before, shown = self.things(), positions(thing)
        selected = [o.name for o in bpy.context.selected_objects]
        for kind in ("AUTO", "MESHES", "AUTO"):
            self.click(kind=kind)
            self.assertEqual(self.things(), before)
            np.testing.assert_array_equal(positions(thing), shown)
        self.assertEqual([o.name for o in bpy.context.selected_objects], selected)
        self.assertEqual((self.scene.frame_current, thing.sunder.preview, bpy.context.scene), (4, "PIECES", self.scene))
        self.assertEqual(sorted(p.name for p in self.folder.iterdir() if "part" in p.name), [])

    def test_what_cannot_be_shared_is_refused_by_a_sentence(self):
        tree = self.block_tree
        things = [thing for thing in addon("tree.trees").result_objects(tree)]
        for thing in things:
            thing.sunder.tree = None
        self.refuses("no result object")
        for thing in things:
            thing.sunder.tree = tree
        for path in self.paths()[0 if self.has_alembic() else 1:]:
            path.mkdir()
            self.refuses("is a folder")
            path.rmdir()
        name, other = tree.name, bpy.data.node_groups.new("A b", "SunderTree")
        tree.name = "A_B"
        self.refuses("'A b' is shared into files of the same name: rename")
        bpy.data.node_groups.remove(other)
        tree.name = name
        bpy.ops.sunder.free_bake(tree=tree.name)
        self.refuses("bake first")
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.scene = bpy.context.scene
        tree, _ = self.tree()
        self.results(tree)
        with self.assertRaisesRegex(RuntimeError, "save this file first"):
            bpy.ops.sunder.make_shareable(tree=tree.name)

    def test_a_disk_that_gets_full_leaves_what_was_shared_before(self):
        """Of meshes; at a cache the exporter ends Blender, so that room is looked for first."""
        import resource
        import signal

        self.click()
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        known = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20000, known[1]))
        try:
            self.refuses("cannot be written", kind="MESHES")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, known)

    def test_without_room_nothing_is_begun(self):
        self.click()
        usage = shutil._ntuple_diskusage(10**9, 10**9 - 50_000, 50_000)
        with mock.patch("shutil.disk_usage", return_value=usage):
            for kind in ("AUTO", "MESHES"):
                self.refuses("no room in .* and 0.1 MB are free", kind=kind)

    def test_a_folder_that_cannot_be_written(self):
        with mock.patch("os.access", return_value=False):
            self.refuses("cannot be written")

    def test_what_is_stopped_leaves_nothing(self):
        places = [("exports.share", "_write", "MESHES"), ("exports.share", "_write", "AUTO"),
                  ("exports.share_meshes", "_Sequence", "MESHES")]
        for module, name, kind in places + ([("exports.share_cache", "_open", "AUTO")] if self.has_alembic() else []):
            with mock.patch.object(addon(module), name, side_effect=KeyboardInterrupt):
                before, things = self.files(), self.things()
                try:
                    self.click(kind=kind)
                except (RuntimeError, KeyboardInterrupt):
                    pass
                self.assertEqual((self.files(), self.things()), (before, things))
            self.assertEqual(len(bpy.app.handlers.frame_change_post), 1)

    def test_between_any_two_frames_it_can_be_stopped(self):
        thing = bpy.data.objects["Block fractured"]
        thing.keyframe_insert("location", frame=1)
        before, things, shown = self.files(), self.things(), positions(thing)
        kinds = {"MESHES": 12, "CACHE": 6} if self.has_alembic() else {"MESHES": 12}
        for kind, count in kinds.items():
            for stop in range(1, count + 1):
                steps = addon("exports.share").share(self.block_tree, self.scene, [thing], kind)
                for _ in range(stop):
                    next(steps)
                steps.close()
                addon("results.player").show_all(self.scene)
                self.assertEqual((self.files(), self.things()), (before, things))
                np.testing.assert_array_equal(positions(thing), shown)

    def test_each_file_and_tree_has_names_of_its_own(self):
        names = []
        for file, tree in (("shot", "a_b"), ("shot_a", "b"), ("shot-a", "b"), ("shot-a_b", "b"), ("shot", "a-b_b")):
            self.save(f"{file}.blend")
            self.block_tree.name = tree
            names.append(self.shared()[0])
            self.assertEqual(addon("exports.share").found(self.block_tree), names[-1])
        self.assertEqual(len(set(names)), len(names), names)

    def test_what_was_shared_under_a_name_of_before_is_found_and_replaced(self):
        """Names were joined by "_": shot and a_b, and shot_a and b, had the same. Who linked it gets the new one."""
        self.save("shot.blend")
        self.block_tree.name = "a_b"
        former = self.folder / "shot_a_b_shared.blend"
        shutil.move(self.shared("MESHES")[0], former)
        self.assertEqual(addon("exports.share").found(self.block_tree), str(former))
        content = former.read_bytes()
        self.assertEqual(self.shared("MESHES")[0], str(former))
        self.assertNotEqual(former.read_bytes(), content)
        content = former.read_bytes()
        self.save("shot_a.blend")
        self.block_tree.name = "b"  # another's file
        self.assertEqual(self.shared("MESHES")[0], str(self.folder / "shot_a-b_shared.blend"))
        self.assertEqual(former.read_bytes(), content)

    def test_a_cache_that_ends_early_is_no_cache(self):
        if not self.has_alembic():
            return
        share = addon("exports.share_cache")
        self.addCleanup(setattr, share, "_export", share._export)
        write = share._export
        share._export = lambda pieces, frames, stage, path: write(pieces, frames[:2], stage, path)
        self.refuses("did not become whole")

    def test_a_bake_that_misses_a_frame_is_refused(self):
        for name in ("mesh/deformer.0004.ply", "state/solver.0001.ply"):
            path = self.cached(self.block_tree) / name
            content = path.read_bytes()
            for broken in (None, content[:-1]):
                path.unlink() if broken is None else path.write_bytes(broken)
                for kind in ("AUTO", "MESHES"):
                    self.refuses("frame . cannot be shown", kind=kind)
            path.write_bytes(content)

    def test_what_an_instance_alone_shows_is_told(self):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.save("b.blend")
        self.scene = bpy.context.scene
        shot = bpy.data.collections.new("Shot")
        with bpy.data.libraries.load(str(self.folder / "a.blend"), link=True) as (_, wanted):
            wanted.objects = ["Block fractured"]
        shot.objects.link(wanted.objects[0])
        instance = bpy.data.objects.new("Instance", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", shot
        self.scene.collection.objects.link(instance)
        self.block_tree = wanted.objects[0].sunder.tree
        self.assertRegex(self.shared("MESHES")[1][0], "not where an instance shows it: Block fractured")

    def test_what_is_lost_is_told(self):
        self.reads(bpy.data.materials["Primer"], "fragment")
        if not self.has_alembic():
            return
        path, notes = self.shared()
        self.assertEqual((path, len(notes)), (str(self.paths()[1]), 1))
        self.assertRegex(notes[0], "does not hold: fragment")


class Elsewhere(PlayCase):
    def pick_up(self):
        """b.blend with the results linked; returns the deformer's."""
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.save("b.blend")
        with bpy.data.libraries.load(str(self.folder / "a.blend"), link=True) as (there, wanted):
            wanted.objects = ["Block fractured"]
        self.scene = bpy.context.scene
        self.scene.collection.objects.link(wanted.objects[0])
        return wanted.objects[0]

    def test_without_sunder_a_linked_shot_shows_the_frame_it_was_saved_at(self):
        self.scene.frame_set(5)
        shot = bpy.data.collections.new("Shot")
        self.scene.collection.children.link(shot)
        for name in ("Block fractured", "Crate moving"):
            self.scene.collection.objects.unlink(bpy.data.objects[name])
            shot.objects.link(bpy.data.objects[name])
        self.save("a.blend")
        for how in ("open", "link", "append"):
            found = self.elsewhere(how, self.folder / "a.blend", (5, 2, 6))
            for frame in (5, 2, 6):
                np.testing.assert_array_equal(found[frame]["Block fractured"]["points"],
                                              self.wanted[5]["points"].astype(np.float32))
                np.testing.assert_allclose(found[frame]["Crate moving"]["points"], self.wanted[5]["crate"],
                                           atol=SHARE * self.size)

    def test_without_its_bake_the_shared_file_is_offered_and_plays(self):
        self.click()
        thing = self.pick_up()
        (self.folder / "sunder_cache").rename(self.folder / "away")
        share = addon("exports.share")
        self.assertFalse(share.has_bake(thing.sunder.tree))
        self.assertEqual(share.found(thing.sunder.tree), str(self.paths()[1]))
        self.assertIn("sunder.use_shared", Drawn.of(share.draw, thing.sunder.tree))
        self.assertEqual(bpy.ops.sunder.use_shared(), {"FINISHED"})
        self.assertTrue(thing.hide_get())
        self.assertEqual(bpy.ops.sunder.use_shared(), {"CANCELLED"})  # once is enough
        self.scene.frame_end = 6
        self.save("b.blend")
        found = self.elsewhere("open", self.folder / "b.blend")
        for frame in FRAMES:
            points = np.concatenate([s["points"] for n, s in found[frame].items() if n.startswith("Block fractured shared")])
            wanted = self.wanted[frame]["points"]
            np.testing.assert_allclose(points.min(0), wanted.min(0), atol=SHARE * self.size)

    def test_the_panel_says_where_to_click(self):
        thing = self.pick_up()
        draw = addon("exports.share").draw
        self.assertIn("sunder.make_shareable", Drawn.of(draw, thing.sunder.tree))
        shutil.rmtree(self.folder / "sunder_cache")
        told = Drawn.of(draw, thing.sunder.tree)
        self.assertNotIn("sunder.make_shareable", told)
        self.assertRegex(" ".join(told), "cannot play here.* Open a.blend .*Share Without Sunder")
        with self.assertRaisesRegex(RuntimeError, "nothing was shared"):
            bpy.ops.sunder.use_shared()

    def test_in_its_own_file_the_results_stand_back(self):
        self.click()
        self.assertEqual(bpy.ops.sunder.use_shared(tree=self.block_tree.name), {"FINISHED"})
        for name in ("Block fractured", "Crate moving"):
            self.assertEqual((bpy.data.objects[name].hide_render, bpy.data.objects[name].hide_get()), (True, True))

    def test_what_is_linked_here_is_read_again_when_it_is_shared_again(self):
        for kind in ("AUTO", "MESHES", "AUTO"):
            self.click(kind=kind)
            if kind == "AUTO":
                bpy.ops.sunder.use_shared(tree=self.block_tree.name)
            shown = {}
            for instance in bpy.context.evaluated_depsgraph_get().object_instances:
                if instance.object.type == "MESH" and instance.object.library or "shared" in instance.object.name:
                    shown[instance.object.name] = len(getattr(instance.object.data, "vertices", ()))
            self.assertIn(len(self.wanted[1]["points"]), shown.values())
        self.plays(self.elsewhere("open"))


class Drawn:
    """Stands in for a layout: what a panel draws, as texts and names of operators."""

    def __init__(self):
        self.told = []

    @classmethod
    def of(cls, draw, *arguments):
        layout = cls()
        draw(layout, *arguments)
        return layout.told

    def column(self, **_):
        return self

    row = column

    def label(self, text="", **_):
        self.told.append(text)

    def operator(self, name, *_, **__):
        self.told.append(name)
        return self

    operator_menu_enum = operator


if __name__ == "__main__":
    main()
