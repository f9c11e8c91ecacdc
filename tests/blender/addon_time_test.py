"""Frame rates and first frames of Blender's scenes, as bakes have them."""
from addon_case import AddonCase, addon, main


class TimeTest(AddonCase):
    def compiled(self, tree):
        return addon("bake.compiler").compile_tree(tree, self.scene).description

    def test_the_rate_is_the_ratio_that_blenders_base_stands_for(self):
        tree, _ = self.tree()
        for fps, base, wanted in ((24, 1, 24), (24, 1.001, [24000, 1001]), (30, 1.001, [30000, 1001]), (60, 1.001, [60000, 1001]),
                                  (24, 1.2, 20), (25, 2, [25, 2]), (24, 1.0833333, [8000000, 361111]), (97, 1.083331, 89.53865)):
            self.scene.render.fps, self.scene.render.fps_base = fps, base
            self.assertEqual(self.compiled(tree)["frame_rate"], wanted, (fps, base))

    def test_a_shot_of_a_ratio_is_baked_and_stays_up_to_date(self):
        self.scene.render.fps, self.scene.render.fps_base = 24, 1.001
        tree, _ = self.tree()
        self.bake(tree)
        self.assertEqual(self.manifest(tree).graph["frame_rate"], [24000, 1001])
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["complete", False])

    def test_a_shot_may_begin_at_zero_before_it_or_far_behind(self):
        tree, _ = self.tree()
        result, = self.results(tree)
        shapes = []
        for start in (1, 0, -3, 1001):
            tree.use_scene_range, tree.frame_start, tree.frame_end = False, start, start + 5  # scenes begin at 0 at least
            self.bake(tree, start="RESTART")
            self.assertEqual(self.manifest(tree).numbers, list(range(start, start + 6)))
            played = []
            for frame in range(start, start + 6):
                self.scene.frame_set(frame)
                played.append([tuple(v.co) for v in result.data.vertices])
            self.assertNotEqual(played[0], played[5])
            shapes.append(played)
        self.assertTrue(all(played == shapes[0] for played in shapes))


if __name__ == "__main__":
    main()
