// A hard-edged machine in Chromium, by three.js: with creases=auto its surface covers what its cage covers.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { BoxGeometry, CylinderGeometry } from 'three';

import { Daemon } from '../node/daemon.mjs';
import { openPage } from './three_page.mjs';

/** Boxes and cylinders as an artist puts them together: [geometry, translation]. Normals are split at their edges. */
const PARTS = [
  [new BoxGeometry(4, 0.8, 2), [0, 0.9, 0]],
  [new BoxGeometry(1.6, 0.7, 1.4, 2, 1, 2), [-0.4, 1.65, 0]],
  [new CylinderGeometry(0.15, 0.15, 2.2, 32).rotateZ(Math.PI / 2), [1.4, 1.7, 0]],
  ...[-1.4, 0, 1.4].map((x) => [new CylinderGeometry(0.6, 0.6, 2.4, 48).rotateX(Math.PI / 2), [x, 0.6, 0]]),
];

/** The machine as a glTF with its bytes inside. */
function machine() {
  const chunks = [];
  const document = { asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [] }], nodes: [], meshes: [], accessors: [], bufferViews: [] };
  let size = 0;
  const add = (array, type, more) => {
    const bytes = Buffer.from(array.buffer, array.byteOffset, array.byteLength);
    document.bufferViews.push({ buffer: 0, byteOffset: size, byteLength: bytes.length });
    const componentType = array instanceof Float32Array ? 5126 : 5125;
    const count = array.length / (type === 'VEC3' ? 3 : 1);
    size += bytes.length;
    chunks.push(bytes);
    return document.accessors.push({ bufferView: document.bufferViews.length - 1, componentType, count, type, ...more }) - 1;
  };
  for (const [geometry, translation] of PARTS) {
    geometry.computeBoundingBox();
    const { min, max } = geometry.boundingBox;
    const { position, normal } = geometry.attributes;
    const attributes = {
      POSITION: add(position.array, 'VEC3', { min: min.toArray(), max: max.toArray() }),
      NORMAL: add(normal.array, 'VEC3'),
    };
    const mesh = document.meshes.push({ primitives: [{ attributes, indices: add(Uint32Array.from(geometry.index.array), 'SCALAR') }] }) - 1;
    document.scenes[0].nodes.push(document.nodes.push({ mesh, translation }) - 1);
  }
  document.buffers = [{ byteLength: size, uri: `data:application/octet-stream;base64,${Buffer.concat(chunks).toString('base64')}` }];
  return JSON.stringify(document);
}

const daemon = new Daemon();
let browser, page, model;

before(async () => {
  await daemon.start();
  model = await daemon.upload(machine());
  ({ browser, page } = await openPage(daemon));
});

after(async () => {
  await browser?.close();
  await daemon.remove();
});

/** The pixels that a model covers, as 0 and 1, seen from each of several sides. */
const coverage = (query) =>
  page.evaluate(async (url) => {
    const { MeshBasicMaterial, OrthographicCamera, Scene, Vector3, WebGLRenderer, WebGLRenderTarget } = await import('three');
    const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
    const SIZE = 192;
    const SIDES = [[0, 0, 1], [1, 0, 0], [0.01, 1, 0], [1, 0.8, 1], [-1, 0.5, 0.4], [0.3, -1, 0.7]];
    const scene = new Scene().add((await new GLTFLoader().loadAsync(url)).scene);
    scene.overrideMaterial = new MeshBasicMaterial({ color: 0xffffff });
    window.renderer ??= new WebGLRenderer();
    const target = new WebGLRenderTarget(SIZE, SIZE);
    const camera = new OrthographicCamera(-2.8, 2.8, 2.8, -2.8, 0.1, 20);
    const pixels = new Uint8Array(4 * SIZE * SIZE);
    return SIDES.map((side) => {
      camera.position.set(...side).setLength(10).add(new Vector3(0, 1, 0));
      camera.lookAt(0, 1, 0);
      renderer.setRenderTarget(target);
      renderer.render(scene, camera);
      renderer.readRenderTargetPixels(target, 0, 0, SIZE, SIZE, pixels);
      return Array.from({ length: SIZE * SIZE }, (_, i) => Number(pixels[4 * i] > 127));
    });
  }, `${model}/surface.glb?${query}`);

/** From each side: the pixels that one of two pictures covers alone, as a part of what the first one covers. */
function differences(before, after) {
  return before.map((mask, side) => {
    const covered = mask.reduce((sum, pixel) => sum + pixel, 0);
    assert.ok(covered > 1000, `${covered} pixels are covered`);
    return mask.filter((pixel, i) => pixel !== after[side][i]).length / covered;
  });
}

test('a machine keeps its silhouette with creases=auto and loses it without', async () => {
  const cage = await coverage('level=0');
  const kept = differences(cage, await coverage('level=2&creases=auto'));
  const lost = differences(cage, await coverage('level=2&creases=none'));
  assert.ok(Math.max(...kept) < 0.005, `with creases up to ${Math.max(...kept)} of the silhouette change`);
  assert.ok(Math.min(...lost) > 0.05, `without creases as little as ${Math.min(...lost)} of the silhouette changes`);
});
