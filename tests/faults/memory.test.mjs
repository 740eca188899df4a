// One allocation in a thousand fails, in the daemon and in its libraries: answers are right, 503 or cut off, and the
// daemon goes on.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { Daemon, root } from '../node/daemon.mjs';

const CLIENTS = 6;
const ROUNDS = Number(process.env.TESTED_ROUNDS ?? 500); // requests of each client
const preload = join(dirname(process.env.TESTED_BINARY ?? join(root, 'build/tweend')), 'tests/failing_malloc.so');
const [well, poor] = [new Daemon(), new Daemon()];
poor.env = { LD_PRELOAD: preload };
before(() => Promise.all([well.start(), poor.start()]));
after(() => Promise.all([well.remove(), poor.remove()]));

/** What a name of `stored` holds. Mixed: the tank with a clip that is mixed of its own. */
function contents(name) {
  if (name !== 'mixed') return sample(name);
  const tank = JSON.parse(sample('tank.json'));
  const [one, other] = tank.clips;
  tank.clips.push({ name: 'both', layers: [{ clip: one.name, weight: 0.7 }, { clip: other.name, weight: { times: [0, 1], values: [0, 1] }, sync: true }] });
  return JSON.stringify(tank);
}

const sample = (name) => readFileSync(join(root, 'server/samples', name));
const kinds = [
  'surface.glb?level=2', 'surface.obj?level=1', 'surface.json?level=3', 'surface.glb?level=0&polygons=ngon', 'surface.glb?level=2&encoding=meshopt',
  'surface.gltf?level=1&creases=auto', 'surface.glb?level=1&quads=auto', 'surface.stl?level=1', 'surface.ply?level=1&polygons=ngon', 'surface.3mf?level=1',
];
// [name of a stored model, path, body]; without a name the path is the daemon's.
const stored = [
  ['tank.json', ''], ['tank.json', '/tracks?clip=drive'], ['tank.json', '/pose.json?clip=drive&at=0.5'], ['tank.json', '/pose.bvh?clip=drive'],
  ['tank.json', '/pose.bin?clip=drive&from=0&to=2&fps=30'], ['tank.json', '/surface.glb?clip=drive&at=0.7&level=1'],
  ['octopus.obj', '/surface.obj?level=1&boundary=open'], ['octopus.obj', '/edits', { edits: [{ edit: 'smooth', vertices: 'all', iterations: 2 }, { edit: 'mirror', axis: 'x' }] }],
  ['octopus.obj', '/edits', { edits: [{ edit: 'extrude', faces: [1], distance: 0.1 }] }], ['octopus.obj', '/coarsen?levels=1', {}],
  ['octopus.obj', '/levels.json'], ['octopus.obj', '/surface.bin?level=1&normals=limit'],
  ['mixed', '/pose.json?clip=both&from=0&to=1&fps=10'], ['mixed', '/surface.glb?meshes=none&clip=both'], ['mixed', '/tracks?clip=both'],
  ['tank.json', (ids) => `/pose.json?clip=${ids.get('mixed')}/both&at=0.5&retarget=auto`],
  ['', '/v1/rotations', { rotations: [{ quaternion: [0, 0, 0, 1] }, { matrix: [1, 0, 0, 0, 1, 0, 0, 0, 1] }] }], ['', '/v1/models'],
];
const hash = async (answer) => createHash('sha256').update(Buffer.from(await answer.arrayBuffer())).digest('hex');
const post = (daemon, path, type, body) => fetch(daemon.url + path, { method: 'POST', headers: { 'Content-Type': type }, body });
const convert = (kind, file) => (daemon) => post(daemon, `/v1/${kind}`, 'application/octet-stream', file);
const askStored = ([name, tail, body]) => (daemon) => {
  const path = name ? `/v1/models/${daemon.ids.get(name)}${typeof tail === 'string' ? tail : tail(daemon.ids)}` : tail;
  return body ? post(daemon, path, 'application/json', JSON.stringify(body)) : fetch(daemon.url + path);
};

test('where allocations fail, no answer is wrong and the daemon goes on', async (t) => {
  const cube = await convert('surface.glb?level=0&polygons=ngon', sample('cube.obj'))(well);
  const files = [sample('cube.obj'), sample('octopus.obj'), sample('tank.json'), Buffer.from(await cube.arrayBuffer())];
  for (const daemon of [well, poor]) {
    daemon.ids = new Map();
    for (const name of ['tank.json', 'octopus.obj', 'mixed'])
      while (!daemon.ids.has(name)) {
        const model = await daemon.upload(contents(name)).catch(() => null); // refused for want of memory
        if (model) daemon.ids.set(name, model.split('/').pop());
      }
  }
  // What is stored by now shows in the list of models, and in what storing answers.
  const requests = [
    ...files.flatMap((file, f) => kinds.map((kind) => ({ name: `${f} ${kind}`, ask: convert(kind, file), isSteady: true }))),
    ...stored.map((one) => ({ name: one.join(' '), ask: askStored(one), isSteady: one[2] === undefined && one[1] !== '/v1/models' })),
  ];
  for (const one of requests) {
    const answer = await one.ask(well);
    Object.assign(one, { status: answer.status, bytes: await hash(answer) });
    assert.ok(answer.status < 300 || one.name.includes('coarsen'), `${one.name}: ${answer.status}`); // of a cage there is none
  }
  const tally = { right: 0, refused: 0, cut: 0 };
  const wrong = [];
  await Promise.all(
    Array.from({ length: CLIENTS }, async (_, client) => {
      for (let i = client; i < client + ROUNDS; i++) {
        const { name, ask, isSteady, status, bytes } = requests[(i * 7) % requests.length];
        try {
          const answer = await ask(poor);
          const got = await hash(answer);
          const isRight = isSteady ? answer.status === status && got === bytes : answer.status === status || answer.status === 200;
          if (answer.status === 503) tally.refused++;
          else if (isRight) tally.right++;
          else wrong.push(`${name}: ${answer.status}`);
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
