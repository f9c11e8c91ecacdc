"""A thin tube crushed along its axis, against Alexander (1960): mean force 6 s_y t^1.5 D^0.5, one fold per 1.9 (D t)^0.5.

Both ends are clamped, and the upper one is driven. The tube stands on a length of itself that does not yield (`yield_map`), whose
shortening tells the force: E times section times strain.
"""
import math

import numpy as np
import pytest
import sheet_cases

import sunder

DIAMETER, LENGTH, RINGS, GAUGE = 0.1, 0.12, 32, 8  # m; rings of fragments along the tube, and of what it stands on
RATE = 240
RING = LENGTH / RINGS  # 3.75 mm; half a fold is 13 to 19 mm
BAR = 0.3  # asked for


class CrushedTube:
    """Crushed by `crush` m at `speed` m/s."""

    def __init__(self, folder, thickness, strain, crush, speed, substeps=32):
        self.thickness, self.crush, self.frames = thickness, crush, math.ceil(crush / speed * RATE)
        bottom, top, rings = -GAUGE * RING, LENGTH + RING, RINGS + GAUGE + 1
        points, faces = sheet_cases.tube((DIAMETER + thickness) / 2, bottom, top, rings)
        # A hundred times: enough, and the tube's lowest ring, which reads a little of it, is 1.13 times as strong.
        sheet_cases.write_ply(folder / "tube.ply", points, faces, strength=[100 if z < -1e-9 else 1 for _, _, z in points])
        around = round(math.pi * DIAMETER / RING)
        sites = [[DIAMETER / 2 * math.cos(a), DIAMETER / 2 * math.sin(a), bottom + (j + 0.5) * RING]
                 for j in range(rings) for a in 2 * math.pi / around * (np.arange(around) + 0.5 * (j % 2))]
        down = {"keys": [[1, [0, 0, 0]], [1 + self.frames, [0, 0, -crush]]]}
        self.graph = sunder.Graph.from_dict({"sunder": 2, "frame_rate": RATE, "frame_range": [1, 1000], "nodes": {
            "mesh": {"type": "mesh_file", "path": "tube.ply"},
            "cut": {"type": "prefracture", "mesh": "@mesh.mesh", "sites": "points", "points": sites, "thickness": thickness,
                    "yield_map": "strength"},
            "body": {**sheet_cases.steel("@cut.fragments", strain), "flow_rate": 1e5},
            "foot": {"type": "pin", "body": "@body.body", "box_min": [-1, -1, -1], "box_max": [1, 1, bottom + 0.99 * RING]},
            "lid": {"type": "pin", "body": "@body.body", "box_min": [-1, -1, LENGTH], "box_max": [1, 1, 1], "position": down},
            "sim": {"type": "solver", "bodies": ["@body.body"], "pins": ["@foot.pin", "@lid.pin"], "gravity": [0, 0, 0],
                    "damping": 20, "substeps": substeps, "iterations": 2, "sleeping": False}}}, base_folder=str(folder))
        self.rest = self.state(1).position.copy()
        height = self.rest[:, 2]
        self.gauge = (height < 0) & (height > bottom + RING)
        self.ring = [np.abs(height - (j + 0.5) * RING) < RING / 4 for j in range(RINGS)]

    def state(self, frame):
        return self.graph.evaluate("sim.state", frame=frame)

    def force(self, frame):
        """That the gauge bears, N."""
        shortened = (self.rest - self.state(frame).position)[self.gauge, 2]
        strain = np.polyfit(self.rest[self.gauge, 2], shortened, 1)[0]
        return sheet_cases.YOUNGS_MODULUS * math.pi * DIAMETER * self.thickness * strain

    def mean_force(self):
        mean = np.mean([self.force(frame) for frame in range(2, self.frames + 2)])
        flowed = self.state(self.frames + 1).plastic_deformation[self.gauge] - np.eye(3)
        assert np.abs(flowed).max() < 1e-5  # the gauge is elastic
        return mean

    def folds(self):
        """Rings that stand out from both of their neighbours towards the ends, by half of the wall at least."""
        place = self.state(self.frames + 1).position
        out = [np.linalg.norm(place[ring, :2], axis=1).mean() for ring in self.ring]
        count, lowest, highest = 0, out[0], -math.inf
        for radius in [*out, DIAMETER / 2]:  # a fold ends where the wall has come back in
            if highest == -math.inf:
                lowest = min(lowest, radius)
                if radius > lowest + self.thickness / 2:
                    highest = radius
            else:
                highest = max(highest, radius)
                if radius < highest - self.thickness / 2:
                    count, lowest, highest = count + 1, radius, -math.inf
        return count


def test_the_gauge_tells_hookes_force(tmp_path):
    tube = CrushedTube(tmp_path, 0.002, 1.0, 2e-5, 0.001)
    free = LENGTH + (GAUGE - 1) * RING
    hooke = sheet_cases.YOUNGS_MODULUS * math.pi * DIAMETER * 0.002 * 2e-5 / free
    print(f"\nforce over Hooke's: {tube.force(tube.frames + 1) / hooke:.3f}")
    assert abs(tube.force(tube.frames + 1) / hooke - 1) < 0.05  # clamps that hinder Poisson's ratio make 2 %


def test_it_yields_by_its_yield_stress(tmp_path):
    """At 0.75 mm: by 1 mm a first fold begins beside the clamp, and the force falls."""
    strain, thickness = 0.0015, 0.002
    tube = CrushedTube(tmp_path, thickness, strain, 0.00075, 0.02)
    squash = math.pi * DIAMETER * thickness * sheet_cases.yield_stress(strain)
    share = tube.force(tube.frames + 1) / squash
    print(f"\nforce at 0.75 mm over section times yield stress: {share:.3f}")
    assert 0.95 < share < 1.1  # of plane strain, where it is clamped, up to 4/3


@pytest.fixture(scope="module", params=[(0.002, 0.0015), (0.004, 0.0015)], ids=lambda case: "t %g, yield %g" % case)
def crushed(request, tmp_path_factory):
    thickness, strain = request.param
    tube = CrushedTube(tmp_path_factory.mktemp("tube"), thickness, strain, 0.5 * LENGTH, 0.2)
    alexander = 6 * sheet_cases.yield_stress(strain) * thickness**1.5 * DIAMETER**0.5
    force, folds = tube.mean_force() / alexander, tube.folds()
    wanted = 0.5 * LENGTH / (1.9 * math.sqrt(DIAMETER * thickness))
    print(f"\nt {thickness} m, yield {strain}: mean force {force * alexander / 1e3:.0f} kN, Alexander {alexander / 1e3:.0f} ({force:.2f}); "
          f"{folds} folds, the last one begun, Alexander {wanted:.1f}")
    return force, folds, wanted


@pytest.mark.xfail(strict=True, reason="a fold is four fragments long, and flow lags behind (docs/measurements.md)")
def test_the_mean_force_is_alexanders(crushed):
    assert abs(crushed[0] - 1) < BAR


def test_it_folds_as_often_as_alexanders(crushed):
    assert math.floor(crushed[2]) <= crushed[1] <= math.ceil(crushed[2])  # the last one has begun
