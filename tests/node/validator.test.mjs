// The Khronos validator finds nothing to object to in any file that tweend writes.
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { objections } from './objections.mjs';
import { writeSamples } from './samples.mjs';

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
