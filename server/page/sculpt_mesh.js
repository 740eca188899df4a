// A mesh of a level that is sculpted: its points in the order of surface.bin, and the vertices of the picture that show
// them.
import { Quaternion, Vector3 } from 'three';

/** The values of an attribute, which may be interleaved with others, one behind the other. */
function packed(attribute) {
  const values = new Float32Array(3 * attribute.count);
  for (let i = 0; i < attribute.count; i++) for (let k = 0; k < 3; k++) values[3 * i + k] = attribute.getComponent(i, k);
  return values;
}

const keyAt = (values, i) => `${values[3 * i]} ${values[3 * i + 1]} ${values[3 * i + 2]}`;

const APART = 1e-4; // of the mesh's extent: points of one place differ by rounding alone

/** Finds the point at a place: the one with the same bits, else the nearest of those that are close. */
class Finder {
  constructor(points, places) {
    Object.assign(this, { points, places });
  }

  #cell(...place) {
    return place.map((value) => Math.round(value / this.size)).join();
  }

  /** The cells are filled when the first place has other bits. */
  #fill() {
    const { points } = this;
    const [least, most] = points.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
    this.size = Math.max((most - least) * APART, 1e-30);
    this.cells = new Map();
    for (const i of this.places.values()) {
      const key = this.#cell(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
      if (!this.cells.has(key)) this.cells.set(key, []);
      this.cells.get(key).push(i);
    }
  }

  /** values: [x, y, z, …]; i: of the place. -1 where no point is close. */
  at(values, i) {
    const same = this.places.get(keyAt(values, i));
    if (same !== undefined) return same;
    if (!this.cells) this.#fill();
    const [x, y, z] = values.subarray(3 * i, 3 * i + 3);
    const sides = [-0.3 * this.size, 0.3 * this.size]; // also finds points near the border of two cells
    const found = sides.flatMap((a) => sides.flatMap((b) => sides.flatMap((c) => this.cells.get(this.#cell(x + a, y + b, z + c)) ?? [])));
    const away = (k) => Math.hypot(this.points[3 * k] - x, this.points[3 * k + 1] - y, this.points[3 * k + 2] - z);
    return found.length > 0 ? found.reduce((best, k) => (away(k) < away(best) ? k : best)) : -1;
  }
}

/** Of a geometry: which points its vertices show, its triangles at each vertex, and its places and normals before a stroke. */
class Shown {
  constructor(geometry, finder) {
    this.geometry = geometry;
    const { position } = geometry.attributes;
    this.index = geometry.index?.array ?? Uint32Array.from({ length: position.count }, (_, i) => i);
    this.pointOf = new Int32Array(position.count).fill(-1);
    this.vertices = new Map(); // by point
    this.places = packed(position);
    for (let i = 0; i < position.count; i++) {
      const point = finder.at(this.places, i);
      if (point < 0) continue;
      this.pointOf[i] = point;
      if (!this.vertices.has(point)) this.vertices.set(point, []);
      this.vertices.get(point).push(i);
    }
    this.hold();
  }

  hold() {
    const { normal } = this.geometry.attributes;
    this.rest = this.places.slice();
    this.normals = normal && packed(normal);
  }

  /** By vertex, the triangles that use it; found when they are first needed. */
  get triangles() {
    if (this.known) return this.known;
    this.known = Array.from({ length: this.pointOf.length }, () => []);
    for (let i = 0; i < this.index.length; i += 3) for (let k = 0; k < 3; k++) this.known[this.index[i + k]].push(i);
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

  /** Takes over the places of points, and turns normals by turn(point, normal), else as their triangles have turned since
   *  the stroke began. */
  show(points, indices, turn) {
    const { position, normal } = this.geometry.attributes;
    const around = new Set();
    for (const point of indices)
      for (const vertex of this.vertices.get(point) ?? []) {
        const place = points.subarray(3 * point, 3 * point + 3);
        this.places.set(place, 3 * vertex);
        position.setXYZ(vertex, ...place);
        if (turn && normal) normal.setXYZ(vertex, ...turn(point, new Vector3().fromArray(this.normals, 3 * vertex)));
        else if (normal) for (const i of this.triangles[vertex]) for (let k = 0; k < 3; k++) around.add(this.index[i + k]);
      }
    const [turned, old] = [new Quaternion(), new Vector3()];
    for (const vertex of around) {
      const [before, now] = [this.#facing(this.rest, vertex), this.#facing(this.places, vertex)];
      old.fromArray(this.normals, 3 * vertex);
      if (before.lengthSq() > 0 && now.lengthSq() > 0) old.applyQuaternion(turned.setFromUnitVectors(before, now));
      normal.setXYZ(vertex, ...old);
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
    const finder = new Finder(points, places);
    this.shown = [...new Set(geometries)].map((geometry) => new Shown(geometry, finder));
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

  /** A stroke begins: normals turn from how they are now. */
  hold() {
    for (const shown of this.shown) shown.hold();
  }

  /** Draws moved points. turn(point, normal): how its normal turns, where that is known. */
  show(indices, turn) {
    for (const shown of this.shown) shown.show(this.points, indices, turn);
  }

  /** Puts points back to places. */
  restore(places, indices) {
    for (const index of indices) this.points.set(places.subarray(3 * index, 3 * index + 3), 3 * index);
    this.show(indices);
  }
}
