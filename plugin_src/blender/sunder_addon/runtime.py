"""What the add-on remembers while Blender runs and does not save: errors of handlers and nodes, and what is dirty.

Keys are texts, never Blender's objects: those die with every undo.
"""
import functools
import traceback

handler_errors = []  # tracebacks of what went wrong where Blender would swallow it; tests want this empty
node_errors = {}  # (name of the tree, graph name of the node): sentence
node_notes = {}  # the same, of what is no error
signatures = {}  # name of the tree: (settings, signature), as in signature.py; gone when something may have changed
mesh_hashes = {}  # (name of an object, with modifiers): {with layers: hash of its mesh}, as long as nothing changed it
former_homes = {}  # cache id of a tree: where its bake lay when the file was saved last; the tree's own memory is undone
wires = {}  # name of the tree: {(node, input): (node, output)} as last seen, to put back what a wrong wire pushed out
jobs = {}  # cache id of the tree: BakeJob at work
is_sampling = False  # frames are stepped through for a bake: nothing is to be shown meanwhile


def guarded(function):
    """A handler that keeps what it throws: Blender prints and forgets it."""

    @functools.wraps(function)
    def handler(*arguments):
        try:
            return function(*arguments)
        except Exception:
            handler_errors.append(traceback.format_exc())
            traceback.print_exc()
            return None

    return handler


def forget_errors(tree_name):
    for key in [k for k in node_errors if k[0] == tree_name]:
        del node_errors[key]


def forget():
    """Everything about a file that is not open any more."""
    for memory in (node_errors, node_notes, signatures, mesh_hashes, wires, former_homes):
        memory.clear()
