"""What the add-on remembers while Blender runs and does not save: errors of handlers and nodes, and what is dirty.

Keys are texts, never Blender's objects: those die with every undo.
"""
import functools
import traceback

import bpy

from . import blender_versions

handler_errors = []  # tracebacks of what went wrong where Blender would swallow it; tests want this empty
node_errors = {}  # (name of the tree, graph name of the node): sentence
node_notes = {}  # the same, of what is no error
signatures = {}  # name of the tree: (settings, signature), as in signature.py; gone when something may have changed
mesh_hashes = {}  # (name of an object, with modifiers): {with layers: hash of its mesh}, as long as nothing changed it
former_homes = {}  # cache id of a tree: where its bake lay when the file was saved last; the tree's own memory is undone
face_stamps = {}  # name of a mesh: (names, arrays, stamp), as in result_mesh.py, of the frame that was stamped last
wires = {}  # name of the tree: {(node, input): (node, output)} as last seen, to put back what a wrong wire pushed out
driven = set()  # names of trees whose drivers Blender works out, as far as is known
jobs = {}  # cache id of the tree: BakeJob at work
is_registered = False  # all classes are known to Blender: trees may be looked at and changed
is_sampling = False  # frames are stepped through for a bake: nothing is to be shown meanwhile


def fault(error):
    """A sentence about an exception that nothing was to throw, for a node or panel; the traceback is kept.

    In a Blender newer than any that is known something has gone that Sunder needs: there the sentence is all that is told.
    """
    handler_errors.append(traceback.format_exc())
    if bpy.app.version[:2] > blender_versions.NEWEST:
        known = ".".join(map(str, blender_versions.NEWEST))
        return f"Blender {bpy.app.version_string} is newer than {known}, and something that Sunder needs has changed: {error}"
    traceback.print_exc()
    return f"Sunder has a fault, told whole in the console: {type(error).__name__}: {error}"


def guarded(function):
    """A handler that keeps what it throws: Blender prints and forgets it."""

    @functools.wraps(function)
    def handler(*arguments):
        try:
            return function(*arguments)
        except Exception as error:
            print(f"sunder: error: {fault(error)}")
            return None

    return handler


def forget_errors(tree_name):
    for key in [k for k in node_errors if k[0] == tree_name]:
        del node_errors[key]


def forget():
    """Everything about a file that is not open any more."""
    for memory in (node_errors, node_notes, signatures, mesh_hashes, face_stamps, wires, former_homes, driven):
        memory.clear()
