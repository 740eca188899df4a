// The page at /: whatever comes, there is a picture or a word; the same address shows the same; fields take what
// people write; and it goes on without a graphics card, on small screens and while the daemon is away.
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { Daemon } from '../node/daemon.mjs';
import { Modeller } from './modeller.mjs';
import { ALL_PIXELS, covered, difference, drop, open, PYRAMID, UNDRAWN, Visit } from './page_driver.mjs';

const site = open();
const { daemon, visits } = site;
const blank = (visit) => visit.page.locator('.empty[role=status]');

/** A grid of n x n quads, as OBJ. */
function grid(n) {
  const points = Array.from({ length: (n + 1) ** 2 }, (_, i) => `v ${i % (n + 1)} ${Math.floor(i / (n + 1))} 0`);
  const faces = Array.from({ length: n * n }, (_, i) => {
    const at = Math.floor(i / n) * (n + 1) + (i % n) + 1;
    return `f ${at} ${at + 1} ${at + n + 2} ${at + n + 1}`;
  });
  return [...points, ...faces, ''].join('\n');
}

visits('an address with a time, a view and Follow shows the same picture each time', { hash: '#show=surface,follow' }, async (visit) => {
  await visit.level(2);
  await visit.wait(() => document.querySelectorAll('.ticks line').length > 0);
  await visit.seek(1.9); // the tank has driven away
  await visit.page.locator('canvas').focus();
  for (const key of ['ArrowLeft', 'ArrowUp', '+', '+']) await visit.page.keyboard.press(key);
  await visit.drawn();
  const left = await visit.pixels();
  assert.ok(covered(left) > 0.05);
  const address = await visit.address();
  for (let i = 0; i < 3; i++) {
    const other = await Visit.begin(site.browser, address);
    // The poses come before or after the surface.
    if (i > 0) await other.page.route(i === 1 ? '**/pose.bin**' : '**/surface.glb**', (route) => setTimeout(() => route.fallback(), 700));
    await other.page.reload();
    await other.level(2);
    await other.wait(() => document.querySelector('.clock').textContent.startsWith('1.90'));
    await other.page.waitForTimeout(i > 0 ? 800 : 0);
    await other.drawn();
    assert.ok(difference(left, await other.pixels()) < 0.002, `opening ${i}: ${difference(left, await other.pixels())} differ`);
    await other.end();
  }
  // Without Follow the view is that of the world.
  await visit.page.getByRole('button', { name: 'Follow' }).click();
  await visit.drawn();
  assert.ok(difference(left, await visit.pixels()) < 0.002, 'nothing jumps');
  const other = await Visit.begin(site.browser, await visit.address());
  await other.level(2);
  await other.wait(() => document.querySelector('.clock').textContent.startsWith('1.90'));
  await other.drawn();
  assert.ok(difference(left, await other.pixels()) < 0.002, 'without Follow');
  await other.end();
});

visits('a model opens with the least level whose error is not seen, which the slider and the address tell', { ...UNDRAWN, hash: '#tab=surface', choosesLevel: true }, async (visit) => {
  const { page } = visit;
  const slider = page.getByRole('slider', { name: 'Level' });
  const opens = async (name, level) => {
    await visit.wait((wanted) => document.getElementById('subject').textContent === wanted, name);
    const told = await (await fetch(`${daemon.url}/v1/models/${await visit.model()}/surface.json?level=auto&error=0.1%25&faces=50000`)).json();
    assert.equal(told.level, level, name);
    await visit.level(level);
    await visit.tab('Surface'); // which a drop leaves
    assert.equal(await slider.inputValue(), String(level));
    assert.match(await visit.address(), new RegExp(`level=${level}(&|$)`));
    assert.match(await visit.text('#facts'), new RegExp(`^Level ${level} `));
  };
  await opens('tank.json', 3); // level 4 has 56,320 faces
  const address = await visit.address();
  await drop(visit, { 'square.obj': grid(1) }); // its sides are straight, its corners sharp
  await opens('square.obj', 0);
  assert.match(await page.locator('#view').getAttribute('aria-label'), /level 0: 1 face round/);
  await drop(visit, { 'pyramid.obj': PYRAMID });
  await opens('pyramid.obj', 4);
  await page.getByRole('button', { name: 'Show level 1', exact: true }).click();
  await visit.level(1);
  await page.evaluate(() => (location.hash = location.hash.replace('&level=1', ''))); // an address that names no level
  await opens('pyramid.obj', 4);
  // Others who are sent the address ask nothing else than what it names.
  const other = await Visit.begin(site.browser, `${daemon.url}/version`, { ...UNDRAWN, choosesLevel: true });
  const asked = [];
  other.page.on('request', (request) => asked.push(request.url()));
  await other.page.goto(address);
  await other.level(3);
  assert.ok(asked.some((url) => url.endsWith('surface.glb?level=3')));
  assert.deepEqual(asked.filter((url) => url.includes('auto')), []);
  await other.end();
});

visits('the level of one model is not that of the next, and a large one opens at less', { first: 'cube.obj', hash: '#tab=surface' }, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'pyramid.obj': PYRAMID });
  await visit.wait(() => document.getElementById('subject').textContent === 'pyramid.obj');
  await visit.tab('Surface');
  await visit.page.getByLabel('Scheme').selectOption('bilinear');
  await visit.page.getByRole('button', { name: 'Show level 6' }).click();
  await visit.level(6);
  await drop(visit, { 'scan.obj': grid(230) });
  await visit.wait(() => document.getElementById('subject').textContent === 'scan.obj');
  await visit.level(0); // 52,900 faces; level 1 has 211,600
  assert.match(await visit.text('#facts'), /^Level 0 .* 52,900 faces/);
  assert.doesNotMatch(await visit.address(), /bilinear/);
  assert.ok(covered(await visit.pixels()) > 0.05);
});

visits('until a large model is drawn, coarse at first, the page says that it is', { first: 'cube.obj' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await page.evaluate(() => {
    const { getSyncParameter, viewport } = WebGL2RenderingContext.prototype;
    Object.assign(window, { isHeld: true, widths: [] });
    Object.assign(WebGL2RenderingContext.prototype, {
      getSyncParameter(...given) {
        return window.isHeld ? this.UNSIGNALED : getSyncParameter.apply(this, given);
      },
      viewport(...given) {
        window.widths.push(given[2]);
        viewport.apply(this, given);
      },
    });
  });
  await drop(visit, { 'scan.obj': grid(230) });
  await page.locator('#busy-text', { hasText: 'Drawing' }).waitFor();
  assert.ok(await page.locator('#cancel').isHidden(), 'it cannot be cancelled');
  assert.ok(await page.evaluate(() => window.widths.includes(Math.ceil(document.querySelector('canvas').width / 2))), 'in half the pixels');
  await page.evaluate(() => (window.isHeld = false));
  await page.locator('#busy').waitFor({ state: 'hidden' });
  await visit.level(0);
  assert.ok(covered(await visit.pixels()) > 0.05);
});

visits('a level that is refused leaves the picture, the slider and the address of the last', { first: 'cube.obj', hash: '#tab=surface', refused: [422] }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await drop(visit, { 'scan.obj': grid(60) });
  await visit.wait(() => document.getElementById('facts').textContent.includes(' 57,600 faces'));
  await page.evaluate(() => (location.hash = location.hash.replace('level=2', 'level=15')));
  await page.locator('.notice', { hasText: 'Level 15 cannot be shown' }).waitFor();
  await visit.wait(() => document.querySelector('[aria-label=Level]').value === '2' && /level=2(&|$)/.test(location.hash));
  assert.match(await visit.text('#facts'), /^Level 2/);
  await visit.drawn();
  assert.ok(covered(await visit.pixels()) > 0.05);
});

test('a level that is refused opens as the highest that is allowed, with a word', async () => {
  const own = new Daemon(['--sample', '--max-level', '3', '--max-faces', '10k']);
  await own.start();
  try {
    const ids = Object.fromEntries((await (await fetch(`${own.url}/v1/models`)).json()).models.map(({ name, id }) => [name, id]));
    for (const [name, level] of [['cube.obj', 3], ['tank.json', 2]]) {
      const { levels } = await (await fetch(`${own.url}/v1/models/${ids[name]}/levels.json`)).json();
      assert.equal(levels.findLast(({ refused }) => !refused).level, level, name);
      const visit = await Visit.begin(site.browser, `${own.url}/`, { hash: `#model=${ids[name]}&level=15&show=surface`, refused: [422] });
      await visit.level(level);
      assert.match(await visit.text('.notice'), new RegExp(`Level 15 cannot be shown, level ${level} is`));
      assert.equal(await visit.page.locator('.notice').count(), 1);
      assert.match(await visit.address(), new RegExp(`level=${level}(&|$)`));
      assert.ok(covered(await visit.pixels()) > 0.02);
      await visit.end();
    }
  } finally {
    await own.remove();
  }
});

visits('what an address says that means nothing is left out, with a word', { ...UNDRAWN, first: 'tank.json', hash: '#level=abc&tab=nonsense&scheme=foo&theme=purple&t=x&mesh=-1&weight=7&order=QQQ' }, async (visit) => {
  const { page } = visit;
  const notice = page.locator('.notice', { hasText: 'Left out of the address' });
  const says = async (...all) => {
    for (const one of all) assert.ok((await notice.last().innerText()).includes(one), one);
  };
  await visit.level(2);
  await says('level=abc', 'tab=nonsense', 'scheme=foo', 'theme=purple', 't=x', 'mesh=-1', 'weight=7', 'order=QQQ');
  assert.doesNotMatch(await visit.address(), /abc|nonsense|foo|purple|QQQ/);
  assert.equal(await page.getByRole('tab', { name: 'Models' }).getAttribute('aria-selected'), 'true');
  await notice.getByRole('button', { name: 'Close' }).click();
  await page.evaluate(() => (location.hash = location.hash.replace('level=2', 'level=-1&boundary=bar')));
  await visit.wait(() => document.querySelector('.notice'));
  await says('level=-1', 'boundary=bar');
  await visit.level(2);
  for (const name of ['Edit', 'Rotation', 'Scripts']) await visit.tab(name);
  assert.equal(await page.locator('.notice').count(), 1);
});

visits('a first level that is cancelled leaves the control mesh; a model that is gone, a word and a way on', { refused: [404] }, async (visit) => {
  await visit.level(2);
  const id = await visit.model();
  const other = await Visit.begin(site.browser, `${daemon.url}/models`.replace('/models', '/version'));
  const release = await other.hold('**/surface.glb?level=2', (route) => route.abort());
  await other.page.goto(`${daemon.url}/#model=${id}&show=surface`);
  await other.page.locator('#busy-text', { hasText: 'Level 2' }).waitFor();
  await other.page.locator('#cancel').click();
  await other.level(0);
  release();
  assert.ok(covered(await other.pixels()) > 0.02);
  await other.end();
  await visit.page.evaluate(() => (location.hash = `model=${'ab'.repeat(32)}`));
  await blank(visit).getByRole('heading', { name: 'The model cannot be opened' }).waitFor();
  await visit.page.locator('.notice .close').click();
  await visit.drawn();
  assert.equal(covered(await visit.pixels()), 0, 'nothing of the former model stays');
  for (const name of ['Surface', 'Download']) assert.equal(await visit.page.getByText(name, { exact: true }).and(visit.page.locator('.chip, #download')).isVisible(), false, name);
  await visit.page.route('**/v1/models?**', (route) => setTimeout(() => route.fallback(), 500)); // the model is known to be gone before others are listed
  await visit.page.reload();
  await blank(visit).getByRole('button', { name: 'Another model' }).click();
  await visit.level(2);
  assert.ok(await blank(visit).isHidden());
  assert.ok(covered(await visit.pixels()) > 0.02);
});

visits('a file whose opening was cancelled opens when it is given again', UNDRAWN, async (visit) => {
  await visit.level(2);
  const { page } = visit;
  const isOne = /\/v1\/models\/\w+$/;
  await page.route(isOne, () => {}); // it is never answered
  await drop(visit, { 'again.obj': PYRAMID });
  await page.locator('#busy-text', { hasText: 'Reading the model' }).waitFor();
  await page.locator('#cancel').click();
  await blank(visit).getByRole('heading', { name: 'The model cannot be opened' }).waitFor();
  await page.unroute(isOne);
  await drop(visit, { 'again.obj': PYRAMID });
  await visit.wait(() => document.getElementById('facts').textContent.includes(' 64 faces'));
  assert.ok(await blank(visit).isHidden());
});

visits('from the first on the picture has the size that it keeps beside the player’s bar', { ...UNDRAWN, isAlone: true }, async (visit) => {
  const { page } = visit;
  await page.addInitScript(() => {
    const { set, ...others } = Object.getOwnPropertyDescriptor(HTMLCanvasElement.prototype, 'height');
    window.heights = new Set();
    Object.defineProperty(HTMLCanvasElement.prototype, 'height', { ...others, set(height) {
      if (this.id === 'view') window.heights.add(height);
      set.call(this, height);
    } });
  });
  for (const width of [1280, 800]) {
    await page.setViewportSize({ width, height: 640 });
    await page.reload();
    await visit.level(2);
    assert.ok(await page.getByRole('button', { name: 'Play' }).isVisible());
    assert.equal(await page.evaluate(() => window.heights.size), 1, `${width} pixels wide`);
  }
});

visits('nothing of the former model stays beside one that cannot be opened', { ...UNDRAWN, first: 'tank.json', refused: [404] }, async (visit) => {
  await visit.level(2);
  const { page } = visit;
  const panel = (name) => page.locator(`#panel-${name}`);
  await visit.tab('Rotation');
  await page.locator('.verdict').waitFor();
  await page.evaluate(() => (location.hash = `tab=animation&model=${'ab'.repeat(32)}`));
  await blank(visit).getByRole('heading', { name: 'The model cannot be opened' }).waitFor();
  assert.equal(await page.locator('#timeline').isVisible(), false);
  assert.equal(await panel('animation').innerText(), 'Rotation\n\nA clip’s rotation tracks are shown here as curves.');
  assert.equal(await page.locator('.outliner').count(), 0);
  await visit.tab('Sculpt');
  assert.equal(await panel('sculpt').innerText(), 'Sculpt\n\nOpen a model, or make a shape.');
  for (const name of ['surface', 'scripts']) {
    await page.locator(`#tab-${name}`).click();
    assert.equal(await panel(name).locator('input, button, select, a, pre').and(page.locator(':visible')).count(), 0, name);
  }
  assert.equal(await page.title(), 'tweend');
  assert.equal(await page.locator('#view').getAttribute('aria-label'), 'No model');
  await blank(visit).getByRole('button', { name: 'Another model' }).click();
  await visit.level(2);
  assert.ok(await page.locator('#timeline').isVisible());
});

visits('numbers are taken as the browser’s language writes them, by Enter, and what is none is said', { ...UNDRAWN, first: 'cube.obj', hash: '#tab=edit', locale: 'de-DE' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  const sizeOf = async () => {
    const { meshes: [{ bounds: { min, max } }] } = await (await fetch(`${daemon.url}/v1/models/${await visit.model()}`)).json();
    return max.map((value, i) => value - min[i]);
  };
  const modeller = new Modeller(visit);
  await modeller.shape('Box');
  const before = await visit.model();
  const field = page.getByLabel('Box: size');
  for (const wrong of ['much', '1 2', '']) {
    await field.fill(wrong);
    await field.press('Enter');
    assert.equal(await field.getAttribute('aria-invalid'), 'true', wrong);
    assert.match(await field.evaluate((input) => input.validationMessage), /3 numbers/);
  }
  await field.fill('1 x 1');
  await page.keyboard.press('Tab');
  assert.equal(await field.getAttribute('aria-invalid'), 'true', 'it is said as soon as the field is left');
  assert.equal(await visit.model(), before);
  for (const [text, size] of [['0,25 2,5 1', [0.25, 2.5, 1]], ['1; 0,5; 3', [1, 0.5, 3]], ['2, 0.5, 1', [2, 0.5, 1]], ['2,3,4', [2, 3, 4]]]) {
    const last = await visit.model();
    await field.fill(text);
    assert.equal(await field.getAttribute('aria-invalid'), 'false');
    await field.press('Enter');
    await visit.wait((id) => !location.hash.includes(id) && document.getElementById('facts').textContent.startsWith('Level'), last);
    assert.deepEqual(await sizeOf(), size, text);
  }
});

visits('a graphics context that was lost comes back', { first: 'cube.obj', ...ALL_PIXELS, hash: '#show=surface' }, async (visit) => {
  await visit.level(2);
  const before = await visit.pixels();
  await visit.page.evaluate(async () => {
    const canvas = document.getElementById('view');
    const told = (name) => new Promise((resolve) => canvas.addEventListener(name, resolve, { once: true }));
    const context = canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
    const lost = told('webglcontextlost');
    context.loseContext();
    await lost;
    await new Promise((resolve) => setTimeout(resolve));
    const restored = told('webglcontextrestored');
    context.restoreContext();
    await restored;
  });
  await visit.drawn();
  assert.ok(difference(before, await visit.pixels()) < 0.002);
});

test('without WebGL all but the picture works', async () => {
  const visit = await Visit.begin(site.browser, `${daemon.url}/version`);
  await visit.page.context().addInitScript(() => {
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      return /webgl/.test(kind) ? null : getContext.call(this, kind, ...rest);
    };
  });
  await visit.page.goto(`${daemon.url}/#tab=surface`);
  await visit.page.getByText('This browser has no WebGL 2').waitFor();
  await visit.page.getByRole('button', { name: 'Show level 1', exact: true }).click();
  await visit.wait(() => document.getElementById('facts').textContent.startsWith('Level 1'));
  await drop(visit, { 'pyramid.obj': PYRAMID });
  await visit.wait(() => document.getElementById('subject').textContent === 'pyramid.obj');
  await visit.tab('Scripts');
  await visit.page.locator('#panel-scripts pre').first().waitFor();
  visit.faults = visit.faults.filter((fault) => !/WebGL/.test(fault)); // three.js says so too
  await visit.end();
});

visits('in a browser that keeps nothing all works', { ...UNDRAWN, first: 'cube.obj', isAlone: true }, async (visit) => {
  const { page } = visit;
  await page.addInitScript(() => {
    for (const name of ['localStorage', 'sessionStorage']) Object.defineProperty(window, name, { get: () => { throw new DOMException('denied', 'SecurityError'); } });
  });
  await page.reload();
  await visit.level(2);
  await page.getByRole('button', { name: 'Change to the dark theme' }).click();
  await drop(visit, { 'pyramid.obj': PYRAMID });
  await visit.wait(() => document.getElementById('subject').textContent === 'pyramid.obj');
});

visits('a page magnified to 400 %, and a phone held sideways, have a panel that can be read, and all tools', { ...UNDRAWN, first: 'tank.json' }, async (visit) => {
  await visit.level(2);
  const slider = visit.page.getByRole('slider', { name: 'Level' }).first();
  for (const viewport of [{ width: 320, height: 200 }, { width: 844, height: 390 }]) {
    await visit.page.setViewportSize(viewport);
    await visit.tab('Edit');
    await visit.page.getByRole('toolbar', { name: 'Tools' }).waitFor();
    const hidden = await visit.page.locator('.tools button').evaluateAll((buttons) => {
      scrollTo(0, 0);
      const stage = document.getElementById('stage').getBoundingClientRect();
      const isIn = ({ left, right, top, bottom }) => left >= stage.left && right <= stage.right && top >= stage.top && bottom <= stage.bottom;
      const isOnTop = (button, { left, top, width, height }) => button.contains(document.elementFromPoint(left + width / 2, top + height / 2));
      return buttons.filter((button) => !isIn(button.getBoundingClientRect()) || !isOnTop(button, button.getBoundingClientRect())).map(({ title }) => title);
    });
    assert.deepEqual(hidden, [], `${viewport.width} pixels wide`);
    await visit.tab('Surface');
    await slider.scrollIntoViewIfNeeded();
    const isSeen = await slider.evaluate((element) => {
      const { left, top, width, height } = element.getBoundingClientRect();
      return element.contains(document.elementFromPoint(left + width / 2, top + height / 2));
    });
    assert.ok(isSeen, `${viewport.width} pixels wide`);
    assert.ok(await visit.page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `nothing reaches beyond ${viewport.width} pixels`);
    await visit.picture(`panel ${viewport.width}`);
  }
});

visits('the panel keeps its width, and what is liked, over visits; in a small window the picture keeps its part', { ...UNDRAWN, first: 'cube.obj', hash: '#tab=surface' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  const width = () => page.locator('aside').evaluate(({ clientWidth }) => clientWidth);
  const line = page.getByRole('separator', { name: 'Width of the panel' });
  const box = await line.boundingBox();
  await page.mouse.move(box.x + 4, box.y + 100);
  await page.mouse.down();
  await page.mouse.move(box.x - 140, box.y + 100, { steps: 3 });
  await page.mouse.up();
  const wide = await width();
  assert.ok(wide > 480, `${wide}`);
  await page.getByRole('button', { name: 'Change to the dark theme' }).click();
  for (const again of [() => page.reload(), () => page.goto(`${daemon.url}/version`).then(() => page.goto(`${daemon.url}/`))]) {
    await again();
    await visit.wait(() => document.querySelector('html[data-theme=dark]'));
    assert.equal(await width(), wide);
  }
  assert.doesNotMatch(await visit.address(), /panel|theme/);
  await page.setViewportSize({ width: 780, height: 640 });
  assert.ok((await page.locator('#stage').boundingBox()).width >= 300);
});

visits('nothing moves by itself for those who want less motion', { ...UNDRAWN, first: 'cube.obj', hash: '#turntable=true' }, async (visit) => {
  await visit.level(2);
  const animated = await visit.page.evaluate(() => {
    document.getElementById('busy').hidden = false;
    return document.getAnimations().length;
  });
  assert.equal(animated, 0);
  assert.equal(await visit.page.getByLabel('Turntable').isChecked(), false);
  const frames = () => visit.page.evaluate(() => document.querySelector('canvas').dataset.frames);
  await visit.wait(() => document.querySelector('.model[aria-current] img.thumbnail')); // for which a frame is drawn, two seconds after the first
  await visit.drawn();
  const before = await frames();
  await visit.page.waitForTimeout(200);
  assert.equal(await frames(), before);
});

visits('a clip that cannot be opened leaves the picture to what is done next', { isAlone: true, hash: '#show=surface' }, async (visit) => {
  // A fault where none is expected: the list of clips cannot be filled.
  await visit.page.addInitScript(() => (HTMLSelectElement.prototype.replaceChildren = () => {
    throw new Error('provoked');
  }));
  await visit.page.reload();
  await visit.wait(() => document.getElementById('facts').textContent.startsWith('Level 2'));
  await visit.page.waitForTimeout(1200);
  await visit.drawn();
  const before = await visit.pixels();
  await visit.shows('surface', false);
  assert.ok(difference(before, await visit.pixels()) > 0.02);
  visit.faults = visit.faults.filter((fault) => !fault.includes('provoked'));
});

visits('forced colours show which chips are pressed', { ...UNDRAWN, first: 'cube.obj', forcedColors: 'active' }, async (visit) => {
  await visit.level(2);
  const colourOf = (name) => visit.page.locator(`#shown [data-name=${name}]`).evaluate((chip) => getComputedStyle(chip).backgroundColor);
  assert.equal(await visit.page.locator('#shown [data-name=surface]').getAttribute('aria-pressed'), 'true');
  assert.notEqual(await colourOf('surface'), await colourOf('uv'));
  const [seen, meant] = await visit.page.locator('.legend i').first().evaluate((dot) => [getComputedStyle(dot).backgroundColor, dot.style.backgroundColor]);
  assert.equal(seen.replaceAll(' ', ''), meant.replaceAll(' ', ''), 'and what the legend tells of');
});

test('a live stream that is down says so, and that it is back', async () => {
  const own = new Daemon(['--sample']);
  await own.start();
  const visit = await Visit.begin(site.browser, `${own.url}/`, UNDRAWN);
  try {
    await visit.level(2);
    const live = visit.page.locator('#timeline .chip');
    await live.click();
    await visit.wait(() => Number.parseFloat(document.querySelector('.clock').textContent) > 0); // frames come
    await own.stop();
    await visit.wait(() => document.querySelector('#timeline .chip').textContent === 'Live: no answer');
    await own.start();
    await visit.wait(() => document.querySelector('#timeline .chip').textContent === 'Live');
    await live.click();
    const release = await visit.hold('**/live?**');
    const asked = visit.page.waitForRequest('**/live?**');
    await live.click();
    await asked;
    await visit.wait(() => document.querySelector('#timeline .chip').textContent === 'Live: no answer'); // also before its first frame
    assert.equal(await live.getAttribute('aria-pressed'), 'true');
    release();
    await visit.wait(() => document.querySelector('#timeline .chip').textContent === 'Live');
    visit.faults = visit.faults.filter((fault) => !/net::ERR|status of 503/.test(fault));
    await visit.end();
  } finally {
    await own.remove();
  }
});

visits('edits, undo and deletes keep the focus and what is scrolled to', { ...UNDRAWN, hash: '#tab=edit' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  const opens = async (action) => {
    const last = await visit.model();
    await action();
    await visit.wait((id) => !location.hash.includes(id) && document.getElementById('facts').textContent.startsWith('Level'), last);
    await visit.wait(() => 'pickable' in document.querySelector('canvas').dataset);
  };
  const place = () => page.evaluate(() => [document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent, document.getElementById('panel').scrollTop]);
  await new Modeller(visit).shape('Box');
  await page.getByLabel('Selection').fill('"all"');
  await page.getByLabel('Selection').press('Enter');
  const field = page.getByLabel('Move: by');
  await field.scrollIntoViewIfNeeded();
  await field.focus();
  const before = await place();
  assert.equal(before[0], 'Move: by');
  await opens(() => field.press('Enter'));
  assert.deepEqual(await place(), before);
  await opens(() => page.getByRole('button', { name: 'Undo' }).click());
  assert.deepEqual(await place(), ['Redo', before[1]]);
  await visit.tab('Models');
  const names = () => page.locator('.model .name').allInnerTexts();
  const rename = page.getByRole('button', { name: 'Rename octopus.obj' });
  await rename.focus();
  await page.keyboard.press('Enter');
  await page.getByRole('dialog').getByLabel('Name').fill('Z, the last');
  await page.keyboard.press('Enter');
  await visit.wait(() => [...document.querySelectorAll('.model .name')].at(-1).textContent === 'Z, the last');
  assert.equal(await visit.focused(), 'Rename Z, the last');
  const all = await names();
  await page.getByRole('button', { name: 'Delete cube.obj' }).click();
  await visit.wait((count) => document.querySelectorAll('.model').length === count, all.length - 1);
  await page.waitForLoadState('networkidle');
  assert.ok(await page.evaluate(() => document.activeElement.matches('.model')), 'the focus is on a model');
});

for (const [width, height] of [[390, 600], [320, 256], [812, 390], [1280, 800]])
  visits(`three notices cover no button of a stage of ${width} x ${height}`, { ...UNDRAWN, viewport: { width, height }, refused: [500] }, async (visit) => {
    const { page } = visit;
    await visit.level(2);
    const detail = 'There are several lines of words about what has failed here, as the daemon has them for what is seldom.';
    await page.route('**/v1/models/0*', (route) => route.fulfill({ status: 500, contentType: 'application/problem+json', body: JSON.stringify({ status: 500, title: 'Failed', detail }) }));
    await page.evaluate(() => (location.hash = '#model=00000000000000000000000000000000'));
    const again = blank(visit).getByRole('button', { name: 'Try again' });
    for (let notices = 1; notices <= 3; notices++) {
      await visit.wait((count) => document.querySelectorAll('.notice').length === count, notices);
      await again.click({ timeout: 5000 }); // playwright refuses where something else would get the click
    }
    await page.locator('.notice .close').last().click({ timeout: 5000 });
    await page.getByRole('button', { name: 'New shape' }).click({ timeout: 5000 });
    await page.keyboard.press('Escape');
    await page.evaluate(() => scrollTo(0, document.body.scrollHeight)); // the panel goes on below a small stage
    await page.locator('.model').last().click({ timeout: 5000 });
    await visit.level(2);
  });
