"""What the preview draws, as arrays: a bake's frames, skinned by whoever asks (Choi 2014, section 4.2).

The library gives what rests (vertices, whom they follow) when it changes, which is when edges broke, and the particles'
maps at every frame. Nothing here knows of Blender's scene or of graphics.
"""
import math

import numpy as np

from ..base import bake_reader, core
from ..bake import cache

LIMIT = 0.1  # strain of the hottest colour of bodies that never tear
_ELLIPSOID = 0.6  # size of drawn ellipsoids: at their full one they would hide the edges


class Geometry:
    """Vertices that follow particles, and what joins them.

    rest (v, 3) f32; follows (v, 3) i32: first row of `influences`, number of rows, particle whose colour it has;
    influences (k, 2) f32: particle and weight; outer, inner (t, 3) i32 triangles; lines (l, 2) i32.
    """

    def __init__(self, rest, follows, influences, outer=None, inner=None, lines=None):
        none = np.empty((0, 3), np.int32)
        self.rest, self.follows = np.ascontiguousarray(rest, np.float32), np.ascontiguousarray(follows, np.int32)
        self.influences = np.ascontiguousarray(influences, np.float32)
        self.outer, self.inner = none if outer is None else outer, none if inner is None else inner
        self.lines = none[:, :2] if lines is None else lines


class Frame:
    """One body at one frame, drawn about `center` (m).

    particles (n, 8, 4) f32: three rows of each particle's map from rest to world, its colour, three rows of what turns as
    a vertex does and its own turn, a quaternion (x, y, z, w); surface, edges: Geometry; ellipsoids: the same for a unit
    sphere's vertices; limit: strain at which it tears, None for never.
    """


def skinned(geometry, particles):
    """Positions (v, 3) as the graphics card computes them, in double precision."""
    maps = _skin_maps(geometry, particles)
    return np.einsum("vij,vj->vi", maps[:, :, :3], geometry.rest.astype(np.float64)) + maps[:, :, 3]


def _beside(geometry, particles, positions):
    """A Geometry that is skinned to `positions` (v, 3): what fragments leave of a source that bends within them is in its rest."""
    maps = _skin_maps(geometry, particles)
    rest, turned = geometry.rest.astype(np.float64), np.abs(np.linalg.det(maps[:, :, :3])) > 1e-9  # else flat: as they are skinned
    rest[turned] = np.linalg.solve(maps[turned, :, :3], (positions - maps[:, :, 3])[turned][:, :, None])[:, :, 0]
    return Geometry(rest, geometry.follows, geometry.influences, geometry.outer, geometry.inner)


def _skin_maps(geometry, particles):
    """What takes each vertex from its rest to where it is drawn, (v, 3, 4)."""
    first, count = geometry.follows[:, 0], geometry.follows[:, 1]
    vertex = np.repeat(np.arange(len(first)), count)
    row = np.repeat(first - np.concatenate([[0], np.cumsum(count)[:-1]]), count) + np.arange(count.sum())
    particle, weight = geometry.influences[row, 0].astype(int), geometry.influences[row, 1].astype(np.float64)
    maps = particles[particle].astype(np.float64)

    def blended(of_influence):
        return np.stack([np.bincount(vertex, column * weight, len(first)) for column in of_influence.T], 1)

    carried, arm = (blended(maps[:, r:r + 3].reshape(-1, 12)).reshape(-1, 3, 4) for r in (0, 4))
    heaviest = particle[np.lexsort((np.arange(len(weight)), -weight, vertex))[np.cumsum(count) - count]]
    own, near = maps[:, 7], particles[heaviest, 7].astype(np.float64)
    turn = blended(own * np.where((own * near[vertex]).sum(1) < 0, -1.0, 1.0)[:, None])
    return carried + _rotations(turn / np.linalg.norm(turn, axis=1, keepdims=True)) @ arm


def _rotations(quaternions):
    """Matrices of unit quaternions (n, 4), ordered (x, y, z, w)."""
    x, y, z, w = quaternions.T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


class Source:
    """The body that one deformer shows in one bake folder. `frame` raises core.Refused, Unusable or the library's Error.

    Cutting the mesh again takes the library a while: `start` lets it begin (in a thread of its own, see bake_job.py),
    `is_ready` tells when it is done.
    """

    def __init__(self, folder, graph, node, at_hand=None):
        """`at_hand`: the library's graph that made the bake, if it is there still: what it has cut is not cut again."""
        sunder = core.sunder()
        self._sunder, self._node, self.graph, self.error = sunder, node, graph, ""
        fields = graph["nodes"][node]
        # What cannot be seen is not drawn, whatever the bake's files hold.
        if at_hand is not None and at_hand.to_dict(defaults=True)["nodes"] == graph["nodes"]:
            self._graph = at_hand
            at_hand[node]["topology"] = "compact"
        else:
            nodes = {**graph["nodes"], node: {**fields, "topology": "compact"}}
            self._graph = sunder.Graph.from_dict({**graph, "nodes": nodes}, base_folder=folder)
            self._graph.set_cut_folder(cache.cuts(folder))
        self._solver, self._output = fields["state"][1:].rsplit(".", 1)
        # States are those of files, each at the frame that was simulated; none is simulated to tell accelerations.
        for name, plain in (("time_scale", 1), ("accelerations", False)):
            if self._graph[self._solver][name] != plain:
                self._graph[self._solver][name] = plain
        self._body = bake_reader.body_of(graph["nodes"], fields["body"])
        self._follows = _follows_a_mesh(graph["nodes"], fields["body"])
        self._first = graph["frame_range"][0]
        self._intact = self._surface = self._center = None
        self._job = None

    def start(self):
        self._job = self._graph.start_evaluate(f"{self._node}.mesh", self._first)

    def wait(self):
        while not self.is_ready:
            self._job.wait(1.0)

    @property
    def is_ready(self):
        if self._job is not None and not self._job.is_running:
            job, self._job = self._job, None
            try:
                job.result()
            except self._sunder.Error as error:
                self.error = str(error)
        return self._job is None

    def frame(self, state_path, mode, limit=0.0, edges_as="BREAKS"):
        """A Frame of a state file. `limit`: strain of the hottest colour; 0: the body's toughness. edges_as: what
        colours of edges tell, BREAKS, STRENGTH or LOAD; the latter two leave out what broke."""
        kept = self._sunder.read_state(state_path)
        number = math.ceil(kept.simulated_frame)  # whose keys made it
        self._graph.show_state(self._solver, number, kept)
        state = self._graph.evaluate(f"{self._solver}.{self._output}", number)
        body, = (b for b in state.bodies if b["name"] == self._body)
        mine, own_edges = slice(*body["particles"]), slice(*body["edges"])
        intact = state.edge_intact[own_edges].astype(bool)
        if self._center is None:
            self._center = state.rest_position[mine].mean(0)
        is_new = self._surface is None or not np.array_equal(intact, self._intact)
        mesh = self._graph.evaluate(f"{self._node}.mesh", number) if is_new or self._follows else None
        if is_new:
            self._bind(mesh)
            self._intact = intact
        made = Frame()
        made.center, made.surface = self._center, self._surface
        made.limit = self._limit(kept.simulated_frame, limit)
        edges = state.edges[own_edges].astype(np.int64) - mine.start
        own = self._graph[self._body].at("toughness", number)
        broken_now = np.zeros(len(state.edges), bool)
        broken_now[state.broken_edge] = True
        if edges_as == "BREAKS":
            made.edges, of_edges = _edges(state.rest_position[mine] - self._center, edges, intact, broken_now[own_edges]), _EXTRA
        else:
            of_edge = state.edge_toughness[own_edges][intact]
            made.edges = _colored_edges(state.rest_position[mine] - self._center, edges[intact])
            if edges_as == "LOAD":
                of_edges = heat(np.clip(state.strain[mine][edges[intact]].max(1) / of_edge, 0, 1))
            else:
                of_edges = strength(of_edge / own if own else np.ones(len(of_edge)))
        toughness = state.toughness[mine] * (made.limit / own if own and made.limit else 1.0)
        colors = _colors(mode, state.piece[mine], state.strain[mine], made.limit, toughness)
        made.particles = _texels(*_about(state, mine, self._center), colors, of_edges)
        if self._follows:
            made.surface = _beside(self._surface, made.particles, mesh.positions - self._center)
        made.ellipsoids = _texels(_ellipsoids(state, mine, self._center), *_unturned(len(colors)), colors, of_edges)
        return made

    def _bind(self, mesh):
        offset = mesh.influence_offset.astype(np.int64)
        follows = np.stack([offset[:-1], np.diff(offset), mesh.vertex_fragment], 1)
        influences = np.stack([mesh.influence_particle, mesh.influence_weight], 1)
        is_inner = mesh.face_material >= mesh.interior_material
        triangles = mesh.triangles.astype(np.int32)
        self._surface = Geometry(mesh.rest_positions - self._center, follows, influences,
                                 np.ascontiguousarray(triangles[~is_inner]), np.ascontiguousarray(triangles[is_inner]))

    def _limit(self, number, wanted):
        if wanted > 0:
            return wanted
        return self._graph[self._body].at("toughness", number)


def _follows_a_mesh(nodes, wire):
    """Whether a body, as it comes along a wire, follows each vertex of a mesh: then no skin alone has its vertices."""
    name = wire[1:].rsplit(".", 1)[0]
    while nodes[name]["type"] != "body":
        if nodes[name]["type"] == "follow" and nodes[name].get("motion") == "vertices":
            return True
        name = nodes[name]["body"][1:].rsplit(".", 1)[0]
    return False


def _about(state, mine, center):
    """What carries (n, 3, 4), what turns (n, 3, 4) and turns (n, 4) as maps of what lies about `center`: single precision
    then suffices far out."""
    turn = state.particle_turn[mine][:, [1, 2, 3, 0]]
    turned = state.particle_turned[mine].copy()
    carried = state.particle_transform[mine] - _rotations(turn) @ turned
    carried[:, :, 3] += carried[:, :, :3] @ center - center
    turned[:, :, 3] += turned[:, :, :3] @ center
    return carried, turned, turn


def _unturned(n):
    return np.zeros((n, 3, 4)), np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))


def _ellipsoids(state, mine, center):
    """Maps of the unit sphere to each particle's ellipsoid (n, 3, 4)."""
    turned = _rotations(state.orientation[mine][:, [1, 2, 3, 0]])
    maps = np.empty((len(turned), 3, 4))
    maps[:, :, :3] = turned * (_ELLIPSOID * state.radii[mine])[:, None, :]
    maps[:, :, 3] = state.position[mine] - center
    return maps


# Colours behind the particles' own: of edges that hold, that broke, that broke in this frame.
INTACT_COLOR, BROKEN_COLOR, BREAKING_COLOR = (0.62, 0.66, 0.72), (0.85, 0.12, 0.08), (1.0, 0.85, 0.2)
_EXTRA = np.array([INTACT_COLOR, BROKEN_COLOR, BREAKING_COLOR])


def _texels(carried, turned, turn, colors, of_edges):
    """Maps and colours of the particles, then the colours of edges (under maps that are never used)."""
    n = len(carried)
    texels = np.zeros((n + len(of_edges), 8, 4), np.float32)
    texels[:n, :3], texels[:n, 4:7], texels[:n, 7] = carried, turned, turn
    texels[:n, 3, :3], texels[n:, 3, :3] = colors, of_edges
    texels[:, 3, 3] = texels[n:, 7, 3] = 1
    return texels


def _edges(rest, edges, intact, broken_now):
    """A line from particle to particle where an edge holds; where it broke, a stub on either side to its middle."""
    n = len(rest)
    whole, torn = edges[intact], edges[~intact]
    middle = rest[torn].mean(1)
    color = n + 1 + broken_now[~intact].astype(int)
    ends = [(rest[whole[:, k]], whole[:, k], np.full(len(whole), n)) for k in (0, 1)]
    for k in (0, 1):
        ends += [(rest[torn[:, k]], torn[:, k], color), (middle, torn[:, k], color)]
    position, particle, shade = (np.concatenate([e[i] for e in ends]) for i in range(3))
    follows = np.stack([particle, np.ones_like(particle), shade], 1)
    influences = np.stack([np.arange(n), np.ones(n)], 1)  # row i: particle i alone
    w, t = len(whole), len(torn)
    starts = [np.arange(w), 2 * w + np.arange(t), 2 * w + 2 * t + np.arange(t)]
    steps = [w, t, t]
    lines = np.concatenate([np.stack([s, s + step], 1) for s, step in zip(starts, steps)])
    return Geometry(position, follows, influences, lines=lines.astype(np.int32))


def _colored_edges(rest, edges):
    """A line from particle to particle, each in a colour of its own."""
    n, m = len(rest), len(edges)
    shade = n + np.repeat(np.arange(m), 2)
    follows = np.stack([edges.ravel(), np.ones(2 * m, int), shade], 1)
    influences = np.stack([np.arange(n), np.ones(n)], 1)  # row i: particle i alone
    return Geometry(rest[edges].reshape(-1, 3), follows, influences, lines=np.arange(2 * m, dtype=np.int32).reshape(-1, 2))


def _colors(mode, piece, strain, limit, toughness):
    """(n, 3), as shown on the screen. `limit`: strain of the hottest colour; `toughness` (n,): at which each particle may tear."""
    if mode == "STRAIN":
        return heat(np.clip(strain / (limit or LIMIT), 0, 1))
    if mode == "TOUGHNESS":
        return traffic_light(1 - np.clip(np.divide(strain, toughness, out=np.zeros(len(strain)), where=toughness > 0), 0, 1))
    if mode == "EDGES":
        return np.tile([0.5, 0.55, 0.62], (len(piece), 1))
    return piece_colors(piece)


def piece_colors(piece):
    """A colour a piece, of the first particle in it: what comes off changes its colour, what it came off keeps it."""
    first = np.full(int(piece.max(initial=0)) + 1, len(piece))
    np.minimum.at(first, piece, np.arange(len(piece)))
    key = first[piece]
    hue = (key * 0.61803398875) % 1  # golden ratio: neighbours in number are far apart in colour
    value = 0.75 + 0.2 * ((key * 0.75487766) % 1)
    return _hsv(hue, np.full(len(key), 0.55), value)


def _hsv(hue, saturation, value):
    k = (hue[:, None] * 6 + np.array([5.0, 3.0, 1.0])) % 6
    return value[:, None] * (1 - saturation[:, None] * np.clip(np.minimum(k, 4 - k), 0, 1))


_HEAT = np.array([(0.16, 0.20, 0.42), (0.20, 0.50, 0.72), (0.55, 0.78, 0.55), (0.96, 0.82, 0.30), (0.93, 0.36, 0.16),
                  (1.0, 0.95, 0.9)])
_TRAFFIC = np.array([(0.80, 0.10, 0.10), (0.95, 0.65, 0.15), (0.30, 0.65, 0.35)])


def _ramp(values, colors):
    at = np.linspace(0, 1, len(colors))
    return np.stack([np.interp(values, at, colors[:, k]) for k in range(3)], -1)


def heat(share):
    """Cold to hot for 0 to 1, (n, 3)."""
    return _ramp(share, _HEAT)


def traffic_light(left):
    """Red for 0, green for 1, (n, 3)."""
    return _ramp(left, _TRAFFIC)


_STRENGTHS = np.array([(0.85, 0.15, 0.08), (0.95, 0.55, 0.15), (0.62, 0.66, 0.72), (0.30, 0.62, 0.90), (0.10, 0.25, 0.85)])
_GLUED = (0.62, 0.25, 0.85)
DECADES = 1.0  # that the colours of strengths reach to either side


def strength(ratio):
    """Weak (red) over as it was (grey) to tough (blue) for a tenth to ten times a body's toughness; violet for what never breaks."""
    at = np.clip(np.log10(np.maximum(ratio, 1e-9)), -DECADES, DECADES) / (2 * DECADES) + 0.5
    colors = _ramp(at, _STRENGTHS)
    colors[np.isinf(ratio)] = _GLUED
    return colors


def spheres(n):
    """A unit sphere for each of n particles, twelve faces around and eight up; sphere i follows particle i alone."""
    around, up = np.linspace(0, 2 * np.pi, 13)[:-1], np.linspace(-np.pi / 2, np.pi / 2, 9)
    ring = np.stack([np.cos(around), np.sin(around)], 1)
    corners = np.concatenate([np.column_stack([np.cos(u) * ring, np.full(12, np.sin(u))]) for u in up])
    k = np.arange(12)
    below = np.concatenate([12 * level + np.stack([k, (k + 1) % 12, 12 + (k + 1) % 12, 12 + k], 1) for level in range(8)])
    faces = np.concatenate([below[:, [0, 1, 2]], below[:, [0, 2, 3]]])
    particle = np.repeat(np.arange(n), len(corners))
    follows = np.stack([particle, np.ones_like(particle), particle], 1)
    outer = (faces[None] + len(corners) * np.arange(n)[:, None, None]).reshape(-1, 3).astype(np.int32)
    return Geometry(np.tile(corners, (n, 1)), follows, np.stack([np.arange(n), np.ones(n)], 1), outer)
