"""What nodes have in Blender beyond their description: objects in place of numbers and files."""
import bpy
from bpy.props import BoolProperty, EnumProperty, PointerProperty, StringProperty

from ..base import descriptions

OBJECT, COLLECTION, VALUES = "OBJECT", "COLLECTION", "VALUES"


SURFACES = ("MESH", "FONT", "CURVE", "SURFACE")  # types of objects that Blender makes a mesh of


def has_mesh(_self, thing):
    return thing.type in SURFACES and not thing.sunder.tree


# Blender's force fields that nodes stand for.
FIELDS = {"force": ("WIND", "DRAG"), "point_force": ("FORCE",), "vortex": ("VORTEX",), "turbulence": ("TURBULENCE",)}


def _has_field(node_type):
    return lambda _self, thing: thing.field is not None and thing.field.type in FIELDS[node_type]


def _not_a_result(_self, thing):
    return not thing.sunder.tree


def _source(sentence, values, default, with_collection=True, changed=None):
    items = [(OBJECT, "Object", f"{sentence} an object")]
    if with_collection:
        items.append((COLLECTION, "Collection", f"{sentence} every mesh object of a collection"))
    items.append((VALUES, *values))
    return EnumProperty(name="From", description="Where it comes from", items=items, default=default, options=set(),
                        update=changed)


def points_parameters(node_type):
    """Names of the parameters that are lists of points: each has a picker for what they are taken from."""
    return [p["name"] for p in descriptions.parameters(node_type) if p["type"] == "points"]


def group_parameters(node_type):
    """Names of the parameters that name a vertex group of the mesh."""
    return [p["name"] for p in descriptions.parameters(node_type)
            if p["type"] == "text" and (p["name"] == "group" or p["name"].endswith("_group"))]


def map_parameters(node_type):
    """Names of the parameters that name a number at every vertex of the mesh."""
    return [p["name"] for p in descriptions.parameters(node_type) if p["type"] == "text" and p["name"].endswith("_map")]


def has_source(node):
    """Whether a node has a choice of objects or values. (A parameter of the library may be called `source`, too.)"""
    return node.sunder_type in _SOURCED


_PARTS_OF_BODIES = ("activate", "body_region", "seam")
_SOURCED = ("mesh_file", "body", "rigid_body", "collider", "pin", "fragment_region", "blast", *_PARTS_OF_BODIES, *FIELDS)


def properties(node_type, changed):
    """{attribute: Blender property} of one node type."""
    return {**_own_properties(node_type, changed), **_points_properties(node_type, changed)}


def region(node):
    """Which of its regions a node takes; those that an object may stand for are box and sphere."""
    return getattr(node, "between" if node.sunder_type == "seam" else "region", "box")


def _points_properties(node_type, changed):
    made = {}
    for name in points_parameters(node_type):
        items = [(OBJECT, "Object", "The vertices of a mesh, the points of a curve, the origin of anything else"),
                 (COLLECTION, "Collection", "The origins of its objects")]
        if node_type == "seam":
            items.append((VALUES, "Edits", "Places that edits of edges keep here; they move along with the body"))
            made[f"{name}_values"] = StringProperty(update=changed, options={"HIDDEN"},
                                                    description="In the body's own coordinates, as edits.py writes them")
        made[f"{name}_source"] = EnumProperty(name="Points From", description="Where the points come from", items=items,
                                              default=OBJECT, options=set(), update=changed)
        made[f"{name}_object"] = PointerProperty(
            type=bpy.types.Object, name="Points", poll=_not_a_result, update=changed,
            description="Vertices of this mesh, points of this curve in their order, or the origin of this object, at the "
                        "first frame")
        made[f"{name}_collection"] = PointerProperty(type=bpy.types.Collection, name="Points", update=changed,
                                                     description="The origins of its objects at the first frame")
    return made


def _own_properties(node_type, changed):
    def thing(name, sentence, poll=_not_a_result):
        return PointerProperty(type=bpy.types.Object, name=name, description=sentence, poll=poll, update=changed)

    def things(sentence):
        return PointerProperty(type=bpy.types.Collection, name="Collection", description=sentence, update=changed)

    if node_type == "mesh_file":
        return {
            "source": _source("The mesh of", ("File", "A mesh file"), OBJECT, changed=changed),
            "object": thing("Object", "The solid, as it stands at the first frame: a mesh, a text or a curve with depth", has_mesh),
            "collection": things("All its mesh objects as one mesh, as they stand at the first frame"),
            "use_modifiers": BoolProperty(
                name="Apply Modifiers", description="Cut the mesh as modifiers make it", default=True, options=set(),
                update=changed,
            ),
        }
    motion = BoolProperty(
        name="Start with Its Motion", options=set(), update=changed,
        description="Begin with the velocity that the object had in the frame before the first",
    )
    if node_type == "body":
        return {
            "use_motion": motion,
            "source": _source("Stands as", ("Values", "Stands as position and rotation tell"), OBJECT, False, changed),
        }
    if node_type in ("rigid_body", "collider"):
        moving = {"use_motion": motion} if node_type == "rigid_body" else {}
        default = OBJECT if node_type == "rigid_body" else VALUES
        moves = "Place at the first frame" if node_type == "rigid_body" else "Place, with its animation,"
        return {
            **moving,
            "source": _source("Place and size of", ("Values", "Place and size as numbers"), default, changed=changed),
            "object": thing("Object", f"{moves} and bounding box of this object, scale included"),
            "collection": things("One for each of its mesh objects"),
        }
    if node_type == "blast":
        return {
            "source": _source("Where stands", ("Values", "Place and direction as numbers"), VALUES, False, changed),
            "object": thing("Charge", "It goes off where this object is at its frame; a cone opens along the object's z axis"),
        }
    if node_type in FIELDS:
        name, sentence = _FIELD_PICKERS[node_type]
        return {
            "source": _source("The force field of", ("Values", "Numbers"), VALUES, False, changed),
            "object": thing(name, sentence, _has_field(node_type)),
        }
    if node_type == "fragment_region":
        return {
            "source": _source("The bounding box of", ("Values", "Numbers, in the fragments' own coordinates"), VALUES, False,
                              changed),
            "object": thing("Region", "Its bounding box at the first frame, along the fragments' own axes: an empty or a "
                            "mesh"),
        }
    if node_type == "follow":
        return {
            "from_object": BoolProperty(
                name="Follow Its Object", default=True, options=set(), update=changed,
                description="Follow the object that the body was cut from: its place, or each vertex of it with all that "
                            "deforms it (armatures, shape keys, modifiers, caches). Every frame is read when baking"),
        }
    if node_type in _PARTS_OF_BODIES:
        return {
            "source": _source("The bounding box of", ("Values", "Numbers"), VALUES, False, changed),
            "object": thing("Region", "Its bounding box at the first frame: an empty or a mesh"),
        }
    if node_type == "pin":
        return {
            "source": _source("The bounding box of", ("Values", "Numbers"), VALUES, False, changed),
            "object": thing("Region", "Its bounding box at the first frame: an empty or a mesh"),
            "motion_object": thing("Moved By", "What is held follows this object's animation, or with motion surface each "
                                   "fragment the nearest face of its mesh; none: it is held still, or as numbers tell"),
            "from_object": BoolProperty(
                name="Follow Its Object", default=True, options=set(), update=changed,
                description="Hold each fragment where the object that the body was cut from takes it, with all that deforms "
                            "that (armatures, shape keys, modifiers, caches). Every frame is read when baking"),
        }
    return {}


_FIELD_PICKERS = {
    "force": ("Wind", "A wind force field: it blows along the object's z axis, its strength in m/s, everywhere alike; or a drag "
              "force field: its linear drag in 1/s in still air"),
    "point_force": ("Field", "A force field of type Force: its place, strength (m/s2 at the radius), falloff power and largest "
                    "distance"),
    "vortex": ("Field", "A force field of type Vortex: its place and z axis, strength, inflow, falloff power and largest distance"),
    "turbulence": ("Field", "A force field of type Turbulence: its strength, size, seed and largest distance"),
}

# Parameters that objects stand in for: values of `source` at which they do, parameters.
REPLACED = {
    "mesh_file": ((OBJECT, COLLECTION), ("path", "scale", "rotation")),
    "body": ((OBJECT,), ("position", "rotation")),
    "rigid_body": ((OBJECT, COLLECTION), ("radius", "size", "position", "rotation")),
    "collider": ((OBJECT, COLLECTION), ("radius", "size", "height", "position", "rotation", "path", "scale",
                                         "motion_source", "motion_path", "positions", "first_frame")),
    "fragment_region": ((OBJECT,), ("box_min", "box_max", "center", "radius")),
    **{name: ((OBJECT,), ("box_min", "box_max", "center", "radius")) for name in ("pin", *_PARTS_OF_BODIES)},
    "force": ((OBJECT,), ("wind",)),
    "blast": ((OBJECT,), ("position", "direction")),
    "point_force": ((OBJECT,), ("position", "strength", "falloff", "reach")),
    "vortex": ((OBJECT,), ("position", "axis", "swirl", "inflow", "falloff", "reach")),
    "turbulence": ((OBJECT,), ("position", "strength", "size", "seed", "reach")),
}


def is_drag(node):
    """Whether a force node's object is a drag force field, which has no wind of its own."""
    thing = node.object if node.sunder_type == "force" and node.source == OBJECT else None
    return thing is not None and thing.field is not None and thing.field.type == "DRAG"


def uses_motion(node):
    """Whether a body or rigid body begins with the motion of its object."""
    return getattr(node, "use_motion", False) and has_source(node) and node.source != VALUES


def takes_vertices(node):
    """Whether a collider or pin deforms as an object does."""
    if node.sunder_type == "pin":
        return node.motion == "vertices" and node.from_object or goes_with_another(node)
    return node.motion == "vertices" and node.shape == "mesh" and node.source != VALUES


def goes_with_another(node):
    """Whether a pin's fragments go with the mesh of an object that is not their own."""
    return node.motion == "surface" and node.motion_object is not None


_OF_MOTION = {"follow": ("position", "rotation", "source", "path", "positions", "first_frame"),
              "pin": ("motion_source", "motion_path", "positions", "first_frame")}


def is_replaced(node, parameter):
    """Whether an object stands in for a parameter's value."""
    if node.sunder_type == "follow" and node.from_object or node.sunder_type == "pin" and takes_vertices(node):
        if parameter in _OF_MOTION[node.sunder_type]:
            return True
    if uses_motion(node) and parameter in ("velocity", "angular_velocity"):
        return True
    if node.sunder_type == "pin" and node.motion_object and parameter in ("pivot", "position", "rotation"):
        return True
    if parameter == "drag" and is_drag(node):
        return True
    sources, replaced = REPLACED.get(node.sunder_type, ((), ()))
    return parameter in replaced and node.source in sources
