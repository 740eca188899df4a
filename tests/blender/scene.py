"""A small figure as an artist makes it, for `blender --background --python scene.py -- FOLDER`.

Writes into FOLDER
  figure.glb      Blender's own export: quads with texture coordinates, hard edges, two materials, an armature,
                  two shape keys, and the actions "bend" (bones) and "grow" (shape keys)
  expected.json   what Blender says of the figure: counts, names, hard edges, and positions in glTF's axes:
                  the points of its Subdivision modifier, and the points that the actions move at their keys
"""
import json
import math
import sys

import bmesh
import bpy

FOLDER = sys.argv[sys.argv.index("--") + 1]
RINGS, SIDES, RADIUS, HEIGHT = 7, 8, 0.5, 3.0
KEYS = (1, 13, 25)  # frames, 24 a second


def gltf_axes(point):
    return [point.x, point.z, -point.y]


def make_mesh():
    """A closed tube of quads alone; its ends are strips of quads across."""
    mesh = bpy.data.meshes.new("figure")
    points, faces = [], []
    for ring in range(RINGS):
        for side in range(SIDES):
            turn = 2 * math.pi * side / SIDES
            radius = RADIUS * (1 + 0.3 * math.sin(1.7 * ring))
            points.append((radius * math.cos(turn), radius * math.sin(turn), HEIGHT * ring / (RINGS - 1)))
    for ring in range(RINGS - 1):
        for side in range(SIDES):
            a, b = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
            faces.append((a, b, b + SIDES, a + SIDES))
    top = (RINGS - 1) * SIDES
    for first, turned in ((0, True), (top, False)):
        for i in range(SIDES // 2 - 1):
            quad = [first + i, first + i + 1, first + SIDES - 2 - i, first + SIDES - 1 - i]
            faces.append(tuple(reversed(quad)) if turned else tuple(quad))
    mesh.from_pydata(points, [], faces)
    mesh.update()
    return mesh


def dress(mesh):
    """Texture coordinates with one seam, hard edges round the ends, two materials."""
    layer = mesh.uv_layers.new(name="UVMap")
    for face in mesh.polygons:
        sides = [mesh.loops[i].vertex_index % SIDES for i in face.loop_indices]
        crosses = max(sides) - min(sides) > 1 and face.index < (RINGS - 1) * SIDES
        for i, side in zip(face.loop_indices, sides):
            point = mesh.vertices[mesh.loops[i].vertex_index].co
            u = (side + (SIDES if crosses and side == 0 else 0)) / SIDES
            is_cap = face.index >= (RINGS - 1) * SIDES
            layer.data[i].uv = (0.5 + point.x, 0.5 + point.y) if is_cap else (u, point.z / HEIGHT)
    for name, color in (("skin", (0.8, 0.5, 0.4, 1)), ("cap", (0.2, 0.3, 0.8, 1))):
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = color
        mesh.materials.append(material)
    hard = []
    for face in mesh.polygons:
        face.use_smooth = True
        face.material_index = int(face.index >= (RINGS - 1) * SIDES)
    for edge in mesh.edges:
        rings = {v // SIDES for v in edge.vertices}
        sides = sorted(v % SIDES for v in edge.vertices)
        is_rim = rings in ({0}, {RINGS - 1}) and sides[1] - sides[0] in (1, SIDES - 1)
        edge.use_edge_sharp = is_rim
        if is_rim:
            hard.append(edge.index)
    mesh.use_auto_smooth = True
    mesh.auto_smooth_angle = math.pi
    return hard


def make_armature():
    data = bpy.data.armatures.new("rig")
    rig = bpy.data.objects.new("rig", data)
    bpy.context.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for i, name in enumerate(("hip", "spine", "head")):
        bone = data.edit_bones.new(name)
        bone.head, bone.tail = (0, 0, i), (0, 0, i + 1)
        bone.parent = parent
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


def bind(figure, rig):
    for i, name in enumerate(("hip", "spine", "head")):
        group = figure.vertex_groups.new(name=name)
        for vertex in figure.data.vertices:
            weight = max(0.0, 1 - abs(vertex.co.z - (i + 0.5)))
            if weight > 0:
                group.add([vertex.index], weight, "REPLACE")
    figure.parent = rig
    figure.modifiers.new("rig", "ARMATURE").object = rig


def add_shape_keys(figure):
    figure.shape_key_add(name="Basis")
    for name, axis, factor in (("wide", 0, 0.5), ("tall", 2, 0.2)):
        key = figure.shape_key_add(name=name)
        for point in key.data:
            point.co[axis] *= 1 + factor
    figure.data.shape_keys.key_blocks["wide"].value = 0.0


def stash(owner, action):
    """As an artist pushes an action down: each strip becomes a clip of the export."""
    track = owner.animation_data.nla_tracks.new()
    track.name = action.name
    track.strips.new(action.name, 1, action)
    owner.animation_data.action = None


def animate(figure, rig):
    rig.animation_data_create()
    bend = bpy.data.actions.new("bend")
    rig.animation_data.action = bend
    for name, angle in (("spine", 0.7), ("head", -0.9)):
        bone = rig.pose.bones[name]
        bone.rotation_mode = "QUATERNION"
        for frame, part in zip(KEYS, (0, 1, 0.3)):
            turn = angle * part / 2
            bone.rotation_quaternion = (math.cos(turn), math.sin(turn), 0, 0)
            bone.keyframe_insert("rotation_quaternion", frame=frame)
    shapes = figure.data.shape_keys
    shapes.animation_data_create()
    grow = bpy.data.actions.new("grow")
    shapes.animation_data.action = grow
    for name, values in (("wide", (0, 1, 0.5)), ("tall", (0.2, 0, 1))):
        for frame, value in zip(KEYS, values):
            shapes.key_blocks[name].value = value
            shapes.key_blocks[name].keyframe_insert("value", frame=frame)
    for action in (bend, grow):
        for curve in action.fcurves:
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
    return bend, grow


def moved_points(figure):
    """The points of the figure as modifiers and shape keys leave them, in the world."""
    graph = bpy.context.evaluated_depsgraph_get()
    shown = figure.evaluated_get(graph)
    mesh = shown.to_mesh()
    points = [gltf_axes(shown.matrix_world @ v.co) for v in mesh.vertices]
    faces = len(mesh.polygons)
    shown.to_mesh_clear()
    return points, faces


def refined(figure, hard, levels):
    """The points of Blender's own subdivision, hard edges as creases without end."""
    for edge in figure.data.edges:
        edge.crease = 1.0 if edge.index in hard else 0.0
    rig = figure.modifiers["rig"]
    rig.show_viewport = False
    out = {}
    for level in levels:
        modifier = figure.modifiers.new("smooth", "SUBSURF")
        modifier.levels = level
        modifier.use_limit_surface = False
        bpy.context.view_layer.update()
        points, faces = moved_points(figure)
        out[str(level)] = {"points": points, "faces": faces}
        figure.modifiers.remove(modifier)
    rig.show_viewport = True
    for edge in figure.data.edges:
        edge.crease = 0.0
    return out


def main():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    figure = bpy.data.objects.new("figure", make_mesh())
    bpy.context.collection.objects.link(figure)
    hard = dress(figure.data)
    rig = make_armature()
    bind(figure, rig)
    add_shape_keys(figure)
    shapes = figure.data.shape_keys
    for block in shapes.key_blocks:
        block.value = 0.0
    shapes.key_blocks["tall"].value = 0.2  # as "grow" begins: the export's weights at rest
    expected = {
        "faces": len(figure.data.polygons),
        "vertices": len(figure.data.vertices),
        "hard_edges": len(hard),
        "materials": [m.name for m in figure.data.materials],
        "bones": [b.name for b in rig.data.bones],
        "shape_keys": ["wide", "tall"],
        "clips": ["bend", "grow"],
        "surfaces": refined(figure, set(hard), (1, 2, 3)),
    }
    bend, grow = animate(figure, rig)
    rig.animation_data.action, shapes.animation_data.action = bend, grow
    expected["moved"] = []
    for frame in KEYS:
        bpy.context.scene.frame_set(frame)
        points, _ = moved_points(figure)
        # The exporter counts seconds from frame 0.
        expected["moved"].append({"time": frame / bpy.context.scene.render.fps, "points": points})
    bpy.context.scene.frame_set(0)
    stash(rig, bend)
    stash(shapes, grow)
    bpy.ops.export_scene.gltf(
        filepath=FOLDER + "/figure.glb", export_format="GLB", export_animations=True,
        export_nla_strips=True, export_force_sampling=False, export_morph=True, export_morph_normal=True,
        export_frame_range=False, export_apply=False)
    with open(FOLDER + "/expected.json", "w", encoding="utf-8") as file:
        json.dump(expected, file)


main()
