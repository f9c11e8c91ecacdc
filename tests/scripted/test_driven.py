"""What is driven into a body that pins hold: it is stopped by how stiff that is, and not by how often it is asked."""
import pytest

import sunder


def deepest(frames, substeps, iterations, bar, body, pins, ball):
    """How far the ball comes down in `frames` frames, m, and how fast it leaves, m/s."""
    graph = sunder.Graph.from_dict({"sunder": 2, "frame_rate": 384, "frame_range": [1, frames], "nodes": {
        "bar": {"type": "lattice", **bar}, "body": {"type": "body", "fragments": "@bar.fragments", **body},
        **{f"pin{k}": {"type": "pin", "body": "@body.body", "box_min": least, "box_max": most} for k, (least, most) in enumerate(pins)},
        "ball": {"type": "rigid_body", "shape": "sphere", "position": [0.01, 0.02, ball["radius"] + bar["size"][2] / 2 + 0.01], **ball},
        "sim": {"type": "solver", "bodies": ["@body.body"], "pins": [f"@pin{k}.pin" for k in range(len(pins))],
                "rigid_bodies": ["@ball.rigid_body"], "gravity": [0, 0, 0], "substeps": substeps, "iterations": iterations}}})
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
        assert abs(found[0] / way - 1) < 0.02 and abs(found[1] / speed - 1) < 0.06, (iterations, found, way, speed)


def test_so_does_a_beam():
    """An elastic beam, four cells across, that 90 kg hit at 4 m/s."""
    ways = [deepest(60, 4, iterations, {"size": [1.2, 0.2, 0.2], "cells": [24, 4, 4]}, {"density": 700, "youngs_modulus": 5e7, "yield": None},
                    [([-1, -1, -1], [-0.5, 1, 1]), ([0.5, -1, -1], [1, 1, 1])], {"radius": 0.15, "mass": 90, "velocity": [0, 0, -4]})[0]
            for iterations in (2, 4, 8)]
    assert max(ways) < 1.01 * min(ways), ways
