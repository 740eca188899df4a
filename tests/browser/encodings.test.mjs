// A subdivided, skinned clip as three.js draws it in Chromium: float, quantized and compressed answers look the same.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { Daemon } from '../node/daemon.mjs';
import { figure } from '../node/figure.mjs';
import { openPage } from './three_page.mjs';

const TIMES = [0.4, 1.3];
const daemon = new Daemon();
let browser, page, model;

before(async () => {
  await daemon.start();
  model = await daemon.upload(figure());
  ({ browser, page } = await openPage(daemon));
});

after(async () => {
  await browser?.close();
  await daemon.remove();
});

/** A picture of normals at each time: [time][pixel] bytes. */
const pictures = (query) =>
  page.evaluate(
    async ([url, times]) => {
      const { AnimationMixer, MeshNormalMaterial, OrthographicCamera, Scene, WebGLRenderer, WebGLRenderTarget } = await import('three');
      const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
      const { MeshoptDecoder } = await import('three/addons/libs/meshopt_decoder.module.js');
      const SIZE = 256;
      const gltf = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).loadAsync(url);
      const scene = new Scene().add(gltf.scene);
      scene.overrideMaterial = new MeshNormalMaterial();
      gltf.scene.traverse((object) => (object.frustumCulled = false));
      const mixer = new AnimationMixer(gltf.scene);
      mixer.clipAction(gltf.animations[0]).play();
      window.renderer ??= new WebGLRenderer();
      const target = new WebGLRenderTarget(SIZE, SIZE);
      const camera = new OrthographicCamera(-3.5, 3.5, 5, -2, 0.1, 20);
      camera.position.set(2, 1, 9);
      camera.lookAt(0, 1, 0);
      return times.map((time) => {
        mixer.setTime(time);
        renderer.setRenderTarget(target);
        renderer.render(scene, camera);
        const pixels = new Uint8Array(4 * SIZE * SIZE);
        renderer.readRenderTargetPixels(target, 0, 0, SIZE, SIZE, pixels);
        return Array.from(pixels);
      });
    },
    [`${model}/surface.glb?${query}`, TIMES],
  );

const covered = (picture) => picture.filter((value, i) => i % 4 === 2 && value > 0).length; // normals that are seen have blue

/** The part of what a picture covers that differs by more than 8 bits of normals and a hair of an edge do. */
function difference(a, b) {
  let count = 0;
  for (let i = 0; i < a.length; i += 4) count += [0, 1, 2].some((k) => Math.abs(a[i + k] - b[i + k]) > 6);
  return count / covered(a);
}

test('pictures of all encodings agree', async () => {
  const exact = await pictures('level=2');
  exact.forEach((picture) => assert.ok(covered(picture) > 5000, `${covered(picture)} pixels are covered`));
  assert.ok(difference(exact[0], exact[1]) > 0.2, 'the clip moves what is drawn');
  assert.ok(difference(exact[0], (await pictures('level=0'))[0]) > 0.2, 'levels differ');
  for (const encoding of ['quantized', 'meshopt']) {
    const coded = await pictures(`level=2&encoding=${encoding}`);
    exact.forEach((picture, i) => {
      const part = difference(picture, coded[i]);
      assert.ok(part < 0.01, `${encoding} at ${TIMES[i]} s: ${part} of the picture differ`);
    });
  }
});
