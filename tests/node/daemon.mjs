// The daemon of a test: on a port and in a folder that last over a restart.
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { createInterface } from 'node:readline';
import { setTimeout as pause } from 'node:timers/promises';
import { fileURLToPath } from 'node:url';

export const root = join(dirname(fileURLToPath(import.meta.url)), '../..');

/** Waits until something holds; throws what was waited for when it does not come about. */
export async function eventually(what, seconds, holds) {
  const end = Date.now() + seconds * 1000;
  while (!(await holds())) {
    if (Date.now() > end) throw new Error(`not within ${seconds} s: ${what}`);
    await pause(20);
  }
}

export class Daemon {
  listen = '127.0.0.1:0';
  /** What runs the daemon, as a command in front of it, and variables of its own. */
  runner = [];
  env = {};

  /** flags: besides those that every test needs. folder: where the models are, its own unless others share it. */
  constructor(flags = [], folder = mkdtempSync(join(tmpdir(), 'tweend-test-'))) {
    this.flags = flags;
    this.folder = folder;
  }

  async start() {
    const binary = process.env.TESTED_BINARY ?? join(root, 'build/tweend');
    // A test that computes for long leaves its connections idle; the next request may not find them closed.
    const flags = ['--listen', this.listen, '--data', join(this.folder, 'data'), '--log-level', 'warn', '--idle-timeout', '1h', ...this.flags];
    const [command, ...rest] = [...this.runner, binary, ...flags];
    this.process = spawn(command, rest, { stdio: ['ignore', 'pipe', 'inherit'], env: { ...process.env, ...this.env } });
    this.exit = once(this.process, 'exit');
    const ready = once(createInterface(this.process.stdout), 'line');
    const [line] = await Promise.race([ready, this.exit.then(([code]) => [`it ended with ${code}`])]);
    if (typeof line !== 'string' || !line.includes(' listening on http')) throw new Error(`no ready line: ${line}`);
    this.url = line.slice(line.indexOf('http'));
    this.listen = this.url.slice('http://'.length);
  }

  /** Ends it as an operator would; it must do so without complaint. */
  async stop() {
    this.process.kill('SIGTERM');
    const [code] = await this.exit;
    if (code !== 0) throw new Error(`the daemon ended with ${code}`);
  }

  /** Stops it if it runs, and forgets its models. */
  async remove() {
    try {
      if (this.url) await this.stop();
    } finally {
      rmSync(this.folder, { recursive: true });
    }
  }

  /** Stores bytes and returns the model's address. */
  async upload(bytes) {
    const headers = { 'Content-Type': 'application/octet-stream' }; // the bytes decide
    const answer = await fetch(`${this.url}/v1/models`, { method: 'POST', headers, body: bytes });
    const { id, detail } = await answer.json();
    if (!id) throw new Error(detail);
    return `${this.url}/v1/models/${id}`;
  }
}
