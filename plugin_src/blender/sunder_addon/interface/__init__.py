"""Where Blender and artists meet the add-on: events, operators, panels, menus, how nodes are drawn."""
