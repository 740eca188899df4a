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

  /** The gradient of the weight at a place under the brush. */
  slopeAt(place) {
    const away = place.clone().sub(this.centre);
    const pulled = away.clone().applyMatrix3(this.metric);
    return pulled.multiplyScalar((-4 * (1 - away.dot(pulled) / this.radius ** 2)) / this.radius ** 2);
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

/** One dab: where it takes the points under a brush, {indices, by: how far each goes}. */
function dab(mesh, brush, move) {
  const [indices, weights] = brush.under(mesh.points);
  const [before, after] = [new Vector3(), new Vector3()];
  const by = indices.map((index, k) => move(after.copy(mesh.at(index, before)), index, weights[k]).clone().sub(before));
  return { indices, by };
}

/** Moves points as dabs say that were computed from the same places. Returns their indices. */
export function apply(mesh, dabs) {
  const place = new Vector3();
  for (const { indices, by } of dabs) indices.forEach((index, k) => mesh.at(index, place).add(by[k]).toArray(mesh.points, 3 * index));
  return dabs.flatMap(({ indices }) => indices);
}

/** mesh: a SculptMesh; strength: from 0 to 1, below 0 the other way round; normal: of the surface at the brush's centre. */
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

/** How a normal turns where a brush moves its points by a vector: the move is the matrix 1 + by ⊗ slope, and normals
 *  transform by its cofactors. */
export function turnedBy(by, slope, normal) {
  const along = by.dot(normal);
  return normal.multiplyScalar(1 + slope.dot(by)).addScaledVector(slope, -along).normalize();
}

/** Moves the points that a brush held at the beginning of a stroke by a vector, from their places then. */
export function grab(mesh, { indices, weights }, from, by) {
  indices.forEach((index, k) => {
    for (let i = 0; i < 3; i++) mesh.points[3 * index + i] = from[3 * index + i] + by.getComponent(i) * weights[k];
  });
  return indices;
}
