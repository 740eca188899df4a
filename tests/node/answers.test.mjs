// The Khronos validator finds nothing to object to in any GLB that the daemon answered to the end to end tests
// (tests/e2e/helper.bash keeps them).
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';

import { objections } from './objections.mjs';

const folder = process.env.TESTED_GLB_DIR ?? '';
const names = existsSync(folder) ? readdirSync(folder) : [];

/** Those of the same bytes once. */
const answers = new Map(
  names.map((name) => {
    const glb = readFileSync(join(folder, name));
    return [createHash('sha256').update(glb).digest('hex'), { name, glb }];
  }),
);

test('answers were kept', () => assert.ok(answers.size > 20, 'tests/run e2e fills TESTED_GLB_DIR'));
for (const { name, glb } of answers.values()) test(`${name} of the daemon is valid`, async () => assert.deepEqual(await objections(glb), []));
