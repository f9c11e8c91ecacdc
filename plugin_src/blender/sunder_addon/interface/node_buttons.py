"""How nodes are drawn, and with that their classes: one for each node type of the library.

A node and the sidebar's panels of it (node_panels.py) show the same rows in the same groups.
"""
from ..base import descriptions, drawing
from ..tree import conditions, edits, nodes, parameters, pickers
from ..bake import bake_warnings
from . import bake_buttons


def shown(node, label):
    """The parameters of a group that have rows as the node stands."""
    return [p for p in descriptions.groups(node.sunder_type)[label]
            if p["type"] not in ("vertex_groups", "vectors") and conditions.is_shown(node, p["name"])]


def groups(node):
    """Labels of the groups that are folded away and have rows."""
    return [label for label in descriptions.groups(node.sunder_type) if label and shown(node, label)]


def is_touched(node, label):
    """Whether something in a group is other than in a new node, and counts."""
    return any(p["type"] not in parameters.NO_FIELD and conditions.counts(node, p["name"])
               and parameters.value(p, node) != p["default"] for p in shown(node, label))


def draw_main(layout, node, width):
    """What is seen at once: errors, what the bake warned of, objects, and the rows in no group. width: points that there are."""
    if node.error:
        drawing.sentence(layout, node.error, "ERROR", alert=True, width=width)
    for sentence in node.warnings:
        drawing.sentence(layout, sentence, "ERROR", width=width)
    _draw_pickers(layout, node)
    draw_group(layout, node, "", width)


def draw_group(layout, node, label, width):
    column = layout.column()
    for p in shown(node, label):
        lack = conditions.lack(node, p["name"])
        if lack:
            rows = column.column(align=True)
            rows.enabled = False
            drawing.lines(rows, f"{p['label']}: needs {lack}", width)
        elif p["type"] == "points":
            _draw_points(column, node, p["name"])
        else:
            _draw_parameter(column, node, p, width)


def _draw_pickers(layout, node):
    if node.sunder_type == "follow":
        layout.prop(node, "from_object")
    if not pickers.has_source(node) or node.sunder_type == "seam" and pickers.region(node) not in ("box", "sphere"):
        return
    row = layout.row()
    row.prop(node, "source", expand=True)
    if node.source == pickers.OBJECT and hasattr(node, "object"):
        layout.prop(node, "object")
    if node.source == pickers.COLLECTION:
        layout.prop(node, "collection")
    if node.sunder_type == "mesh_file" and node.source != pickers.VALUES:
        layout.prop(node, "use_modifiers")
    if hasattr(node, "use_motion") and node.source != pickers.VALUES:
        layout.prop(node, "use_motion")
    if node.sunder_type == "pin" and node.motion == "vertices":
        layout.prop(node, "from_object")
    elif node.sunder_type == "pin":
        drawing.labelled(layout, "Moved By").prop(node, "motion_object", text="")


def _draw_points(layout, node, name):
    source = getattr(node, f"{name}_source")
    layout.row().prop(node, f"{name}_source", expand=True)
    if source == pickers.VALUES:
        label = next(p["label"] for p in descriptions.parameters(node.sunder_type) if p["name"] == name)
        layout.label(text=f"{label}: {len(edits.places(node, name))} places")
    else:
        layout.prop(node, f"{name}_{source.lower()}")


def _number_label(layout, node, p, width):
    """What a parameter's button says beside its value: none where that is a number and the label stands on a line above it."""
    label, value = parameters.label(p), getattr(node, parameters.attribute(p["name"]))
    is_number = p["type"] in ("number", "integer") and "choices" not in p
    if not is_number or drawing.fits(label, value, p["automatic"] + p["nullable"], width):
        return {}
    layout.label(text=label + ":")
    return {"text": ""}


def _draw_parameter(layout, node, p, width):
    attribute = parameters.attribute(p["name"])
    beside = _number_label(layout, node, p, width)
    if p["automatic"] or p["nullable"]:
        row = layout.row(align=True)
        is_automatic = p["automatic"] and getattr(node, parameters.automatic(p["name"]))
        is_used = not p["nullable"] or getattr(node, parameters.switch(p["name"]))
        if p["nullable"]:
            switch = row.row(align=True)
            switch.enabled = not is_automatic
            switch.prop(node, parameters.switch(p["name"]), text="")
        if p["automatic"]:
            row.prop(node, parameters.automatic(p["name"]), text="", icon="EVENT_A")
        value = row.row()
        value.enabled = is_used and not is_automatic
        value.prop(node, attribute, **beside)
    elif p["name"] in pickers.group_parameters(node.sunder_type) and node.mesh_object():
        drawing.labelled(layout, p["label"]).prop_search(node, attribute, node.mesh_object(), "vertex_groups", text="")
    elif p["type"] == "text" or "choices" in p:
        drawing.labelled(layout, p["label"]).prop(node, attribute, text="")
    else:
        layout.prop(node, attribute, **beside)


class _Buttons:
    """What Blender calls to draw a node."""

    @property
    def warnings(self):
        """Sentences of what the bake that is there warned of at this node."""
        return bake_warnings.of_node(self)

    @drawing.guarded
    def draw_buttons(self, context, layout):
        draw_main(layout, self, self.width)
        for label in groups(self):
            fold = parameters.fold(label)
            is_open = getattr(self, fold)
            row = layout.row()
            row.alignment = "LEFT"
            row.prop(self, fold, text=label + (" •" if is_touched(self, label) else ""), emboss=False,
                     icon="DISCLOSURE_TRI_DOWN" if is_open else "DISCLOSURE_TRI_RIGHT")
            if is_open:
                draw_group(layout, self, label, self.width)
        if self.sunder_type in ("solver", "deformer"):
            bake_buttons.draw_node(context, layout, self)


classes = [nodes.make(description, _Buttons) for description in descriptions.NODES.values()]


def categories():
    """[(identifier, label, [class, ...])] as menus list them."""
    found = {}
    for cls in classes:
        found.setdefault(descriptions.NODES[cls.sunder_type]["category"], []).append(cls)
    return [("SUNDER_" + name.upper(), name.title(), members) for name, members in found.items()]
