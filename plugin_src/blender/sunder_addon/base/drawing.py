"""What panels and nodes share when they draw."""
import functools
import textwrap

from . import runtime

NODE, WIDE_NODE, SIDEBAR, DIALOG = 200, 260, 175, 320  # widths in points: of our nodes, of a box in a sidebar, of our dialogs
_ICON, _LETTER = 42, 6.1  # what an icon with its margins and a letter take of them


def guarded(draw):
    """A method that draws, a panel's (self, context) or a node's (self, context, layout): what it throws stands where it drew."""

    def try_to(layout, *arguments):
        try:
            draw(*arguments)
        except Exception as error:
            sentence(layout, runtime.fault(error), "ERROR", alert=True)

    # Blender counts the arguments that they are declared with.
    @functools.wraps(draw)
    def of_node(self, context, layout):
        try_to(layout, self, context, layout)

    @functools.wraps(draw)
    def of_panel(self, context):
        try_to(self.layout, self, context)

    return of_node if draw.__code__.co_argcount == 3 else of_panel


def sentence(layout, text, icon, alert=False, width=SIDEBAR):
    """A sentence on as many lines as it takes; Blender's labels do not wrap."""
    column = layout.column(align=True)
    column.alert = alert
    for i, line in enumerate(textwrap.wrap(text, int((width - _ICON) / _LETTER))):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")
