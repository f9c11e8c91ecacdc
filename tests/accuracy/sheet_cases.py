"""What the measured sheets share: meshes of open surfaces, steel, the law's yield stress."""
import math

import numpy as np

YOUNGS_MODULUS, POISSON_RATIO, DENSITY = 2e11, 0.3, 7800  # steel


def yield_stress(strain):
    """Of Sunder's law in uniaxial tension, Pa: its largest principal deviator is the yield strain."""
    return 1.5 * YOUNGS_MODULUS * strain / (1 + POISSON_RATIO)


def steel(fragments, strain):
    """A body without hardening or fracture, whose flow lags behind by no more than a substep."""
    return {"type": "body", "fragments": fragments, "density": DENSITY, "youngs_modulus": YOUNGS_MODULUS,
            "poisson_ratio": POISSON_RATIO, "yield": strain, "flow_rate": 2e4, "friction": 0.0, "hardening": 0.0, "toughness": None}


def write_ply(path, points, faces, **attributes):
    """attributes: a number for each point."""
    columns = "".join(f"property float {name}\n" for name in ("x", "y", "z", *attributes))
    with open(path, "w", encoding="ascii") as file:
        file.write(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n{columns}"
                   f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
        for row in np.column_stack([points, *attributes.values()]):
            file.write(" ".join(f"{x:.7g}" for x in row) + "\n")
        for face in faces:
            file.write(" ".join(map(str, (len(face), *face))) + "\n")


def disc(radius, around=96, rings=8):
    """A flat disc, facing up, numbered from the middle outwards; the vertices of its rim."""
    angles = 2 * math.pi * np.arange(around) / around
    points = [(0, 0, 0)] + [(radius * r / rings * math.cos(a), radius * r / rings * math.sin(a), 0)
                            for r in range(1, rings + 1) for a in angles]

    def at(r, k):
        return 1 + (r - 1) * around + k % around
    faces = [(0, at(1, k), at(1, k + 1)) for k in range(around)]
    faces += [(at(r, k), at(r + 1, k), at(r + 1, k + 1), at(r, k + 1)) for r in range(1, rings) for k in range(around)]
    return points, faces, [at(rings, k) for k in range(around)]


def tube(radius, bottom, top, along, around=64):
    """An open tube about z, facing outwards, `along` quads high."""
    angles = 2 * math.pi * np.arange(around) / around
    points = [(radius * math.cos(a), radius * math.sin(a), bottom + (top - bottom) * j / along) for j in range(along + 1) for a in angles]

    def at(k, j):
        return j * around + k % around
    return points, [(at(k, j), at(k + 1, j), at(k + 1, j + 1), at(k, j + 1)) for j in range(along) for k in range(around)]
