"""What a result does besides what its mesh shows: where it is at each frame, and what keys, drivers and strips change.

It is sampled and keyed, for what drives it in its own file is not to come along. Keys hold a place, a rotation and three
scales; what is left of a matrix, shear below an unevenly scaled parent, is held by `matrix_parent_inverse`.
"""
import re

import bpy
import numpy as np
from mathutils import Matrix

from ..base import blender_versions, core
from ..tree import keys
from ..results import parts, player, results

HIDDEN = ("hide_viewport", "hide_render")
_OF_PLACE = ("location", "rotation", "scale", "delta_", "constraints[", "sunder.")
_LAST_STEP = re.compile(r'(.*?)\.?(\w+|\["((?:[^"\\]|\\.)*)"\])$')  # of a data path: an attribute or a key
_SHEAR = 1e-5  # what keys may be off, as a share of the object's size


def _split(matrix):
    """(Place, rotation and scales; shear: 4x4, None for none): their product is `matrix`. A rotation before it changes the
    rotation alone."""
    whole = np.array(matrix, np.float64)
    left, _, right = np.linalg.svd(whole[:3, :3])
    sign = np.sign(np.linalg.det(left @ right))
    rotation, scales = sign * (left @ right), sign * np.linalg.norm(whole[:3, :3], axis=0)
    rest = rotation.T @ whole[:3, :3] / np.where(scales, scales, 1)[:, None]
    rest[:, scales == 0] = np.eye(3)[:, scales == 0]
    shear = None if np.abs(rest - np.eye(3)).max() < _SHEAR else Matrix(rest.tolist()).to_4x4()
    return (matrix.to_translation(), Matrix(rotation.tolist()).to_quaternion(), scales.tolist()), shear


def _plain(value):
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def _set(thing, path, value):
    owner, name, key = _LAST_STEP.match(path).groups()
    owner = thing.path_resolve(owner) if owner else thing
    if key is None:
        setattr(owner, name, value)
    else:
        owner[re.sub(r"\\(.)", r"\1", key)] = value


class Motion:
    """Of one result, in the order of `frames`: places and shears as `_split` gives them, `values` of each path that changes."""

    def __init__(self, thing, frames):
        self._thing, self._frames, self._places, self.shears, self.values = thing, frames, [], [], {}

    def add(self, evaluated, matrix):
        place, shear = _split(matrix)
        if self._places and self._places[-1][1].dot(place[1]) < 0:
            place[1].negate()  # the same rotation, the short way round
        self._places.append(place)
        self.shears.append(shear)
        for path in self.values:
            self.values[path].append(_plain(evaluated.path_resolve(path)))

    def fill(self):
        """What was sampled once stays."""
        self._places *= len(self._frames) // len(self._places)
        self.shears *= len(self._frames) // len(self.shears)

    def moves(self):
        return any(place != self._places[0] for place in self._places)

    def is_sheared(self):
        return any(shear is not None for shear in self.shears)

    def has_shear(self, shear, i):
        """Whether that of a frame is `shear`, or as good as that."""
        own, other = self.shears[i] or Matrix(), shear or Matrix()
        return np.abs(np.array(own) - np.array(other)).max() < _SHEAR

    def is_hidden(self, name, i):
        """name: one of HIDDEN."""
        return self.values[name][i] if name in self.values else results.is_hidden(self._thing, name)

    def place(self, thing, i=0):
        thing.rotation_mode = "QUATERNION"
        thing.location, thing.rotation_quaternion, thing.scale = self._places[i]

    def key_place(self, thing):
        if self.moves():
            for i, frame in enumerate(self._frames):
                self.place(thing, i)
                for name in ("location", "rotation_quaternion", "scale"):
                    thing.keyframe_insert(name, frame=frame)
            _make_linear(thing)
        self.place(thing)

    def handle(self, name, collection):
        """An empty for what `hang` hangs on it."""
        handle = bpy.data.objects.new(name, None)
        collection.objects.link(handle)
        return handle

    def holder(self, made, collection):
        """What is to be placed for `made` to be: itself, or a handle where it is sheared."""
        if not self.is_sheared():
            return made
        handle = self.handle(f"{made.name} handle", collection)
        self.hang(made, handle)
        return handle

    def hang(self, made, handle, i=0):
        made.parent, made.matrix_parent_inverse = handle, self.shears[i] or Matrix()
        made.matrix_basis.identity()

    def key_values(self, made, span=slice(None), chosen=lambda path: True):
        """Sets what changes in a span of the frames, and keys what changes there. chosen: which paths."""
        for path, values in self.values.items():
            values = values[span]
            if not chosen(path):
                continue
            if any(value != values[0] for value in values):
                for frame, value in zip(self._frames[span], values):
                    _set(made, path, value)
                    made.keyframe_insert(path, frame=frame)
            _set(made, path, values[0])
        _make_linear(made)


def of_modifiers(path):
    return path.startswith("modifiers[")


def _make_linear(made):
    for curve in blender_versions.curves_of(made.animation_data) if made.animation_data else ():
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"


class _Probe:
    """A result's copy, driven as that is. Blender evaluates what is hidden where something visible hangs on it."""

    def __init__(self, thing, frames, stage):
        self.motion, self._copy = Motion(thing, frames), results.local_copy(thing)
        if parts.shows_mesh(thing):
            self._copy.sunder.tree, self._copy.data = None, bpy.data.meshes.new("probe")
        self._follower = bpy.data.objects.new("follower", None)
        self._follower.parent = self._copy
        for one in (self._copy, self._follower):
            stage.collection.objects.link(one)
        for path in sorted({curve.data_path for curve in keys.curves(thing)}):
            try:
                thing.path_resolve(path)
            except ValueError:  # of what is gone
                continue
            if not path.startswith(_OF_PLACE):
                self.motion.values[path] = []

    def take(self, graph):
        self.motion.add(self._copy.evaluated_get(graph), self._follower.evaluated_get(graph).matrix_world)

    def remove(self):
        for one in (self._copy, self._follower):
            bpy.data.objects.remove(one)


def sample(things, frames, stage):
    """{thing: Motion}. A generator, as all that steps through the frames: it gives each before it goes on."""
    probes = {thing: _Probe(thing, frames, stage) for thing in things}
    is_still = all(parts.shows_mesh(thing) and not parts.has_motion(thing) for thing in things)
    stage.frame_set(frames[0] - 1)  # 3.4 leaves keys as they are at the frame that a new scene is at
    for frame in frames[:1] if is_still else frames:
        yield frame
        stage.frame_set(frame)
        stage.view_layers[0].update()
        for thing, probe in probes.items():
            if not parts.shows_mesh(thing) and player.fault(thing):
                raise core.Refused(player.fault(thing))
            probe.take(stage.view_layers[0].depsgraph)
    for probe in probes.values():
        probe.remove()
        if is_still:
            probe.motion.fill()
    return {thing: probe.motion for thing, probe in probes.items()}


def notes(motions, is_cache):
    """What is not there as it is with Sunder, or is not seen."""

    def told(sentence, is_so):
        names = [thing.name for thing, motion in motions.items() if is_so(thing, motion)]
        return [f"{sentence}: {', '.join(names)}"] if names else []

    def is_lost(thing, motion):
        varies = not all(motion.has_shear(motion.shears[0], i) for i in range(len(motion.shears)))
        return varies and (is_cache or not parts.shows_mesh(thing))

    linked = {thing for o in bpy.data.objects for c in blender_versions.light_collections(o) for thing in (o, *c.all_objects)}
    way = " (with Holds set to A Mesh a Frame it is kept of meshes)" if is_cache else ""
    return [
        *told(f"shear that changes is kept as at the first frame{way}", is_lost),
        *told("hidden in renders there, as here", lambda thing, _: results.is_hidden(thing, "hide_render")),
        *told("light linking does not come along", lambda thing, _: thing in linked),
    ]
