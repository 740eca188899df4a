// Prints octopus.obj: node octopus.mjs > octopus.obj
//
// A head from five sides of a cube (the sixth is the open border), eyes set into it, eight arms extruded from its
// lowest row. The mesh has points of valence 3, 4 and 5, a border, and texture coordinates in charts: five for the
// head, one for each arm. Its points are coloured: the eyes are dark, the tips of the arms pale. Y is up, the face
// looks along +Z.

const SIDE = 4; // faces along each side of the cube
const ARM_RINGS = 6;

const points = [];
const uvs = [];
const faces = []; // { points: [4], uvs: [4], group }

const add = (list, value) => list.push(value) - 1;
const mix = (a, b, t) => a.map((x, i) => x + (b[i] - x) * t);
const sum = (a, b, scale = 1) => a.map((x, i) => x + b[i] * scale);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(...a);
const unit = (a) => a.map((x) => x / length(a));
const centre = (list) => list.reduce((s, p) => sum(s, p), [0, 0, 0]).map((x) => x / list.length);

// ---- head ---------------------------------------------------------------------------------------

const onGrid = new Map();

/** The point of the head for a place on the cube [-1, 1]^3, created once. */
function headPoint(cube) {
  const key = cube.map((x) => Math.round(x * SIDE)).join(' ');
  if (!onGrid.has(key)) onGrid.set(key, add(points, headShape(cube)));
  return onGrid.get(key);
}

/** Bends the cube into a mantle: a ball, stretched up and back, narrowed towards the border. */
function headShape(cube) {
  const [x, y, z] = unit(cube.map((c) => Math.tan((c * Math.PI) / 4)));
  const height = (y + 0.62) / 1.62; // 0 at the border, 1 at the top
  const girth = 0.8 + 0.42 * Math.sin(Math.PI * Math.min(1, Math.max(0, height * 0.92 + 0.04)));
  return [x * girth, y * 1.15 + 0.55 * Math.max(0, height) ** 2, z * girth - 0.45 * Math.max(0, height) ** 2];
}

// For each side: its chart in the texture, and the map from (s, t) in [-1, 1] to the cube.
const sides = [
  { chart: [0, 0], place: (s, t) => [s, t, 1] },
  { chart: [1, 0], place: (s, t) => [1, t, -s] },
  { chart: [2, 0], place: (s, t) => [-s, t, -1] },
  { chart: [3, 0], place: (s, t) => [-1, t, s] },
  { chart: [0, 1], place: (s, t) => [s, 1, -t] },
];
const CHART = 1 / 4;
const MARGIN = 0.01;

const armRoots = [];
const eyeRoots = [];

for (const [index, side] of sides.entries()) {
  const cornerUv = [];
  for (let j = 0; j <= SIDE; j++) {
    for (let i = 0; i <= SIDE; i++) {
      const u = (side.chart[0] + MARGIN + (i / SIDE) * (1 - 2 * MARGIN)) * CHART;
      const v = (side.chart[1] + MARGIN + (j / SIDE) * (1 - 2 * MARGIN)) * CHART;
      cornerUv.push(add(uvs, [u, v]));
    }
  }
  for (let j = 0; j < SIDE; j++) {
    for (let i = 0; i < SIDE; i++) {
      const around = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
      const face = {
        points: around.map(([a, b]) => headPoint(side.place((a / SIDE) * 2 - 1, (b / SIDE) * 2 - 1))),
        uvs: around.map(([a, b]) => cornerUv[b * (SIDE + 1) + a]),
        group: 'head',
      };
      const isWall = index < 4;
      if (isWall && j === 0 && i % 2 === 0) armRoots.push(face);
      else if (index % 2 === 1 && isWall && j === 2 && i === (index === 1 ? 0 : SIDE - 1)) eyeRoots.push(face);
      else faces.push(face);
    }
  }
}

// ---- eyes: a ring inset into the face, and a raised lid -------------------------------------------

for (const root of eyeRoots) {
  const corners = root.points.map((p) => points[p]);
  const middle = centre(corners);
  const outward = unit(cross(sum(corners[2], corners[0], -1), sum(corners[3], corners[1], -1)));
  const middleUv = mix(mix(uvs[root.uvs[0]], uvs[root.uvs[2]], 0.5), mix(uvs[root.uvs[1]], uvs[root.uvs[3]], 0.5), 0.5);
  let ring = root;
  for (const [inset, height] of [[0.22, -0.06], [0.3, 0.22]]) {
    const next = {
      points: corners.map((c) => add(points, sum(mix(c, middle, inset), outward, height))),
      uvs: root.uvs.map((i) => add(uvs, mix(uvs[i], middleUv, inset + (height > 0 ? 0.3 : 0)))),
      group: 'eyes',
    };
    bridge(ring, next, 'eyes');
    ring = next;
  }
  faces.push(ring);
}

// ---- arms: rings along a curve that descends, runs outwards and curls up --------------------------

for (const [number, root] of armRoots.entries()) {
  const corners = root.points.map((p) => points[p]);
  const start = centre(corners);
  const outward = unit([start[0], 0, start[2]]);
  const across = cross([0, 1, 0], outward);
  const sway = 0.35 * Math.sin(number * 2.4);
  const column = (number % 8) / 8;
  const width = 1 / 8;

  // The texture of an arm is a strip of its own, four faces wide, with one row a ring and the tip above.
  const strip = (i, row) => add(uvs, [
    column + width * (0.06 + 0.88 * (i / 4)),
    2 * CHART + 0.01 + (0.44 * row) / (ARM_RINGS + 1),
  ]);
  let ring = { points: root.points, row: [0, 1, 2, 3, 4].map((i) => strip(i, 0)) };
  for (let r = 1; r <= ARM_RINGS; r++) {
    const t = r / ARM_RINGS;
    const along = sum(
      sum(sum(start, outward, 2.3 * t), [0, 1, 0], -1.05 * Math.sin(t * 2.2) + 1.15 * t ** 3),
      across, sway * t ** 2);
    const before = t - 1 / ARM_RINGS;
    const direction = unit([
      outward[0] * 2.3, -1.05 * 2.2 * Math.cos((t + before) * 1.1) + 3.45 * ((t + before) / 2) ** 2, outward[2] * 2.3]);
    const up = unit(cross(direction, across));
    const thickness = 0.27 * (1 - 0.72 * t);
    // Corners of the root in order: lower left, lower right, upper right, upper left, seen from outside.
    const ringPoints = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) =>
      add(points, sum(sum(along, across, a * thickness), up, b * thickness)));
    const next = { points: ringPoints, row: [0, 1, 2, 3, 4].map((i) => strip(i, r)) };
    for (let i = 0; i < 4; i++) {
      const k = (i + 1) % 4;
      faces.push({
        points: [ring.points[i], ring.points[k], next.points[k], next.points[i]],
        uvs: [ring.row[i], ring.row[i + 1], next.row[i + 1], next.row[i]],
        group: 'arms',
      });
    }
    ring = next;
  }
  const tip = [ring.row[1], ring.row[2], strip(2, ARM_RINGS + 1), strip(1, ARM_RINGS + 1)];
  const [a, b, c, d] = ring.points;
  faces.push({ points: [b, c, d, a], uvs: tip, group: 'arms' });
}

/** Four quads between two rings of four. */
function bridge(from, to, group) {
  for (let i = 0; i < 4; i++) {
    const k = (i + 1) % 4;
    faces.push({
      points: [from.points[i], from.points[k], to.points[k], to.points[i]],
      uvs: [from.uvs[i], from.uvs[k], to.uvs[k], to.uvs[i]],
      group,
    });
  }
}

// ---- colours: sRGB --------------------------------------------------------------------------------

const SKIN = [0.85, 0.36, 0.28];
const PALE = [0.97, 0.78, 0.62];
const DARK = [0.13, 0.08, 0.12];

const groupsOf = points.map(() => new Set());
for (const face of faces) for (const p of face.points) groupsOf[p].add(face.group);

/** Dark where only an eye is, and paler along an arm. */
function colorOf(point) {
  const groups = groupsOf[point];
  if (groups.size === 1 && groups.has('eyes')) return DARK;
  if (groups.has('head') || groups.has('eyes')) return SKIN;
  const [x, , z] = points[point];
  return mix(SKIN, PALE, Math.min(1, Math.max(0, (Math.hypot(x, z) - 1) / 2)));
}

// ---- OBJ ------------------------------------------------------------------------------------------

const number = (x) => String(Number(x.toFixed(4)) + 0);
const lines = ['# An octopus, made by octopus.mjs.', 'o octopus'];
for (const [i, p] of points.entries()) lines.push(`v ${[...p, ...colorOf(i)].map(number).join(' ')}`);
const used = uvs.map((_, i) => i).filter((i) => faces.some((face) => face.uvs.includes(i))); // arms take faces of the head away
for (const i of used) lines.push(`vt ${uvs[i].map(number).join(' ')}`);
lines.push('usemtl skin');
for (const group of ['head', 'eyes', 'arms']) {
  lines.push(`g ${group}`);
  for (const face of faces.filter((f) => f.group === group)) {
    lines.push(`f ${face.points.map((p, i) => `${p + 1}/${used.indexOf(face.uvs[i]) + 1}`).join(' ')}`);
  }
}
console.log(lines.join('\n'));
