"""The node tree is the library's: every node, socket, parameter and range; wires that do not fit are refused."""
import json
import math

import bpy

from addon_case import AddonCase, addon, main


class Nodes(AddonCase):
    def test_every_node_type_has_a_node_with_its_sockets_and_defaults(self):
        descriptions = addon("base.core").sunder().node_types()
        tree = bpy.data.node_groups.new("All", "SunderTree")
        self.assertEqual({c.sunder_type for c in addon("interface.node_buttons").classes}, set(descriptions))
        for node_type, description in descriptions.items():
            node = self.node(tree, node_type)
            for kind in ("inputs", "outputs"):
                found = [(s.identifier, s.bl_idname) for s in getattr(node, kind)]
                wanted = [(s["name"], addon("tree.sockets").class_name(s["type"])) for s in description[kind]]
                self.assertEqual(found, wanted, node_type)
            for p in description["parameters"]:
                if p["type"] in addon("tree.parameters").NO_FIELD:
                    continue
                where = f"{node_type}.{p['name']}"
                self.assertEqual(node.parameter(p["name"]), p["default"], where)
                shown = node.bl_rna.properties[addon("tree.parameters").attribute(p["name"])]
                self.assertEqual(shown.description, p["sentence"].rstrip("."), where)
                self.assertEqual(shown.is_animatable, p["animatable"], where)
                if "choices" in p:
                    self.assertEqual([i.identifier for i in shown.enum_items], [str(c) for c in p["choices"]])

    def test_names_that_python_or_blender_has_end_in_an_underscore(self):
        changed = {p["name"] for d in addon("base.descriptions").NODES.values() for p in d["parameters"]
                   if addon("tree.parameters").attribute(p["name"]) != p["name"]}
        self.assertEqual(sorted(changed), ["height", "yield"])

    def test_values_beyond_the_range_are_clamped_to_it(self):
        tree = bpy.data.node_groups.new("T", "SunderTree")
        body, solver = self.node(tree, "body"), self.node(tree, "solver")
        body.poisson_ratio, body.density, solver.damping = 7, -3, 1e9
        self.assertEqual([body.parameter("poisson_ratio"), solver.parameter("damping")], [0.45, 1e4])
        self.assertGreater(body.parameter("density"), 0)
        self.assertEqual(self.node(tree, "force").bl_rna.properties["wind"].unit, "VELOCITY")

    def test_what_is_set_comes_back_and_the_library_takes_it(self):
        tree = bpy.data.node_groups.new("T", "SunderTree")
        body, pin = self.node(tree, "body"), self.node(tree, "pin")
        body.set_parameters(**{"yield": 0.05, "toughness": None, "youngs_modulus": 2e11, "rotation": (0, 30, -90)})
        self.assertEqual([body.parameter(n) for n in ("yield", "toughness", "youngs_modulus", "rotation")],
                         [0.05, None, 2e11, [0, 30, -90]])
        self.assertAlmostEqual(body.rotation[1], math.radians(30), places=6)
        self.assertEqual([pin.use_release_frame, pin.parameter("release_frame")], [False, None])
        cut = self.node(tree, "prefracture")
        self.assertEqual([cut.weld_distance, cut.parameter("weld_distance")], [0, "auto"])
        cut.set_parameters(weld_distance=1e-4)
        self.assertEqual(cut.parameter("weld_distance"), 1e-4)
        cut.set_parameters(weld_distance="auto")
        self.assertEqual(cut.parameter("weld_distance"), "auto")
        with self.assertRaisesRegex(AttributeError, "no parameter 'toughnes'.*toughness"):
            body.parameter("toughnes")

    def test_a_tree_compiles_to_the_graph_that_was_meant(self):
        thing = self.cube(location=(1, 2, 3))
        tree, nodes = self.tree(thing, pieces=5)
        compiled = addon("bake.compiler").compile_tree(tree, self.scene)
        graph = addon("base.core").sunder().Graph.from_dict(compiled.description)
        self.assertEqual([graph["body"]["position"], graph["body"]["toughness"]], [[1, 2, 3], 0.01])
        self.assertEqual([graph["solver"]["bodies"], graph["solver"]["colliders"]], [["@body.body"], ["@collider.collider"]])
        self.assertEqual([graph["prefracture"]["pieces"], graph["deformer"]["state"]], [5, "@solver.state"])
        self.assertEqual(json.loads(json.dumps(compiled.description))["frame_range"], [1, 6])


class Wires(AddonCase):
    def test_a_wire_that_does_not_fit_is_taken_out_and_told_and_the_old_one_put_back(self):
        tree, nodes = self.tree()

        def wires():
            return sorted((l.from_node.name, l.from_socket.name, l.to_node.name, l.to_socket.name) for l in tree.links)

        before = wires()
        self.connect(nodes["prefracture"], "fragments", nodes["deformer"], "state")
        self.assertEqual(wires(), before)
        self.assertEqual(nodes["deformer"].error, "State takes a state, not the fragments of 'Pre-Fracture'")

    def test_also_behind_a_reroute(self):
        tree, nodes = self.tree()
        bend = tree.nodes.new("NodeReroute")
        tree.links.new(nodes["prefracture"].outputs[0], bend.inputs[0])
        tree.links.new(bend.outputs[0], nodes["solver"].inputs[0])
        self.assertIn("takes a body", nodes["solver"].error)
        self.assertEqual([l.from_node.name for l in nodes["solver"].inputs[0].links], ["Body"])

    def test_a_reroute_carries_what_fits(self):
        tree, nodes = self.tree()
        bend = tree.nodes.new("NodeReroute")
        tree.links.remove(nodes["deformer"].inputs["Body"].links[0])
        tree.links.new(nodes["body"].outputs[0], bend.inputs[0])
        tree.links.new(bend.outputs[0], nodes["deformer"].inputs["Body"])
        description = addon("bake.compiler").compile_tree(tree, self.scene).description
        self.assertEqual(description["nodes"]["deformer"]["body"], "@body.body")

    def test_a_muted_node_is_not_there(self):
        tree, nodes = self.tree()
        nodes["collider"].mute = True
        description = addon("bake.compiler").compile_tree(tree, self.scene).description
        self.assertNotIn("collider", description["nodes"])
        self.assertNotIn("colliders", description["nodes"]["solver"])

    def test_a_cycle_is_refused_by_name(self):
        tree = bpy.data.node_groups.new("T", "SunderTree")
        first, second = self.node(tree, "pin"), self.node(tree, "deformer")
        # No two sockets of today's nodes can close a cycle: the walk must end on one all the same.
        ring = [tree.nodes.new("NodeReroute") for _ in range(2)]
        tree.links.new(ring[0].outputs[0], ring[1].inputs[0])
        tree.links.new(ring[1].outputs[0], ring[0].inputs[0])
        tree.links.new(ring[1].outputs[0], second.inputs["Body"])
        self.assertEqual(addon("tree.wiring").needed(tree), [second])
        self.assertIn("nothing is wired to it", self.refusal(tree))
        self.assertIn("nothing is wired to it", second.error)


class Errors(AddonCase):
    def test_the_node_that_is_at_fault_says_so_until_it_is_mended(self):
        tree, nodes = self.tree()
        nodes["mesh_file"].object = None
        self.assertIn("no object is picked", self.refusal(tree))
        self.assertEqual([n.name for n in tree.nodes if n.error], ["Mesh"])
        nodes["mesh_file"].object = bpy.data.objects["Block"]
        self.assertEqual(nodes["mesh_file"].error, "")

    def test_an_error_of_the_library_lands_on_its_node(self):
        thing = self.cube()
        bpy.ops.mesh.primitive_plane_add(size=0.3, location=(2, 0, 1))
        tree, nodes = self.tree(bpy.context.object)
        nodes["prefracture"].thickness = 0  # a sheet without walls
        self.refusal(tree)
        self.assertEqual([n.name for n in tree.nodes if n.error], ["Pre-Fracture"])
        nodes["mesh_file"].object = thing
        self.bake(tree)
        self.assertEqual([n.name for n in tree.nodes if n.error], [])

    def test_a_script_may_pick_what_the_picker_would_not(self):
        tree, nodes = self.tree()
        bpy.ops.object.light_add()
        nodes["mesh_file"].object = bpy.context.object
        self.assertIn("is a light, not a mesh", self.refusal(tree))
        nodes["mesh_file"].object = self.results(tree)[0]
        self.assertIn("shows a result", self.refusal(tree))

    def test_a_tree_that_bakes_nothing_is_refused(self):
        tree = bpy.data.node_groups.new("T", "SunderTree")
        self.node(tree, "solver")
        self.assertIn("nothing to bake", self.refusal(tree))


class Identity(AddonCase):
    def test_nodes_keep_their_names_in_the_graph(self):
        tree, nodes = self.tree()
        nodes["body"].name = "Renamed"
        self.assertEqual(nodes["body"].graph_name, "body")
        second = self.node(tree, "body")
        self.assertEqual(second.graph_name, "body_2")
        copied = tree.copy()
        self.assertEqual({n.graph_name for n in copied.nodes}, {n.graph_name for n in tree.nodes})
        tree.nodes.remove(nodes["body"])
        self.assertEqual(self.node(tree, "body").graph_name, "body")

    def test_a_node_added_later_does_not_follow_wires_that_are_gone(self):
        tree, nodes = self.tree()
        tree.nodes.remove(nodes["body"])
        self.assertIn("nothing is wired to it", self.refusal(tree))


if __name__ == "__main__":
    main()
