"""Exports from the tree, and back into Blender: point caches by Mesh Cache, glTF by the importer, at every frame."""
import os

import bpy
import numpy as np
from mathutils import Matrix

from addon_case import AddonCase, addon, main, positions, versions

if not hasattr(np, "bool"):  # Debian's glTF importer is older than its numpy
    np.bool = bool


def evaluated_positions(thing):
    return positions(thing.evaluated_get(bpy.context.evaluated_depsgraph_get()))


class Exports(AddonCase):
    def constant_tree(self, **material):
        tree, nodes = self.tree(material={"toughness": 0.01, **material})
        nodes["deformer"].set_parameters(topology="constant")
        return tree, nodes

    def frames(self, tree, name="deformer"):
        files = sorted((self.cached(tree) / "mesh").glob(f"{name}.*.ply"))
        return [addon("base.bake_reader").read_mesh_frame(str(p)) for p in files]

    def test_a_point_cache_of_a_bake_node_plays_on_its_mesh(self):
        tree, nodes = self.constant_tree()
        out = self.node(tree, "bake_mesh", path="cache/block.####.ply", export="pc2")
        self.connect(nodes["deformer"], "mesh", out, "mesh")
        self.assertEqual(self.bake(tree), {"FINISHED"})
        frames, folder = self.frames(tree), self.cached(tree) / "cache"
        self.assertGreater(len({int(f.hidden.sum()) for f in frames}), 1)  # it tore
        bpy.ops.wm.obj_import(filepath=str(folder / "block.obj"), forward_axis="Y", up_axis="Z")
        thing = bpy.context.object
        np.testing.assert_array_equal(positions(thing), frames[0].positions)
        played = thing.modifiers.new("cache", "MESH_CACHE")
        played.cache_format, played.filepath = "PC2", str(folder / "block.pc2")
        played.forward_axis, played.up_axis, played.frame_start = "POS_Y", "POS_Z", 1
        moved = 0
        for number, frame in enumerate(frames, 1):
            self.scene.frame_set(number)
            shown = evaluated_positions(thing)
            np.testing.assert_array_equal(shown, frame.positions)
            moved = max(moved, np.abs(shown - frames[0].positions).max())
        self.assertGreater(moved, 0.05)
        bpy.ops.sunder.free_bake(tree=tree.name)
        self.assertFalse(folder.exists())

    def test_gltf_fragments_move_as_the_bake_does(self):
        tree, nodes = self.constant_tree(toughness=1e-6, youngs_modulus=1e7)
        nodes["body"].set_parameters(angular_velocity=(200, 400, 100), velocity=(1, 0, 8))
        self.assertEqual(self.bake(tree), {"FINISHED"})
        frames = self.frames(tree)
        path = str(self.folder / "block.glb")
        self.assertEqual(bpy.ops.sunder.export(tree=tree.name, filepath=path, tolerance=0.02), {"FINISHED"})
        before = set(bpy.data.objects)
        self.scene.render.fps = 24
        bpy.ops.import_scene.gltf(filepath=path)
        imported = [o for o in bpy.data.objects if o not in before and o.type == "MESH"]
        pieces = [o for o in imported if o.parent]
        self.assertEqual([o.name for o in imported if not o.parent], ["Floor"])
        self.assertEqual(len(pieces), len(np.unique(frames[0].fragment)))
        worst = 0
        for number, frame in enumerate(frames):
            self.scene.frame_set(number)  # the importer's time 0 is frame 0
            for piece in pieces:
                fragment = int(piece.name.rsplit(".", 1)[1])
                own = frame.positions[np.unique(frame.triangles[frame.fragment == fragment])]
                local = positions(piece)
                world = np.array(piece.matrix_world)
                shown = local @ world[:3, :3].T + world[:3, 3]
                apart = np.linalg.norm(shown[:, None] - own[None], axis=2)
                worst = max(worst, apart.min(1).max(), apart.min(0).max())
        self.assertLess(worst, 1e-5 + self.deviation(frames))
        self.assertGreater(np.abs(frames[-1].positions - frames[0].positions).max(), 0.05)

    def deviation(self, frames):
        """How far vertices are from the best rigid motion of their fragment, m."""
        worst = 0
        for fragment in np.unique(frames[0].fragment):
            own = np.unique(frames[0].triangles[frames[0].fragment == fragment])
            local = frames[0].positions[own].astype(float)
            local -= local.mean(0)
            for frame in frames:
                now = frame.positions[own].astype(float)
                now -= now.mean(0)
                u, _, v = np.linalg.svd(now.T @ local)
                rotation = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
                worst = max(worst, np.linalg.norm(now - local @ rotation.T, axis=1).max())
        return worst

    def solids_tree(self):
        """A falling block with a free anvil (scaled, its origin off its middle) and a turning ramp, on a floor object."""
        tree, nodes = self.constant_tree(toughness=1e-6, youngs_modulus=1e7)
        iron = bpy.data.materials.new("Iron")
        versions().turn_on_nodes(iron)
        iron.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1
        bpy.ops.mesh.primitive_monkey_add(size=0.3, location=(1, 0, 1), rotation=(0.3, 0.2, 0.1))
        anvil = bpy.context.object
        anvil.name, anvil.scale = "Anvil", (1, 2, 0.5)
        anvil.data.transform(Matrix.Translation((0.2, 0, 0.1)))
        anvil.data.materials.append(iron)
        bpy.ops.mesh.primitive_cylinder_add(radius=0.2, depth=1, location=(-1, 0, 1))
        ramp = bpy.context.object
        ramp.name = "Turning Ramp"
        for frame, angle in ((1, 0), (6, 1)):
            ramp.rotation_euler = (angle, 0, 0)
            ramp.keyframe_insert("rotation_euler", frame=frame)
        bpy.ops.mesh.primitive_plane_add(size=4)
        bpy.context.object.name = "Ground"
        free, turning, ground = self.node(tree, "rigid_body"), self.node(tree, "collider"), nodes["collider"]
        for node, thing, shape in ((free, anvil, "box"), (turning, ramp, "mesh"), (ground, bpy.data.objects["Ground"], "plane")):
            node.source, node.object, node.shape = "OBJECT", thing, shape
        free.set_parameters(angular_velocity=(100, 300, 50), velocity=(0, 0, 2))
        turning.set_parameters(resolution=24)
        self.connect(free, "rigid_body", nodes["solver"], "rigid_bodies")
        self.connect(turning, "collider", nodes["solver"], "colliders")
        return tree

    def test_gltf_holds_what_the_artist_sees(self):
        tree = self.solids_tree()
        self.results(tree)
        self.assertEqual(self.bake(tree), {"FINISHED"})
        twin = bpy.data.objects["Anvil moving"]
        wanted = {"Anvil": twin, "Turning Ramp": bpy.data.objects["Turning Ramp"], "Ground": bpy.data.objects["Ground"]}
        path = str(self.folder / "shot.glb")
        self.assertEqual(bpy.ops.sunder.export(tree=tree.name, filepath=path, tolerance=0.5), {"FINISHED"})
        before = set(bpy.data.objects)
        self.scene.render.fps = 24
        bpy.ops.import_scene.gltf(filepath=path)
        imported = {o.name.removesuffix(".001"): o for o in bpy.data.objects if o not in before}
        self.assertIn("Block fractured", imported)
        self.assertEqual(imported["Anvil"].data.materials[0].name.removesuffix(".001"), "Iron")
        self.assertIn("Sunder Interior.001", bpy.data.materials)
        places = []
        for frame in range(1, 7):
            corners = {}
            self.scene.frame_set(frame)
            for name, thing in wanted.items():
                corners[name] = np.array([thing.matrix_world @ v.co for v in thing.data.vertices])
            self.scene.frame_set(frame - 1)  # the importer's time 0 is frame 0
            for name, thing in wanted.items():
                shown = np.array([imported[name].matrix_world @ v.co for v in imported[name].data.vertices])
                apart = np.linalg.norm(shown[:, None] - corners[name][None], axis=2)
                self.assertLess(max(apart.min(0).max(), apart.min(1).max()), 1e-4, f"{name} at {frame}")
            places.append(corners)
        for name, moves in (("Anvil", True), ("Turning Ramp", True), ("Ground", False)):
            self.assertEqual(np.abs(places[0][name] - places[-1][name]).max() > 0.1, moves)
        folder = self.cached(tree)
        self.assertEqual(len(list((folder / "looks").iterdir())), 3)
        bpy.ops.sunder.free_bake(tree=tree.name)
        self.assertFalse(folder.exists())

    def test_a_colour_that_something_gives_is_told_to_vary(self):
        paint = bpy.data.materials.new("Paint")
        paint.diffuse_color = (0.25, 0.5, 0.75, 1)
        versions().turn_on_nodes(paint)
        nodes, links = paint.node_tree.nodes, paint.node_tree.links
        shader = nodes["Principled BSDF"]
        shader.inputs["Base Color"].default_value = (1, 0.5, 0, 1)
        told = addon("bake.looks").surface(paint)
        self.assertEqual((told["color"], "color_varies" in told), ([1, 0.5, 0, 1], False))
        links.new(nodes.new("ShaderNodeVertexColor").outputs["Color"], shader.inputs["Base Color"])
        told = addon("bake.looks").surface(paint)
        self.assertEqual((told["color"], told["color_varies"]), ([0.25, 0.5, 0.75, 1], True))
        if bpy.app.version < (5, 0, 0):  # from then on nodes count always
            paint.use_nodes = False
            self.assertNotIn("color_varies", addon("bake.looks").surface(paint))

    def test_formats_are_told_by_the_ending(self):
        tree, _ = self.constant_tree()
        self.bake(tree)
        for name in ("shot.usda", "shot.pc2", "shot.####.obj", "shot.####.ply"):
            path = str(self.folder / "out" / name)
            self.assertEqual(bpy.ops.sunder.export(tree=tree.name, filepath=path, node="deformer"), {"FINISHED"})
        wanted = ["shot.usda", "shot.pc2", "shot.obj"]
        wanted += [f"shot.000{i}.{kind}" for i in range(1, 7) for kind in ("obj", "ply")]
        self.assertEqual(sorted(os.listdir(self.folder / "out")), sorted(wanted))
        with self.assertRaisesRegex(RuntimeError, ".abc"):
            bpy.ops.sunder.export(tree=tree.name, filepath=str(self.folder / "shot.abc"))

    def test_what_blender_cannot_write_is_refused_and_the_scene_left_alone(self):
        tree, _ = self.constant_tree()
        thing, = self.results(tree)
        self.bake(tree)
        before = [m.name for m in thing.modifiers]
        known = addon("exports.export").host_formats()
        for kind in ("ABC", "USD"):
            path = self.folder / f"host.{kind}"
            if kind in known:
                self.assertEqual(bpy.ops.sunder.export_host(tree=tree.name, filepath=str(path), format=kind), {"FINISHED"})
            else:
                with self.assertRaisesRegex(RuntimeError, "built without"):
                    bpy.ops.sunder.export_host(tree=tree.name, filepath=str(path), format=kind)
        self.assertEqual([m.name for m in thing.modifiers], before)


if __name__ == "__main__":
    main()
