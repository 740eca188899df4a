// The page at /: points of a level are dragged, and the other levels remember it.
import assert from 'node:assert/strict';

import { Vector3 } from 'three';

import { cameraOf, Modeller, VIEW } from './modeller.mjs';
import { ALL_PIXELS, CUBE, difference, open, PHONE, UNDRAWN } from './page_driver.mjs';

const site = open({ first: 'block.obj', files: { 'block.obj': CUBE } });
const { daemon, visits } = site;
const hash = `#tab=sculpt&level=3&show=surface&view=${encodeURIComponent(VIEW)}`;

/** Points that the OBJ of a level has, in its order. */
async function pointsOf(id, level, more = '') {
  const text = await (await fetch(`${daemon.url}/v1/models/${id}/surface.obj?level=${level}${more}`)).text();
  return text.match(/^v .*$/gm).map((line) => new Vector3(...line.split(' ').slice(1).map(Number)));
}

const nearest = (points, place) => points.reduce((best, point, i) => (point.distanceTo(place) < points[best].distanceTo(place) ? i : best), 0);

/** The radius of a brush: parts of half the diagonal of what is shown. */
function radiusOf(points, percent) {
  const most = points.reduce((sum, point) => sum.max(point), points[0].clone());
  return (points.reduce((sum, point) => sum.min(point), most.clone()).distanceTo(most) * percent) / 200;
}

/** Where points have to be after one of them was dragged. */
function dragged(points, middle, by, percent = 25) {
  const radius = radiusOf(points, percent);
  const part = (point) => Math.max(0, 1 - (point.distanceTo(points[middle]) / radius) ** 2) ** 2;
  return points.map((point) => point.clone().addScaledVector(by, part(point)));
}

const apart = (a, b) => Math.max(...a.map((point, i) => point.distanceTo(b[i])));

class Sculptor extends Modeller {
  static async begin(visit) {
    await visit.level(3);
    const sculptor = new Sculptor(visit);
    await sculptor.ready();
    return sculptor;
  }

  /** How far a place goes in the world when the picture moves it by pixels. */
  async moved(place, [dx, dy]) {
    const { width, height } = await this.page.locator('#view').boundingBox();
    const camera = cameraOf({ width, height });
    const seen = place.clone().project(camera);
    return seen.add(new Vector3((2 * dx) / width, (-2 * dy) / height, 0)).unproject(camera).sub(place);
  }

  /** Goes to another level, and holds its points until the function that it resolves with is called. */
  async holdPoints(level) {
    const release = await this.visit.hold('**/surface.bin?**');
    await this.slide('Level', level);
    await this.visit.wait((wanted) => document.querySelector('canvas').dataset.level === String(wanted), level);
    await this.visit.still();
    return release;
  }

  /** Takes hold of a place and moves the pointer by pixels. */
  async hold(place, by) {
    await this.move(place, by);
    await this.visit.drawn();
  }

  async move(place, [dx, dy]) {
    const { x, y } = await this.page.locator('#view').boundingBox();
    const at = await this.at(place);
    await this.page.mouse.move(x + at.x, y + at.y);
    await this.page.mouse.down();
    await this.page.mouse.move(x + at.x + dx, y + at.y + dy, { steps: 3 });
  }

  async drag(place, by) {
    await this.hold(place, by);
    await this.opens(() => this.page.mouse.up());
  }

  slide(name, to) {
    return this.page.getByRole('slider', { name }).evaluate((slider, value) => {
      slider.value = value;
      for (const type of ['input', 'change']) slider.dispatchEvent(new Event(type));
    }, to);
  }

  async toLevel(level) {
    await this.slide('Level', level);
    await this.visit.level(level);
  }
}

visits('a point of a level is dragged, and the other levels remember it', { ...ALL_PIXELS, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const source = await sculptor.id;
  const before = await pointsOf(source, 3);
  const middle = nearest(before, new Vector3(0.5, 0.3, 0.6));
  await sculptor.slide('Radius', 60);
  const [plain, plainer] = [await visit.pixels(), await pointsOf(source, 4)];
  await sculptor.hold(before[middle], [70, -50]);
  const held = await visit.pixels();
  const changed = difference(plain, held);
  assert.ok(changed > 0.004, `the picture follows the hand: ${changed}`);
  assert.equal(await sculptor.id, source);
  await sculptor.opens(() => page.mouse.up());
  await visit.picture('sculpt');
  const by = await sculptor.moved(before[middle], [70, -50]);
  assert.ok(by.length() > 0.3);
  assert.ok(apart(await pointsOf(await sculptor.id, 3), dragged(before, middle, by, 60)) < 1e-3, 'each point is where the brush put it');
  const made = await visit.pixels();
  assert.ok(difference(held, made) < changed / 3, `what the daemon answers looks as it did in the hand: ${difference(held, made)}`);

  await sculptor.toLevel(4);
  const finer = await pointsOf(await sculptor.id, 4);
  assert.ok(apart(finer, plainer) > 0.7 * by.length(), 'level 4 has the bump');
  const detailed = await visit.pixels();
  await page.getByLabel('Details of the levels').uncheck();
  await visit.wait(() => location.hash.includes('details=false') && document.getElementById('facts').textContent.startsWith('Level 4'));
  await visit.drawn();
  let bare = await visit.pixels();
  for (let i = 0; i < 50 && difference(bare, detailed) === 0; i++) bare = await visit.pixels();
  assert.ok(difference(bare, detailed) > 0.004, 'without details there is none');
  assert.ok(await page.getByRole('button', { name: 'Push' }).isHidden(), 'nor anything to sculpt');
  assert.equal(apart(await pointsOf(await sculptor.id, 4, '&details=false'), plainer), 0);
  await page.getByRole('button', { name: 'Show it so' }).click();
  await visit.wait(() => 'sculpts' in document.querySelector('canvas').dataset);
  await sculptor.toLevel(3);
  assert.equal(difference(await visit.pixels(), made), 0, 'the level is as it was');

  const once = await sculptor.id;
  const finest = nearest(before, new Vector3(-0.2, 0.7, 0.5));
  await sculptor.drag(before[finest], [0, -30]);
  await sculptor.opens(() => page.getByRole('button', { name: 'Undo' }).click());
  assert.equal(await sculptor.id, once);
  await sculptor.opens(() => page.getByRole('button', { name: 'Undo' }).click());
  assert.equal(await sculptor.id, source);
  assert.ok(await page.getByRole('button', { name: 'Undo' }).isDisabled());
  await visit.tab('Surface'); // where no point is marked
  await visit.drawn();
  assert.ok(difference(await visit.pixels(), plain) < 1e-4);
});

visits('with Shift a point goes along its normal', { ...UNDRAWN, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const before = await pointsOf(await sculptor.id, 3);
  const middle = nearest(before, new Vector3(0, 0.7, 0)); // the middle of the upper side, which faces up
  await visit.page.keyboard.down('Shift');
  await sculptor.drag(before[middle], [25, -40]);
  await visit.page.keyboard.up('Shift');
  const by = (await pointsOf(await sculptor.id, 3))[middle].sub(before[middle]);
  assert.ok(by.y > 0.1, `${by.y}`);
  assert.ok(Math.hypot(by.x, by.z) < 1e-4, 'not sidewards');
  assert.match(await visit.address(), /view=4%2C3%2C6%2C0%2C0%2C0/, 'the camera stays');
});

visits('a stroke that is cancelled leaves the model as it was', { hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const before = await pointsOf(await sculptor.id, 3);
  const place = before[nearest(before, new Vector3(0.5, 0.3, 0.6))];
  const [source, at] = [await sculptor.id, await sculptor.at(place)];
  await page.locator('#view').click({ position: at });
  await visit.drawn();
  const plain = await visit.pixels();
  await page.route('**/detail?**', () => {}); // is never answered
  await sculptor.hold(place, [30, -30]);
  await page.mouse.up();
  await page.getByRole('button', { name: 'Cancel' }).click();
  await page.waitForTimeout(100);
  await visit.drawn();
  assert.equal(difference(await visit.pixels(), plain), 0);
  assert.equal(await sculptor.id, source);
  await page.unroute('**/detail?**');
  await sculptor.drag(place, [30, -30]);
});

visits('a stroke by numbers waits for the point that it was given', { ...UNDRAWN, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const before = await pointsOf(await sculptor.id, 4);
  const release = await sculptor.holdPoints(4);
  await page.getByRole('textbox', { name: 'Point' }).fill('7');
  await page.keyboard.press('Enter');
  await page.getByLabel('Stroke: by').fill('0 0.25 -0.125');
  await sculptor.opens(async () => {
    await page.getByRole('button', { name: 'Move', exact: true }).click();
    release();
  });
  assert.ok(apart(await pointsOf(await sculptor.id, 4), dragged(before, 7, new Vector3(0, 0.25, -0.125))) < 1e-5);
});

visits('points that could not be loaded are asked for again by the next stroke', { ...UNDRAWN, hash: '#tab=models&level=3' }, async (visit) => {
  await visit.level(3);
  const sculptor = new Sculptor(visit);
  const { page } = sculptor;
  const before = await pointsOf(await sculptor.id, 3);
  await page.route('**/surface.bin?**', (route) => route.abort('connectionrefused'));
  await visit.tab('Sculpt');
  await page.locator('#view').click();
  const failures = page.locator('.notice', { hasText: 'The points cannot be loaded' });
  await failures.waitFor(); // of the stroke
  await page.getByLabel('Stroke: by').fill('0 0.25 0');
  await page.getByLabel('Stroke: by').press('Enter');
  await failures.nth(1).waitFor();
  await page.unroute('**/surface.bin?**');
  await sculptor.opens(() => failures.last().getByRole('button', { name: 'Try again' }).click());
  assert.ok(apart(await pointsOf(await sculptor.id, 3), before) > 0.2);
  visit.faults = visit.faults.filter((fault) => !fault.includes('ERR_CONNECTION_REFUSED'));
});

visits('points are moved by keyboard', { ...UNDRAWN, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const before = await pointsOf(await sculptor.id, 3);
  await page.locator('#view').focus();
  for (const [key, value] of [['n', '0'], ['n', '1'], ['n', '2'], ['p', '1']]) {
    await page.keyboard.press(key);
    await visit.wait((wanted) => document.querySelector('[aria-label=Point]').value === wanted, value);
  }
  await page.getByRole('textbox', { name: 'Point' }).fill('7');
  await page.keyboard.press('Enter');
  await visit.wait(() => document.querySelector('#panel-sculpt [role=status]').textContent.startsWith('A point at'));
  await page.getByLabel('Stroke: by').fill('0 0.25 -0.125');
  await sculptor.press('Move');
  const by = new Vector3(0, 0.25, -0.125);
  assert.ok(apart(await pointsOf(await sculptor.id, 3), dragged(before, 7, by)) < 1e-5);
  assert.equal(await page.getByRole('textbox', { name: 'Point' }).inputValue(), '', 'it may have another number now');
  await page.locator('#view').press('p');
  await visit.wait(() => document.querySelector('[aria-label=Point]').value === '6');
  await page.locator('#view').press('n');
  await visit.wait(() => document.querySelector('[aria-label=Point]').value === '7');
  await page.getByLabel('Push: distance').fill('-0.2');
  await sculptor.press('Push');
  const pushed = (await pointsOf(await sculptor.id, 3))[7].sub(before[7]).sub(by);
  assert.ok(Math.abs(pushed.length() - 0.2) < 1e-4, `${pushed.length()}`);
});

visits('what is shown twice, turned and stretched, is sculpted in its own space', { ...UNDRAWN, hash }, async (visit) => {
  const document = {
    meshes: [{ name: 'other', shape: { kind: 'box' } }, { name: 'ball', shape: { kind: 'box', size: [2, 2, 2] } }],
    nodes: [{ name: 'a', mesh: 'other', translation: [0, 0, -8] },
      { name: 'b', mesh: 'ball', translation: [-3, 0, -2], scale: [0.5, 0.5, 1] },
      { name: 'c', mesh: 'ball', translation: [0.5, 0.2, 0], rotation: [0, 0.6, 0, 0.8], scale: [1, 0.8, 1.2] }],
  };
  const sculptor = await Sculptor.begin(visit);
  await sculptor.drop('twice.json', JSON.stringify(document), 'Sculpt');
  await sculptor.toLevel(3);
  const before = await pointsOf(await sculptor.id, 3);
  const [first, second] = [before.length / 3, (2 * before.length) / 3];
  const middle = second + nearest(before.slice(second), new Vector3(0.9, 0.5, 0.7));
  await sculptor.drag(before[middle], [40, -60]);
  const after = await pointsOf(await sculptor.id, 3);
  const by = await sculptor.moved(before[middle], [40, -60]);
  assert.ok(after[middle].clone().sub(before[middle]).distanceTo(by) < 1e-3);
  const radius = radiusOf(before, 25);
  for (let i = second; i < before.length; i++) {
    const part = Math.max(0, 1 - (before[i].distanceTo(before[middle]) / radius) ** 2) ** 2;
    assert.ok(after[i].distanceTo(before[i].clone().addScaledVector(by, part)) < 1e-3, `point ${i}`);
  }
  assert.ok(after[middle - second + first].distanceTo(before[middle - second + first]) > 0.05, 'the other one shows it too');
  assert.equal(apart(after.slice(0, first), before.slice(0, first)), 0);
});

visits('one finger sculpts, two move the camera', { hash, ...PHONE }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const source = await sculptor.id;
  const before = await pointsOf(source, 3);
  await page.evaluate(() => scrollTo(0, 0));
  const { x, y } = await page.locator('#view').boundingBox();
  const at = await sculptor.at(before[nearest(before, new Vector3(0.5, 0.3, 0.6))]);
  const finger = (dx, dy) => ({ x: x + at.x + dx, y: y + at.y + dy, id: dx > 100 ? 1 : 0 });
  const session = await page.context().newCDPSession(page);
  const touch = (type, ...touchPoints) => session.send('Input.dispatchTouchEvent', { type, touchPoints });
  await touch('touchStart', finger(0, 0));
  await touch('touchEnd');
  await visit.drawn();
  const plain = await visit.pixels(); // the point is picked
  await touch('touchStart', finger(0, 0));
  await touch('touchMove', finger(10, -20));
  await visit.drawn();
  assert.ok(difference(await visit.pixels(), plain) > 0.002);
  await touch('touchStart', finger(10, -20), finger(110, 0));
  await visit.drawn();
  assert.equal(difference(await visit.pixels(), plain), 0, 'the second finger takes the stroke back');
  await touch('touchMove', finger(-20, -20), finger(150, 0));
  await touch('touchEnd');
  await visit.drawn();
  assert.ok(difference(await visit.pixels(), plain) > 0.02, 'the camera has moved');
  assert.equal(await sculptor.id, source);
  await sculptor.look();
  await sculptor.opens(async () => {
    await touch('touchStart', finger(0, 0));
    await touch('touchMove', finger(10, -20));
    await touch('touchEnd');
  });
  assert.ok(apart(await pointsOf(await sculptor.id, 3), before) > 0.05);
});

const BRUSHES = [
  ['Draw', ({ up }) => up > 0.02], ['Inflate', ({ up }) => up > 0.02], ['Smooth', ({ apart: far }) => far > 0.001], ['Flatten', ({ apart: far }) => far > 0.001], ['Crease', ({ up }) => up < -0.02],
];
visits('a stroke of each brush, mirrored', { ...UNDRAWN, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const before = await pointsOf(await sculptor.id, 3);
  await page.getByLabel('Symmetry').selectOption('x');
  for (const [brush, isRight] of BRUSHES) {
    await page.getByRole('button', { name: brush, exact: true }).click();
    await sculptor.slide('Strength', 100);
    await sculptor.drag(before[nearest(before, new Vector3(0.45, 0.7, 0.3))], [30, 10]);
    const after = await pointsOf(await sculptor.id, 3);
    const moves = after.map((point, i) => point.clone().sub(before[i]));
    const most = moves.reduce((best, move) => (move.length() > best.length() ? move : best), new Vector3());
    assert.ok(isRight({ up: most.y, apart: most.length() }), `${brush}: ${most.toArray()}`);
    const mirrored = after.map(({ x, y, z }) => new Vector3(-x, y, z));
    for (const point of after) assert.ok(mirrored.some((other) => other.distanceTo(point) < 1e-4), `${brush}: both sides are alike`);
    await sculptor.opens(() => page.getByRole('button', { name: 'Undo' }).click());
  }
});

visits('strokes go on while one is stored, and each can be undone', { ...UNDRAWN, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const source = await sculptor.id;
  const before = await pointsOf(source, 3);
  const release = await visit.hold('**/detail?**');
  const places = [new Vector3(0.5, 0.3, 0.6), new Vector3(-0.3, 0.7, 0.3), new Vector3(0.1, -0.2, 0.7)];
  for (const place of places) {
    await sculptor.hold(before[nearest(before, place)], [0, -25]);
    await page.mouse.up();
  }
  assert.equal(await sculptor.id, source);
  await sculptor.opens(async () => release());
  const third = await sculptor.id;
  const after = await pointsOf(third, 3);
  for (const place of places) assert.ok(after[nearest(before, place)].distanceTo(before[nearest(before, place)]) > 0.05);
  for (let i = 0; i < 3; i++) await sculptor.opens(() => page.getByRole('button', { name: 'Undo' }).click());
  assert.equal(await sculptor.id, source);
});

/** Begins a stroke at a point of level 3, and ends it after what is done meanwhile. */
async function during(sculptor, [place, by], act) {
  await sculptor.hold(place, by);
  await act();
  await sculptor.page.mouse.up();
}

visits('a level that comes during a stroke waits for the hand', { ...UNDRAWN, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const before = await pointsOf(await sculptor.id, 3);
  const middle = nearest(before, new Vector3(0.5, 0.3, 0.6));
  await sculptor.opens(() => during(sculptor, [before[middle], [40, -40]], async () => {
    const coming = page.waitForResponse(/surface\.glb\?.*level=4/);
    await sculptor.slide('Level', 4);
    await (await coming).finished();
    await page.waitForTimeout(300);
    assert.match(await visit.text('#facts'), /^Level 3/);
  }));
  await visit.level(4);
  const by = await sculptor.moved(before[middle], [40, -40]);
  assert.ok(apart(await pointsOf(await sculptor.id, 3), dragged(before, middle, by)) < 1e-3, 'the stroke is of level 3');
});

visits('a stroke that ends before its points are there is kept', { ...UNDRAWN, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const before = await pointsOf(await sculptor.id, 4);
  const release = await sculptor.holdPoints(4);
  const strokes = [[new Vector3(0.5, 0.3, 0.6), [40, -40]], [new Vector3(-0.3, 0.7, 0.3), [0, -30]]].map(([place, by]) => [nearest(before, place), by]);
  for (const [point, by] of strokes) {
    await sculptor.move(before[point], by);
    await sculptor.page.mouse.up();
  }
  await sculptor.opens(async () => release());
  const after = await pointsOf(await sculptor.id, 4);
  for (const [point, by] of strokes) {
    const wanted = before[point].clone().add(await sculptor.moved(before[point], by));
    assert.ok(after[point].distanceTo(wanted) < 0.02, `${after[point].distanceTo(wanted)}`); // each reaches a little to the other
  }
});

visits('undo takes back the stroke that is in the hand, or being stored', { ...UNDRAWN, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const source = await sculptor.id;
  const before = await pointsOf(source, 3);
  const stroke = [before[nearest(before, new Vector3(0.5, 0.3, 0.6))], [40, -40]];
  await sculptor.drag(...stroke);
  const once = await sculptor.id;
  const place = (await pointsOf(once, 3))[nearest(before, new Vector3(-0.3, 0.7, 0.3))];
  await during(sculptor, [place, [0, -25]], () => page.keyboard.press('Control+z'));
  await page.waitForTimeout(300);
  await visit.drawn();
  assert.equal(await sculptor.id, once, 'the one in the hand has gone, the one before has not');
  const release = await visit.hold('**/detail?**');
  await during(sculptor, [place, [0, -25]], () => {});
  await page.keyboard.press('Control+z');
  release();
  await page.getByRole('button', { name: 'Redo', disabled: false }).waitFor();
  await visit.drawn();
  assert.equal(await sculptor.id, once);
  await sculptor.opens(() => page.keyboard.press('Control+Shift+z'));
  assert.ok((await pointsOf(await sculptor.id, 3))[nearest(before, new Vector3(-0.3, 0.7, 0.3))].distanceTo(place) > 0.05);
});

visits('strokes that are stored after another model was opened are kept as a version', { ...UNDRAWN, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const source = await sculptor.id;
  const before = await pointsOf(source, 3);
  const middle = nearest(before, new Vector3(0.5, 0.3, 0.6));
  const release = await visit.hold('**/detail?**');
  await during(sculptor, [before[middle], [40, -40]], () => {});
  const second = nearest(before, new Vector3(-0.3, 0.7, 0.3));
  const tank = await site.model('tank.json');
  await during(sculptor, [before[second], [0, -30]], () => page.evaluate((id) => (location.hash = `#model=${id}`), tank));
  release();
  await page.locator('.notice', { hasText: 'Kept in the list' }).getByText('block.obj').waitFor();
  assert.equal(await sculptor.id, tank);
  await page.locator('.versions summary').click();
  assert.equal(await page.locator('.version').count(), 3);
  await page.locator('.version').first().click(); // the newest
  await visit.wait((id) => !location.hash.includes(id) && document.getElementById('subject').textContent.startsWith('block.obj'), tank);
  const after = await pointsOf(await sculptor.id, 3);
  assert.ok(after[middle].distanceTo(before[middle]) > 0.1 && after[second].distanceTo(before[second]) > 0.1);
});

visits('a stroke outlives a restart of the daemon', { hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const source = await sculptor.id;
  const before = await pointsOf(source, 3);
  const place = before[nearest(before, new Vector3(0.5, 0.3, 0.6))];
  const plain = await visit.pixels();
  await daemon.stop();
  await sculptor.hold(place, [70, -50]);
  await page.mouse.up();
  const notice = page.locator('.notice', { hasText: 'The stroke cannot be kept' });
  await notice.getByText('The daemon does not answer').waitFor();
  await visit.drawn();
  assert.ok(difference(plain, await visit.pixels()) > 0.002, 'the stroke stays in the picture');
  await daemon.start();
  await sculptor.opens(() => notice.getByRole('button', { name: 'Try again' }).click());
  assert.ok((await pointsOf(await sculptor.id, 3))[before.indexOf(place)].distanceTo(place) > 0.05);
  await sculptor.opens(() => page.getByRole('button', { name: 'Undo' }).click());
  assert.equal(await sculptor.id, source);
  visit.faults = visit.faults.filter((fault) => !fault.includes('net::ERR_'));
});

visits('the wheel with Shift, and brackets, change the radius', { ...UNDRAWN, hash }, async (visit) => {
  const sculptor = await Sculptor.begin(visit);
  const { page } = sculptor;
  const radius = async () => Number(await page.getByRole('slider', { name: 'Radius' }).inputValue());
  const first = await radius();
  await page.locator('#view').hover();
  await page.keyboard.down('Shift');
  await page.mouse.wheel(0, -100);
  await page.keyboard.up('Shift');
  await visit.wait((least) => Number(document.querySelector('[aria-label=Radius]').value) > least, first);
  await page.locator('#view').focus();
  for (let i = 0; i < 3; i++) await page.keyboard.press('[');
  assert.ok((await radius()) < first);
  assert.doesNotMatch(await visit.address(), /view=(?!4%2C3%2C6)/, 'the camera stays');
});

visits('other rules are refused, and left by a click', { ...UNDRAWN, hash: '#tab=sculpt&level=1&scheme=bilinear' }, async (visit) => {
  await visit.level(1);
  await visit.page.getByRole('button', { name: 'Show it so' }).click();
  await visit.wait(() => 'sculpts' in document.querySelector('canvas').dataset);
  assert.doesNotMatch(await visit.address(), /scheme=/);
});
