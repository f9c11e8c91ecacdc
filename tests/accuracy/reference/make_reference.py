#!/usr/bin/env python3
"""Makes the continuum references of tests/accuracy (tests/data/reference/*.csv) with CalculiX.

    make_reference.py [--mesh N] [--output FOLDER] [NAME ...]

Needs numpy and ccx (Debian: calculix-ccx). N is the number of elements across the bar (4: seconds to a minute a case);
discs take some minutes each, whatever N is.
NAME picks cases by the beginning of their file names.
"""
import argparse
import pathlib
import time

import numpy as np

import calculix
import pressed_disc
from calculix import BarMesh, LENGTH, Z_END

HEAD = np.array((0, 0, Z_END))  # centre of the upper end face
LATTICES = (4, 6, 8)            # particles across the bar


def rotation(axis, angle):
    """Rotation about coordinate axis 0, 1 or 2 by `angle` rad."""
    c, s = np.cos(angle), np.sin(angle)
    r = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    r[i, i] = r[j, j] = c
    r[i, j], r[j, i] = -s, s
    return r


def stretched(percent):
    return lambda x: x + (0, 0, percent / 100 * LENGTH)


def twisted(degrees):
    r = rotation(2, np.radians(degrees))
    return lambda x: x @ r.T


def bent(degrees):
    """The face turned about x, its centre on the circle that keeps the axis' length."""
    angle = np.radians(degrees)
    r = rotation(0, angle)
    radius = LENGTH / angle if angle else np.inf
    center = HEAD if angle == 0 else HEAD + (0, -radius * (1 - np.cos(angle)), radius * np.sin(angle) - LENGTH)
    return lambda x: (x - HEAD) @ r.T + center


def path(motion, *corners, step):
    """Amounts from 0 over `corners` at most `step` apart."""
    amounts, last = [], 0
    for corner in corners:
        n = int(np.ceil(abs(corner - last) / step - 1e-9))
        amounts += list(last + (corner - last) * np.arange(1, n + 1) / n)
        last = corner
    return amounts, [motion(a) for a in amounts]


def cell_centers(n):
    """Centres of the free cells of an n x n x 5n lattice, x fastest, z slowest (4n * n * n, 3)."""
    k, j, i = np.indices((4 * n, n, n))
    d = 0.2 / n
    return np.stack([(i + .5) * d - .1, (j + .5) * d - .1, (k + .5) * d + .1], axis=-1).reshape(-1, 3)


def moment(step, axis):
    """About the centre of the upper face, N m."""
    return step.moment(step.position[step.mesh.top - 1][step.mesh.center_of_top])[axis]


def write_field(file, title, mesh, step, axis):
    """The field, and the reaction of the upper end: axial force, or moment about `axis`."""
    reaction = step.force[:, 2].sum() if axis is None else moment(step, axis)
    with open(file, 'w') as out:
        out.write(f'# {title}; mesh {mesh.n}x{mesh.n}x{4 * mesh.n} C3D20R, CalculiX {calculix.version()}\n'
                  f'# reaction: {reaction:.3f} {"N" if axis is None else "N m"} (mu 1 MPa)\n'
                  '# n, then deformed x, y, z (m) of the centres of the free cells of the n x n x 5n lattice, x fastest, z '
                  'slowest\nn,x,y,z\n')
        for n in LATTICES:
            centers = cell_centers(n)
            for x in centers + mesh.interpolate(step.position - mesh.position, centers):
                out.write(f'{n},{x[0]:.6f},{x[1]:.6f},{x[2]:.6f}\n')


def zero_crossing(amounts, moments):
    """Where the moment passes zero while unloading, by linear interpolation."""
    turn = int(np.argmax(np.abs(amounts)))
    for k in range(turn, len(amounts) - 1):
        if moments[k] * moments[k + 1] <= 0:
            return amounts[k] + (amounts[k + 1] - amounts[k]) * moments[k] / (moments[k] - moments[k + 1])
    raise RuntimeError('the moment does not pass zero: unload further')


def write_moments(file, title, mesh, amounts, steps, axis):
    """`axis` of the moment about the upper face's centre against the path."""
    moments = [moment(s, axis) for s in steps]
    residual = zero_crossing(amounts, moments)
    with open(file, 'w') as out:
        out.write(f'# {title}; mesh {mesh.n}x{mesh.n}x{4 * mesh.n} C3D20R, CalculiX {calculix.version()}\n'
                  f'# residual angle at zero moment: {residual:.2f} deg\nangle_deg,moment_Nm,axial_N\n')
        for a, m, s in zip(amounts, moments, steps):
            out.write(f'{a:.3f},{m:.6g},{s.force[:, 2].sum():.6g}\n')
    return residual


# name: motion, most, largest step, axis of the moment, what it is
ELASTIC = {'stretch20': (stretched, 20, 5, None, 'upper end moved axially by 0.16 m, 20 % of the free length'),
           'twist90': (twisted, 90, 15, 2, 'upper end turned 90 deg about z, no axial motion'),
           'bend60': (bent, 60, 10, 0, 'upper end turned 60 deg about x, its centre on the arc of length 0.8 m')}
POISSON_RATIOS = (0.0, 0.3, 0.45)

# name: motion, most, unload to, axis of the moment, yield strain
PLASTIC = {'twist90_j2_yield0.02': (twisted, 90, 60, 2, .02),
           'twist90_j2_yield0.04': (twisted, 90, 40, 2, .04),
           'twist90_j2_yield0.06': (twisted, 90, 20, 2, .06),
           'twist60_j2_yield0.03': (twisted, 60, 20, 2, .03),
           'bend60_j2_yield0.03': (bent, 60, 20, 0, .03)}


# Of a disc: radius of the sphere (m), yield strain, travel of the sphere (m)
DISCS = (pressed_disc.Case(0.2, 0.0015, 0.05), pressed_disc.Case(0.4, 0.0015, 0.06), pressed_disc.Case(0.4, 0.003, 0.06))


def write_disc(file, case, mesh, force, moved):
    """Force against depth, and the middle surface at the deepest and when let go. Returns the depth that stays, m."""
    free = int(np.argmax((np.arange(len(force)) > np.argmax(force)) & (force < 1e-6 * force.max())))
    assert free > 0, 'the sphere is not let go: further back'
    deepest = int(np.argmax(force))
    depth = -moved[:, 0, 1]
    with open(file, 'w') as out:
        out.write(f'# a clamped disc, radius {pressed_disc.RADIUS} m, thickness {pressed_disc.THICKNESS} m, pressed by a sphere of '
                  f'{case.ball} m and let go; E 200 GPa, nu 0.3, von Mises {case.yield_stress / 1e6:.2f} MPa (yield {case.strain}), '
                  f'no hardening; mesh {mesh.n}x{mesh.through} CAX8R, CalculiX {calculix.version()}\n'
                  f'# deepest: force {force[deepest]:.0f} N, middle {1e3 * depth[deepest]:.3f} mm; stays: {1e3 * depth[free]:.3f} mm\n'
                  '# part curve: travel of the sphere (m), depth of the middle (m), force (N); parts deepest and left: radius (m), '
                  'depth (m), outwards (m) of the middle surface\npart,a,b,c\n')
        for travel, d, f in zip(pressed_disc.travels(case)[:free + 1], depth, force):
            out.write(f'curve,{travel:.5f},{d:.6f},{max(f, 0):.0f}\n')
        for name, k in (('deepest', deepest), ('left', free)):
            for i in range(0, mesh.n + 1, 2):
                out.write(f'{name},{i * pressed_disc.RADIUS / mesh.n:.3f},{-moved[k, i, 1] + 0:.6f},{moved[k, i, 0] + 0:.6f}\n')
    return depth[free]


def main():
    here = pathlib.Path(__file__).resolve()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--mesh', type=int, default=4, help='elements across the bar (4)')
    parser.add_argument('--output', type=pathlib.Path, default=here.parents[2] / 'data' / 'reference')
    parser.add_argument('names', nargs='*', help='cases, by the beginning of their names; all by default')
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    mesh = BarMesh(args.mesh)

    def wanted(name):
        return not args.names or any(name.startswith(n) for n in args.names)

    for name, (motion, most, step, axis, text) in ELASTIC.items():
        for nu in POISSON_RATIOS:
            full = f'{name}_nu{nu:.2f}'
            if not wanted(full):
                continue
            begin = time.time()
            steps = calculix.run(mesh, calculix.neo_hookean(nu), path(motion, most, step=step)[1])
            write_field(args.output / f'{full}.csv', f'{text}; neo-Hookean, nu {nu:.2f}', mesh, steps[-1], axis)
            print(f'{full}: {time.time() - begin:.0f} s', flush=True)
    for name, (motion, most, back, axis, yield_strain) in PLASTIC.items():
        if not wanted(name):
            continue
        begin = time.time()
        loading, up = path(motion, most, step=5)
        unloading, down = path(lambda a: motion(most - a), most - back, step=2.5)
        amounts = loading + [most - a for a in unloading]
        steps = calculix.run(mesh, calculix.j2_plastic(yield_strain), up + down)
        text = f'upper end as in {name.split("_")[0]} and back; J2, nu 0, mu 1 MPa, yield strain {yield_strain} in pure shear'
        residual = write_moments(args.output / f'{name}.csv', text, mesh, amounts, steps, axis)
        print(f'{name}: residual {residual:.2f} deg, {time.time() - begin:.0f} s', flush=True)
    for case in DISCS:
        if not wanted(case.name):
            continue
        begin = time.time()
        disc = pressed_disc.DiscMesh(case)
        force, moved = calculix.run_deck(lambda path: pressed_disc.write_deck(path, disc, case), pressed_disc.read_results)
        stays = write_disc(args.output / f'{case.name}.csv', case, disc, force, moved)
        print(f'{case.name}: {stays * 1e3:.2f} mm stay, {time.time() - begin:.0f} s', flush=True)


if __name__ == '__main__':
    main()
