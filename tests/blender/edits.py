"""Meshes that Blender edits, for `blender --background --python edits.py -- FOLDER`.

Writes FOLDER/edits.json: a list of {name, body, same, points, faces}. body is tweend JSON of the mesh as it was,
with the edits in its words, or of a shape; points and faces are what Blender's operators made. They are the same
but for two things, which `same` tells:

places  Faces that move and meet in a point alone: Blender leaves that point to both, so that it is no manifold
        any more; tweend gives each its own.
points  A quad of whose four edges three are cut: Blender divides it, which sends edges that nobody asked for over
        it; tweend gives it more corners, as both do where one edge is cut.
"""
import json
import random
import sys

import bmesh
import bpy

FOLDER = sys.argv[sys.argv.index("--") + 1]


def cube():
    bpy.ops.mesh.primitive_cube_add()


def grid():
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=5)


def cylinder():
    bpy.ops.mesh.primitive_cylinder_add(vertices=12)


def icosphere():
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)


def suzanne():
    bpy.ops.mesh.primitive_monkey_add()


def ring_of(mesh, edge):
    """The edges that Blender selects as the ring through one."""
    for e in mesh.edges:
        e.select = False
    for part in (mesh.verts, mesh.faces):
        for element in part:
            element.select = False
    edge.select = True
    bmesh.update_edit_mesh(bpy.context.object.data)
    bpy.ops.mesh.loop_multi_select(ring=True)
    return [e for e in mesh.edges if e.select]


def loop_cut(edge, cuts):
    def run(mesh):
        e = mesh.edges[edge]
        ends = [v.index for v in e.verts]
        ring = ring_of(mesh, e)
        bmesh.ops.subdivide_edges(mesh, edges=ring, cuts=cuts, use_grid_fill=True)
        return {"edit": "loop_cut", "edge": ends, "cuts": cuts}, "all"

    return run


def subdivide(mesh, edges, cuts):
    """Returns what is the same."""
    is_odd = any(len(f.edges) == 4 and sum(e in edges for e in f.edges) == 3 for f in mesh.faces)
    bmesh.ops.subdivide_edges(mesh, edges=list(edges), cuts=cuts, use_grid_fill=True)
    return "points" if is_odd else "all"


def subdivide_faces(faces, cuts):
    def run(mesh):
        chosen = list(mesh.faces) if faces == "all" else [mesh.faces[f] for f in faces]
        same = subdivide(mesh, {e for f in chosen for e in f.edges}, cuts)
        return {"edit": "subdivide", "faces": faces, "cuts": cuts}, same

    return run


def subdivide_edges(edges, cuts):
    def run(mesh):
        chosen = {mesh.edges[e] for e in edges}
        pairs = [[v.index for v in e.verts] for e in chosen]
        same = subdivide(mesh, chosen, cuts)
        return {"edit": "subdivide", "edges": pairs, "cuts": cuts}, same

    return run


def meet_in_points(faces):
    """Whether some of the faces have a point in common, and no edge between them there."""

    def is_split(v):
        here = [f for f in v.link_faces if f in faces]
        joints = [e for e in v.link_edges if sum(f in faces for f in e.link_faces) == 2]
        return len(here) - len(joints) > 1

    return any(is_split(v) for f in faces for v in f.verts)


def inside_of(faces):
    """The elements that Blender's own tool hands to the operator: it removes what is left inside."""
    return list({e for f in faces for e in f.edges} | {v for f in faces for v in f.verts}) + faces


def extrude(faces, by):
    def run(mesh):
        chosen = [mesh.faces[f] for f in faces]
        same = "places" if meet_in_points(chosen) else "all"
        made = bmesh.ops.extrude_face_region(mesh, geom=inside_of(chosen))
        bmesh.ops.translate(mesh, verts=[v for v in made["geom"] if isinstance(v, bmesh.types.BMVert)], vec=by)
        return {"edit": "extrude", "faces": faces, "by": by}, same

    return run


def extrude_each(faces, distance):
    def run(mesh):
        made = bmesh.ops.extrude_discrete_faces(mesh, faces=[mesh.faces[f] for f in faces])
        for face in made["faces"]:
            bmesh.ops.translate(mesh, verts=list(face.verts), vec=face.normal * distance)
        return {"edit": "extrude", "faces": faces, "distance": distance, "individual": True}, "all"

    return run


def inset(faces, amount):
    def run(mesh):
        bmesh.ops.inset_region(
            mesh, faces=[mesh.faces[f] for f in faces], thickness=amount, use_even_offset=True, use_boundary=True
        )
        return {"edit": "inset", "faces": faces, "amount": amount}, "all"

    return run


def inset_each(faces, amount):
    def run(mesh):
        bmesh.ops.inset_individual(
            mesh, faces=[mesh.faces[f] for f in faces], thickness=amount, use_even_offset=True
        )
        return {"edit": "inset", "faces": faces, "amount": amount, "individual": True}, "all"

    return run


CASES = [
    (cube, loop_cut(0, 1)),
    (cube, loop_cut(5, 4)),
    (grid, loop_cut(3, 2)),
    (cylinder, loop_cut(2, 3)),
    (suzanne, loop_cut(100, 2)),
    (suzanne, loop_cut(420, 1)),
    (suzanne, loop_cut(700, 3)),
    (cube, subdivide_faces("all", 3)),
    (icosphere, subdivide_faces("all", 2)),
    (suzanne, subdivide_faces("all", 1)),
    (cube, subdivide_faces([2], 2)),
    (icosphere, subdivide_faces([7], 2)),
    (grid, subdivide_edges([0, 9], 2)),
    (cylinder, subdivide_edges([0, 5, 6], 1)),
    (cube, extrude([0], [0.25, 0.5, 1])),
    (suzanne, extrude([10, 11, 12, 13, 200], [0.1, -0.5, 0.2])),
    (grid, extrude([4, 5], [0, 0, 0.5])),
    (cylinder, extrude_each([0, 1, 5], 0.5)),
    (suzanne, extrude_each([1, 3, 5, 100], 0.125)),
    (cube, inset([3], 0.25)),
    (grid, inset([4, 5, 8, 9], 0.1)),
    (cylinder, inset([0, 1, 2], 0.1)),
    (cube, inset_each([0, 1, 2, 3, 4, 5], 0.25)),
    (suzanne, inset_each([0, 1, 2, 30], 0.01)),
]


def sweep():
    """Any elements of every mesh, by every operator."""
    any_of = random.Random(5)
    cases = []
    for shape, edge_count, face_count in ((cube, 12, 6), (grid, 49, 20), (cylinder, 36, 14), (suzanne, 1005, 500)):
        for _ in range(5):
            faces = any_of.sample(range(face_count), any_of.randint(1, 5))
            edges = any_of.sample(range(edge_count), any_of.randint(1, 6))
            edits = (
                loop_cut(any_of.randrange(edge_count), any_of.randint(1, 4)),
                subdivide_edges(edges, any_of.randint(1, 3)),
                subdivide_faces(faces, any_of.randint(1, 3)),
                extrude(faces, [0.1, 0.2, 0.3]),
                extrude_each(faces, 0.1),
                inset(faces, 0.01),
                inset_each(faces, 0.01),
            )
            cases += [(shape, edit) for edit in edits]
    return cases


def segmented_cube(segments):
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.mode_set(mode="EDIT")
    mesh = bmesh.from_edit_mesh(bpy.context.object.data)
    bmesh.ops.subdivide_edges(mesh, edges=list(mesh.edges), cuts=segments - 1, use_grid_fill=True)


# Blender's angles begin elsewhere: a number of segments that four divides makes the same points of any of them. Its
# icosphere stands on a point, ours on an edge as three.js's does, with which tests/node compares it.
SHAPES = [
    (
        {"kind": "grid", "size": [2, 2], "segments": [4, 6]},
        lambda add: add.primitive_grid_add(x_subdivisions=4, y_subdivisions=6),
    ),
    ({"kind": "box", "size": [2, 2, 2], "segments": [3, 3, 3]}, lambda add: segmented_cube(3)),
    (
        {"kind": "uv_sphere", "segments": 12, "rings": 7},
        lambda add: add.primitive_uv_sphere_add(segments=12, ring_count=7),
    ),
    ({"kind": "cylinder", "height": 3, "segments": 8}, lambda add: add.primitive_cylinder_add(vertices=8, depth=3)),
    (
        {"kind": "cylinder", "height": 3, "segments": 8, "caps": "fan"},
        lambda add: add.primitive_cylinder_add(vertices=8, depth=3, end_fill_type="TRIFAN"),
    ),
    (
        {"kind": "cylinder", "height": 3, "segments": 8, "caps": "none"},
        lambda add: add.primitive_cylinder_add(vertices=8, depth=3, end_fill_type="NOTHING"),
    ),
    (
        {"kind": "cone", "height": 3, "segments": 12, "rings": 1},
        lambda add: add.primitive_cone_add(vertices=12, depth=3),
    ),
    (
        {"kind": "torus", "radius": 2, "tube": 0.5, "segments": 12, "sides": 8},
        lambda add: add.primitive_torus_add(major_radius=2, minor_radius=0.5, major_segments=12, minor_segments=8),
    ),
]


def write(mesh):
    mesh.verts.index_update()
    return [list(v.co) for v in mesh.verts], [[v.index for v in f.verts] for f in mesh.faces]


def begin(add):
    """The mesh that is added to an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.tool_settings.mesh_select_mode = (False, True, False)
    mesh = bmesh.from_edit_mesh(bpy.context.object.data)
    for part in (mesh.verts, mesh.edges, mesh.faces):
        part.ensure_lookup_table()
    return mesh


def main():
    made = []
    for number, (shape, edit) in enumerate(CASES + sweep()):
        mesh = begin(shape)
        positions, faces = write(mesh)
        words, same = edit(mesh)
        points, made_faces = write(mesh)
        name = f"{number} {shape.__name__} {words['edit']}"
        body = {"meshes": [{"positions": positions, "faces": faces, "edits": [words]}]}
        made.append({"name": name, "body": body, "same": same, "points": points, "faces": made_faces})
    for shape, add in SHAPES:
        points, faces = write(begin(lambda: add(bpy.ops.mesh)))
        body = {"meshes": [{"shape": shape}]}
        upright = [[x, z, -y] for x, y, z in points]
        made.append({"name": shape["kind"], "body": body, "same": "all", "points": upright, "faces": faces})
    with open(FOLDER + "/edits.json", "w", encoding="utf-8") as file:
        json.dump(made, file)


main()
