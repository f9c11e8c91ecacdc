"""A notched strip is slowly drawn: a crack runs through it at a strain that goes by the root of the fracture energy (Griffith).

A strip between clamps stores E e^2 h / 2 by length, h its height between them, all of which a long crack frees: it runs where that is
G_c = E tau^2 L / 2, at a strain e of tau (L / h)^0.5, however long the notch. (The ball of test_split_ball.py has no notch.)
"""
import numpy as np
import pytest

import sunder

STIFFNESS, DENSITY, TOUGHNESS = 1e8, 2000.0, 0.005  # Pa, kg/m3
HEIGHT, HELD, WIDTH, NOTCH, FRAGMENT = 1.0, 0.05, 3.0, 1.0, 0.025  # m
FRAMES = 97
SHOTS = 3


def write_strip(path):
    """One fragment thick, with a slit half way up from its left side."""
    x, z = WIDTH / 2, HEIGHT / 2
    outline = [(-x, -z), (x, -z), (x, z), (-x, z), (-x, 0.01), (NOTCH - x, 0), (-x, -0.01)]
    n = len(outline)
    lines = ["v %g %g %g" % (px, y, pz) for y in (-FRAGMENT / 2, FRAGMENT / 2) for px, pz in outline]
    faces = [range(1, n + 1), range(2 * n, n, -1)] + [((i + 1) % n + 1, i + 1, i + 1 + n, (i + 1) % n + 1 + n) for i in range(n)]
    path.write_text("\n".join(lines + ["f " + " ".join(map(str, face)) for face in faces]) + "\n")


def strain_that_splits(path, length, seed):
    """Over Griffith's. `length`: L = 2 G_c / (E tau^2), m."""
    between = HEIGHT - 2 * HELD
    griffith = TOUGHNESS * (length / between)**0.5
    most = 3 * griffith
    sides = {name: {"type": "pin", "body": "@body.body", "region": "box", "box_min": [-9, -9, low], "box_max": [9, 9, high],
                    "position": {"keys": [[1, [0, 0, 0]], [FRAMES, [0, 0, side * most * between / 2]]]}}
             for name, side, low, high in (("below", -1, -9, HELD - HEIGHT / 2), ("above", 1, HEIGHT / 2 - HELD, 9))}
    graph = sunder.Graph.from_dict({"sunder": 2, "frame_rate": 24, "frame_range": [1, FRAMES], "nodes": {
        "mesh": {"type": "mesh_file", "path": str(path)},
        "cut": {"type": "prefracture", "mesh": "@mesh.mesh", "pieces": round(WIDTH * HEIGHT / FRAGMENT**2), "clusters": 0, "seed": seed},
        "body": {"type": "body", "fragments": "@cut.fragments", "density": DENSITY, "youngs_modulus": STIFFNESS,
                 "toughness": TOUGHNESS, "fracture_energy": STIFFNESS * TOUGHNESS**2 * length / 2},
        "solver": {"type": "solver", "gravity": [0, 0, 0], "damping": 4, "bodies": ["@body.body"],
                   "pins": [f"@{name}.pin" for name in sides]}, **sides}})
    place = graph.evaluate("cut.fragments").interface_centroid
    for frame in range(2, FRAMES + 1):
        broken = place[graph.evaluate("solver.state", frame=frame).broken_edge]
        if len(broken) > 0 and broken[:, 0].max() > 0.9 * WIDTH / 2:
            assert np.abs(broken[:, 2]).max() < 0.2  # one crack, from the notch
            return most * (frame - 1) / (FRAMES - 1) / griffith
    return np.inf


def test_a_crack_runs_by_the_root_of_the_fracture_energy(tmp_path):
    path = tmp_path / "strip.obj"
    write_strip(path)
    short, long = ([strain_that_splits(path, n * FRAGMENT, seed) for seed in range(SHOTS)] for n in (4, 8))
    power = 0.5 + np.log(np.mean(long) / np.mean(short)) / np.log(2)
    print(f"\nstrain over Griffith's: {np.round(short, 2)} with L of 4 fragments, {np.round(long, 2)} with 8; power {power:.2f}")
    assert power == pytest.approx(0.5, abs=0.1)
