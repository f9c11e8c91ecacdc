"""Long lists of verbs, chosen by seeds: whatever an artist does in whatever order, what is shown is what is baked."""
import itertools
import os
import random

import bpy
import numpy as np

from addon_case import AddonCase, addon, main, positions

N_VERBS = 40


class Verbs(AddonCase):
    def setUp(self):
        super().setUp()
        self.scene.frame_end = 4
        bpy.context.preferences.edit.use_global_undo = True
        self.results(self.tree(pieces=4)[0])
        render = self.scene.render
        render.engine, render.resolution_x, render.resolution_y = "BLENDER_WORKBENCH", 16, 16
        self.scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        self.scene.collection.objects.link(self.scene.camera)
        self.names = itertools.count()
        self.file, self.is_keyed = None, False
        bpy.ops.ed.undo_push(message="begin")

    @property
    def shot(self):
        return addon("tree.trees").result_objects()[0].sunder.tree

    def part(self, node_type):
        return next(n for n in self.shot.nodes if n.sunder_type == node_type)

    # The verbs. Each is whole in itself; `self.random` chooses among its ways.

    def verb_bake(self):
        self.bake(self.shot)
        now = self.status(self.shot)
        self.assertEqual([now.state, now.is_stale], ["complete", False])

    def verb_stop(self):
        """A bake that is stopped at once, or when half of it is done."""
        job = addon("bake.bake_job").BakeJob(self.shot, self.scene)
        half = self.random.choice((0.0, 0.5))
        job.start()
        while job.is_running and job.fraction < half:
            job.wait(0.002)
        job.cancel()
        job.finish(self.shot)
        addon("results.player").show_all(self.scene)

    def verb_scrub(self):
        self.scene.frame_set(self.random.randint(-1, 6))

    def verb_change(self):
        self.part("body").toughness = self.random.choice((0.02, 0.1, 0.4))
        bpy.ops.ed.undo_push(message="toughness")

    def verb_move(self):
        self.part("mesh_file").object.location.x = self.random.choice((0.0, 0.25))
        bpy.context.view_layer.update()
        bpy.ops.ed.undo_push(message="move")

    def verb_shape(self):
        thing = self.part("mesh_file").object
        thing.data.vertices[0].co.x = self.random.choice((-0.2, -0.25))
        thing.data.update()
        bpy.context.view_layer.update()
        bpy.ops.ed.undo_push(message="shape")

    def verb_key(self):
        self.is_keyed = True
        self.part("body").use_toughness = True
        self.part("body").keyframe_insert("toughness", frame=self.random.randint(1, 4))
        addon("base.runtime").signatures.clear()  # keys set by a script send no event
        bpy.ops.ed.undo_push(message="key")

    def verb_range(self):
        self.scene.frame_end = self.random.randint(3, 5)

    def verb_undo(self):
        if bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()

    def verb_redo(self):
        if bpy.ops.ed.redo.poll():
            bpy.ops.ed.redo()

    def verb_save(self):
        self.file = self.file or f"shot{next(self.names)}.blend"
        self.save(self.file)

    def verb_save_as(self):
        folder = self.random.choice(("", "", "elsewhere"))
        os.makedirs(self.folder / folder, exist_ok=True)
        self.file = os.path.join(folder, f"shot{next(self.names)}.blend")
        self.save(self.file)

    def verb_reopen(self):
        if self.file:
            self.reopen(self.file)

    def verb_free(self):
        bpy.ops.sunder.free_bake(tree=self.shot.name)
        self.assertEqual(self.status(self.shot).state, "none")

    def verb_rename(self):
        self.shot.name = f"Tree {next(self.names)}"
        self.part("body").name = f"Body {next(self.names)}"
        bpy.ops.ed.undo_push(message="rename")

    def verb_twin(self):
        """The result plays a copy of the tree from now on."""
        addon("tree.trees").result_objects()[0].sunder.tree = self.shot.copy()
        addon("results.player").show_all(self.scene)
        bpy.ops.ed.undo_push(message="twin")

    def verb_render(self):
        self.scene.render.filepath = str(self.folder / "picture.png")
        bpy.ops.render.render(write_still=True)

    # What holds after each.

    def check(self):
        self.assertEqual(addon("base.runtime").handler_errors, [])
        manifest, folder = self.manifest(self.shot), self.cached(self.shot)
        if manifest is None:
            return
        sunder = addon("base.core").sunder()
        self.assertEqual(sunder.verify(str(folder))["faults"][: -1 if len(manifest.numbers) < manifest.interval[1] else None], [])
        if not manifest.numbers:
            return
        frame = manifest.shown(self.scene.frame_current)
        file = addon("base.bake_reader").read_mesh_frame(str(folder / manifest.frames[frame]["deformer:bake"]))
        thing = addon("tree.trees").result_objects()[0]
        np.testing.assert_array_equal(positions(thing), file.positions)
        self.assertEqual(len(thing.data.polygons), len(file.triangles))
        # The quick signature against the whole graph, mesh by mesh and frame by frame.
        graph = sunder.Graph.from_dict(addon("bake.compiler").compile_tree(self.shot, self.scene).description)
        is_same = addon("bake.bake_job")._is_same(manifest, graph, sunder.version())
        if is_same and self.is_keyed:
            return  # keys that change no value may mark a bake as out of date; the reverse may never be
        self.assertIs(self.status(self.shot).is_stale, not is_same)

    def play(self, seed):
        self.random = random.Random(seed)
        verbs = sorted(name for name in dir(self) if name.startswith("verb_"))
        weights = [{"verb_bake": 3, "verb_scrub": 2, "verb_change": 2, "verb_undo": 2, "verb_stop": 2}.get(v, 1) for v in verbs]
        told = []
        for verb in self.random.choices(verbs, weights, k=N_VERBS):
            told.append(verb.removeprefix("verb_"))
            with self.subTest(verbs=" ".join(told)):
                getattr(self, verb)()
                self.scene = bpy.context.scene
                self.check()

    def test_seed_1(self):
        self.play(1)

    def test_seed_2(self):
        self.play(2)

    def test_seed_22(self):
        self.play(22)


if __name__ == "__main__":
    main()
