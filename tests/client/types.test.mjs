// The types: those of requests and answers are what openapi.json says, and users' programs compile.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';

import * as module from '../../api/client/tweend.js';
import { declarations } from './types.mjs';

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const types = readFileSync(here('../../api/client/tweend.d.ts'), 'utf8');

test('the types of requests and answers are those of openapi.json', async () => {
  assert.equal(types, await declarations(), 'node tests/client/types.mjs writes them anew');
});

test('a program that uses the types compiles in strict mode', () => {
  const options = ['--strict', '--noEmit', '--exactOptionalPropertyTypes', '--target', 'es2022', '--module', 'esnext', '--moduleResolution', 'bundler'];
  execFileSync(process.execPath, [here('node_modules/typescript/bin/tsc'), ...options, here('usage.ts')], { stdio: 'inherit' });
});

test('what is declared is what is there', () => {
  const declared = [...types.matchAll(/^export class (\w+)(.*?)^}/gms)];
  assert.deepEqual(declared.map(([, name]) => name).sort(), Object.keys(module).sort());
  for (const [, name, body] of declared) {
    const methods = [...body.matchAll(/^ {2}(\w+)\(/gm)].map(([, method]) => method).concat('constructor');
    const present = Object.entries(Object.getOwnPropertyDescriptors(module[name].prototype))
      .filter(([, { value }]) => typeof value === 'function')
      .map(([method]) => method);
    assert.deepEqual([...new Set(methods)].sort(), present.sort(), name);
  }
});
