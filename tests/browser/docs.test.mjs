// The API reference at /docs, and the example: without errors, and nothing asked of hosts that they need not ask.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { Daemon, root } from '../node/daemon.mjs';
import { launch, PATIENCE_MS } from './chromium.mjs';
import { coloursOf, covered, difference, Visit } from './page_driver.mjs';

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const { paths } = JSON.parse(readFileSync(join(root, 'api/openapi.json')));
const daemon = new Daemon();
let browser;
let reference, dark; // the reference is drawn twice: each time takes seconds

const open = async (hash, options) => {
  const visit = await Visit.begin(browser, `${daemon.url}/docs`, { hash, ...options });
  await visit.page.locator('.opblock').first().waitFor();
  return visit;
};

before(async () => {
  await daemon.start();
  browser = await launch();
  reference = await open('');
});
after(async () => {
  await browser?.close();
  await daemon.remove();
});

test('the reference has every operation of openapi.json', async () => {
  const shown = await reference.page.locator('.opblock-summary').evaluateAll((all) =>
    all.map((one) => `${one.querySelector('.opblock-summary-method').textContent} ${one.querySelector('[data-path]').dataset.path}`));
  const documented = Object.entries(paths).flatMap(([path, item]) =>
    ['get', 'post', 'delete'].filter((method) => item[method]).map((method) => `${method.toUpperCase()} ${path}`));
  assert.deepEqual(shown.sort(), documented.sort());
});

test('its link leads to the layout of pose.bin, and so does its address', async () => {
  const assertShown = async (visit) => {
    await visit.page.locator('#operations-poses-getPose .renderedMarkdown code', { hasText: 'TWPB' }).waitFor();
    await visit.wait(() => {
      const { top } = document.getElementById('operations-poses-getPose').getBoundingClientRect();
      return top >= -1 && top < innerHeight;
    });
  };
  await reference.page.getByRole('link', { name: 'The layout of pose.bin' }).click();
  await assertShown(reference);
  dark = await open(new URL(reference.page.url()).hash, { colorScheme: 'dark' });
  await assertShown(dark);
});

// What Swagger UI itself does: roles of the rows that open, headings of its own levels, fields and lists without names.
const OF_THE_LIBRARY = ['heading-order', 'label', 'nested-interactive', 'region', 'scrollable-region-focusable', 'select-name'];

for (const [name, visitOf, rules] of [['light', () => reference, null], ['dark', () => dark, ['color-contrast']]]) // in the dark colours alone are others
  test(`axe finds nothing to mend but in the library, ${name}`, async () => {
    const visit = visitOf();
    await visit.page.locator('#operations-poses-getPose .response').first().waitFor();
    await visit.page.waitForTimeout(500); // colours fade in
    await visit.page.evaluate(axe);
    const { violations } = await visit.page.evaluate((only) => axe.run(only ? { runOnly: only } : {}), rules);
    const found = violations.filter(({ id }) => !OF_THE_LIBRARY.includes(id));
    assert.deepEqual(found.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(' ')}`), []);
    await visit.picture(`docs ${name}`);
  });

test('requests that are tried go to the daemon', async () => {
  const operation = reference.page.locator('#operations-operations-getVersion');
  await operation.locator('.opblock-summary-control').click();
  await operation.getByRole('button', { name: 'Try it out' }).click();
  await operation.getByRole('button', { name: 'Execute' }).click();
  await operation.locator('.live-responses-table', { hasText: '"name": "tweend"' }).waitFor();
});

test('the reference logs no errors, and asks nobody else', async () => {
  await reference.end();
  await dark.end();
});

const THREE = /^https:\/\/cdn\.jsdelivr\.net\/npm\/three@([\d.]+)\/(.*)/;
const three = fileURLToPath(new URL('./node_modules/three/', import.meta.url));

/** The example, for which the network has three.js or nothing. */
async function openExample(isOnline) {
  const { version } = JSON.parse(readFileSync(`${three}package.json`));
  const errors = [];
  const page = await browser.newPage({ viewport: { width: 160, height: 120 } });
  page.on('pageerror', (error) => errors.push(String(error)));
  page.on('console', (message) => isOnline && message.type() === 'error' && errors.push(message.text()));
  await page.route(/^https?:\/\/(?!127\.0\.0\.1:)/, (route) => {
    const [, wanted, path] = route.request().url().match(THREE) ?? [];
    if (wanted !== version) errors.push(`asks ${route.request().url()}`);
    if (!isOnline) return route.abort();
    const headers = { 'Access-Control-Allow-Origin': '*' };
    return route.fulfill({ contentType: 'text/javascript', headers, body: readFileSync(three + path) });
  });
  await page.goto(`${daemon.url}/example.html`);
  return { page, errors };
}

test('the example shows a model that turns', async () => {
  const { page, errors } = await openExample(true);
  const pixels = async () => coloursOf(await page.screenshot());
  await page.waitForSelector('canvas', { timeout: PATIENCE_MS });
  let seen = await pixels();
  for (const until = performance.now() + PATIENCE_MS; covered(seen) < 0.05 && performance.now() < until; ) seen = await pixels();
  assert.ok(covered(seen) > 0.05, `covers ${covered(seen)}`);
  let later = seen;
  for (const until = performance.now() + PATIENCE_MS; difference(seen, later) < 0.02 && performance.now() < until; ) later = await pixels();
  assert.ok(difference(seen, later) > 0.02, 'it turns');
  const lightness = (p) => p.reduce((sum, value, i) => (i % 4 < 3 ? Math.max(sum, value) : sum), 0);
  assert.ok(lightness(seen) > 120, 'it is lit');
  await page.screenshot({ path: join(root, 'build/screenshots/example.png') });
  assert.deepEqual(errors, []);
  await page.close();
});

test('without three.js the example says so', async () => {
  const { page, errors } = await openExample(false);
  await page.getByText('cannot be loaded').waitFor({ timeout: PATIENCE_MS });
  assert.deepEqual(errors, []);
  await page.close();
});
