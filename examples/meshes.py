#!/usr/bin/python3
"""Writes the meshes of the examples: open sheets, which pre-fracture makes as thick as it is told, and one beam."""
import math
from pathlib import Path

HERE = Path(__file__).parent


def write(name, points, faces):
    with open(HERE / (name + ".obj"), "w", encoding="ascii") as file:
        for point in points:
            file.write("v %.5f %.5f %.5f\n" % tuple(point))
        for face in faces:
            file.write("f " + " ".join(str(i + 1) for i in face) + "\n")


def grid(n, m, place, leave_out=lambda i, j: False):
    """n x m quads: corner (i, j) lies at place(i / n, j / m)."""
    points = [place(i / n, j / m) for j in range(m + 1) for i in range(n + 1)]
    at = lambda i, j: j * (n + 1) + i
    faces = [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))
             for j in range(m) for i in range(n) if not leave_out(i, j)]
    return points, faces


def panel():
    """1.2 x 1 m."""
    return grid(12, 10, lambda u, v: (1.2 * u - 0.6, v - 0.5, 0))


def door():
    """The skin of a car door, 1 x 0.6 m, bulging by 6 cm, with a crease along it and its rim folded inwards."""
    def place(u, v):
        x, z = 1.04 * u - 0.52, 0.64 * v - 0.32
        bulge = 0.06 * (1 - (2 * v - 1) ** 2) + 0.012 * max(0.0, 1 - abs(v - 0.6) / 0.1)
        rim = max(abs(x) - 0.5, abs(z) - 0.3)
        if rim > 0:
            x, z, bulge = max(-0.5, min(0.5, x)), max(-0.3, min(0.3, z)), -0.03
        return x, -bulge, z
    return grid(26, 16, place)


def can():
    """A drinks can, 66 mm wide and 115 mm high, its wall 0.5 mm thick: one surface outside, one within."""
    profile = [(0.0, 0.005), (0.018, 0.0035), (0.0235, 0.0), (0.0275, 0.002), (0.033, 0.010), (0.033, 0.030), (0.033, 0.050),
               (0.033, 0.070), (0.033, 0.090), (0.033, 0.098), (0.027, 0.110), (0.026, 0.115), (0.025, 0.112), (0.012, 0.112),
               (0.0, 0.112)]

    def inner(k, wall=0.0005):
        """The corner k of the profile moved inwards, by `wall` from both its sides."""
        (r, z), normals = profile[k], []
        for (r0, z0), (r1, z1) in [(profile[i], profile[i + 1]) for i in (k - 1, k) if 0 <= i < len(profile) - 1]:
            length = math.hypot(r1 - r0, z1 - z0)
            normals.append(((z0 - z1) / length, (r1 - r0) / length))
        if r == 0:
            return 0.0, z + wall * math.copysign(1, normals[0][1])
        nr, nz = (sum(n[i] for n in normals) for i in (0, 1))
        scale = wall * len(normals) / (nr * nr + nz * nz)
        return r + scale * nr, z + scale * nz

    n, points, faces = 32, [], []
    for outline, turned in ((profile, False), ([inner(k) for k in range(len(profile))], True)):
        rings = []
        for radius, z in outline:
            if radius == 0:
                rings.append([len(points)] * n)
                points.append((0, 0, z))
                continue
            rings.append([len(points) + k for k in range(n)])
            points += [(radius * math.cos(2 * math.pi * k / n), radius * math.sin(2 * math.pi * k / n), z)
                       for k in range(n)]
        for low, high in zip(rings, rings[1:]):
            for k in range(n):
                corners = list(dict.fromkeys((low[k], low[(k + 1) % n], high[(k + 1) % n], high[k])))
                faces.append(tuple(corners[::-1] if turned else corners))
    return points, faces


def roof():
    """Sheet with ribs, 3 x 2 m: 6 cm high, one every 50 cm."""
    def place(u, v):
        at = round(48 * u) % 8
        rib = min(max(2 - abs(at - 4), 0.0), 1.0)
        return 3 * u - 1.5, 2 * v - 1, 0.06 * rib
    return grid(48, 24, place)


def beam():
    """A rolled I-section, 0.2 m high and 0.1 m wide, flanges 12 mm, web 8 mm, 1.6 m long."""
    w, h, f, t = 0.05, 0.1, 0.012, 0.004
    outline = [(-w, -h), (w, -h), (w, -h + f), (t, -h + f), (t, h - f), (w, h - f), (w, h), (-w, h), (-w, h - f), (-t, h - f),
               (-t, -h + f), (-w, -h + f)]
    n, k = len(outline), 16
    points = [(1.6 * i / k - 0.8, y, z) for i in range(k + 1) for y, z in outline]
    faces = [(i * n + a, i * n + (a + 1) % n, (i + 1) * n + (a + 1) % n, (i + 1) * n + a) for i in range(k) for a in range(n)]
    for first, turned in ((0, True), (k * n, False)):
        for part in ((0, 1, 2, 3, 10, 11), (3, 4, 9, 10), (4, 5, 6, 7, 8, 9)):
            corners = [first + a for a in part]
            faces.append(tuple(corners[::-1] if turned else corners))
    return points, faces


if __name__ == "__main__":
    for make in (panel, door, can, roof, beam):
        write(make.__name__, *make())
