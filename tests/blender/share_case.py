"""A baked shot, what one click makes of it, and what a Blender without the add-on has of that."""
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np

from addon_case import AddonCase, addon

HERE = Path(__file__).resolve().parent
FRAMES = (6, 2, 5, 1, 3, 4)
SHARE = 1e-5  # of the shot's size: what positions may be off
BYTE = 1.5 / 255  # what colours may be off that travel as bytes


class ShareCase(AddonCase):
    """a.blend: a block of two materials, with colours and two UV maps, that breaks, and a box that falls and turns."""

    def setUp(self):
        super().setUp()
        self.save("a.blend")
        block = self.cube()
        for name in ("Paint", "Primer"):
            block.data.materials.append(bpy.data.materials.new(name))
        block.data.polygons[0].material_index = 1
        block.data.uv_layers.new(name="Second")
        paint = block.data.color_attributes.new("paint", "FLOAT_COLOR", "CORNER")
        paint.data.foreach_set("color", np.linspace(0, 1, 4 * len(paint.data)).astype(np.float32))
        self.reads(bpy.data.materials["Paint"], "toughness_left")
        self.block_tree, nodes = self.tree(block)
        crate = self.cube(size=0.3, location=(1, 0, 1), name="Crate")
        crate.scale, crate.rotation_euler = (1, 2, 0.5), (0.3, 0.2, 0.1)
        bpy.context.view_layer.update()
        node = self.node(self.block_tree, "rigid_body", shape="box", mass=5, velocity=(0.5, 0, -1),
                         angular_velocity=(100, 300, 50))
        node.source, node.object = "OBJECT", crate
        self.connect(node, "rigid_body", nodes["solver"], "rigid_bodies")
        self.scene.render.fps = 24
        self.results(self.block_tree)
        self.bake(self.block_tree)
        self.scene.frame_set(1)
        self.save("a.blend")
        self.wanted = {frame: self.shown(frame) for frame in FRAMES}
        self.scene.frame_set(1)
        everything = np.concatenate([shown["points"] for shown in self.wanted.values()])
        self.size = np.ptp(everything, axis=0).max()
        self.assertGreater(np.abs(self.wanted[6]["crate"] - self.wanted[1]["crate"]).max(), 0.2)
        self.assertGreater(len(self.wanted[6]["triangles"]), len(self.wanted[1]["triangles"]))

    @staticmethod
    def reads(material, name):
        addon("base.blender_versions").turn_on_nodes(material)
        nodes = material.node_tree.nodes
        node = nodes.new("ShaderNodeAttribute")
        node.attribute_name = name
        material.node_tree.links.new(node.outputs["Fac"], nodes["Principled BSDF"].inputs["Roughness"])

    def shown(self, frame):
        """What the bake holds at a frame; colours and normals as the result object has them."""
        mesh = addon("base.bake_reader").read_mesh_frame(
            str(self.cached(self.block_tree) / f"mesh/deformer.{frame:04d}.ply"))
        self.scene.frame_set(frame)
        result, crate = bpy.data.objects["Block fractured"].data, bpy.data.objects["Crate moving"]
        corners = {}
        for name in ("paint", "toughness_left"):
            values = [tuple(v.color) if name == "paint" else v.value for v in result.attributes[name].data]
            corners[name] = np.array(values, np.float32)
        corners["toughness_left"] = corners["toughness_left"][mesh.triangles.ravel()]
        for layer in result.uv_layers:
            corners[f"uv {layer.name}"] = np.array([v.uv for v in layer.data])
        rest = np.array([(*v.co, 1) for v in crate.data.vertices])
        names = np.array(["Paint", "Primer", "Sunder Interior"])
        return {"points": mesh.positions, "triangles": mesh.triangles, "velocity": mesh.velocities,
                "material": names[mesh.material], "normal": addon("base.blender_versions").corner_normals(result),
                "crate": (rest @ np.array(crate.matrix_world).T)[:, :3], **corners}

    def click(self, **options):
        return bpy.ops.sunder.make_shareable(tree=self.block_tree.name, **options)

    def shared(self, kind="AUTO"):
        """(Path, notes) of a click."""
        steps = addon("exports.share").share(self.block_tree, self.scene, addon("tree.trees").result_objects(self.block_tree), kind)
        while True:
            try:
                next(steps)
            except StopIteration as end:
                return end.value

    def has_alembic(self):
        return "ABC" in addon("exports.export").host_formats()

    def paths(self):
        return [self.folder / f"a-Block_Fracture_shared.{ending}" for ending in ("abc", "blend")]

    def elsewhere(self, how, path=None, frames=FRAMES):
        """What a Blender without Sunder has of a file: {frame: {object: {field: array}}}."""
        profile, out = self.folder / "profile", self.folder / "read.npz"
        words = [bpy.app.binary_path] if bpy.app.binary_path else [sys.executable, HERE.parent / "hosts/blender_module.py"]
        names = {n: v for n, v in os.environ.items() if n not in ("BLENDER_USER_SCRIPTS", "SUNDER_ADDON_ROOT")}
        done = subprocess.run(
            [*words, "-b", "--factory-startup", "--python-exit-code", "9", "--python", HERE / "read_shared.py", "--", how,
             path or self.paths()[1], out, *map(str, frames)], env={**names, "BLENDER_USER_RESOURCES": str(profile)},
            text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=120)
        self.assertIn("READ", done.stdout, done.stdout)
        found = {frame: {} for frame in frames}
        with np.load(out) as file:
            for key in file:
                if key == "range":
                    self.range = file[key].tolist()
                    continue
                name, frame, field = key.split("/")
                found[int(frame)].setdefault(name, {})[field] = file[key]
        return found


class PlayCase(ShareCase):
    """A part of a frame that is shown is what was baked."""

    def assert_is(self, found, wanted, mine, place, byte):
        """`mine`: which triangles it is to have. Corners of a face may begin anywhere."""
        corners = found["points"][found["triangles"]]
        if not mine.any() and len(corners):  # a triangle without extent, for the exporter's sake
            self.assertEqual((len(corners), np.ptp(corners, 1).max()), (1, 0))
            return
        self.assertEqual(len(corners), mine.sum())
        if not len(corners):
            return
        there = wanted["points"][wanted["triangles"][mine]] + place
        turns = [np.abs(np.roll(corners, turn, 1) - there).max((1, 2)) for turn in range(3)]
        turn = np.argmin(turns, 0)
        self.assertLess(np.min(turns, 0).max(), SHARE * self.size)
        self.assertEqual(len(found["points"]), len(np.unique(wanted["triangles"][mine])))

        def same(values, target, tolerance):
            values = values.reshape(len(corners), 3, -1)
            values = np.stack([np.roll(values[i], turn[i], 0) for i in range(len(values))])
            target = target.reshape(len(wanted["triangles"]), 3, -1)[mine]
            self.assertLess(np.abs(values - target).max(), tolerance)

        self.assertEqual(found["material"].tolist(), wanted["material"][mine].tolist())
        same(found["velocity"][found["triangles"]], wanted["velocity"][wanted["triangles"]],
             SHARE * np.abs(wanted["velocity"]).max())
        for name in ("uv UVMap", "uv Second"):
            same(found[name], wanted[name], 1e-6)
        same(found["normal"], wanted["normal"], 2e-3)  # Blender keeps directions in two times 16 bits
        same(found["paint"], wanted["paint"], byte)
        same(found["toughness_left"][:, :3], wanted["toughness_left"][:, None], byte)

    def plays(self, found, place=(0, 0, 0)):
        for frame in FRAMES:
            wanted, shown = self.wanted[frame], found[frame]
            is_inside = wanted["material"] == "Sunder Interior"
            names = set(shown) - {"Crate moving shared"}
            with self.subTest(frame=frame):
                if "Block fractured shared" in names:  # of a cache
                    self.assertEqual(names - {"Block fractured shared inside"}, {"Block fractured shared"})
                    self.assert_is(shown["Block fractured shared"], wanted, ~is_inside, place, BYTE)
                    inside = shown.get("Block fractured shared inside")
                    if inside is None:  # an instance of nothing
                        self.assertFalse(is_inside.any())
                    else:
                        self.assert_is(inside, wanted, is_inside, place, BYTE)
                else:
                    self.assertEqual(names, {f"Block fractured shared {frame:04d}"})
                    self.assert_is(*[shown[n] for n in names], wanted, np.full(len(is_inside), True), place, 1e-6)
                crate = shown["Crate moving shared"]["points"] - place
                self.assertLess(np.abs(crate - wanted["crate"]).max(), SHARE * self.size)

    def everywhere(self):
        for how in ("open", "link", "append", "instance"):
            with self.subTest(how):
                self.plays(self.elsewhere(how), (3, 1, 2) if how == "instance" else (0, 0, 0))
                if how == "open":
                    self.assertEqual(self.range, [1, 6, 24])
