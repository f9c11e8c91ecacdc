"""A shot that Sunder 0.1.0 baked and saved in Blender 3.4 (tests/data/version_0_1_0) opens, plays, and is baked anew when asked."""
import shutil
from pathlib import Path

import bpy
import numpy as np

from addon_case import AddonCase, addon, main, positions

OLD = Path(__file__).resolve().parents[1] / "data/version_0_1_0/shot"


class OldFiles(AddonCase):
    def setUp(self):
        super().setUp()
        shutil.copytree(OLD, self.folder, dirs_exist_ok=True)
        self.reopen()
        self.shot, = addon("tree.trees").trees()
        self.result, = addon("tree.trees").result_objects()

    def written(self, frame):
        """Points of a frame as the file on the disk has them."""
        name = f"mesh/deformer.{frame:04}.ply"
        return addon("base.bake_reader").read_mesh_frame(str(self.cached(self.shot) / name)).positions

    def test_its_frames_play(self):
        for frame in (1, 2, 3):
            self.scene.frame_set(frame)
            np.testing.assert_array_equal(positions(self.result), self.written(frame))
        self.assertEqual(self.result.data.materials[0].name, "Sunder Clay")

    def test_baked_again_it_begins_anew(self):
        self.scene.frame_end = 4
        self.bake(self.shot)
        baked = self.manifest(self.shot)
        self.assertEqual((baked.version, baked.numbers), (addon("base.core").sunder().version(), [1, 2, 3, 4]))
        self.scene.frame_set(4)
        self.assertGreater(np.abs(positions(self.result) - self.written(1)[:len(positions(self.result))]).max(), 0.01)

    def test_what_it_leaves_out_means_what_it_meant(self):
        """Defaults are written out in a bake: those of then, though new trees damp otherwise."""
        body = next(n for n in self.shot.nodes if n.sunder_type == "body").graph_name
        before = self.manifest(self.shot).graph["nodes"][body]
        self.bake(self.shot, start="RESTART")
        after = self.manifest(self.shot)
        self.assertEqual(after.version, addon("base.core").sunder().version())
        self.assertEqual({name: after.graph["nodes"][body][name] for name in before}, before)


if __name__ == "__main__":
    main()
