"""Processor time against how a ball splits: large pieces and parted area. Measures, keeps a csv, draws it.

    cracks.py BUILD_FOLDER OUTPUT_STEM     measures (two minutes, one thread), writes OUTPUT_STEM.csv and .svg
    cracks.py OUTPUT_STEM                  draws OUTPUT_STEM.csv again

The ball of docs/cracks.md in 300 fragments falls at a fifth above its critical load; shots differ by the cut's seed.
Columns of the csv: way (a key of WAYS), name, shots, pieces (of 2 % of the mass and more), pieces_error (standard, of the mean),
area (parted, m2), area_error, cpu_s (processor time of the three frames of a shot without its cut, s).
"""
import importlib.util
import os
import sys
import tempfile
import time
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import kept_csv

ROOT = Path(__file__).resolve().parents[3]
SHOTS, LARGE = 3, 0.02
SPEED, DENSITY, STIFFNESS, LOAD = 10.0, 2000.0, 1e8, 8
WAYS = {  # key: label, colour, marker, settings by name
    "presets": ("presets", "#0b5fa5", "o", {name: {"preset": name} for name in ("preview", "default", "final")}),
    "undivided": ("undivided substeps", "#c2452d", "s", {
        str(n): {"substeps": n, "iterations": 1, "hit_substeps": 1} for n in (64, 128, 256)}),
    "parts": ("8 substeps, hits in up to so many parts", "#1a9988", "D", {
        str(n): {"substeps": 8, "iterations": 1, "hit_substeps": n} for n in (32, 64)}),
    "budget": ("error budget", "#8b2f7f", "v", {
        f"{n:.0%}": {"error_budget": n} for n in (0.1, 0.02)}),
    "finest": ("512 undivided", "#22272e", "*", {"512": {"substeps": 512, "iterations": 1, "hit_substeps": 1}}),
}
COLUMNS = ("way", "name", "shots", "pieces", "pieces_error", "area", "area_error", "cpu_s")


def split(sunder, ball, seed, settings):
    """(large pieces, parted area, processor time) a tenth of a second after the hit."""
    graph = sunder.Graph.from_dict({"sunder": 2, "frame_rate": 24, "frame_range": [1, 4], "nodes": {
        "mesh": {"type": "mesh_file", "path": ball},
        "cut": {"type": "prefracture", "mesh": "@mesh.mesh", "pieces": 300, "clusters": 0, "seed": seed},
        "body": {"type": "body", "fragments": "@cut.fragments", "density": DENSITY, "youngs_modulus": STIFFNESS,
                 "poisson_ratio": 0.2, "toughness": SPEED / ((STIFFNESS / DENSITY)**0.5 * LOAD), "position": [0, 0, 0.52],
                 "velocity": [0, 0, -SPEED]},
        "floor": {"type": "collider", "shape": "plane"},
        "solver": {"type": "solver", "bodies": ["@body.body"], "colliders": ["@floor.collider"], **settings}}})
    graph.set_threads(1)
    cut = graph.evaluate("cut.fragments")
    graph.evaluate("solver.state", frame=1)
    before = time.process_time()
    state = graph.evaluate("solver.state", frame=4)
    spent = time.process_time() - before
    mass = np.bincount(state.piece, state.mass) / np.sum(state.mass)
    ends = state.piece[cut.edges]
    return np.count_nonzero(mass >= LARGE), np.sum(cut.interface_area[ends[:, 0] != ends[:, 1]]), spent


def measure(build):
    os.environ["SUNDER_LIBRARY"] = str(build.resolve() / "plugin_src/libsunder.so")
    sys.path.insert(0, str(ROOT / "plugin_src/python"))
    import sunder

    spec = importlib.util.spec_from_file_location("test_cracks", ROOT / "tests/scripted/test_cracks.py")
    cracks = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(cracks)
    with tempfile.TemporaryDirectory() as folder:
        ball = Path(folder) / "ball.obj"
        cracks.write_ball(ball)
        for way, (*_, all_settings) in WAYS.items():
            for name, settings in all_settings.items():
                made = np.array([split(sunder, str(ball), seed, settings) for seed in range(SHOTS)])
                mean, error = made.mean(axis=0), made.std(axis=0, ddof=1) / SHOTS**0.5
                row = (way, name, SHOTS, *(f"{x:.3f}" for x in (mean[0], error[0], mean[1], error[1], mean[2])))
                print(*row, file=sys.stderr, flush=True)
                yield row


def draw(rows, stem):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.6))
    for axis, (column, title) in zip(axes, (("pieces", "Pieces of 2 % of the mass and more"), ("area", "Parted area, m²"))):
        for way, (label, colour, marker, _) in WAYS.items():
            own = sorted(((float(r["cpu_s"]), float(r[column]), float(r[column + "_error"]), r["name"]) for r in rows if r["way"] == way))
            axis.errorbar([x for x, *_ in own], [y for _, y, *_ in own], yerr=[e for *_, e, _ in own], color=colour, marker=marker,
                          markersize=12 if way == "finest" else 6, linewidth=1.3, label=label)
            for x, y, _, name in own if way != "finest" else ():
                axis.annotate(name, (x, y), color=colour, fontsize=8, xytext=(5, 5), textcoords="offset points")
        finest, = (float(r[column]) for r in rows if r["way"] == "finest")
        axis.axhline(finest, color="#22272e", linewidth=0.8, linestyle=":")
        axis.set_xscale("log")
        axis.set_ylim(bottom=0)
        axis.set_title(title, color="#22272e", fontsize=11, loc="left", weight="bold")
        axis.set_xlabel("processor time of a shot, s (bars: standard error)")
        axis.grid(alpha=0.25)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=5, frameon=False, fontsize=9)
    figure.tight_layout(rect=(0, 0.08, 1, 1))
    plt.rcParams["svg.hashsalt"] = "sunder"
    figure.savefig(stem + ".svg", metadata={"Date": None})


if __name__ == "__main__":
    kept_csv.run(__doc__, COLUMNS, measure, draw)
