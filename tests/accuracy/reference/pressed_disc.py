"""A clamped disc pressed by a sphere and let go, by axisymmetric finite elements with CalculiX.

x is the radius, y the height; the disc lies in y from 0 to its thickness, x from 0 to its radius, where it is clamped. Elements are
CAX8R, perfectly plastic by von Mises; the sphere is twenty times as stiff as the disc, without friction, and driven downwards.
"""
import dataclasses

import numpy as np

RADIUS, THICKNESS = 0.5, 0.01  # m
YOUNGS_MODULUS, POISSON_RATIO = 2e11, 0.3
CONTACT_STIFFNESS = 1e14       # Pa/m; ten times less changes force and middle by 0.8 and 0.1 %
WHOLE_CIRCLE = 180             # forces are those of a wedge of two degrees, into which ccx turns what is axisymmetric


@dataclasses.dataclass
class Case:
    ball: float    # m, radius of the sphere
    strain: float  # yield strain of Sunder's law
    depth: float   # m, travel of the sphere

    @property
    def name(self):
        return f'disc_ball{self.ball}_yield{self.strain}'

    @property
    def yield_stress(self):
        """In uniaxial tension, Pa."""
        return 1.5 * YOUNGS_MODULUS * self.strain / (1 + POISSON_RATIO)


class Grid:
    """n x m eight-node elements; `place(u, v)` gives x and y for u and v from 0 to 1."""

    def __init__(self, n, m, place, first_node=1, first_element=1):
        i, j = np.indices((2 * n + 1, 2 * m + 1))
        is_node = (i % 2 + j % 2) <= 1  # corners and middles of edges
        self.node = np.zeros(is_node.shape, int)
        self.node[is_node] = np.arange(is_node.sum()) + first_node
        self.position = np.array([place(a / (2 * n), b / (2 * m)) for a, b in zip(i[is_node], j[is_node])])
        self.first_node, self.first_element = first_node, first_element
        around = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
        self.elements = np.array([[self.node[a + da, b + db] for da, db in around]
                                  for a in range(0, 2 * n, 2) for b in range(0, 2 * m, 2)])
        corner = self.position[self.elements[0][:4] - first_node]
        if np.cross(corner[1] - corner[0], corner[3] - corner[0]) < 0:
            self.elements = self.elements[:, [0, 3, 2, 1, 7, 6, 5, 4]]

    def faces(self, nodes):
        """'element, Sk' of the elements' edges whose ends are both among `nodes`."""
        nodes = set(nodes)
        return [f'{self.first_element + k}, S{s + 1}' for k, e in enumerate(self.elements) for s in range(4)
                if e[s] in nodes and e[(s + 1) % 4] in nodes]


class DiscMesh:
    """`n` elements along the radius, `through` through the thickness, and a sphere's sector of like elements on it."""

    def __init__(self, case, n=50, through=4):
        self.n, self.through = n, through
        self.disc = Grid(n, through, lambda u, v: (RADIUS * u, THICKNESS * v))
        reach = min(1.2, (0.15 + case.ball / 2) / case.ball)  # rad: of the sector, past all that touches
        self.reach = reach * case.ball                        # m

        def on_ball(u, v):
            r = case.ball * (1 - 0.3 * u)
            return r * np.sin(reach * v), THICKNESS + case.ball - r * np.cos(reach * v)
        self.ball = Grid(2, round(self.reach * n / RADIUS), on_ball, self.disc.position.shape[0] + 1, len(self.disc.elements) + 1)
        self.middle = self.disc.node[::2, through]  # nodes of the middle surface (n + 1): even numbers through the thickness

    def write(self, deck, case):
        deck.write('*NODE, NSET=NALL\n')
        for k, x in enumerate(np.vstack([self.disc.position, self.ball.position]), 1):
            deck.write(f'{k}, {max(x[0], 0):.12g}, {x[1]:.12g}, 0.\n')
        for name, grid in (('DISC', self.disc), ('BALL', self.ball)):
            deck.write(f'*ELEMENT, TYPE=CAX8R, ELSET={name}\n')
            for k, e in enumerate(grid.elements, grid.first_element):
                deck.write(f'{k}, ' + ', '.join(map(str, e)) + '\n')
        driven = self.ball.node[-1][self.ball.node[-1] > 0]
        axis = np.concatenate([self.disc.node[0], self.ball.node[:, 0]])
        clamp = self.disc.node[-1]
        for name, nodes in (('CLAMP', clamp), ('AXIS', axis), ('DRIVEN', driven), ('MIDDLE', self.middle)):
            deck.write(f'*NSET, NSET={name}\n' + ''.join(f'{v},\n' for v in nodes if v > 0))
        upper = [v for v in self.disc.node[::2, -1] if self.disc.position[v - 1, 0] < 1.3 * self.reach]
        for name, faces in (('UPPER', self.disc.faces(upper)), ('LOWER', self.ball.faces(self.ball.node[0, ::2]))):
            deck.write(f'*SURFACE, NAME={name}, TYPE=ELEMENT\n' + ''.join(f'{f}\n' for f in faces))
        stress = case.yield_stress
        deck.write(f'*MATERIAL, NAME=SHEET\n*ELASTIC\n{YOUNGS_MODULUS:.12g}, {POISSON_RATIO}\n'
                   f'*PLASTIC\n{stress:.12g}, 0.\n{1.01 * stress:.12g}, 10.\n'  # all but perfectly plastic
                   f'*MATERIAL, NAME=HARD\n*ELASTIC\n{20 * YOUNGS_MODULUS:.12g}, {POISSON_RATIO}\n'
                   '*SOLID SECTION, ELSET=DISC, MATERIAL=SHEET\n*SOLID SECTION, ELSET=BALL, MATERIAL=HARD\n'
                   '*SURFACE INTERACTION, NAME=TOUCH\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n'
                   f'{CONTACT_STIFFNESS:g}\n*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE\nUPPER, LOWER\n'
                   '*BOUNDARY\nCLAMP, 1, 2\nAXIS, 1, 1\nDRIVEN, 1, 1\n')


def travels(case, down=20, up=20, back=0.5):
    """Of the sphere at the ends of steps, m: down, and up again by `back` of it, by when it hangs free."""
    return [case.depth * (k + 1) / down for k in range(down)] + [case.depth * (1 - back * (k + 1) / up) for k in range(up)]


def write_deck(path, mesh, case):
    with open(path, 'w') as deck:
        mesh.write(deck, case)
        for k, travel in enumerate(travels(case)):
            deck.write(f'*STEP, NLGEOM, INC=2000\n*STATIC\n{0.2 if k == 0 else 1.}, 1., 1e-7, 1.\n'
                       f'*BOUNDARY\nDRIVEN, 2, 2, {-travel:.12g}\n*NODE PRINT, NSET=DRIVEN, FREQUENCY=2000, TOTALS=ONLY\nRF\n'
                       '*NODE PRINT, NSET=MIDDLE, FREQUENCY=2000\nU\n*END STEP\n')


def read_results(path):
    """(force on the sphere (n_steps), N; displacement of the middle surface (n_steps, n_nodes, 2), m: outwards, up)."""
    force, moved, kind, step = {}, {}, None, None
    for line in open(path):
        words = line.split()
        if 'time' in words:
            time, kind = float(words[-1]), words[0]
            step = round(time) if abs(time - round(time)) < 1e-6 else None
        elif step is not None and kind == 'total' and len(words) == 3:
            force[step] = -WHOLE_CIRCLE * float(words[1])
        elif step is not None and kind == 'displacements' and len(words) == 4:
            moved.setdefault(step, []).append([float(words[1]), float(words[2])])
    steps = sorted(force)
    return np.array([force[k] for k in steps]), np.array([moved[k] for k in steps])
