"""Figures whose exports say nothing of quads, for `blender --background --python plain.py -- FOLDER`.

Writes into FOLDER
  suzanne.glb, rod.glb, worn.glb   Blender's own exports: Suzanne, a slender cylinder with fans at its ends, and
                                   Suzanne again, reduced to triangles alone
  quads.json                       of each the quads that it was made of, as the places of their corners in
                                   glTF's axes
"""
import json
import sys

import bpy

FOLDER = sys.argv[sys.argv.index("--") + 1]


def make_worn():
    bpy.ops.mesh.primitive_monkey_add()
    bpy.context.object.modifiers.new("fewer", "DECIMATE").ratio = 0.5
    bpy.ops.object.modifier_apply(modifier="fewer")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.quads_convert_to_tris()
    bpy.ops.object.mode_set(mode="OBJECT")


MAKERS = {
    "suzanne": bpy.ops.mesh.primitive_monkey_add,
    "rod": lambda: bpy.ops.mesh.primitive_cylinder_add(radius=0.2, end_fill_type="TRIFAN"),
    "worn": make_worn,
}


def main():
    quads = {}
    for name, make in MAKERS.items():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        make()
        mesh = bpy.context.object.data
        for face in mesh.polygons:
            face.use_smooth = True
        points = [(v.co.x, v.co.z, -v.co.y) for v in mesh.vertices]
        quads[name] = [[points[i] for i in face.vertices] for face in mesh.polygons if len(face.vertices) == 4]
        bpy.ops.export_scene.gltf(filepath=f"{FOLDER}/{name}.glb", export_format="GLB")
    with open(FOLDER + "/quads.json", "w", encoding="utf-8") as file:
        json.dump(quads, file)


main()
