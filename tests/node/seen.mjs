// What is seen of a file: its triangles, in the order in which they face outwards.
import assert from 'node:assert/strict';

import { Matrix4, Mesh, Vector3 } from 'three';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';

/** [triangle][corner], moved by a matrix. pointOf: where a mesh has its points, by their number. */
function trianglesOf({ attributes: { position }, index }, matrix, pointOf = (i, out) => out.fromBufferAttribute(position, i)) {
  const corners = Array.from({ length: index ? index.count : position.count }, (_, i) => pointOf(index ? index.getX(i) : i, new Vector3()).applyMatrix4(matrix));
  const second = matrix.determinant() < 0 ? 2 : 1;
  return Array.from({ length: corners.length / 3 }, (_, i) => [corners[3 * i], corners[3 * i + second], corners[3 * i + 3 - second]]);
}

/** What three draws of a scene: meshes at their nodes, instances, morph targets with their weights, and skins at their joints. */
export function drawn(scene) {
  scene.updateMatrixWorld(true);
  const all = [];
  scene.traverse((object) => {
    if (!object.isMesh) return;
    for (let i = 0; i < (object.count ?? 1); i++) {
      const matrix = new Matrix4();
      if (object.isInstancedMesh) object.getMatrixAt(i, matrix);
      const pointOf = (object.skeleton ? object : Mesh.prototype).getVertexPosition; // joints of a mesh without a skin have no say
      for (const triangle of trianglesOf(object.geometry, matrix.premultiply(object.matrixWorld), (k, out) => pointOf.call(object, k, out))) all.push(triangle);
    }
  });
  return all;
}

export const read = {
  obj: (bytes) => drawn(new OBJLoader().parse(bytes.toString())),
  stl: (bytes) => trianglesOf(new STLLoader().parse(new Uint8Array(bytes).buffer), new Matrix4()),
  ply: (bytes) => trianglesOf(new PLYLoader().parse(new Uint8Array(bytes).buffer), new Matrix4()),
};

/** Each triangle is one of the others, with corners in the same order from some corner on. */
export function assertSame(found, wanted, tolerance, why) {
  assert.equal(found.length, wanted.length, why);
  const left = [...wanted];
  for (const triangle of found) {
    const match = left.findIndex((other) => [0, 1, 2].some((k) => triangle.every((corner, i) => corner.distanceTo(other[(i + k) % 3]) <= tolerance)));
    assert.ok(match >= 0, `${why}: ${JSON.stringify(triangle)}`);
    left.splice(match, 1);
  }
}

export const volumeOf = (triangles) => triangles.reduce((sum, [a, b, c]) => sum + a.dot(b.clone().cross(c)) / 6, 0);

export const areaOf = (triangles) => triangles.reduce((sum, [a, b, c]) => sum + b.clone().sub(a).cross(c.clone().sub(a)).length() / 2, 0);

export function boundsOf(triangles) {
  const low = new Vector3(Infinity, Infinity, Infinity), high = low.clone().negate();
  for (const point of triangles.flat()) { low.min(point); high.max(point); }
  return [...low.toArray(), ...high.toArray()];
}
