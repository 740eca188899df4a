"""What Blender sees of a GLB: `blender --background --python look.py -- FILE EXPECTED` prints it as one line of JSON
that begins with "{": names, counts, bounds, and how far the points that its actions move are from those expected.
"""
import json
import sys

import bpy
import numpy
from mathutils import Vector, kdtree

# Blender 3.4's importer asks for a name that later versions of numpy dropped.
numpy.bool = bool

FILE, EXPECTED = sys.argv[sys.argv.index("--") + 1:]


def moved_points(figure):
    graph = bpy.context.evaluated_depsgraph_get()
    shown = figure.evaluated_get(graph)
    mesh = shown.to_mesh()
    points = [shown.matrix_world @ v.co for v in mesh.vertices]
    shown.to_mesh_clear()
    return points


def farthest(points, others):
    """The greatest distance from a point to the nearest of the others."""
    tree = kdtree.KDTree(len(others))
    for i, point in enumerate(others):
        tree.insert(point, i)
    tree.balance()
    return max(tree.find(point)[2] for point in points)


def play(figure, rig, expected):
    """Both actions at their keys; the actions are taken out of the tracks that the importer makes of them."""
    for owner, name in ((rig, "bend"), (figure.data.shape_keys, "grow")):
        action = next(a for a in bpy.data.actions if a.name.startswith(name))
        owner.animation_data_create()
        for track in list(owner.animation_data.nla_tracks):
            owner.animation_data.nla_tracks.remove(track)
        owner.animation_data.action = action
    worst = 0
    for pose in expected["moved"]:
        bpy.context.scene.frame_set(round(pose["time"] * bpy.context.scene.render.fps))
        wanted = [Vector((x, -z, y)) for x, y, z in pose["points"]]
        points = moved_points(figure)
        worst = max(worst, farthest(wanted, points), farthest(points, wanted))
    return worst


def main():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=FILE)
    with open(EXPECTED, encoding="utf-8") as file:
        expected = json.load(file)
    figure = next(o for o in bpy.data.objects if o.type == "MESH" and o.vertex_groups)
    rig = next(o for o in bpy.data.objects if o.type == "ARMATURE")
    corners = [figure.matrix_world @ Vector(corner) for corner in figure.bound_box]
    print(json.dumps({
        "objects": sorted(o.name for o in (figure, rig)),
        "triangles": len(figure.data.polygons),
        "uv_maps": len(figure.data.uv_layers),
        "materials": sorted(m.name for m in figure.data.materials),
        "bones": [b.name for b in rig.data.bones],
        "shape_keys": [k.name for k in figure.data.shape_keys.key_blocks][1:],
        "actions": sorted(a.name for a in bpy.data.actions),
        "bounds": [[f(c[i] for c in corners) for i in range(3)] for f in (min, max)],
        "off": play(figure, rig, expected),
    }))


main()
