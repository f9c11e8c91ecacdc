"""A tree as the graph that the library bakes: the one place where Blender's scene becomes numbers.

Everything is copied here, in the main thread; the bake that follows knows nothing of Blender.
"""
import math

import bpy
from mathutils import Vector

from ..base import core, descriptions, runtime
from ..tree import conditions, keys, parameters, pickers, wiring
from ..scene import animation, field_input, mesh_export, scene_input

_PATH_OF = {"deformer": ("bake_mesh", "mesh", "mesh/{}.####.ply"), "solver": ("bake_state", "state", "state/{}.####.ply")}


class Compiled:
    """description: what a graph file holds. files: {path seen from the bake folder: bytes}.
    rest_matrices: {graph name of a rigid body: 4x4 rows of its object at the first frame}.
    rest_coordinates: {graph name of a deformer whose body is cut from one object: what is noted of that}.
    mesh_layers: {graph name of a deformer: how artists find the layers of its mesh}, where it has any."""

    def __init__(self):
        self.description, self.files, self.rest_matrices, self.rest_coordinates, self.mesh_layers = {}, {}, {}, {}, {}


class _Channel:
    """A parameter that may differ from frame to frame."""

    def __init__(self, node, name, read):
        self.node, self.name, self.read, self.keys = node, name, read, []

    def sample(self, frame):
        before = self.keys[-1][1] if self.keys else None
        self.keys.append([frame, self.read(before)])

    def store(self):
        """Keys without the still time before and after, so that a longer shot is the same shot; or one value."""
        keys, values = self.keys, [value for _, value in self.keys]
        first, last = 0, len(keys) - 1
        while first < last and values[first + 1] == values[first]:
            first += 1
        while last > first and values[last - 1] == values[last]:
            last -= 1
        self.node[self.name] = values[0] if first == last else {"keys": keys[first:last + 1]}


class _VertexMotion:
    """Where the vertices of an object's mesh are from frame to frame, as a file beside the bake: a farm needs no rig.
    geometry: the mesh as it was read; path: the parameter that takes the file."""

    name = "vertices"

    def __init__(self, name, blender_node, thing, geometry, path):
        self.graph_name, self.blender_node, self.thing, self.geometry, self.path = name, blender_node, thing, geometry, path
        self.first, self.frames = None, []

    def sample(self, frame):
        if self.first is None:
            self.first = frame
        depsgraph = bpy.context.evaluated_depsgraph_get()
        try:
            self.frames.append(mesh_export.placed_vertices(self.thing, depsgraph, self.geometry, frame))
        except core.Refused as error:
            raise core.Refused(str(error), self.blender_node.graph_name) from error

    def store_in(self, fields, files):
        data = mesh_export.npy_bytes(self.frames)
        path = mesh_export.path_of(self.graph_name.replace(":", "_"), data, ".npy")
        files[path] = data
        fields.update({self.path: path, "first_frame": self.first})


def ensure_evaluated(tree, scene):
    """Makes Blender evaluate keys and drivers of the tree: it does so only for what the scene points to. Drivers of nodes that
    were of no class for a while, because the add-on was off, it lets lie."""
    is_there = any(t.tree == tree for t in scene.sunder_trees)
    drivers = tree.animation_data.drivers if tree.animation_data else ()
    if is_there and (not drivers or tree.name_full in runtime.driven):
        return
    if not is_there:
        scene.sunder_trees.add().tree = tree
    for curve in drivers:
        curve.driver.is_valid = True
    tree.update_tag()  # the copy of it that Blender evaluates
    rebuild_relations(scene)
    runtime.driven.add(tree.name_full)


def rebuild_relations(scene):
    """Assigning a pointer does not rebuild Blender's relations between datablocks, an object that comes and goes does."""
    thing = bpy.data.objects.new("sunder relations", None)
    scene.collection.objects.link(thing)
    bpy.context.view_layer.update()
    bpy.data.objects.remove(thing)
    bpy.context.view_layer.update()


def _coordinates(source, own):
    """What is noted of the object that a body was cut from: how to come from the cut's coordinates, to which `own` (4x4)
    took it, back to its own, and its texture space. JSON (rest_coordinates.py reads it)."""
    note = {"matrix": [list(row) for row in own.inverted()]}
    if getattr(source.data, "texspace_location", None) is not None:
        note.update(location=list(source.data.texspace_location), size=list(source.data.texspace_size))
    return note


class _Compiler:
    def __init__(self, tree, scene, at_first):
        self.tree, self.scene, self.at_first = tree, scene, at_first
        self.result = Compiled()
        self.nodes = {}  # graph name: what the graph file holds of it
        self.names = {}  # graph name of a Blender node: [its names in the graph]
        self.channels, self.vertex_motions = [], []
        self.geometries = {}  # graph name of what has a mesh of an object: that
        self.before = {}  # name of an object: where it was in the frame before the first
        self.is_moving = False
        self.animated = keys.animated_attributes(tree)

    def run(self):
        scene, (first, last) = self.scene, self.tree.frames(self.scene)
        if self.animated:
            ensure_evaluated(self.tree, scene)
        shown, sub_frame = scene.frame_current, scene.frame_subframe
        runtime.is_sampling = True
        try:
            order = wiring.needed(self.tree)
            if not order:
                raise core.Refused("the tree has no deformer and no bake node: there is nothing to bake")
            self._look_back(order, first)
            scene.frame_set(first)
            depsgraph = bpy.context.evaluated_depsgraph_get()
            for node in order:
                self._add(node, depsgraph)
            for node in order:
                self._wire(node)
            for node in order:
                self._bake_outputs(node)
            moves = self.is_moving and not self.at_first
            for frame in range(first, last + 1 if moves else first + 1):
                if frame > first:
                    scene.frame_set(frame)
                for channel in (*self.channels, *self.vertex_motions):
                    channel.sample(frame)
            for frame in self._frames_beyond(first, last) if moves else ():
                scene.frame_set(frame)
                for channel in (*self.channels, *self.vertex_motions):
                    if channel.name != "time_scale":
                        channel.sample(frame)
        finally:
            scene.frame_set(shown, subframe=sub_frame)
            runtime.is_sampling = False
        for channel in self.channels:
            channel.store()
        for motion in self.vertex_motions:
            motion.store_in(self.nodes[motion.graph_name], self.result.files)
        self.result.description = {
            "sunder": 2, "frame_rate": scene_input.frame_rate(scene), "frame_range": [first, last], "nodes": self.nodes,
        }
        return self.result

    def _frames_beyond(self, first, last):
        """Frames behind the last that are simulated, too, where time runs faster than the frames or accelerations look ahead."""
        end = last
        for fields in self.nodes.values():
            if fields["type"] == "solver":
                keyed = [c.keys for c in self.channels if c.node is fields and c.name == "time_scale"]
                scales = [scale for _, scale in keyed[0]] if keyed else [fields.get("time_scale", 1)] * (last - first + 1)
                passed = sum((a + b) / 2 for a, b in zip(scales, scales[1:]))
                end = max(end, math.ceil(first + passed - 1e-6))
                if fields.get("accelerations"):
                    end = max(end, math.floor(first + passed + 1e-6) + 1)
        return range(last + 1, end + 1)

    def _look_back(self, order, first):
        """Where objects whose motion is taken over were in the frame before the first."""
        movers = []
        for node in order:
            if pickers.uses_motion(node):
                is_body = node.sunder_type == "body"
                movers += [scene_input.placed_by(node)] if is_body else scene_input.objects_of(node)
        if movers:
            self.scene.frame_set(first - 1)
            self.before = {thing.name: thing.matrix_world.copy() for thing in movers if thing is not None}

    def _motion(self, node, thing, center):
        if not pickers.uses_motion(node):
            return {}
        rate = self.scene.render.fps / self.scene.render.fps_base
        return scene_input.motion(self.before[thing.name], thing.matrix_world, center, rate)

    def _channel(self, name, parameter, read, is_moving):
        self.channels.append(_Channel(self.nodes[name], parameter, read))
        self.is_moving |= is_moving

    def _add(self, node, depsgraph):
        name = node.graph_name
        self.nodes[name] = {"type": node.sunder_type}
        self.names[name] = [name]
        animated = self.animated.get(node.name, ())
        for p in descriptions.parameters(node.sunder_type):
            if not conditions.counts(node, p["name"]):
                continue
            if p["type"] == "points":
                found = scene_input.points(node, p["name"], depsgraph)
                if found:
                    self.nodes[name][p["name"]] = found
            if p["type"] in parameters.NO_FIELD:
                continue
            if p["name"] in pickers.map_parameters(node.sunder_type):
                self._add_map(node, p["name"])
                continue
            if parameters.attribute(p["name"]) in animated:
                self._channel(name, p["name"], lambda _, p=p: parameters.value(p, node), True)
            else:
                value = parameters.value(p, node)
                if p["type"] == "path" and value:
                    value = bpy.path.abspath(value)
                if value != p["default"]:
                    self.nodes[name][p["name"]] = value
        special = getattr(self, "_add_" + node.sunder_type, None)
        if special:
            special(node, depsgraph)

    def _add_mesh_file(self, node, depsgraph):
        if node.source == pickers.VALUES:
            return
        fields = self.nodes[node.graph_name]
        geometry = scene_input.mesh(node, depsgraph)
        self.geometries[node.graph_name] = geometry
        data = mesh_export.ply_bytes(geometry)
        fields["path"] = mesh_export.path_of(node.graph_name, data)
        self.result.files[fields["path"]] = data
        groups = mesh_export.welded_groups(geometry)
        if groups:
            fields["groups"] = groups

    def _add_body(self, node, _depsgraph):
        thing = scene_input.placed_by(node)
        if node.source == pickers.OBJECT and thing is not None:
            fields = self.nodes[node.graph_name]
            fields.update(scene_input.body_placement(node))
            if pickers.uses_motion(node):
                geometry = self.geometries[wiring.upstream(node, "mesh_file").graph_name]
                fields.update(self._motion(node, thing, Vector(mesh_export.centroid(geometry))))

    def _add_deformer(self, node, _depsgraph):
        thing = scene_input.placed_by(node)
        if thing is not None:
            own = scene_input.placement(thing.matrix_world)[2]
            self.result.rest_coordinates[node.graph_name] = _coordinates(thing, own)
        source = wiring.upstream(node, "mesh_file")
        geometry = self.geometries.get(source.graph_name) if source is not None else None
        if geometry is not None and geometry.mesh_layers:
            self.result.mesh_layers[node.graph_name] = geometry.order

    def _follow_vertices(self, name, node, thing, geometry, path):
        self.vertex_motions.append(_VertexMotion(name, node, thing, geometry, path))
        self.is_moving = True

    def _cut_from(self, node, depsgraph):
        """The object that a node's body was cut from."""
        thing = scene_input.placed_by(node)
        if thing is None:
            raise core.Refused("the body was not cut from one object: turn off Follow Its Object, or pick an object in the "
                               "mesh node", node.graph_name)
        scene_input.check_evaluated(thing, depsgraph, node)
        return thing

    def _follow_its_object(self, node, depsgraph, path):
        """By each vertex of the object that the body was cut from."""
        thing, source = self._cut_from(node, depsgraph), wiring.upstream(node, "mesh_file")
        self.nodes[node.graph_name]["mesh"] = f"@{source.graph_name}.mesh"
        self._follow_vertices(node.graph_name, node, thing, self.geometries[source.graph_name], path)

    def _follow_another(self, node, depsgraph):
        """By each vertex of an object of the node's own, whose mesh comes beside it."""
        name = f"{node.graph_name}:mesh"
        self.nodes[name] = {"type": "mesh_file", **self._solid(name, node.motion_object, depsgraph, node)}
        self.nodes[node.graph_name]["mesh"] = f"@{name}.mesh"
        self._follow_vertices(node.graph_name, node, node.motion_object, self.geometries[name], "motion_path")

    def _add_follow(self, node, depsgraph):
        if not node.from_object:
            return
        if node.motion == "vertices":
            self._follow_its_object(node, depsgraph, "path")
            return
        thing = self._cut_from(node, depsgraph)
        moves = animation.moves(thing)
        self._channel(node.graph_name, "position", lambda _: scene_input.pose(thing.matrix_world, Vector())[0], moves)
        self._channel(node.graph_name, "rotation", lambda before: scene_input.pose(thing.matrix_world, Vector(), before)[1],
                      moves)

    def _add_rigid_body(self, node, depsgraph):
        for name, thing, center in self._shapes(node, depsgraph):
            position, rotation = scene_input.pose(thing.matrix_world, center)
            self.nodes[name].update(position=position, rotation=rotation, **self._motion(node, thing, center))
            self.result.rest_matrices[name] = [list(row) for row in thing.matrix_world]

    def _add_collider(self, node, depsgraph):
        for name, thing, center in self._shapes(node, depsgraph):
            if pickers.takes_vertices(node):
                self._follow_vertices(name, node, thing, self.geometries[name], "motion_path")
                continue
            moves = animation.moves(thing)

            def position(_, thing=thing, center=center):
                return scene_input.pose(thing.matrix_world, center)[0]

            def rotation(before, thing=thing, center=center):
                return scene_input.pose(thing.matrix_world, center, before)[1]

            self._channel(name, "position", position, moves)
            self._channel(name, "rotation", rotation, moves)

    def _add_of_object(self, node, depsgraph):
        """Of a force that an object stands for, what may move as channels, the rest as it is at the first frame."""
        if node.source == pickers.VALUES:
            return
        thing, = scene_input.objects_of(node)
        scene_input.check_evaluated(thing, depsgraph, node)
        is_dragged = pickers.is_drag(node) or node.sunder_type != "force" or "drag" in self.animated.get(node.name, ())
        if not is_dragged and node.parameter("drag") == 0:
            raise core.Refused("drag is 0: the wind would take nothing along", node.graph_name)
        may_move = {p["name"] for p in descriptions.parameters(node.sunder_type) if p["animatable"]}
        for name, value in field_input.values(thing, node).items():
            if name in may_move:
                self._channel(node.graph_name, name, lambda _, name=name: field_input.values(thing, node)[name],
                              animation.moves(thing))
            else:
                self.nodes[node.graph_name][name] = value

    _add_force = _add_blast = _add_point_force = _add_vortex = _add_turbulence = _add_of_object

    def _shapes(self, node, depsgraph):
        """(graph name, object, centre in its axes) of each object that a node stands for, sizes filled in."""
        if node.source == pickers.VALUES:
            return []
        shapes, common = [], self.nodes[node.graph_name]
        for i, thing in enumerate(scene_input.objects_of(node)):
            name = node.graph_name if i == 0 else f"{node.graph_name}:{i + 1}"
            if node.shape == "mesh":
                size, center = self._solid(name, thing, depsgraph, node), Vector()
            else:
                size, center = scene_input.shape(node.shape, thing, depsgraph, node)
            shapes.append((name, {**common, **size}, thing, center))
        self.names[node.graph_name] = [name for name, *_ in shapes]
        self.nodes.update({name: fields for name, fields, *_ in shapes})
        return [(name, thing, center) for name, _, thing, center in shapes]

    def _solid(self, name, thing, depsgraph, node):
        """An object's mesh in its own axes (scale in), as a collider of shape mesh reads it."""
        scene_input.check_evaluated(thing, depsgraph, node)
        if thing.type not in pickers.SURFACES:
            raise core.Refused(f"object '{thing.name}' is a {thing.type.lower()}, not a mesh", node.graph_name)
        own = scene_input.placement(thing.matrix_world)[2]
        try:
            geometry = self.geometries[name] = mesh_export.geometry(thing, depsgraph, own, True)
        except core.Refused as error:
            raise core.Refused(str(error), node.graph_name) from error
        data = mesh_export.ply_bytes(geometry)
        path = mesh_export.path_of(name.replace(":", "_"), data)
        self.result.files[path] = data
        return {"path": path}

    def _add_map(self, node, parameter):
        """A map by its name in the mesh's file, which is not the artist's where the mesh comes from Blender."""
        name, source = getattr(node, parameter), wiring.upstream(node, "mesh_file")
        if name:
            is_ours = source is not None and source.source != pickers.VALUES
            self.nodes[node.graph_name][parameter] = mesh_export.map_property(name) if is_ours else name

    def _add_fragment_region(self, node, depsgraph):
        if node.source == pickers.OBJECT and node.region in ("box", "sphere"):
            thing, = scene_input.objects_of(node)
            scene_input.check_evaluated(thing, depsgraph, node)
            self._region(node, *scene_input.own_bounds(thing, node, depsgraph))

    def _add_part(self, node, depsgraph):
        if node.source == pickers.OBJECT and pickers.region(node) in ("box", "sphere"):
            thing, = scene_input.objects_of(node)
            scene_input.check_evaluated(thing, depsgraph, node)
            self._region(node, *scene_input.world_bounds(thing, depsgraph))

    _add_activate = _add_body_region = _add_seam = _add_part

    def _region(self, node, low, high):
        fields = self.nodes[node.graph_name]
        if pickers.region(node) == "box":
            fields.update(box_min=scene_input.vector(low), box_max=scene_input.vector(high))
        else:
            fields.update(center=scene_input.vector((low + high) / 2), radius=scene_input.decimal(max(high - low) / 2))

    def _add_pin(self, node, depsgraph):
        fields = self.nodes[node.graph_name]
        if node.source == pickers.OBJECT and node.region != "group":
            thing = scene_input.objects_of(node)[0]
            scene_input.check_evaluated(thing, depsgraph, node)
            self._region(node, *scene_input.world_bounds(thing, depsgraph))
        if pickers.goes_with_another(node):
            self._follow_another(node, depsgraph)
        elif pickers.takes_vertices(node):
            self._follow_its_object(node, depsgraph, "motion_path")
        if node.motion != "transform":
            return
        mover = node.motion_object
        if mover is None:
            return
        scene_input.check_evaluated(mover, depsgraph, node)
        start, turned, _ = scene_input.placement(mover.matrix_world)
        fields["pivot"] = scene_input.vector(start)

        def position(_):
            return scene_input.vector(scene_input.placement(mover.matrix_world)[0] - start)

        def rotation(before):
            return scene_input.degrees(scene_input.placement(mover.matrix_world)[1] @ turned.inverted(), before)

        self._channel(node.graph_name, "position", position, animation.moves(mover))
        self._channel(node.graph_name, "rotation", rotation, animation.moves(mover))

    def _wire(self, node):
        many = {s["name"]: s["many"] for s in descriptions.NODES[node.sunder_type]["inputs"]}
        for name, found in wiring.inputs(node):
            wires = [f"@{g}.{output}" for source, output in found for g in self.names[source.graph_name]]
            for graph_name in self.names[node.graph_name]:
                self.nodes[graph_name][name] = wires if many[name] else wires[0]

    def _bake_outputs(self, node):
        """What playing needs is baked whether the tree has a bake node for it or not."""
        if node.sunder_type not in _PATH_OF:
            return
        bake_type, socket, pattern = _PATH_OF[node.sunder_type]
        name = f"{node.graph_name}:bake"
        self.nodes[name] = {"type": bake_type, socket: f"@{node.graph_name}.{socket}", "path": pattern.format(node.graph_name)}
        if self.tree.subframes > 1:
            self.nodes[name]["subframes"] = self.tree.subframes


def compile_tree(tree, scene, at_first=False):
    """Raises core.Refused with the node that is at fault. Steps through the frames if something moves; not so `at_first`, where
    all stays as it is at the first frame."""
    return _Compiler(tree, scene, at_first).run()
