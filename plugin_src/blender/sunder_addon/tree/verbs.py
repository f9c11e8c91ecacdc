"""What operators share: which tree they are about, and what becomes of what they throw."""
import functools

import bpy
from bpy.props import StringProperty

from ..base import core, runtime
from . import trees


def tree_of(context, name):
    """The tree of that name, else the one that is edited, else the active object's, else the only one."""
    if name:  # a linked one may have the name of one that is local: its full name tells them apart
        tree = next((t for t in trees.trees() if t.name_full == name), None) or bpy.data.node_groups.get(name)
        return tree if trees.is_tree(tree) else None
    edited = getattr(context.space_data, "edit_tree", None)
    if trees.is_tree(edited):
        return edited
    thing = context.object
    if thing is not None and trees.is_tree(thing.sunder.tree):
        return thing.sunder.tree
    known = trees.trees()
    return known[0] if len(known) == 1 else None


def told(verb):
    """A method of an operator, (self, context) or (self, context, event): what is refused, and what nothing was to
    throw, is reported, and the operator cancelled."""

    def try_to(self, *arguments):
        try:
            return verb(self, *arguments)
        except (core.Refused, RuntimeError) as error:  # of the scene; what another operator, called by this one, reported
            self.report({"ERROR"}, str(error))
        except Exception as error:
            self.report({"ERROR"}, runtime.fault(error))
        return {"CANCELLED"}

    # Blender counts the arguments that they are declared with.
    @functools.wraps(verb)
    def on_event(self, context, event):
        return try_to(self, context, event)

    @functools.wraps(verb)
    def plain(self, context):
        return try_to(self, context)

    return on_event if verb.__code__.co_argcount == 3 else plain


class OnTree:
    tree: StringProperty(name="Tree", description="Name of the Sunder tree; empty: the one at hand", options={"SKIP_SAVE"})

    def find(self, context):
        tree = tree_of(context, self.tree)
        if tree is None:
            self.report({"ERROR"}, f"there is no Sunder tree '{self.tree}'" if self.tree else "pick a Sunder tree")
        return tree
