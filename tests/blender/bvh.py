"""Where Blender has the joints of BVH files, for `blender --background --python bvh.py -- FOLDER`.

Writes for each FOLDER/NAME.bvh
  NAME.places        JSON: by joint its place in each frame, in the file's axes
  NAME.again.WAY     what Blender's exporter makes of it: with channels in the orders that the file has, in others, and with
                     positions of the root alone where no other joint moves
"""
import glob
import json
import re
import sys

import bpy
from io_anim_bvh import import_bvh

FOLDER = sys.argv[sys.argv.index("--") + 1]


def open_text(path, mode="r", **options):
    """Blender 3.4 asks for the mode rU, which Python 3.11 does not have any more."""
    return open(path, mode.replace("U", ""), **options)


import_bvh.open = open_text


def places_of(rig, frames):
    places = {bone.name: [] for bone in rig.pose.bones}
    for frame in range(frames):
        bpy.context.scene.frame_set(1 + frame)
        for bone in rig.pose.bones:
            places[bone.name].append(list(rig.matrix_world @ bone.head))
    return places


def export(path, frames, order, **options):
    bpy.ops.export_anim.bvh(filepath=path, frame_start=1, frame_end=frames, rotate_mode=order, **options)


def main():
    for path in glob.glob(FOLDER + "/*.bvh"):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.import_anim.bvh(
            filepath=path, axis_forward="Y", axis_up="Z", rotate_mode="NATIVE", update_scene_fps=True)
        rig = next(o for o in bpy.data.objects if o.type == "ARMATURE")
        name = path[: -len(".bvh")]
        frames = round(rig.animation_data.action.frame_range[1])
        with open(name + ".places", "w", encoding="utf-8") as file:
            json.dump(places_of(rig, frames), file)
        bpy.context.view_layer.objects.active = rig
        for order in ("NATIVE", "XYZ", "YZX"):
            export(name + ".again." + order, frames, order)
        with open(path, encoding="utf-8") as file:
            if len(re.findall("^\\s*CHANNELS 6 ", file.read(), re.MULTILINE)) == 1:
                export(name + ".again.root", frames, "NATIVE", root_transform_only=True)


main()
