"""Read by mypy alone (test_types.py): what is right is taken, and what is wrong is refused where `type: ignore` says so."""
from __future__ import annotations

import numpy as np

import sunder


def shot() -> sunder.Graph:
    g = sunder.Graph()
    g.add("lattice", "bar", size=(1, 1, 4), cells=np.array([2, 2, 8]), neighbours=18)
    g.add("body", "clay", fragments="@bar.fragments", youngs_modulus=3e5, toughness=None)["yield"] = 0.1
    g.add("body", "soft", fragments="@bar.fragments", youngs_modulus={"keys": [[1, 3e5], [9, 1e5]]}, damping_time="auto")
    g.add("solver", "sim", bodies=["@clay.body", "@soft.body"], preset="preview", substeps=np.int64(4))
    g.add("bake_state", "states", state="@sim.state")["compression"] = "zstd"
    g.add("lattice", "b", sise=(1, 1, 1))  # type: ignore[call-overload]
    g.add("latice", "b", size=(1, 1, 1))  # type: ignore[call-overload]
    g.add("solver", "b", preset="fast")  # type: ignore[call-overload]
    g.add("deformer", "b", state=4)  # type: ignore[call-overload]
    g.add("lattice", "b", size="large")  # type: ignore[call-overload]
    return g


def look(g: sunder.Graph) -> float:
    first, last = g.frame_range
    state = g.evaluate("sim.state", frame=last, progress=lambda fraction, text: fraction < 0.5)
    assert isinstance(state, sunder.State)
    g.seed_state("sim", first, state)
    g.seed_state("sim", first, g.evaluate("skin.mesh"))  # type: ignore[arg-type]
    g.frame_range = "1:24"  # type: ignore[assignment]
    state.position.no_such_method()  # type: ignore[attr-defined]
    mesh, = g.evaluate_all(["skin.mesh"], last)
    print(len(mesh.triangles), [name.upper() for name in sunder.verify("bake")["faults"]], state.frame + 1)
    job = g.start_bake("bake", frames=(first, last), resume=True)
    job.wait("long")  # type: ignore[arg-type]
    return job.result()["n_frames"] / job.progress[0]


def fails() -> str:
    try:
        told: list[str] = sunder.bake("shot.json", "bake", frames=[1, 24], threads=2)["warnings"]
    except sunder.Error as error:
        return error.code + error.parameter
    return sunder.__version__ + 1  # type: ignore[operator, no-any-return]
