"""Draws the preview of result objects in 3D viewports: a handler that Blender calls with every redraw."""
import blf
import bpy
import gpu
import numpy as np
from bpy.app.handlers import persistent
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix, Vector

from ..base import bake_reader, blender_versions, core, runtime
from ..tree import trees
from ..bake import cache
from ..results import player
from . import preview_shader, preview_source

problems = {}  # name of a result object: why its preview is not drawn
_sources = {}  # (bake folder, node): preview_source.Source
_at_hand = {}  # bake folder: the graph that baked it, its mesh cut already; for one source alone, whose jobs hold it
_drawn = {}  # name of a result object: _Drawn
_shaders = {}
_handles = []
_GHOST = 0.12  # opacity of the body around its edges
_INNER = (0.62, 0.55, 0.50)  # break surfaces are darker than the outside


class _Drawn:
    """What one object's preview has on the graphics card. `key` tells of which frame, bake and mode."""

    key = frame = skin = balls = None


def _frame_key(thing, scene):
    """(key, manifest, folder) of what an object's preview shows now; None if there is nothing."""
    folder = cache.folder(thing.sunder.tree)
    manifest = cache.manifest(folder)
    shown = manifest.shown(player.nearest_frame(scene)) if manifest else None
    if shown is None:
        return None
    path, stamp = player.state_file(folder, manifest, shown, thing.sunder.node)
    return (folder, path, stamp, thing.sunder.preview, thing.sunder.preview_limit, _edges_as(thing)), manifest, folder


def _edges_as(thing):
    return thing.sunder.edges_as if thing.sunder.preview in ("EDGES", "SIMULATION") else "BREAKS"


def _cut_of(graph):
    """What a Source depends on: a longer shot is the same one."""
    return graph["nodes"], graph["frame_range"][0], graph["frame_rate"]


def _source(folder, manifest, node):
    """The bake's body; None while the library prepares it."""
    known = _sources.get((folder, node))
    if known is None or _cut_of(known.graph) != _cut_of(manifest.graph):
        known = _sources[folder, node] = preview_source.Source(folder, manifest.graph, node, _at_hand.pop(folder, None))
        known.start()
        if not bpy.app.timers.is_registered(_await):
            bpy.app.timers.register(_await, first_interval=0.1)
    if not known.is_ready:
        return None
    if known.error:
        raise core.Refused(known.error)
    return known


def take_over(job, tree):
    """After a bake: its graph spares previews that are on cutting the mesh again."""
    _at_hand.pop(job.folder, None)
    if tree is not None and not job.error and any(o.sunder.preview != "OFF" for o in trees.result_objects(tree)):
        _at_hand[job.folder] = job.graph
        job.graph.set_cache_limit(0)  # states are read from files


def _await():
    """Redraws once the library has cut what a preview shows; no thread may do so."""
    if any(not source.is_ready for source in _sources.values()):
        return 0.1
    redraw()
    return None


def redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def update(thing, scene):
    """Brings an object's preview to the scene's frame; returns its _Drawn, None while there is nothing to draw."""
    drawn = _drawn.setdefault(thing.name_full, _Drawn())
    wanted = _frame_key(thing, scene)
    if wanted is None:
        problems[thing.name_full] = "nothing baked yet: the preview shows what Bake makes"
        return None
    key, manifest, folder = wanted
    if drawn.key == key:
        return drawn if drawn.frame else None
    source = _source(folder, manifest, thing.sunder.node)
    if source is None:
        problems[thing.name_full] = "preparing the preview ..."
        return None
    drawn.key, drawn.frame = key, None  # what fails once is not tried again with every redraw
    frame = source.frame(key[1], thing.sunder.preview, thing.sunder.preview_limit, _edges_as(thing))
    if drawn.skin is None or drawn.surface is not frame.surface:
        drawn.skin, drawn.surface = preview_shader.Skin(frame.surface), frame.surface
    drawn.particles = preview_shader.texture(frame.particles, "RGBA32F")
    drawn.edges = preview_shader.Skin(frame.edges) if thing.sunder.preview in ("EDGES", "SIMULATION") else None
    if thing.sunder.preview == "SIMULATION":
        n = len(frame.particles)
        if drawn.balls is None or drawn.n_balls != n:
            drawn.balls, drawn.n_balls = preview_shader.Skin(preview_source.spheres(n)), n
        drawn.ellipsoids = preview_shader.texture(frame.ellipsoids, "RGBA32F")
    drawn.frame = frame
    problems.pop(thing.name_full, None)
    return drawn


def _shader(name, make):
    if name not in _shaders:
        _shaders[name] = make()
    return _shaders[name]


def _pass(batch, skin, particles, tint, light):
    if batch is None:
        return
    shader = _shader("draw", preview_shader.drawing_shader)
    shader.bind()
    preview_shader.bind(shader, particles, skin.influences)
    shader.uniform_float("tint", tint)
    shader.uniform_float("light", light)
    batch.draw(shader)


def draw_object(thing, drawn, to_screen, towards_viewer):
    """`to_screen`: from world to clip coordinates; `towards_viewer`: direction in the world."""
    place = thing.matrix_world @ Matrix.Translation(Vector(drawn.frame.center))
    shader = _shader("draw", preview_shader.drawing_shader)
    shader.bind()
    shader.uniform_float("to_screen", to_screen @ place)
    lit = (*(thing.matrix_world.to_3x3().inverted_safe() @ towards_viewer).normalized(), 1.0)
    unlit = (0.0, 0.0, 1.0, 0.0)
    mode = thing.sunder.preview
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    gpu.state.blend_set("NONE")
    if mode in ("EDGES", "SIMULATION"):
        gpu.state.line_width_set(2)
        _pass(drawn.edges.lines, drawn.edges, drawn.particles, (1, 1, 1, 1), unlit)
    if mode == "SIMULATION":
        _pass(drawn.balls.outer, drawn.balls, drawn.ellipsoids, (1, 1, 1, 1), lit)
        return
    alpha = 1.0
    if mode == "EDGES":
        alpha = _GHOST
        gpu.state.blend_set("ALPHA")
        gpu.state.depth_mask_set(False)
    _pass(drawn.skin.outer, drawn.skin, drawn.particles, (1, 1, 1, alpha), lit)
    _pass(drawn.skin.inner, drawn.skin, drawn.particles, (*_INNER, alpha), lit)


def _visible():
    layer, view = bpy.context.view_layer, bpy.context.space_data
    return [o for o in trees.result_objects()
            if o.sunder.preview != "OFF" and o.visible_get(view_layer=layer, viewport=view)]


@runtime.guarded
def _draw():
    things = _visible()
    if not things:
        return
    view = bpy.context.region_data
    towards_viewer = view.view_rotation @ Vector((0.25, 0.35, 0.9))
    before = gpu.state.depth_test_get(), gpu.state.depth_mask_get(), gpu.state.blend_get(), gpu.state.line_width_get()
    try:
        for thing in things:
            drawn = _updated(thing)
            if drawn is not None:
                draw_object(thing, drawn, view.perspective_matrix, towards_viewer)
    finally:
        gpu.state.depth_test_set(before[0]), gpu.state.depth_mask_set(before[1])
        gpu.state.blend_set(before[2]), gpu.state.line_width_set(before[3])


def _updated(thing):
    try:
        return update(thing, bpy.context.scene)
    except (core.Refused, core.Unusable, bake_reader.BakeError) as error:
        problems[thing.name_full] = str(error)
    except Exception as error:
        if type(error).__module__.split(".")[-1] != "errors":  # the library's own are told, all else is ours
            raise
        problems[thing.name_full] = str(error)
    return None


_LEGENDS = {
    "STRAIN": (preview_source.heat, "Strain", "0"),
    "TOUGHNESS": (lambda share: preview_source.traffic_light(1 - share), "Strain until it tears", "0"),
    "LOAD": (preview_source.heat, "Strain over toughness", "0"),
    "STRENGTH": (lambda share: preview_source.strength(10 ** (2 * share - 1)), "Times the toughness", "0.1"),
}
_MOST = {"LOAD": "1", "STRENGTH": "10"}


def _font(scale):
    blf.size(0, *blender_versions.text_size(11 * scale))
    blf.color(0, 0.9, 0.9, 0.9, 1)
    return 0


def _corner(scale):
    """Where text begins, right of the tools."""
    tools = sum(r.width for r in bpy.context.area.regions if r.type == "TOOLS" and r.width > 1)
    return tools + 24 * scale, 28 * scale


@runtime.guarded
def _draw_problems():
    """What is missing where a bounding box stands alone."""
    told = [f"{thing.name}: {problems[thing.name_full]}" for thing in _visible() if thing.name_full in problems]
    if not told:
        return
    scale = bpy.context.preferences.system.ui_scale
    font, (x, y) = _font(scale), _corner(scale)
    for i, text in enumerate(reversed(told)):
        blf.position(font, x, y + (40 + 16 * i) * scale, 0)
        blf.draw(font, text)


@runtime.guarded
def _draw_legend():
    """A bar of the colours, with what they stand for, for the active object's preview."""
    thing = bpy.context.view_layer.objects.active
    drawn = _drawn.get(thing.name_full) if thing else None
    shown = None if thing is None else _edges_as(thing) if thing.sunder.preview == "EDGES" else thing.sunder.preview
    if drawn is None or drawn.frame is None or shown not in _LEGENDS:
        return
    colors, title, least = _LEGENDS[shown]
    scale = bpy.context.preferences.system.ui_scale
    (x, y), width, height, n = _corner(scale), 180 * scale, 10 * scale, 32
    left = np.linspace(0, width, n + 1)
    quads = [((x + a, y), (x + b, y), (x + b, y + height), (x + a, y), (x + b, y + height), (x + a, y + height))
             for a, b in zip(left[:-1], left[1:])]
    name, width_of_a_point = blender_versions.flat_color_shader()
    shader = _shader("legend", lambda: gpu.shader.from_builtin(name))
    corners = [(*p, 0.0)[:width_of_a_point] for quad in quads for p in quad]
    color = [(*c, 1.0) for c in np.repeat(colors((np.arange(n) + 0.5) / n), 6, 0)]
    batch_for_shader(shader, "TRIS", {"pos": corners, "color": color}).draw(shader)
    limit = thing.sunder.preview_limit or drawn.frame.limit
    never = "never" if thing.sunder.preview == "TOUGHNESS" else f"{preview_source.LIMIT:g}"
    most = _MOST.get(shown) or (f"{limit:.3g}" if limit else never)
    font = _font(scale)
    for text, at in ((least, x), (most, x + width - blf.dimensions(font, most)[0]),
                     (title, x + (width - blf.dimensions(font, title)[0]) / 2)):
        blf.position(font, at, y + height + 5 * scale, 0)
        blf.draw(font, text)


@persistent
def forget(*_):
    """Another file is open, or none: nothing of the old one is kept."""
    for memory in (problems, _drawn, _at_hand):
        memory.clear()
    for key in [k for k, s in _sources.items() if s.is_ready]:
        del _sources[key]


def register():
    if bpy.app.background:  # there is nothing to draw on
        return
    add = bpy.types.SpaceView3D.draw_handler_add
    _handles.extend([add(_draw, (), "WINDOW", "POST_VIEW"), add(_draw_legend, (), "WINDOW", "POST_PIXEL"),
                     add(_draw_problems, (), "WINDOW", "POST_PIXEL")])
    bpy.app.handlers.load_pre.append(forget)


def unregister():
    for source in _sources.values():
        source.wait()  # its thread must not outlive the add-on
    forget(), _shaders.clear(), preview_shader.forget()
    if bpy.app.timers.is_registered(_await):
        bpy.app.timers.unregister(_await)
    for handle in _handles:
        bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
    _handles.clear()
    if forget in bpy.app.handlers.load_pre:
        bpy.app.handlers.load_pre.remove(forget)
