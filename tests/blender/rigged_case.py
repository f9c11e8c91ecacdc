"""A rigged object, and where Blender has it."""
import math

import bpy
import numpy as np

from addon_case import ObjectCase


class RiggedCase(ObjectCase):
    def arm(self, degrees=35, shift=0.5):
        """A column of 1.2 m in six storeys, bent by an armature of two bones that moves as an object, too: by frame 6 by the
        angle and the way along x (m) that are given."""
        data = bpy.data.meshes.new("arm")
        rings, sides = 7, 8
        vertices = [(0.1 * math.cos(a), 0.1 * math.sin(a), 0.2 * k) for k in range(rings)
                    for a in (2 * math.pi * i / sides for i in range(sides))]
        faces = [(k * sides + i, k * sides + (i + 1) % sides, (k + 1) * sides + (i + 1) % sides, (k + 1) * sides + i)
                 for k in range(rings - 1) for i in range(sides)]
        faces += [tuple(range(sides))[::-1], tuple(range((rings - 1) * sides, rings * sides))]
        data.from_pydata(vertices, [], faces)
        thing = bpy.data.objects.new("Arm", data)
        self.scene.collection.objects.link(thing)
        bones = bpy.data.armatures.new("bones")
        rig = bpy.data.objects.new("Rig", bones)
        self.scene.collection.objects.link(rig)
        bpy.context.view_layer.objects.active = rig
        bpy.ops.object.mode_set(mode="EDIT")
        low, high = bones.edit_bones.new("low"), bones.edit_bones.new("high")
        low.head, low.tail = (0, 0, 0), (0, 0, 0.6)
        high.head, high.tail, high.parent = (0, 0, 0.6), (0, 0, 1.2), low
        bpy.ops.object.mode_set(mode="OBJECT")
        for name in ("low", "high"):
            group = thing.vertex_groups.new(name=name)
            for v in data.vertices:
                share = min(max((v.co.z - 0.3) / 0.6, 0), 1)
                group.add([v.index], share if name == "high" else 1 - share, "REPLACE")
        thing.modifiers.new("rig", "ARMATURE").object = rig
        thing.parent = rig
        bone = rig.pose.bones["high"]
        bone.rotation_mode = "XYZ"
        for frame, angle, x in ((1, 0, 0), (6, degrees, shift)):
            bone.rotation_euler.x = math.radians(angle)
            bone.keyframe_insert("rotation_euler", frame=frame)
            rig.location.x = x
            rig.keyframe_insert("location", frame=frame)
        bpy.context.view_layer.update()
        return thing, rig

    def shown(self, thing, frame):
        """Where Blender has the object's vertices in the scene."""
        self.scene.frame_set(frame)
        evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
        mesh = evaluated.to_mesh()
        found = np.array([evaluated.matrix_world @ v.co for v in mesh.vertices])
        evaluated.to_mesh_clear()
        return found
