"""Materials of a shared cache: vectors that Alembic does not hold travel as two UV maps each, and nodes put them together again.

So textures by Generated coordinates stick to the pieces: of a cached mesh Blender takes these from where points are now.
"""
import bpy
import numpy as np

from ..bake import looks
from ..results import rest_coordinates, result_mesh

GENERATED = "generated"  # what their maps are named for


def maps_of(name):
    return f"{name}_xy", f"{name}_z"  # names that Alembic leaves as they are


def vectors_read(things):
    """Names of the vectors that results' materials read and that are to travel as maps."""
    materials = {s.material for thing in things for s in thing.material_slots if s.material}
    read = {name for material in materials for name in looks.attributes_read(material)} - {"velocity"}
    meshes = [thing.data for thing in things if thing.type == "MESH"]
    found = {a.name for mesh in meshes for a in mesh.attributes if (a.data_type, a.domain) == ("FLOAT_VECTOR", "POINT")} & read
    if any(looks.reads_generated(m) for m in materials) and any(rest_coordinates.ATTRIBUTE in m.attributes for m in meshes):
        found.add(GENERATED)
    return found


def write_maps(mesh, names):
    """The maps of a frame."""
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    for name in names:
        attribute = mesh.attributes.get(rest_coordinates.ATTRIBUTE if name == GENERATED else name)
        if attribute is None or attribute.data_type != "FLOAT_VECTOR":
            continue
        values = np.empty(3 * len(attribute.data), np.float32)
        attribute.data.foreach_get("vector", values)
        values = values.reshape(-1, 3)[corners]
        if name == GENERATED:
            values = (values - np.array(mesh.texspace_location)) / (2 * np.array(mesh.texspace_size)) + 0.5
        first, second = maps_of(name)
        result_mesh.write_uvs(mesh, values[:, :2], first)
        result_mesh.write_uvs(mesh, np.stack([values[:, 2], np.zeros(len(values))], 1), second)


class Adapter:
    """Makes copies of materials, and of groups in them, that read maps; those that read none stay."""

    def __init__(self, vectors):
        self._vectors, self._made = vectors, {}

    def material(self, material):
        if material is None or not (looks.attributes_read(material) & self._vectors
                                    or GENERATED in self._vectors and looks.reads_generated(material)):
            return material
        if material not in self._made:
            copy = self._made[material] = material.copy()
            copy.name = f"{material.name} shared"
            self._adapt(copy.node_tree)
        return self._made[material]

    def _group(self, tree):
        if tree is not None and tree not in self._made:
            self._made[tree] = tree.copy()
            self._adapt(self._made[tree])
        return self._made.get(tree)

    def _adapt(self, tree):
        for node in list(tree.nodes):
            if node.type == "GROUP":
                node.node_tree = self._group(node.node_tree)
            elif node.type == "ATTRIBUTE" and node.attribute_name in self._vectors:
                for name in ("Vector", "Color"):
                    self._replace(tree, node.outputs[name], node.attribute_name)
            elif GENERATED in self._vectors and node.type == "TEX_COORD":
                self._replace(tree, node.outputs["Generated"], GENERATED)
            elif GENERATED in self._vectors and node.type in looks.BY_GENERATED and not node.inputs["Vector"].is_linked:
                tree.links.new(self._source(tree, node, GENERATED), node.inputs["Vector"])

    def _replace(self, tree, output, name):
        readers = [link.to_socket for link in output.links]
        if readers:
            source = self._source(tree, output.node, name)
            for reader in readers:
                tree.links.new(source, reader)

    @staticmethod
    def _source(tree, beside, name):
        """A vector, put together of its maps."""
        whole = tree.nodes.new("ShaderNodeCombineXYZ")
        numbers = []
        for at, map_name in enumerate(maps_of(name)):
            attribute, split = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeSeparateXYZ")
            attribute.attribute_name = map_name
            tree.links.new(attribute.outputs["Vector"], split.inputs[0])
            numbers += list(split.outputs)[:2 - at]
            for node, left in ((attribute, 600), (split, 400), (whole, 200)):
                node.location = beside.location.x - left, beside.location.y - 200 * at
        for number, into in zip(numbers, whole.inputs):
            tree.links.new(number, into)
        return whole.outputs[0]
