// What the brushes of the Sculpt tab do to the points under them. Falloff is soft: the centre moves all the way, points
// at the radius stay.
import { Matrix3, Vector3 } from 'three';

const STEP = 0.12;   // of the radius: how far one dab of full strength moves
const PINCH = 0.35;  // of the way to the centre, likewise
const SMOOTH = 0.6;  // of the way to the neighbours

export class Brush {
  /** centre: in the object's space; matrixWorld: of that object; radius: in world space. */
  constructor(centre, matrixWorld, radius) {
    const toWorld = new Matrix3().setFromMatrix4(matrixWorld);
    this.centre = centre;
    this.metric = toWorld.clone().transpose().multiply(toWorld); // measures world lengths of vectors in the object's space
    this.radius = radius;
    this.reach = radius / Math.cbrt(Math.abs(toWorld.determinant()) || 1); // the radius in the object's space
  }

  /** [indices, weights] of the points under the brush; the weight is (1 - s)², where s is the square of the distance in
   *  radii. */
  under(points) {
    const { x, y, z } = this.centre;
    const [a, b, c, , d, e, , , f] = this.metric.elements;
    const most = this.radius ** 2;
    const [indices, weights] = [[], []];
    for (let i = 0; i < points.length; i += 3) {
      const [u, v, w] = [points[i] - x, points[i + 1] - y, points[i + 2] - z];
      const s = (u * u * a + v * v * d + w * w * f + 2 * (u * v * b + u * w * c + v * w * e)) / most;
      if (s >= 1) continue;
      indices.push(i / 3);
      weights.push((1 - s) ** 2);
    }
    return [indices, weights];
  }
}

/** One dab: moves the points under a brush. mesh: a SculptMesh; strength: from 0 to 1, below 0 the other way round.
 *  Returns the indices of the points that moved. */
function dab(mesh, brush, move) {
  const [indices, weights] = brush.under(mesh.points);
  const next = new Float32Array(3 * indices.length);
  const place = new Vector3();
  indices.forEach((index, k) => move(mesh.at(index, place), index, weights[k]).toArray(next, 3 * k)); // all from the places before
  indices.forEach((index, k) => mesh.points.set(next.subarray(3 * k, 3 * k + 3), 3 * index));
  return indices;
}

/** normal: of the surface at the brush's centre. */
export const BRUSHES = {
  draw: (mesh, brush, strength, normal) =>
    dab(mesh, brush, (place, index, weight) => place.addScaledVector(normal, weight * strength * STEP * brush.reach)),
  inflate: (mesh, brush, strength) =>
    dab(mesh, brush, (place, index, weight) => place.addScaledVector(mesh.normalAt(index), weight * strength * STEP * brush.reach)),
  smooth: (mesh, brush, strength) =>
    dab(mesh, brush, (place, index, weight) => place.lerp(mesh.middleAround(index), weight * Math.abs(strength) * SMOOTH)),
  flatten(mesh, brush, strength, normal) {
    const [indices, weights] = brush.under(mesh.points);
    const total = weights.reduce((sum, weight) => sum + weight, 0);
    const [place, middle] = [new Vector3(), new Vector3()];
    indices.forEach((index, k) => middle.addScaledVector(mesh.at(index, place), weights[k] / total));
    return dab(mesh, brush, (at, index, weight) => at.addScaledVector(normal, weight * strength * SMOOTH * middle.clone().sub(at).dot(normal)));
  },
  crease: (mesh, brush, strength, normal) =>
    dab(mesh, brush, (place, index, weight) => {
      const inward = brush.centre.clone().sub(place);
      inward.addScaledVector(normal, -inward.dot(normal)); // within the tangent plane
      return place.addScaledVector(inward, weight * Math.abs(strength) * PINCH).addScaledVector(normal, -weight * strength * STEP * brush.reach);
    }),
};

/** Moves the points that a brush held at the beginning of a stroke by a vector, from their places then. */
export function grab(mesh, { indices, weights }, from, by) {
  indices.forEach((index, k) => {
    for (let i = 0; i < 3; i++) mesh.points[3 * index + i] = from[3 * index + i] + by.getComponent(i) * weights[k];
  });
  return indices;
}
