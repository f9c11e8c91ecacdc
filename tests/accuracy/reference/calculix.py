"""Static finite-element runs of the square bar with CalculiX (ccx, Debian package calculix-ccx).

The bar is 0.2 x 0.2 x 1 m, x and y in [-0.1, 0.1], z in [0, 1]; both ends are rigid over 0.1 m, so that the mesh fills
z in [0.1, 0.9] and every node of its two end faces is prescribed. Elements are C3D20R: 20-node bricks, reduced integration.
SI units; mu = 1 MPa.
"""
import os
import pathlib
import subprocess
import tempfile

import numpy as np

HALF_WIDTH = 0.1               # m
Z_BEGIN, Z_END = 0.1, 0.9      # m, the free part
LENGTH = Z_END - Z_BEGIN
SHEAR_MODULUS = 1e6            # Pa

# Corners and mid-edge nodes of a C3D20 element in half cells, in CalculiX's order.
ELEMENT_NODES = np.array([
    (0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
    (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
    (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)])


class BarMesh:
    """n x n x 4n cubic C3D20R elements; `grid[i, j, k]` is the number of the node at half cells (i, j, k), 0 for none."""

    def __init__(self, n):
        self.n = n
        self.cells = np.array((n, n, 4 * n))
        i, j, k = np.indices(2 * self.cells + 1)
        is_node = (i % 2 + j % 2 + k % 2) <= 1  # corners and middles of edges
        self.grid = np.zeros(is_node.shape, int)
        self.grid[is_node] = np.arange(1, is_node.sum() + 1)
        half = HALF_WIDTH / n
        self.position = np.stack([i[is_node] * half - HALF_WIDTH, j[is_node] * half - HALF_WIDTH,
                                  k[is_node] * half + Z_BEGIN], axis=1)  # (n_nodes, 3), m
        corner = 2 * np.stack(np.indices(self.cells), axis=-1).reshape(-1, 3)
        at = corner[:, None, :] + ELEMENT_NODES
        self.elements = self.grid[at[..., 0], at[..., 1], at[..., 2]]  # (n_elements, 20)
        self.bottom = self.grid[:, :, 0][self.grid[:, :, 0] > 0]
        self.top = self.grid[:, :, -1][self.grid[:, :, -1] > 0]
        self.center_of_top = int(np.argmin(np.linalg.norm(self.position[self.top - 1] - (0, 0, Z_END), axis=1)))

    def interpolate(self, values, points):
        """`values` (n_nodes, 3) at `points` (m, 3) of the undeformed bar, by the elements' own shape functions."""
        local = (points - (-HALF_WIDTH, -HALF_WIDTH, Z_BEGIN)) * self.n / (2 * HALF_WIDTH)
        cell = np.clip(np.floor(local).astype(int), 0, self.cells - 1)
        natural = 2 * (local - cell) - 1  # [-1, 1]
        element = (cell[:, 0] * self.cells[1] + cell[:, 1]) * self.cells[2] + cell[:, 2]
        at_node = ELEMENT_NODES - 1       # natural coordinates of the nodes
        product = natural[:, None, :] * at_node
        corners = np.prod(1 + product, axis=2) * (product.sum(axis=2) - 2) / 8
        on_edge = at_node == 0            # the axis along which a mid-edge node lies in the middle
        edges = np.prod(np.where(on_edge, 1 - natural[:, None, :] ** 2, 1 + product), axis=2) / 4
        shape = np.where(on_edge.any(axis=1), edges, corners)
        return np.einsum('me,mec->mc', shape, values[self.elements[element] - 1])


def neo_hookean(poisson_ratio):
    """Compressible neo-Hookean cards with shear modulus mu."""
    bulk = 2 * SHEAR_MODULUS * (1 + poisson_ratio) / (3 * (1 - 2 * poisson_ratio))
    return f'*HYPERELASTIC, NEO HOOKE\n{SHEAR_MODULUS / 2:.12g}, {2 / bulk:.12g}\n'


def j2_plastic(yield_strain):
    """Elastic with nu = 0 and von Mises plastic cards: first yield in pure shear at principal log strain `yield_strain`."""
    stress = np.sqrt(3) * 2 * SHEAR_MODULUS * yield_strain
    return (f'*ELASTIC\n{2 * SHEAR_MODULUS:.12g}, 0.\n'
            f'*PLASTIC\n{stress:.12g}, 0.\n{1.01 * stress:.12g}, 10.\n')  # all but perfectly plastic


def write_deck(path, mesh, material, motions):
    """One static step for each of `motions`: functions that give the upper face's nodes (m, 3) their places."""
    with open(path, 'w') as deck:
        deck.write('*NODE, NSET=NALL\n')
        for k, x in enumerate(mesh.position, 1):
            deck.write(f'{k}, {x[0]:.12g}, {x[1]:.12g}, {x[2]:.12g}\n')
        deck.write('*ELEMENT, TYPE=C3D20R, ELSET=EALL\n')
        for k, nodes in enumerate(mesh.elements, 1):
            text = [str(v) for v in nodes]
            deck.write(f'{k}, {", ".join(text[:10])},\n{", ".join(text[10:])}\n')
        for name, nodes in (('BOTTOM', mesh.bottom), ('TOP', mesh.top)):
            deck.write(f'*NSET, NSET={name}\n' + ''.join(f'{v},\n' for v in nodes))
        deck.write(f'*MATERIAL, NAME=BAR\n{material}*SOLID SECTION, ELSET=EALL, MATERIAL=BAR\n')
        deck.write('*BOUNDARY\nBOTTOM, 1, 3\n')
        rest = mesh.position[mesh.top - 1]
        for motion in motions:
            deck.write('*STEP, NLGEOM, INC=1000\n*STATIC\n1., 1., 1e-6, 1.\n*BOUNDARY\n')
            for node, u in zip(mesh.top, motion(rest) - rest):
                for axis in range(3):  # ccx cuts numbers off after 20 characters
                    deck.write(f'{node}, {axis + 1}, {axis + 1}, {u[axis]:.12e}\n')
            deck.write('*NODE PRINT, NSET=NALL, FREQUENCY=1000\nU\n*NODE PRINT, NSET=TOP, FREQUENCY=1000\nRF\n*END STEP\n')


def read_results(path):
    """{(quantity, step): (n, 4) rows of node number and vector} at the ends of steps (times 1, 2, ...)."""
    blocks, rows = {}, None
    for line in open(path):
        words = line.split()
        if 'time' in words and words[0] in ('displacements', 'forces'):
            time = float(words[-1])
            at_end = abs(time - round(time)) < 1e-6
            rows = blocks.setdefault((words[0], round(time)), []) if at_end else None
        elif rows is not None and len(words) == 4:
            rows.append([float(w) for w in words])
    return {key: np.array(value) for key, value in blocks.items() if value}


class Step:
    """End of a step: places of all nodes (n_nodes, 3), m; force on each node of the upper face (n_top, 3), N."""

    def __init__(self, mesh, position, force):
        self.mesh, self.position, self.force = mesh, position, force

    def moment(self, about):
        """Moment of the forces on the upper face about a point, N m."""
        return np.cross(self.position[self.mesh.top - 1] - about, self.force).sum(axis=0)


def version():
    """Of the installed ccx, as it tells it."""
    return subprocess.run(['ccx', '-v'], capture_output=True, text=True).stdout.split()[-1]


def run_deck(write, read, threads=1):
    """What `read(path)` makes of the results of the deck that `write(path)` writes. Raises RuntimeError with the end of ccx's output
    when it fails."""
    with tempfile.TemporaryDirectory() as folder:
        deck = pathlib.Path(folder, 'deck.inp')
        write(deck)
        done = subprocess.run(['nice', '-n', '10', 'ccx', '-i', 'deck'], cwd=folder, capture_output=True, text=True,
                              env={**os.environ, 'OMP_NUM_THREADS': str(threads)})
        if 'Job finished' not in done.stdout:
            raise RuntimeError('ccx did not finish:\n' + '\n'.join(done.stdout.splitlines()[-20:]))
        return read(deck.with_suffix('.dat'))


def run(mesh, material, motions, threads=1):
    """Runs ccx and returns one Step for each motion. Raises RuntimeError when it fails."""
    results = run_deck(lambda path: write_deck(path, mesh, material, motions), read_results, threads)
    if ('forces', len(motions)) not in results:
        raise RuntimeError('ccx did not finish')
    steps = []
    for k in range(1, len(motions) + 1):
        u, f = results['displacements', k], results['forces', k]
        assert (u[:, 0] == np.arange(1, len(mesh.position) + 1)).all() and (f[:, 0] == mesh.top).all()
        steps.append(Step(mesh, mesh.position + u[:, 1:], f[:, 1:]))
    return steps
