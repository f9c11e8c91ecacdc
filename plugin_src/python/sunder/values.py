"""Results of evaluation: numpy views into the library's memory, by name."""
from __future__ import annotations

import ctypes
import json
import re
from typing import TYPE_CHECKING, Any, Iterable, Optional, SupportsInt

import numpy as np

from .library import ArrayStruct, Path, Progress, ProgressCallback, check, decode, encode, integer, lib

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[Any]

_DTYPES = (np.uint8, np.int32, np.uint32, np.float32, np.float64)


class _Handle:
    """Owns a value of the library; every array that looks into it holds it."""

    def __init__(self, pointer: ctypes.c_void_p) -> None:
        self.pointer = pointer
        self._free = lib().sunder_value_free

    def __del__(self) -> None:
        self._free(self.pointer)


class Value:
    """One result. Arrays and other facts are attributes; `dir()` lists them.

    Arrays are read-only views, made when first asked for; copy what you want to change.
    """

    def __init__(self, pointer: ctypes.c_void_p) -> None:
        self._handle = _Handle(pointer)
        self._cache: dict[str, Array] = {}
        library = lib()
        self.type = decode(library.sunder_value_type(pointer))
        self._arrays = [
            decode(library.sunder_value_array_name(pointer, i))
            for i in range(library.sunder_value_array_count(pointer))
        ]
        text = ctypes.c_char_p()
        self._check(library.sunder_value_info(pointer, ctypes.byref(text)))
        self.info: dict[str, Any] = json.loads(decode(text.value))

    def _check(self, status: int) -> None:
        check(status, lib().sunder_value_error, self._handle.pointer)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self._arrays:
            info = self.__dict__.get("info", {})
            if name in info:
                return info[name]
            raise AttributeError(
                f"a {self.__dict__.get('type', 'value')} has no '{name}'; it has {', '.join(self._names())}"
            )
        if name not in self._cache:
            self._cache[name] = self._array(name)
        return self._cache[name]

    def _names(self) -> list[str]:
        return sorted({*self.__dict__.get("_arrays", []), *self.__dict__.get("info", {})})

    def __dir__(self) -> Iterable[str]:
        return [*super().__dir__(), *self._names()]

    def __repr__(self) -> str:
        return f"<sunder {self.type}: {', '.join(self._names())}>"

    def _array(self, name: str) -> Array:
        a = ArrayStruct()
        self._check(lib().sunder_value_array(self._handle.pointer, encode(name), ctypes.byref(a)))
        dtype, shape = np.dtype(_DTYPES[a.type]), tuple(a.shape[: a.rank])
        n_bytes = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
        if n_bytes == 0:
            array = np.empty(shape, dtype)
        else:
            memory = (ctypes.c_char * n_bytes).from_address(a.data)
            memory.owner = self._handle  # type: ignore[attr-defined]  # the array holds `memory`, which holds the value
            array = np.frombuffer(memoryview(memory), dtype).reshape(shape)
        array.flags.writeable = False
        return array


class State(Value):
    """All bodies at a frame, n particles and m edges.

    position (n, 3), orientation (n, 4), velocity (n, 3), angular_velocity (n, 3), plastic_deformation (n, 3, 3),
    plastic_curvature (n, 3, 3) or, where no body bends by its curvature, (0, 3, 3), rad/m, yield_ (n,), strain (n,),
    body (n,), fragment (n,), piece (n,), edges (m, 2), edge_intact (m,), edge_damage (m,) or, where no body has a
    fracture energy, (0,); edge_toughness (m,), at which each edge begins to tear, and toughness (n,), at which a fragment may lose one, with
    what seams, regions and glue make of them, infinite where nothing tears, not a number in a state that was read; kept (n,), what activations keep of each (1 held, 2 asleep, 4 glued), or (0,);
    rigid_position, rigid_orientation,
    rigid_velocity, rigid_angular_velocity of rigid bodies; broken_edge, broken_time, broken_strain, broken_toughness of this frame, and
    broken_by (b, 2), what pressed hardest: 0 nothing, 1 a particle, 2 a rigid body, 3 a collider, 4 a seam that broke it, and its number
    (of nothing -1);
    rest_position, rest_orientation, radii, mass, volume at rest; particle_transform (n, 3, 4), from rest to world,
    particle_turned (n, 3, 4) and particle_turn (n, 4), of which skins are made (Mesh); frame, time, bodies, rigid_bodies, report. Where
    time is scaled, it lies at `simulated_frame`, most often between two that were simulated, and velocities are of simulated time.
    """

    position: Array
    orientation: Array
    velocity: Array
    angular_velocity: Array
    plastic_deformation: Array
    plastic_curvature: Array
    strain: Array
    group_rotation: Array
    body: Array
    fragment: Array
    piece: Array
    asleep: Array
    kept: Array
    edges: Array
    edge_intact: Array
    edge_toughness: Array
    toughness: Array
    broken_edge: Array
    broken_time: Array
    broken_strain: Array
    broken_toughness: Array
    broken_by: Array
    rigid_position: Array
    rigid_orientation: Array
    rigid_velocity: Array
    rigid_angular_velocity: Array
    rest_position: Array
    rest_orientation: Array
    radii: Array
    volume: Array
    mass: Array
    particle_transform: Array
    frame: float  # an int of a whole one
    simulated_frame: float
    time_scale: float
    time: float
    bodies: list[dict[str, Any]]
    rigid_bodies: list[str]
    report: dict[str, Any]
    warnings: list[str]

    @property
    def yield_(self) -> Array:
        """(n,) present yield strain; infinite where plastic flow never starts. (`yield` is a word of Python.)"""
        array: Array = self.__getattr__("yield")
        return array


class Mesh(Value):
    """positions (v, 3), triangles (t, 3), normals (3t, 3) and uvs (3t, 2) by corner, face_material (t,).

    A visual mesh also has face_fragment (t,), vertex_fragment (v,), velocities (v, 3) in m/s and, where the solver is asked
    for them, accelerations (v, 3) in m/s2; with constant topology face_hidden (t,), 1 until the interface breaks (otherwise
    it is empty). And it has what moves it: rest_positions (v, 3) and the particles that each vertex follows, those of vertex i being influence_particle[o[i]:o[i + 1]] with weights
    influence_weight[o[i]:o[i + 1]], o = influence_offset (v + 1,). All of this stays the same until an edge breaks.
    A vertex at rest position x is  sum w_i (T_i x - R_i t_i x) + Q sum w_i t_i x  with a State's particle_transform T,
    particle_turned t, which is zero of what is more than one fragment thick, and particle_turn R; Q is the rotation of the
    quaternion sum w_i R_i, each with the sign by which it is nearer to that of the largest weight.
    What follows, or followed, the vertices of a mesh (`follow`) lies beside that by what its skin leaves of these.

    What else the artist's mesh carries is in attributes and vertex_weights, as far as its file has it (docs/files.md).
    """

    positions: Array
    triangles: Array
    normals: Array
    uvs: Array
    colors: Array
    face_material: Array
    materials: list[str]

    _KINDS = re.compile("(point|corner|face)_(float|uv|color|int|bool|weight):(.*)", re.DOTALL)

    def _layers(self) -> list[tuple[str, str, str, str]]:
        """(domain, kind, name, array)"""
        found = [self._KINDS.fullmatch(array) for array in self._arrays if ":" in array]
        return [(m[1], m[2], m[3], m[0]) for m in found if m]

    @property
    def attributes(self) -> dict[str, Array]:
        """{name: (n,) or (n, width) array} by vertex, corner (3t) or face: float32, int32 or bool; further UV maps and
        colours among them."""
        return {name: getattr(self, array).astype(bool) if kind == "bool" else getattr(self, array)
                for _, kind, name, array in self._layers() if kind != "weight"}

    @property
    def attribute_domains(self) -> dict[str, str]:
        """{name: "point", "corner" or "face"} of attributes."""
        return {name: domain for domain, kind, name, _ in self._layers() if kind != "weight"}

    @property
    def vertex_weights(self) -> dict[str, Array]:
        """{name of a vertex group: (v,) weights, 0 of what is not in it}."""
        return {name: getattr(self, array) for _, kind, name, array in self._layers() if kind == "weight"}


class Interfaces:
    """Where fragments touch: pair (m, 2), area (m,) m2, normal (m, 3) from first to second, centroid (m, 3) m."""

    def __init__(self, fragments: Fragments) -> None:
        self.pair, self.area = fragments.edges, fragments.interface_area
        self.normal, self.centroid = fragments.interface_normal, fragments.interface_centroid

    def __len__(self) -> int:
        return len(self.pair)


class Fragments(Value):
    """rest_position (n, 3), rest_orientation (n, 4), radii (n, 3), volume (n,), cluster (n,), edges (m, 2).

    Also interfaces, and warnings, materials, source_volume, ... of the cut.
    """

    rest_position: Array
    rest_orientation: Array
    radii: Array
    volume: Array
    cluster: Array
    toughness_factor: Array
    yield_factor: Array
    density_factor: Array
    edges: Array
    interface_area: Array
    interface_normal: Array
    interface_centroid: Array
    interface_toughness_factor: Array
    materials: list[str]
    source_volume: float
    source_area: float
    warnings: list[str]

    @property
    def interfaces(self) -> Interfaces:
        return Interfaces(self)

    def __len__(self) -> int:
        return len(self.volume)

    def fragment_mesh(self, index: SupportsInt) -> Mesh:
        """Fragment `index` as a closed Mesh."""
        index = integer("fragment", index)
        if not 0 <= index < len(self):
            raise IndexError(f"there is no fragment {index} of {len(self)}")
        out = ctypes.c_void_p()
        self._check(lib().sunder_value_part(self._handle.pointer, b"fragment_mesh", index, ctypes.byref(out)))
        return Mesh(out)

    def save(self, folder: Path, progress: Optional[ProgressCallback] = None) -> None:
        """Writes fragments.json and pieces/ as `sunder fracture` does."""
        p = Progress(progress)
        status = lib().sunder_value_write_fragments(self._handle.pointer, encode(folder), ctypes.byref(p.struct))
        p.check(status, lib().sunder_value_error, self._handle.pointer)


_CLASSES = {b"state": State, b"mesh": Mesh, b"visual_mesh": Mesh, b"fragments": Fragments}


def wrap(pointer: ctypes.c_void_p) -> Value:
    """The Python object for a value of the library, which it owns from now on."""
    return _CLASSES.get(lib().sunder_value_type(pointer), Value)(pointer)
