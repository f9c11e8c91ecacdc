"""What moves: animated parameters of nodes, objects that do not stand still, and what their motion is made of."""
from ..base.blender_versions import curves_of


def is_animated(thing):
    """Whether a datablock has keys, drivers or strips of its own."""
    data = getattr(thing, "animation_data", None)
    return data is not None and bool(curves_of(data) or data.drivers or data.nla_tracks)


def chain(thing):
    """The object and its parents."""
    while thing is not None:
        yield thing
        thing = thing.parent


def moves(thing):
    """Whether an object may stand elsewhere at another frame."""
    return any(is_animated(o) or o.constraints or o.rigid_body for o in chain(thing))


def is_deforming(thing):
    """Whether an object's mesh may differ at another frame."""
    data = thing.data
    keys = getattr(data, "shape_keys", None)
    names_others = any(
        m.type in ("ARMATURE", "HOOK", "CLOTH", "SOFT_BODY", "OCEAN", "WAVE", "MESH_CACHE", "NODES", "BUILD", "EXPLODE",
                   "FLUID", "SURFACE_DEFORM", "MESH_DEFORM", "LATTICE", "MESH_SEQUENCE_CACHE", "DYNAMIC_PAINT")
        for m in thing.modifiers
    )
    own = any("modifiers[" in c.data_path for c in _own_curves(thing))
    return names_others or own or is_animated(data) or (keys is not None and is_animated(keys))


def describe_deformation(thing):
    """What deforms an object's mesh over time, as plain data: keys of its data, of its shape keys, and the motion of what its
    modifiers name."""
    keys = getattr(thing.data, "shape_keys", None)
    named = [getattr(m, "object", None) for m in thing.modifiers]
    return [describe(thing.data), describe(keys), *(describe_motion(o) + describe(o) for o in named if o is not None)]


def _own_curves(thing):
    data = thing.animation_data
    return [] if data is None else [*curves_of(data), *data.drivers]


def describe_curve(curve):
    """A curve or driver as plain data, for comparing."""
    plain = [curve.data_path, curve.array_index, curve.extrapolation, curve.mute]
    plain += [[*k.co, *k.handle_left, *k.handle_right, k.interpolation, k.easing] for k in curve.keyframe_points]
    driver = getattr(curve, "driver", None)
    if driver is not None:
        plain += [driver.type, driver.expression]
        for v in driver.variables:
            plain += [[v.name, v.type] + [[getattr(t.id, "name", ""), t.data_path, t.transform_type] for t in v.targets]]
    return plain


def describe(thing):
    """All keys, drivers and strips of a datablock as plain data."""
    data = getattr(thing, "animation_data", None)
    if data is None:
        return []
    strips = [
        [s.name, s.frame_start, s.frame_end, s.scale, s.repeat, [describe_curve(c) for c in curves_of(s)]]
        for track in data.nla_tracks
        for s in track.strips
    ]
    return [[describe_curve(c) for c in [*curves_of(data), *data.drivers]], strips]


def describe_motion(thing):
    """What decides where an object is over time, as plain data; needs no step through the frames."""
    if not moves(thing):
        return [list(row) for row in thing.matrix_world]
    described = []
    for o in chain(thing):
        keyed = {(c.data_path, c.array_index) for c in _own_curves(o)}
        rest = []
        for name in ("location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale"):
            rest += [v for i, v in enumerate(getattr(o, name)) if (name, i) not in keyed]
        constraints = [[c.type, c.mute, c.influence, getattr(getattr(c, "target", None), "name", "")]
                       for c in o.constraints]
        described.append([o.rotation_mode, rest, describe(o), constraints])
    return described
