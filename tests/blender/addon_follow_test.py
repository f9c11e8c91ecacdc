"""A body follows its object, rigged and animated, until it is let go: what Blender shows is what is baked."""
import math

import bpy
import numpy as np

from addon_case import main, versions
from rigged_case import RiggedCase

LAST = 4  # the frame at which it follows for the last time


class Follow(RiggedCase):
    def following(self, thing, **parameters):
        tree, nodes = self.tree(thing, pieces=12)
        follow = self.node(tree, "follow", frame=LAST + 1, **parameters)
        solver = nodes["solver"]
        bodies = next(s for s in solver.inputs if s.identifier == "bodies")
        for link in list(bodies.links):
            tree.links.remove(link)
        self.connect(nodes["body"], "body", follow, "body")
        self.connect(follow, "body", solver, "bodies")
        return tree, follow, nodes

    def farthest(self, graph, thing, frame):
        """How far the artist's vertices are from those of the baked mesh."""
        wanted, mesh = self.shown(thing, frame), graph.evaluate("deformer.mesh", frame=frame)
        return np.linalg.norm(wanted[:, None] - mesh.positions[None], axis=2).min(axis=1).max()

    def test_a_rigged_body_is_where_blender_has_it_and_is_then_let_go(self):
        thing, _ = self.arm()
        tree, _, _ = self.following(thing, motion="vertices")
        graph = self.graph(tree)
        for frame in (1, 3, LAST):
            self.assertLess(self.farthest(graph, thing, frame), 2e-6, frame)
        self.assertTrue((graph.evaluate("solver.state", frame=LAST).kept == 1).all())
        gone = graph.evaluate("solver.state", frame=LAST + 1)
        self.assertFalse(gone.kept.any())
        self.assertGreater(gone.velocity[:, 0].mean(), 1)
        self.assertLess(gone.velocity[:, 2].mean(), 0)

    def test_an_animated_object_is_followed_as_one(self):
        thing = self.cube(location=(0, 0, 1))
        for frame, x, turn in ((1, 0, 0), (6, 1, 50)):
            thing.location.x, thing.rotation_euler.z = x, math.radians(turn)
            thing.keyframe_insert("location", frame=frame), thing.keyframe_insert("rotation_euler", frame=frame)
        tree, _, _ = self.following(thing)
        graph = self.graph(tree)
        for frame in (1, 2, LAST):
            self.assertLess(self.farthest(graph, thing, frame), 2e-6, frame)

    def test_what_is_baked_needs_no_rig(self):
        thing, rig = self.arm()
        tree, _, _ = self.following(thing, motion="vertices")
        self.bake(tree)
        files = sorted(p.suffix for p in (self.cached(tree) / "inputs").iterdir())
        self.assertEqual(files, [".npy", ".ply"])
        self.assertIs(self.status(tree).is_stale, False)
        rig.pose.bones["high"].keyframe_insert("rotation_euler", frame=3)
        versions().curves_of(rig.animation_data)[0].keyframe_points[1].co.y += 0.2
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, True)

    def plate(self):
        """A flat box of 60 vertices, 1.2 m long."""
        bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 1))
        thing = bpy.context.object
        thing.scale = (1.2, 0.4, 0.1)
        bpy.ops.object.transform_apply(location=False, scale=True, rotation=False)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.subdivide(number_cuts=3)
        bpy.ops.object.mode_set(mode="OBJECT")
        return thing

    def expect_followed(self, thing, moves=0.05):
        """The baked mesh is where Blender has the object, which moves by so much (m), and is let go on."""
        before, after = self.shown(thing, 1), self.shown(thing, LAST)
        self.assertGreater(np.linalg.norm(after - before, axis=1).max(), moves)
        bent = after - after.mean(0) - (before - before.mean(0))
        self.assertGreater(np.linalg.norm(bent, axis=1).max(), 0.3 * moves)  # it is no plain shift
        tree, _, _ = self.following(thing, motion="vertices")
        graph = self.graph(tree)
        for frame in (1, 2, LAST):
            self.assertLess(self.farthest(graph, thing, frame), 2e-6, frame)
        self.assertFalse(graph.evaluate("solver.state", frame=LAST + 1).kept.any())

    def test_shape_keys_are_followed(self):
        thing = self.plate()
        thing.shape_key_add(name="Basis")
        key = thing.shape_key_add(name="Bent")
        for point in key.data:
            point.co.z += 0.5 * point.co.x ** 2
        for frame, value in ((1, 0), (6, 1)):
            key.value = value
            key.keyframe_insert("value", frame=frame)
        self.expect_followed(thing)

    def test_a_cloth_with_its_cache_is_followed(self):
        thing = self.plate()
        held = thing.vertex_groups.new(name="held")
        held.add([v.index for v in thing.data.vertices if v.co.x < -0.5], 1, "REPLACE")
        cloth = thing.modifiers.new("cloth", "CLOTH")
        cloth.settings.vertex_group_mass = "held"
        cloth.settings.tension_stiffness = cloth.settings.shear_stiffness = 50
        cloth.settings.use_internal_springs = True
        cloth.point_cache.frame_start, cloth.point_cache.frame_end = 1, 6
        self.scene.frame_start, self.scene.frame_end = 1, 6
        with bpy.context.temp_override(scene=self.scene, active_object=thing, object=thing, point_cache=cloth.point_cache):
            bpy.ops.ptcache.bake(bake=True)
        self.assertTrue(cloth.point_cache.is_baked)
        self.expect_followed(thing, moves=0.02)

    def test_a_mesh_from_alembic_is_followed(self):
        if not bpy.app.build_options.alembic:
            return  # Debian 12 builds Blender without it
        thing, rig = self.arm()
        bpy.ops.object.select_all(action="DESELECT")
        thing.select_set(True)
        path = str(self.folder / "arm.abc")
        bpy.ops.wm.alembic_export(filepath=path, start=1, end=8, selected=True, flatten=True, evaluation_mode="VIEWPORT")
        wanted = {frame: self.shown(thing, frame) for frame in (1, LAST)}
        for each in (thing, rig):
            bpy.data.objects.remove(each)
        bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)
        read, = (thing for thing in self.scene.objects if any(m.type == "MESH_SEQUENCE_CACHE" for m in thing.modifiers))
        for frame, positions in wanted.items():
            np.testing.assert_allclose(self.shown(read, frame), positions, atol=1e-5)
        self.expect_followed(read)

    def test_another_number_of_vertices_is_refused_on_the_node_with_the_frame(self):
        thing = self.cube()
        levels = thing.modifiers.new("more", "SUBSURF")
        for frame, value in ((1, 1), (3, 2)):
            levels.levels = value
            levels.keyframe_insert("levels", frame=frame)
        tree, follow, _ = self.following(thing, motion="vertices")
        self.refusal(tree)
        self.assertRegex(follow.error, "vertices at frame [23].*must keep their number")

    def test_objects_that_go_by_one_another_are_refused_on_the_node(self):
        thing, other = self.cube(location=(0, 0, 1)), bpy.data.objects.new("Leader", None)
        self.scene.collection.objects.link(other)
        thing.constraints.new("COPY_LOCATION").target = other
        tree, _, _ = self.following(thing)
        self.assertEqual(self.bake(tree), {"FINISHED"})
        back = other.constraints.new("COPY_ROTATION")
        back.target = thing
        self.refusal(tree)
        self.assertRegex(self.status_of_nodes(tree), "'Leader'.*by one another")
        back.mute = True
        self.assertEqual(self.bake(tree), {"FINISHED"})

    def test_an_object_that_goes_by_what_its_tree_makes_is_refused_on_the_node(self):
        thing = self.cube(location=(0, 0, 1))
        tree, _, _ = self.following(thing, motion="vertices")
        result, = self.results(tree)
        self.assertEqual(self.bake(tree), {"FINISHED"})
        clings = thing.modifiers.new("clings", "SHRINKWRAP")
        clings.target = result
        self.refusal(tree)
        self.assertRegex(self.status_of_nodes(tree), f"goes by '{result.name}', which shows what this tree makes")
        thing.modifiers.remove(clings)
        self.assertEqual(self.bake(tree), {"FINISHED"})

    def status_of_nodes(self, tree):
        return " ".join(node.error for node in tree.nodes)

    def test_numbers_count_where_the_object_does_not(self):
        tree, follow, _ = self.following(self.cube())
        follow.from_object = False
        follow.set_parameters(position=(0, 0, 2))
        self.assertEqual(self.compiled(tree).description["nodes"]["follow"]["position"], [0, 0, 2])
        follow.from_object = True
        self.assertEqual(self.compiled(tree).description["nodes"]["follow"]["position"], [0, 0, 0.5])


main()
