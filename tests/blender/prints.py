"""What Blender sees of files for printers: `blender --background --python prints.py -- FILE...` prints one line of JSON for
each GLB, STL or PLY: triangles, edges that have not two faces, shells, volume and bounds, in the axes of glTF.
"""
import json
import sys

import bmesh
import bpy
import numpy
from mathutils import Matrix

# Blender 3.4's importer asks for a name that later versions of numpy dropped.
numpy.bool = bool

IMPORTS = {
    # What glTF has as y, Blender has as z; files for printers have no axes of their own.
    "glb": lambda path: (bpy.ops.import_scene.gltf(filepath=path), Matrix(((1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)))),
    "stl": lambda path: (bpy.ops.import_mesh.stl(filepath=path, axis_up="Z", axis_forward="Y"), Matrix()),
    "ply": lambda path: (bpy.ops.import_mesh.ply(filepath=path), Matrix()),
}


def join(triangles):
    """The triangles by numbers of their points: equal points have one number."""
    numbers = {}
    return [[numbers.setdefault(tuple(point), len(numbers)) for point in triangle] for triangle in triangles]


def count_shells(faces, count):
    shell = list(range(count))

    def find(i):
        while shell[i] != i:
            shell[i] = shell[shell[i]]
            i = shell[i]
        return i

    for a, b, c in faces:
        shell[find(a)] = shell[find(c)] = find(b)
    return len({find(face[0]) for face in faces})


def look(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _, turn = IMPORTS[path.rsplit(".", 1)[1]](path)
    triangles = []
    for figure in [o for o in bpy.data.objects if o.type == "MESH"]:
        mesh = bmesh.new()
        mesh.from_mesh(figure.data)
        mesh.transform(turn @ figure.matrix_world)
        bmesh.ops.triangulate(mesh, faces=mesh.faces)
        triangles += [[vertex.co.copy().freeze() for vertex in face.verts] for face in mesh.faces]
        mesh.free()
    faces = join(triangles)
    edges = {}
    for face in faces:
        for i in range(3):
            edge = frozenset((face[i], face[(i + 1) % 3]))
            edges[edge] = edges.get(edge, 0) + 1
    points = numpy.array([tuple(point) for triangle in triangles for point in triangle]).reshape(-1, 3, 3).astype(float)
    print(json.dumps({
        "file": path.rsplit("/", 1)[-1],
        "triangles": len(triangles),
        "open": sum(count != 2 for count in edges.values()),
        "shells": count_shells(faces, max(map(max, faces)) + 1),
        "volume": float(numpy.einsum("ij,ij->i", points[:, 0], numpy.cross(points[:, 1], points[:, 2])).sum() / 6),
        "bounds": [points.min(axis=(0, 1)).tolist(), points.max(axis=(0, 1)).tolist()],
    }))


for file in sys.argv[sys.argv.index("--") + 1:]:
    look(file)
