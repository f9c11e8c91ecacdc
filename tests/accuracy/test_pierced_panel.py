"""A ball through the panel of examples/panel.json: the tougher the sheet, the slower it comes out; and petals.

Rounding decides which edge breaks first: each number is the median of shots whose balls lie nanometres apart."""
from pathlib import Path

import numpy as np
import pytest

import sunder

EXAMPLES = Path(__file__).parents[2] / "examples"
TOUGHNESSES = (0.005, 0.01, 0.016, 0.04)
SHOTS = 15
BENT = 30  # degrees; what stands so steep has been bent out of the sheet, which dishes by 26 at most


def panel(toughness, shot):
    """State of frame 4, when the ball has come through or turned (at 40 m/s 0.83 m a frame)."""
    graph = sunder.Graph.load(str(EXAMPLES / "panel.json"))
    graph["body"]["toughness"] = toughness
    x, y, z = graph["ball"]["position"]
    graph["ball"]["position"] = [x + shot * 1e-9, y, z]
    return graph.evaluate("solver.state", frame=4)


def through(state):
    """Speed of the ball beyond the panel, m/s; 0 where it is held up or thrown back."""
    return max(0.0, -state.rigid_velocity[0][2])


def petals(state):
    """Sizes of the connected parts of the panel, in fragments, that hang on it and are bent out of it."""
    normal = state.particle_transform[:, :, 2]
    steep = np.abs(normal[:, 2]) < np.cos(np.radians(BENT)) * np.linalg.norm(normal, axis=1)
    hangs_on = state.piece == np.bincount(state.piece).argmax()
    bent = steep & hangs_on
    part = np.arange(len(bent))
    edges = state.edges[(state.edge_intact > 0) & bent[state.edges].all(axis=1)]
    for _ in range(len(bent)):
        least = part[edges].min(axis=1)
        before = part.copy()
        np.minimum.at(part, edges.ravel(), np.repeat(least, 2))
        if (part == before).all():
            break
    return np.unique(part[bent], return_counts=True)[1]


def medians(states, number):
    return [np.median([number(state) for state in states[toughness]]) for toughness in TOUGHNESSES]


@pytest.fixture(scope="module")
def shots():
    states = {toughness: [panel(toughness, shot) for shot in range(SHOTS)] for toughness in TOUGHNESSES}
    print()
    for toughness, of in states.items():
        print(f"toughness {toughness}: out at {np.median([through(s) for s in of]):.1f} m/s of 40, "
              f"{np.median([np.count_nonzero(s.edge_intact == 0) for s in of]):.0f} edges broken, "
              f"{np.median([np.count_nonzero(np.bincount(s.piece) == 1) for s in of]):.0f} single fragments, "
              f"petals: {sorted(len(petals(s)) for s in of)}")
    return states


def test_the_tougher_the_slower(shots):
    speeds = medians(shots, through)
    fall = 0.2  # m/s: what the ball falls by in a frame
    assert 40 > speeds[0] and speeds[-1] < fall
    assert all(tougher < weaker + fall for weaker, tougher in zip(speeds, speeds[1:]))
    assert speeds[0] - speeds[1] > 5


@pytest.mark.xfail(strict=True, reason="five, seven, and nine at a toughness of 0.016, eight to ten in all (docs/measurements.md)")
def test_four_to_eight_petals_stay_on_where_it_comes_through(shots):
    speeds, numbers = medians(shots, through), medians(shots, lambda state: len(petals(state)))
    assert all(4 <= number <= 8 for speed, number in zip(speeds, numbers) if speed > 5)
