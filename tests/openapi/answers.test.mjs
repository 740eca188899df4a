// What the end to end tests asked and got (tests/e2e/helper.bash keeps it) is documented: status, type, fields, JSON body.
import assert from 'node:assert/strict';
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { fault, find, strayFields } from './document.mjs';

const folder = process.env.TESTED_TRAFFIC_DIR ?? '';
const names = existsSync(folder) ? readdirSync(folder) : [];

// Where there is no such path or method: that, or what keeps somebody from asking at all.
const elsewhere = [401, 403, 404, 405, 421, 429, 503];

/** One answer: the request's line, heads (those of 100 Continue first), the body of JSON. */
function read(name) {
  const text = readFileSync(join(folder, name), 'utf8');
  const [, method, target, rest] = text.match(/^(\S+) (.*?)\n(.*)$/s);
  const [, head, body] = rest.match(/^(?:HTTP\/1.1 1\d\d.*?\r\n\r\n)*(HTTP.*?\r\n\r\n)(.*)$/s);
  const field = (key) => head.match(new RegExp(`^${key}: *(.*?)\r$`, 'im'))?.[1];
  const fields = Array.from(head.matchAll(/^([^:\s]+):/gm), ([, key]) => key.toLowerCase());
  return { method, target, status: Number(head.match(/^HTTP\S+ (\d+)/)[1]), type: field('content-type'), fields, body };
}

test('answers of the end to end tests are documented', () => {
  assert.ok(names.length > 100, 'tests/run e2e fills TESTED_TRAFFIC_DIR');
  const wrong = [];
  for (const name of names) {
    const { method, target, status, type, fields, body } = read(name);
    if (method === 'OPTIONS' && status === 204) continue;
    if (status === 404 && body.includes('this listener has')) continue; // that of --admin-listen is another server
    const asked = find(method, target);
    const said = asked ? fault(asked, status, type, method === 'HEAD' ? '' : body) : elsewhere.includes(status) ? null : `${status} of no operation`;
    if (said) wrong.push(`${name}: ${method} ${target}: ${said}`);
    const stray = asked && !said ? strayFields(asked, status, fields) : [];
    if (stray.length > 0) wrong.push(`${name}: ${method} ${target}: ${status} documents no ${stray.join(', ')}`);
  }
  assert.deepEqual(wrong, []);
});
