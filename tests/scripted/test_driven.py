"""What is driven into a body that pins hold: it is stopped by how stiff that is, and not by how often it is asked."""
import numpy as np
import pytest

import sunder


def shot(bar, body, pins, ball, frame_rate, substeps, iterations):
    """A ball, or a box, and a lattice that pins hold; without gravity."""
    return sunder.Graph.from_dict({"sunder": 2, "frame_rate": frame_rate, "frame_range": [1, 100], "nodes": {
        "bar": {"type": "lattice", **bar}, "body": {"type": "body", "fragments": "@bar.fragments", **body},
        **{f"pin{k}": {"type": "pin", "body": "@body.body", "box_min": least, "box_max": most} for k, (least, most) in enumerate(pins)},
        "ball": {"type": "rigid_body", "shape": "sphere", **ball},
        "sim": {"type": "solver", "bodies": ["@body.body"], "pins": [f"@pin{k}.pin" for k in range(len(pins))],
                "rigid_bodies": ["@ball.rigid_body"], "gravity": [0, 0, 0], "substeps": substeps, "iterations": iterations}}})


def deepest(frames, substeps, iterations, bar, body, pins, ball):
    """How far the ball comes down in `frames` frames, m, and how fast it leaves, m/s."""
    start = [0.01, 0.02, ball["radius"] + bar["size"][2] / 2 + 0.01]
    graph = shot(bar, body, pins, {"position": start, **ball}, frame_rate=384, substeps=substeps, iterations=iterations)
    states = [graph.evaluate("sim.state", frame=frame) for frame in range(1, frames + 1)]
    ways = [state.rigid_position[0][2] - states[0].rigid_position[0][2] for state in states]
    return -min(ways), max(state.rigid_velocity[0][2] for state in states)


def sheet(iterations, **changes):
    """A sheet of steel of 1 m and 1.5 mm, held at its four sides, hit by 20 kg at 5 m/s."""
    body = {"density": 7800, "youngs_modulus": 2e11, "poisson_ratio": 0.3, "yield": None, **changes}
    sides = [([-1, -1, -1], [-0.45, 1, 1]), ([0.45, -1, -1], [1, 1, 1]), ([-1, -1, -1], [1, -0.45, 1]), ([-1, 0.45, -1], [1, 1, 1])]
    return deepest(40, 8, iterations, {"size": [1, 1, 0.0015], "cells": [16, 16, 1]}, body, sides,
                   {"radius": 0.1, "mass": 20, "velocity": [0, 0, -5]})


@pytest.mark.parametrize("body", [{"youngs_modulus": 2e10}, {}, {"yield": 0.0012, "flow_rate": 1e5}], ids=["softer", "steel", "yields"])
def test_a_sheet_stops_a_ball_in_as_much_with_any_number_of_iterations(body):
    way, speed = sheet(8, **body)
    for iterations in (2, 4):
        found = sheet(iterations, **body)
        # Here at most 0.3 and 3 %; by turns up to 46 and 44 %.
        assert abs(found[0] / way - 1) < 0.01 and abs(found[1] / speed - 1) < 0.04, (iterations, found, way, speed)


def test_so_does_a_beam():
    """An elastic beam, four cells across, that 90 kg hit at 4 m/s."""
    ways = [deepest(60, 4, iterations, {"size": [1.2, 0.2, 0.2], "cells": [24, 4, 4]}, {"density": 700, "youngs_modulus": 5e7, "yield": None},
                    [([-1, -1, -1], [-0.5, 1, 1]), ([0.5, -1, -1], [1, 1, 1])], {"radius": 0.15, "mass": 90, "velocity": [0, 0, -4]})[0]
            for iterations in (2, 4, 8)]
    assert max(ways) < 1.01 * min(ways), ways


def energies(graph, frames, mass, ball_mass, inertia):
    """Of motion, of the ball and of the body, over that of the first frame."""
    found = []
    for frame in range(1, frames + 1):
        state = graph.evaluate("sim.state", frame=frame)
        turning = inertia * np.sum(np.square(state.rigid_angular_velocity[0]))
        ball = ball_mass * np.sum(np.square(state.rigid_velocity[0])) + turning
        found.append((ball, mass / len(state.position) * np.sum(np.square(state.velocity))))
    return np.array(found) / sum(found[0])


def test_a_load_that_comes_to_touch_what_is_pinned_is_borne_on():
    """A ball in the dent that it made in an elastic sheet of 22 kg, beside a pin."""
    graph = shot({"size": [1, 1, 0.0028], "cells": [8, 8, 1]},
                 {"density": 7800, "youngs_modulus": 6.7e10, "poisson_ratio": 0.3, "yield": 0.042, "friction": 1},
                 [([-9, -9, -9], [-0.4, 9, 9]), ([0.4, -9, -9], [9, 9, 9])],
                 {"radius": 0.15, "mass": 1.1e5, "position": [0.3046, -0.0642, 0.1564], "velocity": [-0.0037, 0, -0.0867]},
                 frame_rate=12, substeps=4, iterations=2)
    both = energies(graph, 25, 22, 1.1e5, 0.4 * 1.1e5 * 0.15 ** 2)
    assert both.sum(axis=1).max() < 1.001 and 0.6 < both[-1, 0] < 0.8, both[:, 0]  # by 8 iterations 0.71


def test_what_swings_away_from_a_load_takes_none_of_it_along():
    """A soft sheet of 1 kg that hangs on one side, pushed by a box at 0.1 m/s."""
    graph = shot({"size": [1, 1, 0.0012], "cells": [8, 8, 1]},
                 {"density": 1000, "youngs_modulus": 1.3e6, "poisson_ratio": 0.3, "yield": None, "friction": 1}, [([-9, -9, -9], [-0.4, 9, 9])],
                 {"shape": "box", "size": [0.3, 0.3, 0.3], "mass": 68, "position": [0.128, -0.0595, 0.1556], "velocity": [-0.0068, 0, -0.1073],
                  "friction": 0, "restitution": 0.5}, frame_rate=12, substeps=64, iterations=1)
    assert energies(graph, 25, 1.2, 68, 68 * 0.3 ** 2 / 6).sum(axis=1).max() < 1.2


def test_what_is_squeezed_against_the_floor_is_not_pressed_into_it():
    """A stiff block that pins lower by 3 cm on a box of 8 kg, which gives way sideways."""
    graph = sunder.Graph.from_dict({"sunder": 2, "frame_rate": 24, "frame_range": [1, 36], "nodes": {
        "block": {"type": "lattice", "size": [0.6, 0.6, 0.3], "cells": [6, 6, 3], "center": [0, 0, 0.36]},
        "body": {"type": "body", "fragments": "@block.fragments", "density": 1000, "youngs_modulus": 1e10},
        "top": {"type": "pin", "body": "@body.body", "box_min": [-9, -9, 0.45], "box_max": [9, 9, 9],
                "position": {"keys": [[1, [0, 0, 0]], [24, [0, 0, -0.03]]], "interpolation": "linear"}},
        "box": {"type": "rigid_body", "shape": "box", "size": [0.2, 0.2, 0.2], "mass": 8, "position": [0, 0, 0.1], "friction": 0.5},
        "floor": {"type": "collider", "shape": "plane"},
        "sim": {"type": "solver", "bodies": ["@body.body"], "pins": ["@top.pin"], "rigid_bodies": ["@box.rigid_body"], "colliders": ["@floor.collider"],
                "substeps": 8, "iterations": 2}}})
    least = min(graph.evaluate("sim.state", frame=frame).rigid_position[0][2] for frame in range(1, 37))
    assert 0.1 - least < 0.005, least
