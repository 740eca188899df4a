// The page at /: shapes, selections and edits, by clicks and by keyboard.
import assert from 'node:assert/strict';
import { execFile } from 'node:child_process';
import { promisify } from 'node:util';

import { Modeller } from './modeller.mjs';
import { covered, difference, open, PHONE, PYRAMID, UNDRAWN, Visit } from './page_driver.mjs';

const site = open({ first: 'cube.obj' });
const { daemon, visits } = site;
const hash = '#tab=edit';

const described = async (id) => (await (await fetch(`${daemon.url}/v1/models/${id}`)).json()).meshes[0];
const surface = async (id) => (await fetch(`${daemon.url}/v1/models/${id}/surface.obj?level=2`)).text();
const store = async (document) =>
  (await (await fetch(`${daemon.url}/v1/models`, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(document) })).json()).id;

const orange = (pixels) => {
  let found = 0;
  for (let i = 0; i < pixels.length; i += 4) if (pixels[i] > pixels[i + 2] + 60 && pixels[i + 1] > pixels[i + 2] + 20) found++;
  return found / (pixels.length / 4);
};

visits('a tank hull is made by clicks from one box', { hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const { page } = modeller;
  await modeller.box('2, 0.8, 4');
  const box = await visit.pixels();
  assert.ok(covered(box) > 0.03, 'the box is there');
  await page.getByRole('button', { name: 'Edges', exact: true }).click();
  await modeller.click([0.97, 0.4, 0]);
  assert.deepEqual(await modeller.selection, [[7, 5]]);
  await page.getByLabel('Loop cut: cuts').fill('2');
  await modeller.press('Loop cut');
  await modeller.click([0, 0.4, 1.95]);
  await page.getByLabel('Move: by').fill('0 -0.4 0');
  await modeller.press('Move');
  await page.getByRole('button', { name: 'Faces', exact: true }).click();
  const unselected = await visit.pixels();
  await modeller.click([0, 0.4, 0]);
  await modeller.click([0, 0.4, -1.3], ['Shift']);
  assert.equal((await modeller.selection).length, 2);
  const selected = await visit.pixels();
  assert.ok(orange(selected) > orange(unselected) + 0.02, 'what is selected is seen');
  await page.getByLabel('Inset: amount').fill('0.2');
  await modeller.press('Inset');
  await page.getByLabel('Extrude: distance').fill('0.3');
  await modeller.press('Extrude');
  assert.equal((await modeller.selection).length, 2, 'the selection stays with the faces');
  await page.getByRole('button', { name: 'Edges', exact: true }).click();
  await modeller.click([0.78, 0.7, 0]);
  await modeller.click([0.78, 0.7, -1.2], ['Shift']);
  await page.getByLabel('Crease: sharpness').fill('3');
  await modeller.press('Crease');
  await visit.wait(() => document.getElementById('legend').textContent.includes('crease 3'));
  await visit.drawn();
  assert.ok(difference(box, await visit.pixels()) > 0.05);
  await visit.picture('hull');

  const { vertices, edges, faces, creases } = await described(await modeller.id);
  assert.deepEqual({ vertices, edges, faces, creases }, { vertices: 28, edges: 52, faces: 26, creases: 2 });
  const script = [
    { edit: 'loop_cut', edge: [7, 5], cuts: 2 },
    { edit: 'move', edges: { inside: { min: [-1, 0.39, 1.9], max: [1, 0.41, 2.1] } }, by: [0, -0.4, 0] },
    { edit: 'inset', faces: { inside: { min: [-1, 0.39, -2], max: [1, 0.41, 0.7] } }, amount: 0.2, name: 'deck' },
    { edit: 'extrude', faces: { made: 'deck' }, distance: 0.3 },
    { edit: 'crease', edges: { inside: { min: [0.79, 0.69, -2], max: [0.81, 0.71, 0.7] } }, sharpness: 3 },
  ];
  const written = await store({ meshes: [{ shape: { kind: 'box', size: [2, 0.8, 4], segments: [1, 1, 1] }, edits: script }] });
  const unnamed = (text) => text.replace(/^o .*$/gm, 'o');
  assert.equal(unnamed(await surface(await modeller.id)), unnamed(await surface(written)), 'a script of edits makes the same model');

  // The line of curl makes it too; each step has an address.
  const line = await page.locator('#panel-edit pre').innerText();
  const { stdout } = await promisify(execFile)('bash', ['-c', line.replace(/^curl /, 'curl -s ')]);
  assert.equal(JSON.parse(stdout).id, await modeller.id);
  const here = await visit.address();
  await page.locator('#view').focus();
  for (const [keys, edits] of [['Control+z', 4], ['Control+z', 3], ['Control+Shift+z', 4], ['Control+Shift+z', 5]]) {
    await modeller.opens(() => page.keyboard.press(keys));
    assert.equal((await modeller.edits).length, edits, keys);
  }
  assert.ok(await page.getByRole('button', { name: 'Redo' }).isDisabled());
  assert.equal(await visit.address(), here);
  const other = await Visit.begin(site.browser, here, UNDRAWN);
  await other.wait(() => document.querySelector('[aria-label=Edits]')?.value.includes('crease'));
  assert.equal((await new Modeller(other).edits).length, 5);
  await other.end();
});

visits('steps are undone and done again after the page was loaded anew, on any tab', { ...UNDRAWN, hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const { page } = modeller;
  await modeller.drop('kept.obj', `# kept\n${PYRAMID}`);
  const models = [await modeller.id];
  for (const [edit, place] of [['Extrude', [0, 0.5, 0.66]], ['Inset', null]]) {
    if (place) await modeller.click(place);
    await modeller.press(edit);
    models.push(await modeller.id);
  }
  await visit.tab('Sculpt');
  const goes = async (keys, wanted) => {
    await page.reload();
    await visit.level(2);
    await page.keyboard.press(keys);
    await visit.wait((id) => location.hash.includes(`model=${id}`), models[wanted]);
    await visit.level(2);
  };
  for (const [keys, wanted] of [['Control+z', 1], ['Control+z', 0], ['Control+Shift+z', 1]]) await goes(keys, wanted);
  await visit.tab('Edit');
  await visit.wait(() => document.querySelector('[aria-label=Edits]').value.includes('extrude'));
  assert.equal((await modeller.edits).length, 1);
  await visit.tab('Models');
  await page.locator('.model', { hasText: 'cube.obj' }).click(); // another lineage
  await visit.wait(() => document.getElementById('subject').textContent === 'cube.obj');
  await page.reload();
  await visit.level(2);
  assert.ok(await page.getByRole('button', { name: 'Undo' }).isHidden());
});

visits('the picture is not empty between two steps', { hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  await modeller.box('2, 2, 2');
  await modeller.click([1, 0, 0]);
  const release = await visit.hold('**/surface.glb**');
  await visit.page.getByRole('button', { name: 'Inset', exact: true }).click();
  await visit.wait(() => document.getElementById('subject').textContent === 'box, 1 edit');
  await visit.still();
  assert.ok(covered(await visit.pixels()) > 0.05);
  release();
  await visit.wait(() => 'pickable' in document.querySelector('canvas').dataset);
});

visits('through an edit nothing is selected from the cage before, and without an answer the level is kept', { ...UNDRAWN, hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const { page } = modeller;
  const takesClicks = () => page.evaluate(() => 'pickable' in document.querySelector('canvas').dataset);
  const extrude = async (distance) => {
    await page.getByLabel('Extrude: distance').fill(distance);
    await page.getByRole('button', { name: 'Extrude', exact: true }).click();
    await visit.wait((wanted) => document.querySelector('[aria-label=Edits]').value.includes(`"distance":${wanted}}`), distance);
  };
  await modeller.box('1, 2, 3');
  await page.getByLabel('Selection').fill('[0]');
  await page.keyboard.press('Enter');
  const release = await visit.hold('**/surface.glb?level=0**');
  await extrude('0.375');
  await visit.wait(() => document.getElementById('facts').textContent.startsWith('Level 2'));
  assert.equal(await takesClicks(), false);
  release();
  await modeller.ready();
  await page.unrouteAll();

  await page.route('**/surface.glb**', (route) => route.abort());
  await extrude('0.625');
  const word = page.locator('.empty', { hasText: 'Nothing is shown' });
  await word.waitFor();
  const made = await visit.model();
  const again = (about) => page.locator('.notice', { hasText: `${about} cannot be shown` }).getByRole('button', { name: 'Try again' });
  await again('The cage').waitFor();
  assert.equal(await takesClicks(), false);
  await page.unrouteAll();
  await again('Level 2').click();
  await visit.level(2);
  await again('The cage').click();
  await modeller.ready();
  assert.ok(await word.isHidden());
  assert.equal(await visit.model(), made);
  visit.faults = visit.faults.filter((fault) => !fault.includes('net::ERR_FAILED')); // visits after this one have others
});

visits('the list of edits is changed as text, and taken back', { ...UNDRAWN, hash, refused: [422] }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const { page } = modeller;
  await modeller.box('2, 1, 2');
  const plain = await modeller.id;
  await page.getByRole('textbox', { name: 'Edits' }).fill('[{"edit": "extrude", "faces": {"facing": [0, 1, 0]}, "distance": 2}]');
  await page.route('**/v1/models?name=*', (route) => route.abort('connectionrefused'), { times: 1 });
  await page.getByRole('button', { name: 'Apply', exact: true }).click();
  await modeller.opens(() => page.locator('.notice', { hasText: 'This cannot be done' }).getByRole('button', { name: 'Try again' }).click());
  visit.faults = visit.faults.filter((fault) => !fault.includes('ERR_CONNECTION_REFUSED'));
  assert.deepEqual((await described(await modeller.id)).bounds.max, [1, 2.5, 1]);
  await page.getByRole('textbox', { name: 'Edits' }).fill('[{"edit": "extrude", "faces": [99], "distance": 2}]');
  await page.getByRole('button', { name: 'Apply', exact: true }).click();
  await page.getByText('/meshes/0/edits/0/faces/0').waitFor();
  await page.getByRole('textbox', { name: 'Edits' }).fill('[');
  await page.getByRole('button', { name: 'Apply', exact: true }).click();
  await page.getByText('The list is no JSON').waitFor();
  await modeller.press('Undo');
  assert.equal(await modeller.id, plain);
});

visits('edits that an address has are taken back one by one, and done again, however fast', { ...UNDRAWN, hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const { page } = modeller;
  await modeller.drop('listed.obj', `# listed\n${PYRAMID}`);
  const list = [1, 2, 3].map((face) => ({ edit: 'extrude', faces: [face], distance: 0.25 }));
  await page.getByRole('textbox', { name: 'Edits' }).fill(JSON.stringify(list));
  await modeller.press('Apply');
  const address = await visit.address();
  await page.evaluate(() => sessionStorage.clear()); // as in another tab
  await page.goto('about:blank');
  await page.goto(address);
  await modeller.ready();
  const keys = async (key, times, left) => {
    for (let i = 0; i < times; i++) await page.keyboard.press(key);
    await visit.wait((count) => JSON.parse(document.querySelector('[aria-label=Edits]').value).length === count, left);
    await visit.drawn();
    assert.equal(JSON.parse(new URLSearchParams(new URL(await visit.address()).hash.slice(1)).get('edits') ?? '[]').length, left);
  };
  await keys('Control+z', 1, 2);
  await keys('Control+z', 2, 0);
  await keys('Control+Shift+z', 2, 2);
  await keys('Control+z', 1, 1);
});

visits('an edit that follows before the last one is shown is added to it', { ...UNDRAWN, hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const { page } = modeller;
  await modeller.box('2, 2, 2');
  await page.getByLabel('Selection').fill('"all"');
  await page.keyboard.press('Enter');
  const asked = page.waitForRequest('**/source');
  const release = await visit.hold('**/source');
  const before = await modeller.id;
  await page.getByRole('button', { name: 'Move', exact: true }).click();
  await asked;
  const moved = await modeller.id;
  assert.notEqual(moved, before);
  await page.getByRole('button', { name: 'Scale', exact: true }).click();
  release();
  await visit.wait((id) => new URLSearchParams(location.hash.slice(1)).get('model') !== id, moved);
  await visit.drawn();
  assert.deepEqual((await modeller.edits).map(({ edit }) => edit), ['move', 'scale']);
  assert.equal(await page.locator('.notice').count(), 0);
  await page.locator('#view').press('Control+z');
  await visit.wait((id) => new URLSearchParams(location.hash.slice(1)).get('model') === id, moved);
});

visits('steps are there again beside the original, after the page was loaded anew, and after Back', { ...UNDRAWN, hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const { page } = modeller;
  await modeller.drop('stepped.obj', `# stepped\n${PYRAMID}`);
  const first = await modeller.id;
  await page.getByLabel('Selection').fill('[1]');
  await page.keyboard.press('Enter');
  await modeller.press('Extrude');
  const second = await modeller.id;
  await modeller.press('Inset');
  await page.locator('#view').press('Control+z');
  await visit.wait((id) => location.hash.includes(`model=${id}`), second);
  await visit.drawn();
  await page.getByLabel('Beside the original').check();
  await visit.drawn();
  await page.reload();
  await visit.level(2);
  const [undo, redo] = ['Undo', 'Redo'].map((name) => page.getByRole('button', { name, exact: true }));
  assert.ok((await undo.isEnabled()) && (await redo.isEnabled()));
  await visit.tab('Models');
  await page.locator('.model', { hasText: 'cube.obj' }).click();
  await visit.wait(() => document.getElementById('subject').textContent === 'cube.obj');
  assert.ok(await undo.isHidden());
  await page.goBack();
  await visit.wait((id) => location.hash.includes(`model=${id}`), second);
  await visit.level(2);
  assert.ok((await undo.isEnabled()) && (await redo.isEnabled()));
  await undo.click();
  await visit.wait((id) => location.hash.includes(`model=${id}`), first);
});

visits('edits are made by keyboard alone', { ...UNDRAWN, hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const { page } = modeller;
  await modeller.opens(async () => {
    await page.getByRole('button', { name: 'New shape' }).focus();
    await page.keyboard.press('Enter');
    await visit.wait(() => document.activeElement.role === 'menuitem');
    for (const key of ['ArrowDown', 'Enter']) await page.keyboard.press(key);
  });
  assert.equal((await described(await modeller.id)).faces, 16);
  await page.locator('#view').focus();
  for (const key of ['n', 'n', 'Shift+N', 'p']) await page.keyboard.press(key);
  assert.deepEqual(await modeller.selection, [1]);
  await page.getByLabel('Selection').focus();
  await page.keyboard.press('Control+A');
  await page.keyboard.type('all');
  await page.keyboard.press('Enter');
  assert.equal(await modeller.selection, 'all');
  assert.equal(await visit.text('#panel-edit .selected'), '16 faces');
  await modeller.opens(async () => {
    await page.getByRole('button', { name: 'Subdivide', exact: true }).focus();
    await page.keyboard.press('Enter');
  });
  assert.equal((await described(await modeller.id)).faces, 64);
});

visits('each shape is one to start from', { hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  for (const [kind, faces] of [['Sphere', 24], ['Globe', 128], ['Icosphere', 80], ['Ellipsoid', 24], ['Cylinder', 10], ['Cone', 9], ['Torus', 72]]) {
    await modeller.shape(kind);
    assert.equal((await described(await modeller.id)).faces, faces, kind);
    assert.ok(covered(await visit.pixels()) > 0.05, kind);
  }
});

visits('a file that somebody else made is edited', { ...UNDRAWN, hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  await modeller.drop('pyramid.obj', PYRAMID);
  const source = await modeller.id;
  await modeller.click([0, 0.5, 0.66]);
  assert.deepEqual(await modeller.selection, [3]);
  await modeller.press('Extrude');
  await modeller.press('Inset');
  const made = await modeller.id;
  assert.equal((await described(made)).faces, 5 + 3 + 3);
  const line = await modeller.page.locator('#panel-edit pre').innerText();
  const { stdout } = await promisify(execFile)('bash', ['-c', line.replace(/^curl /, 'curl -s ')]);
  assert.equal(JSON.parse(stdout).id, made);
  const other = await Visit.begin(site.browser, await modeller.visit.address(), UNDRAWN);
  await other.wait(() => document.querySelector('[aria-label=Edits]')?.value.includes('inset'));
  await other.end();
  await modeller.press('Undo');
  assert.deepEqual((await modeller.edits).map(({ edit }) => edit), ['extrude']);
  await modeller.press('Undo');
  assert.equal(await modeller.id, source);
  assert.doesNotMatch(await modeller.visit.address(), /from=|edits=/);
});

visits('taps select one more each', { ...UNDRAWN, hash, ...PHONE }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  await modeller.box('2, 2, 2');
  await visit.page.evaluate(() => scrollTo(0, 0));
  for (const place of [[1, 0, 0], [0, 1, 0], [1, 0, 0]]) await modeller.click(place, [], 'tap');
  assert.deepEqual(await modeller.selection, [2]);
});

visits('faces have the numbers of the file, whatever their materials and holes', { ...UNDRAWN, hash }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const strip = [-2, -1, 0, 1, 2].map((x) => `v ${x} 0 1\nv ${x} 0 -1\n`).join('');
  const face = (k) => `f ${2 * k + 1} ${2 * k + 3} ${2 * k + 4} ${2 * k + 2}\n`;
  await modeller.drop('strip.obj', `${strip}usemtl a\n${face(0)}usemtl b\n${face(1)}usemtl a\n${face(2)}${face(3)}t hole 1/0/0 0\n`);
  for (const [x, number] of [[-0.5, 1], [0.5, 2], [1.5, 3]]) {
    await modeller.click([x, 0, 0]);
    assert.deepEqual(await modeller.selection, [number]);
  }
  await modeller.page.getByLabel('Move: by').fill('0 1 0');
  await modeller.press('Move');
  assert.deepEqual((await described(await modeller.id)).bounds.max, [2, 1, 1]);
  assert.deepEqual(await modeller.selection, [3]);
  await modeller.click([-0.5, 0, 0]);
  assert.deepEqual(await modeller.selection, [1]);
});

visits('one mesh of several is edited', { ...UNDRAWN, hash: `${hash}&show=surface,cage` }, async (visit) => {
  await visit.level(2);
  const modeller = new Modeller(visit);
  const cube = (name) => ({ name, shape: { kind: 'box' } });
  await modeller.drop('pair.json', JSON.stringify({
    meshes: [cube('left'), cube('right')],
    nodes: [{ name: 'a', mesh: 'left', translation: [-1.5, 0, 0] }, { name: 'b', mesh: 'right', translation: [1, 0, 0], scale: [2, 1, 1] }],
  }));
  await modeller.click([1, 0, 0.5]);
  assert.match(await visit.text('#panel-edit .selected'), /1 face of right/);
  await modeller.press('Extrude');
  const { meshes } = JSON.parse(await (await fetch(`${daemon.url}/v1/models/${await modeller.id}/source`)).text());
  assert.deepEqual(meshes.map(({ edits }) => edits?.length ?? 0), [0, 1]);
});

visits('a thumbnail shows a model without what a hand marks on it', { first: 'cube.obj', hash: '#tab=edit' }, async (visit) => {
  const { page } = visit;
  await visit.wait(() => 'pickable' in document.querySelector('canvas').dataset);
  await page.locator('#view').press('a');
  await page.locator('.selected', { hasText: '6 faces' }).waitFor();
  await page.waitForTimeout(3000); // it would be made after two seconds
  await visit.tab('Models');
  const thumbnail = page.locator('.model[aria-current] img.thumbnail');
  await thumbnail.waitFor();
  const marked = await thumbnail.evaluate(async (image) => {
    await image.decode();
    const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    return data.filter((red, i) => i % 4 === 0 && red - data[i + 2] > 60).length;
  });
  assert.equal(marked, 0);
});
