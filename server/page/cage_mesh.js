// The control cage as edits see it: points, faces, and the edges between them. Finds what a person or a rule selects:
// loops, rings, neighbours, pieces, what faces a direction. The rules are those of openapi.json.

const SLACK = 1e-6; // radians, as in the daemon: rounding must not decide about a face exactly at an angle

const subtract = (a, b) => a.map((value, i) => value - b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const unit = (a) => a.map((value) => value / (Math.hypot(...a) || 1));
const angle = (a, b) => Math.atan2(Math.hypot(...cross(a, b)), dot(a, b));
const radians = (degrees) => (degrees * Math.PI) / 180;

export const isSameEdge = ([a, b], [c, d]) => (a === c && b === d) || (a === d && b === c);

export class CageMesh {
  #sides; // by edge: [{face, at}], the faces at it and their corners before it
  #facesAt; // by point

  /** points: [[x, y, z]], faces: [[point]]. */
  constructor({ points, faces }) {
    Object.assign(this, { points, faces });
  }

  keyOf([a, b]) {
    return a < b ? a * this.points.length + b : b * this.points.length + a;
  }

  #find() {
    if (this.#sides) return;
    this.#sides = new Map();
    this.#facesAt = this.points.map(() => []);
    this.faces.forEach((corners, face) =>
      corners.forEach((point, at) => {
        const key = this.keyOf(this.edgeOf(face, at));
        if (!this.#sides.has(key)) this.#sides.set(key, []);
        this.#sides.get(key).push({ face, at });
        this.#facesAt[point].push(face);
      }));
  }

  /** The edge after a corner of a face. */
  edgeOf(face, at) {
    const corners = this.faces[face];
    return [corners[at], corners[(at + 1) % corners.length]];
  }

  /** All edges, each in the direction of its first face. */
  get edges() {
    this.#find();
    return [...this.#sides.values()].map(([{ face, at }]) => this.edgeOf(face, at));
  }

  sidesOf(edge) {
    this.#find();
    return this.#sides.get(this.keyOf(edge)) ?? [];
  }

  facesAt(point) {
    this.#find();
    return this.#facesAt[point];
  }

  /** The edges at a point, each beginning with it. */
  edgesAt(point) {
    const known = new Map();
    for (const face of this.facesAt(point)) {
      const corners = this.faces[face];
      const at = corners.indexOf(point);
      for (const other of [corners.at(at - 1), corners[(at + 1) % corners.length]]) known.set(other, [point, other]);
    }
    return [...known.values()];
  }

  /** The unit normal of a face, by Newell's method; zeros where it has no area. */
  normalOf(face) {
    const sum = [0, 0, 0];
    const corners = this.faces[face];
    const origin = this.points[corners[0]];
    for (let i = 1; i + 1 < corners.length; i++) {
      const normal = cross(subtract(this.points[corners[i]], origin), subtract(this.points[corners[i + 1]], origin));
      for (let k = 0; k < 3; k++) sum[k] += normal[k];
    }
    return unit(sum);
  }

  // ---- selections ----

  has(kind, element) {
    if (kind === 'edges') return Array.isArray(element) && element.length === 2 && element.every((i) => i in this.points);
    return element in (kind === 'faces' ? this.faces : this.points);
  }

  all(kind) {
    if (kind === 'edges') return this.edges;
    return [...(kind === 'faces' ? this.faces : this.points).keys()];
  }

  pointsOf(kind, element) {
    return kind === 'vertices' ? [element] : kind === 'edges' ? element : this.faces[element];
  }

  /** The points of a list of elements, each once. */
  pointsIn(kind, list) {
    return [...new Set(list.flatMap((element) => this.pointsOf(kind, element)))];
  }

  /** The elements of a kind all of whose points are among those given. */
  within(kind, points) {
    const among = new Set(points);
    return this.all(kind).filter((element) => this.pointsOf(kind, element).every((point) => among.has(point)));
  }

  /** The elements of a kind that touch one of the points. */
  touching(kind, points) {
    const among = new Set(points);
    return this.all(kind).filter((element) => this.pointsOf(kind, element).some((point) => among.has(point)));
  }

  grow(kind, list) {
    const points = this.pointsIn(kind, list);
    return kind === 'faces' ? this.touching(kind, points) : this.within(kind, this.pointsIn('faces', this.touching('faces', points)));
  }

  /** Leaves out the elements that touch one that is not selected. */
  shrink(kind, list) {
    const selected = new Set(list.map((element) => (kind === 'edges' ? this.keyOf(element) : element)));
    const others = this.all(kind).filter((element) => !selected.has(kind === 'edges' ? this.keyOf(element) : element));
    const outside = kind === 'vertices' ? new Set(this.pointsIn('edges', this.touching('edges', others))) : new Set(this.pointsIn(kind, others));
    return list.filter((element) => !this.pointsOf(kind, element).some((point) => outside.has(point)));
  }

  /** All that hangs together with a list. */
  linked(kind, list) {
    const seen = new Set(this.pointsIn(kind, list));
    for (const point of seen) for (const face of this.facesAt(point)) for (const other of this.faces[face]) seen.add(other);
    return this.touching(kind, seen);
  }

  /** The edge that goes straight on from an edge across its end. */
  #straightOn(edge, end) {
    const around = this.edgesAt(end);
    const isBorder = (other) => this.sidesOf(other).length === 1;
    const others = around.filter((other) => !isSameEdge(other, edge));
    if (isBorder(edge)) {
      const along = others.filter(isBorder);
      return along.length === 1 ? along[0] : null;
    }
    if (around.length !== 4 || around.some(isBorder)) return null;
    const faces = new Set(this.sidesOf(edge).map(({ face }) => face));
    return others.find((other) => !this.sidesOf(other).some(({ face }) => faces.has(face))) ?? null;
  }

  /** The edges in line with an edge, beginning with it. */
  loop(edge) {
    const known = new Map([[this.keyOf(edge), edge]]);
    for (const end of [1, 0]) {
      let [at, next] = [edge[end], this.#straightOn(edge, edge[end])];
      while (next && !known.has(this.keyOf(next))) {
        known.set(this.keyOf(next), next);
        at = next.find((point) => point !== at);
        next = this.#straightOn(next, at);
      }
    }
    return [...known.values()];
  }

  /** The edges opposite one another across quads, all in the direction of the first, which is the edge. */
  ring(edge) {
    const known = new Map([[this.keyOf(edge), edge]]);
    const follow = (face, from) => {
      for (let side = { face }, last = from; side && this.faces[side.face].length === 4;) {
        const corners = this.faces[side.face];
        const at = [0, 1, 2, 3].find((i) => isSameEdge(this.edgeOf(side.face, i), last));
        const isAlong = corners[at] === last[0];
        const [c, d] = this.edgeOf(side.face, (at + 2) % 4);
        last = isAlong ? [d, c] : [c, d];
        if (known.has(this.keyOf(last))) return;
        known.set(this.keyOf(last), last);
        const before = side.face;
        const sides = this.sidesOf(last);
        side = sides.length === 2 ? sides.find(({ face: other }) => other !== before) : null;
      }
    };
    const sides = this.sidesOf(edge);
    if (sides.length <= 2) for (const { face } of sides) follow(face, edge);
    return [...known.values()];
  }

  /** The elements that a selection of the API names: a list, a word or a rule. null: only the daemon can tell. */
  select(kind, selection) {
    if (Array.isArray(selection)) return selection.filter((element) => this.has(kind, element));
    if (selection === 'all') return this.all(kind);
    const isEdges = kind === 'edges';
    if (isEdges && selection === 'border') return this.edges.filter((edge) => this.sidesOf(edge).length === 1);
    const { facing, within = 45, inside, loop, ring, sharper_than: sharper } = selection ?? {};
    if (inside?.min && inside.max) {
      const isIn = (point) => this.points[point].every((value, i) => value >= inside.min[i] && value <= inside.max[i]);
      return this.all(kind).filter((element) => this.pointsOf(kind, element).every(isIn));
    }
    if (kind === 'faces' && facing && within >= 0) {
      const isFacing = (normal) => dot(normal, normal) > 0 && angle(normal, unit(facing)) <= radians(within) + SLACK;
      return this.all(kind).filter((face) => isFacing(this.normalOf(face)));
    }
    if (isEdges && loop && this.sidesOf(loop).length > 0) return this.loop(loop);
    if (isEdges && ring && this.sidesOf(ring).length > 0) return this.ring(ring);
    if (isEdges && sharper >= 0) {
      return this.edges.filter((edge) => {
        const sides = this.sidesOf(edge);
        return sides.length === 2 && angle(...sides.map(({ face }) => this.normalOf(face))) > radians(sharper) + SLACK;
      });
    }
    return null;
  }

  /** The mean of the points of a list. */
  centreOf(kind, list) {
    const points = this.pointsIn(kind, list);
    return [0, 1, 2].map((k) => points.reduce((sum, point) => sum + this.points[point][k], 0) / points.length);
  }

  /** The mean normal of the faces of a list, or of those that touch it. */
  normalIn(kind, list) {
    const faces = kind === 'faces' ? list : this.touching('faces', this.pointsIn(kind, list));
    const sum = [0, 0, 0];
    for (const face of faces) this.normalOf(face).forEach((value, k) => (sum[k] += value));
    return Math.hypot(...sum) > 1e-6 ? unit(sum) : faces.length > 0 ? this.normalOf(faces[0]) : [0, 1, 0];
  }
}

export const vectors = { subtract, dot, cross, unit, angle };
