// Three replicas on one store behind HAProxy lose no request, whatever happens to one of them.
//   TESTED_FLEET=containers    in place of processes: what docker/compose.scale.yaml starts of TWEEND_IMAGE
//   TESTED_ROUNDS=10           of racing uploads (one by default); three and more: replicas are replaced in three rounds
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { createHash } from 'node:crypto';
import { once } from 'node:events';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';
import { eventually, root } from '../node/daemon.mjs';
import { Containers, Processes } from './fleet.mjs';

const ROUNDS = Number(process.env.TESTED_ROUNDS ?? 1);
const RATE = 40;
const STREAM_RATE = 12e6;
const MODELS = 24;
const fleet = process.env.TESTED_FLEET === 'containers' ? new Containers() : new Processes();
const { replicas } = fleet;
const cube = readFileSync(join(root, 'server/samples/cube.obj'), 'utf8');
const headers = { 'Content-Type': 'model/obj' };
const own = (name) => `${cube}# ${name}\n`;
const idOf = (text) => createHash('sha256').update(text).digest('hex').slice(0, 32);
const models = Array.from({ length: MODELS }, (_, i) => `/v1/models/${idOf(own(`model ${i}`))}`);

const post = (url, body) => fetch(`${url}/v1/models`, { method: 'POST', headers, body });

before(async () => {
  await fleet.start();
  for (let i = 0; i < MODELS; i++) assert.equal((await post(fleet.url, own(`model ${i}`))).status, 201);
});
after(() => fleet.remove());

/** Sums of /metrics of a replica whose lines match. */
async function counted(url, pattern) {
  const text = await (await fetch(`${url}/metrics`)).text();
  return text.split('\n').filter((line) => pattern.test(line)).reduce((sum, line) => sum + Number(line.split(' ').at(-1)), 0);
}

/** How many requests each replica answers while ask() makes so many; they are counted once their clients have it all. */
async function served(pattern, number, ask) {
  const counts = () => Promise.all(replicas.map(({ url }) => counted(url, pattern)));
  const earlier = await counts();
  await ask();
  let more;
  await eventually(`${number} requests are counted`, 5, async () => {
    more = (await counts()).map((count, i) => count - earlier[i]);
    return more.reduce((sum, count) => sum + count) >= number;
  });
  return more;
}

const SURFACES = /^tweend_http_requests_total\{route="[^"]*surface/;
const OF_MODELS = /^tweend_http_requests_total\{route="\/v1\/models\/\{id\}/;

/** For each replica a model that HAProxy gives to it. */
async function modelOfEach() {
  const found = [];
  for (const model of models) {
    const counts = await served(SURFACES, 1, async () => (await fetch(`${fleet.url}${model}/surface.json`)).arrayBuffer());
    found[counts.findIndex((count) => count > 0)] ??= model;
    if (Object.keys(found).length === replicas.length) return found;
  }
  throw new Error(`${models.length} models are served by ${Object.keys(found).length} replicas`);
}

/** Requests at a steady rate, whatever becomes of those before, until stop(); tells what failed and the slowest. */
class Traffic {
  failed = [];
  slowest = 0;
  sent = 0;
  #running = [];
  #timer = setInterval(() => this.#running.push(this.#one(this.sent++)), 1000 / RATE);

  async #one(number) {
    const model = models[number % MODELS];
    const kinds = [
      () => fetch(`${fleet.url}${model}/surface.glb?level=2`),
      () => fetch(`${fleet.url}${model}`),
      () => fetch(`${fleet.url}${model}/surface.json?level=3`),
      () => fetch(`${fleet.url}/v1/surface?level=1`, { method: 'POST', headers, body: cube }),
      () => post(fleet.url, own(`traffic ${number}`)),
    ];
    const started = performance.now();
    try {
      const answer = await kinds[number % kinds.length]();
      await answer.arrayBuffer();
      if (!answer.ok) this.failed.push(`${number % kinds.length}: ${answer.status}`);
    } catch (error) {
      this.failed.push(`${number % kinds.length}: ${error.cause?.message ?? error.message}`);
    }
    this.slowest = Math.max(this.slowest, (performance.now() - started) / 1000);
  }

  async stop() {
    clearInterval(this.#timer);
    await Promise.all(this.#running);
    return this;
  }
}

/** The SHA-256 of an answer that curl reads at a rate. */
async function slowly(url) {
  const curl = spawn('curl', ['--silent', '--fail', '--limit-rate', `${STREAM_RATE}`, url], { stdio: ['ignore', 'pipe', 'inherit'] });
  const hash = createHash('sha256');
  let size = 0;
  for await (const bytes of curl.stdout) {
    hash.update(bytes);
    size += bytes.length;
  }
  if (curl.exitCode === null) await once(curl, 'exit');
  return { status: curl.exitCode, size, hash: hash.digest('hex') };
}

test('racing uploads of equal and of distinct models are all stored', async (t) => {
  for (let round = 0; round < ROUNDS; round++) {
    const equal = own(`equal ${round}`);
    const uploads = [...Array(50).fill(equal), ...Array.from({ length: 150 }, (_, i) => own(`distinct ${round} ${i}`))];
    for (let i = uploads.length - 1; i > 0; i--) {
      const j = Math.floor(Math.random() * (i + 1));
      [uploads[i], uploads[j]] = [uploads[j], uploads[i]];
    }
    const answers = await Promise.all(uploads.map((body, i) => post(replicas[i % replicas.length].url, body)));
    const statuses = {};
    for (const { status } of answers) statuses[status] = (statuses[status] ?? 0) + 1;
    t.diagnostic(`round ${round + 1}: ${JSON.stringify(statuses)}`);
    assert.deepEqual(Object.keys(statuses).filter((status) => !['200', '201'].includes(status)), []);
    const ids = await Promise.all(answers.map(async (answer) => (await answer.json()).id));
    assert.deepEqual(ids, uploads.map(idOf));
    for (const [i, id] of ids.entries()) {
      const answer = await fetch(`${replicas[(i + 1) % replicas.length].url}/v1/models/${id}/source`);
      assert.equal(await answer.text(), uploads[i]);
    }
  }
});

test('what belongs to one model goes to one replica', async () => {
  for (const model of models.slice(0, 8)) {
    const paths = ['', '/source', '/surface.json', '/surface.obj?level=2', '/tracks'];
    const counts = await served(OF_MODELS, paths.length, async () => {
      for (const path of paths) await (await fetch(`${fleet.url}${model}${path}`)).arrayBuffer();
    });
    assert.deepEqual(counts.filter((count) => count > 0), [paths.length], model);
  }
});

test('what one replica deletes, every replica has forgotten within two seconds', async () => {
  for (const path of ['', '/surface.glb?level=2']) {
    const body = own(`deleted ${path}`);
    const model = `/v1/models/${idOf(body)}${path}`;
    await post(fleet.url, body);
    const statuses = () => Promise.all(replicas.map(async ({ url }) => {
      const answer = await fetch(url + model);
      await answer.arrayBuffer();
      return answer.status;
    }));
    assert.deepEqual(await statuses(), [200, 200, 200]);
    assert.equal((await fetch(`${fleet.url}/v1/models/${idOf(body)}`, { method: 'DELETE' })).status, 204);
    await pause(2000);
    assert.deepEqual(await statuses(), [404, 404, 404]);
  }
});

test('replicas that are replaced one after another fail no request, and cut no stream', async (t) => {
  const path = '/surface.glb?level=9';
  for (let round = 0; round < (ROUNDS < 3 ? 1 : 3); round++) {
    const chosen = await modelOfEach();
    const hash = createHash('sha256');
    hash.update(Buffer.from(await (await fetch(`${fleet.url}${chosen[0]}${path}`)).arrayBuffer()));
    const whole = hash.digest('hex');
    const traffic = new Traffic();
    t.after(() => traffic.stop());
    const started = Date.now();
    for (const [i, replica] of replicas.entries()) {
      const stream = slowly(`${fleet.url}${chosen[i]}${path}`);
      await pause(500);
      await replica.replace();
      const { status, size, hash: arrived } = await stream;
      assert.deepEqual([status, arrived], [0, whole], `a stream through the end of replica ${i + 1}: ${size} bytes`);
      assert.ok(size > 70e6);
      // HAProxy sends to it again.
      const before = await counted(replica.url, SURFACES);
      await eventually('the replica serves', 10, async () => (await counted(replica.url, SURFACES)) > before);
    }
    const { failed, slowest, sent } = await traffic.stop();
    t.diagnostic(`${sent} requests in ${Math.round((Date.now() - started) / 1000)} s, ${failed.length} failed, slowest ${slowest.toFixed(2)} s`);
    assert.deepEqual(failed, []);
    assert.ok(slowest < 2, `${slowest} s`);
  }
});

test('a replica that is killed and one that hangs fail no request', async (t) => {
  const traffic = new Traffic();
  t.after(() => traffic.stop());
  await pause(1000);
  await replicas[0].kill();
  await pause(3000);
  await replicas[0].start();
  await pause(2000);
  await replicas[1].freeze();
  await pause(6000);
  await replicas[1].thaw();
  await pause(1000);
  const { failed, slowest, sent } = await traffic.stop();
  t.diagnostic(`${sent} requests, ${failed.length} failed, slowest ${slowest.toFixed(2)} s`);
  assert.deepEqual(failed, []);
});

test('how much one, two and three replicas answer', async (t) => {
  const CLIENTS = 16;
  const SECONDS = 3;
  const plans = async (kind) => (await Promise.all(running.map(({ url }) => counted(url, new RegExp(`^tweend_cache_${kind}_total.kind="plan"`)))))
    .reduce((sum, count) => sum + count);
  const running = [...replicas];
  for (let count = replicas.length; count > 0; count--) {
    const [hits, misses] = [await plans('hits'), await plans('misses')];
    const end = Date.now() + SECONDS * 1000;
    let answered = 0;
    await Promise.all(Array.from({ length: CLIENTS }, async (_, client) => {
      for (let i = client; Date.now() < end; i++) {
        const answer = await fetch(`${fleet.url}${models[(i * 7) % MODELS]}/surface.glb?level=4&limit=true`);
        await answer.arrayBuffer();
        assert.equal(answer.status, 200);
        answered++;
      }
    }));
    const [found, made] = [(await plans('hits')) - hits, (await plans('misses')) - misses];
    t.diagnostic(`${count} replicas: ${Math.round(answered / SECONDS)} surfaces a second, ${(100 * found / (found + made)).toFixed(1)} % found their plan`);
    // Each model's plan is made once, or once more when its replica ends.
    assert.ok(made <= 1.5 * MODELS, `${made} plans of ${MODELS} models`);
    if (count > 1) await running.pop().stop();
  }
});
