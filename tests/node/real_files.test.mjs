// Files that others made (Debian's package assimp-testmodels, and the folders of TESTED_MODELS, colons between them):
// what three.js sees of one before, it sees after, or a warning of the model says what had to go.
import assert from 'node:assert/strict';
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { basename, dirname, extname, join } from 'node:path';
import { after, before, test } from 'node:test';

import { AnimationMixer, Box3, Vector3 } from 'three';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';

import { Daemon } from './daemon.mjs';
import { load, nodesOf } from './player.mjs';

const FOLDERS = ['/usr/share/assimp/models', ...(process.env.TESTED_MODELS ?? '').split(':').filter(Boolean)];
const TIMES = 5;

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

/** Name and path of each file with one of the suffixes. */
function filesWith(suffixes) {
  return FOLDERS.filter(existsSync).flatMap((folder) =>
    readdirSync(folder, { recursive: true })
      .filter((name) => suffixes.includes(extname(name).toLowerCase()))
      .sort()
      .map((name) => ({ name, file: join(folder, name) })),
  );
}

/** The file, and beside a .gltf all that lies in its folder, as one form. */
function formOf(file) {
  const form = new FormData();
  const folder = dirname(file);
  const names = extname(file) === '.gltf' ? [basename(file), ...namedBy(file)] : [basename(file)];
  for (const name of names) form.append('file', new Blob([readFileSync(join(folder, name))]), name);
  return form;
}

/** Files of the same folder that a glTF's uris name. */
function namedBy(file) {
  try {
    const { buffers = [], images = [] } = JSON.parse(readFileSync(file));
    const uris = [...buffers, ...images].map((part) => part.uri).filter((uri) => uri && !uri.startsWith('data:'));
    return [...new Set(uris.map(decodeURIComponent))].filter((name) => existsSync(join(dirname(file), name)));
  } catch {
    return [];
  }
}

async function upload(file) {
  const answer = await fetch(`${daemon.url}/v1/models`, { method: 'POST', body: formOf(file) });
  return { status: answer.status, description: await answer.json() };
}

const bytesOf = async (url) => {
  const answer = await fetch(url);
  assert.equal(answer.status, 200, `${url}: ${answer.status}`);
  return Buffer.from(await answer.arrayBuffer());
};

const rounded = (numbers) => numbers.map((x) => Number(x.toPrecision(5)) + 0);

/** The box of a scene's vertices where joints and morph targets put them. */
function boundsOf(gltf) {
  const box = new Box3();
  const point = new Vector3();
  gltf.scene?.updateMatrixWorld(true);
  gltf.scene?.traverse((object) => {
    const position = object.geometry?.attributes.position;
    for (let i = 0; i < (position?.count ?? 0); i++) {
      if (object.getVertexPosition) object.getVertexPosition(i, point);
      else point.fromBufferAttribute(position, i);
      box.expandByPoint(point.applyMatrix4(object.matrixWorld));
    }
  });
  return box.isEmpty() ? [] : [...box.min.toArray(), ...box.max.toArray()];
}

/** What a person misses when it is gone, by name. */
async function sightOf(gltf) {
  const json = gltf.parser.json;
  const names = (list) => (list ?? []).map((part) => part.name ?? '');
  const extras = (list) => (list ?? []).map((part) => JSON.stringify(part.extras ?? null));
  const nodes = json.nodes ? await nodesOf(gltf) : [];
  const sight = {
    'node names': names(json.nodes),
    'mesh names': names(json.meshes),
    'material names': names(json.materials),
    'skin names': names(json.skins),
    'camera names': names(json.cameras),
    'scene names': names(json.scenes),
    'texture names': names(json.textures),
    'clip names': names(json.animations),
    'default scene': (json.scenes && json.scene) ?? null,
    joints: (json.skins ?? []).map((skin) => skin.joints),
    cameras: (json.cameras ?? []).map((camera) => JSON.stringify(camera.perspective ?? camera.orthographic)),
    extras: ['nodes', 'meshes', 'materials', 'scenes', 'skins', 'cameras'].map((kind) => extras(json[kind])),
    'asset extras': JSON.stringify(json.asset.extras ?? null),
    copyright: json.asset.copyright ?? '',
    'morph targets': (json.meshes ?? []).map((mesh) => mesh.primitives[0]?.targets?.length ?? 0),
    'root extensions': Object.keys(json.extensions ?? {}).sort(),
    'material extensions': (json.materials ?? []).map((material) => Object.keys(material.extensions ?? {}).sort()),
    tracks: (json.animations ?? []).map((clip) => clip.channels.length),
    bounds: rounded(boundsOf(gltf)),
    'world transforms': nodes.map((node) => rounded(node.matrixWorld.elements)),
  };
  const mixer = new AnimationMixer(gltf.scene);
  for (const [i, clip] of gltf.animations.entries()) {
    const action = mixer.clipAction(clip).play();
    for (let time = 0; time < TIMES; time++) {
      mixer.setTime((clip.duration * time) / TIMES);
      sight[`bounds in clip ${i} at ${time}`] = rounded(boundsOf(gltf));
    }
    action.stop();
  }
  return sight;
}

/** 5e-4: rotations that a file has with four digits are made unit on the way. */
function differ(a, b) {
  if (Array.isArray(a) && Array.isArray(b) && a.length === b.length) return a.some((x, i) => differ(x, b[i]));
  if (typeof a === 'number' && typeof b === 'number') return Math.abs(a - b) > 5e-4 * Math.max(1, Math.abs(a));
  return a !== b;
}

/** Warnings that may explain what differs; all else may never differ. */
const REASONS = { bounds: /left out|lies so far from the origin/, triangles: /left out/ };

function assertKept(before, after, warnings, t) {
  for (const what of Object.keys(before)) {
    if (!differ(before[what], after[what])) continue;
    const reason = warnings.find((warning) => REASONS[what]?.test(warning));
    assert.ok(reason, `${what}: ${JSON.stringify(before[what])} became ${JSON.stringify(after[what])}; warnings: ${warnings}`);
    t.diagnostic(`${what} differs: ${reason}`);
  }
}

for (const { name, file } of filesWith(['.gltf', '.glb', '.vrm'])) {
  test(`${name} keeps what it holds`, async (t) => {
    const { status, description } = await upload(file);
    if (status >= 400) {
      assert.ok(status === 422 || status === 400, description.detail);
      return t.skip(`refused: ${description.detail}`);
    }
    const model = `${daemon.url}/v1/models/${description.id}`;
    let before;
    try {
      before = await sightOf(await load(await bytesOf(`${model}/source`)));
    } catch (error) {
      return t.skip(`three.js does not read it: ${error.message}`);
    }
    const after = await sightOf(await load(await bytesOf(`${model}/surface.glb?level=0&quads=off`)));
    assertKept(before, after, description.warnings, t);
  });
}

/** Triangles and box of a three.js geometry or group. */
function extentOf(object) {
  const box = new Box3();
  let triangles = 0;
  const add = (geometry) => {
    const { position } = geometry.attributes;
    triangles += (geometry.index ?? position).count / 3;
    for (let i = 0; i < position.count; i++) box.expandByPoint(new Vector3().fromBufferAttribute(position, i));
  };
  if (object.isBufferGeometry) add(object);
  else object.traverse((part) => part.isMesh && add(part.geometry));
  return { triangles, bounds: box.isEmpty() ? [] : rounded([...box.min.toArray(), ...box.max.toArray()]) };
}

const READERS = {
  '.obj': (bytes) => new OBJLoader().parse(Buffer.from(bytes).toString('latin1')),
  '.stl': (bytes) => new STLLoader().parse(new Uint8Array(bytes).buffer),
  '.ply': (bytes) => new PLYLoader().parse(new Uint8Array(bytes).buffer),
};

for (const { name, file } of filesWith(Object.keys(READERS))) {
  test(`${name} keeps its faces`, async (t) => {
    const { status, description } = await upload(file);
    if (status >= 400) {
      const isForeign = status === 415 && name.includes('UTF16');
      assert.ok(status === 422 || status === 400 || isForeign, description.detail);
      return t.skip(`refused: ${description.detail}`);
    }
    let before;
    try {
      before = extentOf(READERS[extname(file).toLowerCase()](readFileSync(file)));
    } catch (error) {
      return t.skip(`three.js does not read it: ${error.message}`);
    }
    const faces = description.meshes.reduce((sum, mesh) => sum + mesh.faces, 0);
    if (faces === 0) return t.diagnostic('a file without faces');
    const answer = await bytesOf(`${daemon.url}/v1/models/${description.id}/surface.glb?level=0`);
    const after = extentOf((await load(answer)).scene);
    assertKept(before, after, description.warnings, t);
  });
}
