"""Which parameters of a node count as it stands: what others they need, as the library's descriptions tell, and what objects
stand in for. What does not count is neither passed on nor asked for; its value and its keys stay.
"""
from ..base import descriptions
from . import keys, parameters, pickers


def _described(node, name):
    return next(p for p in descriptions.parameters(node.sunder_type) if p["name"] == name)


def _holds(node, condition):
    p = _described(node, condition["parameter"])
    value = parameters.value(p, node)
    if "values" in condition:
        return value in condition["values"]
    if "above" not in condition:
        return value is not None
    if p["animatable"] and parameters.attribute(p["name"]) in keys.animated_attributes(node.id_data).get(node.name, ()):
        return True  # at some frame it may
    return isinstance(value, (int, float)) and value > condition["above"]


def _lacks(node, p):
    """Of each alternative what does not hold; None if the parameter has an effect."""
    lacks = [[c for c in alternative if not _holds(node, c)] for alternative in p.get("needs", ())]
    return None if not lacks or [] in lacks else lacks


def counts(node, name):
    """Whether a parameter changes what the node gives, as far as the node can tell."""
    return not pickers.is_replaced(node, name) and _lacks(node, _described(node, name)) is None


def is_shown(node, name):
    """Whether it has a row. Other choices of the node have other rows; where a number or a switch alone stands in its way, it
    stays in its place (`lack`)."""
    return not pickers.is_replaced(node, name) and (counts(node, name) or bool(lack(node, name)))


def lack(node, name):
    """What a parameter needs to count, in words, where that is other than a choice; else empty."""
    for lacking in _lacks(node, _described(node, name)) or ():
        if all(_described(node, c["parameter"])["type"] != "choice" for c in lacking):
            return " and ".join(_spoken(node, c) for c in lacking)
    return ""


def _spoken(node, condition):
    label = _described(node, condition["parameter"])["label"]
    if "above" in condition:
        return f"{label} > {condition['above']:g}"
    if "values" not in condition:
        return label
    if condition["values"] == [None]:
        return f"no {label}"
    return f"{label} = " + " or ".join(f"{v:g}" if isinstance(v, float) else str(v) for v in condition["values"])
