"""A shot as a mesh for each frame, each on an object that is shown in its time, and keys for what moves as a whole.

It plays in every Blender with all that meshes carry, but a shot of a million triangles makes a .blend of gigabytes.
"""
import bpy

from ..base import core
from ..results import parts, player, rest_coordinates, result_mesh, results
from . import share_motion

_AT_REST = "sunder_at_rest"  # a use of a texture mesh that Blender counts (rest_coordinates.py)
_GOES_ON = {"CLOTH", "DYNAMIC_PAINT", "FLUID", "PARTICLE_SYSTEM", "SOFT_BODY"}  # modifiers that go on from the frame before


class _Sequence:
    """Objects of one result, each with the mesh of one frame or of several that are alike. `shown`: [(number of its first
    frame, object)]."""

    def __init__(self, thing, motion, stage, shared):
        self.thing, self.motion, self.shared = thing, motion, shared
        self.shown, self._key, self._at_rest = [], None, {}
        mesh = bpy.data.meshes.new(f"{thing.name} shared")
        for slot in thing.material_slots:
            mesh.materials.append(slot.material)
        self.copy = results.player_of(thing, mesh.name, mesh)
        stage.collection.objects.link(self.copy)
        self.handle = None
        if motion.moves() or motion.is_sheared():
            self.handle = motion.handle(f"{thing.name} shared", shared)
            motion.key_place(self.handle)

    def add(self, i, frame):
        if player.fault(self.thing):
            raise core.Refused(player.fault(self.thing))
        key = self.copy.data[player.SHOWN]
        is_same = key == self._key
        if is_same and self.motion.has_shear(self.motion.shears[self.shown[-1][0]], i):
            return
        self._key = key
        name = f"{self.thing.name} shared {frame:04d}"
        made = results.twin(self.thing, name, self.shown[-1][1].data if is_same else self._mesh(name))
        rest_coordinates.prepare(made)
        if self.handle is not None:
            self.motion.hang(made, self.handle, i)
        self.shared.objects.link(made)
        self.shown.append((i, made))

    def _mesh(self, name):
        source = self.copy.data
        at_rest, source.texco_mesh = source.texco_mesh, None  # a copy would take back a use that is not its own
        mesh, source.texco_mesh = source.copy(), at_rest
        mesh.name = name
        for name in (player.SHOWN, result_mesh.FACES, _AT_REST):
            if name in mesh:
                del mesh[name]
        if at_rest is not None:
            stamp = source[result_mesh.FACES]
            if stamp not in self._at_rest:
                self._at_rest[stamp] = at_rest.copy()
            mesh.texco_mesh = mesh[_AT_REST] = self._at_rest[stamp]
        return mesh

    def end(self, frames):
        """Each is shown from its frame to that of the next one, where the result is; the first also before, the last also
        after."""
        starts = [i for i, _ in self.shown]
        for (start, made), after in zip(self.shown, [*starts[1:], len(frames)]):
            self.motion.key_values(made, slice(start, after), lambda path: path not in share_motion.HIDDEN)
            for name in share_motion.HIDDEN:
                self._key_hidden(made, name, start, after, frames)

    def _key_hidden(self, made, name, start, after, frames):
        span = range(max(start - 1, 0), min(after + 1, len(frames)))
        states = [not start <= i < after or self.motion.is_hidden(name, i) for i in span]
        for at, i in enumerate(span):
            if any(state != states[0] for state in states) and (at == 0 or states[at] != states[at - 1]):
                setattr(made, name, states[at])
                made.keyframe_insert(name, frame=frames[i])
        setattr(made, name, states[0])  # what is just linked shows the first


def make(things, frames, stage, shared):
    """Fills collection `shared`, working in scene `stage`. A generator of frames; returns notes."""
    motions = yield from share_motion.sample(things, frames, stage)
    for thing in things:
        if not parts.shows_mesh(thing):
            made, motion = results.twin(thing, f"{thing.name} shared"), motions[thing]
            shared.objects.link(made)
            motion.key_place(motion.holder(made, shared))
            motion.key_values(made)
    sequences = [_Sequence(thing, motions[thing], stage, shared) for thing in things if parts.shows_mesh(thing)]
    stage.frame_set(frames[0] - 1)
    for i, frame in enumerate(frames):
        yield frame
        stage.frame_set(frame)
        for sequence in sequences:
            sequence.add(i, frame)
    for sequence in sequences:
        stage.collection.objects.unlink(sequence.copy)
        sequence.end(frames)
    notes = share_motion.notes(motions, is_cache=False)
    going_on = [s.thing.name for s in sequences if any(m.type in _GOES_ON for m in s.thing.modifiers)]
    if going_on:
        notes.append(f"modifiers that go on from the frame before begin anew at each: {', '.join(going_on)}")
    return notes
