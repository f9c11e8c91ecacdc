"""The preview: the graphics card skins as the library does, colours say what they claim, meshes follow in good time."""
import traceback

import bpy
import gpu
import numpy as np
from mathutils import Matrix, Vector

from addon_case import AddonCase, addon, main, positions

WIDTH, HEIGHT = 160, 120


class OnCard(bpy.types.RenderEngine):
    """Background mode has a graphics context only while an engine that asks for one renders."""

    bl_idname, bl_label, bl_use_gpu_context = "SUNDER_TEST", "Sunder's tests", True
    work = staticmethod(lambda: None)
    result = error = None

    def render(self, _depsgraph):
        try:
            OnCard.result, OnCard.error = OnCard.work(), None
        except Exception:
            OnCard.error = traceback.format_exc()


bpy.utils.register_class(OnCard)


class PreviewCase(AddonCase):
    def setUp(self):
        super().setUp()
        addon("preview.preview").forget()
        self.shot, self.nodes = self.tree(self.thing(), pieces=20, material={"toughness": 0.009, "fracture_energy": None})  # some edges hold
        self.result, = self.results(self.shot)
        self.bake(self.shot)
        self.scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        self.scene.collection.objects.link(self.scene.camera)
        self.scene.render.resolution_x = self.scene.render.resolution_y = 16

    def thing(self):
        return self.cube(location=(30, -20, 0.5))  # far out: rounding shows there

    def on_card(self, work):
        OnCard.work = staticmethod(work)
        engine, self.scene.render.engine = self.scene.render.engine, "SUNDER_TEST"
        bpy.ops.render.render()
        self.scene.render.engine = engine
        self.assertIsNone(OnCard.error, OnCard.error)
        return OnCard.result

    def source(self):
        folder = str(self.cached(self.shot))
        source = addon("preview.preview_source").Source(folder, self.manifest(self.shot).graph, "deformer")
        source.start(), source.wait()
        self.assertEqual(source.error, "")
        return source

    def frame(self, source, number, mode="PIECES", limit=0.0):
        return source.frame(str(self.cached(self.shot) / f"state/solver.{number:04d}.ply"), mode, limit)

    def baked(self, number):
        return addon("base.bake_reader").read_mesh_frame(str(self.cached(self.shot) / f"mesh/deformer.{number:04d}.ply"))


class Skinning(PreviewCase):
    def test_the_card_puts_every_vertex_where_the_library_does(self):
        source, shader, data = self.source(), addon("preview.preview_shader"), addon("preview.preview_source")
        frames = {n: self.frame(source, n) for n in (1, 3, 6, 2)}  # backwards, too: edges hold again

        def work():
            listing = shader.listing_shader()
            found = {}
            for n, f in frames.items():
                skin, particles = shader.Skin(f.surface), shader.texture(f.particles, "RGBA32F")
                found[n] = shader.listed_positions(listing, skin, len(f.surface.rest), particles)
            return found

        counts = set()
        for n, found in self.on_card(work).items():
            wanted = self.baked(n).positions
            self.assertEqual(found.shape, wanted.shape)
            counts.add(len(wanted))
            # The file's single precision 36 m from the origin is coarser than the card's near the body's centre.
            np.testing.assert_allclose(found + frames[n].center, wanted, rtol=0, atol=1e-5)
            np.testing.assert_allclose(found, data.skinned(frames[n].surface, frames[n].particles), rtol=0, atol=1e-6)
        self.assertGreater(len(counts), 1)  # it tore

    def test_what_rests_is_sent_again_only_when_edges_broke(self):
        source = self.source()
        broke = {n: addon("base.bake_reader").read_ply(str(self.cached(self.shot) / f"state/solver.{n:04d}.ply"))
                 for n in range(1, 7)}
        self.assertTrue(any(len(state["broken_edge"]) for state in broke.values()))
        before = self.frame(source, 1).surface
        for n in range(2, 7):
            now = self.frame(source, n).surface
            self.assertIs(now is before, len(broke[n]["broken_edge"]) == 0, n)
            before = now

    def test_edges_follow_their_particles_and_broken_ones_end_in_their_middle(self):
        source, data = self.source(), addon("preview.preview_source")
        f = self.frame(source, 6, "EDGES")
        state = addon("base.bake_reader").read_ply(str(self.cached(self.shot) / "state/solver.0006.ply"))
        particle, edge = state["particle"], state["edge"]
        center = np.stack([particle[n] for n in "xyz"], 1)
        ends = data.skinned(f.edges, f.particles)[f.edges.lines] + f.center
        n_whole, n_torn = int(edge["intact"].sum()), int((edge["intact"] == 0).sum())
        self.assertEqual(len(ends), n_whole + 2 * n_torn)
        self.assertTrue(n_whole > 0 and n_torn > 0)
        whole = edge[edge["intact"] == 1]
        np.testing.assert_allclose(ends[:n_whole], np.stack([center[whole["a"]], center[whole["b"]]], 1), atol=1e-5)
        torn = edge[edge["intact"] == 0]
        np.testing.assert_allclose(ends[n_whole:n_whole + n_torn, 0], center[torn["a"]], atol=1e-5)
        shades = f.particles[f.edges.follows[f.edges.lines[:, 0], 2], 3, :3]
        np.testing.assert_allclose(shades[:n_whole], np.tile(data.INTACT_COLOR, (n_whole, 1)), rtol=1e-6)
        now = np.isin(np.flatnonzero(edge["intact"] == 0), state["broken_edge"]["edge"])
        wanted = np.where(now[:, None], data.BREAKING_COLOR, data.BROKEN_COLOR)
        np.testing.assert_allclose(shades[n_whole:], np.tile(wanted, (2, 1)), rtol=1e-6)

    def test_ellipsoids_are_the_particles(self):
        source, data = self.source(), addon("preview.preview_source")
        f = self.frame(source, 4, "SIMULATION")
        n = len(f.particles)
        balls = data.spheres(n)
        corners = data.skinned(balls, f.ellipsoids).reshape(n, -1, 3)
        state = addon("base.core").sunder().read_state(str(self.cached(self.shot) / "state/solver.0004.ply"))
        k = len(state.position)
        np.testing.assert_allclose(corners[:k].mean(1) + f.center, state.position, atol=1e-5)


class SkinningOfSheets(PreviewCase):
    def thing(self):
        plate = self.cube(location=(30, -20, 0.5))
        plate.scale = (2, 1, 0.05)
        bpy.ops.object.transform_apply(location=False)
        return plate

    def test_the_card_turns_what_bends_as_the_library_does(self):
        source, shader, data = self.source(), addon("preview.preview_shader"), addon("preview.preview_source")
        frames = {n: self.frame(source, n) for n in (1, 3, 6)}

        def work():
            listing = shader.listing_shader()
            return {n: shader.listed_positions(listing, shader.Skin(f.surface), len(f.surface.rest),
                                               shader.texture(f.particles, "RGBA32F")) for n, f in frames.items()}

        for n, found in self.on_card(work).items():
            self.assertGreater(np.abs(frames[n].particles[:, 4:7]).max(), 0)
            np.testing.assert_allclose(found + frames[n].center, self.baked(n).positions, rtol=0, atol=1e-5)
            np.testing.assert_allclose(found, data.skinned(frames[n].surface, frames[n].particles), rtol=0, atol=1e-6)
        turns = frames[6].particles[:-3, 7]  # the last three are colours of edges
        self.assertLess(np.abs(turns @ turns[0]).min(), 0.999)  # it bent, or this guards little


class SkinningOfWhatFollows(PreviewCase):
    """A bar that its shape key bends within its fragments, half of which an activate node lets go at frame 4."""

    def thing(self):
        bar = self.cube(location=(30, -20, 0.5))
        bar.scale = (2, 0.4, 0.4)
        bpy.ops.object.transform_apply(location=False)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.subdivide(number_cuts=7)
        bpy.ops.object.mode_set(mode="OBJECT")
        bar.shape_key_add(name="Basis")
        bent = bar.shape_key_add(name="Bent")
        for point in bent.data:
            point.co.z += 0.4 * point.co.x ** 2
        for frame, value in ((1, 0), (6, 1)):
            bent.value = value
            bent.keyframe_insert("value", frame=frame)
        return bar

    def tree(self, thing=None, **options):
        tree, nodes = super().tree(thing, **options)
        follow = self.node(tree, "follow", motion="vertices")
        wait = self.node(tree, "activate", region="box", box_min=(30, -30, -9), box_max=(40, 0, 9), until="frame", frame=4)
        for link in [link for link in tree.links if link.from_node == nodes["body"]]:
            tree.links.remove(link)
        self.connect(nodes["body"], "body", follow, "body")
        self.connect(follow, "body", wait, "body")
        for name, socket in (("solver", "bodies"), ("deformer", "body")):
            self.connect(wait, "body", nodes[name], socket)
        return tree, nodes

    def test_it_is_drawn_as_the_artist_has_it_and_as_it_goes_on(self):
        source, shader, data = self.source(), addon("preview.preview_shader"), addon("preview.preview_source")
        frames = {n: self.frame(source, n) for n in (1, 3, 2, 6)}
        kept = addon("base.core").sunder().read_state(str(self.cached(self.shot) / "state/solver.0006.ply")).kept
        self.assertEqual(set(kept), {0, 1})  # the one half was let go

        def work():
            listing = shader.listing_shader()
            return {n: shader.listed_positions(listing, shader.Skin(f.surface), len(f.surface.rest),
                                               shader.texture(f.particles, "RGBA32F")) for n, f in frames.items()}

        for n, found in self.on_card(work).items():
            np.testing.assert_allclose(found + frames[n].center, self.baked(n).positions, rtol=0, atol=1e-5)
        plain = data.skinned(source._surface, frames[6].particles) + frames[6].center
        self.assertGreater(np.abs(plain - self.baked(6).positions).max(), 1e-3)  # what the skin alone would leave out


class Colors(PreviewCase):
    def test_strain_and_toughness_left_are_shares_of_the_toughness(self):
        data = addon("preview.preview_source")
        strain, piece = np.array([0.0, 0.05, 0.1, 0.4]), np.zeros(4, int)
        ones = np.ones(4)
        shown = data._colors("STRAIN", piece, strain, 0.1, ones)
        np.testing.assert_array_equal(shown, data.heat(np.array([0, 0.5, 1, 1])))
        left = data._colors("TOUGHNESS", piece, strain, 0.1, 0.1 * ones)
        np.testing.assert_array_equal(left, data.traffic_light(np.array([1, 0.5, 0, 0])))
        self.assertTrue(left[0, 1] > 2 * left[0, 0] and left[3, 0] > 2 * left[3, 1])  # green, red
        weak = data._colors("TOUGHNESS", piece, strain, 0.1, np.array([0.1, 0.1, 0.4, 0.2]))
        np.testing.assert_array_equal(weak, data.traffic_light(np.array([1, 0.5, 0.75, 0])))
        np.testing.assert_array_equal(data._colors("TOUGHNESS", piece, strain, None, np.inf * ones), data.traffic_light(ones))

    def test_the_limit_is_the_toughness_at_the_frame_unless_told(self):
        body = self.nodes["body"]
        for frame, value in ((1, 0.5), (4, 0.2)):
            body.toughness = value
            body.keyframe_insert("toughness", frame=frame)
        addon("base.runtime").signatures.clear()
        self.bake(self.shot)
        source = self.source()
        self.assertAlmostEqual(self.frame(source, 4, "STRAIN").limit, 0.2, places=6)
        self.assertAlmostEqual(self.frame(source, 4, "STRAIN", 0.07).limit, 0.07, places=6)

    def test_pieces_keep_their_colour_when_others_come_off(self):
        data = addon("preview.preview_source")
        before = data.piece_colors(np.array([0, 0, 0, 0, 1]))
        after = data.piece_colors(np.array([0, 0, 1, 1, 2]))  # 2 and 3 came off; numbers of the others moved
        np.testing.assert_array_equal(after[[0, 1, 4]], before[[0, 1, 4]])
        self.assertGreater(np.abs(after[2] - before[2]).max(), 0.1)


class Drawn(PreviewCase):
    def picture(self, mode, frame):
        """The preview on a black ground, (h, w, 3)."""
        self.scene.frame_set(frame)
        preview = addon("preview.preview")
        self.result.sunder.preview = mode
        view = Matrix.Translation((0, 0, -1.6)) @ Matrix.Rotation(-1.1, 4, "X") @ Matrix.Translation((-30, 20, -0.2))
        lens = 4.0
        screen = Matrix([[lens * HEIGHT / WIDTH, 0, 0, 0], [0, lens, 0, 0], [0, 0, -1.002, -0.2], [0, 0, -1, 0]]) @ view

        def work():
            drawn = preview.update(self.result, self.scene)
            for _ in range(200):
                if drawn is not None:
                    break
                next(iter(preview._sources.values())).wait()
                drawn = preview.update(self.result, self.scene)
            target = gpu.types.GPUOffScreen(WIDTH, HEIGHT)
            with target.bind():
                buffer = gpu.state.active_framebuffer_get()
                buffer.clear(color=(0, 0, 0, 1), depth=1.0)
                preview.draw_object(self.result, drawn, screen, Vector((0.2, -0.5, 0.8)))
                gpu.state.blend_set("NONE"), gpu.state.depth_mask_set(True), gpu.state.depth_test_set("NONE")
                pixels = buffer.read_color(0, 0, WIDTH, HEIGHT, 4, 0, "FLOAT")
            target.free()
            pixels.dimensions = WIDTH * HEIGHT * 4
            return np.array(pixels, np.float32).reshape(HEIGHT, WIDTH, 4)[..., :3]

        return self.on_card(work)

    @staticmethod
    def hues(picture):
        """How many sixths of the colour circle more than ten pixels have."""
        lit = picture[picture.max(-1) > 0.1]
        most, least = lit.max(1), lit.min(1)
        rgb = (lit - least[:, None]) / np.maximum(most - least, 1e-6)[:, None]
        code = np.round(rgb).astype(int) @ [4, 2, 1]
        return int((np.bincount(code[most - least > 0.05], minlength=8) > 10).sum())

    def test_every_mode_draws_and_tells_the_tear(self):
        whole, torn = self.picture("PIECES", 1), self.picture("PIECES", 6)
        self.assertGreater((whole.max(-1) > 0.1).sum(), 500)
        self.assertEqual(self.hues(whole), 1)
        self.assertGreater(self.hues(torn), 1)
        np.testing.assert_array_equal(self.picture("PIECES", 6), torn)
        at_rest, loaded = self.picture("STRAIN", 1), np.concatenate([self.picture("STRAIN", n) for n in range(2, 6)])
        cold = addon("preview.preview_source").heat(np.zeros(1))[0]
        lit = at_rest[at_rest.max(-1) > 0.05]
        np.testing.assert_allclose(lit / lit.max(1, keepdims=True), np.tile(cold / cold.max(), (len(lit), 1)), atol=0.02)
        self.assertGreater((loaded[..., 0] > loaded[..., 2] + 0.2).sum(), 20)  # hot somewhere
        red = (lambda p: int(((p[..., 0] > 0.4) & (p[..., 1] < 0.25)).sum()))
        self.assertEqual(red(self.picture("EDGES", 1)), 0)
        self.assertGreater(red(self.picture("EDGES", 6)), 20)
        self.assertGreater((self.picture("SIMULATION", 6).max(-1) > 0.1).sum(), 300)
        self.assertEqual(addon("preview.preview").problems, {})

    def test_an_object_that_was_moved_is_drawn_where_it_stands(self):
        there = self.picture("PIECES", 1).max(-1) > 0.1
        self.result.location.x = 0.15
        bpy.context.view_layer.update()
        moved = self.picture("PIECES", 1).max(-1) > 0.1
        shift = np.argwhere(moved)[:, 1].mean() - np.argwhere(there)[:, 1].mean()
        self.assertTrue(20 < shift < 80, shift)


class Meshes(PreviewCase):
    def test_previewed_meshes_wait_but_not_for_renders(self):
        handlers, player = addon("interface.handlers"), addon("results.player")
        self.scene.frame_set(2)
        self.assertEqual(self.result.display_type, "TEXTURED")
        self.result.sunder.preview = "STRAIN"
        self.assertEqual(self.result.display_type, "BOUNDS")
        there = positions(self.result)
        self.scene.frame_current = 5  # as a frame change in the window does it: no mesh is written
        self.assertTrue(player.show_all(self.scene, skip_previewed=True))
        np.testing.assert_array_equal(positions(self.result), there)
        handlers._late["frame"] = 5
        handlers._catch_up(self.scene)
        np.testing.assert_array_equal(positions(self.result), there)
        handlers._catch_up(self.scene)  # it rested
        np.testing.assert_array_equal(positions(self.result), self.baked(5).positions)
        self.scene.frame_set(3)  # scripts and renders have the mesh at once
        np.testing.assert_array_equal(positions(self.result), self.baked(3).positions)
        self.result.sunder.preview = "OFF"
        self.assertEqual(self.result.display_type, "TEXTURED")

    def test_a_file_that_is_opened_again_shows_what_was_cut_before(self):
        self.save()
        kept, = (self.cached(self.shot) / "cuts").iterdir()
        stamp = kept.stat()
        before = self.frame(self.source(), 4)
        self.reopen()
        addon("preview.preview").forget()
        self.shot, = addon("tree.trees").trees()
        after = self.frame(self.source(), 4)
        for a, b in ((before.particles, after.particles), (before.surface.rest, after.surface.rest),
                     (before.surface.influences, after.surface.influences), (before.surface.inner, after.surface.inner)):
            np.testing.assert_array_equal(a, b)
        again = kept.stat()
        self.assertEqual((again.st_ino, again.st_mtime_ns), (stamp.st_ino, stamp.st_mtime_ns))  # read, not made
        kept.unlink()
        np.testing.assert_array_equal(self.frame(self.source(), 4).surface.rest, before.surface.rest)
        self.assertEqual([p.name for p in kept.parent.iterdir()], [kept.name])  # made anew, the same
        folder = self.cached(self.shot)
        bpy.ops.sunder.free_bake(tree=self.shot.name)
        self.assertFalse(folder.exists())

    def test_without_a_bake_the_preview_says_so(self):
        bpy.ops.sunder.free_bake(tree=self.shot.name)
        self.result.sunder.preview = "PIECES"
        self.assertIsNone(addon("preview.preview").update(self.result, self.scene))
        self.assertEqual(addon("preview.preview").problems[self.result.name], "nothing baked yet: the preview shows what Bake makes")

    def test_two_shots_are_cut_once_each_and_anew_when_baked_otherwise(self):
        other, nodes = self.tree(self.cube(location=(3, 0, 0.5), name="Other"))
        self.bake(other)
        preview = addon("preview.preview")

        def source(tree):
            known = preview._source(str(self.cached(tree)), self.manifest(tree), "deformer")
            preview._sources[str(self.cached(tree)), "deformer"].wait()
            return known or preview._source(str(self.cached(tree)), self.manifest(tree), "deformer")

        first, second = source(self.shot), source(other)
        self.assertIsNot(first, second)
        self.scene.frame_end = 7  # a longer shot is the same one
        self.bake(other)
        self.assertEqual([source(self.shot) is first, source(other) is second], [True, True])
        nodes["prefracture"].pieces = 5
        self.bake(other)
        self.assertEqual([source(self.shot) is first, source(other) is second], [True, False])

    def test_after_a_bake_its_own_cut_is_shown(self):
        self.result.sunder.preview = "STRAIN"
        bpy.ops.sunder.bake(tree=self.shot.name, start="RESTART")
        preview, source_of = addon("preview.preview"), addon("preview.preview_source").Source
        folder, manifest = str(self.cached(self.shot)), self.manifest(self.shot)
        graph = preview._at_hand[folder]
        source, fresh = source_of(folder, manifest.graph, "deformer", graph), source_of(folder, manifest.graph, "deformer")
        self.assertTrue(source._graph is graph and fresh._graph is not graph)
        for number in (2, 4, 3):
            path, _ = addon("results.player").state_file(folder, manifest, number, "deformer")
            one, other = (s.frame(path, "STRAIN") for s in (source, fresh))
            np.testing.assert_array_equal(one.particles, other.particles)
            np.testing.assert_array_equal(one.surface.rest, other.surface.rest)
            np.testing.assert_array_equal(one.surface.influences, other.surface.influences)
        self.result.sunder.preview = "OFF"
        bpy.ops.sunder.bake(tree=self.shot.name, start="RESTART")
        self.assertEqual(preview._at_hand, {})  # nobody would look

    def test_an_object_that_plays_no_deformer_of_the_bake_says_so(self):
        self.result.sunder.preview, self.result.sunder.node = "PIECES", "deformer_7"
        self.assertIsNone(addon("preview.preview")._updated(self.result))
        self.assertIn("nothing of node 'deformer_7'", addon("preview.preview").problems[self.result.name])


if __name__ == "__main__":
    main()
