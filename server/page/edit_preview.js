// What an edit will make of a cage, before the daemon is asked: {points, faces, changed: indices of faces}. Extrude and
// inset follow lib/edit/extrude.c, the cut of a loop lib/edit/cut.c.
import { vectors } from './cage_mesh.js';

const { subtract, dot, cross, unit, angle } = vectors;
const REACH_MOST = 4; // how many times the distance a point moves at most, where directions diverge

const add = (a, b, times = 1) => a.map((value, i) => value + times * b[i]);

/** Moves the points of a selection by a function. */
function moved(mesh, kind, list, move) {
  const among = new Set(mesh.pointsIn(kind, list));
  return { points: mesh.points.map((point, i) => (among.has(i) ? move(point) : point)), faces: mesh.faces,
    changed: mesh.touching('faces', among) };
}

/** v turned about a unit axis (Rodrigues). */
function turned(v, axis, degrees) {
  const [c, s] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
  const across = cross(axis, v);
  return v.map((value, i) => value * c + across[i] * s + axis[i] * dot(axis, v) * (1 - c));
}

/** The vector whose component along each direction is about 1. */
function offsetOf({ sum, total }) {
  const length = Math.hypot(...sum);
  const along = total > 0 ? length / total : 0;
  const reach = along > 1 / REACH_MOST ? 1 / along : REACH_MOST;
  return unit(sum).map((value) => value * reach);
}

/** The same, or, where that misses, what comes nearest to a component of 1 along each (settle_offsets, find_better, is_better). */
function nearestOf(pull) {
  const offset = offsetOf(pull);
  const mostMissed = (by) => Math.max(0, ...pull.parts.map(({ direction }) => Math.abs(1 - dot(direction, by))));
  const miss = mostMissed(offset);
  if (miss <= 1e-3) return offset;
  const spread = [0, 1, 2].map((i) => pull.parts.reduce((sum, { direction, weight }) => add(sum, direction, weight * direction[i]), [0, 0, 0]));
  const rest = pull.parts.reduce((sum, { direction, weight }) => add(sum, direction, weight * (1 - dot(direction, offset))), [0, 0, 0]);
  const trace = spread[0][0] + spread[1][1] + spread[2][2];
  for (let i = 0; i < 3; i++) spread[i][i] += 1e-9 * trace;
  const inverse = [0, 1, 2].map((i) => cross(spread[(i + 1) % 3], spread[(i + 2) % 3]));
  const better = rest.reduce((sum, value, k) => add(sum, inverse[k], value / dot(spread[0], inverse[0])), offset);
  const isBetter = mostMissed(better) <= miss / 2 && Math.hypot(...subtract(better, offset)) <= 4 * miss && Math.hypot(...better) <= REACH_MOST;
  return isBetter ? better : offset;
}

/** Parts faces from their neighbours and puts walls into the gaps. shift(pull) tells where a new point goes. */
function parted(mesh, list, { isInset, isIndividual, shift }) {
  const selected = new Set(list);
  const fans = new Map(); // by corner: the corner that stands for its fan
  const nameOf = (face, at) => face * 65536 + at;
  const rootOf = (corner) => {
    while (fans.get(corner) !== corner) corner = fans.get(corner);
    return corner;
  };
  for (const face of list) mesh.faces[face].forEach((_, at) => fans.set(nameOf(face, at), nameOf(face, at)));
  const isRim = (edge) => {
    const sides = mesh.sidesOf(edge);
    return isIndividual || sides.length === 1 || sides.some(({ face }) => !selected.has(face));
  };
  const sizeOf = (face) => mesh.faces[face].length;
  for (const face of list)
    mesh.faces[face].forEach((point, at) => {
      const edge = mesh.edgeOf(face, at);
      if (isRim(edge)) return;
      for (const { face: other, at: there } of mesh.sidesOf(edge).filter((side) => side.face !== face)) {
        const isSame = mesh.faces[other][there] === point;
        const next = [nameOf(face, (at + 1) % sizeOf(face)), nameOf(other, (there + 1) % sizeOf(other))];
        fans.set(rootOf(nameOf(face, at)), rootOf(isSame ? nameOf(other, there) : next[1]));
        fans.set(rootOf(next[0]), rootOf(isSame ? next[1] : nameOf(other, there)));
      }
    });
  const pulls = new Map();
  const pull = (corner, direction, weight) => {
    if (!(dot(direction, direction) > 0)) return; // of a face without an area, or an edge without a length
    const root = rootOf(corner);
    if (!pulls.has(root)) pulls.set(root, { sum: [0, 0, 0], total: 0, parts: [] });
    const at = pulls.get(root);
    at.sum = add(at.sum, direction, weight);
    at.total += weight;
    at.parts.push({ direction, weight });
  };
  const parts = new Map(); // by fan: [its number of corners, whether a rim meets it]
  for (const face of list) {
    const corners = mesh.faces[face];
    const normal = mesh.normalOf(face);
    corners.forEach((point, at) => {
      const [here, next] = [nameOf(face, at), nameOf(face, (at + 1) % corners.length)];
      const side = subtract(mesh.points[corners[(at + 1) % corners.length]], mesh.points[point]);
      const isWall = isRim(mesh.edgeOf(face, at));
      const isMet = isWall || isRim(mesh.edgeOf(face, (at + corners.length - 1) % corners.length));
      const [count, met] = parts.get(rootOf(here)) ?? [0, false];
      parts.set(rootOf(here), [count + 1, met || isMet]);
      if (!isInset) pull(here, normal, angle(side, subtract(mesh.points[corners.at(at - 1)], mesh.points[point])));
      else if (isWall) for (const end of [here, next]) pull(end, unit(cross(normal, side)), 1);
    });
  }
  const points = mesh.points.map((point) => [...point]);
  const placed = new Map();
  const pointOf = (face, at) => {
    const root = rootOf(nameOf(face, at));
    if (placed.has(root)) return placed.get(root);
    const old = mesh.faces[face][at];
    const [count, isMet] = parts.get(root);
    const by = shift(pulls.get(root) ?? { sum: [0, 0, 0], total: 0, parts: [] });
    const isKept = !isMet && count === mesh.facesAt(old).length;
    placed.set(root, isKept ? old : points.length);
    points[placed.get(root)] = add(mesh.points[old], by);
    return placed.get(root);
  };
  const walls = [];
  const faces = mesh.faces.map((corners, face) => {
    if (!selected.has(face)) return corners;
    const top = corners.map((_, at) => pointOf(face, at));
    corners.forEach((point, at) => {
      const next = (at + 1) % corners.length;
      if (isRim(mesh.edgeOf(face, at))) walls.push([point, corners[next], top[next], top[at]]);
    });
    return top;
  });
  return { points, faces: [...faces, ...walls], changed: [...list, ...walls.map((_, i) => faces.length + i)] };
}

/** Cuts the ring of an edge. */
function cut(mesh, edge, cuts) {
  const points = [...mesh.points];
  const made = new Map(); // by edge of the ring: [its direction, its first new point]
  for (const [a, b] of mesh.ring(edge)) {
    made.set(mesh.keyOf([a, b]), { from: a, first: points.length });
    for (let k = 1; k <= cuts; k++) points.push(add(mesh.points[a], subtract(mesh.points[b], mesh.points[a]), k / (cuts + 1)));
  }
  const along = (a, b) => { // the new points from a to b
    const { from, first } = made.get(mesh.keyOf([a, b]));
    const list = Array.from({ length: cuts }, (_, k) => first + k);
    return from === a ? list : list.reverse();
  };
  const [faces, changed] = [[], []];
  for (const [face, corners] of mesh.faces.entries()) {
    const isCut = corners.map((_, at) => made.has(mesh.keyOf(mesh.edgeOf(face, at))));
    const at = isCut.findIndex((value, i) => value && isCut[(i + 2) % 4]);
    if (corners.length !== 4 || at < 0) {
      faces.push(corners.flatMap((point, i) => (isCut[i] ? [point, ...along(point, corners[(i + 1) % corners.length])] : [point])));
      continue;
    }
    const [a, b, c, d] = [0, 1, 2, 3].map((i) => corners[(at + i) % 4]);
    const [top, bottom] = [[a, ...along(a, b), b], [d, ...along(d, c), c]];
    for (let k = 0; k <= cuts; k++) {
      changed.push(faces.length);
      faces.push([top[k], top[k + 1], bottom[k + 1], bottom[k]]);
    }
  }
  return { points, faces, changed, cuts: [...made].map(([, { first }]) => first) };
}

/** null for edits that have no preview. */
export function previewOf(mesh, kind, list, { edit, edge, by, axis, degrees, distance = 0, amount = 0, cuts = 1, individual: isIndividual = false }) {
  if (edit === 'loop_cut') return cut(mesh, edge, cuts);
  if (edit === 'extrude') return parted(mesh, list, { isIndividual, shift: (pull) => by ?? nearestOf(pull).map((value) => value * distance) });
  if (edit === 'inset') return parted(mesh, list, { isInset: true, isIndividual, shift: (pull) => offsetOf(pull).map((value) => value * amount) });
  if (edit === 'move') return moved(mesh, kind, list, (point) => add(point, by));
  const centre = mesh.centreOf(kind, list);
  if (edit === 'scale') return moved(mesh, kind, list, (point) => subtract(point, centre).map((value, i) => centre[i] + value * (by[i] ?? by)));
  if (edit !== 'rotate') return null;
  const about = Array.isArray(axis) ? unit(axis) : ['x', 'y', 'z'].map((name) => (name === axis ? 1 : 0));
  return moved(mesh, kind, list, (point) => add(centre, turned(subtract(point, centre), about, degrees)));
}
