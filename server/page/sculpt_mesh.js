// A mesh of a level that is sculpted: its points in the order of surface.bin, and the vertices of the picture that show
// them. There may be hundreds of thousands, so what is kept of each stands in arrays of numbers.
import { Quaternion, Vector3 } from 'three';

import { cornersOf } from './overlays.js';

/** The values of an attribute, which may be interleaved with others, one behind the other. */
function packed(attribute) {
  const values = new Float32Array(3 * attribute.count);
  for (let i = 0; i < attribute.count; i++) for (let k = 0; k < 3; k++) values[3 * i + k] = attribute.getComponent(i, k);
  return values;
}

/** Numbers 0, 1, … in groups: the group of number i is of[i], or none below 0. */
class Groups {
  constructor(of, count) {
    this.starts = new Uint32Array(count + 1);
    for (const group of of) if (group >= 0) this.starts[group + 1]++;
    for (let group = 0; group < count; group++) this.starts[group + 1] += this.starts[group];
    const ends = this.starts.slice();
    this.members = new Uint32Array(this.starts[count]);
    of.forEach((group, i) => group >= 0 && (this.members[ends[group]++] = i));
  }

  /** The numbers of a group, rising. */
  in(group) {
    return this.members.subarray(this.starts[group], this.starts[group + 1]);
  }
}

/** Finds the point at a place. The picture has a level's points to the last bit. */
class Finder {
  constructor(points) {
    const count = points.length / 3;
    this.points = points;
    this.heads = new Int32Array(2 ** Math.ceil(Math.log2(count + 2))).fill(-1); // by hash: a point
    this.next = new Int32Array(count); // another one with the same hash
    this.place = new Float32Array(3);
    this.bits = new Int32Array(this.place.buffer);
    this.first = new Uint32Array(count); // of the points at the same place, which move alike
    for (let i = 0; i < count; i++) {
      const same = this.at(points, i);
      this.first[i] = same < 0 ? i : same;
      if (same >= 0) continue;
      const slot = this.#slot(points, i);
      this.next[i] = this.heads[slot];
      this.heads[slot] = i;
    }
  }

  #slot(values, i) {
    for (let k = 0; k < 3; k++) this.place[k] = values[3 * i + k] + 0; // -0 is 0
    const [a, b, c] = this.bits;
    const sum = Math.imul(a, 0x9e3779b1) ^ Math.imul(b, 0x85ebca77) ^ Math.imul(c, 0xc2b2ae3d);
    return (sum ^ (sum >>> 15)) & (this.heads.length - 1);
  }

  /** values: [x, y, z, …]; i: of the place. -1 where there is no point. */
  at(values, i) {
    const { points, heads, next } = this;
    const [x, y, z] = [values[3 * i], values[3 * i + 1], values[3 * i + 2]];
    let found = heads[this.#slot(values, i)];
    while (found >= 0 && !(points[3 * found] === x && points[3 * found + 1] === y && points[3 * found + 2] === z)) found = next[found];
    return found;
  }
}

/** Of a geometry: which points its vertices show, its corners at each vertex, and its places and normals before a stroke. */
class Shown {
  constructor(geometry, finder) {
    this.geometry = geometry;
    const { position } = geometry.attributes;
    this.index = cornersOf(geometry);
    this.places = packed(position);
    this.pointOf = Int32Array.from({ length: position.count }, (_, i) => finder.at(this.places, i));
    this.vertices = new Groups(this.pointOf, finder.first.length); // by point
    this.corners = new Groups(this.index, position.count); // by vertex, as indices of `index`
    this.hold();
  }

  hold() {
    const { normal } = this.geometry.attributes;
    this.rest = this.places.slice();
    this.normals = normal && packed(normal);
  }

  /** The normal that triangles give a vertex. */
  #facing(places, vertex, out) {
    let [nx, ny, nz] = [0, 0, 0];
    for (const corner of this.corners.in(vertex)) {
      const i = corner - (corner % 3);
      const [a, b, c] = [3 * this.index[i], 3 * this.index[i + 1], 3 * this.index[i + 2]];
      const [x, y, z] = [places[a], places[a + 1], places[a + 2]];
      const [ux, uy, uz] = [places[b] - x, places[b + 1] - y, places[b + 2] - z];
      const [vx, vy, vz] = [places[c] - x, places[c + 1] - y, places[c + 2] - z];
      nx += uy * vz - uz * vy;
      ny += uz * vx - ux * vz;
      nz += ux * vy - uy * vx;
    }
    return out.set(nx, ny, nz).normalize();
  }

  /** Adds the points that share a triangle with a point. */
  addAround(point, to) {
    for (const vertex of this.vertices.in(point))
      for (const corner of this.corners.in(vertex))
        for (let k = 1; k < 3; k++) {
          const other = this.pointOf[this.index[corner - (corner % 3) + ((corner + k) % 3)]];
          if (other >= 0) to.add(other);
        }
  }

  /** Takes over the places of points, and turns normals by turn(point, normal), else as their triangles have turned since
   *  the stroke began. */
  show(points, indices, turn) {
    const { position, normal } = this.geometry.attributes;
    const around = new Set();
    for (const point of indices)
      for (const vertex of this.vertices.in(point)) {
        const place = points.subarray(3 * point, 3 * point + 3);
        this.places.set(place, 3 * vertex);
        position.setXYZ(vertex, ...place);
        if (turn && normal) normal.setXYZ(vertex, ...turn(point, new Vector3().fromArray(this.normals, 3 * vertex)));
        else if (normal) for (const corner of this.corners.in(vertex)) for (let k = 0; k < 3; k++) around.add(this.index[corner - (corner % 3) + k]);
      }
    const [turned, old, before, now] = [new Quaternion(), new Vector3(), new Vector3(), new Vector3()];
    for (const vertex of around) {
      this.#facing(this.rest, vertex, before);
      this.#facing(this.places, vertex, now);
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
    const finder = new Finder(points);
    this.first = finder.first;
    this.shown = [...new Set(geometries)].map((geometry) => new Shown(geometry, finder));
  }

  at(index, place) {
    return place.fromArray(this.points, 3 * index);
  }

  /** The mean of the points around a point; its own place where there are none. */
  middleAround(index) {
    const [sum, place] = [new Vector3(), new Vector3()];
    const around = new Set();
    for (const shown of this.shown) shown.addAround(this.first[index], around);
    for (const other of around) sum.add(this.at(other, place));
    return around.size > 0 ? sum.divideScalar(around.size) : this.at(index, sum);
  }

  normalAt(index) {
    for (const { vertices, geometry: { attributes: { normal } } } of this.shown) {
      const [vertex] = vertices.in(this.first[index]);
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
