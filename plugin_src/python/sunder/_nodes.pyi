"""Node types and their parameters. Written by write_stubs.py from the nodes' descriptions."""
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, Literal, Optional, SupportsFloat, SupportsIndex, Union, overload

import numpy.typing as npt

from .graph import Node

_Wire = str  # "@node.socket"
_Wires = Union[str, Sequence[str]]
_Animation = Mapping[str, Any]  # {"keys": [[frame, value], ...], "interpolation": "linear" or "step"}
_Number = Union[SupportsFloat, SupportsIndex]
_Integer = SupportsIndex
_Vector3 = Union[Sequence[float], npt.NDArray[Any]]
_Integer3 = Union[Sequence[int], npt.NDArray[Any]]
_Points = Union[Sequence[_Vector3], npt.NDArray[Any]]
_VertexGroups = Mapping[str, Union[Sequence[int], npt.NDArray[Any]]]
_Path = Union[str, PathLike[str]]

NodeType = Literal[
    "mesh_file",
    "lattice",
    "prefracture",
    "fragment_region",
    "body",
    "body_region",
    "follow",
    "activate",
    "seam",
    "rigid_body",
    "collider",
    "pin",
    "force",
    "blast",
    "point_force",
    "vortex",
    "turbulence",
    "guide",
    "grid_force",
    "pressure",
    "solver",
    "deformer",
    "bake_mesh",
    "bake_state",
]

class AddsNodes:
    @overload
    def add(
        self,
        type: Literal["mesh_file"],
        name: str,
        *,
        path: _Path = ...,
        scale: _Number = ...,
        rotation: _Vector3 = ...,
        groups: _VertexGroups = ...,
    ) -> Node:
        """Reads a triangle mesh from a file: OBJ, PLY, STL, glTF, GLB, FBX or OFF. Colours of vertices are kept, and
        further numbers that a PLY file has for each vertex.

        path: The file, relative to the graph file's folder.
        scale: Length of the file's unit in metres; for FBX, which tells its unit, a factor on that [m per file unit].
        rotation: Turns the mesh about its origin, for files whose up axis is not z; Euler angles XYZ: about x first,
            then y, then z [degrees].
        groups: Named lists of vertices (numbered as read, equal positions being one vertex), for pins.
        """

    @overload
    def add(
        self,
        type: Literal["lattice"],
        name: str,
        *,
        size: _Vector3 = ...,
        cells: _Integer3 = ...,
        center: _Vector3 = ...,
        neighbours: Literal[6, 18, 26] = ...,
    ) -> Node:
        """A box of equal cells, one fragment each: the body of accuracy cases and lessons.

        size: Lengths of the box's sides [m].
        cells: Number of cells along each side; 4 million together at most.
        center: Middle of the box [m].
        neighbours: Cells that a cell is joined to: 6 across faces, 18 also across edges, 26 also across corners.
        """

    @overload
    def add(
        self,
        type: Literal["prefracture"],
        name: str,
        *,
        mesh: _Wire = ...,
        method: Literal["voronoi", "kmeans"] = ...,
        pieces: _Integer = ...,
        seed: _Integer = ...,
        sites: Literal["kmeans", "uniform", "poisson", "impact", "grid", "points", "density"] = ...,
        points: _Points = ...,
        impact_shape: Literal["points", "curve"] = ...,
        impact_radius: _Number = ...,
        grid_jitter: _Number = ...,
        density_group: str = ...,
        density_factor: _Number = ...,
        sheets: Literal["auto", "off"] = ...,
        roughness: _Integer = ...,
        least_piece: _Number = ...,
        source: Literal["tets", "voronoi"] = ...,
        cells_per_piece: _Number = ...,
        sharp_angle: _Number = ...,
        repair: Literal["auto", "keep", "wrap", "refuse"] = ...,
        thickness: _Number = ...,
        weld_distance: Union[_Number, Literal["auto"]] = ...,
        wrap_detail: _Number = ...,
        noise: _Number = ...,
        noise_scale: _Number = ...,
        interior_detail: _Number = ...,
        interior_smooth_angle: _Number = ...,
        rim_width: _Number = ...,
        toughness_map: str = ...,
        yield_map: str = ...,
        density_map: str = ...,
        clusters: _Integer = ...,
        cluster_toughness: _Number = ...,
        weak_interface_share: _Number = ...,
    ) -> Node:
        """Cuts a closed mesh into fragments that share their break surfaces exactly.

        mesh: A closed surface that bounds a solid.
        method: voronoi: along the Voronoi cells of `sites`, with flat break surfaces; the mesh's own triangles, UVs and
            normals stay. kmeans: small cells of `source` gathered into pieces of like size, with rough break surfaces.
        pieces: Number of fragments wanted; sites grid and points have about or exactly their own. Needs method =
            kmeans, or sites = kmeans, uniform, poisson, impact, grid or density.
        seed: Chooses among cuts of the same kind; the same seed gives the same cut.
        sites: Where method voronoi has its pieces. kmeans: pieces of like size; uniform: anywhere, large and small
            ones; poisson: spread, but irregular; impact: the smaller the nearer to `points`; grid: cubes; points: one
            piece around each of `points`; density: more of them near `density_group`. Needs method = voronoi.
        points: In the mesh's coordinates: where it is hit (sites impact), or the sites themselves (sites points) [m].
            Needs method = voronoi and sites = impact or points.
        impact_shape: What `points` are with sites impact. points: each is hit; curve: the line through them is. Needs
            method = voronoi and sites = impact.
        impact_radius: Within it pieces of an impact are alike; beyond it their size grows with the distance [m]. Needs
            method = voronoi and sites = impact.
        grid_jitter: How far sites of a grid leave their places; 0: cubes, 1: anywhere in their grid cells. Needs method
            = voronoi and sites = grid.
        density_group: Vertex group of the mesh, or vertex attribute from 0 to 1, that sites density gather at. Needs
            method = voronoi and sites = density.
        density_factor: How many times more pieces a volume has at the density group than away from it. Needs method =
            voronoi and sites = density.
        source: Cells that method kmeans gathers. tets: tetrahedra, the paper's way, the surface is meshed anew;
            voronoi: small Voronoi cells, the mesh's own surface stays. Needs method = kmeans.
        cells_per_piece: Cells that method kmeans aims at for each fragment: more tetrahedra follow the surface closer
            and cost more. Needs method = kmeans.

        Pieces:
        sheets: auto: where the mesh is thinner than a piece is large, sites lie in the middle between its faces, evenly
            spread: one piece through the thickness, walls along it; sites grid and points stay. off: anywhere within
            the thickness. Needs method = voronoi and sites = kmeans, uniform, poisson, impact or density, or method =
            voronoi and roughness > 1.0, or method = kmeans and source = voronoi.
        least_piece: Pieces of method voronoi below this share of their neighbours' volume join the neighbour that they
            share most area with. Needs method = voronoi and roughness = 1.
        sharp_angle: Edges sharper than this stay edges with method kmeans; 0 decides by the mesh [degrees]. Needs
            method = kmeans and source = tets.

        Break Surfaces:
        roughness: Voronoi cells that a piece is made of: 1 has flat break surfaces, 8 rough ones, with several times as
            many triangles. Needs method = voronoi.
        noise: How far break surfaces leave their planes, as a share of a piece's size (cube root of the mean volume).
            Both sides stay the same, the outer surface stays where it is, and what would intersect moves less; 0: not
            at all.
        noise_scale: Distance between bumps of the noise, as a share of a piece's size; break surfaces get four edges a
            bump. Needs noise > 0.0.
        interior_detail: Longest edge of break surfaces, as a share of a piece's size; 0: as they are cut, or as the
            noise needs.
        interior_smooth_angle: Break surfaces are shaded smooth across edges flatter than this; 0: every triangle is
            flat [degrees].
        rim_width: The attribute `rim` of break surfaces is 1 where they meet the outer surface and falls to 0 within
            this; it follows the surface's triangles, which `interior_detail` makes finer [m].

        Repair:
        repair: What is done about a mesh that is no solid; what was done is told as a warning. keep: the mesh's own
            triangles stay, welded, oriented, holes closed; wrap: a new surface around them; auto: keep, or where that
            cannot be cut, wrap; refuse: nothing, it is an error.
        thickness: Open sheets become walls as thick as this, their surface the outer side; 0: they are refused [m].
            Needs repair = auto, keep or wrap.
        weld_distance: How far apart the sides of a seam may lie to be welded, where the mesh is open; auto: found from
            the gap between boundary edges that run side by side; 0: equal positions alone [m]. Needs repair = auto or
            keep, or repair = wrap and thickness > 0.0.
        wrap_detail: Share of the mesh's diagonal: gaps and details narrower than this are lost in a wrap; smaller ones
            cost triangles. Needs repair = auto or wrap.

        Strength:
        toughness_map: Vertex attribute of the mesh, or red, green, blue or alpha of its colours, that is the factor on
            the body's toughness from place to place; empty: none.
        yield_map: Vertex attribute of the mesh, or red, green, blue or alpha of its colours, that is the factor on the
            body's yield from place to place; empty: none.
        density_map: Vertex attribute of the mesh, or red, green, blue or alpha of its colours, that is the factor on
            the body's density from place to place; empty: none.
        clusters: Number of large pieces that the body breaks into first, each then into its fragments; 0: fragments are
            not gathered.
        cluster_toughness: Factor on the toughness of interfaces within a cluster. Needs clusters > 0.0.
        weak_interface_share: Interfaces of a smaller area, as a share of its fragments' cross-section, do not hold by
            themselves: they part with what is around them.
        """

    @overload
    def add(
        self,
        type: Literal["fragment_region"],
        name: str,
        *,
        fragments: _Wire = ...,
        region: Literal["all", "box", "sphere", "group", "cluster"] = ...,
        box_min: _Vector3 = ...,
        box_max: _Vector3 = ...,
        center: _Vector3 = ...,
        radius: _Number = ...,
        group: str = ...,
        cluster: _Integer = ...,
        toughness: _Number = ...,
        density: _Number = ...,
        interface_toughness: Optional[_Number] = ...,
    ) -> Node:
        """Makes a part of the fragments tougher, weaker, softer or heavier than their body, or glues it. Several can
        follow one another: their factors multiply.

        fragments: Of a cut or a lattice.
        region: Fragments whose centre lies in it, in the fragments' own coordinates. all: every one; box takes
            `box_min` and `box_max`; sphere takes `center` and `radius`; group takes `group`; cluster takes `cluster`.
        box_min: Lowest corner of the box [m]. Needs region = box.
        box_max: Highest corner of the box [m]. Needs region = box.
        center: Of the sphere [m]. Needs region = sphere.
        radius: Of the sphere [m]. Needs region = sphere.
        group: Vertex group of the mesh: fragments that own one of its vertices. Needs region = group.
        cluster: Number of a cluster, as pre-fracture gathered them. Needs region = cluster.
        toughness: Factor on the body's toughness around the region's fragments.
        yield: Factor on the body's yield around the region's fragments.
        density: Factor on the body's density in the region's fragments.
        interface_toughness: Factor on the toughness of interfaces between two of the region's fragments, below 1 weak;
            null: glued, they never break.

        yield, a word of Python, is set in the node: node["yield"] = ...
        """

    @overload
    def add(
        self,
        type: Literal["body"],
        name: str,
        *,
        fragments: _Wire = ...,
        position: _Vector3 = ...,
        rotation: _Vector3 = ...,
        velocity: _Vector3 = ...,
        angular_velocity: _Vector3 = ...,
        settle: bool = ...,
        density: _Number = ...,
        youngs_modulus: Union[_Number, _Animation] = ...,
        poisson_ratio: Union[_Number, _Animation] = ...,
        damping_time: Union[_Number, Literal["auto"], _Animation] = ...,
        flow_rate: Union[_Number, _Animation] = ...,
        hardening: Union[_Number, _Animation] = ...,
        toughness: Optional[Union[_Number, _Animation]] = ...,
        compressive_toughness: Optional[Union[_Number, _Animation]] = ...,
        fracture_energy: Optional[Union[_Number, Literal["auto"], _Animation]] = ...,
        stiffness: Union[_Number, _Animation] = ...,
        friction: Union[_Number, _Animation] = ...,
        restitution: Union[_Number, _Animation] = ...,
        curvature: bool = ...,
        slender: Literal["auto", "always", "never"] = ...,
    ) -> Node:
        """Gives fragments a material, a place and a start; one set of fragments may serve many bodies.

        fragments: What the body is made of.
        density: Mass per volume [kg/m3].
        youngs_modulus: Stiffness: stress per stretch (rubber 1e6, wood 1e10, steel 2e11) [Pa].
        yield: Change of shape (logarithmic strain without its change of volume) from which it stays dented; null:
            never.
        hardening: Growth of the yield per permanent strain. Needs yield is not null.
        toughness: Stretch (principal logarithmic strain) at which it tears; null: never.
        fracture_energy: Work that parts an area of an interface beyond its toughness: high, cracks run through and
            leave large pieces, low, things crumble. Of method projective; null: groups of fragments break at once, by
            their mean stretch. "auto": E toughness^2 L / 2, L a quarter of the body's longest side [J/m2]. Needs
            toughness is not null, or compressive_toughness is not null.

        Start:
        position: Where the origin of the fragments is put at the first frame [m].
        rotation: How the fragments are turned about their origin at the first frame; Euler angles XYZ: about x first,
            then y, then z [degrees].
        velocity: Velocity at the first frame [m/s].
        angular_velocity: Rate of turning at the first frame, about the centre of mass: its axis times degrees per
            second [degrees/s].
        settle: Comes to rest under its own weight before the first frame, where nothing breaks and what does not settle
            stands still. Else its weight arrives all at once.

        Material:
        poisson_ratio: Thinning across per stretch along; solids keep their volume better as it nears 0.5.
        damping_time: Damping inside the material, stress by strain rate over stiffness: a free vibration of period T
            falls by exp(-2 pi^2 x this / T) each time. Where something touches, substeps longer than this damp more by
            themselves; none in gauss_seidel. "auto": 0.3 of the time that a wave takes through a fragment of the body's
            mean size, so that what a hit sets ringing dies away as soon in stiff bodies as in soft ones, and not before
            they bounce [s].
        flow_rate: How fast strain beyond the yield becomes permanent: its share per second [1/s]. Needs yield is not
            null.
        compressive_toughness: Squeeze (principal logarithmic strain) at which it is crushed; null: never.
        stiffness: Of the solver's method gauss_seidel alone: share of the way to the goal shape per iteration.
        curvature: Sheets and rods that are one fragment thick resist bending, yield and tear as plates and beams of
            their thickness do; off: as stiff as blocks, and they spring back. Methods other than projective leave it
            out.
        slender: What is a few fragments thick resists bending, yields and tears as beams and plates do, at some four
            times the cost of blocks, which bend too little and spring back. Methods other than projective leave it out.
            "auto": where two to four fragments lie through the thickness of a body that yields or never tears;
            "always": all of it.

        Contact:
        friction: Coulomb friction: tangential force per normal force that a contact can bear before it slides.
        restitution: Share of the approach speed with which a contact bounces.

        yield, a word of Python, is set in the node: node["yield"] = ...
        """

    @overload
    def add(
        self,
        type: Literal["body_region"],
        name: str,
        *,
        body: _Wire = ...,
        region: Literal["all", "box", "sphere", "group", "cluster"] = ...,
        box_min: _Vector3 = ...,
        box_max: _Vector3 = ...,
        center: _Vector3 = ...,
        radius: _Number = ...,
        group: str = ...,
        cluster: _Integer = ...,
        toughness: Union[_Number, _Animation] = ...,
        stiffness: Union[_Number, _Animation] = ...,
        fracture_energy: Union[_Number, _Animation] = ...,
    ) -> Node:
        """Makes a part of a body tougher, weaker, softer or stiffer, for all of the shot or with time; nothing is cut
        anew. Several can follow one another: their factors multiply.

        body: Of which it is a part.
        region: Fragments whose centre lies in it, with the body as placed at the first frame. all: every one; box takes
            `box_min` and `box_max`; sphere takes `center` and `radius`; group takes `group`; cluster takes `cluster`.
        box_min: Lowest corner of the box [m]. Needs region = box.
        box_max: Highest corner of the box [m]. Needs region = box.
        center: Of the sphere [m]. Needs region = sphere.
        radius: Of the sphere [m]. Needs region = sphere.
        group: Vertex group of the mesh: fragments that own one of its vertices. Needs region = group.
        cluster: Number of a cluster, as pre-fracture gathered them. Needs region = cluster.
        toughness: Factor on the body's toughnesses.
        yield: Factor on the body's yield, and on what yields have grown to by hardening.
        stiffness: Factor on the body's Young's modulus.
        fracture_energy: Factor on the body's fracture energy; an automatic one goes with `toughness` squared and
            `stiffness`, too.

        yield, a word of Python, is set in the node: node["yield"] = ...
        """

    @overload
    def add(
        self,
        type: Literal["follow"],
        name: str,
        *,
        body: _Wire = ...,
        mesh: _Wire = ...,
        motion: Literal["transform", "vertices"] = ...,
        position: Union[_Vector3, _Animation] = ...,
        rotation: Union[_Vector3, _Animation] = ...,
        frame: Optional[_Integer] = ...,
        source: Literal["file", "values"] = ...,
        path: _Path = ...,
        positions: _Points = ...,
        first_frame: _Integer = ...,
        source_strain: Literal["rest", "elastic"] = ...,
    ) -> Node:
        """A body follows an animation, of its place or of each vertex of its mesh, until it is let go with the speed and
        spin that it has. `activate` nodes behind it say when and where that is for the fragments that they hold.

        body: What follows.
        mesh: Of `motion` vertices: the mesh that the body was cut from.
        motion: transform: the body moves as one, by `position` and `rotation`; vertices: each vertex of its mesh is
            where `path` or `positions` say.
        position: Where the origin of the fragments is [m]. Needs motion = transform.
        rotation: How the fragments are turned about their origin; Euler angles XYZ: about x first, then y, then z
            [degrees]. Needs motion = transform.
        frame: First frame at which it has let go; null: it follows to the end, but for what `activate` nodes let go.
        source: file: places stand in a file of their own; values: in the graph. Needs motion = vertices.
        path: A .npy file of shape (frames, vertices, 3), floats, m, in the scene; relative to the graph file's folder.
            Needs motion = vertices and source = file.
        positions: Where each vertex of the mesh is in the scene, in the order of the mesh as read, equal positions
            being one; frame after frame [m]. Needs motion = vertices and source = values.
        first_frame: Of the first of these; before it, and after the last, the mesh stands. Needs motion = vertices.
        source_strain: What the animation's stretch is to the body once it is let go. rest: the shape that it has then
            is its rest, but for a change of volume; elastic: it springs back, and breaks where that is too much. Needs
            motion = vertices.
        """

    @overload
    def add(
        self,
        type: Literal["activate"],
        name: str,
        *,
        body: _Wire = ...,
        object: _Wire = ...,
        mode: Literal["held", "asleep", "glued"] = ...,
        region: Literal["all", "box", "sphere", "group", "cluster"] = ...,
        box_min: _Vector3 = ...,
        box_max: _Vector3 = ...,
        center: _Vector3 = ...,
        radius: _Number = ...,
        group: str = ...,
        cluster: _Integer = ...,
        until: Literal["frame", "object", "contact", "neighbour"] = ...,
        frame: _Integer = ...,
        impulse: _Number = ...,
        delay: _Integer = ...,
        growth: _Number = ...,
        falloff: _Number = ...,
    ) -> Node:
        """Keeps fragments from moving, or their edges from breaking, until a condition comes for each. Several can follow
        one another: where two speak of a fragment, the later one counts.

        body: Whose fragments these are.
        object: Of `until` object: what comes over the fragments, on its keys. It need not be wired to the solver, and
            pushes nothing unless it is.
        mode: held: does not move, and is there to be hit; asleep: not simulated until something touches its piece, or
            the condition comes; glued: no edge of it breaks.
        region: Fragments whose centre lies in it, with the body as placed at the first frame. all: every one; box takes
            `box_min` and `box_max`; sphere takes `center` and `radius`; group takes `group`; cluster takes `cluster`.
        box_min: Lowest corner of the box [m]. Needs region = box.
        box_max: Highest corner of the box [m]. Needs region = box.
        center: Of the sphere [m]. Needs region = sphere.
        radius: Of the sphere [m]. Needs region = sphere.
        group: Vertex group of the mesh: fragments that own one of its vertices. Needs region = group.
        cluster: Number of a cluster, as pre-fracture gathered them. Needs region = cluster.
        until: frame: at `frame`; object: when the object comes over a fragment; contact: when something else pushes a
            fragment by more than `impulse`; neighbour: when an edge of a fragment or of one beside it breaks.
        frame: First frame at which it has let go. Needs until = frame.
        impulse: Of a fragment's contacts in this frame and the one before, that they have to exceed; 0: any touch will
            do [N s]. Needs until = contact.
        delay: From the object's touch until it lets go [frames]. Needs until = object.
        growth: How fast it spreads through the region from what was touched; 0: it does not [m/s]. Needs until =
            object.
        falloff: How far beyond its surface the object lets go: at the surface of all fragments, so far away of none,
            between of the fewer the farther [m]. Needs until = object.
        """

    @overload
    def add(
        self,
        type: Literal["seam"],
        name: str,
        *,
        body: _Wire = ...,
        mode: Literal["break", "hold", "scale"] = ...,
        toughness: Union[_Number, _Animation] = ...,
        between: Literal["groups", "clusters", "curve", "all", "box", "sphere", "places"] = ...,
        group: str = ...,
        other_group: str = ...,
        points: _Points = ...,
        spared: _Points = ...,
        distance: _Number = ...,
        box_min: _Vector3 = ...,
        box_max: _Vector3 = ...,
        center: _Vector3 = ...,
        radius: _Number = ...,
        angle: Optional[_Number] = ...,
        direction: _Vector3 = ...,
        least_area: _Number = ...,
        most_area: Optional[_Number] = ...,
        frame: Optional[_Integer] = ...,
        frames: _Integer = ...,
    ) -> Node:
        """Tells interfaces of a body when to break, or not to, or makes them weaker or tougher. Several can follow one
        another: factors multiply, and what one holds no other breaks.

        body: Whose interfaces these are.
        mode: break: they break at `frame`, or weaken from there on; hold: they cannot break before; scale: they bear
            `toughness` times as much strain.
        toughness: Factor on their toughness; the fracture energy goes by its square, so that they open as far as others
            before they part. Needs mode = scale.
        between: Which interfaces: groups: of fragments of `group` with those of `other_group`; clusters: of different
            clusters; curve: nearer than `distance` to the line through `points`; all; box takes `box_min` and
            `box_max`; sphere takes `center` and `radius`; places: nearer than `distance` to one of `points`, and to
            none of `spared` nearer still. What counts is an interface's middle, with the body as placed at the first
            frame.
        group: Vertex group of the mesh: fragments that own one of its vertices. Needs between = groups.
        other_group: Likewise; empty: all that are not in the one. Needs between = groups.
        points: Of the line, or places, in the scene, with the body as placed at the first frame [m]. Needs between =
            curve or places.
        spared: Places, likewise, that are left out: an interface goes by what is nearest to it [m]. Needs between =
            places.
        distance: From the line, or a place, to the middle of an interface [m]. Needs between = curve or places.
        box_min: Lowest corner of the box [m]. Needs between = box.
        box_max: Highest corner of the box [m]. Needs between = box.
        center: Of the sphere [m]. Needs between = sphere.
        radius: Of the sphere [m]. Needs between = sphere.
        frame: At which they are broken; from which on they may break; null: never. Needs mode = break or hold.
        frames: How long it takes from that frame on: a factor on their toughness falls to 0, where what is left of them
            breaks; 0: at once [frames]. Needs mode = break and frame is not null.

        Only:
        angle: Only interfaces whose normal is at most so far from `direction`: 0 takes those that lie across it, 90
            all; null: all [degrees].
        direction: That `angle` is measured from; either of its two ways. Needs angle is not null.
        least_area: Only interfaces of at least this area, as a share of its fragments' cross-section.
        most_area: Only interfaces of at most this area, likewise; null: however large.
        """

    @overload
    def add(
        self,
        type: Literal["rigid_body"],
        name: str,
        *,
        shape: Literal["sphere", "box"] = ...,
        radius: _Number = ...,
        size: _Vector3 = ...,
        mass: _Number = ...,
        position: _Vector3 = ...,
        rotation: _Vector3 = ...,
        velocity: _Vector3 = ...,
        angular_velocity: _Vector3 = ...,
        settle: bool = ...,
        friction: _Number = ...,
        restitution: _Number = ...,
    ) -> Node:
        """A sphere or box that keeps its shape, pushes with its mass and is pushed.

        shape: sphere takes `radius`, box takes `size`.
        radius: Of the sphere [m]. Needs shape = sphere.
        size: Lengths of the box's sides [m]. Needs shape = box.
        mass: Spread evenly over the shape [kg].

        Start:
        position: Of the centre at the first frame [m].
        rotation: About the centre at the first frame; Euler angles XYZ: about x first, then y, then z [degrees].
        velocity: Velocity at the first frame [m/s].
        angular_velocity: Rate of turning at the first frame, about the centre of mass: its axis times degrees per
            second [degrees/s].
        settle: Comes to rest under its own weight before the first frame, where nothing breaks and what does not settle
            stands still. Else its weight arrives all at once.

        Contact:
        friction: Coulomb friction: tangential force per normal force that a contact can bear before it slides.
        restitution: Share of the approach speed with which a contact bounces.
        """

    @overload
    def add(
        self,
        type: Literal["collider"],
        name: str,
        *,
        mesh: _Wire = ...,
        shape: Literal["plane", "sphere", "box", "capsule", "mesh"] = ...,
        position: Union[_Vector3, _Animation] = ...,
        rotation: Union[_Vector3, _Animation] = ...,
        radius: _Number = ...,
        size: _Vector3 = ...,
        height: _Number = ...,
        friction: _Number = ...,
        restitution: _Number = ...,
        path: _Path = ...,
        scale: _Number = ...,
        resolution: _Integer = ...,
        voxel_size: Optional[_Number] = ...,
        thickness: _Number = ...,
        motion: Literal["transform", "vertices"] = ...,
        motion_source: Literal["file", "values"] = ...,
        motion_path: _Path = ...,
        positions: _Points = ...,
        first_frame: _Integer = ...,
    ) -> Node:
        """A solid that moves as its keys tell it, or deforms as an animation does, and is pushed by nothing: floor, wall,
        tool, arm.

        mesh: Of shape mesh: a closed surface that bounds a solid.
        shape: plane: all below z = 0 of its own frame; sphere takes `radius`; box takes `size`; capsule takes `radius`
            and `height` along its z axis; mesh takes any solid from `mesh` or `path`, as distances on a grid of voxels,
            or as its triangles where it deforms.
        position: Of its centre, of a point of the plane, or of the mesh's origin [m]. Needs motion = transform, or
            shape = plane, sphere, box or capsule.
        rotation: About its position; Euler angles XYZ: about x first, then y, then z [degrees]. Needs motion =
            transform, or shape = plane, sphere, box or capsule.
        radius: Of sphere and capsule [m]. Needs shape = sphere or capsule.
        size: Lengths of the box's sides [m]. Needs shape = box.
        height: Of the capsule between the centres of its two caps [m]. Needs shape = capsule.
        path: Of the file with the mesh of shape mesh, where none is wired; relative to the graph file's folder. Needs
            shape = mesh.
        scale: Lengths of the mesh are multiplied by this, about its origin. Needs shape = mesh and motion = transform.
        motion: Of shape mesh. transform: it moves as one, by `position` and `rotation`; vertices: it deforms, each
            vertex being where `motion_path` or `positions` say. Needs shape = mesh.
        motion_source: file: places stand in a file of their own; values: in the graph. Needs shape = mesh and motion =
            vertices.
        motion_path: A .npy file of shape (frames, vertices, 3), floats, m, in the scene; relative to the graph file's
            folder. Needs shape = mesh and motion = vertices and motion_source = file.
        positions: Where each vertex of the mesh is in the scene, in the order of the mesh as read, equal positions
            being one; frame after frame [m]. Needs shape = mesh and motion = vertices and motion_source = values.
        first_frame: Of the first of these; before it, and after the last, the mesh stands. Needs shape = mesh and
            motion = vertices.

        Contact:
        friction: Coulomb friction: tangential force per normal force that a contact can bear before it slides.
        restitution: Share of the approach speed with which a contact bounces.

        Sampling:
        resolution: Voxels along the mesh's longest side. What is thinner than two voxels is lost, edges are rounded by
            a third of one; memory grows with the cube: 100 takes 5 MiB at most, 256 MiB are permitted. Needs shape =
            mesh and motion = transform and voxel_size = null.
        voxel_size: Sets the size of voxels itself; null goes by the resolution [m]. Needs shape = mesh and motion =
            transform.
        thickness: Above 0 the mesh need not be closed: what collides is all within half of this of its surface. Of
            motion transform at least two voxels [m]. Needs shape = mesh.
        """

    @overload
    def add(
        self,
        type: Literal["pin"],
        name: str,
        *,
        body: _Wire = ...,
        mesh: _Wire = ...,
        region: Literal["box", "sphere", "group"] = ...,
        box_min: _Vector3 = ...,
        box_max: _Vector3 = ...,
        center: _Vector3 = ...,
        radius: _Number = ...,
        group: str = ...,
        pivot: _Vector3 = ...,
        position: Union[_Vector3, _Animation] = ...,
        rotation: Union[_Vector3, _Animation] = ...,
        hold: Literal["pose", "position"] = ...,
        release_frame: Optional[_Integer] = ...,
        release_frames: _Integer = ...,
        motion: Literal["transform", "vertices", "surface"] = ...,
        motion_source: Literal["file", "values"] = ...,
        motion_path: _Path = ...,
        positions: _Points = ...,
        first_frame: _Integer = ...,
    ) -> Node:
        """Holds the particles whose rest centre lies in its region, and moves them rigidly about its pivot, or each with
        an animated mesh, their own or another. Region, pivot and motion are given in the scene, with the body as placed
        at the first frame.

        body: The body that is held.
        mesh: Of `motion` vertices the mesh that the body was cut from, of surface any other.
        region: box takes `box_min` and `box_max`; sphere takes `center` and `radius`; group takes `group`.
        box_min: Lowest corner of the box [m]. Needs region = box.
        box_max: Highest corner of the box [m]. Needs region = box.
        center: Of the sphere [m]. Needs region = sphere.
        radius: Of the sphere [m]. Needs region = sphere.
        group: Vertex group of the mesh: fragments that own one of its vertices are held. Needs region = group.
        hold: pose holds places and turns, as a clamp; position holds places alone, as a hinge: what is held turns with
            what it is part of (methods other than projective hold the pose).
        release_frame: Last frame at which it holds; null: it never lets go.
        release_frames: How long it takes to let go: what was held by force eases out, and does not spring; 0: at once
            [frames]. Needs release_frame is not null.

        Motion:
        pivot: Point about which the rotation turns [m]. Needs motion = transform.
        position: How far the held particles are moved from where they rest [m]. Needs motion = transform.
        rotation: How far the held particles are turned about the pivot; Euler angles XYZ: about x first, then y, then z
            [degrees]. Needs motion = transform.
        motion: transform: what is held moves as one, by `position` and `rotation`; vertices: each fragment goes where
            the vertices of its own mesh take it; surface: each goes as the triangle of another mesh takes it that is
            nearest at the first frame. Where the mesh is, `motion_path` or `positions` say.
        motion_source: file: places stand in a file of their own; values: in the graph. Needs motion = vertices or
            surface.
        motion_path: A .npy file of shape (frames, vertices, 3), floats, m, in the scene; relative to the graph file's
            folder. Needs motion = vertices or surface and motion_source = file.
        positions: Where each vertex of the mesh is in the scene, in the order of the mesh as read, equal positions
            being one; frame after frame [m]. Needs motion = vertices or surface and motion_source = values.
        first_frame: Of the first of these; before it, and after the last, the mesh stands. Needs motion = vertices or
            surface.
        """

    @overload
    def add(
        self,
        type: Literal["force"],
        name: str,
        *,
        acceleration: Union[_Vector3, _Animation] = ...,
        wind: Union[_Vector3, _Animation] = ...,
        drag: Union[_Number, _Animation] = ...,
        gusts: Union[_Number, _Animation] = ...,
        gust_time: _Number = ...,
        gust_seed: _Integer = ...,
    ) -> Node:
        """An acceleration that all particles feel, and a wind that drags them along.

        acceleration: Added to the solver's gravity [m/s2].
        wind: Velocity of the air [m/s]. Needs drag > 0.0.
        drag: How fast the wind takes particles along: acceleration = drag x (wind - velocity); 0: no wind [1/s].

        Gusts:
        gusts: By how much of itself the wind grows and drops, at most. Needs drag > 0.0.
        gust_time: From gust to lull, more or less [s]. Needs drag > 0.0 and gusts > 0.0.
        gust_seed: Other gusts. Needs drag > 0.0 and gusts > 0.0.
        """

    @overload
    def add(
        self,
        type: Literal["blast"],
        name: str,
        *,
        frame: _Integer = ...,
        position: Union[_Vector3, _Animation] = ...,
        strength: Literal["speed", "energy"] = ...,
        speed: _Number = ...,
        energy: _Number = ...,
        radius: _Number = ...,
        falloff: _Number = ...,
        reach: Optional[_Number] = ...,
        spread: Literal["all", "cone"] = ...,
        direction: Union[_Vector3, _Animation] = ...,
        angle: _Number = ...,
        shadow: Literal["none", "solids", "all"] = ...,
    ) -> Node:
        """Throws everything away from a place, at once: an explosion. What pins hold stays.

        frame: When it goes off: the state of this frame is the last before it.
        position: Its centre; where it moves, that of its frame counts [m].
        strength: speed: everything is given a velocity, whatever it weighs; energy: the same, and as fast as makes that
            energy of all that it reaches.
        speed: Given at the radius, where it is largest [m/s]. Needs strength = speed.
        energy: Kinetic energy that all would be given if nothing moved before [J]. Needs strength = energy.
        radius: Where it is strongest: evenly weaker from there to the centre, and outwards by the falloff [m].
        falloff: n: at distance r beyond the radius it is (radius / r)^n as strong; 0: no weaker.

        Reach:
        reach: Beyond this distance there is nothing of it; null: no such bound [m].
        shadow: What keeps it from things that lie behind: nothing; solids, which are colliders and rigid bodies; all,
            fragments too.

        Direction:
        spread: all: to all sides; cone: to those around a direction.
        direction: Middle of the cone. Needs spread = cone.
        angle: Between the middle of the cone and its side [degrees]. Needs spread = cone.
        """

    @overload
    def add(
        self,
        type: Literal["point_force"],
        name: str,
        *,
        position: Union[_Vector3, _Animation] = ...,
        strength: Union[_Number, _Animation] = ...,
        radius: _Number = ...,
        falloff: _Number = ...,
        reach: Optional[_Number] = ...,
    ) -> Node:
        """Pushes everything away from a place, or draws it there, all the time.

        position: Its centre [m].
        strength: Acceleration at the radius, where it is largest; below 0 it draws in [m/s2].
        radius: Where it is strongest: evenly weaker from there to the centre, and outwards by the falloff [m].
        falloff: n: at distance r beyond the radius it is (radius / r)^n as strong; 0: no weaker.

        Reach:
        reach: Beyond this distance there is nothing of it; null: no such bound [m].
        """

    @overload
    def add(
        self,
        type: Literal["vortex"],
        name: str,
        *,
        position: Union[_Vector3, _Animation] = ...,
        axis: Union[_Vector3, _Animation] = ...,
        swirl: Union[_Number, _Animation] = ...,
        inflow: Union[_Number, _Animation] = ...,
        lift: Union[_Number, _Animation] = ...,
        radius: _Number = ...,
        falloff: _Number = ...,
        reach: Optional[_Number] = ...,
        acts_as: Literal["wind", "acceleration"] = ...,
        drag: Union[_Number, _Animation] = ...,
    ) -> Node:
        """Takes everything round an axis: a whirlwind.

        position: A point of the axis [m].
        axis: It turns about this, counter-clockwise as seen from its tip.
        swirl: Round the axis, at the radius, where it is largest [m/s or m/s2].
        radius: Where it is strongest: evenly weaker from there to the centre, and outwards by the falloff [m].
        falloff: n: at distance r beyond the radius it is (radius / r)^n as strong; 0: no weaker.
        acts_as: wind: its numbers are velocities of the air, which drags things along; acceleration: they are
            accelerations.
        drag: How fast the wind takes things along: acceleration = drag x (wind - velocity) [1/s]. Needs acts_as = wind.

        Draught:
        inflow: Towards the axis, at the radius [m/s or m/s2].
        lift: Along the axis: so much within the radius [m/s or m/s2].

        Reach:
        reach: Beyond this distance there is nothing of it; null: no such bound [m].
        """

    @overload
    def add(
        self,
        type: Literal["turbulence"],
        name: str,
        *,
        strength: Union[_Number, _Animation] = ...,
        size: _Number = ...,
        octaves: _Integer = ...,
        seed: _Integer = ...,
        period: Optional[_Number] = ...,
        acts_as: Literal["wind", "acceleration"] = ...,
        drag: Union[_Number, _Animation] = ...,
        reach: Optional[_Number] = ...,
        position: Union[_Vector3, _Animation] = ...,
    ) -> Node:
        """Eddies everywhere: what drifts in them neither gathers nor thins out.

        strength: Root of the mean square of what it is everywhere [m/s or m/s2].
        size: Of its largest eddies [m].
        octaves: Sizes of eddies: each half as large and half as fast as the one before.
        seed: Other eddies.
        period: How long it takes until they are other eddies; null: they stay [s].
        acts_as: wind: its numbers are velocities of the air, which drags things along; acceleration: they are
            accelerations.
        drag: How fast the wind takes things along: acceleration = drag x (wind - velocity) [1/s]. Needs acts_as = wind.

        Reach:
        reach: There are none farther away from a place; null: they are everywhere [m].
        position: From where [m]. Needs reach is not null.
        """

    @overload
    def add(
        self,
        type: Literal["guide"],
        name: str,
        *,
        body: _Wire = ...,
        state: _Wire = ...,
        strength: Union[_Number, _Animation] = ...,
        target: Literal["rest", "state"] = ...,
        target_frame: _Integer = ...,
        position: Union[_Vector3, _Animation] = ...,
        rotation: Union[_Vector3, _Animation] = ...,
        pivot: _Vector3 = ...,
    ) -> Node:
        """Draws the fragments of a body to a pose: back to where they were, or to where they shall be. What pins hold
        stays.

        body: The body that is drawn.
        state: Of another solver that moves the same body: a frame of it is where fragments are drawn to.
        strength: How fast: what is free has come most of the way in 4 / strength; 0: not at all [1/s].
        target: rest: as placed at the first frame; state: as at a frame of the state.
        target_frame: Of the state. Needs target = state.

        Motion:
        position: How far the target is moved from there [m].
        rotation: How far the target is turned about the pivot; Euler angles XYZ: about x first, then y, then z
            [degrees].
        pivot: Point about which the rotation turns [m].
        """

    @overload
    def add(
        self,
        type: Literal["grid_force"],
        name: str,
        *,
        source: Literal["values", "file"] = ...,
        path: _Path = ...,
        values: _Points = ...,
        nodes: _Integer3 = ...,
        box_min: _Vector3 = ...,
        box_max: _Vector3 = ...,
        first_frame: _Integer = ...,
        strength: Union[_Number, _Animation] = ...,
        acts_as: Literal["wind", "acceleration"] = ...,
        drag: Union[_Number, _Animation] = ...,
    ) -> Node:
        """Any field, as vectors at the nodes of a box: what a script worked out, or another program. Between nodes it is
        linear, outside of the box there is nothing.

        source: values: they stand in the graph; file: in a file of their own.
        path: A JSON file {"nodes": [i, j, k], "box_min": [x, y, z], "box_max": ..., "values": [[x, y, z], ...],
            "first_frame": n}, relative to the graph file's folder. Needs source = file.
        values: A vector for each node, z fastest, then y, then x; as often as there are frames, one after the other
            [m/s or m/s2]. Needs source = values.
        nodes: How many there are along each side of the box. Needs source = values.
        box_min: Lowest corner of the box, the first node [m]. Needs source = values.
        box_max: Highest corner of the box, the last node [m]. Needs source = values.
        strength: A factor on the values.
        acts_as: wind: its numbers are velocities of the air, which drags things along; acceleration: they are
            accelerations.
        drag: How fast the wind takes things along: acceleration = drag x (wind - velocity) [1/s]. Needs acts_as = wind.

        Time:
        first_frame: Of the first of several grids, one a frame; before and after, the first and the last one stay.
            Needs source = values.
        """

    @overload
    def add(
        self,
        type: Literal["pressure"],
        name: str,
        *,
        body: _Wire = ...,
        pressure: Union[_Number, _Animation] = ...,
        vent: _Number = ...,
    ) -> Node:
        """Blows a closed hollow body up from inside until it bursts. The pressure drops as the body opens.

        body: Of a mesh with a surface inside that encloses a hollow.
        pressure: Above that outside, while the body is closed [Pa].
        vent: Share of the surface inside that is open when the pressure has dropped to half.
        """

    @overload
    def add(
        self,
        type: Literal["solver"],
        name: str,
        *,
        bodies: _Wires = ...,
        rigid_bodies: _Wires = ...,
        colliders: _Wires = ...,
        pins: _Wires = ...,
        forces: _Wires = ...,
        method: Literal["projective", "jacobi", "gauss_seidel"] = ...,
        preset: Literal["preview", "default", "final"] = ...,
        substeps: Optional[_Integer] = ...,
        iterations: Optional[_Integer] = ...,
        hit_substeps: Optional[_Integer] = ...,
        crack_passes: _Integer = ...,
        error_budget: _Number = ...,
        over_relaxation: _Number = ...,
        gravity: Union[_Vector3, _Animation] = ...,
        damping: _Number = ...,
        depenetration_speed: _Number = ...,
        self_collision: bool = ...,
        sleeping: bool = ...,
        time_scale: Union[_Number, _Animation] = ...,
        accelerations: bool = ...,
    ) -> Node:
        """Moves all bodies together, dents and tears them. Frames that were simulated are kept, and a frame is reached
        from the last one before it that still holds.

        bodies: What may dent and tear.
        rigid_bodies: What pushes and is pushed.
        colliders: What all else collides with.
        pins: What holds and moves parts of the bodies.
        forces: Acceleration fields and winds, added up.
        method: projective: stiffness in Pa, however stiff; jacobi: the same by cheap sweeps that leave stiff bodies too
            soft; gauss_seidel: the paper's, for comparison, with the bodies' `stiffness` as a share per sweep.
        preset: Speed against accuracy, as docs/images/chart.svg shows it: preview: 4 substeps of 1, hits in up to 16
            parts, default: 8 substeps of 2, hits in up to 16 parts, final: 32 substeps of 1, hits in up to 64 parts;
            what substeps, iterations or hit_substeps say goes before. Needs substeps = null and error_budget = 0.0, or
            iterations = null and error_budget = 0.0, or hit_substeps = null and method = projective.
        substeps: Steps per frame: more for stiff materials and fast impacts, even numbers are more accurate; null: the
            preset's. Needs error_budget = 0.0.
        error_budget: Above 0, the solver chooses substeps (1 to 64) and iterations frame by frame, so that oscillations
            and the time of breaking are wrong by about this share at most (0.02: 2 %) and quiet frames cost little; 0:
            as preset, substeps and iterations say.
        gravity: Acceleration of all that may move [m/s2].

        Steps:
        iterations: Sweeps per substep: more carry a push further through a body; soft things that lie on one another
            take two at least; null: the preset's. Needs error_budget = 0.0.
        hit_substeps: Of method projective: parts, at most, of a substep in which something is hit so fast that it may
            break: as many as let the hit's waves run from fragment to fragment, so that it breaks as much with few
            substeps as with many; stiff things need more. A substep in which edges that fade break takes as many, or
            none where it would take more than this. 1: never divided; null: the preset's. Needs method = projective.
        crack_passes: How often in a substep a hit may break things. With 1, as in the paper, its cracks run one ring of
            fragments a substep; with more it breaks nearly as much with few substeps as with many, but what hangs
            together with the cracks takes the substep again each time.
        over_relaxation: Of method jacobi: how far each sweep goes beyond its own answer, to arrive sooner; 1: not at
            all. Odd numbers of iterations take only as much as ends near the goal (three: 1.58). Needs method = jacobi.

        Contact and Rest:
        damping: Velocities die away as exp(-damping x time) [1/s].
        depenetration_speed: Fastest at which parts that overlap already are pushed apart [m/s].
        self_collision: Particles of one body collide with one another where no edge joins them.
        sleeping: What has not moved for half a second (looked at four times a second) is left out, and costs nothing,
            until something touches it or what acts on it changes; off: everything is simulated at all times.

        Time:
        time_scale: How fast time runs: 0.1 shows a frame in ten, 0 stands still. Its keys are in frames of the output,
            those of all else in simulated frames. Changes nothing of what happens: frames between simulated ones are
            blended.
        accelerations: Meshes tell accelerations beside velocities, for curved motion blur. The frame after the one that
            is asked for is simulated for them.
        """

    @overload
    def add(
        self,
        type: Literal["deformer"],
        name: str,
        *,
        body: _Wire = ...,
        state: _Wire = ...,
        topology: Literal["compact", "constant"] = ...,
    ) -> Node:
        """Makes the visual mesh of one body at a frame: it follows the particles and splits where edges broke.

        body: The body whose mesh is made.
        state: Of a solver that moves the body.
        topology: compact: no break surface is in the mesh before its edge breaks, so the mesh grows as it tears;
            constant: all fragments are there from the first frame, break surfaces marked as hidden until they open, so
            that vertices and faces stay the same for point caches and motion blur.
        """

    @overload
    def add(
        self,
        type: Literal["bake_mesh"],
        name: str,
        *,
        mesh: _Wire = ...,
        path: _Path = ...,
        export: Literal["none", "usda", "glb", "pc2"] = ...,
        compression: Literal["none", "zstd"] = ...,
        subframes: _Integer = ...,
    ) -> Node:
        """Writes a visual mesh to a file each frame when the graph is baked.

        mesh: A deformer's mesh.
        path: File below the output folder, #### being the frame; its ending tells the format.
        export: Also one file of all frames beside them (PLY), made when all are baked: of this mesh alone, in usda and
            glb with rigid bodies and colliders. usda: USD with every frame; glb: glTF, fragments as rigid nodes
            (constant topology); pc2: point cache (constant topology).
        compression: zstd: files are compressed and their names end in .zst; everything of Sunder reads them as they
            are, other programs once `zstd -d` has unpacked them.
        subframes: Steps from one frame to the next, each of which is written: 4 has frames 12, 12.25, 12.5, 12.75, 13.
            What lies between is blended, and its file stands behind the frame's: 0012_250.
        """

    @overload
    def add(
        self,
        type: Literal["bake_state"],
        name: str,
        *,
        state: _Wire = ...,
        path: _Path = ...,
        compression: Literal["none", "zstd"] = ...,
        subframes: _Integer = ...,
    ) -> Node:
        """Writes the simulation's whole state to a file each frame when the graph is baked; a bake resumes from it.

        state: A solver's state.
        path: PLY file below the output folder, #### being the frame.
        compression: zstd: files are compressed and their names end in .zst; everything of Sunder reads them as they
            are, other programs once `zstd -d` has unpacked them.
        subframes: Steps from one frame to the next, each of which is written: 4 has frames 12, 12.25, 12.5, 12.75, 13.
            What lies between is blended, and its file stands behind the frame's: 0012_250.
        """
