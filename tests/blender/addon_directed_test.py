"""What directs a shot keeps its values, keys and drivers: turned off and on, undone, opened while off, copied. What is compared
is the graph that a bake would take."""
import bpy

from addon_case import ObjectCase, addon, main

NAME = "sunder_addon"
TIMES = 5
KEYED = {"hold": [], "weak": ["toughness"], "rot": ["toughness", "yield_", "stiffness", "fracture_energy"],
         "rig": ["position", "rotation"], "clamp": ["position", "rotation"], "hand": ["position", "rotation"],
         "sim": ["time_scale", "gravity"], "blow": ["drag", "gusts"]}


class Directed(ObjectCase):
    def setUp(self):
        super().setUp()
        bpy.context.preferences.edit.use_global_undo = True
        self.tree_, nodes = self.tree()
        body, solver = nodes["body"], nodes["solver"]
        bodies = next(s for s in solver.inputs if s.identifier == "bodies")
        self.tree_.links.remove(bodies.links[0])
        made = {"hold": self.node(self.tree_, "activate", mode="glued", until="object", delay=2, growth=1, falloff=0.1),
                "weak": self.node(self.tree_, "seam", mode="scale", between="all"),
                "rot": self.node(self.tree_, "body_region", region="box"),
                "rig": self.node(self.tree_, "follow", frame=3),
                "clamp": self.node(self.tree_, "pin", region="box", release_frame=4, release_frames=2),
                "hand": self.node(self.tree_, "collider", shape="sphere", radius=0.2),
                "blow": self.node(self.tree_, "force", wind=(3, 0, 0), gust_time=0.5, drag=1, gusts=0.4)}
        for name, node in made.items():
            node.graph_name = node.name = name
            if addon("tree.pickers").has_source(node):
                node.source = "VALUES"
        made["rig"].from_object = False
        solver.name = "sim"
        last = body
        for name in ("weak", "rot", "rig", "hold"):
            self.connect(last, "body", made[name], "body")
            last = made[name]
        self.connect(last, "body", solver, "bodies")
        self.connect(made["hand"], "collider", made["hold"], "object")
        self.connect(made["hand"], "collider", solver, "colliders")
        self.connect(body, "body", made["clamp"], "body")
        self.connect(made["clamp"], "pin", solver, "pins")
        self.connect(made["blow"], "force", solver, "forces")
        for name, parameters in KEYED.items():
            for parameter in parameters:
                self.key(self.tree_.nodes[name], parameter)
        self.thing = self.cube(name="Driver", location=(3, 0, 0))
        driver = self.tree_.driver_add('nodes["weak"].toughness').driver  # takes the place of the keys
        driver.expression = "0.2 + 0.1 * way"
        way = driver.variables.new()
        way.name, way.type = "way", "TRANSFORMS"
        way.targets[0].id, way.targets[0].transform_type = self.thing, "LOC_X"
        for frame, x in ((1, 0.0), (6, 2.0)):
            self.thing.location.x = x
            self.thing.keyframe_insert("location", frame=frame)
        self.results(self.tree_)
        self.cached_name = self.tree_.name
        self.save()
        self.first = self.description()

    def key(self, node, parameter):
        value = getattr(node, parameter)
        many = hasattr(value, "__len__")
        for frame, factor in ((1, 1.0), (3, 0.8), (6, 0.5)):
            setattr(node, parameter, [0.1 + factor * (v or 1.0) for v in value] if many else factor * (value or 1.0))
            self.assertTrue(node.keyframe_insert(parameter, frame=frame))

    def description(self):
        self.scene = bpy.context.scene
        self.scene.frame_set(1)
        return self.compiled(bpy.data.node_groups[self.cached_name]).description

    def is_as_it_was(self):
        now = self.description()
        for name in self.first["nodes"]:
            self.assertEqual(now["nodes"][name], self.first["nodes"][name], name)
        self.assertEqual(now, self.first)

    def off_and_on(self):
        bpy.ops.preferences.addon_disable(module=NAME)
        bpy.context.view_layer.update()
        bpy.context.scene.frame_set(4)
        bpy.ops.preferences.addon_enable(module=NAME)

    def test_all_keys_and_the_driver_are_in_what_is_baked(self):
        nodes = self.first["nodes"]
        for name, parameters in KEYED.items():
            for parameter in parameters:
                value = nodes["solver" if name == "sim" else name][parameter.rstrip("_")]
                self.assertGreater(len(value["keys"]), 2, (name, parameter))
                self.assertNotEqual(value["keys"][0][1], value["keys"][-1][1], (name, parameter))
        self.assertAlmostEqual(nodes["weak"]["toughness"]["keys"][-1][1], 0.4, 5)
        self.assertEqual([nodes["hold"][n] for n in ("mode", "until", "delay", "object")],
                         ["glued", "object", 2, "@hand.collider"])
        self.bake(bpy.data.node_groups[self.cached_name])
        self.assertEqual(self.status(bpy.data.node_groups[self.cached_name]).state, "complete")

    def test_turned_off_and_on(self):
        for _ in range(TIMES):
            self.off_and_on()
            self.is_as_it_was()

    def test_opened_while_off(self):
        for _ in range(TIMES):
            bpy.ops.preferences.addon_disable(module=NAME)
            self.reopen()
            bpy.context.scene.frame_set(3)
            self.save("again.blend")
            self.reopen("again.blend")
            bpy.ops.preferences.addon_enable(module=NAME)
            self.is_as_it_was()

    def test_scripts_are_reloaded(self):
        for _ in range(TIMES):
            bpy.ops.script.reload()
            self.is_as_it_was()

    def test_undone_and_done_again(self):
        bpy.ops.ed.undo_push(message="start")
        for name in [n for n in KEYED if n != "sim"]:
            nodes = bpy.data.node_groups[self.cached_name].nodes
            nodes.remove(nodes[name])
            bpy.ops.ed.undo_push(message="removed")
            self.assertNotIn(name, self.description()["nodes"])
            bpy.ops.ed.undo()
            self.is_as_it_was()
            bpy.ops.ed.redo()
            self.assertNotIn(name, self.description()["nodes"])
            bpy.ops.ed.undo()
            self.is_as_it_was()

    def test_keys_are_undone(self):
        bpy.ops.ed.undo_push(message="start")
        tree = bpy.data.node_groups[self.cached_name]
        tree.nodes["rot"].yield_ = 0.3
        tree.nodes["rot"].keyframe_insert("yield_", frame=6)
        tree.driver_remove('nodes["weak"].toughness')
        bpy.ops.ed.undo_push(message="keyed")
        self.assertNotEqual(self.description(), self.first)
        bpy.ops.ed.undo()
        self.is_as_it_was()

    def test_undone_beyond_the_time_it_was_off(self):
        for _ in range(TIMES):
            bpy.ops.ed.undo_push(message="before")
            self.off_and_on()
            bpy.ops.ed.undo_push(message="after")
            bpy.ops.ed.undo()
            self.is_as_it_was()
            bpy.ops.ed.redo()
            self.is_as_it_was()

    def test_a_copied_tree_has_them_all(self):
        copy = bpy.data.node_groups[self.cached_name].copy()
        self.scene.frame_set(1)
        told = self.compiled(copy).description
        self.assertEqual(told["nodes"], self.first["nodes"])


if __name__ == "__main__":
    main()
