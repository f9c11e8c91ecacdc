"""A solid ball falls on a floor: how it breaks hangs on its fracture energy, and not on how finely it is cut.

Load is the strain of the hit over the toughness, v / (c tau). Shots differ by the cut's seed.
"""
import importlib.util
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

import sunder

RADIUS, DENSITY, STIFFNESS, SPEED = 0.5, 2000.0, 1e8, 10.0  # m, kg/m3, Pa, m/s
SHOTS = 16
LARGE = 0.02  # of the mass
# The least load at which the largest piece of 3000 fragments has under 0.9 of the mass: between 5.5, where it has 1.00 in the
# mean of four shots, and 6, where it has 0.67 in the mean of eight.
CRITICAL = 5.7

spec = importlib.util.spec_from_file_location("test_cracks", Path(__file__).parents[1] / "scripted/test_cracks.py")
cracks = importlib.util.module_from_spec(spec)
spec.loader.exec_module(cracks)


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    path = tmp_path_factory.mktemp("ball") / "ball.obj"
    cracks.write_ball(path, radius=RADIUS)
    return str(path)


class Broken:
    """A tenth of a second after the hit."""

    def __init__(self, path, pieces, seed, toughness, fracture_energy="auto", speed=SPEED):
        graph = sunder.Graph.from_dict({"sunder": 2, "frame_rate": 24, "frame_range": [1, 4], "nodes": {
            "mesh": {"type": "mesh_file", "path": path},
            "cut": {"type": "prefracture", "mesh": "@mesh.mesh", "pieces": pieces, "clusters": 0, "seed": seed},
            "body": {"type": "body", "fragments": "@cut.fragments", "density": DENSITY, "youngs_modulus": STIFFNESS,
                     "poisson_ratio": 0.2, "toughness": toughness, "fracture_energy": fracture_energy,
                     "position": [0, 0, 0.52], "velocity": [0, 0, -speed]},
            "floor": {"type": "collider", "shape": "plane"},
            "solver": {"type": "solver", "preset": "final", "bodies": ["@body.body"], "colliders": ["@floor.collider"]}}})
        state, cut = graph.evaluate("solver.state", frame=4), graph.evaluate("cut.fragments")
        mass = np.bincount(state.piece, state.mass) / np.sum(state.mass)
        ends = state.piece[cut.edges]
        parted = ends[:, 0] != ends[:, 1]
        wedges = parted & (mass[ends] >= LARGE).all(axis=1)
        self.masses = np.sort(mass)[::-1]
        self.largest = self.masses[0]
        self.n_large = np.count_nonzero(mass >= LARGE)
        self.area = np.sum(cut.interface_area[parted])  # m2
        # Of the mean normal of the crack between two large pieces, against what is at right angles to the line of the hit;
        # the mean of all such cracks by area, degrees.
        ordered = np.sort(ends[wedges], axis=1)
        vector = cut.interface_area[wedges, None] * cut.interface_normal[wedges]
        vector[ends[wedges][:, 0] != ordered[:, 0]] *= -1
        _, crack = np.unique(ordered, axis=0, return_inverse=True)
        normal = np.stack([np.bincount(crack.ravel(), vector[:, k]) for k in range(3)], 1) if len(vector) else np.zeros((0, 3))
        area = np.linalg.norm(normal, axis=1)
        tilts = np.degrees(np.arcsin(np.abs(normal[:, 2]) / np.maximum(area, 1e-12)))
        self.tilt = np.sum(area * tilts) / np.sum(area) if np.sum(area) > 0 else 90.0


def toughness_of(load):
    return SPEED / ((STIFFNESS / DENSITY)**0.5 * load)


@lru_cache(maxsize=None)
def shots(path, pieces, load, n=SHOTS):
    made = [Broken(path, pieces, seed, toughness_of(load)) for seed in range(n)]
    print(f"{pieces} fragments, load {load:.1f}: largest {np.mean([s.largest for s in made]):.2f}, "
          f"{np.mean([s.n_large for s in made]):.1f} large pieces, {np.mean([s.area for s in made]):.2f} m2, "
          f"tilt {np.mean([s.tilt for s in made]):.0f} degrees")
    return made


@pytest.mark.parametrize("over", [1.2, 1.5, 2])
@pytest.mark.parametrize("pieces, tolerance", [(1000, 0.25), (300, 0.5)])
def test_it_parts_by_the_same_area_however_finely_it_is_cut(ball, pieces, tolerance, over):
    fine = np.mean([s.area for s in shots(ball, 3000, CRITICAL * over)])
    assert np.mean([s.area for s in shots(ball, pieces, CRITICAL * over)]) == pytest.approx(fine, rel=tolerance)


@pytest.mark.parametrize("over", [1.2, 1.5, 2])
@pytest.mark.parametrize("pieces, tolerance", [(1000, 0.25), (300, 0.5)])
def test_and_into_as_many_large_pieces(ball, pieces, tolerance, over):
    fine = np.mean([s.n_large for s in shots(ball, 3000, CRITICAL * over)])
    assert np.mean([s.n_large for s in shots(ball, pieces, CRITICAL * over)]) == pytest.approx(fine, rel=tolerance)


def test_the_harder_the_smaller_is_the_largest_piece(ball):
    means = [np.mean([s.largest for s in shots(ball, 1000, load)]) for load in (6, 7, 8.5, 10, 12)]
    assert all(harder < softer for softer, harder in zip(means, means[1:]))


def test_just_above_its_critical_speed_it_splits_into_wedges(ball):
    made = shots(ball, 3000, CRITICAL * 1.05, 8)
    assert sum(2 <= s.n_large <= 6 and s.tilt < 25 for s in made) >= 5


@pytest.mark.xfail(strict=True, reason="1.24 of 224 pieces of six shots: pieces of a few fragments are too few")
def test_masses_of_smaller_pieces_follow_a_power_law(ball):
    """Density n(m) ~ m^-exponent of 3000 fragments over a decade and a half, from two fragments on, by maximum likelihood."""
    masses = np.concatenate([s.masses[1:] for s in shots(ball, 3000, CRITICAL * 1.5)])
    least = 2 / 3000
    counted = masses[(masses >= least) & (masses < 10**1.5 * least)]
    exponents = np.linspace(1.01, 3, 200)
    likelihood = [np.log((e - 1) / (least**(1 - e) - (10**1.5 * least)**(1 - e))) * len(counted) - e * np.sum(np.log(counted))
                  for e in exponents]
    found = exponents[np.argmax(likelihood)]
    print(f"exponent {found:.2f} of {len(counted)} pieces")
    assert 1.5 < found < 2.1


def critical_speed(path, toughness, fracture_energy):
    """m/s at which the largest piece of 1000 fragments has 0.9 of the mass, in the mean of four shots; by bisection, to 3 %."""
    low, high = 2.0, 60.0
    while high > 1.03 * low:
        speed = (low * high)**0.5
        made = [Broken(path, 1000, seed, toughness, fracture_energy, speed).largest for seed in range(4)]
        low, high = (low, speed) if np.mean(made) < 0.9 else (speed, high)
    return (low * high)**0.5


@pytest.mark.xfail(strict=True, reason="0.27; half of the toughness moves it by 24 %: L is as long as the ball's radius (docs/lab/cracks.md)")
def test_the_critical_speed_goes_by_the_root_of_the_fracture_energy(ball):
    """Griffith: v ~ (G_c / (rho R))^0.5 where L is above four fragments, whatever the toughness."""
    toughness, opening = 0.0034, 0.35  # m; four fragments are 0.32 m
    energy = STIFFNESS * toughness**2 * opening / 2
    speeds = [critical_speed(ball, toughness, factor * energy) for factor in (1, 4)]
    halved = critical_speed(ball, toughness / 2, energy)
    print(f"critical at {speeds[0]:.1f} m/s, {speeds[1]:.1f} with four times the energy, {halved:.1f} with half of the toughness")
    assert np.log(speeds[1] / speeds[0]) / np.log(4) == pytest.approx(0.5, abs=0.1)
    assert halved == pytest.approx(speeds[0], rel=0.15)
