// What artists put into a file beside triangles comes back: three.js sees the same scenes, names, cameras, lights,
// instances, morph targets, attributes, lines, points, materials and extras in an answer as in the file, the validator
// agrees, and bones and morph targets move the surface as they move the file's mesh.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { AnimationMixer, LoopOnce, Vector3 } from 'three';

import { Daemon } from './daemon.mjs';
import { objections } from './objections.mjs';
import { load } from './player.mjs';

// ---- the file -----------------------------------------------------------------------------------------

const buffer = [];
const bufferViews = [];
const accessors = [];

function accessor(values, type, more = {}) {
  const bytes = Buffer.from(values.buffer);
  const byteOffset = buffer.reduce((sum, part) => sum + part.length, 0);
  const width = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 }[type];
  const componentType = { Float32Array: 5126, Uint16Array: 5123, Uint8Array: 5121 }[values.constructor.name];
  bufferViews.push({ buffer: 0, byteOffset, byteLength: bytes.length });
  buffer.push(bytes, Buffer.alloc(-bytes.length & 3));
  accessors.push({ bufferView: bufferViews.length - 1, componentType, count: values.length / width, type, ...more });
  return accessors.length - 1;
}

const boxPoints = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [i & 1, (i >> 1) & 1, i >> 2]);
const boxFaces = [0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5];
const unit = { min: [0, 0, 0], max: [1, 1, 1] };
const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

const extremes = (values, width) => {
  const columns = [...Array(width).keys()].map((c) => values.filter((_, i) => i % width === c));
  return { min: columns.map((column) => Math.min(...column)), max: columns.map((column) => Math.max(...column)) };
};
const floats = (values, type, width) => accessor(new Float32Array(values), type, width && extremes(values.map(Math.fround), width));

const POSITION = accessor(new Float32Array(boxPoints), 'VEC3', unit);
const indices = accessor(new Uint16Array(boxFaces), 'SCALAR');
const edges = accessor(new Uint16Array([0, 1, 1, 3, 3, 2, 2, 0]), 'SCALAR');
const smile = accessor(new Float32Array(boxPoints.map((x) => x / 4)), 'VEC3', { ...unit, max: [0.25, 0.25, 0.25] });
const color = accessor(new Uint8Array([...Array(32).keys()].map((i) => 8 * i)), 'VEC4', { normalized: true });
const joints = accessor(new Uint8Array(32), 'VEC4');
const weights = accessor(new Float32Array([...Array(32).keys()].map((i) => +(i % 4 === 0))), 'VEC4');
const binds = accessor(new Float32Array(identity), 'MAT4');
const places = accessor(new Float32Array([0, 0, 0, 5, 0, 0, 0, 5, 0]), 'VEC3');
const times = accessor(new Float32Array([0, 1]), 'SCALAR', { min: [0], max: [1] });
const moves = accessor(new Float32Array([0, 0, 0, 0, 1, 0]), 'VEC3');
const blinks = accessor(new Float32Array([0, 1, 1, 0]), 'SCALAR');
const colors = accessor(new Float32Array([0, 0, 0, 1, 1, 1]), 'VEC3');

/** A tube along y on three bones, open at both ends, with a seam in its UVs. */
function makeFigure() {
  const sides = 6;
  const rings = 7;
  const grid = [...Array(rings).keys()].flatMap((ring) => [...Array(sides + 1).keys()].map((side) => [ring, side]));
  const direction = (side) => [Math.cos((2 * Math.PI * (side % sides)) / sides), Math.sin((2 * Math.PI * (side % sides)) / sides)];
  const points = grid.flatMap(([ring, side]) => [direction(side)[0], ring, direction(side)[1]]);
  const normals = grid.flatMap(([, side]) => [direction(side)[0], 0, direction(side)[1]]);
  const influences = grid.map(([ring]) => [0, 2, 4].map((bone) => Math.max(0, 3 - Math.abs(ring - bone))));
  const corners = grid.flatMap(([ring, side], at) =>
    ring + 1 < rings && side < sides ? [at, at + sides + 1, at + sides + 2, at, at + sides + 2, at + 1] : [],
  );
  /** Swells, and leans. */
  const swell = grid.flatMap(([ring, side]) => direction(side).flatMap((x, i) => (i ? [0, x * ring * 0.1] : [x * ring * 0.1])));
  const lean = grid.flatMap(([ring]) => [ring * ring * 0.05, 0, 0]);
  const ids = grid.map(([ring, side]) => ring * sides + (side % sides));
  return {
    attributes: {
      POSITION: floats(points, 'VEC3', 3),
      _ID: accessor(new Float32Array(ids), 'SCALAR'),
      NORMAL: floats(normals, 'VEC3'),
      TEXCOORD_0: floats(grid.flatMap(([ring, side]) => [side / sides, ring / rings]), 'VEC2'),
      COLOR_0: floats(grid.flatMap(([ring]) => [ring / rings, 1, 0.5, 1]), 'VEC4'),
      JOINTS_0: accessor(new Uint8Array(influences.flatMap((w) => [...w.map((x, bone) => (x ? bone : 0)), 0])), 'VEC4'),
      WEIGHTS_0: floats(influences.flatMap((w) => [...w.map((x) => x / (w[0] + w[1] + w[2])), 0]), 'VEC4'),
      _Flow: floats(points.map((x) => 3 * x - 1), 'VEC3'),
    },
    indices: accessor(new Uint16Array(corners), 'SCALAR'),
    targets: [
      { POSITION: floats(swell, 'VEC3', 3), NORMAL: floats(normals.map((x, i) => (i % 3 === 1 ? -0.1 : 0)), 'VEC3') },
      { POSITION: floats(lean, 'VEC3', 3), NORMAL: floats(normals.map((x) => 0.05 * x), 'VEC3') },
    ],
  };
}

const figure = makeFigure();
const boneBinds = floats([0, 2, 4].flatMap((y) => [...identity.slice(0, 13), -y, 0, 1]), 'MAT4');
const beats = accessor(new Float32Array([0, 0.4, 1.1, 2]), 'SCALAR', { min: [0], max: [2] });
const turned = (angle, [x, y, z]) => [x, y, z].map((a) => a * Math.sin(angle / 2)).concat(Math.cos(angle / 2));
const turns = floats([0, 0.7, -0.4, 1].flatMap((angle) => turned(angle, [0.6, 0, 0.8])), 'VEC4');
const swings = floats([0, -0.9, 0.8, 0.1].flatMap((angle) => turned(angle, [0, 0, 1])), 'VEC4');
const smoothTurns = floats(
  [0, 0.5, 0.9, 0.2].flatMap((angle) => [0.1, 0, 0.2, 0, ...turned(angle, [1, 0, 0]), 0.2, 0, -0.1, 0]),
  'VEC4',
);
const steps = floats([0, 0, 0, 1, 0, 0, 1, 2, 0, 0, 0, 3], 'VEC3');
const stretches = floats([1, 1, 1, 1, 1.5, 1, 0.8, 1, 1.2, 1, 1, 1], 'VEC3');
const moods = floats([0, 1, 0.5, 0.5, 1, 0, 0.25, 0.75], 'SCALAR');
const smoothMoods = floats([0, 1, 1, 0].flatMap((x) => [0.1, 0, x, 1 - x, 0, -0.1]), 'SCALAR');

const variant = (material, name) => ({
  extensions: { KHR_materials_variants: { mappings: [{ material, variants: [name] }] } },
});
const box = { attributes: { POSITION }, indices };
const target = { POSITION: smile };

const file = {
  asset: { version: '2.0', copyright: 'CC-BY', generator: 'other', extras: { author: 'Ada', license: 'CC-BY-4.0' } },
  extensionsUsed: [
    'ACME_meta', 'KHR_lights_punctual', 'KHR_materials_variants', 'EXT_mesh_gpu_instancing', 'KHR_animation_pointer',
    'KHR_materials_unlit',
  ],
  extensions: {
    KHR_lights_punctual: {
      lights: [
        { type: 'spot', name: 'lamp', color: [1, 0.5, 0.25], intensity: 40, spot: { outerConeAngle: 0.5 } },
        { type: 'directional', name: 'sun' },
      ],
    },
    KHR_materials_variants: { variants: [{ name: 'day' }, { name: 'night' }] },
    ACME_meta: { huge: 12345678901, deep: [{ empty: {} }, []] },
  },
  extras: { root: true },
  scene: 1,
  scenes: [
    { name: 'spare', nodes: [6], extras: { scene: 0 } },
    { name: 'shown', nodes: [0, 8, 10, 11], extensions: { ACME_meta: { scene: 1 } } },
  ],
  nodes: [
    { name: 'root', children: [1, 2, 3, 4, 5, 7, 9], extras: { node: 'root' } },
    { name: 'box', mesh: 0, extensions: { ACME_meta: { node: 1 } } },
    { name: 'eye', camera: 1, translation: [0, 0, 9] },
    { name: 'lamp', extensions: { KHR_lights_punctual: { light: 0 } } },
    { name: 'face', mesh: 1, weights: [0.25, 0.75] },
    { name: 'mixed', mesh: 2 },
    { name: 'elsewhere', mesh: 0, camera: 0 },
    { name: 'crowd', mesh: 4, extensions: { EXT_mesh_gpu_instancing: { attributes: { TRANSLATION: places } } } },
    { name: 'arm', mesh: 5, skin: 1 },
    { name: 'bone', extras: {} },
    { name: 'figure', mesh: 6, skin: 2, weights: [0.5, 0.25] },
    { name: 'stage', children: [12], translation: [1, 2, 3], scale: [2, 2, 2] },
    { name: 'hips', children: [13], rotation: [0, 0.6, 0, 0.8] },
    { name: 'spine', children: [14], translation: [0, 2, 0], extras: { bone: 1 } },
    { name: 'head', translation: [0, 2, 0] },
  ],
  cameras: [
    { name: 'flat', type: 'orthographic', orthographic: { xmag: 2, ymag: 1, znear: 0.5, zfar: 10 } },
    { name: 'eye', type: 'perspective', perspective: { yfov: 0.75, znear: 0.125 }, extras: { lens: '50 mm' } },
  ],
  meshes: [
    {
      name: 'box',
      primitives: [{ ...box, material: 0 }, { ...box, material: 1, ...variant(2, 1), extras: { part: 'lid' } }],
    },
    {
      name: 'face',
      primitives: [{ ...box, targets: [target, target] }],
      weights: [0, 0.5],
      extras: { targetNames: ['smile', 'blink'] },
    },
    {
      name: 'mixed',
      primitives: [
        { ...box, material: 1 },
        { attributes: { POSITION, COLOR_0: color }, indices: edges, mode: 1, material: 2, extras: { lines: 1 } },
        { attributes: { POSITION }, mode: 0 },
      ],
    },
    { name: 'unused', primitives: [box], extras: { unused: true } },
    { name: 'tree', primitives: [box] },
    { name: 'arm', primitives: [{ ...box, attributes: { POSITION, JOINTS_0: joints, WEIGHTS_0: weights } }] },
    { name: 'figure', primitives: [figure], weights: [0, 0], extras: { targetNames: ['swell', 'lean'] } },
  ],
  skins: [
    { name: 'unused', joints: [9], extras: { skin: 0 } },
    { name: 'arm', joints: [9], inverseBindMatrices: binds },
    { name: 'figure', joints: [12, 13, 14], skeleton: 12, inverseBindMatrices: boneBinds, extras: { skin: 2 } },
  ],
  materials: [
    { name: 'red', pbrMetallicRoughness: { baseColorFactor: [1, 0, 0, 1] }, extras: { paint: 3 } },
    { name: 'green', extensions: { KHR_materials_unlit: {} } },
    { name: 'blue', extensions: { ACME_meta: { material: 2 } } },
    { name: 'unused' },
  ],
  animations: [
    {
      name: 'walk',
      channels: [
        { sampler: 0, target: { node: 1, path: 'translation' }, extras: { channel: 0 } },
        {
          sampler: 2,
          target: {
            path: 'pointer',
            extensions: { KHR_animation_pointer: { pointer: '/materials/0/emissiveFactor' } },
          },
        },
        { sampler: 1, target: { node: 4, path: 'weights' } },
      ],
      samplers: [
        { input: times, output: moves },
        { input: times, output: blinks },
        { input: times, output: colors, interpolation: 'STEP' },
      ],
      extras: { animation: 0 },
    },
    {
      name: 'dance, slowly',
      channels: [
        { sampler: 0, target: { node: 12, path: 'rotation' } },
        { sampler: 1, target: { node: 13, path: 'rotation' } },
        { sampler: 2, target: { node: 12, path: 'translation' } },
        { sampler: 3, target: { node: 14, path: 'scale' } },
        { sampler: 4, target: { node: 10, path: 'weights' } },
      ],
      samplers: [
        { input: beats, output: turns },
        { input: beats, output: smoothTurns, interpolation: 'CUBICSPLINE', extras: { sampler: 1 } },
        { input: beats, output: steps, interpolation: 'STEP' },
        { input: beats, output: stretches },
        { input: beats, output: moods },
      ],
    },
    {
      name: 'nod',
      channels: [
        { sampler: 0, target: { node: 14, path: 'rotation' } },
        { sampler: 1, target: { node: 10, path: 'weights' } },
      ],
      samplers: [
        { input: beats, output: swings },
        { input: beats, output: smoothMoods, interpolation: 'CUBICSPLINE' },
      ],
    },
  ],
};

const bytes = Buffer.concat(buffer);
const source = JSON.stringify({
  ...file,
  accessors,
  bufferViews,
  buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }],
});

// ---- what three.js sees ---------------------------------------------------------------------------------

const rounded = (numbers) => [...numbers].map((x) => Math.round(x * 1e5) / 1e5);

function seen(object) {
  const out = { name: object.name, type: object.type, userData: object.userData, matrix: rounded(object.matrix.elements) };
  if (object.material) out.material = [object.material.name, object.material.type, object.material.userData];
  if (object.morphTargetDictionary) out.morphs = [object.morphTargetDictionary, object.morphTargetInfluences];
  if (object.isCamera) out.camera = rounded(object.projectionMatrix.elements);
  if (object.isLight) out.light = [object.color.toArray(), object.intensity, object.angle];
  if (object.isInstancedMesh) out.instances = rounded(object.instanceMatrix.array);
  if (object.isSkinnedMesh) out.bones = object.skeleton.bones.map((bone) => bone.name);
  if (object.isLine || object.isPoints) {
    const { attributes, index } = object.geometry;
    out.points = Object.entries(attributes).sort().map(([name, { array }]) => [name, rounded(array)]);
    out.index = index && [...index.array];
  }
  return { ...out, children: object.children.map(seen) };
}

function everythingSeen(gltf) {
  gltf.scenes.forEach((scene) => scene.updateMatrixWorld(true));
  return {
    scenes: gltf.scenes.map(seen),
    shown: gltf.scenes.indexOf(gltf.scene),
    cameras: gltf.cameras.map(seen),
    clips: gltf.animations.map(({ name, tracks }) => [name, tracks.map((track) => [track.name, rounded(track.values)])]),
    userData: gltf.userData,
  };
}

/** Members of the two documents that no geometry changes. */
function assertSameDocument(answer) {
  const kept = ['cameras', 'extensions', 'extras', 'materials', 'scene'];
  for (const member of kept) assert.deepEqual(answer[member], file[member], member);
  const { copyright, extras } = answer.asset;
  assert.deepEqual({ copyright, extras }, { copyright: 'CC-BY', extras: file.asset.extras });
  assert.deepEqual(answer.extensionsUsed, file.extensionsUsed);
  const names = (array) => array.map(({ name, extras: more }) => [name, more]);
  for (const array of ['nodes', 'meshes', 'skins', 'animations', 'scenes'])
    assert.deepEqual(names(answer[array]), names(file[array]), array);
}

/** As it stands in the file: three.js adds to what it reads. */
const jsonOf = (glb) => JSON.parse(Buffer.from(glb).toString('utf8', 20, 20 + Buffer.from(glb).readUInt32LE(12)));

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

async function answerTo(query) {
  const answer = await fetch(`${await daemon.upload(source)}/surface.glb?${query}`);
  assert.equal(answer.status, 200);
  return new Uint8Array(await answer.arrayBuffer());
}

async function assertValid(bytes) {
  assert.deepEqual(await objections(bytes), []);
}

for (const query of ['level=0', 'level=1']) {
  test(`${query} keeps what the file says`, async () => {
    const glb = await answerTo(query);
    await assertValid(glb);
    assertSameDocument(jsonOf(glb));
    assert.deepEqual(everythingSeen(await load(glb)), everythingSeen(await load(source)));
  });
}

test('the file itself is valid, and glTF answers leave nothing of it out', async () => {
  await assertValid(new TextEncoder().encode(source));
  const description = await (await fetch(await daemon.upload(source))).json();
  assert.deepEqual(description.warnings, ['78 pairs of triangles are joined into quads: quads=ngon keeps the triangles', '1 mesh is in no node of the shown scene: OBJ, STL, PLY and 3MF leave it out', '1 node that is not shown has a mesh that others show: OBJ, STL, PLY and 3MF leave it out', '12 corners of borders are kept hard as the file shows them: creases=tags rounds them']);
});

// ---- what moves -------------------------------------------------------------------------------------------

const TIMES = 20;

/** Moves to times of a clip, with the morph weights that a node has where no clip says them. */
function clipPlayer(gltf, name) {
  const clip = gltf.animations.find((one) => one.name === name);
  const mixer = new AnimationMixer(gltf.scene);
  const action = mixer.clipAction(clip);
  action.setLoop(LoopOnce).clampWhenFinished = true;
  action.play();
  return (part) => {
    action.paused = false;
    mixer.setTime((part * clip.duration) / (TIMES - 1));
    gltf.scene.updateMatrixWorld(true);
  };
}

/** Baked, it hangs on a second node of the name. */
const figureOf = (gltf) => [gltf.scene.getObjectByName('figure'), gltf.scene.getObjectByName('figure_1')].find((one) => one?.isMesh);

/** [vertex]: where joints and morph targets put it in the world. */
function vertices(mesh) {
  return [...Array(mesh.geometry.attributes.position.count).keys()].map((i) =>
    mesh.getVertexPosition(i, new Vector3()).applyMatrix4(mesh.matrixWorld),
  );
}

const row = (attribute, i) => [...Array(attribute.itemSize).keys()].map((c) => attribute.getComponent(i, c));

function assertNear(found, wanted, tolerance, what) {
  assert.equal(found.length, wanted.length, what);
  found.forEach((x, i) => assert.ok(Math.abs(x - wanted[i]) <= tolerance, `${what}: ${found} is not ${wanted}`));
}

function assertSameBones(a, b, what) {
  const bones = (gltf) => figureOf(gltf).skeleton.bones;
  bones(a).forEach((bone, i) => assertNear(bone.matrixWorld.elements, bones(b)[i].matrixWorld.elements, 1e-5, what));
}

test('level 0 has the values and displacements of the file', async () => {
  const [before, after] = [await load(source), await load(await answerTo('level=0'))];
  const [was, is] = [figureOf(before).geometry, figureOf(after).geometry];
  assert.equal(is.attributes.position.count, was.attributes.position.count);
  const key = (geometry, i) => [row(geometry.attributes._id, i), rounded(row(geometry.attributes.uv, i))].join();
  const found = new Map([...Array(was.attributes._id.count).keys()].map((i) => [key(was, i), i]));
  for (let i = 0; i < is.attributes._id.count; i++) {
    const from = found.get(key(is, i));
    for (const name of ['_flow', 'normal', 'color'])
      assertNear(row(is.attributes[name], i), row(was.attributes[name], from), 1e-6, name);
    for (const name of ['position', 'normal'])
      for (const target of [0, 1])
        assertNear(row(is.morphAttributes[name][target], i), row(was.morphAttributes[name][target], from), 1e-6, name);
  }
});

for (const clip of ['dance, slowly', 'nod']) {
  test(`level 0 moves as the file in '${clip}'`, async () => {
    const [before, after] = [await load(source), await load(await answerTo('level=0'))];
    const moves = [before, after].map((gltf) => clipPlayer(gltf, clip));
    const idOf = (gltf, i) => figureOf(gltf).geometry.attributes._id.getX(i);
    for (let time = 0; time < TIMES; time++) {
      moves.forEach((moveTo) => moveTo(time));
      assertSameBones(after, before, `bones at ${time}`);
      const places = new Map();
      vertices(figureOf(before)).forEach((point, i) => places.set(idOf(before, i), point.toArray()));
      vertices(figureOf(after)).forEach((point, i) =>
        assertNear(point.toArray(), places.get(idOf(after, i)), 1e-5, `vertex ${i} at ${time}`),
      );
    }
  });

  /** Weights are subdivided apart from points: between bones that is near to, not the same as, moving first. */
  test(`level 2 follows in '${clip}'`, async () => {
    const [before, after] = [await load(source), await load(await answerTo('level=2'))];
    const moves = [before, after].map((gltf) => clipPlayer(gltf, clip));
    for (let time = 0; time < TIMES; time += 3) {
      moves.forEach((moveTo) => moveTo(time));
      assertSameBones(after, before, `bones at ${time}`);
      const at = (before.animations.find((one) => one.name === clip).duration * time) / (TIMES - 1);
      const baked = await load(await answerTo(`level=2&skin=bake&at=${at}&clip=${encodeURIComponent(clip)}`));
      baked.scene.updateMatrixWorld(true);
      const [kept, moved] = [vertices(figureOf(after)), vertices(figureOf(baked))];
      assert.equal(kept.length, moved.length);
      kept.forEach((point, i) => {
        const distance = point.distanceTo(moved[i]); // edges of the cage are 2 long
        assert.ok(distance < 0.25, `vertex ${i} at ${time}: ${distance}`);
      });
    }
  });
}

test('displaced normals of a level are unit', async () => {
  const { attributes, morphAttributes } = figureOf(await load(await answerTo('level=2'))).geometry;
  for (let i = 0; i < attributes.normal.count; i++)
    for (const target of [0, 1]) {
      const moved = new Vector3(...row(attributes.normal, i)).add(new Vector3(...row(morphAttributes.normal[target], i)));
      assert.ok(Math.abs(moved.length() - 1) < 1e-5, `vertex ${i}: ${moved.length()}`);
    }
});

test('edits that leave the normals of morph targets out say so', async () => {
  const model = await daemon.upload(source);
  const warned = async (...edits) => {
    const answer = await fetch(`${model}/edits`, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify({ mesh: 'figure', edits }) });
    assert.ok(answer.ok, await answer.clone().text());
    return decodeURIComponent(answer.headers.get('X-Tweend-Warning') ?? '');
  };
  assert.match(await warned({ edit: 'extrude', faces: [0], distance: 0.1 }), /the normals of morph targets are left out/);
  assert.doesNotMatch(await warned({ edit: 'crease', edges: 'all', sharpness: 1 }), /normals/);
});
