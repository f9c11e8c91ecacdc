"""Reads back what addon_host_export_test.py had Blender's exporters write: by the libraries of the formats' makers.

    PYTHON read_host_exports.py FOLDER

PYTHON is what `tests/hosts/hosts.py prepare readers` prints; the last words are "N passed, M failed".
"""
import sys
import unittest
from pathlib import Path

import numpy as np
from alembic3d import Abc, AbcGeom
from pxr import Usd, UsdGeom, UsdShade

FRAMES, RATE = range(1, 7), 24
SHARE = 1e-5  # of the scene's size: what positions may be off
MATERIALS = ["Paint", "Primer", "Sunder_Interior"]


class Mesh:
    """Of one frame. points (v, 3); corners, velocities: (t, 3, 3), None of what is no triangle mesh; material: name of each
    face's, "" for none; interface (t,) or None."""

    def __init__(self, points, counts, indices, velocities, material, interface=None):
        self.points, self.material, self.interface = points, material, interface
        self.vertices, self.faces = len(points), len(counts)
        is_triangles = len(indices) == 3 * len(counts)
        self.corners = points[indices].reshape(-1, 3, 3) if is_triangles else None
        self.velocities = velocities[indices].reshape(-1, 3, 3) if is_triangles and velocities is not None else None


class UsdFile:
    def __init__(self, path):
        self.stage = Usd.Stage.Open(str(path))
        self.meshes = {p.GetParent().GetName(): UsdGeom.Mesh(p) for p in self.stage.Traverse() if p.IsA(UsdGeom.Mesh)}

    def _material(self, mesh, faces, frame):
        def bound(prim):
            material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
            return material.GetPrim().GetName() if material else ""

        names = np.full(faces, bound(mesh.GetPrim()), object)
        for part in UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets():
            names[np.array(part.GetIndicesAttr().Get(frame), int)] = bound(part.GetPrim())
        return names

    def read(self, name, frame):
        mesh = self.meshes[name]
        matrix = np.array(UsdGeom.XformCache(frame).GetLocalToWorldTransform(mesh.GetPrim()))
        points = np.array(mesh.GetPointsAttr().Get(frame), float).reshape(-1, 3) @ matrix[:3, :3] + matrix[3, :3]
        counts, indices = (np.array(a.Get(frame), int)
                           for a in (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()))
        velocities = mesh.GetVelocitiesAttr().Get(frame)
        interface = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("interface")
        return Mesh(points, counts, indices, None if velocities is None else np.array(velocities, float).reshape(-1, 3),
                    self._material(mesh, len(counts), frame), np.array(interface.Get(frame)) if interface else None)


class AlembicFile:
    """Alembic has y upwards and corners the other way round."""

    def __init__(self, path):
        self.archive = Abc.IArchive(str(path))  # what hangs in it dies with it
        top = self.archive.getTop()
        self.forms, self.meshes = {}, {}
        for i in range(top.getNumChildren()):
            form = top.getChild(i)
            name, mesh = form.getName(), form.getChild(0)
            self.forms[name] = AbcGeom.IXform(top, name).getSchema()
            self.meshes[name] = AbcGeom.IPolyMesh(form, mesh.getName()).getSchema()

    @staticmethod
    def _z_up(rows):
        return rows[:, [0, 2, 1]] * (1, -1, 1)

    def read(self, name, frame):
        at = Abc.ISampleSelector(frame / RATE)
        sample, matrix = self.meshes[name].getValue(at), self.forms[name].getValue(at).getMatrix()
        matrix = np.array([[matrix[r][c] for c in range(4)] for r in range(4)])
        vectors = lambda values: np.array([tuple(v) for v in values], float).reshape(-1, 3)
        points = self._z_up(vectors(sample.getPositions()) @ matrix[:3, :3] + matrix[3, :3])
        counts, indices = (np.array(list(a), int) for a in (sample.getFaceCounts(), sample.getFaceIndices()))
        if len(indices) == 3 * len(counts):
            indices = indices.reshape(-1, 3)[:, ::-1].ravel()
        velocities = sample.getVelocities()
        material = np.full(len(counts), "", object)
        for part in self.meshes[name].getFaceSetNames():
            faces = self.meshes[name].getFaceSet(part).getSchema().getValue(at).getFaces()
            material[np.array(list(faces), int)] = part
        return Mesh(points, counts, indices, self._z_up(vectors(velocities)) if velocities else None, material)


class ReadBack(unittest.TestCase):
    folder = None

    def files(self, *cases):
        """(name, file, what it is to hold) of each format and case."""
        for case in cases:
            wanted = np.load(self.folder / case / "wanted.npz")
            for kind, name in ((UsdFile, "shot.usdc"), (AlembicFile, "shot.abc")):
                yield f"{case}/{name}", kind(self.folder / case / name), {f: {n: wanted[f"{n}{f}"] for n in (
                    "corners", "velocities", "triangles", "material", "interface", "crate")} for f in FRAMES}

    def assert_is(self, found, wanted, size, mine=slice(None)):
        """`mine`: which triangles it is to have."""
        corners, velocities = wanted["corners"][mine], wanted["velocities"][mine]
        self.assertEqual(found.faces, len(corners))
        self.assertEqual(found.vertices, len(np.unique(wanted["triangles"][mine])))  # none that no face has
        if len(corners):
            self.assertLess(np.abs(found.corners - corners).max(), SHARE * size)
            self.assertLess(np.abs(found.velocities - velocities).max(), SHARE * np.abs(velocities).max())

    @staticmethod
    def size(wanted):
        points = np.concatenate([w[n].reshape(-1, 3) for w in wanted.values() for n in ("corners", "crate")])
        return np.ptp(points, axis=0).max()

    def test_meshes_change_as_baked_where_they_are_whole(self):
        for name, file, wanted in self.files("whole", "whole_by_file_menu"):
            with self.subTest(name):
                for frame in FRAMES:
                    self.assert_is(file.read("Block_fractured", frame), wanted[frame], self.size(wanted))

    def test_meshes_change_as_baked_where_break_surfaces_are_apart(self):
        for name, file, wanted in self.files("apart", "apart_by_file_menu"):
            with self.subTest(name):
                for frame in FRAMES:
                    is_inside = wanted[frame]["material"] >= 2
                    for thing, mine in (("Block_fractured", ~is_inside), ("Block_fractured_inside", is_inside)):
                        self.assert_is(file.read(thing, frame), wanted[frame], self.size(wanted), mine)

    def test_rigid_bodies_move(self):
        for name, file, wanted in self.files("apart", "whole", "apart_by_file_menu", "whole_by_file_menu"):
            with self.subTest(name):
                for frame in FRAMES:
                    found = file.read("Crate_moving", frame)
                    self.assertEqual(len(found.points), 8)
                    self.assertLess(np.abs(found.points - wanted[frame]["crate"]).max(), SHARE * self.size(wanted))

    def test_break_surfaces_that_are_apart_keep_their_material(self):
        for name, file, wanted in self.files("apart", "apart_by_file_menu"):
            with self.subTest(name):
                for frame in FRAMES:
                    material = wanted[frame]["material"]
                    outer, inner = (file.read(n, frame).material for n in ("Block_fractured", "Block_fractured_inside"))
                    self.assertEqual(outer.tolist(), [MATERIALS[m] for m in material if m < 2])
                    if isinstance(file, UsdFile):  # in Alembic faces have their material by the object that they are in
                        self.assertEqual(inner.tolist(), [MATERIALS[m] for m in material if m == 2])

    def test_in_whole_meshes_of_usd_the_interface_tells_break_surfaces(self):
        """The attribute is written at every frame, as materials are not."""
        for name, file, wanted in self.files("whole", "whole_by_file_menu"):
            with self.subTest(name):
                if isinstance(file, UsdFile):
                    for frame in FRAMES:
                        found = file.read("Block_fractured", frame)
                        np.testing.assert_array_equal(found.interface, wanted[frame]["interface"])
                        np.testing.assert_array_equal(found.interface >= 0, wanted[frame]["material"] >= 2)

    def test_in_whole_meshes_materials_are_lost_by_the_hosts_own_fault(self):
        """Once Blender writes them at each frame, its users can be told so."""
        for name, file, wanted in self.files("whole"):
            with self.subTest(name):
                found, material = file.read("Block_fractured", 6).material, wanted[6]["material"]
                self.assertEqual(found[material < 2].tolist(), [MATERIALS[m] for m in material if m < 2])
                self.assertNotIn(MATERIALS[2], found[material == 2])


if __name__ == "__main__":
    ReadBack.folder = Path(sys.argv[1])
    result = unittest.main(argv=["test"], exit=False, verbosity=2).result
    failed = len({getattr(t, "test_case", t).id() for t, _ in result.failures + result.errors + result.skipped})
    print(f"{result.testsRun - failed} passed, {failed} failed", flush=True)
    sys.exit(1 if failed or not result.testsRun else 0)
