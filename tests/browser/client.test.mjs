// The client module in Chromium: imported from the daemon by a page of another origin, with keys and signed URLs on.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import http from 'node:http';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Daemon, root } from '../node/daemon.mjs';
import { launch } from './chromium.mjs';

// An upload that is called off is in flight until the daemon's time for it is over.
const daemon = new Daemon(['--api-keys', 'sesame', '--url-keys', 'seal', '--drain-timeout', '1s']);
const PREFIX = '/apps/tweend';
const tankFile = readFileSync(join(root, 'server/samples/tank.json'), 'utf8');
let browser, page, server, far;

/** An origin of its own, which hands what is below PREFIX on to the daemon. */
function answer(request, response) {
  if (!request.url.startsWith(`${PREFIX}/`)) {
    response.setHeader('Content-Type', 'text/html');
    response.end('<!doctype html><link rel="icon" href="data:,">');
    return;
  }
  const { method, headers } = request;
  const onward = http.request(daemon.url + request.url.slice(PREFIX.length), { method, headers }, (reply) => {
    response.writeHead(reply.statusCode, reply.headers);
    reply.pipe(response);
  });
  onward.on('error', () => response.destroy());
  request.pipe(onward);
}

before(async () => {
  await daemon.start();
  server = http.createServer(answer);
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  far = `http://127.0.0.1:${server.address().port}`;
  browser = await launch([]);
  page = await browser.newPage();
  await page.goto(far);
  await page.evaluate(
    async ([url, tank]) => {
      window.module = await import(`${url}/tweend.js`);
      window.tweend = new module.Tweend(undefined, { key: 'sesame' });
      window.tank = await tweend.upload(tank, { name: 'tank' });
    },
    [daemon.url, tankFile],
  );
});

after(async () => {
  await browser?.close();
  server?.close();
  server?.closeAllConnections();
  await daemon.remove();
});

test('the module asks the daemon that it came from', async () => {
  assert.equal(await page.evaluate(() => tweend.base), `${daemon.url}/`);
  assert.notEqual(new URL(daemon.url).origin, far);
  assert.equal(await page.evaluate(() => tank.name), 'tank');
});

test('an upload tells its progress, and errors with their places', async () => {
  const told = await page.evaluate(async () => {
    const told = [];
    const file = new File([`${' '.repeat(8 << 20)}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n`], 'spacious.obj', { type: 'model/x-what' });
    const model = await tweend.upload(file, { onProgress: (...of) => told.push(of) });
    const error = await tweend.upload('v 0 0 0\nv a', { onProgress() {} }).catch(({ name, status, line, requestId }) => ({ name, status, line, requestId }));
    await tweend.remove(model);
    return { name: model.name, told, size: file.size, error };
  });
  assert.equal(told.name, 'spacious.obj');
  assert.deepEqual(told.told.at(-1), [told.size, told.size]);
  told.told.slice(1).forEach(([sent], i) => assert.ok(sent >= told.told[i][0]));
  assert.ok(told.error.requestId);
  assert.deepEqual({ ...told.error, requestId: 0 }, { name: 'TweendError', status: 400, line: 2, requestId: 0 });
});

test('an upload that is called off goes no further', async () => {
  const ends = await page.evaluate(async () => {
    const end = (signal, onProgress) => tweend.upload(new Blob([new Uint8Array(64 << 20)]), { signal, onProgress }).then(String, ({ message }) => message);
    const controller = new AbortController();
    return [
      await end(controller.signal, () => controller.abort(new Error('enough'))),
      await end(AbortSignal.abort(new Error('before')), () => {}),
      await end(AbortSignal.abort(new Error('without progress'))),
    ];
  });
  assert.deepEqual(ends, ['enough', 'before', 'without progress']);
});

test('what cannot send headers takes a signed URL', async () => {
  const seen = await page.evaluate(async () => {
    const url = tweend.liveUrl(tank, { fps: 20, nodes: 'turret' });
    const refused = await new Promise((resolve) => (new EventSource(url).onerror = resolve)).then(() => true);
    const source = new EventSource(await tweend.sign(url, 60));
    const data = await new Promise((resolve) => (source.onmessage = (event) => resolve(event.data)));
    source.close();
    return { refused, pose: JSON.parse(data), now: Date.now() };
  });
  assert.ok(seen.refused);
  assert.equal(seen.pose.rotation.length, 1);
  assert.ok(Math.abs(seen.now - seen.pose.now) < 1000);
});

test('the fourth live stream is warned of, and closing streams frees their connections', async () => {
  const warnings = [];
  page.on('console', (message) => message.type() === 'warning' && warnings.push(message.text()));
  const play = () => page.evaluate(async () => {
    window.players ??= [];
    players.push(await tweend.live(tank, {}, { loop: 'repeat' }));
  });
  for (let i = 0; i < 3; i++) await play();
  assert.deepEqual(warnings, []);
  for (let i = 0; i < 3; i++) await play();
  assert.equal(warnings.length, 1);
  assert.match(warnings[0], /4 live streams/);
  const seventh = await page.evaluate(async () => {
    const soon = (ms) => AbortSignal.timeout(ms);
    const waits = await tweend.describe(tank, { signal: soon(1000) }).then(() => false, () => true);
    for (const player of players) player.close();
    return { waits, name: (await tweend.describe(tank)).name };
  });
  assert.deepEqual(seventh, { waits: true, name: 'tank' });
});

test('poses stream in as rows', async () => {
  const read = await page.evaluate(async () => {
    const options = { clip: 'drive', from: 0, fps: 1000 };
    const table = await tweend.poseTable(tank, options);
    let same = 0;
    for await (const row of await tweend.poseStream(tank, options)) same += row.every((value, i) => value === table.row(same)[i]);
    return { same, count: table.header.times.length };
  });
  assert.deepEqual(read, { same: 4001, count: 4001 });
});

test('a live player goes on where it was when the daemon comes again', async () => {
  const patient = { timeout: 60000 };
  const start = await page.evaluate(async () => {
    const [start, begun] = [Date.now(), performance.now()];
    window.hull = { position: { x: 0, y: 0, z: 0 }, quaternion: { x: 0, y: 0, z: 0, w: 1 }, scale: { x: 1, y: 1, z: 1 } };
    window.player = await tweend.live(tank, { hull }, { clip: 'drive', fps: 30, loop: 'repeat', start });
    window.shown = [];
    const show = (now) => {
      shown.push({ now, time: player.update(now) });
      requestAnimationFrame(show);
    };
    requestAnimationFrame(show);
    return begun;
  });
  await page.waitForFunction(() => player.time > 1, undefined, patient);
  await daemon.stop();
  await page.waitForTimeout(300);
  await daemon.start();
  await page.waitForFunction(() => player.time > 3, undefined, patient);
  await page.waitForFunction(() => player.time > 0.1 && player.time < 1, undefined, patient); // at 0 the hull is where it began
  const { shown, clock, z } = await page.evaluate(() => ({ shown, clock: player.serverTime - Date.now(), z: hull.position.z }));
  // Seconds from what is due, in the clip's four, to what is shown: time that passes adds to them, a step back would too.
  const behind = shown.map(({ now, time }) => ((now - start) / 1000 - time + 4) % 4);
  behind.slice(1).forEach((late, i) => {
    const passed = (shown[i + 1].now - shown[i].now) / 1000;
    assert.ok(late - behind[i] < passed + 0.02, `${shown[i + 1].time} after ${shown[i].time}, ${passed} s later`);
  });
  assert.ok(Math.min(...behind.slice(-30)) < 0.5, `${behind.slice(-30)}`);
  assert.ok(Math.abs(clock) < 300, `${clock} ms`);
  assert.notEqual(z, 0);
  await page.evaluate(() => (player.close(), player.done));
});

test('behind a prefix all goes through it', async () => {
  const seen = await page.evaluate(async (prefix) => {
    const { Tweend } = await import(`${prefix}/tweend.js`);
    const behind = new Tweend(undefined, { key: 'sesame' });
    const ids = [];
    for await (const { id } of behind.list({ limit: 1 })) ids.push(id);
    const url = await behind.sign(behind.surfaceUrl(tank, { level: 1 }, 'json'));
    const { faces } = await (await fetch(url)).json();
    return { base: behind.base, ids, url, faces, relative: new Tweend('some/where').base };
  }, PREFIX);
  assert.equal(seen.base, `${far}${PREFIX}/`);
  assert.ok(seen.url.startsWith(`${far}${PREFIX}/v1/models/`));
  assert.ok(seen.faces > 100);
  assert.equal(seen.ids.length, 1);
  assert.equal(seen.relative, `${far}/some/where/`);
});
