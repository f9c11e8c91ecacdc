"""What the library is told of Blender's force fields, and of objects that stand for places of forces, as the frame is now."""
from mathutils import Vector

from ..base import core
from ..tree import pickers
from .scene_input import decimal, placement, vector

# Of a force field, what is told for each kind of node.
_DESCRIBED = ("type", "strength", "linear_drag", "inflow", "falloff_power", "size", "seed", "use_max_distance", "distance_max")


def _field(thing, node):
    field, taken = thing.field, pickers.FIELDS[node.sunder_type]
    if field is None or field.type not in taken:
        kind = "no" if field is None or field.type == "NONE" else f"a {field.type.replace('_', ' ').lower()}"
        raise core.Refused(f"object '{thing.name}' has {kind} force field: this node takes {' or '.join(taken).lower()}",
                           node.graph_name)
    return field


def _reach(field):
    return decimal(field.distance_max) if field.use_max_distance else None


def _force(field, _place, axis):
    if field.type == "DRAG":
        return {"drag": decimal(field.linear_drag), "wind": [0.0, 0.0, 0.0]}
    return {"wind": vector(axis * field.strength)}


def _point_force(field, place, _axis):
    return {"position": vector(place), "strength": decimal(field.strength), "falloff": decimal(field.falloff_power),
            "reach": _reach(field)}


def _vortex(field, place, axis):
    return {"position": vector(place), "axis": vector(axis), "swirl": decimal(field.strength), "inflow": decimal(field.inflow),
            "falloff": decimal(field.falloff_power), "reach": _reach(field)}


def _turbulence(field, place, _axis):
    placed = {"position": vector(place)} if field.use_max_distance else {}
    return {"strength": decimal(abs(field.strength)), "size": decimal(max(field.size, 1e-3)), "seed": field.seed,
            "reach": _reach(field), **placed}


_OF = {"force": _force, "point_force": _point_force, "vortex": _vortex, "turbulence": _turbulence}


def values(thing, node):
    """{parameter: value} of a node that stands for an object."""
    place, turn, _ = placement(thing.matrix_world)
    axis = turn @ Vector((0, 0, 1))
    if node.sunder_type == "blast":
        return {"position": vector(place), **({"direction": vector(axis)} if node.spread == "cone" else {})}
    return _OF[node.sunder_type](_field(thing, node), place, axis)


def described(thing):
    """What of a force field a bake depends on, as plain data."""
    field = thing.field
    if field is None:
        return []
    told = (getattr(field, name) for name in _DESCRIBED)
    return [round(v, 6) if isinstance(v, float) else v for v in told]
