"""Processor time of what directs a shot: of time scale, and of a source that deforms. Measures, keeps a csv, draws it.

    directed.py BUILD_FOLDER OUTPUT_STEM     measures (four minutes, one thread), writes OUTPUT_STEM.csv and .svg
    directed.py OUTPUT_STEM                  draws OUTPUT_STEM.csv again

Time scale: the shots of SHOTS over the same simulated frames, each frame of the output asked for its state, or its mesh.
Source: the column of examples/arm.json over the frames in which it follows its rig, cut finer and finer; beside it the same
column that follows keys of its place, and one that is simulated, held at its foot and swung by gravity.
Columns of the csv: part (time_scale, source), case (a shot, or a key of WAYS), asked (state, mesh), scale, pieces (fragments),
simulated (frames), shown (frames), cpu_s (user and system time without cutting and the first frame, median of REPEATS, s).
"""
import os
import statistics
import sys
import time
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import kept_csv

ROOT = Path(__file__).resolve().parents[3]
REPEATS = 3
SHOTS = {"arch": 40, "blast": 24}  # simulated frames
SCALES = (1, 0.5, 0.2, 0.1)
PIECES = (120, 480, 1920)
FOLLOWED = 21  # frames of arm.json in which it follows
WAYS = {"simulated": ("simulated", "#c2452d", "s"), "vertices": ("follows each vertex", "#0b5fa5", "o"),
        "transform": ("follows keys of its place", "#1a9988", "D")}
ASKED = {"state": "states", "mesh": "meshes"}
LOOKS = {("arch", "state"): ("#0b5fa5", "-"), ("arch", "mesh"): ("#0b5fa5", "--"), ("blast", "state"): ("#c2452d", "-"),
         ("blast", "mesh"): ("#c2452d", "--")}
INK = "#22272e"
COLUMNS = ("part", "case", "asked", "scale", "pieces", "simulated", "shown", "cpu_s")


def load(sunder, name):
    graph = sunder.Graph.load(str(ROOT / "examples" / (name + ".json")))
    graph.set_threads(1)
    return graph


def cost(make, output, last):
    """(median processor time of frames 2 to `last` of an output, s; fragments), each time of a graph that knows none."""
    times = []
    for _ in range(REPEATS):
        graph = make()
        first = graph.evaluate("solver.state", frame=1)
        graph.evaluate(output, frame=1)
        before = time.process_time()
        for frame in range(2, last + 1):
            graph.evaluate(output, frame=frame)
        times.append(time.process_time() - before)
    return round(statistics.median(times), 4), len(first.position)


def slowed(sunder, name, scale):
    graph = load(sunder, name)
    graph["solver"]["time_scale"] = scale
    return graph


def arm(sunder, way, pieces):
    graph = load(sunder, "arm")
    graph["cut"]["pieces"] = pieces
    if way == "transform":
        graph["rig"].set(motion="transform", path="", position={"keys": [[1, [0, 0, 0.3]], [FOLLOWED, [2, 0, 0.3]]]},
                         rotation={"keys": [[1, [0, 0, 0]], [FOLLOWED, [0, 40, 0]]]})
    if way == "simulated":
        graph.add("pin", "foot", body="@body.body", region="box", box_min=(-1, -1, -1), box_max=(1, 1, 0.2))
        graph["solver"].set(bodies=["@body.body"], pins=["@foot.pin"], gravity=(4, 0, -9.81))
        graph["deformer"]["body"] = "@body.body"
        graph["body"]["toughness"] = None
    return graph


def measure(build):
    os.environ["SUNDER_LIBRARY"] = str(build.resolve() / "plugin_src/libsunder.so")
    sys.path.insert(0, str(ROOT / "plugin_src/python"))
    import sunder

    for name, simulated in SHOTS.items():
        for scale in SCALES:
            for asked, output in (("state", "solver.state"), ("mesh", "deformer.mesh")):
                shown = round(simulated / scale)
                seconds, pieces = cost(lambda: slowed(sunder, name, scale), output, 1 + shown)
                yield tell("time_scale", name, asked, scale, pieces, simulated, shown, seconds)
    for way in WAYS:
        for wanted in PIECES:
            seconds, pieces = cost(lambda: arm(sunder, way, wanted), "solver.state", FOLLOWED)
            yield tell("source", way, "state", 1, pieces, FOLLOWED - 1, FOLLOWED - 1, seconds)


def tell(*row):
    print(*row, file=sys.stderr, flush=True)
    return row


def draw(rows, stem):
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
    for (name, asked), (colour, line) in LOOKS.items():
        own = [r for r in rows if (r["part"], r["case"], r["asked"]) == ("time_scale", name, asked)]
        left.plot([int(r["shown"]) / int(r["simulated"]) for r in own], [float(r["cpu_s"]) for r in own], color=colour, linestyle=line,
                  marker="o", label=f"{name}: {ASKED[asked]} ({own[0]['pieces']} fragments)")
    left.set_title("The same simulated frames, shown slower", color=INK, fontsize=11, loc="left", weight="bold")
    left.set_xlabel("frames shown for one simulated: 1 / time_scale")
    left.set_ylabel("processor time of the shot, s")
    left.set_ylim(bottom=0)
    for way, (label, colour, marker) in WAYS.items():
        own = [r for r in rows if (r["part"], r["case"]) == ("source", way)]
        right.plot([int(r["pieces"]) for r in own], [1e3 * float(r["cpu_s"]) / int(r["shown"]) for r in own], color=colour,
                   marker=marker, label=label)
    right.set_xscale("log"), right.set_yscale("log")
    right.set_title("A column that bends, or is bent", color=INK, fontsize=11, loc="left", weight="bold")
    right.set_xlabel("fragments")
    right.set_ylabel("processor time of a frame, ms")
    for axis, place in ((left, "center right"), (right, "upper left")):
        axis.grid(alpha=0.25)
        axis.legend(frameon=False, fontsize=9, loc=place)
    figure.tight_layout()
    plt.rcParams["svg.hashsalt"] = "sunder"
    figure.savefig(stem + ".svg", metadata={"Date": None})


if __name__ == "__main__":
    kept_csv.run(__doc__, COLUMNS, measure, draw)
