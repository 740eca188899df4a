// A mesh of a level that is sculpted: its points in the order of surface.bin, and the vertices of the picture that show
// them.
import { Quaternion, Vector3 } from 'three';

const keyAt = (values, i) => `${values[3 * i]} ${values[3 * i + 1]} ${values[3 * i + 2]}`;

/** Of a geometry: which points its vertices show, its triangles at each point, and its normals before a stroke. */
class Shown {
  constructor(geometry, places) {
    this.geometry = geometry;
    const { position, normal } = geometry.attributes;
    this.index = geometry.index?.array ?? Uint32Array.from({ length: position.count }, (_, i) => i);
    this.pointOf = new Int32Array(position.count).fill(-1);
    this.vertices = new Map(); // by point
    for (let i = 0; i < position.count; i++) {
      const point = places.get(keyAt(position.array, i));
      if (point === undefined) continue;
      this.pointOf[i] = point;
      if (!this.vertices.has(point)) this.vertices.set(point, []);
      this.vertices.get(point).push(i);
    }
    this.normals = normal?.array.slice();
    this.rest = position.array.slice();
  }

  /** By vertex, the triangles that use it. */
  get triangles() {
    this.known ??= Array.from({ length: this.pointOf.length }, () => []);
    if (this.isSorted) return this.known;
    for (let i = 0; i < this.index.length; i += 3) for (let k = 0; k < 3; k++) this.known[this.index[i + k]].push(i);
    this.isSorted = true;
    return this.known;
  }

  /** The normal that triangles give a vertex. */
  #facing(places, vertex) {
    const sum = new Vector3();
    const [a, b, c] = [new Vector3(), new Vector3(), new Vector3()];
    for (const i of this.triangles[vertex]) {
      [a, b, c].forEach((corner, k) => corner.fromArray(places, 3 * this.index[i + k]));
      sum.add(b.sub(a).cross(c.sub(a)));
    }
    return sum.normalize();
  }

  /** Takes over the places of points, and turns normals as their triangles turned since the last rest. */
  show(points, indices) {
    const { position, normal } = this.geometry.attributes;
    const around = new Set();
    for (const point of indices)
      for (const vertex of this.vertices.get(point) ?? []) {
        position.array.set(points.subarray(3 * point, 3 * point + 3), 3 * vertex);
        if (normal) for (const i of this.triangles[vertex]) for (let k = 0; k < 3; k++) around.add(this.index[i + k]);
      }
    const [turn, old] = [new Quaternion(), new Vector3()];
    for (const vertex of around) {
      const [before, now] = [this.#facing(this.rest, vertex), this.#facing(position.array, vertex)];
      old.fromArray(this.normals, 3 * vertex);
      if (before.lengthSq() > 0 && now.lengthSq() > 0) old.applyQuaternion(turn.setFromUnitVectors(before, now));
      old.toArray(normal.array, 3 * vertex);
    }
    position.needsUpdate = true;
    if (normal) normal.needsUpdate = true;
    this.geometry.boundingSphere = this.geometry.boundingBox = null;
  }
}

export class SculptMesh {
  /** points: [x, y, z, …] of the mesh; geometries: those of the picture that show it. */
  constructor(points, geometries) {
    this.points = points;
    this.stored = points.slice(); // as the daemon has them
    const places = new Map();
    this.first = Uint32Array.from({ length: points.length / 3 }, (_, i) => { // of the points at the same place, which move alike
      const key = keyAt(points, i);
      if (!places.has(key)) places.set(key, i);
      return places.get(key);
    });
    this.shown = [...new Set(geometries)].map((geometry) => new Shown(geometry, places));
  }

  at(index, place) {
    return place.fromArray(this.points, 3 * index);
  }

  get #neighbours() {
    if (this.around) return this.around;
    this.around = Array.from({ length: this.points.length / 3 }, () => new Set());
    for (const { index, pointOf } of this.shown)
      for (let i = 0; i < index.length; i += 3) {
        const corners = [0, 1, 2].map((k) => pointOf[index[i + k]]);
        if (!corners.includes(-1)) corners.forEach((point, k) => this.around[point].add(corners[(k + 1) % 3]).add(corners[(k + 2) % 3]));
      }
    return this.around;
  }

  /** The mean of the points around a point; its own place where there are none. */
  middleAround(index) {
    const [sum, place] = [new Vector3(), new Vector3()];
    const around = this.#neighbours[this.first[index]];
    for (const other of around) sum.add(this.at(other, place));
    return around.size > 0 ? sum.divideScalar(around.size) : this.at(index, sum);
  }

  normalAt(index) {
    for (const { vertices, geometry: { attributes: { normal } } } of this.shown) {
      const vertex = vertices.get(this.first[index])?.[0];
      if (vertex !== undefined && normal) return new Vector3().fromBufferAttribute(normal, vertex);
    }
    return new Vector3();
  }

  /** The index of the point that is nearest to a place. */
  nearest(place) {
    let [nearest, found] = [Infinity, -1];
    const { points } = this;
    for (let i = 0; i < points.length; i += 3) {
      const distance = (points[i] - place.x) ** 2 + (points[i + 1] - place.y) ** 2 + (points[i + 2] - place.z) ** 2;
      if (distance < nearest) [nearest, found] = [distance, i / 3];
    }
    return found;
  }

  /** Draws moved points. */
  show(indices) {
    for (const shown of this.shown) shown.show(this.points, indices);
  }

  /** Puts points back to places. */
  restore(places, indices) {
    for (const index of indices) this.points.set(places.subarray(3 * index, 3 * index + 3), 3 * index);
    this.show(indices);
  }
}
