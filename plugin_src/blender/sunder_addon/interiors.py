"""Materials of break surfaces, and of sources that have none: what each Quick Fracture preset looks like, inside and out."""
import bpy

INTERIOR = "Sunder Interior"
_RAW = {"color": (0.45, 0.36, 0.28), "roughness": 0.9}
_SOCKETS = {  # a Principled BSDF's, as Blender has named them: the first that is there
    "color": ("Base Color",), "metallic": ("Metallic",), "roughness": ("Roughness",), "ior": ("IOR",),
    "transmission": ("Transmission Weight", "Transmission"),
}
_DARKER = 0.55  # what lay inside has not dried and faded

# preset: look of a source without materials, of what was inside. None: as outside; "darker": the same, darker
LOOKS = {
    "STEEL": ({"color": (0.42, 0.44, 0.47), "metallic": 1, "roughness": 0.3},
              {"color": (0.75, 0.76, 0.78), "metallic": 1, "roughness": 0.5}),
    "LEAD": ({"color": (0.16, 0.17, 0.19), "metallic": 1, "roughness": 0.55},
             {"color": (0.5, 0.52, 0.56), "metallic": 1, "roughness": 0.45}),
    "CLAY": ({"color": (0.42, 0.19, 0.1), "roughness": 0.8}, "darker"),
    "GLASS": ({"color": (0.9, 0.97, 0.95), "roughness": 0.0, "transmission": 1, "ior": 1.45}, None),
    "WOOD": ({"color": (0.28, 0.14, 0.06), "roughness": 0.5}, {"color": (0.72, 0.52, 0.32), "roughness": 0.85}),
}


def _principled(material):
    """By its type: its name is in the language of the window. None if there is none."""
    nodes = material.node_tree.nodes if getattr(material, "use_nodes", True) else ()
    return next((n for n in nodes if n.type == "BSDF_PRINCIPLED"), None)


def _made(name, look):
    """The material of that name, made if it is not there."""
    material = bpy.data.materials.get(name)
    if material is not None:
        return material
    material = bpy.data.materials.new(name)
    if not getattr(material, "use_nodes", True):  # always on from Blender 5.0
        material.use_nodes = True
    shader = _principled(material)
    for field, value in {**look, "color": (*look["color"], 1.0)}.items():
        socket = next(shader.inputs[n] for n in _SOCKETS[field] if n in shader.inputs)
        socket.default_value = value
    material.diffuse_color = (*look["color"], 1.0)
    material.metallic, material.roughness = look.get("metallic", 0.0), look["roughness"]
    if look.get("transmission"):
        material.diffuse_color[3] = 0.4  # seen through in solid view, too
        for switch in ("use_screen_space_refraction", "use_raytrace_refraction"):  # EEVEE before and since 4.2
            if hasattr(material, switch):
                setattr(material, switch, True)
    return material


def raw():
    """What break surfaces get at first: a rough look that the artist replaces."""
    return _made(INTERIOR, _RAW)


def _darker(outer):
    """A material's copy, darker and rougher; plain where a texture gave its colour."""
    name = f"{outer.name} Inside"
    known = bpy.data.materials.get(name)
    if known is not None:
        return known
    material = outer.copy()
    material.name = name
    material.diffuse_color = [_DARKER * c for c in outer.diffuse_color[:3]] + [outer.diffuse_color[3]]
    shader = _principled(material)
    if shader is not None:
        color = shader.inputs["Base Color"]
        for link in list(color.links):
            material.node_tree.links.remove(link)
            color.default_value = outer.diffuse_color
        color.default_value = [_DARKER * c for c in color.default_value[:3]] + [color.default_value[3]]
        if not shader.inputs["Roughness"].is_linked:
            shader.inputs["Roughness"].default_value = max(0.85, shader.inputs["Roughness"].default_value)
    return material


def materials(preset, outer):
    """(materials of the outer slots, that of break surfaces). `outer`: the source's; `preset`: "" if none was chosen."""
    if preset not in LOOKS:
        return outer, raw()
    plain, inside = LOOKS[preset]
    if not any(outer):
        outer = [_made(f"Sunder {preset.title()}", plain)] * len(outer)
    first = next(m for m in outer if m)
    if inside is None:
        return outer, first
    return outer, _darker(first) if inside == "darker" else _made(f"Sunder {preset.title()} Inside", inside)
