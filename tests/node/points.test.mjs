// surface.bin beside the GLB and the OBJ of the same surface, as three's loaders read them: each point once, in the order of the
// OBJ, with a normal and texture coordinates that the GLB has there. detail makes the same model of it as of the OBJ.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';

import { Daemon, root } from './daemon.mjs';
import { load } from './player.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

async function ask(model, query) {
  const response = await fetch(`${model}/surface.${query}`);
  assert.equal(response.status, 200, query);
  return Buffer.from(await response.arrayBuffer());
}

function read(bytes) {
  assert.equal(bytes.toString('latin1', 0, 4), 'TWSB');
  assert.equal(bytes.readUInt32LE(4), 1);
  const length = bytes.readUInt32LE(8), head = JSON.parse(bytes.toString('utf8', 12, 12 + length));
  const rows = new Float32Array(new Uint8Array(bytes.subarray(12 + length)).buffer);
  assert.equal(rows.length, head.points * head.stride);
  const part = (name) => {
    const { offset, components } = head.layout.find((entry) => entry.name === name);
    return Array.from({ length: head.points }, (_, i) => [...rows.subarray(i * head.stride + offset, i * head.stride + offset + components)]);
  };
  return { head, part };
}

const models = {
  cube: { bytes: readFileSync(join(root, 'server/samples/cube.obj')) },
  octopus: { bytes: readFileSync(join(root, 'server/samples/octopus.obj')), uvs: true },
  'creased box': { bytes: JSON.stringify({ meshes: [{ name: 'part', shape: { kind: 'box', size: [2, 1, 3] }, edits: [{ edit: 'crease', edges: 'all', sharpness: 10 }] }], nodes: [{ mesh: 'part' }] }) },
};

for (const [name, { bytes, uvs }] of Object.entries(models))
  for (const level of [0, 1, 3])
    test(`${name}, level ${level}: points are those of the GLB, in the order of the OBJ`, async () => {
      const model = await daemon.upload(bytes);
      const { head, part } = read(await ask(model, `bin?level=${level}&with=normals${uvs ? ',uvs' : ''}`));
      const positions = part('position'), normals = part('normal'), coordinates = uvs && part('uv');
      // The OBJ's own numbers: the loader would list them by corner.
      const obj = (await ask(model, `obj?level=${level}`)).toString();
      const lines = [...obj.matchAll(/^v (\S+) (\S+) (\S+)/gm)].map(([, ...point]) => point.map((value) => Math.fround(value)));
      assert.deepEqual(positions.map((point) => point.map((value) => value + 0)), lines.map((point) => point.map((value) => value + 0)));
      const corners = new OBJLoader().parse(obj).children[0].geometry.attributes.position.count;
      assert.ok(corners > head.points);
      const vertices = new Map(); // of the GLB, by place
      (await load(await ask(model, `glb?level=${level}`))).scene.traverse(({ isMesh, geometry }) => {
        if (!isMesh) return;
        const { position, normal, uv } = geometry.attributes, at = (attribute, i) => Array.from({ length: attribute.itemSize }, (_, c) => attribute.getComponent(i, c));
        for (let i = 0; i < position.count; i++) {
          const key = at(position, i).map((value) => value + 0).join();
          vertices.set(key, [...(vertices.get(key) ?? []), { normal: at(normal, i), uv: uv && at(uv, i) }]);
        }
      });
      const near = (a, b) => a.every((value, i) => Math.abs(value - b[i]) < 2e-5);
      positions.forEach((point, i) => {
        const there = vertices.get(point.map((value) => value + 0).join());
        assert.ok(there, `${point}`);
        assert.ok(there.some(({ normal }) => near(normal, normals[i])), `normal of ${i}`);
        if (uvs) assert.ok(there.some(({ uv }) => near(uv, coordinates[i])), `uv of ${i}`);
      });
      assert.equal(new Set(positions.map(String)).size, vertices.size);
    });

test('detail makes one model of moved points, as bytes and as OBJ', async () => {
  const model = await daemon.upload(models.octopus.bytes);
  const body = await ask(model, 'bin?level=2');
  const start = 12 + body.readUInt32LE(8);
  const moved = [];
  for (let i = 0; i < 3 * read(body).head.points; i++) {
    const at = start + 4 * i;
    if (i % 21 === 1) body.writeFloatLE(body.readFloatLE(at) + 0.03, at);
    moved.push(body.readFloatLE(at));
  }
  let next = 0;
  const obj = (await ask(model, 'obj?level=2')).toString().replace(/^v \S+ \S+ \S+/gm, () => `v ${moved.slice(next, (next += 3)).join(' ')}`);
  const send = async (bytes, type) => {
    const response = await fetch(`${model}/detail?level=2`, { method: 'POST', headers: { 'Content-Type': type }, body: bytes });
    const { id, detail } = await response.json();
    assert.equal(detail, undefined);
    return id;
  };
  const made = await send(body, 'application/octet-stream');
  assert.equal(await send(obj, 'model/obj'), made);
  const after = read(await ask(`${daemon.url}/v1/models/${made}`, 'bin?level=2')).part('position').flat();
  after.forEach((value, i) => assert.ok(Math.abs(value - moved[i]) < 1e-6));
});
