// A brush moves places softly: one in its middle goes all the way, those at its radius stay.
import { Matrix3, Vector3 } from 'three';

export class Brush {
  /** centre: in the space of an object, which has matrixWorld; radius: in the world. */
  constructor(centre, matrixWorld, radius) {
    this.centre = centre;
    this.radius = radius;
    const toWorld = new Matrix3().setFromMatrix4(matrixWorld);
    this.metric = toWorld.clone().transpose().multiply(toWorld); // of lengths in the world
    this.away = new Vector3();
  }

  /** The part of a move that a place makes, (1 - s)² with s the square of its distance by radii, and how that changes from
   *  place to place; null where it stays. */
  at(place) {
    const away = this.away.subVectors(place, this.centre);
    const pulled = away.clone().applyMatrix3(this.metric);
    const s = away.dot(pulled) / this.radius ** 2;
    if (s >= 1) return null;
    return { part: (1 - s) ** 2, slope: pulled.multiplyScalar((-4 * (1 - s)) / this.radius ** 2) };
  }
}

/** The points of a geometry under a brush, which move with it. */
export class Grip {
  constructor(geometry, brush) {
    const { position, normal } = geometry.attributes;
    this.geometry = geometry;
    this.points = [];
    const place = new Vector3();
    for (let i = 0; i < position.count; i++) {
      const pull = brush.at(place.fromBufferAttribute(position, i));
      if (pull) this.points.push({ i, ...pull, place: place.clone(), normal: normal && new Vector3().fromBufferAttribute(normal, i) });
    }
  }

  /** Moves the points by a vector from where they were first. */
  move(by) {
    const { position, normal } = this.geometry.attributes;
    const [place, turned] = [new Vector3(), new Vector3()];
    for (const point of this.points) {
      place.copy(point.place).addScaledVector(by, point.part);
      position.setXYZ(point.i, ...place);
      if (!normal) continue;
      // The cofactors of 1 + by ⊗ slope, which the move is nearby, turn normals.
      turned.copy(point.normal).multiplyScalar(1 + point.slope.dot(by)).addScaledVector(point.slope, -by.dot(point.normal)).normalize();
      normal.setXYZ(point.i, ...turned);
    }
    position.needsUpdate = true;
    if (normal) normal.needsUpdate = true;
    this.geometry.boundingSphere = null;
  }
}
