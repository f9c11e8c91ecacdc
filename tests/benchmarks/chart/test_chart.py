"""The short chart: the csv is whole, what it claims holds loosely, and it can be drawn."""
import csv
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
CASES = {"held_twist": {40, 320}, "release_period": {320}, "residual_twist": {40, 320}, "tear_time": {320}}
METHODS = {"projective", "jacobi", "gauss_seidel", "plain", "plain_corrected"}


class Chart(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.csv = Path(cls.folder.name) / "chart.csv"
        subprocess.run([os.environ["SUNDER_CHART"], cls.csv, "--short"], check=True)
        with open(cls.csv, newline="") as file:
            cls.rows = list(csv.DictReader(file))
        for row in cls.rows:
            for name in ("cpu_s_per_s", "error", "substeps", "error_budget"):
                row[name] = float(row[name])

    def errors(self, case, method, particles=320):
        """Error by (substeps, iterations)."""
        return {(int(r["substeps"]), int(r["iterations"])): r["error"] for r in self.rows
                if r["case"] == case and r["method"] == method and int(r["particles"]) == particles and not r["error_budget"]}

    def test_is_whole(self):
        for case, meshes in CASES.items():
            for method in METHODS:
                for particles in meshes:
                    settings = self.errors(case, method, particles)
                    self.assertGreaterEqual(set(settings), {(1, 1), (1, 2), (2, 1), (8, 1)}, (case, method, particles))
                if 320 in meshes:
                    self.assertEqual([r["error_budget"] for r in self.rows if r["case"] == case and r["error_budget"]], [0.1, 0.02])
        keys = ("case", "method", "particles", "substeps", "iterations", "error_budget")
        self.assertEqual(len(self.rows), len({tuple(r[k] for k in keys) for r in self.rows}))
        for row in self.rows:
            self.assertGreater(row["cpu_s_per_s"], 0)
            self.assertGreaterEqual(row["error"], 0)  # infinite where there is no answer, never NaN

    def test_more_substeps_bring_the_solver_nearer(self):
        for case, settings in {"release_period": [(2, 1), (8, 1), (32, 1)], "tear_time": [(2, 1), (32, 1)]}.items():
            errors = [self.errors(case, "projective")[s] for s in settings]
            for coarse, fine in zip(errors, errors[1:]):
                self.assertLess(fine, 0.5 * coarse, (case, errors))

    def test_an_error_budget_holds_within_a_factor_of_two(self):
        # The other cases' errors are the mesh's. A tear by waves of a sudden pull is 5 % late at the most substeps that a
        # budget may take, so that it is held to the larger one alone.
        held_to = {"release_period": {0.1, 0.02}, "tear_time": {0.1}}
        for row in self.rows:
            if row["error_budget"] in held_to.get(row["case"], ()):
                self.assertLessEqual(row["error"], 2 * row["error_budget"], row)

    def test_a_larger_error_budget_takes_fewer_substeps(self):
        for case in CASES:
            loose, tight = [r["substeps"] for r in self.rows if r["case"] == case and r["error_budget"]]
            self.assertLess(loose, tight, case)

    def test_the_solver_beats_the_plain_method_where_order_biases_it(self):
        ours, plain = self.errors("held_twist", "projective"), self.errors("held_twist", "plain")
        for setting in ours.keys() & plain.keys():
            self.assertLess(ours[setting], 0.5 * plain[setting], setting)

    def test_finer_meshes_come_nearer_to_the_continuum(self):
        for case in ("held_twist", "residual_twist"):
            coarse, fine = self.errors(case, "projective", 40), self.errors(case, "projective", 320)
            for setting in coarse.keys() & fine.keys():
                self.assertLess(fine[setting], coarse[setting], (case, setting))

    def test_the_plain_methods_sweep_is_nearly_that_of_the_solver(self):
        # Two implementations of one sweep; the solver's rest shapes depart a little (docs/theory.md).
        for particles in (40, 320):
            ours, plain = (self.errors("held_twist", m, particles) for m in ("gauss_seidel", "plain"))
            for setting in ours.keys() & plain.keys():
                self.assertAlmostEqual(ours[setting], plain[setting], delta=0.1 * plain[setting])

    def test_is_drawn(self):
        stem = Path(self.folder.name) / "picture"
        subprocess.run([sys.executable, HERE / "draw_chart.py", self.csv, stem], check=True)
        self.assertIn("<svg", stem.with_suffix(".svg").read_text()[:1000])
        self.assertEqual(stem.with_suffix(".png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")


if __name__ == "__main__":
    unittest.main()
