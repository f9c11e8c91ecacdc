"""What the Blender scripts read of a bake is what is in the files, and a bad file is named and refused."""
import json
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

import small_bake

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugin_src/blender"))
from bake_reader import Bake, BakeError, read_ply  # noqa: E402


class BakeReader(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = small_bake.write(Path(folder.name) / "a bake")
        self.mesh = self.folder / "mesh/cube.0002.ply"

    def test_reads_every_array_as_it_was_written(self):
        bake = Bake(str(self.folder))
        self.assertEqual(bake.frames, [1, 2])
        positions, triangles, normals, material, fragment = bake.mesh_frame(bake.meshes[0], 2)
        np.testing.assert_array_equal(positions.min(0), [-1, -0.5, 0])
        np.testing.assert_array_equal(positions.max(0), [1, 0.5, 1])
        self.assertEqual([len(triangles), material.tolist().count(1), set(fragment)], [24, 4, {0, 1}])
        a, b, c = (positions[triangles[:, k]] for k in range(3))
        facing = np.einsum("ij,ij->i", np.cross(b - a, c - a), normals.reshape(-1, 3, 3)[:, 0])
        self.assertTrue(np.all(facing > 0))
        # Divergence theorem: two half-cubes hold 1 m3, so no triangle is missing, doubled or turned.
        self.assertAlmostEqual(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6), 1.0, places=6)
        self.assertEqual(bake.interior_material(bake.meshes[0]), 1)
        where, turned = bake.rigid_body_poses(1)
        self.assertEqual([where.tolist(), turned.tolist()], [[[1.5, 0, 0.4]], [[1, 0, 0, 0]]])

    def test_refuses_a_mesh_frame_cut_short_anywhere(self):
        whole = self.mesh.read_bytes()
        for length in (*range(0, len(whole), 7), len(whole) - 1):
            self.mesh.write_bytes(whole[:length])
            with self.assertRaisesRegex(BakeError, "cube.0002.ply: ", msg=f"{length} bytes"):
                read_ply(str(self.mesh))

    def test_refuses_bytes_left_over(self):
        self.mesh.write_bytes(self.mesh.read_bytes() + b"x")
        with self.assertRaisesRegex(BakeError, "1 bytes too many"):
            read_ply(str(self.mesh))

    def test_refuses_an_index_that_would_crash_blender(self):
        data = bytearray(self.mesh.read_bytes())
        data[-small_bake.FACE.itemsize + 1:-small_bake.FACE.itemsize + 5] = np.int32(16).tobytes()
        self.mesh.write_bytes(data)
        bake = Bake(str(self.folder))
        with self.assertRaisesRegex(BakeError, "cube.0002.ply: a triangle names a vertex that is not there"):
            bake.mesh_frame(bake.meshes[0], 2)

    def test_refuses_lists_of_different_lengths(self):
        data = bytearray(self.mesh.read_bytes())
        data[-small_bake.FACE.itemsize] = 4
        self.mesh.write_bytes(data)
        with self.assertRaisesRegex(BakeError, "lists of different lengths in face"):
            read_ply(str(self.mesh))

    def test_refuses_a_foreign_file(self):
        for text in (b"", b"solid cube\n", b"ply\nformat ascii 1.0\nend_header\n"):
            self.mesh.write_bytes(text)
            with self.assertRaisesRegex(BakeError, "not a binary little-endian PLY file"):
                read_ply(str(self.mesh))

    def test_refuses_a_header_that_is_not_understood(self):
        for line in (b"element face many", b"property quad x", b"property float", b"element"):
            self.mesh.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement a 1\n" + line + b"\nend_header\n")
            with self.assertRaisesRegex(BakeError, "its header is not understood", msg=line):
                read_ply(str(self.mesh))

    def test_refuses_a_folder_that_is_no_bake(self):
        (self.folder / "manifest.json").write_text("{}")
        with self.assertRaisesRegex(BakeError, "manifest.json: not a manifest"):
            Bake(str(self.folder))
        (self.folder / "manifest.json").unlink()
        with self.assertRaisesRegex(BakeError, "manifest.json: No such file"):
            Bake(str(self.folder))

    def test_refuses_a_bake_without_frames(self):
        manifest = self.folder / "manifest.json"
        manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "frames": []}))
        with self.assertRaisesRegex(BakeError, "has no whole mesh frame"):
            Bake(str(self.folder))

    def test_names_a_frame_whose_file_is_gone(self):
        (self.folder / "state/sim.0002.ply").unlink()
        with self.assertRaisesRegex(BakeError, "sim.0002.ply: No such file"):
            Bake(str(self.folder)).rigid_body_poses(2)


if __name__ == "__main__":
    unittest.main()
