// A client that openapi-typescript makes of openapi.json compiles in strict mode, refuses what the document does not
// have, and runs against the daemon.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import openapiTS, { astToString } from 'openapi-typescript';
import { Daemon } from '../node/daemon.mjs';
import { document } from './document.mjs';

const at = (name) => fileURLToPath(new URL(name, import.meta.url));

// What somebody gets wrong in client.ts, and what of it the compiler must refuse.
const slips = {
  path: ["'/v1/models/{id}/surface.json'", "'/v1/models/{id}/surface.jsn'"],
  value: ["'edge-only'", "'edges'"],
  answer: ['counts.data?.faces', 'counts.data?.triangles'],
  body: ['{ times: [0, 2] }', '{ times: ["0"] }'],
};

const config = {
  compilerOptions: {
    strict: true,
    noUncheckedIndexedAccess: true,
    exactOptionalPropertyTypes: true,
    skipLibCheck: true,
    target: 'es2022',
    module: 'nodenext',
    lib: ['es2022', 'dom'],
    types: [],
    outDir: 'built',
  },
  include: ['*.ts'],
};

let errors;

/** The types that openapi-typescript makes of the document. */
const typesOf = async (options) => astToString(await openapiTS(structuredClone(document), options));

before(async () => {
  rmSync(at('generated'), { recursive: true, force: true });
  mkdirSync(at('generated'));
  const put = (name, text) => writeFileSync(at(`generated/${name}`), text);
  put('api.d.ts', await typesOf());
  put('tsconfig.json', JSON.stringify(config));
  const text = readFileSync(at('client.ts'), 'utf8');
  put('client.ts', text);
  for (const [name, [right, wrong]] of Object.entries(slips)) {
    assert.ok(text.includes(right), right);
    put(`${name}.ts`, text.replace(right, wrong));
  }
  const tsc = [at('node_modules/typescript/lib/tsc.js'), '-p', at('generated'), '--pretty', 'false'];
  errors = spawnSync(process.execPath, tsc, { encoding: 'utf8', cwd: at('generated') }).stdout;
});
after(() => rmSync(at('generated'), { recursive: true }));

test('the client compiles', () => assert.doesNotMatch(errors, /^(client|api\.d)\.ts|^error/m));

// By default the generator makes what has a `default` required, which is right for answers and wrong for requests. So
// descriptions tell the defaults of request bodies.
test('no default makes a member required', async () =>
  assert.equal(await typesOf(), await typesOf({ defaultNonNullable: false })));

for (const name of Object.keys(slips))
  test(`the compiler refuses a wrong ${name}`, () => assert.match(errors, new RegExp(`^${name}\\.ts\\(`, 'm')));

test('the client runs', async () => {
  const daemon = new Daemon();
  await daemon.start();
  try {
    execFileSync(process.execPath, [at('generated/built/client.js'), daemon.url]);
  } finally {
    await daemon.remove();
  }
});
