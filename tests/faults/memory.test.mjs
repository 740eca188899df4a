// One allocation in a thousand fails, in the daemon and in its libraries: answers are right, 503 or cut off, and the
// daemon goes on.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { Daemon, root } from '../node/daemon.mjs';

const CLIENTS = 6;
const ROUNDS = 400; // requests of each client
const preload = join(dirname(process.env.TESTED_BINARY ?? join(root, 'build/tweend')), 'tests/failing_malloc.so');
const [well, poor] = [new Daemon(), new Daemon()];
poor.env = { LD_PRELOAD: preload };
before(() => Promise.all([well.start(), poor.start()]));
after(() => Promise.all([well.remove(), poor.remove()]));

const sample = (name) => readFileSync(join(root, 'server/samples', name));
const kinds = [
  'surface.glb?level=2', 'surface.obj?level=1', 'surface.json?level=3', 'surface.glb?level=0&polygons=ngon', 'surface.glb?level=2&encoding=meshopt',
  'surface.gltf?level=1&creases=auto', 'surface.glb?level=1&quads=auto',
];
const hash = async (answer) => createHash('sha256').update(Buffer.from(await answer.arrayBuffer())).digest('hex');
const ask = (daemon, kind, body) => fetch(`${daemon.url}/v1/${kind}`, { method: 'POST', headers: { 'Content-Type': 'application/octet-stream' }, body });

test('where allocations fail, no answer is wrong and the daemon goes on', async (t) => {
  const cube = await ask(well, 'surface.glb?level=0&polygons=ngon', sample('cube.obj'));
  const files = [sample('cube.obj'), sample('octopus.obj'), sample('tank.json'), Buffer.from(await cube.arrayBuffer())];
  const right = new Map();
  for (const [f, file] of files.entries())
    for (const kind of kinds) {
      const answer = await ask(well, kind, file);
      right.set(`${f} ${kind}`, [answer.status, await hash(answer)]);
    }
  const tally = { right: 0, refused: 0, cut: 0 };
  const wrong = [];
  await Promise.all(
    Array.from({ length: CLIENTS }, async (_, client) => {
      for (let i = client; i < client + ROUNDS; i++) {
        const [f, kind] = [(i * 3) % files.length, kinds[i % kinds.length]];
        try {
          const answer = await ask(poor, kind, files[f]);
          const [status, bytes] = right.get(`${f} ${kind}`);
          const got = await hash(answer);
          if (answer.status === 503) tally.refused++;
          else if (answer.status === status && (status !== 200 || got === bytes)) tally.right++;
          else wrong.push(`${f} ${kind}: ${answer.status}`);
        } catch (error) {
          if (error.cause?.code === 'ECONNREFUSED') throw error; // it has ended
          tally.cut++;
        }
      }
    }),
  );
  t.diagnostic(JSON.stringify(tally));
  assert.deepEqual(wrong, []);
  assert.ok(tally.right > 100 && tally.refused > 10, JSON.stringify(tally));
  assert.equal(poor.process.exitCode, null);
});
