"""Materials of break surfaces, and of sources that have none: what each Quick Fracture preset looks like, inside and out."""
import bpy
import numpy as np

from ..base import blender_versions
from ..scene import mesh_export

INTERIOR = "Sunder Interior"
_RAW = {"color": (0.45, 0.36, 0.28), "roughness": 0.9}
_SOCKETS = {  # a Principled BSDF's, as Blender has named them: the first that is there
    "color": ("Base Color",), "metallic": ("Metallic",), "roughness": ("Roughness",), "ior": ("IOR",),
    "transmission": blender_versions.TRANSMISSION,
}
_DARKER = 0.55  # what lay inside has not dried and faded
_DEFAULT = 0.8  # of Base Color, each channel
_SAMPLES = 100_000  # pixels that an image's mean is taken of
_CHANGE_COLORS = ("REROUTE", "MIX", "MIX_RGB", "HUE_SAT", "BRIGHTCONTRAST", "GAMMA", "CURVE_RGB")  # not beyond recognition
_LONGEST = 20  # chain of such nodes that is followed: links may go round

# preset: look of a source without materials, of what was inside. None: as outside; "darker": the same, darker
LOOKS = {
    "STEEL": ({"color": (0.42, 0.44, 0.47), "metallic": 1, "roughness": 0.3},
              {"color": (0.75, 0.76, 0.78), "metallic": 1, "roughness": 0.5}),
    "SHEET_METAL": ({"color": (0.52, 0.53, 0.55), "metallic": 1, "roughness": 0.25},
                    {"color": (0.75, 0.76, 0.78), "metallic": 1, "roughness": 0.5}),
    "STEEL_BEAM": ({"color": (0.33, 0.33, 0.35), "metallic": 1, "roughness": 0.45},
                   {"color": (0.75, 0.76, 0.78), "metallic": 1, "roughness": 0.5}),
    "LEAD": ({"color": (0.16, 0.17, 0.19), "metallic": 1, "roughness": 0.55},
             {"color": (0.5, 0.52, 0.56), "metallic": 1, "roughness": 0.45}),
    "CLAY": ({"color": (0.42, 0.19, 0.1), "roughness": 0.8}, "darker"),
    "STONE": ({"color": (0.36, 0.35, 0.32), "roughness": 0.9}, {"color": (0.64, 0.62, 0.58), "roughness": 0.95}),
    "GLASS": ({"color": (0.9, 0.97, 0.95), "roughness": 0.0, "transmission": 1, "ior": 1.45}, None),
    "WOOD": ({"color": (0.28, 0.14, 0.06), "roughness": 0.5}, {"color": (0.72, 0.52, 0.32), "roughness": 0.85}),
}


def _name(preset):
    return preset.replace("_", " ").title()


def _principled(material):
    """By its type: its name is in the language of the window. None if there is none."""
    nodes = material.node_tree.nodes if blender_versions.has_nodes(material) else ()
    return next((n for n in nodes if n.type == "BSDF_PRINCIPLED"), None)


def _made(name, look):
    """The material of that name, made if it is not there."""
    material = bpy.data.materials.get(name)
    if material is not None:
        return material
    material = bpy.data.materials.new(name)
    blender_versions.turn_on_nodes(material)
    shader = _principled(material)
    for field, value in {**look, "color": (*look["color"], 1.0)}.items():
        socket = next(shader.inputs[n] for n in _SOCKETS[field] if n in shader.inputs)
        socket.default_value = value
    material.diffuse_color = (*look["color"], 1.0)
    material.metallic, material.roughness = look.get("metallic", 0.0), look["roughness"]
    if look.get("transmission"):
        material.diffuse_color[3] = 0.4  # seen through in solid view, too
        blender_versions.turn_on_refraction(material)
    return material


def raw():
    """What break surfaces get at first: a rough look that the artist replaces."""
    return _made(INTERIOR, _RAW)


def _image_mean(image):
    """Mean linear colour of an image, the less of a pixel the more it is seen through; None if there are no pixels."""
    pixels = np.empty(len(image.pixels), np.float32)
    if len(pixels) == 0 or image.channels < 3:
        return None
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(-1, image.channels)
    pixels = pixels[::len(pixels) // _SAMPLES | 1].astype(np.float64)  # odd steps do not fall in with patterns
    color, alpha = pixels[:, :3], pixels[:, 3:].ravel()
    if not image.is_float and image.colorspace_settings.name == "sRGB":  # floats are linear once they are loaded
        color = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    return tuple(np.average(color, axis=0, weights=alpha if alpha.any() else None))


def _mean_color(socket, mesh):
    """Mean linear colour of the image or of the mesh's colour attribute that feeds a socket; None if neither does."""
    for _ in range(_LONGEST):
        node = socket.links[0].from_node
        if node.type == "TEX_IMAGE":
            return _image_mean(node.image) if node.image else None
        if node.type in ("VERTEX_COLOR", "ATTRIBUTE"):
            name = node.layer_name if node.type == "VERTEX_COLOR" else node.attribute_name
            layer = mesh.color_attributes.get(name) if name else mesh_export.render_colors(mesh)
            return tuple(mesh_export.layer_colors(layer)[:, :3].mean(0)) if layer and len(layer.data) else None
        socket = next((s for s in node.inputs if s.type == "RGBA" and s.is_linked), None)
        if node.type not in _CHANGE_COLORS or socket is None:
            return None
    return None


def _seen_color(socket, outer, mesh):
    """One colour for a Base Color that is linked: what feeds it, else what it was set to before, else the viewport's."""
    found = _mean_color(socket, mesh)
    if found is None and any(abs(c - _DEFAULT) > 1e-4 for c in socket.default_value[:3]):
        found = socket.default_value[:3]
    return (*found, 1.0) if found is not None else tuple(outer.diffuse_color)


def _darker(outer, mesh):
    """A material's copy, darker and rougher; plain where a texture, or a colour attribute of `mesh`, gave its colour."""
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
        if color.is_linked:
            color.default_value = _seen_color(color, outer, mesh)
            material.node_tree.links.remove(color.links[0])
            material.diffuse_color = [_DARKER * c for c in color.default_value[:3]] + [outer.diffuse_color[3]]
        color.default_value = [_DARKER * c for c in color.default_value[:3]] + [color.default_value[3]]
        if not shader.inputs["Roughness"].is_linked:
            shader.inputs["Roughness"].default_value = max(0.85, shader.inputs["Roughness"].default_value)
    return material


def materials(preset, outer, areas, mesh):
    """(materials of the outer slots, that of break surfaces, which suits the outer one of the largest area).

    `preset`: "" if none was chosen; outer, areas: materials of the source's slots, and how much of it each covers; `mesh`:
    what its colour attributes are read from."""
    if preset not in LOOKS:
        return outer, raw()
    plain, inside = LOOKS[preset]
    if not any(outer):
        outer = [_made(f"Sunder {_name(preset)}", plain)] * len(outer)
    _, largest = max(((a, m) for a, m in zip(areas, outer) if m), key=lambda found: found[0])
    if inside is None:
        return outer, largest
    return outer, _darker(largest, mesh) if inside == "darker" else _made(f"Sunder {_name(preset)} Inside", inside)
