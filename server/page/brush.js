// A brush with soft falloff: its centre moves all the way, points at its radius stay.
import { Matrix3, Vector3 } from 'three';

export class Brush {
  /** centre: in the object's space; matrixWorld: of that object; radius: in world space. */
  constructor(centre, matrixWorld, radius) {
    this.centre = centre;
    this.radius = radius;
    const toWorld = new Matrix3().setFromMatrix4(matrixWorld);
    this.metric = toWorld.clone().transpose().multiply(toWorld); // measures world lengths of vectors in the object's space
    this.away = new Vector3();
  }

  /** The weight of a place, (1 - s)² where s is the square of its distance in radii, and the weight's gradient,
   *  `slope`; null outside the brush. */
  at(place) {
    const away = this.away.subVectors(place, this.centre);
    const pulled = away.clone().applyMatrix3(this.metric);
    const s = away.dot(pulled) / this.radius ** 2;
    if (s >= 1) return null;
    return { part: (1 - s) ** 2, slope: pulled.multiplyScalar((-4 * (1 - s)) / this.radius ** 2) };
  }
}

/** The points of a geometry that a brush moves. */
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

  /** Moves the points by a vector from their original places. */
  move(by) {
    const { position, normal } = this.geometry.attributes;
    const [place, turned] = [new Vector3(), new Vector3()];
    for (const point of this.points) {
      place.copy(point.place).addScaledVector(by, point.part);
      position.setXYZ(point.i, ...place);
      if (!normal) continue;
      // Locally the move is the matrix 1 + by ⊗ slope; normals transform by its cofactors.
      turned.copy(point.normal).multiplyScalar(1 + point.slope.dot(by)).addScaledVector(point.slope, -by.dot(point.normal)).normalize();
      normal.setXYZ(point.i, ...turned);
    }
    position.needsUpdate = true;
    if (normal) normal.needsUpdate = true;
    this.geometry.boundingSphere = null;
  }
}
