"""What a particle, a piece and a triangle cost as their number grows: runs the benchmarks, keeps a csv, draws it.

    growth.py BUILD_FOLDER OUTPUT_STEM     measures (five minutes), writes OUTPUT_STEM.csv, .svg and .png
    growth.py OUTPUT_STEM                  draws OUTPUT_STEM.csv again

Columns of the csv: what (particles, pieces, triangles), count, seconds (a substep, or a cut; one thread), peak_mb.
"""
import csv
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import kept_csv

ROOT = Path(__file__).resolve().parents[3]
BUNNY = ROOT / "tests/data/bunny.obj"
SCENES = ("1k", "10k", "100k", "1m")
PIECES = (100, 1000, 10000, 100000)
SPLITS = (0, 1, 2, 3, 4, 5)  # of each triangle in four
PANELS = {
    "particles": ("Simulation: a substep", "particles", "µs a particle", "KB a particle"),
    "pieces": ("Pre-fracture: pieces (bunny of 3.7K triangles)", "pieces", "µs a piece", "KB a piece"),
    "triangles": ("Pre-fracture: triangles (300 pieces)", "triangles", "µs a triangle", "KB a triangle"),
}
INK, TIME, MEMORY = "#22272e", "#0b5fa5", "#e0a100"


def particles(bench):
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "bench.csv"
        subprocess.run([bench, *SCENES, "--csv", table], check=True, stdout=sys.stderr)
        with open(table, newline="") as file:
            for row in csv.DictReader(file):
                yield "particles", int(row["particles"]), float(row["median_ms"]) * 1e-3 / int(row["substeps"]), float(row["peak_mb"])


def cuts(fracture_table, what, *options):
    printed = subprocess.run([fracture_table, "--methods", "voronoi", *options, BUNNY], check=True, stdout=subprocess.PIPE,
                             text=True).stdout
    for line in printed.splitlines()[2:]:
        print(line, file=sys.stderr, flush=True)
        _, _, triangles, _, _, pieces, seconds, peak_mb, *_ = (word.strip() for word in line.split("|"))
        yield what, int(triangles if what == "triangles" else pieces), float(seconds), float(peak_mb)


def measure(build):
    table = build / "tests/benchmarks/fracture/fracture_table"
    yield from particles(build / "tests/benchmarks/bench/sunder_bench")
    yield from cuts(table, "pieces", "--pieces", ",".join(map(str, PIECES)))
    for split in SPLITS:
        yield from cuts(table, "triangles", "--pieces", "300", "--split", str(split))


def draw(rows, stem):
    figure, axes = plt.subplots(1, len(PANELS), figsize=(13, 3.8))
    for axis, (what, (title, count_label, time_label, memory_label)) in zip(axes, PANELS.items()):
        mine = sorted((int(r["count"]), float(r["seconds"]), float(r["peak_mb"])) for r in rows if r["what"] == what)
        counts = [count for count, _, _ in mine]
        axis.loglog(counts, [1e6 * s / n for n, s, _ in mine], "o-", color=TIME)
        axis.set_title(title, color=INK, fontsize=10)
        axis.set_xlabel(count_label)
        axis.set_ylabel(time_label, color=TIME)
        memory = axis.twinx()
        memory.loglog(counts, [1024 * mb / n for n, _, mb in mine], "s--", color=MEMORY, markersize=4)
        memory.set_ylabel(memory_label + ", whole process", color=MEMORY)
        least = min(1e6 * s / n for n, s, _ in mine)
        axis.set_ylim(least / 3, least * 30)
        axis.grid(alpha=0.25)
    figure.tight_layout()
    for suffix in ("svg", "png"):
        figure.savefig(f"{stem}.{suffix}", dpi=110)


if __name__ == "__main__":
    kept_csv.run(__doc__, ("what", "count", "seconds", "peak_mb"), measure, draw)
