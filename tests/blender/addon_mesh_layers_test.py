"""What an artist's mesh carries arrives on the result: UV maps, attributes of all kinds, vertex groups, by their names."""
import bpy
import numpy as np

from addon_case import ObjectCase, addon, attribute, main


def heat(p):
    return p @ np.array([1.0, -2.0, 3.0]) + 0.5


def values_of(data, field, width, dtype=np.float32):
    values = np.empty(len(data) * width, dtype)
    data.foreach_get(field, values)
    return values.reshape(-1, width) if width > 1 else values


def weights(thing, name):
    """(v,) weights, 0 outside, and how many vertices are in the group."""
    index, mesh = thing.vertex_groups[name].index, thing.data
    held = [{g.group: g.weight for g in v.groups} for v in mesh.vertices]
    return np.array([h.get(index, 0) for h in held]), sum(index in h for h in held)


class Layers(ObjectCase):
    def source(self):
        thing = self.cube()
        mesh, points = thing.data, np.array([v.co for v in thing.data.vertices])
        for name in ("Wall .001", "Größe"):
            mesh.uv_layers.new(name=name)
        for k, map_ in enumerate(mesh.uv_layers):
            for loop, uv in zip(mesh.loops, map_.data):
                uv.uv = points[loop.vertex_index][[0, 1]] + k + loop.index // 4  # each side an island
        mesh.uv_layers["Wall .001"].active_render = True
        mesh.uv_layers.active = mesh.uv_layers["Größe"]
        for name, kind, domain in (("Col", "BYTE_COLOR", "CORNER"), ("Färbung", "FLOAT_COLOR", "POINT")):
            mesh.color_attributes.new(name, kind, domain)
        mesh.color_attributes.active_color_index = mesh.color_attributes.find("Färbung")
        mesh.color_attributes.render_color_index = mesh.color_attributes.find("Col")

        def add(name, kind, domain, field, values):
            mesh.attributes.new(name, kind, domain)
            mesh.attributes[name].data.foreach_set(field, np.ascontiguousarray(values).ravel())

        colors = np.concatenate([points + 0.5, np.ones((8, 1))], 1).astype(np.float32)
        mesh.color_attributes["Färbung"].data.foreach_set("color", colors.ravel())
        add("heat map.001", "FLOAT", "POINT", "value", heat(points).astype(np.float32))
        add("two", "FLOAT2", "POINT", "vector", points[:, :2].astype(np.float32))
        add("arrow", "FLOAT_VECTOR", "CORNER", "vector", np.repeat(np.eye(3), 8, 0).astype(np.float32))
        add("number", "INT", "FACE", "value", 2_000_000_001 + np.arange(6, dtype=np.int32))
        add("small", "INT8", "FACE", "value", np.arange(-3, 3, dtype=np.int32))
        add("top", "BOOLEAN", "POINT", "value", points[:, 2] > 0)
        add("rim", "FLOAT", "POINT", "value", np.ones(8, np.float32))  # a name of results' own
        add("along edges", "FLOAT", "EDGE", "value", np.ones(12, np.float32))
        mesh.attributes.new(".internal", "FLOAT", "POINT")
        for name in ("Leg.L", "Nobody", "Spine"):
            thing.vertex_groups.new(name=name)
        for v, p in enumerate(points):
            thing.vertex_groups["Leg.L"].add([v], p[2] / 0.4 + 0.5, "REPLACE")  # 0 below, 1 above
            thing.vertex_groups["Spine"].add([v], 1, "REPLACE")
        thing.vertex_groups.active_index = 1
        return thing

    def check_frame(self, result):
        mesh = result.data
        inner, corner_points = attribute(result, "interior"), np.array([p.vertices for p in mesh.polygons])
        rest = attribute(result, "rest_position").astype(np.float64)  # in the source's own coordinates
        outer = np.unique(corner_points[~inner])
        within = np.setdiff1d(np.arange(len(rest)), outer)
        self.assertEqual([u.name for u in mesh.uv_layers], ["UVMap", "Wall .001", "Größe"])
        self.assertEqual([u.name for u in mesh.uv_layers if u.active_render], ["Wall .001"])
        self.assertEqual(mesh.uv_layers.active.name, "Größe")
        maps = [values_of(u.data, "uv", 2).reshape(-1, 3, 2) for u in mesh.uv_layers]
        there = rest[corner_points[~inner]][..., :2]
        islands = np.rint((maps[0][~inner] - there).mean((1, 2)))  # which side of the cube
        self.assertEqual(set(islands), set(range(6)))
        for k, uvs in enumerate(maps):
            np.testing.assert_allclose(uvs[~inner], there + k + islands[:, None, None], atol=2e-6)
            np.testing.assert_array_equal(uvs[inner], maps[1][inner])  # those of the cut
        colors = mesh.color_attributes
        self.assertEqual({c.name for c in colors}, {"Col", "Färbung"})
        self.assertEqual([colors[colors.render_color_index].name, colors.active_color.name], ["Col", "Färbung"])
        tint = values_of(colors["Färbung"].data, "color", 4)
        self.assertEqual(colors["Färbung"].domain, "POINT")
        np.testing.assert_allclose(tint[outer, :3], rest[outer] + 0.5, atol=1e-6)
        np.testing.assert_array_equal(tint[within], 1)

        np.testing.assert_allclose(attribute(result, "heat map.001")[outer], heat(rest[outer]), atol=1e-6)
        np.testing.assert_array_equal(attribute(result, "heat map.001")[within], 0)
        self.assertEqual(mesh.attributes["two"].domain, "POINT")
        np.testing.assert_allclose(values_of(mesh.attributes["two"].data, "vector", 2)[outer], rest[outer, :2], atol=1e-6)
        arrow = attribute(result, "arrow").reshape(-1, 3, 3)[~inner]  # of two sides each
        np.testing.assert_array_equal(arrow, np.eye(3, dtype=np.float32)[islands.astype(int) // 2][:, None].repeat(3, 1))
        number = attribute(result, "number")
        np.testing.assert_array_equal(number[~inner], 2_000_000_001 + islands)
        np.testing.assert_array_equal(number[inner], 0)
        np.testing.assert_array_equal(attribute(result, "small")[~inner], islands - 3)
        top = attribute(result, "top")
        far = np.abs(rest[outer, 2]) > 0.19  # of each corner where it is the nearest
        np.testing.assert_array_equal(top[outer][far], rest[outer, 2][far] > 0)
        self.assertEqual({"along edges", ".internal"} & set(mesh.attributes.keys()), set())
        self.assertEqual(mesh.attributes["rim"].domain, "CORNER")

        self.assertEqual([g.name for g in result.vertex_groups], ["Leg.L", "Nobody", "Spine"])
        self.assertEqual(result.vertex_groups.active.name, "Nobody")
        leg, n = weights(result, "Leg.L")
        np.testing.assert_allclose(leg[outer], rest[outer, 2] / 0.4 + 0.5, atol=1e-6)
        self.assertEqual(n, np.count_nonzero(leg))
        np.testing.assert_array_equal(weights(result, "Spine")[0][outer], 1)
        self.assertEqual([weights(result, "Nobody")[1], weights(result, "Spine")[1]], [0, len(outer)])
        self.assertFalse(mesh.validate())
        return inner.any(), len(within)

    def test_all_that_the_mesh_carries_arrives_before_and_after_it_breaks(self):
        tree, _ = self.tree(self.source())
        result, = self.results(tree)
        self.bake(tree)
        found = []
        for frame in (1, 6, 2):
            self.scene.frame_set(frame)
            found.append(self.check_frame(result))
        self.assertEqual(found[0], (False, 0))
        self.assertTrue(found[1][0] and found[1][1] > 0)  # it tore, and has vertices within

    def test_constant_topology_carries_the_same(self):
        tree, nodes = self.tree(self.source())
        nodes["deformer"].topology = "constant"
        result, = self.results(tree)
        self.bake(tree)
        self.check_frame(result)

    def test_only_frames_in_which_something_broke_write_layers(self):
        tree, _ = self.tree(self.source())
        result, = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(1)
        layers, written = addon("scene.mesh_layers"), []
        plain = {name: getattr(layers, name) for name in ("write_uv_maps", "write_attributes", "write_groups")}
        for name, function in plain.items():
            setattr(layers, name, lambda *a, name=name, function=function: (written.append(name), function(*a)))
        try:
            self.scene.frame_set(2)  # in the air: nothing broke
            self.assertEqual(written, [])
            self.check_frame(result)
            self.scene.frame_set(6)
            self.assertEqual(written, list(plain))
        finally:
            for name, function in plain.items():
                setattr(layers, name, function)
        path = str(self.cached(tree) / "mesh/deformer.0001.ply")
        read = lambda: addon("base.bake_reader").read_mesh_frame(path)
        stamp = lambda frame, source: addon("results.result_mesh").face_stamp(frame, source, mesh_name="a mesh")
        for change in (lambda l: l.values.__iadd__(1), lambda l: setattr(l, "name", l.name + "x")):
            before = stamp(read(), "one file")
            self.assertEqual(stamp(read(), "another file"), before)  # of the same faces
            changed = read()
            change(changed.mesh_layers[-1])
            self.assertNotEqual(stamp(changed, "another file"), before)

    def test_bones_that_have_moved_the_mesh_leave_their_groups_behind(self):
        thing = self.source()
        bpy.ops.object.armature_add()
        rig = bpy.context.object
        rig.data.bones[0].name = "Spine"
        thing.modifiers.new("rig", "ARMATURE").object = rig
        tree, nodes = self.tree(thing)
        names = lambda: {l.name for l in self.geometry(tree).mesh_layers if l.kind == "weight"}
        self.assertEqual(names(), {"Leg.L", "Nobody"})
        nodes["mesh_file"].use_modifiers = False
        self.assertEqual(names(), {"Leg.L", "Nobody", "Spine"})

    def geometry(self, tree):
        node = next(n for n in tree.nodes if n.sunder_type == "mesh_file")
        return addon("scene.scene_input").mesh(node, bpy.context.evaluated_depsgraph_get())

    def test_objects_of_a_collection_have_what_any_of_them_has(self):
        parts = bpy.data.collections.new("Parts")
        self.scene.collection.children.link(parts)
        things = [self.cube(name=n, location=(2 * (n == "B"), 0, 0.5)) for n in "AB"]
        for thing in things:
            parts.objects.link(thing)
        a, b = (thing.data for thing in things)
        b.uv_layers[0].name = "Wall"  # renders show it as the first one's
        for mesh, name, kind, domain, value in (
            (a, "number", "INT", "FACE", np.int32(7)), (b, "heat", "FLOAT", "POINT", np.float32(0.25)),
            (a, "mixed", "FLOAT", "POINT", np.float32(0.25)), (b, "mixed", "FLOAT", "FACE", np.float32(0.5)),
            (b, "tint", "FLOAT_COLOR", "FACE", np.float32(0.25)),
        ):
            mesh.attributes.new(name, kind, domain)
            field, width = ("color", 4) if kind == "FLOAT_COLOR" else ("value", 1)
            data = mesh.attributes[name].data
            data.foreach_set(field, np.full(len(data) * width, value))
        things[1].vertex_groups.new(name="number").add(range(8), 0.75, "REPLACE")
        tree, nodes = self.tree(things[0])
        nodes["mesh_file"].source, nodes["mesh_file"].collection = "COLLECTION", parts
        result, = self.results(tree)
        self.bake(tree)
        mesh, inner = result.data, attribute(result, "interior")
        points = np.array([v.co for v in mesh.vertices])
        of_b = points[:, 0] > 1
        face_of_b = of_b[np.array([p.vertices[0] for p in mesh.polygons])]
        self.assertFalse(inner.any())
        self.assertEqual([u.name for u in mesh.uv_layers], ["UVMap", "Wall"])
        main_map, wall = (values_of(u.data, "uv", 2).reshape(-1, 3, 2) for u in mesh.uv_layers)
        np.testing.assert_array_equal(main_map[face_of_b], wall[face_of_b])
        self.assertEqual([wall[~face_of_b].any(), main_map[~face_of_b].any()], [False, True])
        np.testing.assert_array_equal(attribute(result, "number"), np.where(face_of_b, 0, 7))
        np.testing.assert_array_equal(attribute(result, "heat"), np.where(of_b, np.float32(0.25), 0))
        self.assertEqual(mesh.attributes["mixed"].domain, "POINT")  # the first's; another domain is another attribute
        np.testing.assert_array_equal(attribute(result, "mixed"), np.where(of_b, 0, np.float32(0.25)))
        tint = values_of(mesh.attributes["tint"].data, "color", 4)
        np.testing.assert_array_equal(tint, np.where(face_of_b, np.float32(0.25), 1)[:, None].repeat(4, 1))
        np.testing.assert_array_equal(weights(result, "number")[0], np.where(of_b, 0.75, 0))

    def test_a_map_that_became_the_one_of_renders_after_the_result_was_made_keeps_its_name(self):
        thing = self.source()
        tree, _ = self.tree(thing)
        result, = self.results(tree)
        thing.data.uv_layers["UVMap"].active_render = True
        self.bake(tree)
        self.assertEqual([u.name for u in result.data.uv_layers], ["UVMap", "Wall .001", "Größe"])
        self.assertEqual([u.name for u in result.data.uv_layers if u.active_render], ["UVMap"])
        corners = np.array([p.vertices for p in result.data.polygons])
        there = attribute(result, "rest_position")[corners][..., :2]
        for k, u in enumerate(result.data.uv_layers):
            shift = values_of(u.data, "uv", 2).reshape(-1, 3, 2) - there - k
            np.testing.assert_allclose(shift, np.rint(shift), atol=2e-6)

    def test_painting_a_layer_puts_a_bake_out_of_date(self):
        thing = self.source()
        tree, _ = self.tree(thing)
        self.results(tree)
        self.bake(tree)
        self.assertIs(self.status(tree).is_stale, False)
        for change in (lambda: thing.data.attributes["number"].data.foreach_set("value", np.arange(6, dtype=np.int32)),
                       lambda: thing.vertex_groups["Leg.L"].add([0], 0.25, "REPLACE")):
            before = addon("bake.signature").signature(tree, self.scene)
            change()
            thing.data.update()
            bpy.context.view_layer.update()
            addon("base.runtime").mesh_hashes.clear(), addon("base.runtime").signatures.clear()
            self.assertNotEqual(addon("bake.signature").signature(tree, self.scene), before)

    def test_a_mesh_without_layers_makes_the_files_of_before(self):
        tree, _ = self.tree()
        compiled = self.compiled(tree)
        self.assertEqual(compiled.mesh_layers, {})
        for data in compiled.files.values():
            header = data.split(b"end_header\n")[0].decode()
            self.assertNotIn(":", header)
        self.bake(tree)
        self.assertNotIn("mesh_layers", addon("bake.cache").note(str(self.cached(tree))))


if __name__ == "__main__":
    main()
