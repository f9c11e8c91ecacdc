"""Draws a body's edges as the tree stands, at rest: what is selected, and how tough the rest is."""
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..base import blender_versions, runtime
from ..tree import trees
from ..bake import edges
from . import preview_source

_SELECTED = (1.0, 0.62, 0.1, 1.0)
_OPACITY = 0.55  # of what is not selected
stroke = []  # points of a stroke that is being drawn
_batches = {}  # full name of a tree: (key, batch)
_handles = []


def lines(found, chosen):
    """Ends (2 m, 3) f32 of the lines between fragments' centres, and colours (2 m, 4) f32; selected ones last, so that they lie above."""
    ratio = found.toughness / found.own_toughness if found.own_toughness else np.where(np.isinf(found.toughness), 1.0, 0.0)
    colors = np.column_stack([preview_source.strength(ratio), np.full(len(ratio), _OPACITY)])
    colors[chosen] = _SELECTED
    order = np.argsort(chosen, kind="stable")
    ends = found.center[found.pairs[order]].reshape(-1, 3)
    return ends.astype(np.float32), np.repeat(colors[order], 2, 0).astype(np.float32)


def _batch(tree, scene):
    """Of a tree whose edges are known as they are now; None otherwise."""
    known = edges.at_hand(tree, scene)
    found = known.get(tree.edges_of) if known else None
    if found is None or not len(found.pairs):
        return None
    key = id(found), tree.edges_stamp, tree.selected_edges
    if _batches.get(tree.name_full, (None,))[0] != key:
        ends, colors = lines(found, edges.selected(tree, tree.edges_of, found))
        shader = gpu.shader.from_builtin(blender_versions.flat_color_shader_in_space())
        _batches[tree.name_full] = key, batch_for_shader(shader, "LINES", {"pos": ends, "color": colors}), shader
    return _batches[tree.name_full][1:]


def draw(scene):
    """Needs a graphics context and its matrices."""
    before = gpu.state.depth_test_get(), gpu.state.blend_get(), gpu.state.line_width_get()
    gpu.state.depth_test_set("NONE"), gpu.state.blend_set("ALPHA"), gpu.state.line_width_set(2)
    try:
        for tree in trees.trees():
            made = _batch(tree, scene) if tree.shows_edges else None
            if made is not None:
                made[0].draw(made[1])
        if len(stroke) > 1:
            shader = gpu.shader.from_builtin(blender_versions.flat_color_shader_in_space())
            batch_for_shader(shader, "LINE_STRIP", {"pos": stroke, "color": [_SELECTED] * len(stroke)}).draw(shader)
    finally:
        gpu.state.depth_test_set(before[0]), gpu.state.blend_set(before[1]), gpu.state.line_width_set(before[2])


@runtime.guarded
def _draw():
    draw(bpy.context.scene)


def forget():
    """Another file is open."""
    _batches.clear()
    stroke.clear()


def register():
    if not bpy.app.background:
        _handles.append(bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW"))


def unregister():
    forget()
    for handle in _handles:
        bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
    _handles.clear()
