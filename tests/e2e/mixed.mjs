// node mixed.mjs URL: clients that each do what comes, from a fixed seed: models come, go and are read, made
// into others and streamed, by clients that read slowly, ask again before they have read, or leave. No answer
// is broken, nobody waits until time is up, and at the end the daemon holds nothing for anybody.
import assert from 'node:assert/strict';
import http from 'node:http';
import net from 'node:net';
import { setTimeout as pause } from 'node:timers/promises';

const CLIENTS = 12, TURNS = 25;
const url = new URL(process.argv[2]);
const seen = new Map();
let seed = 1;

function below(count) {
  seed = (Math.imul(seed, 1103515245) + 12345) >>> 0;
  return Math.floor((seed / 2 ** 32) * count);
}
const one = (list) => list[below(list.length)];

function grid(cells) {
  const lines = [];
  const row = cells + 1;
  for (let i = 0; i < row * row; i++) lines.push(`v ${i % row} ${i % 7} ${Math.floor(i / row)}`);
  for (let i = 0; i < cells * cells; i++) {
    const a = i + Math.floor(i / cells) + 1;
    lines.push(`f ${a} ${a + row} ${a + row + 1} ${a + 1}`);
  }
  return lines.join('\n');
}

const turning = JSON.stringify({
  nodes: [{ name: 'n' }],
  clips: [{ name: 'c', tracks: [{ node: 'n', path: 'rotation', times: [0, 2], quaternions: [[0, 0, 0, 1], [1, 0, 0, 0]] }] }],
});
const bodies = [grid(4), grid(30), grid(90), turning];
const ids = [];

/** How the request ended: its status, 'left', or what is wrong with it. way: leave (after bytes), slow. */
function ask(method, path, body, { leave = Infinity, slow = 0, headers = {} } = {}) {
  return new Promise((resolve) => {
    const request = http.request(new URL(path, url), { method, agent: false, headers });
    const end = (outcome, text = '') => {
      const detail = outcome === 503 && text.startsWith('{') ? `: ${JSON.parse(text).detail}` : '';
      const key = `${method} ${path.replace(/[0-9a-f]{32}|\?.*/g, '')} ${outcome}${detail}`;
      seen.set(key, (seen.get(key) ?? 0) + 1);
      resolve(text);
    };
    request.on('response', (answer) => {
      const pieces = [];
      let size = 0;
      answer.on('data', (piece) => {
        size += piece.length;
        if (size < 1e6) pieces.push(piece);
        if (slow > 0) {
          answer.pause();
          setTimeout(() => answer.resume(), slow);
        }
        if (size > leave) {
          request.destroy();
          end('left');
        }
      });
      answer.on('error', () => end('left')); // by this client, or the case below
      answer.on('end', () => {
        const whole = method === 'HEAD' || !('content-length' in answer.headers) || Number(answer.headers['content-length']) === size;
        end(whole ? answer.statusCode : 'cut off', Buffer.concat(pieces).toString());
      });
    });
    request.on('error', () => end(leave < Infinity ? 'left' : 'no answer'));
    if (leave === 0) setTimeout(() => request.destroy(), below(40));
    request.end(body);
  });
}

/** Sends text as it is and leaves after a while, whatever has come. */
async function say(text) {
  const socket = net.connect(Number(url.port), url.hostname, () => socket.write(text));
  socket.on('error', () => {});
  socket.pause();
  await pause(below(300));
  socket.destroy();
}

const json = { 'Content-Type': 'application/json' };
const surface = () =>
  `surface.${one(['glb', 'gltf', 'obj', 'json'])}?level=${below(4)}&scheme=${one(['catmull-clark', 'bilinear'])}&boundary=${one(['edge-only', 'open'])}` +
  one(['', '&encoding=meshopt', '&normals=none', '&limit=true']);

async function upload(which, way) {
  const text = await ask('POST', '/v1/models', bodies[which], way);
  if (text.startsWith('{"id"')) ids[which] = JSON.parse(text).id;
}

const turns = [
  () => upload(below(bodies.length)),
  () => upload(below(3), { leave: 0 }),
  () => ask('POST', `/v1/${surface()}`, bodies[below(3)]),
  () => ask('POST', `/v1/${surface()}`, bodies[below(3)], { leave: 0 }),
  (model) => ask('GET', `${model}/${surface()}`),
  (model) => ask('GET', `${model}/${surface()}`, '', { leave: 0 }),
  (model) => ask('GET', `${model}/surface.glb?level=4`, '', { leave: below(1e6) }),
  (model) => ask('GET', `${model}/surface.glb?level=3`, '', { slow: 5 }),
  (model) => ask('GET', `${model}/surface.glb?level=2`, '', { headers: { Range: `bytes=${below(5000)}-` } }),
  (model) => ask('HEAD', `${model}/${surface()}`),
  (model) => ask('GET', `${model}/source`),
  (model) => ask('GET', model),
  (model) => ask('DELETE', model),
  (model) => ask('POST', `${model}/edits`, JSON.stringify({ edits: [{ edit: 'subdivide', faces: 'all', cuts: 1 }] }), { headers: json }),
  (model) => ask('POST', `${model}/coarsen`),
  (model) => say(`GET ${model}/surface.glb?level=3 HTTP/1.1\r\nHost: localhost\r\n\r\n`.repeat(3)),
  () => ask('GET', `/v1/models/${ids[3]}/pose.${one(['json', 'bin'])}?from=0&to=2&fps=${one([30, 3000])}`),
  () => ask('GET', `/v1/models/${ids[3]}/live?loop=repeat&fps=60`, '', { leave: below(3000) }),
  () => ask('POST', '/v1/pose?at=0,1', turning, { headers: json }),
  () => ask('GET', '/v1/models'),
  () => say('POST /v1/models HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nv 1 2'),
];

async function client() {
  for (let turn = 0; turn < TURNS; turn++) await one(turns)(`/v1/models/${ids[below(3)]}`);
}

/** What it holds for requests. */
async function held() {
  const text = await (await fetch(new URL('/metrics', url), { headers: { Connection: 'close' } })).text();
  const names = /^tweend_(spool_bytes|compute_threads_busy|jobs_waiting|live_listeners|live_channels|memory_bytes\{kind="(body|block|request)"\}) (\d+)$/;
  const kept = text.split('\n').filter((line) => Number(line.match(names)?.[3] ?? 0) > 0);
  if (!/^tweend_http_requests_in_flight 1$/m.test(text)) kept.push('requests in flight');
  return kept;
}

for (let i = 0; i < bodies.length; i++) await upload(i);
await Promise.all(Array.from({ length: CLIENTS }, client));
console.log([...seen].sort().map(([what, count]) => `${count} ${what}`).join('\n'));
for (const what of seen.keys()) assert.match(what, / (200|201|204|206|404|416|422|left|503(: (?!the request waited).*)?)$/, what);
let kept = ['not asked'];
for (let tries = 0; tries < 600 && kept.length > 0; tries++) {
  await pause(50);
  kept = await held();
}
assert.deepEqual(kept, []);
