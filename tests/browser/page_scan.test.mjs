// The page at /: a scan is made clean, and seen beside what it was.
import assert from 'node:assert/strict';

import { Modeller } from './modeller.mjs';
import { ALL_PIXELS, covered, difference, open, PHONE, UNDRAWN, Visit } from './page_driver.mjs';
import { scan } from './scan.mjs';

const site = open({ first: 'cube.obj' });
const { daemon, visits } = site;
const hash = '#tab=edit&show=surface';

const described = async (id) => (await (await fetch(`${daemon.url}/v1/models/${id}`)).json()).meshes[0];

const table = (visit) => visit.page.locator('#panel-edit table tbody tr').evaluateAll((rows) =>
  Object.fromEntries(rows.map(({ cells: [name, ...values] }) => [name.innerText, values.map((cell) => cell.innerText)])));

/** The part of the picture left of its middle, or right of it. */
function half(pixels, width, isRight) {
  const rows = [];
  for (let i = 0; i < pixels.length; i += width * 4) rows.push(pixels.subarray(i + (isRight ? width * 2 : 0), i + width * (isRight ? 4 : 2)));
  return Buffer.concat(rows);
}

async function openScan(visit) {
  await visit.level(2);
  const modeller = new Modeller(visit);
  await modeller.drop('scan.obj', scan());
  return modeller;
}

const sideBySide = (visit) => visit.page.getByRole('slider', { name: 'Line between' }).waitFor();

visits('a scan is made clean by one click, and seen beside itself', { ...ALL_PIXELS, hash }, async (visit) => {
  const modeller = await openScan(visit);
  const { page } = modeller;
  const source = await modeller.id;
  await modeller.press('Clean up');
  await sideBySide(visit);
  await visit.level(0);
  await visit.picture('scan');

  const clean = await described(await modeller.id);
  assert.deepEqual([clean.components, clean.boundary_loops, clean.reversed_edges, clean.euler_characteristic], [1, 0, 0, 2]);
  for (const place of [...clean.bounds.min, ...clean.bounds.max]) assert.ok(Math.abs(Math.abs(place) - 1) < 0.03, `${place}`);
  const told = await table(visit);
  assert.deepEqual(told.Pieces, ['2', '1']);
  assert.deepEqual(told['Holes and borders'], ['5', '0']);
  assert.equal(await visit.text('#panel-edit .cleaned'), '5 spikes put back, 170 faces in holes');

  // Each half is what the whole picture has there when it shows that model alone.
  const { width } = await page.locator('#stage').boundingBox();
  const both = await visit.pixels();
  const line = page.getByRole('slider', { name: 'Line between' });
  const drawn = {};
  for (const [key, name] of [['Home', 'edited'], ['End', 'original']]) {
    await line.press(key);
    await visit.drawn();
    drawn[name] = await visit.pixels();
  }
  assert.ok(covered(drawn.original) > covered(drawn.edited) + 0.002, 'spikes cover more');
  assert.equal(difference(half(both, width, false), half(drawn.original, width, false)), 0);
  assert.equal(difference(half(both, width, true), half(drawn.edited, width, true)), 0);

  for (let i = 0; i < 50; i++) await line.press('ArrowLeft');
  const box = await line.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + 200);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 4, box.y + 200, { steps: 3 });
  await page.mouse.up();
  assert.match(await visit.address(), /split=2\d(&|$)/);

  const other = await Visit.begin(site.browser, await visit.address());
  await sideBySide(other);
  await other.wait(() => document.querySelector('#panel-edit table tbody')?.rows.length > 0);
  assert.deepEqual(await table(other), told);
  await other.end();

  await page.getByLabel('Beside the original').uncheck();
  await line.waitFor({ state: 'hidden' });
  assert.doesNotMatch(await visit.address(), /beside=/);
  await page.getByLabel('Beside the original').check();
  await sideBySide(visit);
  await modeller.opens(() => page.goBack());
  assert.equal(await modeller.id, source);
  await line.waitFor({ state: 'hidden' });
});

visits('a scan is opened, made clean and compared by keyboard alone', { ...UNDRAWN, hash: '#tab=models&show=surface' }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const { keyboard } = visit.page;
  await visit.page.locator('#tab-models').focus();
  await visit.reach('Upload');
  await visit.choose([['scan.obj', scan()]], () => keyboard.press('Enter'));
  await visit.wait(() => document.getElementById('subject').textContent === 'scan.obj' && document.getElementById('facts').textContent);
  const source = await modeller.id;
  await visit.reach('Models', 'Shift+Tab');
  for (const key of ['ArrowRight', 'ArrowRight']) await keyboard.press(key);
  await modeller.ready();
  await visit.reach('Clean up');
  await keyboard.press('Tab'); // beyond the heading of the same name
  await modeller.opens(() => keyboard.press('Enter'));
  await sideBySide(visit);
  assert.equal((await described(await modeller.id)).boundary_loops, 0);
  await visit.reach('Line between', 'Shift+Tab');
  await keyboard.press('ArrowLeft');
  assert.match(await visit.address(), /split=49/);
  await modeller.opens(() => keyboard.press('Control+z'));
  assert.equal(await modeller.id, source);
});

visits('steps of a clean-up can be left out', { ...UNDRAWN, hash, ...PHONE }, async (visit) => {
  const modeller = await openScan(visit);
  const { page } = modeller;
  await page.getByText('Steps of a clean-up').tap();
  for (const step of ['Weld points', 'Remove spikes', 'Turn faces outward', 'Smooth']) await page.getByRole('checkbox', { name: step, exact: true }).tap();
  await page.getByLabel('Clean up, fill holes: edges at most').fill('20');
  await modeller.opens(() => page.getByRole('button', { name: 'Clean up', exact: true }).tap());
  assert.deepEqual((await modeller.edits).map(({ edit }) => edit), ['drop_pieces', 'fill']);
  const { components, boundary_loops, bounds } = await described(await modeller.id);
  assert.deepEqual([components, boundary_loops], [1, 2], 'the poles are too wide');
  assert.ok(bounds.max[1] > 1.4, 'the spikes are there');
});

visits('the original of a model is not shown beside another one that was opened meanwhile', { ...UNDRAWN, hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const { page } = modeller;
  await modeller.box('2, 2, 4');
  await page.getByLabel('Selection').fill('[1]');
  await page.keyboard.press('Enter');
  await modeller.press('Extrude');
  const asked = page.waitForRequest('**/v1/models?name=*');
  const release = await visit.hold('**/v1/models?name=*');
  await page.getByLabel('Beside the original').click();
  await asked;
  await visit.tab('Models');
  await page.locator('.model', { hasText: 'octopus.obj' }).click();
  await visit.wait(() => document.getElementById('subject').textContent === 'octopus.obj');
  const answered = page.waitForResponse('**/v1/models?name=*');
  release();
  await answered;
  await visit.drawn();
  assert.doesNotMatch(await visit.address(), /beside=/);
});

visits('a model of its own edits is seen beside what it was without them', { hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  await modeller.box('2, 2, 2');
  const plain = await modeller.id;
  const check = visit.page.getByLabel('Beside the original');
  assert.equal(await check.isVisible(), false, 'it is the original');
  await modeller.click([1, 0, 0]);
  await modeller.press('Extrude');
  await check.check();
  await sideBySide(visit);
  assert.match(await modeller.visit.address(), new RegExp(`beside=${plain}`));
  assert.deepEqual((await table(visit)).Faces, ['6', '10']);
  assert.ok(covered(await visit.pixels()) > 0.05);
  const selection = await modeller.selection;
  await modeller.click([-0.9, -0.9, 1]);
  assert.deepEqual(await modeller.selection, selection, 'the original is only looked at');
  await modeller.press('Undo');
  assert.doesNotMatch(await modeller.visit.address(), /beside=/);
});
