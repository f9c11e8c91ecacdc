"""What Blender's own Alembic and USD exporters write of a baked shot. Here files are written, with what they are to hold;
run_in_blender.py has read_host_exports.py read them back, in a Python of its own."""
import bpy
import numpy as np

from addon_case import AddonCase, FOLDER, addon, main

FORMATS = {"ABC": ".abc", "USD": ".usdc"}


class HostExports(AddonCase):
    def shot(self):
        """A block of two materials that breaks, and a box that falls and turns."""
        block = self.cube()
        for name in ("Paint", "Primer"):
            block.data.materials.append(bpy.data.materials.new(name))
        block.data.polygons[0].material_index = 1
        tree, nodes = self.tree(block)
        crate = self.cube(size=0.3, location=(1, 0, 1), name="Crate")
        crate.scale, crate.rotation_euler = (1, 2, 0.5), (0.3, 0.2, 0.1)
        bpy.context.view_layer.update()
        node = self.node(tree, "rigid_body", shape="box", mass=5, velocity=(0.5, 0, -1), angular_velocity=(100, 300, 50))
        node.source, node.object = "OBJECT", crate
        self.connect(node, "rigid_body", nodes["solver"], "rigid_bodies")
        self.results(tree)
        self.assertEqual(self.bake(tree), {"FINISHED"})
        return tree

    def shown(self, tree):
        """What the bake holds at each frame: corners and velocities of triangles, their materials, corners of the box."""
        state = addon("base.core").sunder().Graph.load(str(self.cached(tree) / "graph.json"))
        twin, wanted = bpy.data.objects["Crate moving"], {}
        rest = np.array([(*v.co, 1) for v in twin.data.vertices])
        files = sorted((self.cached(tree) / "mesh").glob("deformer.*.ply"))
        for frame, path in enumerate(files, 1):
            mesh = addon("base.bake_reader").read_mesh_frame(str(path))
            self.scene.frame_set(frame)
            wanted[f"corners{frame}"] = mesh.positions[mesh.triangles]
            wanted[f"velocities{frame}"] = mesh.velocities[mesh.triangles]
            wanted[f"triangles{frame}"], wanted[f"material{frame}"] = mesh.triangles, mesh.material
            wanted[f"interface{frame}"] = mesh.interface
            wanted[f"crate{frame}"] = (rest @ np.array(twin.matrix_world).T)[:, :3]
            center = wanted[f"crate{frame}"].mean(0)
            np.testing.assert_allclose(center, state.evaluate("solver.state", frame).rigid_position[0], atol=1e-5)
        counts = [len(wanted[f"material{f}"]) for f in range(1, 7)]
        self.assertEqual((len(files), len(set(counts)) > 1, counts[0] < counts[-1]), (6, True, True))  # it tore
        self.assertGreater(np.abs(wanted["crate6"] - wanted["crate1"]).max(), 0.2)
        return wanted

    def write(self, case, tree, write):
        """`write` is called with format and path; what the readers are to find lies beside what it wrote."""
        folder = FOLDER / "read_back" / case
        folder.mkdir(parents=True)
        for kind, ending in FORMATS.items():
            self.assertEqual(write(kind, folder / f"shot{ending}"), {"FINISHED"})
        np.savez(folder / "wanted.npz", **self.shown(tree))

    def by_file_menu(self, tree):
        """As File > Export does with the results selected."""
        def write(kind, path):
            for thing in bpy.context.view_layer.objects:
                thing.select_set(thing.sunder.tree == tree)
            if kind == "ABC":
                return bpy.ops.wm.alembic_export(filepath=str(path), selected=True, start=1, end=6, face_sets=True,
                                                 as_background_job=False)
            return bpy.ops.wm.usd_export(filepath=str(path), selected_objects_only=True, export_animation=True)

        return write

    def test_files_hold_the_shot(self):
        tree = self.shot()
        known = addon("exports.export").host_formats()
        if not known:
            for kind in FORMATS:
                with self.assertRaisesRegex(RuntimeError, "built without"):
                    bpy.ops.sunder.export_host(tree=tree.name, filepath=str(self.folder / "shot"), format=kind)
            return
        self.assertEqual(known, list(FORMATS))
        things = {o.name: (len(o.modifiers), len(o.constraints), [s.material for s in o.material_slots])
                  for o in bpy.data.objects if o.sunder.tree}
        meshes = set(bpy.data.meshes)

        def by_operator(**options):
            def write(kind, path):
                return bpy.ops.sunder.export_host(tree=tree.name, filepath=str(path), format=kind, **options)

            return write

        self.write("apart", tree, by_operator())
        self.write("whole", tree, by_operator(split_inside=False))
        self.assertEqual(things, {o.name: (len(o.modifiers), len(o.constraints), [s.material for s in o.material_slots])
                                  for o in bpy.data.objects if o.sunder.tree})
        self.assertEqual(meshes, set(bpy.data.meshes))
        bpy.ops.sunder.split_inside(tree=tree.name)
        self.write("apart_by_file_menu", tree, self.by_file_menu(tree))

    def test_blenders_own_import_of_our_usd_knows_break_surfaces_by_their_interface(self):
        """It takes materials of the first frame, too; the attribute arrives."""
        tree = self.shot()
        frame = addon("base.bake_reader").read_mesh_frame(str(self.cached(tree) / "mesh/deformer.0006.ply"))
        path, before = str(self.folder / "shot.usda"), set(bpy.data.objects)
        self.assertEqual(bpy.ops.sunder.export(tree=tree.name, filepath=path), {"FINISHED"})
        if not addon("base.blender_versions").has_operator("wm", "usd_import"):
            self.assertEqual(addon("exports.export").host_formats(), [])  # a build without USD
            return
        bpy.ops.wm.usd_import(filepath=path)
        thing, = (o for o in set(bpy.data.objects) - before if o.name.startswith("Block"))
        self.scene.frame_set(6)
        mesh = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        self.assertEqual(len(mesh.polygons), len(frame.triangles))
        interface = np.array([value.value for value in mesh.attributes["interface"].data])
        np.testing.assert_array_equal(interface, frame.interface)
        self.assertNotIn(2, {p.material_index for p in mesh.polygons})  # the host's own fault

    def test_results_of_older_files_move_once_these_are_opened(self):
        tree = self.shot()
        block, crate = bpy.data.objects["Block fractured"], bpy.data.objects["Crate moving"]
        block.modifiers.clear()  # as they were made before
        crate.constraints.clear()
        self.save()
        self.reopen()
        block, crate = bpy.data.objects["Block fractured"], bpy.data.objects["Crate moving"]
        self.assertEqual((len(block.modifiers), len(crate.constraints)), (1, 1))
        tree = crate.sunder.tree
        if addon("exports.export").host_formats():
            self.write("whole_by_file_menu", tree, self.by_file_menu(tree))
        crate.constraints.clear()
        bpy.ops.sunder.add_results(tree=tree.name)
        self.assertEqual(len(crate.constraints), 1)

    def test_what_makes_it_count_as_moving_does_not_move_it(self):
        tree = self.shot()
        twin = bpy.data.objects["Crate moving"]
        self.scene.frame_set(5)
        held = np.array(twin.matrix_world)
        twin.constraints.clear()
        self.scene.frame_set(4)
        self.scene.frame_set(5)
        np.testing.assert_array_equal(held, twin.matrix_world)


class Parts(AddonCase):
    def test_parts_are_the_whole_at_every_frame_and_come_back_together(self):
        block = self.cube()
        block.data.materials.append(bpy.data.materials.new("Paint"))
        tree, _ = self.tree(block)
        thing, = self.results(tree)
        thing.material_slots[1].link = "OBJECT"
        thing.material_slots[1].material = bpy.data.materials.new("Torn")
        self.bake(tree)

        def corners(o):
            return np.array([[o.data.vertices[v].co for v in p.vertices] for p in o.data.polygons]).reshape(-1, 3, 3)

        whole, meshes = {}, set(bpy.data.meshes)
        for frame in (1, 6):
            self.scene.frame_set(frame)
            whole[frame] = corners(thing)
        self.assertEqual(bpy.ops.sunder.split_inside(tree=tree.name), {"FINISHED"})
        inside = bpy.data.objects["Block fractured inside"]
        materials = [[s.material and s.material.name for s in o.material_slots] for o in (thing, inside)]
        self.assertEqual(materials, [["Paint", None], ["Torn"]])
        addon("bake.looks").write(tree, str(self.cached(tree)))  # exports of the bake tell the same of it
        self.assertIn('"Torn"', (self.cached(tree) / "looks.json").read_text())
        for frame in (1, 6, 1, 6):
            self.scene.frame_set(frame)
            parts = [corners(o) for o in (thing, inside)]
            np.testing.assert_array_equal(np.concatenate(parts), whole[frame])
            self.assertEqual([len(thing.data.vertices), len(inside.data.vertices)],
                             [len(np.unique(p.reshape(-1, 3), axis=0)) if p.size else 0 for p in parts])
            self.assertEqual(len(parts[1]) > 0, frame == 6)
            self.assertFalse(any(a.value for a in thing.data.attributes["interior"].data))
        self.assertEqual(bpy.ops.sunder.split_inside(tree=tree.name), {"CANCELLED"})  # once is enough
        self.assertEqual(bpy.ops.sunder.unite_inside(tree=tree.name), {"FINISHED"})
        np.testing.assert_array_equal(corners(thing), whole[6])
        self.assertEqual([s.material.name for s in thing.material_slots], ["Paint", "Torn"])
        self.assertEqual(meshes, set(bpy.data.meshes))


if __name__ == "__main__":
    main()
