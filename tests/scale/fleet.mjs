// Three daemons on one store behind HAProxy with docker/haproxy.cfg: as processes on this machine, or as containers of
// docker/compose.scale.yaml. A fleet has `url`, which is HAProxy, and `replicas` with a `url` each.
import { execFile, spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtempSync, rmSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { promisify } from 'node:util';
import { Daemon, eventually, root } from '../node/daemon.mjs';

/** Heavy requests that may wait at one replica: more than the tests send at once. */
const QUEUE = '200';
/** HAProxy gives up an answer that does not begin in this time. */
const SERVER_TIMEOUT = '3s';
const COUNT = 3;
const haproxy = join(root, 'docker/haproxy.cfg');

const isReady = async (url) => (await fetch(`${url}/readyz`, { signal: AbortSignal.timeout(2000) }).catch(() => null))?.ok === true;

class Replica {
  constructor(daemon) {
    this.daemon = daemon;
  }
  get url() {
    return this.daemon.url;
  }
  start() {
    return this.daemon.start();
  }
  stop() {
    return this.daemon.stop();
  }
  async replace() {
    await this.stop();
    await this.start();
  }
  async kill() {
    this.daemon.process.kill('SIGKILL');
    await this.daemon.exit;
  }
  async freeze() {
    this.daemon.process.kill('SIGSTOP');
  }
  async thaw() {
    this.daemon.process.kill('SIGCONT');
  }
}

export class Processes {
  folder = mkdtempSync(join(tmpdir(), 'tweend-scale-'));
  replicas = Array.from({ length: COUNT }, () => new Replica(new Daemon(['--drain-delay', '2s', '--queue', QUEUE], this.folder)));

  async start() {
    await Promise.all(this.replicas.map((replica) => replica.start()));
    // HAProxy takes a socket that listens already, and so a port that the kernel gives.
    const socket = createServer().listen(0, '127.0.0.1');
    await once(socket, 'listening');
    const env = { ...process.env, TWEEND_BIND: 'fd@3', TWEEND_SERVER_TIMEOUT: SERVER_TIMEOUT };
    this.replicas.forEach(({ url }, i) => (env[`TWEEND_${i + 1}`] = new URL(url).host));
    this.front = spawn('haproxy', ['-db', '-q', '-f', haproxy], { env, stdio: ['ignore', 'ignore', 'inherit', socket._handle.fd] });
    this.url = `http://127.0.0.1:${socket.address().port}`;
    await once(this.front, 'spawn');
    socket.close();
    await eventually('HAProxy answers', 10, () => isReady(this.url));
  }

  async remove() {
    if (this.front?.kill()) await once(this.front, 'exit');
    for (const { daemon } of this.replicas) if (daemon.process?.exitCode === null && daemon.process.kill('SIGKILL')) await daemon.exit;
    rmSync(this.folder, { recursive: true });
  }
}

const run = promisify(execFile);

class Container {
  constructor(fleet, service) {
    Object.assign(this, { fleet, service });
  }
  /** The bridge leads to the container's address, which another may have had before. */
  async find() {
    this.id = await this.fleet.compose('ps', '--quiet', this.service);
    const format = '{{range .NetworkSettings.Networks}}{{.IPAddress}}{{end}}';
    const { stdout } = await run('docker', ['inspect', '--format', format, this.id]);
    this.url = `http://${stdout.trim()}:8080`;
    await eventually(`${this.service} is ready`, 30, () => isReady(this.url));
  }
  async start() {
    await run('docker', ['start', this.id]);
    await this.find();
  }
  async stop() {
    await run('docker', ['stop', '--time', '30', this.id]);
  }
  async replace() {
    await this.fleet.compose('up', '--detach', '--no-deps', '--force-recreate', this.service);
    await this.find();
  }
  kill() {
    return run('docker', ['kill', this.id]);
  }
  freeze() {
    return run('docker', ['pause', this.id]);
  }
  thaw() {
    return run('docker', ['unpause', this.id]);
  }
}

const [compose, ...composing] = (process.env.TESTED_COMPOSE ?? 'docker-compose').split(' ');

export class Containers {
  replicas = Array.from({ length: COUNT }, (_, i) => new Container(this, `tweend${i + 1}`));

  async compose(...args) {
    const options = [...composing, '--project-name', `tweend-scale-${process.pid}`, '--file', join(root, 'docker/compose.scale.yaml')];
    const env = { ...process.env, TWEEND_PORT: '', TWEEND_QUEUE: QUEUE, TWEEND_SERVER_TIMEOUT: SERVER_TIMEOUT };
    return (await run(compose, [...options, ...args], { env })).stdout.trim();
  }

  async start() {
    await this.compose('up', '--detach', '--no-build');
    await Promise.all(this.replicas.map((replica) => replica.find()));
    this.url = `http://${await this.compose('port', 'haproxy', '8080')}`;
    await eventually('HAProxy answers', 30, () => isReady(this.url));
  }

  remove() {
    return this.compose('down', '--volumes', '--timeout', '1');
  }
}
