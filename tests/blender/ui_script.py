"""Inside Blender's window: a list of verbs as a user would do them, a screenshot after each (test_ui.py runs this).

    blender ... --python ui_script.py -- FOLDER

Steps run from timers, so that Blender draws and handles events between them. The end is FOLDER/told.json.
"""
import contextlib
import json
import os
import re
import subprocess
import sys
import time
import traceback

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from ui_panels import addon, on_top  # noqa: E402

FOLDER = sys.argv[sys.argv.index("--") + 1]
TOLD = {"passed": [], "failed": [], "times": {}}


def window():
    return bpy.context.window_manager.windows[0]


def area(kind):
    return next(a for a in window().screen.areas if a.ui_type == kind)


def within(kind):
    """Context of an editor's main region."""
    found = area(kind)
    region = next(r for r in found.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window(), area=found, region=region)


def shot(name):
    with bpy.context.temp_override(window=window()):
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
    subprocess.run(["import", "-window", "root", os.path.join(FOLDER, name + ".png")], check=True, timeout=60)


def key(name):
    """Pressed in the window under the mouse, as where a click gives the focus: no window manager does it here."""
    told = subprocess.run(["xdotool", "getmouselocation", "--shell"], check=True, timeout=20,
                          text=True, stdout=subprocess.PIPE).stdout
    window_below = re.search(r"^WINDOW=(\d+)$", told, re.MULTILINE)[1]
    subprocess.run(["xdotool", "windowfocus", window_below, "key", name], check=True, timeout=20)


def tree():
    return addon("tree.trees").trees()[0]


def node(kind):
    return next(n for n in tree().nodes if n.sunder_type == kind)


def result():
    return addon("tree.trees").result_objects()[0]


def frame_nodes():
    """All nodes in view; Blender knows their sizes once they were drawn."""
    area("SunderTree").spaces.active.node_tree = tree()
    yield 1.5
    with within("SunderTree"):
        bpy.ops.node.select_all(action="DESELECT")
    addon("interface.tree_layout").fill(window(), area("SunderTree"))
    yield 1.0


def open_tab(kind, below_top):
    """Clicks the Sunder tab of an editor's sidebar: Blender 3.4 has no other way to choose one."""
    found = area(kind)
    x, y = found.x + found.width - 13, window().height - found.y - found.height + below_top
    for action in (["mousemove", str(x + 1), str(y)], ["mousemove", str(x), str(y)], ["mousedown", "1"], ["mouseup", "1"]):
        subprocess.run(["xdotool", *action], check=True, timeout=20)
        yield 0.4  # Blender has to see one after the other


# Each step is a generator: it yields seconds to wait, during which Blender runs.

def arrange():
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    for other in [a for a in window().screen.areas if a.type in ("PROPERTIES", "OUTLINER")]:
        with bpy.context.temp_override(window=window(), area=other):
            bpy.ops.screen.area_close()
        yield 0.2
    with within("VIEW_3D"):
        bpy.ops.screen.area_split(direction="HORIZONTAL", factor=0.5)
    yield 0.3
    views = sorted((a for a in window().screen.areas if a.type == "VIEW_3D"), key=lambda a: a.y)
    views[0].ui_type = "SunderTree"
    views[-1].spaces.active.show_region_ui = True
    views[-1].spaces.active.shading.type = "SOLID"
    views[-1].spaces.active.shading.color_type = "MATERIAL"
    views[0].spaces.active.show_region_ui = True
    yield 0.3


def make():
    """Quick Fracture without its bake: the tree is there at once."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 24
    with within("VIEW_3D"):
        bpy.ops.mesh.primitive_torus_add(location=(0, 0, 1.5), rotation=(1.2, 0.2, 0))
        thing = bpy.context.object
        clay = bpy.data.materials.new("Clay")
        clay.diffuse_color = (0.45, 0.13, 0.07, 1)
        thing.data.materials.append(clay)
        bpy.ops.object.shade_smooth()
        bpy.ops.sunder.quick_fracture(preset="CLAY", pieces=80, bake=False)
    assert area("SunderTree").spaces.active.node_tree == tree()
    with within("VIEW_3D"):
        bpy.ops.view3d.view_axis(type="FRONT")
    region = area("VIEW_3D").spaces.active.region_3d
    region.view_perspective = "PERSP"
    from mathutils import Euler, Vector
    region.view_rotation = Euler((1.2, 0, 0.6)).to_quaternion()
    region.view_location, region.view_distance = Vector((0, 0, 1.1)), 9
    yield from frame_nodes()
    yield from open_tab("VIEW_3D", 221)
    yield from open_tab("SunderTree", 203)
    yield 0.5
    shot("1-quick-fracture")
    assert len(tree().nodes) == 6 and not node("solver").error


def rows():
    """Nodes are about as high as they were taken to be when they were placed, and open where they are told to."""
    layout = addon("interface.tree_layout")
    scale = bpy.context.preferences.system.ui_scale
    for found in tree().nodes:
        height, taken = found.dimensions.y / scale, layout.estimated_height(found)
        TOLD["times"][f"height of {found.name} by its rows' number, points"] = [round(height), round(taken)]
        assert abs(height - taken) < 0.15 * height, (found.name, height, taken)
    with within("SunderTree"):
        bpy.ops.screen.screen_full_area()
    yield from frame_nodes()
    shot("1-nodes")
    folds = (node("prefracture"), "unfolds_break_surfaces"), (node("body"), "unfolds_material")
    for is_open in (True, False):
        for owner, fold in folds:
            setattr(owner, fold, is_open)
        area("SunderTree").tag_redraw()
        yield 0.5
        layout.arrange(tree())
        tree().nodes.active = node("body")
        yield from frame_nodes()
        if is_open:
            shot("1-groups-open")
    with within("SunderTree"):
        bpy.ops.screen.back_to_previous()
    yield from frame_nodes()


def new_editor():
    """An area that is made an editor of trees shows the tree, with all of its nodes in view."""
    area("SunderTree").spaces.active.node_tree = None
    area("SunderTree").ui_type = "CONSOLE"
    yield 1.2  # looked at
    area("CONSOLE").ui_type = "SunderTree"
    yield 2.5
    found = area("SunderTree")
    assert found.spaces.active.node_tree == tree()
    region = next(r for r in found.regions if r.type == "WINDOW")
    scale = bpy.context.preferences.system.ui_scale
    for x, y in (n.location for n in tree().nodes):
        x, y = region.view2d.view_to_region(x * scale, y * scale, clip=False)
        assert 0 <= x < region.width and 0 <= y < region.height, (x, y)


def wrong_wire():
    before = len(tree().links)
    addon("interface.quick_fracture").connect(tree(), node("prefracture"), "fragments", node("deformer"), "state")
    yield 0.5
    shot("2-wrong-wire")
    assert node("deformer").error.startswith("State takes a state"), node("deformer").error
    assert len(tree().links) == before
    addon("base.runtime").forget_errors(tree().name_full)


def stop():
    """The bake is stopped by the key within a second of being pressed."""
    bpy.context.scene.frame_end = 900
    with within("VIEW_3D"):
        bpy.ops.sunder.bake("INVOKE_DEFAULT", tree=tree().name)
    for _ in range(600):
        manifest = addon("bake.cache").manifest(addon("bake.cache").folder(tree()))
        if manifest and len(manifest.numbers) >= 2:
            break
        yield 0.1
    shot("3-baking")
    assert addon("base.runtime").jobs, "the bake is at work"
    subprocess.run(["xdotool", "mousemove", "400", "200"], check=True, timeout=20)  # keys go to the editor below
    yield 0.2
    job = next(iter(addon("base.runtime").jobs.values()))
    cancelled, cancel = [], job.cancel

    def timed():
        cancelled.append(time.monotonic())
        cancel()

    job.cancel = timed
    key("Escape")
    begin = time.monotonic()
    while addon("base.runtime").jobs and time.monotonic() - begin < 30:
        if cancelled and not job.is_running:
            TOLD["times"].setdefault("ESC seen until the bake has ended, s", round(time.monotonic() - cancelled[0], 2))
        yield 0.02
    TOLD["times"]["ESC pressed until the window shows it, s"] = round(time.monotonic() - begin, 2)
    assert not addon("base.runtime").jobs and job.is_cancelled
    bpy.context.scene.frame_end = 24


def finish():
    with within("VIEW_3D"):
        bpy.ops.sunder.bake("INVOKE_DEFAULT", tree=tree().name)
    while addon("base.runtime").jobs:
        yield 0.2
    now = addon("bake.bake_status").status(tree(), bpy.context.scene)
    assert [now.state, now.is_stale] == ["complete", False], [now.state, now.text]
    bpy.context.scene.frame_set(12)
    yield 0.5
    shot("4-baked")


def what_broke():
    """The lists of both sidebars are drawn, and a row goes to its fragments in edit mode."""
    bpy.context.view_layer.objects.active = result()
    lists = addon("interface.report").lists()
    with within("VIEW_3D"):
        bpy.ops.sunder.report(tree=tree().name)
        bpy.ops.sunder.ask_fragments(tree=tree().name, fragments="all")
        bpy.ops.object.mode_set(mode="EDIT")
    assert len(lists.loads) == 80 and len(lists.breaks) > 0
    lists.at_load, lists.at_break = 0, len(lists.breaks) - 1
    assert bpy.context.scene.frame_current == lists.breaks[-1].frame
    with on_top("interface.report_panels"):
        yield 1.0
        shot("4-what-broke")
    with within("VIEW_3D"):
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.scene.frame_set(12)
    yield 0.5


def drag(kind, ways):
    """The left button down, along pixels of an editor's region, and up."""
    region = next(r for r in area(kind).regions if r.type == "WINDOW")
    moves = [["mousemove", str(region.x + int(x)), str(window().height - region.y - int(y))] for x, y in ways]
    for action in (moves[0], ["mousedown", "1"], *moves[1:], ["mouseup", "1"]):
        subprocess.run(["xdotool", *action], check=True, timeout=20)
        yield 0.3


def edges():
    """A box drawn in the view selects edges, a stroke over the body paints some; taken back, the bake is as it was."""
    known, name, bpy.context.view_layer.objects.active = addon("bake.edges"), tree().name, result()
    bpy.context.scene.frame_set(1)
    with within("VIEW_3D"):
        bpy.ops.sunder.show_edges(tree=name)
        assert bpy.ops.sunder.box_select_edges("INVOKE_DEFAULT", tree=name) == {"RUNNING_MODAL"}
    region = next(r for r in area("VIEW_3D").regions if r.type == "WINDOW")
    yield from drag("VIEW_3D", [(60, 0.95 * region.height), (200, 200), (0.5 * region.width, 60)])
    found = known.of(tree(), bpy.context.scene, node("body"))
    chosen = known.selected(tree(), "body", found)
    assert 0 < chosen.sum() < len(chosen), chosen.sum()
    with within("VIEW_3D"):
        assert bpy.ops.sunder.paint_edges("INVOKE_DEFAULT", tree=name) == {"RUNNING_MODAL"}
    view = area("VIEW_3D").spaces.active.region_3d
    yield from drag("VIEW_3D", [location_3d_to_region_2d(region, view, c) for c in found.center[:3]])
    assert [len(addon("tree.edits").places(n, "points")) > 0 for n in addon("tree.edits").of_body(node("body"))] == [True]
    with on_top("interface.edge_panels"):
        yield 1.0
        shot("4-edges")
    with within("VIEW_3D"):
        bpy.ops.sunder.select_edges(tree=name, by="ALL")
        bpy.ops.sunder.free_edges(tree=name)
        bpy.ops.sunder.show_edges(tree=name, action="HIDE")
    yield 1.0
    assert not addon("tree.edits").of_body(node("body")) and not addon("bake.bake_status").status(tree(), bpy.context.scene).is_stale
    bpy.context.scene.frame_set(12)
    yield 0.5


def error():
    """What the library has against a mesh stands on the node that is at fault."""
    thing = node("mesh_file").object
    bpy.ops.mesh.primitive_plane_add(location=(5, 5, 5))
    node("mesh_file").object = bpy.context.object
    try:
        bpy.ops.sunder.bake(tree=tree().name)
    except RuntimeError:
        pass
    yield 1.2
    with within("SunderTree"):
        bpy.ops.node.select_all(action="DESELECT")
        node("mesh_file").select = node("prefracture").select = True
        bpy.ops.node.view_selected()
        bpy.ops.node.select_all(action="DESELECT")
    yield 1.0
    shot("5-error-on-the-node")
    assert node("prefracture").error, "the node at fault says so"
    bpy.data.objects.remove(bpy.context.object)
    node("mesh_file").object = thing
    addon("base.runtime").forget_errors(tree().name_full)
    bpy.context.view_layer.objects.active = result()
    result().select_set(True)
    yield from frame_nodes()


def previews():
    for mode in ("PIECES", "STRAIN", "TOUGHNESS", "EDGES", "SIMULATION"):
        begin = time.monotonic()
        result().sunder.preview = mode
        yield 0.1
        for _ in range(60):
            drawn = addon("preview.preview")._drawn.get(result().name)
            if drawn is not None and drawn.key and drawn.key[3] == mode and drawn.frame is not None:
                break
            area("VIEW_3D").tag_redraw()
            yield 0.1
        else:
            raise AssertionError(f"{mode} was not drawn: {addon('preview.preview').problems}")
        TOLD["times"][f"preview {mode} drawn after, s"] = round(time.monotonic() - begin, 2)
        yield 0.2
        shot(f"6-preview-{mode.lower()}")
    bpy.context.scene.frame_set(8)
    yield 0.3
    assert addon("preview.preview")._drawn[result().name].key[1].endswith("0008.ply")
    result().sunder.preview = "OFF"
    yield 0.3


def render():
    """An animation is rendered from the window while the viewport shows results; the interface is locked."""
    scene = bpy.context.scene
    assert scene.render.use_lock_interface
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.render.resolution_x, scene.render.resolution_y = 160, 120
    scene.render.filepath = os.path.join(FOLDER, "render_")
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler, scene.camera = (4, -6, 3), (1.2, 0, 0.6), camera
    scene.frame_start, scene.frame_end = 6, 12
    ended = []
    over = lambda *_: ended.append(True)
    bpy.app.handlers.render_complete.append(over)
    bpy.app.handlers.render_cancel.append(over)
    with within("VIEW_3D"):
        bpy.ops.render.render("INVOKE_DEFAULT", animation=True)
    for _ in range(1200):
        if ended:
            break
        yield 0.1
    bpy.app.handlers.render_complete.remove(over), bpy.app.handlers.render_cancel.remove(over)
    assert ended and all(os.path.exists(os.path.join(FOLDER, f"render_{f:04d}.png")) for f in range(6, 13))
    scene.frame_start, scene.frame_end = 1, 24


def undo():
    with within("VIEW_3D"):
        bpy.ops.ed.undo_push(message="before")
    node("body").toughness = 0.5
    with within("VIEW_3D"):
        bpy.ops.ed.undo_push(message="tougher")
    yield 1.5
    assert addon("bake.bake_status").status(tree(), bpy.context.scene).is_stale
    shot("7-out-of-date")
    with within("VIEW_3D"):
        bpy.ops.ed.undo()
    yield 1.5
    assert not addon("bake.bake_status").status(tree(), bpy.context.scene).is_stale


def drawn_preview():
    for _ in range(200):
        drawn = addon("preview.preview")._drawn.get(result().name)
        if drawn is not None and drawn.frame is not None:
            return
        yield 0.1
    raise AssertionError(f"not drawn: {addon('preview.preview').problems}")


def reopen():
    """A file that was saved with a preview on shows it again, cut anew from the bake."""
    result().sunder.preview = "PIECES"
    bpy.context.scene.frame_set(10)
    path = os.path.join(FOLDER, "shot.blend")
    with bpy.context.temp_override(window=window()):
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
    yield 1.0
    yield from drawn_preview()
    shot("8-reopened")


def share():
    """By the click in the panel, with a preview on and while the animation plays."""
    thing = result()
    with within("VIEW_3D"):
        bpy.context.view_layer.objects.active = thing
        bpy.ops.screen.animation_play()
    yield 0.5
    scenes = len(bpy.data.scenes)
    module, whole = addon("exports.share"), addon("exports.share").share

    def unfinished(*arguments):
        """Stays at its first frame until it is stopped: on no machine is it done before the key comes."""
        with contextlib.closing(whole(*arguments)) as steps:
            frame = next(steps)
            while True:
                yield frame

    for is_stopped in (True, False):
        module.share = unfinished if is_stopped else whole
        with within("VIEW_3D"):
            assert bpy.ops.sunder.make_shareable("INVOKE_DEFAULT", kind="MESHES") == {"RUNNING_MODAL"}
        yield 0.1
        assert not is_stopped or len(bpy.data.scenes) > scenes  # the whole may be done by now
        deadline = time.monotonic() + 120
        while len(bpy.data.scenes) > scenes:
            assert time.monotonic() < deadline, "it goes on sharing"
            if is_stopped:
                key("Escape")
            yield 0.5
        assert not window().screen.is_animation_playing and thing.sunder.preview == "PIECES"
        path = module.found(tree())
        assert path is None if is_stopped else os.path.dirname(path) == FOLDER, path
    yield 1.0
    shot("9-shared")
    with within("VIEW_3D"):
        bpy.ops.ed.undo_push(message="shared")
        assert bpy.ops.sunder.use_shared() == {"FINISHED"}
        bpy.ops.ed.undo_push(message="linked")
    bpy.context.scene.frame_set(14)
    yield 1.0
    shot("10-linked-what-was-shared")
    with within("VIEW_3D"):
        bpy.ops.ed.undo()
    yield from drawn_preview()


def toggle():
    """Fifty times off and on with a preview on the screen; Blender draws in between, now and then until it is there again."""
    for i in range(50):
        bpy.ops.preferences.addon_disable(module="sunder_addon")
        yield 0.05
        bpy.ops.preferences.addon_enable(module="sunder_addon")
        yield 0.05
        if i % 10 == 9:
            yield from drawn_preview()


STEPS = [arrange, make, rows, new_editor, wrong_wire, stop, finish, what_broke, edges, error, previews, render, undo, reopen, share, toggle]


def run():
    for step in STEPS:
        begin = time.monotonic()
        try:
            yield from step()
            TOLD["passed"].append(step.__name__)
        except Exception:
            TOLD["failed"].append([step.__name__, traceback.format_exc()])
            shot("failed-" + step.__name__)
            break
        TOLD["times"][step.__name__] = round(time.monotonic() - begin, 1)
        print("sunder.ui", step.__name__, TOLD["times"][step.__name__], flush=True)
    TOLD["handler_errors"] = addon("base.runtime").handler_errors
    with open(os.path.join(FOLDER, "told.json"), "w", encoding="utf-8") as file:
        json.dump(TOLD, file, indent=1)
    os._exit(0)  # quitting would write quit.blend, and an ESC makes its status 1


# Before the window is up: no splash screen, no samples to smooth edges (software rendering).
bpy.context.preferences.view.show_splash = False
bpy.context.preferences.view.smooth_view = 0  # views are where they go to at once
bpy.context.preferences.system.viewport_aa = "OFF"
_steps = run()
bpy.app.timers.register(lambda: next(_steps, None), first_interval=1.5, persistent=True)
