"""What viewports draw in place of a result, skinned by the graphics card."""
