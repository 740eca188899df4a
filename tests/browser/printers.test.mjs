// surface.3mf as three's 3MFLoader reads it in Chromium: triangles, bounds, volume and colours are those of the GLB.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Daemon, root } from '../node/daemon.mjs';
import { openPage } from './three_page.mjs';

const daemon = new Daemon();
let browser, page;

before(async () => {
  await daemon.start();
  ({ browser, page } = await openPage(daemon));
});

after(async () => {
  await browser?.close();
  await daemon.remove();
});

/** Of each answer: triangles, volume and bounds of all meshes in world space, in millimetres, and colours. */
const read = (model, query) =>
  page.evaluate(
    async ([model, query]) => {
      const { Box3, Vector3 } = await import('three');
      const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
      const { ThreeMFLoader } = await import('three/addons/loaders/3MFLoader.js');
      const facts = (scene, scale) => {
        let triangles = 0, volume = 0;
        const bounds = new Box3(), colors = new Set();
        scene.updateMatrixWorld(true);
        scene.traverse((mesh) => {
          if (!mesh.isMesh) return;
          const { position } = mesh.geometry.attributes, { index } = mesh.geometry, count = index ? index.count : position.count;
          const point = (i) => new Vector3().fromBufferAttribute(position, index ? index.getX(i) : i).applyMatrix4(mesh.matrixWorld).multiplyScalar(scale);
          const sign = Math.sign(mesh.matrixWorld.determinant());
          for (let i = 0; i < count; i += 3) {
            const [a, b, c] = [point(i), point(i + 1), point(i + 2)];
            volume += (sign * a.dot(b.clone().cross(c))) / 6;
            for (const corner of [a, b, c]) bounds.expandByPoint(corner);
          }
          triangles += count / 3;
          colors.add(mesh.material.color.getHexString());
        });
        return { triangles, volume, bounds: [...bounds.min.toArray(), ...bounds.max.toArray()], colors: [...colors].sort() };
      };
      const glb = await new GLTFLoader().loadAsync(`${model}/surface.glb?${query}`);
      const package3mf = await new ThreeMFLoader().loadAsync(`${model}/surface.3mf?${query}`);
      return { glb: facts(glb.scene, 1000), threemf: facts(package3mf, 1) };
    },
    [model, query],
  );

const mirrored = JSON.stringify({
  meshes: [{ name: 'cone', shape: { kind: 'cone', radius: 1, height: 2, segments: 5 }, color: [0.2, 0.4, 0.6] }],
  nodes: [{ name: 'one', mesh: 'cone' }, { name: 'other', mesh: 'cone', translation: [3, 1, 0], rotation: [0, 0.6, 0, 0.8], scale: [-1, 2, 0.5] }],
});

for (const [name, bytes] of Object.entries({ tank: readFileSync(join(root, 'server/samples/tank.json')), mirrored }))
  for (const level of [0, 2])
    test(`3MFLoader reads ${name} at level ${level} as GLTFLoader does`, async () => {
      const { glb, threemf } = await read(await daemon.upload(bytes), `level=${level}&clip=none`);
      assert.equal(threemf.triangles, glb.triangles);
      assert.ok(Math.abs(threemf.volume / glb.volume - 1) < 1e-4, `${threemf.volume}, ${glb.volume}`);
      threemf.bounds.forEach((bound, i) => assert.ok(Math.abs(bound - glb.bounds[i]) < 0.01, `${bound}, ${glb.bounds[i]}`));
      for (const color of glb.colors) assert.ok(threemf.colors.includes(color), `${color} of ${threemf.colors}`);
    });
