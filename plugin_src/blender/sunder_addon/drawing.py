"""What panels and nodes share when they draw."""
import textwrap

NODE, SIDEBAR, DIALOG = 220, 175, 320  # widths in points: of our nodes, of a box in a sidebar, of our dialogs
_ICON, _LETTER = 42, 6.1  # what an icon with its margins and a letter take of them


def sentence(layout, text, icon, alert=False, width=SIDEBAR):
    """A sentence on as many lines as it takes; Blender's labels do not wrap."""
    column = layout.column(align=True)
    column.alert = alert
    for i, line in enumerate(textwrap.wrap(text, int((width - _ICON) / _LETTER))):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")
