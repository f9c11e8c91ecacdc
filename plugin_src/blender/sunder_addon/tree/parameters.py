"""Parameters of a node description as Blender properties, and the values of such properties as Sunder takes them."""
import keyword
import math
import re

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    IntVectorProperty,
    StringProperty,
)

from ..base import descriptions

# Blender's own names of the units that it can show; others stand in the label.
_UNITS = {"m": "LENGTH", "kg": "MASS", "m/s": "VELOCITY", "m/s2": "ACCELERATION", "degrees": "ROTATION"}
_OF_THREE = ("VELOCITY", "ACCELERATION")  # a vector of such a unit has X, Y and Z before its numbers by this subtype alone
_POWERS = str.maketrans("23", "²³")  # as Blender writes units
_INT_LIMIT = 2**31 - 1
_JUST_ABOVE = 1e-6  # the least value where the range excludes its bound
# Types without a field on the node: vertex groups and lists of points come from objects (pickers.py, scene_input.py), numbers of
# fields from files.
NO_FIELD = ("vertex_groups", "points", "vectors")
_IF_USED = 0.1  # what a parameter that is null by default holds when it is switched on


def attribute(name):
    """The node's attribute that holds a parameter: its name, with _ behind it where Python or Blender has that name."""
    taken = keyword.iskeyword(name) or name in bpy.types.Node.bl_rna.properties
    return name + "_" if taken else name


def switch(name):
    """The attribute that tells whether a parameter that may be null is used."""
    return "use_" + name


def automatic(name):
    """The attribute that tells whether a parameter that may be "auto" is."""
    return "auto_" + name


def fold(label):
    """The attribute that tells whether a node shows a group of its parameters."""
    return "unfolds_" + re.sub("[^a-z]+", "_", label.lower())


def folds(node_type):
    """{attribute: Blender property} for the groups of one node type: how it looks, and nothing that counts."""
    return {fold(label): BoolProperty(name=label, description=f"Show {', '.join(p['label'] for p in some)}", options=set())
            for label, some in descriptions.groups(node_type).items() if label}


def begin(p, node):
    """What a new node begins with other than Blender's default, which is what nodes of files saved before have."""
    if p["automatic"] and p["default"] == "auto":
        setattr(node, automatic(p["name"]), True)
        if p["nullable"]:
            setattr(node, switch(p["name"]), True)


def is_angle(p):
    return p["unit"] == "degrees"


def _limits(p, kind):
    limits = {}
    if "min" in p or "above" in p:
        limits["min"] = kind(p["min"] if "min" in p else p["above"] + _JUST_ABOVE)
    if "max" in p or "below" in p:
        limits["max"] = kind(p["max"] if "max" in p else p["below"] - _JUST_ABOVE)
    if kind is int:
        limits = {k: max(-_INT_LIMIT, min(_INT_LIMIT, v)) for k, v in limits.items()}
    elif is_angle(p):
        limits = {k: math.radians(v) for k, v in limits.items()}
    return limits


def _former_default(p):
    """What nodes of files that were saved before have."""
    return p["former_defaults"][-1]["default"] if "former_defaults" in p else p["default"]


def _default(p):
    value = _former_default(p)
    if value == "auto" and p["automatic"]:
        value = p["min"]
    if value is None:
        value = 1 if p["type"] == "integer" else _IF_USED
    if is_angle(p):
        return [math.radians(v) for v in value] if isinstance(value, list) else math.radians(value)
    return value


def label(p):
    unit = p["unit"]
    return p["label"] if not unit or unit in _UNITS else f"{p['label']} ({unit.translate(_POWERS)})"


def properties(p, changed):
    """Blender properties of one parameter as {attribute: property}; `changed(self, context)` is called on edits."""
    kind = p["type"]
    common = {"name": label(p), "description": p["sentence"].rstrip("."), "update": changed}
    common["options"] = {"ANIMATABLE"} if p["animatable"] else set()
    made = {}
    if kind == "boolean":
        made[attribute(p["name"])] = BoolProperty(default=p["default"], **common)
    elif kind == "choice" or "choices" in p:
        items = [(str(c), str(c).replace("_", " ").title(), p["sentence"].rstrip(".")) for c in p["choices"]]
        made[attribute(p["name"])] = EnumProperty(items=items, default=str(p["default"]), **common)
    elif kind == "integer":
        made[attribute(p["name"])] = IntProperty(default=_default(p), **_limits(p, int), **common)
    elif kind == "number":
        unit = {"unit": _UNITS[p["unit"]]} if p["unit"] in _UNITS else {}
        if is_angle(p):
            unit = {"subtype": "ANGLE"}
        made[attribute(p["name"])] = FloatProperty(
            default=_default(p), precision=3, **_limits(p, float), **unit, **common
        )
    elif kind == "vector3":
        unit = {"subtype": "XYZ"}
        if is_angle(p):
            unit = {"subtype": "EULER"}
        elif _UNITS.get(p["unit"]) in _OF_THREE:
            unit = {"subtype": _UNITS[p["unit"]]}
        elif p["unit"] in _UNITS:
            unit["unit"] = _UNITS[p["unit"]]
        made[attribute(p["name"])] = FloatVectorProperty(
            size=3, default=_default(p), precision=3, **_limits(p, float), **unit, **common
        )
    elif kind == "integer3":
        made[attribute(p["name"])] = IntVectorProperty(
            size=3, default=_default(p), subtype="XYZ", **_limits(p, int), **common
        )
    elif kind in ("text", "output_path"):
        made[attribute(p["name"])] = StringProperty(default=p["default"], **common)
    elif kind == "path":
        made[attribute(p["name"])] = StringProperty(default=p["default"], subtype="FILE_PATH", **common)
    elif kind not in NO_FIELD:
        raise ValueError(f"parameter type '{kind}' is not known to this add-on")
    if p["nullable"]:
        made[switch(p["name"])] = BoolProperty(
            name="Use " + p["label"], description=p["sentence"].rstrip("."), options=set(), update=changed,
            default=_former_default(p) is not None,
        )
    if p["automatic"]:
        made[automatic(p["name"])] = BoolProperty(
            name="Automatic " + p["label"], description=p["sentence"].rstrip("."), options=set(), update=changed,
            default=p["default"] == "auto" and "former_defaults" not in p,  # nodes of before keep what they had
        )
    return made


def decimal(value):
    """The shortest number that is this 32-bit float: 0.05 for what Blender gives back as 0.05000000074505806."""
    return float(str(np.float32(value)))


def value(p, node):
    """The parameter's value as Sunder takes it; None for null."""
    if p["automatic"] and getattr(node, automatic(p["name"])):
        return "auto"
    if p["nullable"] and not getattr(node, switch(p["name"])):
        return None
    raw = getattr(node, attribute(p["name"]))
    kind = p["type"]
    convert = (lambda v: decimal(math.degrees(v))) if is_angle(p) else decimal
    if kind == "number":
        return convert(raw)
    if kind == "vector3":
        return [convert(v) for v in raw]
    if kind == "integer3":
        return list(raw)
    if kind == "integer":
        return int(raw)  # also of a choice
    return raw


def set_value(p, node, given):
    """Sets what Sunder would take: the inverse of `value`."""
    if p["type"] in NO_FIELD:
        ways = {"points": f"an object: set `{p['name']}_object` or `{p['name']}_collection`",
                "vectors": "a file: set `source` and `path`", "vertex_groups": "the mesh's own vertex groups"}
        raise AttributeError(f"'{p['name']}' is taken from {ways[p['type']]}")
    if p["automatic"]:
        setattr(node, automatic(p["name"]), given == "auto")
        if given == "auto":
            return
    if p["nullable"]:
        setattr(node, switch(p["name"]), given is not None)
        if given is None:
            return
    if is_angle(p):
        given = [math.radians(v) for v in given] if isinstance(given, (list, tuple)) else math.radians(given)
    if "choices" in p:
        given = str(given)
    setattr(node, attribute(p["name"]), given)
