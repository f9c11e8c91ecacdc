"""Sunder: ductile fracture with oriented particles.

    import sunder
    g = sunder.Graph.load("shot.json")
    g["lead"]["toughness"] = 0.2
    state = g.evaluate("sim.state", frame=24)
    print(state.position.shape, state.edge_intact.sum())
    g.bake("shot_bake", progress=lambda fraction, text: True)

Results hold numpy arrays that are views into Sunder's memory: read-only, and valid as long as they are referred to.
SI units; Z up; quaternions are (w, x, y, z).
"""
from .break_report import Break, FragmentLoad, Pieces, Report, report
from .errors import Error
from .fields import sample_field
from .graph import Graph, Node, bake, export, node_types, read_state, verify
from .job import Job
from .library import version
from .values import Fragments, Interfaces, Mesh, State, Value

__version__ = version()
__all__ = [
    "Break",
    "Error",
    "FragmentLoad",
    "Fragments",
    "Graph",
    "Interfaces",
    "Job",
    "Mesh",
    "Node",
    "Pieces",
    "Report",
    "State",
    "Value",
    "bake",
    "export",
    "node_types",
    "read_state",
    "report",
    "sample_field",
    "verify",
    "version",
]
