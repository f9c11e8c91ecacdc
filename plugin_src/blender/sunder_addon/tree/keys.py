"""Which parameters of a tree's nodes are changed by keys, drivers or strips."""
import re

from ..base.blender_versions import curves_of

_NODE_PATH = re.compile(r'^nodes\["((?:[^"\\]|\\.)*)"\]\.(\w+)$')


def curves(thing):
    """All curves and drivers of a datablock, those of strips included."""
    data = thing.animation_data
    if data is None:
        return []
    return [*curves_of(data), *data.drivers, *(c for track in data.nla_tracks for s in track.strips for c in curves_of(s))]


def animated_attributes(tree):
    """{node name: {attribute}} of what keys or drivers change."""
    found = {}
    for curve in curves(tree):
        match = _NODE_PATH.match(curve.data_path)
        if match:
            name = re.sub(r"\\(.)", r"\1", match[1])
            found.setdefault(name, set()).add(match[2])
    return found
