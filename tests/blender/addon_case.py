"""What tests inside Blender share: an empty file for each, trees built in a line, errors of handlers asserted empty."""
import importlib
import os
import sys
import tempfile
import unittest
from pathlib import Path

import bpy
import numpy as np

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])


def addon(name):
    return importlib.import_module("sunder_addon." + name)


def versions():
    """What differs between versions of Blender."""
    return addon("base.blender_versions")


class AddonCase(unittest.TestCase):
    def setUp(self):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        addon("base.runtime").handler_errors.clear()
        self.scene = bpy.context.scene
        self.scene.frame_start, self.scene.frame_end = 1, 6
        self.folder = Path(tempfile.mkdtemp(dir=FOLDER))

    def tearDown(self):
        self.assertEqual(addon("base.runtime").handler_errors, [])

    def cube(self, size=0.4, location=(0, 0, 0.5), name="Block"):
        bpy.ops.mesh.primitive_cube_add(size=size, location=location)
        bpy.context.object.name = name
        return bpy.context.object

    def node(self, tree, node_type, **parameters):
        node = addon("interface.quick_fracture").add_node(tree, node_type, (0, 0))
        node.set_parameters(**parameters)
        return node

    def connect(self, source, output, target, name):
        return addon("interface.quick_fracture").connect(source.id_data, source, output, target, name)

    def tree(self, thing=None, pieces=8, fall_speed=6, material=None):
        """A block that tumbles on a floor and breaks; nodes by their type."""
        thing = thing or self.cube()
        tree = addon("interface.quick_fracture").build(thing, "CLAY", pieces, fall_speed=fall_speed)
        tree.preset = ""  # as one that was built by hand
        nodes = {n.sunder_type: n for n in tree.nodes}
        nodes["solver"].set_parameters(substeps=4, hit_substeps=1, crack_passes=1)  # pieces come off frame by frame
        nodes["body"].set_parameters(angular_velocity=(400, 250, 0), **(material or {"toughness": 0.01}))
        return tree, nodes

    def results(self, tree):
        return addon("results.results").add_missing(tree, self.scene)

    def bake(self, tree, **options):
        return bpy.ops.sunder.bake(tree=tree.name, **options)

    def refusal(self, tree):
        """What a bake is refused with."""
        with self.assertRaises(RuntimeError) as caught:
            self.bake(tree)
        return str(caught.exception)

    def status(self, tree):
        return addon("bake.bake_status").status(tree, self.scene)

    def cached(self, tree):
        return Path(addon("bake.cache").folder(tree))

    def manifest(self, tree):
        return addon("bake.cache").manifest(str(self.cached(tree)))

    def save(self, name="shot.blend"):
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / name))

    def reopen(self, name="shot.blend"):
        bpy.ops.wm.open_mainfile(filepath=str(self.folder / name))
        self.scene = bpy.context.scene


class ObjectCase(AddonCase):
    def compiled(self, tree):
        return addon("bake.compiler").compile_tree(tree, self.scene)

    def graph(self, tree):
        """The tree as the library has it, meshes written where it looks for them."""
        compiled = self.compiled(tree)
        addon("scene.mesh_export").write(str(self.folder), compiled.files)
        return addon("base.core").sunder().Graph.from_dict(compiled.description, base_folder=str(self.folder))

    def placed(self, tree):
        """Corners of all triangles of the first frame in the scene (t, 3, 3)."""
        mesh = self.graph(tree).evaluate("deformer.mesh")
        return mesh.positions[mesh.triangles].astype(float)

    def wired_collider(self, **parameters):
        """A tree with one collider that a test sets up."""
        tree, nodes = self.tree()
        for name, value in parameters.items():
            setattr(nodes["collider"], name, value)
        return tree


def positions(thing):
    array = np.empty(3 * len(thing.data.vertices), np.float32)
    thing.data.vertices.foreach_get("co", array)
    return array.reshape(-1, 3)


def attribute(thing, name):
    layer = thing.data.attributes[name]
    kind, width = {"INT": (np.int32, 1), "FLOAT": (np.float32, 1), "BOOLEAN": (bool, 1),
                   "FLOAT_VECTOR": (np.float32, 3)}[layer.data_type]
    array = np.empty(width * len(layer.data), kind)
    layer.data.foreach_get("vector" if width == 3 else "value", array)
    return array.reshape(-1, 3) if width == 3 else array


def main():
    result = unittest.main(module="__main__", argv=["test"], exit=False, verbosity=2).result
    sys.stdout.flush(), sys.stderr.flush()
    failures = result.failures + result.errors + result.skipped  # parts of a test that failed are one failure
    failed = len({getattr(t, "test_case", t).id() for t, _ in failures}) + len(result.unexpectedSuccesses)
    print(f"{result.testsRun - failed} passed, {failed} failed", flush=True)
    os._exit(1 if failed else 0)  # quitting would only write quit.blend
