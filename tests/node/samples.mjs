// Files of every kind that libtweend writes, made anew for each run.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const build = process.env.TESTED_BINARY ? dirname(process.env.TESTED_BINARY) : join(here, '../../build');

/** [{name, glb, gltf: bytes, facts: what the library says is in them}] */
export function writeSamples() {
  const folder = mkdtempSync(join(tmpdir(), 'tweend-samples-'));
  try {
    execFileSync(join(build, 'tests/write_samples'), [folder]);
    return readdirSync(folder)
      .filter((file) => file.endsWith('.glb'))
      .map((file) => {
        const name = basename(file, '.glb');
        const read = (suffix) => readFileSync(join(folder, name + suffix));
        return { name, glb: read('.glb'), gltf: read('.gltf'), facts: JSON.parse(read('.json')) };
      });
  } finally {
    rmSync(folder, { recursive: true });
  }
}
