// Prints requests a second and latencies of small answers, compared with nginx, which sends the same bytes from files;
// the same with 10,000 idle connections; how the daemon fares under slowhttptest's attacks and under twice the work
// that it can do; and its memory over millions of requests. All over loopback, in bounded time.
// usage: node tests/bench/load.mjs BUILD-FOLDER [small|idle|attacks|overload|soak=MILLIONS]...    default: all, 10 million
import { execFileSync, spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { connect } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { setTimeout as pause } from 'node:timers/promises';
import { Daemon } from '../node/daemon.mjs';

const [build = 'build-bench', ...wanted] = process.argv.slice(2);
const IDLE = 10000;
const SECONDS = 4;
process.env.TESTED_BINARY = join(build, 'tweend');

const folder = mkdtempSync(join(tmpdir(), 'tweend-load-'));
const daemon = new Daemon(['--sample', '--max-connections', `${IDLE + 1000}`, '--idle-timeout', '600s', '--header-timeout', '20s']);
let failed = false;

/** Prints whether a statement holds; if not, the benchmark fails. */
function expect(holds, text) {
  console.log(`${holds ? 'holds' : 'DOES NOT HOLD'}: ${text}`);
  failed ||= !holds;
}

// ---- wrk ---------------------------------------------------------------------------------------

const ms = (text) => parseFloat(text) * { us: 1e-3, ms: 1, s: 1e3, m: 6e4 }[text.match(/[a-z]+/)[0]];

function run(command, args) {
  return new Promise((resolve) => {
    const child = spawn(command, args, { stdio: ['ignore', 'pipe', 'pipe'] });
    let text = '';
    for (const stream of [child.stdout, child.stderr]) stream.on('data', (bytes) => (text += bytes));
    child.on('close', () => resolve(text));
  });
}

/** Loads a URL over `connections`. Returns requests a second, the 50th and 99th percentile in ms, and how many answers
 *  were not 2xx. */
async function load(url, connections, seconds = SECONDS, script = null) {
  const args = ['-t1', `-c${connections}`, `-d${seconds}s`, '--latency', ...(script ? ['-s', script] : []), url];
  const text = await run('wrk', args);
  const found = (pattern) => text.match(pattern)?.[1];
  return {
    rate: Number(found(/Requests\/sec:\s+(\S+)/)),
    p50: ms(found(/^\s+50%\s+(\S+)/m)),
    p99: ms(found(/^\s+99%\s+(\S+)/m)),
    refused: Number(found(/Non-2xx or 3xx responses: (\d+)/) ?? 0),
    broken: Number(found(/Socket errors: .* read (\d+)/) ?? 0),
  };
}

const columns = (...cells) => console.log(cells.map((cell, i) => `${cell}`.padStart(i === 0 ? 0 : 12).padEnd(i === 0 ? 26 : 12)).join(' '));
const whole = (number) => Math.round(number).toLocaleString('en');

// ---- nginx -------------------------------------------------------------------------------------

let nginx;

/** Starts nginx, which serves the bodies of the daemon's answers from files. */
async function startNginx(bodies) {
  mkdirSync(join(folder, 'www'));
  for (const [name, bytes] of Object.entries(bodies)) writeFileSync(join(folder, 'www', name), bytes);
  const socket = await import('node:net').then(({ createServer }) => new Promise((resolve) => {
    const server = createServer().listen(0, '127.0.0.1', () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  }));
  const temporary = ['client_body', 'proxy', 'fastcgi', 'uwsgi', 'scgi'].map((kind) => `${kind}_temp_path ${folder}/${kind};`).join(' ');
  writeFileSync(
    join(folder, 'nginx.conf'),
    `worker_processes auto; pid ${folder}/pid; error_log ${folder}/error.log; daemon off; user root;
     events { worker_connections 20000; }
     http { ${temporary} access_log off; sendfile on; tcp_nopush on; keepalive_requests 1000000000; open_file_cache max=100;
       server { listen 127.0.0.1:${socket}; root ${folder}/www; } }`,
  );
  nginx = spawn('nginx', ['-c', join(folder, 'nginx.conf')], { stdio: 'inherit' });
  await pause(500);
  return `http://127.0.0.1:${socket}`;
}

// ---- the parts ---------------------------------------------------------------------------------

async function small(paths) {
  const bodies = {};
  for (const [name, path] of Object.entries(paths))
    bodies[name] = Buffer.from(await (await fetch(daemon.url + path)).arrayBuffer());
  const peer = await startNginx(bodies);
  columns('answer, connections', 'bytes', 'requests/s', 'p50 ms', 'p99 ms', 'nginx req/s', 'p99 ms');
  for (const [name, path] of Object.entries(paths)) {
    for (const connections of [1, 16, 256]) {
      const own = await load(daemon.url + path, connections);
      const its = await load(`${peer}/${name}`, connections);
      columns(`${name}, ${connections}`, whole(bodies[name].length), whole(own.rate), own.p50.toFixed(2), own.p99.toFixed(2), whole(its.rate), its.p99.toFixed(2));
      failed ||= own.refused + own.broken > 0;
    }
  }
}

async function idle(path) {
  const port = new URL(daemon.url).port;
  const sockets = [];
  for (let i = 0; i < IDLE; i += 500) {
    const some = Array.from({ length: 500 }, () => new Promise((resolve, reject) => {
      const socket = connect(port, '127.0.0.1', () => {
        socket.write('GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n');
        socket.once('data', () => resolve(socket));
      });
      socket.on('error', reject);
    }));
    sockets.push(...(await Promise.all(some)));
  }
  const held = await load(daemon.url + path, 16);
  columns(`with ${whole(IDLE)} idle ones`, '', whole(held.rate), held.p50.toFixed(2), held.p99.toFixed(2));
  expect(sockets.every((socket) => !socket.destroyed), `${whole(IDLE)} idle connections are still open`);
  for (const socket of sockets) socket.destroy();
}

/** Sends health checks a few times a second until the returned function is called; that returns the slowest in ms, and
 *  how many failed. */
function watch() {
  let slowest = 0;
  let failures = 0;
  let going = true;
  const loop = (async () => {
    while (going) {
      const begin = performance.now();
      try {
        const answer = await fetch(`${daemon.url}/healthz`, { signal: AbortSignal.timeout(5000) });
        if (!answer.ok) failures++;
        await answer.arrayBuffer();
      } catch {
        failures++;
      }
      slowest = Math.max(slowest, performance.now() - begin);
      await pause(200);
    }
  })();
  return async () => {
    going = false;
    await loop;
    return { slowest, failures };
  };
}

async function attacks(large) {
  const attack = { headers: ['-H'], bodies: ['-B', '-s', '8192'], reading: ['-X', '-w', '512', '-y', '1024', '-n', '5', '-z', '32'] };
  for (const [name, args] of Object.entries(attack)) {
    const stop = watch();
    const url = name === 'headers' ? `${daemon.url}/healthz` : name === 'bodies' ? `${daemon.url}/v1/models` : daemon.url + large;
    const text = await run('slowhttptest', [...args, '-c', '1000', '-r', '200', '-i', '2', '-l', '20', '-p', '3', '-t', name === 'bodies' ? 'POST' : 'GET', '-u', url]);
    const { slowest, failures } = await stop();
    const plain = text.replaceAll(/\x1b\[[0-9;]*m/g, '');
    const last = (name) => [...plain.matchAll(new RegExp(`${name}:\\s+(\\S+)`, 'g'))].pop()?.[1];
    console.log(`slow ${name}: ${last('connected')} of 1,000 connections open at the end, ${last('closed')} closed; health checks took at most ${slowest.toFixed(0)} ms`);
    expect(!plain.match(/service available:\s+NO/), `slowhttptest finds the service available during slow ${name}`);
    expect(failures === 0, `health checks were answered during slow ${name}`);
  }
}

/** Requests twice as many different surfaces at once as the daemon admits, while small requests are timed. */
async function overload(heavy, light) {
  const script = join(folder, 'heavy.lua');
  writeFileSync(script, `n = 0 request = function() n = n + 1 return wrk.format("GET", "${heavy}&at=" .. n / 1000) end`);
  const threads = Number(execFileSync('nproc'));
  const pressing = load(daemon.url, 2 * (threads + 4 * threads), 3 * SECONDS, script);
  await pause(1000);
  const served = await load(daemon.url + light, 16, 2 * SECONDS);
  const pressed = await pressing;
  console.log(`heavy: ${pressed.rate.toFixed(0)} answers a second, ${pressed.refused} of them refused`);
  columns('small ones beside them', '', whole(served.rate), served.p50.toFixed(2), served.p99.toFixed(2));
  expect(served.refused === 0 && served.p99 < 100, `accepted small requests take ${served.p99.toFixed(1)} ms in 99 of 100 cases`);
}

const resident = () => Number(readFileSync(`/proc/${daemon.process.pid}/status`, 'utf8').match(/VmRSS:\s+(\d+)/)[1]) / 1024;

/** Sends requests of all kinds, small ones more often. */
async function soak(model, wanted) {
  const script = join(folder, 'mixed.lua');
  const post = 'wrk.format("POST", "/v1/pose.json?at=0", {["Content-Type"]="application/json"}, body)';
  writeFileSync(
    script,
    `n = 0 body = '{"nodes":[{"name":"a"}],"clips":[{"name":"c","tracks":[{"node":"a","path":"rotation","times":[0],"quaternions":[[0,0,0,1]]}]}]}'
     small = {"/healthz", "${model}/pose.json?at=", "/version", "${model}/pose.bin?at=", "${model}/nothing", "${model}/pose.json?at=x"}
     large = {"/v1/models?limit=10", "${model}", "${model}/surface.json?level=2", "${model}/surface.obj?level=0", "${model}/tracks", "/metrics"}
     request = function()
       n = n + 1
       if n % 50 == 0 then return ${post} end
       local path = n % 10 == 5 and large[math.floor(n / 10) % #large + 1] or small[n % #small + 1]
       if path:sub(-1) == "=" then path = path .. n % 1000 / 100 end
       return wrk.format("GET", path)
     end`,
  );
  const begin = performance.now();
  let sent = 0;
  let first;
  while (sent < wanted * 1e6 && performance.now() - begin < 3600e3) {
    const { rate } = await load(daemon.url, 32, 20, script);
    sent += rate * 20;
    first ??= resident();
    if (performance.now() - begin < 60e3) first = Math.max(first, resident());
  }
  const seconds = ((performance.now() - begin) / 1000).toFixed(0);
  console.log(`${whole(sent)} requests of thirteen kinds in ${seconds} s: ${first.toFixed(1)} MB in the first minute, ${resident().toFixed(1)} at the end`);
  expect(resident() <= first * 1.1 + 2, 'memory is that of the first minute');
}

try {
  await daemon.start();
  const { models } = await (await fetch(`${daemon.url}/v1/models`)).json();
  const model = `/v1/models/${models.find(({ name }) => name.startsWith('tank')).id}`;
  const parts = {
    small: () => small({ healthz: '/healthz', 'pose.json': `${model}/pose.json?at=0.5`, 'surface.glb': `${model}/surface.glb?level=1` }),
    idle: () => idle('/healthz'),
    attacks: () => attacks(`${model}/surface.glb?level=6`),
    overload: () => overload(`${model}/surface.glb?level=4`, '/healthz'),
    soak: (millions = 10) => soak(model, Number(millions)),
  };
  for (const part of wanted.length > 0 ? wanted : Object.keys(parts)) {
    const [name, value] = part.split('=');
    await parts[name](value);
  }
} finally {
  nginx?.kill('SIGTERM');
  await daemon.remove();
  rmSync(folder, { recursive: true });
}
process.exitCode = failed ? 1 : 0;
