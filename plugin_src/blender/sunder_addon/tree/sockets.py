"""One socket class for each kind of thing that runs through wires. A kind fits itself alone."""
import bpy

from ..base import blender_versions, descriptions

_COLORS = {
    "mesh": (0.0, 0.84, 0.64, 1.0),
    "visual_mesh": (0.0, 0.84, 0.64, 1.0),
    "fragments": (0.95, 0.55, 0.20, 1.0),
    "body": (0.85, 0.30, 0.25, 1.0),
    "rigid_body": (0.45, 0.50, 0.60, 1.0),
    "collider": (0.35, 0.62, 0.35, 1.0),
    "pin": (0.80, 0.75, 0.25, 1.0),
    "force": (0.40, 0.75, 0.95, 1.0),
    "state": (0.65, 0.45, 0.90, 1.0),
}
_OTHER = (0.7, 0.7, 0.7, 1.0)
MANY = 4095  # wires, the most that Blender lets one socket have


def class_name(socket_type):
    return "Sunder" + "".join(word.title() for word in socket_type.split("_")) + "Socket"


def spoken(socket_idname):
    """"rigid body" for "SunderRigidBodySocket"; the name itself for sockets that are not ours."""
    for socket_type in descriptions.socket_types():
        if class_name(socket_type) == socket_idname:
            return socket_type.replace("_", " ")
    return socket_idname


def color(socket_type):
    """Of its wires."""
    return _COLORS.get(socket_type, _OTHER)


def _make(socket_type):

    def draw(self, _context, layout, _node, text):
        layout.label(text=text)

    members = {
        "bl_idname": class_name(socket_type),
        "bl_label": socket_type.replace("_", " ").title(),
        "__doc__": f"A wire that carries a {socket_type.replace('_', ' ')}",
        "draw": draw,
        **blender_versions.socket_color(color(socket_type)),
    }
    return type(members["bl_idname"], (bpy.types.NodeSocket,), members)


classes = [_make(socket_type) for socket_type in descriptions.socket_types()]


def add(collection, description, is_input):
    socket = collection.new(class_name(description["type"]), description["label"], identifier=description["name"])
    if is_input and description["many"]:
        socket.link_limit = MANY
    blender_versions.describe_socket(socket, description["sentence"])
    return socket
