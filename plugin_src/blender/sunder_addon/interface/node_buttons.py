"""How nodes are drawn, and with that their classes: one for each node type of the library."""
from ..base import descriptions, drawing
from ..tree import nodes, parameters, pickers
from . import bake_buttons


def _labelled(layout, label):
    """Room beside a whole label: Blender cuts those of texts and pickers off."""
    split = layout.split(factor=0.5)
    split.label(text=label)
    return split


class _Buttons:
    """What Blender calls to draw a node."""

    @drawing.guarded
    def draw_buttons(self, context, layout):
        if self.error:
            drawing.sentence(layout, self.error, "ERROR", alert=True, width=self.width)
        self._draw_pickers(layout)
        column = layout.column()
        for p in descriptions.parameters(self.sunder_type):
            if pickers.is_hidden(self, p["name"]):
                continue
            if p["type"] == "points":
                self._draw_points(column, p["name"])
            elif p["type"] not in parameters.NO_FIELD:
                self._draw_parameter(column, p)
        if self.sunder_type in ("solver", "deformer"):
            bake_buttons.draw_node(context, layout, self)

    def _draw_pickers(self, layout):
        if not pickers.has_source(self):
            return
        row = layout.row()
        row.prop(self, "source", expand=True)
        if self.source == pickers.OBJECT and hasattr(self, "object"):
            layout.prop(self, "object")
        if self.source == pickers.COLLECTION:
            layout.prop(self, "collection")
        if self.sunder_type == "mesh_file" and self.source != pickers.VALUES:
            layout.prop(self, "use_modifiers")
        if hasattr(self, "use_motion") and self.source != pickers.VALUES:
            layout.prop(self, "use_motion")
        if self.sunder_type == "pin":
            _labelled(layout, "Moved By").prop(self, "motion_object", text="")

    def _draw_points(self, layout, name):
        source = getattr(self, f"{name}_source")
        layout.row().prop(self, f"{name}_source", expand=True)
        layout.prop(self, f"{name}_{source.lower()}")

    def _draw_parameter(self, layout, p):
        attribute = parameters.attribute(p["name"])
        if p["automatic"]:
            row = layout.row(align=True)
            row.prop(self, parameters.automatic(p["name"]), text="", icon="AUTO")
            value = row.row()
            value.enabled = not getattr(self, parameters.automatic(p["name"]))
            value.prop(self, attribute)
        elif p["nullable"]:
            row = layout.row(align=True)
            row.prop(self, parameters.switch(p["name"]), text="")
            value = row.row()
            value.enabled = getattr(self, parameters.switch(p["name"]))
            value.prop(self, attribute)
        elif p["name"] in pickers.group_parameters(self.sunder_type) and self._mesh_object():
            _labelled(layout, p["label"]).prop_search(self, attribute, self._mesh_object(), "vertex_groups", text="")
        elif p["type"] == "text":
            _labelled(layout, p["label"]).prop(self, attribute, text="")
        else:
            layout.prop(self, attribute)


classes = [nodes.make(description, _Buttons) for description in descriptions.NODES.values()]


def categories():
    """[(identifier, label, [class, ...])] as menus list them."""
    found = {}
    for cls in classes:
        found.setdefault(descriptions.NODES[cls.sunder_type]["category"], []).append(cls)
    return [("SUNDER_" + name.upper(), name.title(), members) for name, members in found.items()]
