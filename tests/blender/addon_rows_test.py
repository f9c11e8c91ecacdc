"""Nodes show what counts, in the groups of the library's descriptions; what is folded away or does not count keeps its value."""
import itertools

import bpy

from addon_case import AddonCase, ObjectCase, addon, main


class Recorder:
    """Stands in for a layout: what would be drawn, in order."""

    def __init__(self, drawn=None):
        self.drawn = [] if drawn is None else drawn

    def row(self, **_how):
        return Recorder(self.drawn)

    split = column = box = row

    def label(self, text="", **_how):
        self.drawn.append(text)

    def separator(self, **_how):
        pass

    def operator(self, name, **_how):
        self.drawn.append(name)
        return type("Operator", (), {})()

    def operator_menu_enum(self, name, _property, **_how):
        self.drawn.append(name)

    def prop(self, _data, name, **how):
        self.drawn.append(how.get("text") or name)

    def prop_search(self, _data, name, *_where, **_how):
        self.drawn.append(name)


class Rows(ObjectCase):
    def drawn(self, node):
        layout = Recorder()
        node.draw_buttons(bpy.context, layout)
        return layout.drawn

    def new(self, node_type, **given):
        return self.node(bpy.data.node_groups.new("T", "SunderTree"), node_type, **given)

    def test_a_new_node_shows_few_rows_and_its_groups_folded(self):
        for node_type in addon("base.descriptions").NODES:
            node = self.new(node_type)
            groups = addon("interface.node_buttons").groups(node)
            self.assertLessEqual(len(self.drawn(node)), 8 + 5 + len(groups), node_type)  # objects, the bake's state
            for label in groups:
                self.assertIn(label, self.drawn(node))
        cut = self.new("prefracture")
        self.assertEqual(addon("interface.node_buttons").groups(cut), ["Pieces", "Break Surfaces", "Repair", "Strength"])
        self.assertNotIn("thickness", self.drawn(cut))
        cut.unfolds_repair = True
        self.assertIn("thickness", self.drawn(cut))

    def test_folding_is_no_edit(self):
        tree, nodes = self.tree()
        before = addon("bake.signature").signature(tree, self.scene), self.compiled(tree).description
        for node in nodes.values():
            for label in addon("interface.node_buttons").groups(node):
                fold = addon("tree.parameters").fold(label)
                self.assertFalse(node.bl_rna.properties[fold].is_animatable)
                setattr(node, fold, True)
        addon("base.runtime").signatures.clear()
        self.assertEqual((addon("bake.signature").signature(tree, self.scene), self.compiled(tree).description), before)
        self.save()
        self.reopen()
        tree, = addon("tree.trees").trees()
        self.assertTrue(next(n for n in tree.nodes if n.sunder_type == "body").unfolds_start)

    def test_a_group_tells_that_something_in_it_was_set(self):
        cut = self.new("prefracture")
        self.assertIn("Repair", self.drawn(cut))
        cut.thickness = 0.1
        self.assertIn("Repair •", self.drawn(cut))
        cut.repair = "refuse"  # set, too; the thickness does not count any more
        self.assertIn("Repair •", self.drawn(cut))
        cut.thickness, cut.repair = 0.1, "auto"
        self.assertEqual(cut.parameter("thickness"), addon("tree.parameters").decimal(0.1))

    def test_where_a_number_or_a_switch_stands_in_the_way_the_row_says_which(self):
        body, cut, solver, pin = (self.new(t) for t in ("body", "prefracture", "solver", "pin"))
        lack = addon("tree.conditions").lack
        self.assertIn("Hardening: needs Yield", self.drawn(body))
        body.use_yield = True
        self.assertIn("hardening", self.drawn(body))
        self.assertEqual([lack(cut, "noise_scale"), lack(cut, "cluster_toughness"), lack(pin, "release_frames")],
                         ["Noise > 0", "Clusters > 0", "Release Frame"])
        cut.sites = "grid"
        self.assertEqual(lack(cut, "sheets"), "Roughness > 1")
        solver.error_budget = 0.02
        self.assertIn("Substeps: needs Error Budget = 0", self.drawn(solver))
        solver.error_budget = 0
        solver.set_parameters(substeps=3, iterations=2, hit_substeps=4)
        self.assertEqual(lack(solver, "preset"), "no Substeps")

    def test_no_label_is_cut_off(self):
        body, pin, lattice = (self.new(t) for t in ("body", "pin", "lattice"))
        above = "Young's Modulus (Pa):"  # on a line of its own where it does not fit beside its number
        self.assertNotIn(above, self.drawn(body))
        body.width = 160
        self.assertIn(above, self.drawn(body))
        self.assertNotIn("Yield:", self.drawn(body))
        body.width, body.youngs_modulus = 260, 2e20
        self.assertIn(above, self.drawn(body))
        rows = self.drawn(pin)
        at = rows.index("Release Over: needs Release")
        self.assertEqual(rows[at + 1].strip(), "Frame")
        self.assertIn("Neighbours", self.drawn(lattice))
        for node_type in addon("base.descriptions").NODES:
            node = self.new(node_type)
            for label in addon("interface.node_buttons").groups(node):
                setattr(node, addon("tree.parameters").fold(label), True)
            numbers = [r for r in self.drawn(node) if r.endswith(":") and "_" not in r]
            self.assertEqual(numbers, [], f"{node_type} as it begins is wide enough")

    def test_rows_of_other_choices_are_not_there_and_keep_value_keys_and_wires(self):
        collider = self.new("collider", shape="sphere", radius=0.3)
        collider.keyframe_insert("position", frame=1)
        collider.shape = "box"
        self.assertNotIn("radius", self.drawn(collider))
        self.assertIn("size", self.drawn(collider))
        self.assertEqual(collider.parameter("radius"), addon("tree.parameters").decimal(0.3))
        self.assertEqual(addon("tree.keys").animated_attributes(collider.id_data), {collider.name: {"position"}})
        self.assertEqual([s.name for s in collider.inputs], ["Mesh"])

    def test_keys_may_make_it_count(self):
        force = self.new("force")
        self.assertEqual(addon("tree.conditions").lack(force, "wind"), "Drag > 0")
        force.keyframe_insert("drag", frame=1)
        self.assertTrue(addon("tree.conditions").counts(force, "wind"))

    def test_what_counts_is_what_the_library_says_counts(self):
        graph = addon("base.core").sunder().Graph()
        for node_type, description in addon("base.descriptions").NODES.items():
            node, own = self.new(node_type), graph.add(node_type, node_type)
            if addon("tree.pickers").has_source(node):
                node.source = "VALUES"
            if hasattr(node, "from_object"):
                node.from_object = False
            asked = {c["parameter"] for p in description["parameters"] for all_of in p.get("needs", ()) for c in all_of}
            values = {p["name"]: p["choices"] if "choices" in p else [None, 1] if p["nullable"] else [p["default"], 2]
                      for p in description["parameters"] if p["name"] in asked}
            values = {name: v if name != "error_budget" else [0, 0.5] for name, v in values.items()}
            values = {name: v if name != "noise" else [0, 0.5] for name, v in values.items()}
            for chosen in itertools.islice(itertools.product(*values.values()), 0, None, 7):
                given = dict(zip(values, chosen))
                node.set_parameters(**given)
                own.set(**given)
                for p in description["parameters"]:
                    if p["type"] != "vertex_groups":
                        self.assertEqual(addon("tree.conditions").counts(node, p["name"]), own.has_effect(p["name"]),
                                         (node_type, p["name"], given))

    def test_what_does_not_count_is_not_passed_on(self):
        tree, nodes = self.tree()
        nodes["body"].set_parameters(**{"yield": None, "hardening": 3})
        self.assertNotIn("hardening", self.compiled(tree).description["nodes"]["body"])
        stale = addon("bake.signature").signature(tree, self.scene)
        nodes["body"].hardening = 4
        self.assertEqual(addon("bake.signature").signature(tree, self.scene), stale)
        nodes["body"].use_yield = True
        self.assertEqual(self.compiled(tree).description["nodes"]["body"]["hardening"], 4)

    def test_an_energy_may_be_a_number_or_worked_out_or_none(self):
        body = self.new("body", toughness=0.1)
        self.assertTrue({"use_fracture_energy", "auto_fracture_energy"} <= set(
            body.bl_rna.properties.keys()))
        layout = Recorder()
        names = []
        layout.prop = lambda _data, name, **_how: names.append(name)
        layout.row = lambda **_how: layout
        addon("interface.node_buttons")._draw_parameter(layout, body, body._description("fracture_energy"), body.width)
        self.assertEqual(names, ["use_fracture_energy", "auto_fracture_energy", "fracture_energy"])

    def test_the_sidebar_has_a_panel_for_each_group(self):
        panels = addon("interface.node_panels").classes
        self.assertEqual({c.bl_label for c in panels[1:]}, set(addon("base.descriptions").group_labels()))
        for cls in panels[1:]:
            self.assertEqual(cls.bl_parent_id, "SUNDER_PT_node")
            self.assertTrue(hasattr(bpy.types, cls.bl_idname))


class Layout(AddonCase):
    def test_the_wire_from_body_to_deformer_passes_above_the_solver(self):
        tree = addon("interface.quick_fracture").build([self.cube()], "CLAY", 8)
        layout = addon("interface.tree_layout")
        body, solver, deformer = (next(n for n in tree.nodes if n.sunder_type == t) for t in ("body", "solver", "deformer"))
        self.assertGreater(body.location.y - layout._TO_OUTPUT, solver.location.y)
        lowest = deformer.location.y - layout.size(deformer)[1]
        self.assertGreater(lowest + layout._TO_INPUT + layout._SOCKET, solver.location.y)  # its first input of two

    def test_columns_follow_the_wires_and_no_node_lies_over_another(self):
        things = [self.cube(location=(i, 0, 1), name=name) for i, name in enumerate(("A", "B", "C"))]
        tree = addon("interface.quick_fracture").build(things, "CLAY", 8)
        layout = addon("interface.tree_layout")
        boxes = {n.name: (n.location.x, n.location.y, *layout.size(n)) for n in tree.nodes}
        for link in tree.links:
            left, right = boxes[link.from_node.name], boxes[link.to_node.name]
            self.assertGreaterEqual(right[0], left[0] + left[2])
        for (a, one), (b, other) in itertools.combinations(boxes.items(), 2):
            apart = (one[0] + one[2] <= other[0] or other[0] + other[2] <= one[0]
                     or one[1] - one[3] >= other[1] or other[1] - other[3] >= one[1])
            self.assertTrue(apart, (a, b))
        bodies = sorted((n for n in tree.nodes if n.sunder_type == "body"), key=lambda n: -n.location.y)
        self.assertEqual([n.label for n in bodies], ["A: Body", "B: Body", "C: Body"])

    def test_a_circle_and_a_node_by_itself_have_places_too(self):
        tree = bpy.data.node_groups.new("T", "SunderTree")
        alone = self.node(tree, "force")
        addon("interface.tree_layout").arrange(tree)
        self.assertEqual(alone.location.x, 0)
        addon("interface.tree_layout").arrange(bpy.data.node_groups.new("Empty", "SunderTree"))

    def test_nodes_are_coloured_by_what_comes_out_of_them(self):
        tree, nodes = addon("interface.quick_fracture").build(self.cube(), "CLAY", 8), {}
        for node in tree.nodes:
            self.assertTrue(node.use_custom_color)
            nodes[node.sunder_type] = tuple(node.color)
        self.assertEqual(len(set(nodes.values())), len(nodes) - 1)  # meshes come out of the first and the last


if __name__ == "__main__":
    main()
