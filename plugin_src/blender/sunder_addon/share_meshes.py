"""A shot as a mesh for each frame, each on an object that is shown in its time, and keys for what moves as a whole.

It plays in every Blender with all that meshes carry, but a shot of a million triangles makes a .blend of gigabytes.
"""
import bpy

from . import blender_versions, parts, player, rest_coordinates, result_mesh, results

_AT_REST = "sunder_at_rest"  # a use of a texture mesh that Blender counts (rest_coordinates.py)


class _Sequence:
    """Objects of one result, each with the mesh of one frame or of several that are alike. `shown`: [(first frame, object)]."""

    def __init__(self, thing, stage, shared):
        self.thing, self.shared = thing, shared
        self.shown, self._key, self._at_rest = [], None, {}
        self.copy = thing.copy()
        self.copy.data = bpy.data.meshes.new(f"{thing.name} shared")
        for slot in thing.material_slots:
            self.copy.data.materials.append(slot.material)
        for slot in self.copy.material_slots:
            slot.link = "DATA"
        self.copy.hide_render = self.copy.hide_viewport = False
        self.copy.sunder.preview = "OFF"
        rest_coordinates.prepare(self.copy)
        stage.collection.objects.link(self.copy)
        self.handle = None
        if parts.has_motion(thing):
            self.handle = bpy.data.objects.new(f"{thing.name} shared", None)
            shared.objects.link(self.handle)

    def add(self, frame, graph):
        if self.handle is not None:
            _key_place(self.handle, self.copy.evaluated_get(graph).matrix_world, frame)
        key = self.copy.data[player.SHOWN]
        if key == self._key:
            return
        self._key = key
        made = results.twin(self.thing, f"{self.thing.name} shared {frame:04d}", self._mesh(frame))
        for modifier in self.copy.modifiers:
            if modifier.name not in made.modifiers:
                rest_coordinates.prepare(made)
        if self.handle is not None:
            made.parent = self.handle
            made.matrix_basis.identity()
        self.shared.objects.link(made)
        self.shown.append((frame, made))

    def _mesh(self, frame):
        source = self.copy.data
        at_rest, source.texco_mesh = source.texco_mesh, None  # a copy would take back a use that is not its own
        mesh, source.texco_mesh = source.copy(), at_rest
        mesh.name = f"{self.thing.name} shared {frame:04d}"
        for name in (player.SHOWN, result_mesh.FACES, _AT_REST):
            if name in mesh:
                del mesh[name]
        if at_rest is not None:
            stamp = source[result_mesh.FACES]
            if stamp not in self._at_rest:
                self._at_rest[stamp] = at_rest.copy()
            mesh.texco_mesh = mesh[_AT_REST] = self._at_rest[stamp]
        return mesh

    def end(self, stage):
        """Each is shown from its frame to that of the next one; the first also before, the last also after."""
        starts = [frame for frame, _ in self.shown]
        for (start, made), before, after in zip(self.shown, [None, *starts], [*starts[1:], None]):
            for frame, is_hidden in ((before, True), (start, False), (after, True)):
                if frame is None:
                    continue
                made.hide_viewport = made.hide_render = is_hidden
                made.keyframe_insert("hide_viewport", frame=frame)
                made.keyframe_insert("hide_render", frame=frame)
            made.hide_viewport = made.hide_render = before is not None  # what is just linked shows the first
        _make_linear(self.handle)
        stage.collection.objects.unlink(self.copy)


def make(things, frames, stage, shared):
    """Fills collection `shared`, working in scene `stage`. Returns notes."""
    sequences = [_Sequence(thing, stage, shared) for thing in things if parts.shows_mesh(thing)]
    moving = []
    for thing in things:
        if not parts.shows_mesh(thing):
            copy, made = thing.copy(), results.twin(thing, f"{thing.name} shared")
            stage.collection.objects.link(copy), shared.objects.link(made)
            moving.append((copy, made))
    stage.frame_set(frames[0] - 1)  # 3.4 leaves keys as they are at the frame that a new scene is at
    for frame in frames:
        stage.frame_set(frame)
        stage.view_layers[0].update()
        for sequence in sequences:
            sequence.add(frame, stage.view_layers[0].depsgraph)
        for copy, made in moving:
            _key_place(made, copy.matrix_world, frame)
    for copy, made in moving:
        _make_linear(made)
        stage.collection.objects.unlink(copy)
    for sequence in sequences:
        sequence.end(stage)
    return [f"it holds {sum(len(s.shown) for s in sequences)} meshes"] if sequences else []


def _key_place(made, matrix, frame):
    made.rotation_mode = "QUATERNION"
    before = made.rotation_quaternion.copy()
    made.location, made.rotation_quaternion, made.scale = matrix.decompose()
    if before.dot(made.rotation_quaternion) < 0:  # the same rotation, the short way round
        made.rotation_quaternion.negate()
    for name in ("location", "rotation_quaternion", "scale"):
        made.keyframe_insert(name, frame=frame)


def _make_linear(made):
    for curve in blender_versions.curves_of(made.animation_data) if made is not None else ():
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
