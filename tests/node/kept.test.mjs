// What artists put into a file beside triangles comes back: three.js sees the same scenes, names, cameras, lights,
// instances, morph targets, lines, points, materials and extras in an answer as in the file, and the validator agrees.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import validator from 'gltf-validator';

import { Daemon } from './daemon.mjs';
import { load } from './player.mjs';

// ---- the file -----------------------------------------------------------------------------------------

const buffer = [];
const bufferViews = [];
const accessors = [];

function accessor(values, type, more = {}) {
  const bytes = Buffer.from(values.buffer);
  const byteOffset = buffer.reduce((sum, part) => sum + part.length, 0);
  const width = { SCALAR: 1, VEC3: 3, VEC4: 4, MAT4: 16 }[type];
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
    { name: 'shown', nodes: [0, 8], extensions: { ACME_meta: { scene: 1 } } },
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
  ],
  skins: [
    { name: 'unused', joints: [9], extras: { skin: 0 } },
    { name: 'arm', joints: [9], inverseBindMatrices: binds },
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

for (const query of ['level=0', 'level=1']) {
  test(`${query} keeps what the file says`, async () => {
    const model = await daemon.upload(source);
    const answer = await fetch(`${model}/surface.glb?${query}&clip=walk`);
    assert.equal(answer.status, 200);
    const glb = new Uint8Array(await answer.arrayBuffer());
    const report = await validator.validateBytes(glb, { maxIssues: 1000 });
    assert.deepEqual(report.issues.messages.filter(({ severity }) => severity < 2), []);
    assertSameDocument(jsonOf(glb));
    assert.deepEqual(everythingSeen(await load(glb)), everythingSeen(await load(source)));
  });
}

test('the file itself is valid, and nothing of it is left out', async () => {
  const report = await validator.validateString(source);
  assert.deepEqual(report.issues.messages.filter(({ severity }) => severity < 2), []);
  const description = await (await fetch(await daemon.upload(source))).json();
  assert.deepEqual(description.warnings ?? [], []);
});
