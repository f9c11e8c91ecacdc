#!/usr/bin/python3
"""Writes the meshes of the examples: open sheets, which pre-fracture makes as thick as it is told, a beam, and masonry."""
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


def inside(profile, wall):
    """A profile (radius, height) moved inwards, by `wall` from both sides of each corner."""
    def moved(k):
        (r, z), normals = profile[k], []
        for (r0, z0), (r1, z1) in [(profile[i], profile[i + 1]) for i in (k - 1, k) if 0 <= i < len(profile) - 1]:
            length = math.hypot(r1 - r0, z1 - z0)
            normals.append(((z0 - z1) / length, (r1 - r0) / length))
        if r == 0:
            return 0.0, z + wall * math.copysign(1, normals[0][1])
        nr, nz = (sum(n[i] for n in normals) for i in (0, 1))
        scale = wall * len(normals) / (nr * nr + nz * nz)
        return r + scale * nr, z + scale * nz
    return [moved(k) for k in range(len(profile))]


def lathe(outline, hollow=None, n=32):
    """An outline (radius, height) turned about the z axis, on which it begins, below, and ends; so is the hollow in it."""
    points, faces = [], []
    for outline, turned in ((outline, False), (hollow or [], True)):
        rings = []
        for radius, z in outline:
            if radius == 0:
                rings.append([len(points)] * n)
                points.append((0, 0, z))
                continue
            rings.append([len(points) + k for k in range(n)])
            points += [(radius * math.cos(2 * math.pi * k / n), radius * math.sin(2 * math.pi * k / n), z) for k in range(n)]
        for low, high in zip(rings, rings[1:]):
            for k in range(n):
                corners = list(dict.fromkeys((low[k], low[(k + 1) % n], high[(k + 1) % n], high[k])))
                faces.append(tuple(corners[::-1] if turned else corners))
    return points, faces


def can():
    """A drinks can, 66 mm wide and 115 mm high, its wall 0.5 mm thick: one surface outside, one within."""
    profile = [(0.0, 0.005), (0.018, 0.0035), (0.0235, 0.0), (0.0275, 0.002), (0.033, 0.010), (0.033, 0.030), (0.033, 0.050),
               (0.033, 0.070), (0.033, 0.090), (0.033, 0.098), (0.027, 0.110), (0.026, 0.115), (0.025, 0.112), (0.012, 0.112),
               (0.0, 0.112)]
    return lathe(profile, inside(profile, 0.0005))


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


def blocks(xs, ys, zs, is_filled):
    """The solid of those blocks between the planes xs, ys, zs that are filled: block (i, j, k) is filled where is_filled(i, j, k)."""
    sizes = len(xs) - 1, len(ys) - 1, len(zs) - 1
    points, faces, numbers = [], [], {}

    def filled(block):
        return all(0 <= b < n for b, n in zip(block, sizes)) and is_filled(*block)

    def corner(at):
        if at not in numbers:
            numbers[at] = len(points)
            points.append((xs[at[0]], ys[at[1]], zs[at[2]]))
        return numbers[at]

    for block in [(i, j, k) for i in range(sizes[0]) for j in range(sizes[1]) for k in range(sizes[2])]:
        if not filled(block):
            continue
        for axis in range(3):
            for side in (0, 1):
                beside = tuple(b + (2 * side - 1) * (a == axis) for a, b in enumerate(block))
                if filled(beside):
                    continue
                u, v = (axis + 1) % 3, (axis + 2) % 3
                round_it = ((0, 0), (1, 0), (1, 1), (0, 1)) if side else ((0, 0), (0, 1), (1, 1), (1, 0))
                face = []
                for du, dv in round_it:
                    at = list(block)
                    at[axis] += side
                    at[u] += du
                    at[v] += dv
                    face.append(corner(tuple(at)))
                faces.append(tuple(face))
    return points, faces


def wall():
    """6 x 3 m, 0.25 m thick, with a door and a window."""
    holes = {(1, 0), (1, 1), (3, 1)}
    return blocks((0, 1.0, 1.9, 3.2, 4.6, 6.0), (0, 0.25), (0, 1.0, 2.1, 3.0), lambda i, j, k: (i, k) not in holes)


def frame():
    """Two storeys of 4 x 4 m: slabs 0.3 m thick on four columns each, 0.4 m wide and 2.4 m high."""
    planes = (0, 0.4, 3.6, 4.0)
    return blocks(planes, planes, (0, 2.4, 2.7, 5.1, 5.4), lambda i, j, k: k in (1, 3) or (i != 1 and j != 1))


def arm():
    """A round column, 2 m high and 0.3 m wide, its ends fans."""
    sides, rings = 16, 17
    points = [(0.15 * math.cos(2 * math.pi * i / sides), 0.15 * math.sin(2 * math.pi * i / sides), 2 * k / (rings - 1))
              for k in range(rings) for i in range(sides)] + [(0, 0, 0), (0, 0, 2)]
    at = lambda k, i: k * sides + i % sides
    faces = [(at(k, i), at(k, i + 1), at(k + 1, i + 1), at(k + 1, i)) for k in range(rings - 1) for i in range(sides)]
    faces += [(at(0, i + 1), at(0, i), len(points) - 2) for i in range(sides)]
    faces += [(at(rings - 1, i), at(rings - 1, i + 1), len(points) - 1) for i in range(sides)]
    order = list(dict.fromkeys(i for face in faces for i in face))  # so are the vertices of an OBJ file numbered when it is read
    number = {old: new for new, old in enumerate(order)}
    return [points[i] for i in order], [tuple(number[i] for i in face) for face in faces]


def arm_motion(points, frames=24):
    """Where the arm's vertices are, frame after frame: it bends back and then swings forward, as a rig would have it."""
    def place(x, y, z, frame):
        swing = (frame - 1) / 8
        curvature = -0.5 * math.sin(math.pi * swing) if swing < 1.5 else 0.5 - 1.2 * (swing - 1.5) ** 2
        if abs(curvature) < 1e-6:
            return x, y, 0.3 + z
        angle = curvature * z
        return ((1 - math.cos(angle)) / curvature + x * math.cos(angle), y,
                0.3 + math.sin(angle) / curvature - x * math.sin(angle))
    return [[[round(c, 5) for c in place(*p, frame)] for p in points] for frame in range(1, frames + 1)]


def write_motion(name, places):
    """The same for a `follow` node, as numpy saves it."""
    import numpy as np
    np.save(HERE / (name + ".npy"), np.array(places, np.float32))


def arc(radius, height, first, last, n, middle=0.0):
    """Corners (radius, height) of a circle about (middle, height), from one angle above the horizon to another, degrees."""
    angles = (math.radians(first + (last - first) * i / n) for i in range(n + 1))
    return [(middle + radius * math.cos(a), height + radius * math.sin(a)) for a in angles]


def pawn():
    """Of a chess board, 2 m high, solid."""
    profile = [(0, 0), (0.5, 0), *arc(0.09, 0.09, -60, 60, 4, 0.45), (0.43, 0.22), (0.43, 0.3), (0.36, 0.36), (0.26, 0.5), (0.19, 0.75),
               (0.165, 1.0), (0.16, 1.2), (0.2, 1.32), (0.32, 1.38), (0.32, 1.43), (0.2, 1.5), *arc(0.26, 1.74, -60, 75, 9), (0, 2.0)]
    return lathe(profile, n=24)


def vase():
    """0.42 m high, its wall 9 mm thick, open above."""
    profile = [(0, 0), (0.075, 0), (0.085, 0.015), (0.118, 0.08), (0.132, 0.15), (0.122, 0.22), (0.088, 0.285), (0.056, 0.33), (0.05, 0.36),
               (0.06, 0.395), (0.08, 0.42)]
    return lathe(profile + inside(profile, 0.009)[::-1])


def tank():
    """A pressure vessel, 1.5 m high and 0.7 m wide, its wall 25 mm thick."""
    profile = [(0, 0), *arc(0.35, 0.35, -75, 0, 5), (0.35, 0.56), (0.35, 0.75), (0.35, 0.94), *arc(0.35, 1.15, 0, 75, 5), (0, 1.5)]
    return lathe(profile, inside(profile, 0.025), n=24)


def arch():
    """Of masonry: 3 m wide and 2.4 m high, 0.8 m deep, 0.5 m thick, on piers of 0.9 m."""
    angles = [math.pi * i / 16 for i in range(17)]
    line = [(1, 0, z) for z in (0, 0.3, 0.6)] + [(math.cos(a), math.sin(a), 0.9) for a in angles] + [(-1, 0, z) for z in (0.6, 0.3, 0)]
    points = [(r * x, y, z + r * up) for x, up, z in line for r, y in ((1, -0.4), (1.5, -0.4), (1.5, 0.4), (1, 0.4))]
    faces = [(4 * i + a, 4 * i + (a + 1) % 4, 4 * i + 4 + (a + 1) % 4, 4 * i + 4 + a) for i in range(len(line) - 1) for a in range(4)]
    last = len(points) - 4
    return points, [*faces, (3, 2, 1, 0), (last, last + 1, last + 2, last + 3)]


def bridge():
    """12 m long and 2.4 m wide, with parapets, on two pillars 3 m high."""
    return blocks((0, 1.2, 2, 10, 10.8, 12), (0, 0.25, 0.6, 1.8, 2.15, 2.4), (0, 3, 3.45, 4), lambda i, j, k: (
        i in (1, 3) and j in (1, 2, 3) if k == 0 else k == 1 or j in (0, 4)))


MAKERS = (panel, door, can, roof, beam, wall, frame, arm, pawn, vase, tank, arch, bridge)

if __name__ == "__main__":
    for make in MAKERS:
        write(make.__name__, *make())
    write_motion("arm", arm_motion(arm()[0]))
