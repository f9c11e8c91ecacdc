"""Processor time against how much a hit breaks, undivided substeps beside those divided for hits: measures, keeps a csv, draws it.

    hits.py BUILD_FOLDER OUTPUT_STEM     measures (fifteen minutes, one thread), writes OUTPUT_STEM.csv, .svg and .png
    hits.py OUTPUT_STEM                  draws OUTPUT_STEM.csv again

Scene: `bunnies`, and the same as many times as stiff (`sunder_breaking --stiffer`). Columns of the csv: stiffer (times),
way (a key of WAYS), substeps, iterations, hit_substeps, edges, standard_error (of the mean of the shots), cpu_s_per_s
(processor time for a simulated second, s).
"""
import re
import resource
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import kept_csv

SHOTS, SECONDS = 8, 2  # that a shot simulates
STIFFER = {1: "0.5 MPa", 20: "10 MPa", 1000: "500 MPa"}
FINEST = {1: (128, 1), 20: (256, 1), 1000: (512, 1)}
UNDIVIDED = [(4, 1), (8, 2), (16, 1), (32, 1), (64, 1)]
WAYS = {  # key: label, colour, marker, options, settings (substeps, iterations, hit_substeps)
    "paper": ("undivided, cracks run a ring a substep (the paper)", "#c2452d", "s", ("--crack-passes", "1"), [(*s, 1) for s in UNDIVIDED]),
    "undivided": ("undivided, cracks run on", "#e0a100", "^", (), [(*s, 1) for s in UNDIVIDED]),
    "divided": ("hits in parts: presets", "#0b5fa5", "o", (), [(4, 1, 16), (8, 2, 16), (32, 1, 64)]),
    "more": ("hits in up to 64 parts", "#1a9988", "D", (), [(2, 1, 64), (4, 1, 64), (8, 2, 64)]),
    "budget": ("error budget of 10 %", "#8b2f7f", "v", ("--error-budget", "0.1"), [(8, 2, 16)]),
    "finest": ("finest undivided", "#22272e", "*", (), []),
}
INK = "#22272e"


def shoot(breaking, stiffer, options, substeps, iterations, hit_substeps):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    printed = subprocess.run(
        [breaking, "bunnies", "--threads", "1", "--shots", str(SHOTS), "--stiffer", str(stiffer), "--substeps", str(substeps),
         "--iterations", str(iterations), "--hit-substeps", str(hit_substeps), *options], check=True, stdout=subprocess.PIPE, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    edges, error = re.match(r"bunnies: edges broken ([\d.]+), standard error ([\d.]+);", printed).groups()
    return edges, error, round((after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime) / (SHOTS * SECONDS), 4)


def measure(build):
    breaking = build / "tests/benchmarks/bench/sunder_breaking"
    for stiffer in STIFFER:
        for way, (*_, options, settings) in WAYS.items():
            for setting in settings or [(*FINEST[stiffer], 1)]:
                row = (stiffer, way, *setting, *shoot(breaking, stiffer, options, *setting))
                print(*row, file=sys.stderr, flush=True)
                yield row


def draw(rows, stem):
    figure, axes = plt.subplots(1, len(STIFFER), figsize=(13, 4.9))
    for axis, (stiffer, modulus) in zip(axes, STIFFER.items()):
        own = [r for r in rows if int(r["stiffer"]) == stiffer]
        for way, (label, colour, marker, *_) in WAYS.items():
            mine = sorted((float(r["cpu_s_per_s"]), float(r["edges"]), float(r["standard_error"])) for r in own if r["way"] == way)
            axis.errorbar(*zip(*((x, y) for x, y, _ in mine)), yerr=[2 * e for *_, e in mine], color=colour, marker=marker,
                          markersize=12 if way == "finest" else 6, linewidth=1.5, label=label)
        finest, = (float(r["edges"]) for r in own if r["way"] == "finest")
        axis.axhline(finest, color=INK, linewidth=0.8, linestyle=":")
        for name, row in zip(("preview", "default", "final"), (r for r in own if r["way"] == "divided")):
            axis.annotate(name, (float(row["cpu_s_per_s"]), float(row["edges"])), color="#0b5fa5", fontsize=9,
                          xytext=(-44, 8) if name == "preview" else (5, -13), textcoords="offset points")
        axis.set_xscale("log")
        axis.set_ylim(0, 1.35 * max(float(r["edges"]) for r in own) / 1.15)
        axis.set_title(f"Bunnies of {modulus}", color=INK, fontsize=11, loc="left", weight="bold")
        axis.set_xlabel("processor time for a simulated second, s")
        axis.grid(alpha=0.25)
    axes[0].set_ylabel("edges that a hit breaks (bars: two standard errors)")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=3, frameon=False, fontsize=9)
    figure.tight_layout(rect=(0, 0.11, 1, 1))
    plt.rcParams["svg.hashsalt"] = "sunder"
    figure.savefig(stem + ".svg", metadata={"Date": None})
    figure.savefig(stem + ".png", dpi=110)


if __name__ == "__main__":
    kept_csv.run(__doc__, ("stiffer", "way", "substeps", "iterations", "hit_substeps", "edges", "standard_error", "cpu_s_per_s"), measure, draw)
