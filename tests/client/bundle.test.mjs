// The module's size, and bundles of it that esbuild and rollup make, at work.
import assert from 'node:assert/strict';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { gzipSync } from 'node:zlib';

import esbuild from 'esbuild';
import { rollup } from 'rollup';

import { Daemon, root } from '../node/daemon.mjs';

const daemon = new Daemon();
const folder = mkdtempSync(join(tmpdir(), 'tweend-bundle-'));
const module = join(root, 'api/client/tweend.js');
const entry = join(folder, 'entry.js');

before(async () => {
  await daemon.start();
  writeFileSync(
    entry,
    `import { Tweend, TweendError } from ${JSON.stringify(module)};
    export async function faces(url, model) {
      const tweend = new Tweend(url);
      await tweend.describe('none').catch((error) => { if (!(error instanceof TweendError)) throw error; });
      return (await tweend.surfaceCounts(await tweend.upload(model), { level: 1 })).faces;
    }`,
  );
});

after(async () => {
  await daemon.remove();
  rmSync(folder, { recursive: true });
});

async function assertWorks(bundle) {
  const { faces } = await import(pathToFileURL(bundle));
  assert.equal(await faces(daemon.url, readFileSync(join(root, 'server/samples/cube.obj'), 'utf8')), 24);
}

test('the module has no dependency and under 12 KB compressed', async () => {
  const text = readFileSync(module);
  assert.doesNotMatch(String(text), /^import |\bimport\(|require\(/m);
  const size = gzipSync(text).length;
  console.log(`${size} bytes`);
  assert.ok(size < 12000, `${size} bytes`);
  const answer = await fetch(`${daemon.url}/tweend.js`);
  assert.ok(Number(answer.headers.get('Content-Length')) < 12000);
  assert.deepEqual(Buffer.from(await answer.arrayBuffer()), text);
});

test('a bundle of esbuild works', async () => {
  const outfile = join(folder, 'esbuild.mjs');
  const { errors, warnings } = await esbuild.build({ entryPoints: [entry], bundle: true, minify: true, format: 'esm', target: 'es2022', outfile });
  assert.deepEqual([...errors, ...warnings], []);
  await assertWorks(outfile);
});

test('a bundle of rollup works', async () => {
  const warnings = [];
  const bundle = await rollup({ input: entry, onwarn: (warning) => warnings.push(warning.message) });
  const file = join(folder, 'rollup.mjs');
  await bundle.write({ file, format: 'es' });
  await bundle.close();
  assert.deepEqual(warnings, []);
  await assertWorks(file);
});
