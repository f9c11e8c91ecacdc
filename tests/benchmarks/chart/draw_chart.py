"""Draws the csv of sunder_chart: processor time against error, a panel a case, a curve a method.

    draw_chart.py CHART.csv OUTPUT_STEM     writes OUTPUT_STEM.svg and OUTPUT_STEM.png
"""
import csv
import math
import sys
from collections import defaultdict

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

METHODS = {  # name: (label, colour, line)
    "projective": ("Sunder, projective (default)", "#0b5fa5", "-"),
    "jacobi": ("Sunder, jacobi", "#1a9988", "-"),
    "gauss_seidel": ("Sunder, gauss_seidel (the paper's sweep)", "#e0a100", "-"),
    "plain": ("the paper's plain method", "#c2452d", "-"),
    "plain_corrected": ("the same, momentum corrected (3.3)", "#8b2f7f", (0, (4, 1.5))),
}
CASES = {
    "held_twist": ("Held at a twist of 90°", "distance from the finite-element field"),
    "release_period": ("Let go from a twist of 60°", "half period, against its limit for fine steps"),
    "residual_twist": ("Twisted by 90° beyond yield, let go", "angle that stays, against finite elements"),
    "tear_time": ("Ductile, pulled apart", "time of the first tear, against its limit for fine steps"),
}
WORST, BEST = 3.0, 1e-3  # what the axis shows; errors beyond are drawn on its edge
INK, MUTED = "#22272e", "#6a737d"
HELD, MISSED = "#9ecae9", "#f4a3a3"  # error budgets


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        for name in ("particles", "iterations"):
            row[name] = int(row[name])
        for name in ("substeps", "error_budget", "cpu_s_per_s", "error"):
            row[name] = float(row[name])
    return rows


def trusted_errors(rows):
    """A setting's error is the largest that it or any finer one of its method and mesh has: an answer that refining
    spoils was right by accident. Where nothing finer was run there is nothing to trust."""
    groups = defaultdict(list)
    for row in rows:
        groups[row["case"], row["method"], row["particles"]].append(row)
    for group in groups.values():
        for row in group:
            finer = [r["error"] for r in group if r["substeps"] >= row["substeps"] and r["iterations"] >= row["iterations"]]
            refined = any(r["substeps"] > row["substeps"] for r in group if r["iterations"] >= row["iterations"])
            row["trusted"] = max(finer) if refined else math.inf


def front(rows):
    """Rows that no other one beats in both time and error, from the fastest on."""
    best, kept = math.inf, []
    for row in sorted(rows, key=lambda r: (r["cpu_s_per_s"], r["trusted"])):
        if row["trusted"] < best:
            best = row["trusted"]
            kept.append(row)
    return kept


def shown(error):
    return min(max(error, BEST), WORST)


def staircase(rows, right):
    x = [r["cpu_s_per_s"] for r in rows] + [right]
    y = [shown(r["trusted"]) for r in rows]
    return x, y + y[-1:]


def draw_panel(axes, rows, budgeted):
    whole = [r for r in front(rows) if math.isfinite(r["trusted"])]
    if whole:
        x, y = staircase(whole, max(r["cpu_s_per_s"] for r in rows))
        axes.step(x, y, where="post", color="#f2c94c", alpha=0.45, linewidth=9, solid_capstyle="round", zorder=1)
    for method, (_, colour, line) in METHODS.items():
        own = [r for r in rows if r["method"] == method]
        found = [r for r in own if math.isfinite(r["error"])]
        lost = [r for r in own if not math.isfinite(r["error"])]
        axes.scatter([r["cpu_s_per_s"] for r in found], [shown(r["error"]) for r in found],
                     s=9, color=colour, alpha=0.28, linewidths=0, zorder=2)
        axes.scatter([r["cpu_s_per_s"] for r in lost], [WORST] * len(lost), s=16, marker="x", color=colour,
                     alpha=0.5, linewidths=0.9, zorder=2, clip_on=False)
        kept = [r for r in front(own) if math.isfinite(r["trusted"])]
        if kept:
            x, y = staircase(kept, max(r["cpu_s_per_s"] for r in own))
            axes.step(x, y, where="post", color=colour, linestyle=line, linewidth=2, zorder=3)
    by_steps = "limit" in CASES[rows[0]["case"]][1]
    draw_budgets(axes, budgeted if by_steps else [])  # elsewhere the mesh's error hides that of the steps
    for row in rows:
        if row["preset"]:
            draw_preset(axes, row)


def draw_budgets(axes, rows):
    rows = sorted(rows, key=lambda r: r["cpu_s_per_s"])
    axes.plot([r["cpu_s_per_s"] for r in rows], [shown(r["error"]) for r in rows], color=INK, linewidth=0.9,
              linestyle=":", zorder=4)
    for row in rows:  # a bar at what is allowed, joined to what was reached
        x, reached, allowed = row["cpu_s_per_s"], shown(row["error"]), shown(row["error_budget"])
        axes.plot([x, x], [reached, allowed], color=INK, linewidth=0.9, zorder=4)
        axes.scatter(x, allowed, s=70, marker="_", color=INK, linewidths=1.4, zorder=4)
        axes.scatter(x, reached, s=26, marker="D", edgecolors=INK, linewidths=0.9, zorder=5,
                     facecolors=HELD if row["error"] <= row["error_budget"] else MISSED)
    for row in rows[:1] + rows[-1:]:
        axes.annotate(percent(row["error_budget"], None), (row["cpu_s_per_s"], shown(row["error"])), xytext=(-6, -11),
                      textcoords="offset points", ha="right", fontsize=8, color=INK, zorder=6)


def draw_preset(axes, row):
    place = (row["cpu_s_per_s"], shown(row["error"]))
    star = row["preset"] == "default"
    axes.scatter(*place, marker="*" if star else "o", s=190 if star else 52, color="white", edgecolors=INK, linewidths=1.4,
                 zorder=5)
    offset, align = {"preview": ((-2, 9), "right"), "default": ((0, 11), "center"), "final": ((8, -3), "left")}[row["preset"]]
    axes.annotate(row["preset"], place, xytext=offset, textcoords="offset points", ha=align, fontsize=9, color=INK,
                  weight="bold" if star else "normal", zorder=6,
                  bbox={"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.7})


def percent(value, _position):
    return f"{100 * value:g} %"


def style(axes, title, subtitle):
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(BEST, WORST)
    axes.yaxis.set_major_formatter(FuncFormatter(percent))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(which="major", color="#e3e6ea", linewidth=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color("#b8bec6")
    axes.tick_params(which="both", colors=MUTED, labelsize=9, length=0)
    axes.set_title(title, loc="left", fontsize=12, color=INK, weight="bold", pad=23)
    axes.text(0, 1.035, subtitle, transform=axes.transAxes, fontsize=9.5, color=MUTED)


def draw(rows, stem):
    plt.rcParams.update({"font.family": "DejaVu Sans", "svg.hashsalt": "sunder", "path.simplify": True})
    figure, panels = plt.subplots(2, 2, figsize=(12, 9.4), sharex=True, sharey=True)
    times = [r["cpu_s_per_s"] for r in rows]
    left, right = min(times) * 0.8, max(times) * 1.25
    for axes, (case, (title, subtitle)) in zip(panels.flat, CASES.items()):
        style(axes, title, subtitle)
        own = [r for r in rows if r["case"] == case]
        draw_panel(axes, [r for r in own if not r["error_budget"]], [r for r in own if r["error_budget"]])
        axes.set_xlim(left, right)
    for axes in panels[1]:
        axes.set_xlabel("processor time for a simulated second, s", fontsize=10, color=INK)
    for axes in panels[:, 0]:
        axes.set_ylabel("error", fontsize=10, color=INK)

    handles = [Line2D([], [], color=c, linestyle=l, linewidth=2.4, label=name) for name, c, l in METHODS.values()]
    handles += [
        Line2D([], [], color="#f2c94c", alpha=0.45, linewidth=9, label="Pareto front of all"),
        Line2D([], [], marker="*", markersize=13, color="white", markeredgecolor=INK, linestyle="", label="presets, 320 particles"),
        Line2D([], [], marker="D", markersize=5, color=INK, linewidth=0.9, linestyle=":", markerfacecolor=HELD,
               label="projective, error budget (bar) held"),
        Line2D([], [], marker="D", markersize=5, color=INK, linewidth=0.9, linestyle=":", markerfacecolor=MISSED,
               label="the same, budget missed"),
        Line2D([], [], marker="o", markersize=4, color=MUTED, alpha=0.5, linestyle="", label="one run"),
        Line2D([], [], marker="x", markersize=5, color=MUTED, linestyle="", label="no answer, or lost"),
    ]
    figure.legend(handles=handles, loc="lower center", ncol=3, frameon=False, fontsize=9.5, labelcolor=INK,
                  bbox_to_anchor=(0.5, 0.035), columnspacing=2.2, handlelength=2.4)
    sizes = sorted({r["particles"] for r in rows})
    figure.text(0.5, 0.012, "Bars of " + ", ".join(map(str, sizes[:-1])) + (" and " if len(sizes) > 1 else "") + str(sizes[-1]) +
                " particles on one thread. Curves: the best settings so far, each counted with the largest error that it or any "
                "finer one has.", ha="center", fontsize=9, color=MUTED)
    figure.suptitle("Speed against accuracy", x=0.065, y=0.985, ha="left", fontsize=17, weight="bold", color=INK)
    figure.subplots_adjust(left=0.065, right=0.985, top=0.89, bottom=0.185, hspace=0.3, wspace=0.06)
    figure.savefig(stem + ".svg", metadata={"Date": None})
    figure.savefig(stem + ".png", dpi=110)


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: draw_chart.py CHART.csv OUTPUT_STEM")
    rows = read(sys.argv[1])
    trusted_errors([r for r in rows if not r["error_budget"]])
    draw(rows, sys.argv[2])


if __name__ == "__main__":
    main()
