"""What panels and nodes share when they draw."""
import functools
import textwrap

from . import runtime

NODE, WIDE_NODE, SIDEBAR, DIALOG = 200, 260, 175, 320  # widths in points: of our nodes, of a box in a sidebar, of our dialogs
_ICON, _LETTER = 42, 6.1  # what an icon with its margins and a letter take of them
EDGES, _SWITCH, _ARROWS = 20, 22, 26  # what a node or panel, a switch before a number, and a number's own margins take
_SIDEBAR_EDGES = 54  # its tabs and margins


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


def sidebar_width(context):
    """Of what is written in a sidebar, points: artists draw it wider."""
    scale = context.preferences.system.ui_scale
    return max(SIDEBAR, context.region.width / scale - _SIDEBAR_EDGES) if context.region else SIDEBAR


def labelled(layout, label):
    """Room beside a whole label: Blender cuts those of texts, choices and pickers off."""
    split = layout.split(factor=0.5)
    split.label(text=label)
    return split


def fits(label, value, n_switches, width):
    """Whether a number's label is whole beside its value; Blender cuts it off where it is not."""
    shown = f"{value:.3f}" if isinstance(value, float) else str(value)
    return _LETTER * (len(label) + len(shown)) + _SWITCH * n_switches + _ARROWS <= width - EDGES


def lines(layout, text, width):
    """A sentence without an icon, on as many lines as it takes."""
    for line in textwrap.wrap(text, int((width - EDGES) / _LETTER), subsequent_indent="    "):
        layout.label(text=line)


def sentence(layout, text, icon, alert=False, width=SIDEBAR):
    """A sentence on as many lines as it takes; Blender's labels do not wrap."""
    column = layout.column(align=True)
    column.alert = alert
    for i, line in enumerate(textwrap.wrap(text, int((width - _ICON) / _LETTER))):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")
