// openapi.json by the recommended rules of two linters, warnings included.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { createConfig, lint } from '@redocly/openapi-core';
import spectral from '@stoplight/spectral-core';
import rulesets from '@stoplight/spectral-rulesets';
import { document, file } from './document.mjs';

test('redocly has nothing to say', async () => {
  const config = await createConfig({ extends: ['recommended'] });
  const found = await lint({ ref: file, config });
  assert.deepEqual(found.map(({ ruleId, message, location }) => `${location[0].pointer}: ${message} (${ruleId})`), []);
});

test('spectral has nothing to say', async () => {
  const linter = new spectral.Spectral();
  linter.setRuleset({ extends: [[rulesets.oas, 'recommended']] });
  const found = await linter.run(structuredClone(document));
  assert.deepEqual(found.map(({ code, message, path }) => `${path.join('/')}: ${message} (${code})`), []);
});
