// Prints tank.json: node tank.mjs > tank.json
//
// A hull on four wheels, a turret on the hull, a barrel and two antennas on the turret. The clip `drive` moves all of
// them by keys at irregular times, in every form in which a rotation can be written. Y is up, the tank looks along +Z,
// its left is +X. Metres, seconds.

const mesh = (name) => ({ name, positions: [], faces: [], creases: [] });

function crease(target, points, sharpness, closed = true) {
  for (let i = 0; i < points.length - (closed ? 0 : 1); i++) {
    target.creases.push({ edge: [points[i], points[(i + 1) % points.length]], sharpness });
  }
}

/** A tube through rings of equal size, each counter-clockwise seen from the last; open at both ends. */
function tube(target, rings) {
  const indices = rings.map((ring) => ring.map((p) => target.positions.push(p) - 1));
  for (let r = 0; r + 1 < indices.length; r++) {
    const [a, b] = [indices[r], indices[r + 1]];
    for (let i = 0; i < a.length; i++) {
      const k = (i + 1) % a.length;
      target.faces.push([a[i], a[k], b[k], b[i]]);
    }
  }
  return indices;
}

/** Closes a ring of even size: with a quad, or with quads around a middle point. */
function cap(target, ring, middle) {
  if (ring.length === 4) {
    target.faces.push(ring);
    return;
  }
  const centre = target.positions.push(middle) - 1;
  for (let i = 0; i < ring.length; i += 2) {
    target.faces.push([centre, ring[i], ring[i + 1], ring[(i + 2) % ring.length]]);
  }
}

// Orientations of a body of revolution.
const upward = (x, y, along) => [x, along, -y];
const forward = (x, y, along) => [x, y, along];
const sideways = (x, y, along) => [along, x, y];

/** A closed body of revolution. profile: [radius, along] for each ring; sharpness: of a ring's edges, by its index. */
function drum(name, axis, sides, profile, sharpness) {
  const target = mesh(name);
  const rings = tube(target, profile.map(([radius, along]) =>
    Array.from({ length: sides }, (_, i) => {
      const angle = ((i + 0.5) / sides) * 2 * Math.PI;
      return axis(radius * Math.cos(angle), radius * Math.sin(angle), along);
    })));
  cap(target, [...rings[0]].reverse(), axis(0, 0, profile[0][1]));
  cap(target, rings.at(-1), axis(0, 0, profile.at(-1)[1]));
  for (const [index, value] of Object.entries(sharpness)) crease(target, rings[index], value);
  return target;
}

/** Cross-sections of eight points from tail to nose. */
function hull() {
  const target = mesh('hull');
  const rings = tube(target, [
    // z, half width, low, high, half width of the deck
    [-1.9, 0.8, 0.55, 0.95, 0.45], [-1.7, 0.95, 0.35, 1.05, 0.55], [-0.6, 0.95, 0.3, 1.1, 0.55],
    [0.7, 0.95, 0.3, 1.1, 0.55], [1.5, 0.95, 0.35, 0.8, 0.55], [2, 0.8, 0.55, 0.7, 0.45],
  ].map(([z, width, low, high, deck]) => [
    [width, low, z], [width, high, z], [deck, high, z], [-deck, high, z],
    [-width, high, z], [-width, low, z], [-deck, low, z], [deck, low, z],
  ]));
  const end = ([a, b, c, d, e, f, g, h]) => [[a, b, c, h], [h, c, d, g], [g, d, e, f]];
  target.faces.push(...end(rings[0]).map((face) => face.reverse()), ...end(rings.at(-1)));
  crease(target, rings[0], 2);
  crease(target, rings.at(-1), 2);
  for (const corner of [0, 1, 4, 5]) crease(target, rings.map((ring) => ring[corner]), 2.5, false);
  return target;
}

/** A rod with a flag, so that a turn about the rod is visible: one of its sides is extruded. */
function antenna() {
  const sides = 4;
  const target = drum('antenna', upward, sides, [[0.03, 0], [0.03, 0.5], [0.03, 0.8]], { 0: 2, 2: 2 });
  const [side] = target.faces.splice(2 * sides - 1, 1);
  const tip = side.map((p) => {
    const [x, y, z] = target.positions[p];
    return target.positions.push([x + 0.35, y, z]) - 1;
  });
  side.forEach((from, i) => {
    const k = (i + 1) % side.length;
    target.faces.push([from, side[k], tip[k], tip[i]]);
  });
  target.faces.push(tip);
  crease(target, tip, 3);
  return target;
}

const meshes = [
  hull(),
  drum('wheel', sideways, 12,
    [[0.18, -0.08], [0.3, -0.2], [0.45, -0.2], [0.45, 0.2], [0.3, 0.2], [0.18, 0.08]],
    { 0: 2, 1: 2, 2: 3, 3: 3, 4: 2, 5: 2 }),
  drum('turret', upward, 8, [[0.75, 0], [0.8, 0.18], [0.6, 0.5], [0.4, 0.5]], { 0: 3, 1: 1.5, 2: 1.5 }),
  drum('barrel', forward, 8,
    [[0.13, 0], [0.1, 0.3], [0.08, 1.6], [0.12, 1.62], [0.12, 1.9], [0.07, 1.9], [0.07, 1.7]],
    { 0: 2, 3: 2, 4: 3, 5: 3, 6: 3 }),
  antenna(),
];

// Linear, as in glTF.
const colors = {
  hull: [0.2, 0.34, 0.14], wheel: [0.05, 0.055, 0.065], turret: [0.25, 0.41, 0.17], barrel: [0.12, 0.2, 0.1],
  antenna: [0.68, 0.1, 0.05],
};
for (const mesh of meshes) mesh.color = colors[mesh.name];

const nodes = [
  { name: 'hull', mesh: 'hull' },
  { name: 'wheel_front_left', parent: 'hull', mesh: 'wheel', translation: [1.15, 0.45, 1.1] },
  { name: 'wheel_front_right', parent: 'hull', mesh: 'wheel', translation: [-1.15, 0.45, 1.1] },
  { name: 'wheel_rear_left', parent: 'hull', mesh: 'wheel', translation: [1.15, 0.45, -1.1] },
  { name: 'wheel_rear_right', parent: 'hull', mesh: 'wheel', translation: [-1.15, 0.45, -1.1] },
  { name: 'turret', parent: 'hull', mesh: 'turret', translation: [0, 1.08, -0.2] },
  { name: 'barrel', parent: 'turret', mesh: 'barrel', translation: [0, 0.28, 0.6] },
  { name: 'antenna_euler', parent: 'turret', mesh: 'antenna', translation: [0.3, 0.48, -0.3] },
  { name: 'antenna_quaternion', parent: 'turret', mesh: 'antenna', translation: [-0.3, 0.48, -0.3] },
];

/** A rotation track of quaternion keys, from turns in degrees about one axis. */
const turning = (node, interpolation, axis, times, angles) => ({
  node, path: 'rotation', interpolation, times,
  quaternions: angles.map((degrees) => {
    const half = (degrees * Math.PI) / 360;
    return [...axis.map((x) => x * Math.sin(half)), Math.cos(half)];
  }),
});

/** A wheel that rolls forward by turns about +X. */
const rolling = (node, degrees) => ({
  node, path: 'rotation', unit: 'degrees', times: driveTimes, axis_angles: degrees.map((angle) => [1, 0, 0, angle]),
});

const UP = [0, 1, 0];
const RIGHT = [-1, 0, 0]; // a turn about it lifts the barrel
const driveTimes = [0, 1.1, 2.6, 4];
const turretKeys = [[0, 0.4, 1.7, 2.15, 4], [0, 35, -60, -60, 20]];
const barrelKeys = [[0, 0.9, 1.3, 3.1], [0, 12, 28, -4]];

// The two antennas have the same keys. As an angle, -170 to 170 degrees goes the long way through 0; as quaternions it
// goes the short way, 20 degrees through 180.
const antennaKeys = [[0, 4], [-170, 170]];

const clips = [
  {
    name: 'drive',
    tracks: [
      { node: 'hull', path: 'translation', times: driveTimes,
        values: [[0, 0, 0], [0.1, 0, 2.5], [1.2, 0, 5.2], [4, 0, 6.5]] },
      turning('hull', 'slerp', UP, driveTimes, [0, 5, 45, 75]),
      rolling('wheel_front_left', [0, 305, 581, 897]),
      rolling('wheel_rear_left', [0, 305, 581, 897]),
      rolling('wheel_front_right', [0, 331, 811, 1281]),
      rolling('wheel_rear_right', [0, 331, 811, 1281]),
      turning('turret', 'slerp', UP, ...turretKeys),
      turning('barrel', 'nlerp', RIGHT, ...barrelKeys),
      { node: 'antenna_euler', path: 'rotation', interpolation: 'euler', order: 'XYZ', unit: 'degrees',
        times: antennaKeys[0], eulers: antennaKeys[1].map((degrees) => [0, degrees, 0]) },
      turning('antenna_quaternion', 'slerp', UP, ...antennaKeys),
    ],
  },
  {
    name: 'aim',
    tracks: [turning('turret', 'linear', UP, ...turretKeys), turning('barrel', 'step', RIGHT, ...barrelKeys)],
  },
];

// Prints short rows of numbers on one line each.
const number = (x) => Number(x.toFixed(7)) + 0;
const json = JSON.stringify({ meshes, nodes, clips }, (_, x) => (typeof x === 'number' ? number(x) : x), 1)
  .replace(/\[[-\d.,e\s]*\]/g, (row) => row.replace(/\s+/g, ' ').replace('[ ', '[').replace(' ]', ']'))
  .replace(/\{\s+"edge": (.*),\s+"sharpness": (.*)\s+\}/g, '{"edge": $1, "sharpness": $2}');
console.log(json);
