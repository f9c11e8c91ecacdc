"""What panels and nodes share when they draw."""
import textwrap

_LINE = 38  # characters of a sentence that fit into a node


def sentence(layout, text, icon, alert=False):
    """A sentence on as many lines as it takes; Blender's labels do not wrap."""
    column = layout.column(align=True)
    column.alert = alert
    for i, line in enumerate(textwrap.wrap(text, _LINE)):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")
