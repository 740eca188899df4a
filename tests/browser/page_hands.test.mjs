// The page at /: modelling by hand, with handles, keys and boxes on the picture.
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';

import { Modeller } from './modeller.mjs';
import { difference, open, PHONE, UNDRAWN } from './page_driver.mjs';
import { BY_KEYBOARD, buildShip } from './ship.mjs';

const site = open({ first: 'cube.obj' });
const { daemon, visits } = site;
const hash = '#tab=edit';
const described = async (id) => (await (await fetch(`${daemon.url}/v1/models/${id}`)).json()).meshes[0];

class Hand extends Modeller {
  static async begin(visit, size = '2, 2, 2') {
    await visit.level(2);
    const hand = new Hand(visit);
    await hand.box(size);
    return hand;
  }

  async pointAt(place, by = [0, 0]) {
    const { x, y } = await this.page.locator('#view').boundingBox();
    const at = await this.at(place);
    await this.page.mouse.move(x + at.x + by[0], y + at.y + by[1], { steps: 3 });
  }

  kind(name) {
    return this.page.getByRole('button', { name, exact: true }).click();
  }

  get said() {
    return this.visit.text('#panel-edit .selected');
  }

  async press(...keys) {
    for (const key of keys) await this.page.keyboard.press(key);
    await this.visit.drawn();
  }
}

visits('extrude, inset and a cut by keys, with a typed amount, by the mouse, and cancelled', { hash }, async (visit) => {
  const hand = await Hand.begin(visit);
  const { page } = hand;
  const plain = await hand.id;
  await hand.click([0, 1, 0]);
  await hand.press('e', '0', '.', '5');
  assert.equal(await visit.text('.gesture [role=status]'), 'Extrude 0.5');
  const before = await visit.pixels();
  await hand.press('Backspace', '1');
  assert.ok(difference(before, await visit.pixels()) > 0.002, 'the preview follows what is typed');
  await hand.press('Escape');
  assert.equal(await hand.id, plain);
  await hand.press('e', '0', '.', '5');
  await hand.opens(() => page.keyboard.press('Enter'));
  assert.deepEqual((await hand.edits).at(-1), { edit: 'extrude', faces: [2], distance: 0.5 });
  assert.deepEqual((await described(await hand.id)).bounds.max, [1, 1.5, 1]);

  // By the mouse: towards the middle of the face, and a click.
  await page.locator('#view').focus();
  await hand.pointAt([0.9, 1.5, 0.9]);
  await hand.press('i');
  await hand.pointAt([0.4, 1.5, 0.4]);
  await hand.opens(async () => {
    await page.mouse.down();
    await page.mouse.up();
  });
  const inset = (await hand.edits).at(-1);
  assert.equal(inset.edit, 'inset');
  assert.ok(inset.amount > 0.1 && inset.amount < 0.9, `${inset.amount}`);

  await hand.kind('Edges');
  await page.locator('#view').focus();
  await hand.press('Control+r');
  await hand.pointAt([1, 0, 1]);
  await page.mouse.wheel(0, -100);
  await visit.drawn();
  assert.equal(await visit.text('.gesture [role=status]'), 'Loop cut 2');
  const { faces } = await described(await hand.id);
  await hand.opens(() => page.keyboard.press('Enter'));
  assert.equal((await hand.edits).at(-1).cuts, 2);
  assert.ok((await described(await hand.id)).faces >= faces + 8);
  await hand.opens(() => page.keyboard.press('Control+z'));
  assert.equal((await described(await hand.id)).faces, faces);
  await hand.opens(() => page.keyboard.press('Control+Shift+z'));
  await visit.picture('hands');
});

visits('handles move a selection, and what is under the pointer is seen', { hash }, async (visit) => {
  const hand = await Hand.begin(visit);
  const { page } = hand;
  const still = await visit.pixels();
  await hand.pointAt([0, 1, 0]);
  await visit.drawn();
  const hovered = await visit.pixels();
  assert.ok(difference(still, hovered) > 0.01, 'the face under the pointer');
  await hand.click([0, 1, 0]);
  assert.equal(await hand.said, '1 face');
  await page.getByRole('button', { name: 'Move by handles' }).click();
  await hand.pointAt([0, 1, 0], [200, 200]);
  await visit.drawn();
  const handles = await visit.pixels();
  await visit.picture('handles');
  assert.ok(difference(hovered, handles) > 0.002, 'the handles are there');
  const view = (await visit.address()).match(/view=[^&]*/)[0];
  await hand.pointAt([0, 1.55, 0]);
  await visit.drawn();
  await page.mouse.down();
  await hand.pointAt([0, 2.05, 0]);
  await visit.drawn();
  await hand.opens(() => page.mouse.up());
  const { edit, by, faces } = (await hand.edits).at(-1);
  assert.deepEqual([edit, faces], ['move', [2]]);
  assert.ok(Math.abs(by[1] - 0.5) < 0.1 && by[0] === 0 && by[2] === 0, `${by}`);
  assert.ok((await visit.address()).includes(view), 'the camera stays');
  assert.equal(await hand.said, '1 face');
});

visits('loops, rings, growth, all and none, and a box', { ...UNDRAWN, hash }, async (visit) => {
  await visit.level(2);
  const hand = new Hand(visit);
  const { page } = hand;
  await hand.shape('Grid');
  await page.getByLabel('Grid: size').fill('4, 4');
  await hand.opens(() => page.getByLabel('Grid: size').press('Enter'));
  await hand.look();
  await hand.kind('Edges');
  await hand.click([0.5, 0, 0], ['Alt']);
  assert.equal(await hand.said, '4 edges');
  await hand.click([0.5, 0, 0], ['Alt', 'Control']);
  assert.equal(await hand.said, '5 edges');
  await page.locator('#view').focus();
  await hand.press('3');
  await hand.click([0.5, 0, 0.5]);
  assert.equal(await hand.said, '1 face');
  await page.getByRole('button', { name: 'Grow' }).click();
  assert.equal(await hand.said, '9 faces');
  await page.getByRole('button', { name: 'Shrink' }).click();
  await page.locator('#view').focus();
  await hand.press('a');
  assert.equal(await hand.said, '16 faces');
  await hand.press('Alt+a');
  assert.match(await hand.said, /^Click faces/);
  await hand.press('b');
  await hand.pointAt([-2.2, 0, -2.2], [0, -30]);
  await page.mouse.down();
  await hand.pointAt([2.2, 0, 2.2], [0, 30]);
  await visit.drawn();
  await visit.wait(() => document.querySelector('.box').textContent);
  const foreseen = await page.locator('.box').innerText();
  await page.mouse.up();
  const some = parseInt(await hand.said, 10);
  assert.equal(Number(foreseen), some, 'what the box holds is told before it is selected');
  assert.ok(some >= 4 && some <= 16, `${some} faces`);
  await page.getByLabel('Selection').fill('{"facing": [0, 1, 0], "within": 10}');
  await page.keyboard.press('Enter');
  assert.equal(await hand.said, '16 faces', 'a rule is shown as what it selects');
});

visits('a finger moves what is selected', { hash, ...PHONE }, async (visit) => {
  const hand = await Hand.begin(visit);
  const { page } = hand;
  await page.evaluate(() => scrollTo(0, 0));
  await hand.click([0, 1, 0], [], 'tap');
  await page.getByRole('button', { name: 'Extrude (E)' }).tap();
  const { x, y } = await page.locator('#view').boundingBox();
  const at = await hand.at([0, 1, 0]);
  const session = await page.context().newCDPSession(page);
  const touch = (type, ...touchPoints) => session.send('Input.dispatchTouchEvent', { type, touchPoints });
  await touch('touchStart', { x: x + at.x, y: y + at.y });
  await touch('touchMove', { x: x + at.x, y: y + at.y - 20 });
  await touch('touchMove', { x: x + at.x, y: y + at.y - 40 });
  await visit.picture('finger');
  await hand.opens(() => touch('touchEnd'));
  const { edit, distance } = (await hand.edits).at(-1);
  assert.equal(edit, 'extrude');
  assert.ok(distance > 0.1, `${distance}`);
});

visits('a finger sees what it will select, by a press and by boxes', { hash, ...PHONE, deviceScaleFactor: 1 }, async (visit) => {
  const hand = await Hand.begin(visit);
  const { page } = hand;
  await page.evaluate(() => scrollTo(0, 0));
  await page.getByRole('button', { name: 'None' }).tap();
  await page.evaluate(() => scrollTo(0, 0));
  const session = await page.context().newCDPSession(page);
  const { x, y } = await page.locator('#view').boundingBox();
  const touch = async (type, place, by = [0, 0]) => {
    const at = place && (await hand.at(place));
    await session.send('Input.dispatchTouchEvent', { type, touchPoints: at ? [{ x: x + at.x + by[0], y: y + at.y + by[1] }] : [] });
    await visit.drawn();
  };
  const bare = await visit.pixels();
  await touch('touchStart', [0, 1, 0]);
  assert.ok(difference(bare, await visit.pixels()) > 0.01, 'the face under the finger is marked');
  await touch('touchEnd');
  assert.equal(await hand.said, '1 face');
  await page.getByRole('button', { name: 'Select by a box (B)' }).tap();
  for (const [place, most] of [[[1, 0, 0], 2], [[0, 0, 1], 3]]) {
    await touch('touchStart', place, [-12, -12]);
    await touch('touchMove', place, [12, 12]);
    await visit.wait(() => document.querySelector('.box').textContent === '1');
    await touch('touchEnd');
    assert.equal(await hand.said, `${most} faces`, 'a box of a finger adds, as its taps do');
  }
});

/** A ship is whole, its last edits are undone and redone, and what is downloaded is its surface. act: by 'Undo' or 'Redo'. */
async function finishShip(hand, { max, creases }, act, press) {
  const whole = await hand.id;
  const { bounds, boundary_edges: open, components, creases: made } = await described(whole);
  assert.deepEqual({ bounds, open, components, creases: made }, { bounds: { min: [-0.5, -0.5, -1.5], max }, open: 0, components: 1, creases });
  for (const name of ['Undo', 'Undo', 'Redo', 'Redo']) await act(name);
  assert.equal(await hand.id, whole);
  const saved = hand.page.waitForEvent('download');
  await press(hand.page.getByRole('link', { name: 'Download' }));
  const file = await readFile(await (await saved).path());
  assert.deepEqual(file, Buffer.from(await (await fetch(`${daemon.url}/v1/models/${whole}/surface.glb?level=2`)).arrayBuffer()));
}

visits('a ship from a box, by keyboard alone', { hash }, async (visit) => {
  await visit.level(2);
  const hand = new Hand(visit);
  const { page } = hand;
  const press = async (control) => {
    await control.focus();
    await page.keyboard.press('Enter');
  };
  const onPicture = async (...keys) => {
    await page.locator('#view').focus();
    await hand.press(...keys);
  };
  const fingers = {
    opens: (action) => hand.opens(action),
    enter: (name) => press(page.getByRole('button', { name, exact: true }).or(page.locator('summary', { hasText: name }))),
    inMenu: async (key) => {
      await visit.wait(() => document.activeElement.role === 'menuitem');
      await page.keyboard.press(key);
    },
    onPicture,
    type: async (label, text) => {
      await page.getByLabel(label).focus();
      await page.keyboard.press('Control+A');
      await page.keyboard.type(text);
      await page.keyboard.press('Enter');
    },
  };
  await buildShip(fingers);
  await visit.picture('ship');
  const keys = { Undo: 'Control+z', Redo: 'Control+Shift+z' };
  await finishShip(hand, BY_KEYBOARD, (name) => hand.opens(() => onPicture(keys[name])), press);
});

visits('a ship from a box, by touch alone', { hash, ...PHONE }, async (visit) => {
  const hand = await Hand.begin(visit, '1, 1, 3');
  const { page } = hand;
  const tap = (control) => control.tap();
  const button = (name) => page.getByRole('button', { name, exact: true });
  const edits = (name) => hand.opens(() => tap(button(name)));
  const onPicture = async (...place) => {
    await tap(button('None')); // each tap adds one
    await page.evaluate(() => scrollTo(0, 0));
    await hand.click(place, [], 'tap');
  };
  await tap(button('Edges'));
  await onPicture(0, 0.5, 1.5);
  await edits('Loop cut');
  await tap(button('Faces'));
  await page.getByLabel('Selection').fill('{"inside": {"min": [-1, -1, -2], "max": [0, 1, 2]}}');
  await page.getByLabel('Selection').blur();
  await edits('Delete');
  await onPicture(0.25, 0, 1.5);
  await edits('Extrude');
  await onPicture(0.25, 0.5, 0);
  await edits('Inset');
  await edits('Extrude');
  await tap(button('Edges'));
  await onPicture(0.5, 0.5, 0);
  await edits('Crease');
  await tap(page.locator('summary', { hasText: 'Edits of the whole mesh' }));
  await edits('Mirror');
  await visit.picture('ship_by_touch');
  await finishShip(hand, { max: [0.5, 0.75, 1.75], creases: 2 }, edits, tap);
});
