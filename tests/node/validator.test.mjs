// The Khronos validator finds nothing to object to in any file that tweend writes.
import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { test } from 'node:test';

import validator from 'gltf-validator';

import { keptAnswers, writeSamples } from './samples.mjs';

const ERROR = 0;
const WARNING = 1;

async function objections(bytes) {
  const report = await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 1000 });
  return report.issues.messages
    .filter((message) => message.severity === ERROR || message.severity === WARNING)
    .map((message) => `${message.code} ${message.pointer ?? ''}: ${message.message}`);
}

test('the validator objects to a broken file', async () => {
  const { glb } = writeSamples().find((sample) => sample.name === 'cube');
  const broken = Buffer.from(glb);
  broken.writeUInt16LE(60000, broken.length - 4); // among the indices
  assert.match((await objections(broken)).join(), /ACCESSOR_INDEX_OOB/);
});

for (const sample of writeSamples()) {
  test(`${sample.name}.glb is valid`, async () => assert.deepEqual(await objections(sample.glb), []));
  test(`${sample.name}.gltf is valid`, async () => assert.deepEqual(await objections(sample.gltf), []));
}

if (process.env.TESTED_GLB_DIR && existsSync(process.env.TESTED_GLB_DIR)) {
  for (const answer of keptAnswers()) {
    test(`${answer.name} of the daemon is valid`, async () =>
      assert.deepEqual(await objections(answer.glb), []));
  }
}
