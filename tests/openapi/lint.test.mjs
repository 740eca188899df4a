// openapi.json by the linter's recommended rules, warnings included, and by its rules for examples.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { createConfig, lint } from '@redocly/openapi-core';
import { file } from './document.mjs';

const rules = {
  'no-invalid-parameter-examples': 'error', 'no-invalid-schema-examples': 'error', 'no-enum-type-mismatch': 'error',
  'no-unused-components': 'error', 'tag-description': 'error',
};

test('redocly has nothing to say', async () => {
  const config = await createConfig({ extends: ['recommended'], rules });
  const found = await lint({ ref: file, config });
  assert.deepEqual(found.map(({ ruleId, message, location }) => `${location[0].pointer}: ${message} (${ruleId})`), []);
});
