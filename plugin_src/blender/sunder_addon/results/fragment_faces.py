"""Fragments of a result's mesh as selected faces, in edit mode and out of it."""
import bmesh
import numpy as np

from ..base import blender_versions
from . import result_mesh

_FRAGMENT = "fragment"  # the attribute of faces


def _of_faces(mesh):
    """(faces,) int32, the fragment of each; None where the mesh shows no frame yet."""
    layer = mesh.attributes.get(_FRAGMENT)
    if layer is None or layer.domain != "FACE" or layer.data_type != "INT":
        return None
    numbers = np.empty(len(mesh.polygons), np.int32)
    layer.data.foreach_get("value", numbers)
    return numbers


def selected(thing):
    """Numbers of the fragments that have selected faces."""
    mesh = thing.data
    if thing.mode == "EDIT":
        edit = bmesh.from_edit_mesh(mesh)
        layer = edit.faces.layers.int.get(_FRAGMENT)
        return {face[layer] for face in edit.faces if face.select} if layer is not None else set()
    numbers = _of_faces(mesh)
    if numbers is None:
        return set()
    is_selected = np.empty(len(numbers), bool)
    mesh.polygons.foreach_get("select", is_selected)
    return set(numbers[is_selected].tolist())


def select(thing, fragments):
    """Selects the faces of fragments and no others; returns how many. In edit mode that is seen at once. (What is written into
    a linked mesh Blender drops: nothing is selected there.)"""
    mesh = thing.data
    if not result_mesh.is_local(mesh):
        return 0
    return _select_in_edit_mode(mesh, fragments) if thing.mode == "EDIT" else _select(mesh, fragments)


def _select_in_edit_mode(mesh, fragments):
    edit = bmesh.from_edit_mesh(mesh)
    layer = edit.faces.layers.int.get(_FRAGMENT)
    if layer is None:
        return 0
    for kind in (edit.verts, edit.edges, edit.faces):
        for element in kind:
            element.select = False
    edit.select_history.clear()
    wanted = [face for face in edit.faces if face[layer] in fragments and not face.hide]
    for face in wanted:
        face.select_set(True)
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
    return len(wanted)


def _select(mesh, fragments):
    numbers = _of_faces(mesh)
    if numbers is None:
        return 0
    is_wanted = np.isin(numbers, np.fromiter(fragments, np.int32, len(fragments)))
    totals = np.empty(len(numbers), np.int32)
    mesh.polygons.foreach_get("loop_total", totals)
    corners = np.repeat(is_wanted, totals)
    parts = [is_wanted]
    for of_corner, n in (("edge_index", len(mesh.edges)), ("vertex_index", len(mesh.vertices))):
        at, is_part = np.empty(len(mesh.loops), np.int32), np.zeros(n, bool)
        mesh.loops.foreach_get(of_corner, at)
        is_part[at[corners]] = True
        parts.append(is_part)
    blender_versions.write_selection(mesh, *parts)
    mesh.update()
    return int(is_wanted.sum())
