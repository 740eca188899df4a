// The page at /: what it shows, on every screen and by keyboard.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { test } from 'node:test';

import { ALL_PIXELS, covered, DESKTOP, difference, drop, open, PHONE, TABLET, UNDRAWN, Visit } from './page_driver.mjs';

const axe = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const site = open();
const { daemon, visits } = site;

test('its bytes are few, its tag is strong, its policy allows no inline code', async () => {
  const answer = await fetch(`${daemon.url}/`, { headers: { 'Accept-Encoding': 'gzip' } });
  const policy = answer.headers.get('Content-Security-Policy');
  assert.match(answer.headers.get('ETag'), /^"/);
  assert.doesNotMatch(policy, /unsafe-inline|unsafe-eval(?<!wasm-unsafe-eval)|https?:/);
  const size = Number(answer.headers.get('Content-Length'));
  console.log(`# the page has ${size} bytes`);
  assert.ok(size < 300000, `${size} bytes`);
  const html = await answer.text();
  assert.doesNotMatch(html.replace(/<script[^]*?<\/script>/g, ''), /(?:href|src)=["']?(?:https?:)?\/\//);
});

visits('the tank is there, its cage over it', DESKTOP, async (visit) => {
  await visit.level(2);
  await visit.picture('desktop light');
  for (const name of ['cage', 'points']) await visit.shows(name, false);
  const plain = await visit.pixels();
  assert.ok(covered(plain) > 0.1 && covered(plain) < 0.8, `${covered(plain)} of the picture is covered`);
  await visit.shows('cage', true);
  const caged = await visit.pixels();
  assert.ok(difference(plain, caged) > 0.005, 'the cage is seen');
  await visit.shows('points', true);
  assert.ok(difference(caged, await visit.pixels()) > 0.0005, 'extraordinary points are seen');
  assert.match(await visit.text('#legend'), /valence under 4[^]*crease 3/);
  assert.match(await visit.text('#facts'), /^Level 2 · 3,530 points · 3,520 faces · 137 kB · [\d.]+ ms$/);
});

/** A ball with steep folds in 2 n x n quads, as OBJ. */
function folds(n) {
  const at = (i, k) => i * 2 * n + (k % (2 * n)) + 1;
  const points = Array.from({ length: 2 * n * (n + 1) }, (_, i) => {
    const [a, b] = [(Math.PI * (Math.floor(i / (2 * n)) + 0.5)) / (n + 1), (Math.PI * (i % (2 * n))) / n];
    const radius = 1 + Math.sin(a) ** 2 * (0.1 * Math.sin(9 * b + 3 * Math.sin(5 * a)) + 0.06 * Math.tanh(4 * Math.sin(23 * a + 2 * Math.sin(3 * b))));
    return `v ${[Math.sin(a) * Math.cos(b), Math.cos(a), Math.sin(a) * Math.sin(b)].map((x) => (radius * x).toFixed(5)).join(' ')}`;
  });
  const faces = Array.from({ length: 2 * n * n }, (_, i) => {
    const [row, k] = [Math.floor(i / (2 * n)), i % (2 * n)];
    return `f ${at(row, k)} ${at(row, k + 1)} ${at(row + 1, k + 1)} ${at(row + 1, k)}`;
  });
  return [...points, ...faces, ''].join('\n');
}

/** How many pixels are brighter than all that are round them. */
function dots(pixels, width) {
  let count = 0;
  const beside = [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((x) => 4 * (y * width + x))).filter(Boolean);
  for (let i = 4 * (width + 1); i < pixels.length - 4 * (width + 1); i += 4) if (beside.every((way) => pixels[i] - pixels[i + way] > 40)) count++;
  return count;
}

visits('no dots along the folds of a dense surface', { ...ALL_PIXELS, hash: '#show=surface&panel=0' }, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'folds.obj': folds(200) });
  await visit.wait(() => document.getElementById('facts').textContent.includes('80,000 faces'));
  await visit.drawn();
  await visit.picture('folds');
  const found = dots(await visit.pixels(), 1120);
  assert.ok(found < 5, `${found} dots`);
});

visits('on a phone no label of a field touches it', { ...UNDRAWN, first: 'cube.obj', ...PHONE, hash: '#tab=edit' }, async (visit) => {
  await visit.level(2);
  for (const kind of ['Faces', 'Edges', 'Points']) {
    await visit.page.getByRole('button', { name: kind, exact: true }).and(visit.page.locator('.chip')).first().tap();
    const gaps = await visit.page.evaluate(() => {
      for (const details of document.querySelectorAll('#panel details')) details.open = true;
      return [...document.querySelectorAll('#panel .parameter')].filter((label) => label.checkVisibility()).map((label) => {
        const text = document.createRange();
        text.selectNodeContents(label.firstChild);
        return [label.textContent, label.lastChild.getBoundingClientRect().left - text.getBoundingClientRect().right];
      });
    });
    assert.ok(gaps.length > 5, `${gaps.length} fields`);
    assert.deepEqual(gaps.filter(([, gap]) => gap < 5), [], kind);
  }
});

for (const [width, height, forcedColors] of [[1000, 700, 'none'], [320, 256, 'none'], [1280, 800, 'active']])
  visits(`no number in a field is cut off in ${width} x ${height} pixels, forced colours: ${forcedColors}`, { ...UNDRAWN, viewport: { width, height }, forcedColors, hash: '#tab=edit' }, async (visit) => {
    await visit.level(2);
    for (const tab of ['Edit', 'Sculpt']) {
      await visit.tab(tab);
      const fields = await visit.page.evaluate(() => {
        for (const details of document.querySelectorAll('#panel details')) details.open = true;
        return [...document.querySelectorAll('#panel .parameter input')].filter((field) => field.checkVisibility()).map((field) => [field.ariaLabel, field.scrollWidth - field.clientWidth]);
      });
      assert.ok(fields.length > 1, `${fields.length} fields`);
      assert.deepEqual(fields.filter(([, more]) => more > 1), [], tab);
    }
  });

/** A square of side 1 in n x n quads, as OBJ. */
function grid(n) {
  const points = Array.from({ length: (n + 1) ** 2 }, (_, i) => `v ${(i % (n + 1)) / n} ${Math.floor(i / (n + 1)) / n} 0`);
  const faces = Array.from({ length: n * n }, (_, i) => {
    const at = Math.floor(i / n) * (n + 1) + (i % n) + 1;
    return `f ${at} ${at + 1} ${at + n + 2} ${at + n + 1}`;
  });
  return [...points, ...faces, ''].join('\n');
}

visits('a dense cage does not hide its surface, and is seen from nearby', { first: 'cube.obj' }, async (visit) => {
  await visit.level(2);
  const share = async () => {
    await visit.shows('cage', false);
    const plain = await visit.pixels();
    await visit.shows('cage', true);
    return difference(plain, await visit.pixels(), 150); // black lines
  };
  await drop(visit, { 'dense.obj': grid(150) });
  await visit.wait(() => document.getElementById('facts').textContent.includes('Level 1 · 90,601 points · 90,000 faces'));
  await visit.drawn();
  const far = await share();
  await visit.page.locator('canvas').focus();
  for (let i = 0; i < 20; i++) await visit.page.keyboard.press('+');
  await visit.drawn();
  const near = await share();
  assert.ok(far < 0.02 && near > 0.05, `${far} of the picture is changed by the cage, ${near} from nearby`);
});

visits('the shadow is that of the model, whatever its triangles are', { first: 'cube.obj', hash: '#show=surface,floor' }, async (visit) => {
  const pictures = [];
  for (const [across, along, faces] of [[1, 2500, '40,000'], [50, 50, '40,000']]) { // strips and squares
    const points = Array.from({ length: (across + 1) * (along + 1) }, (_, i) => `v ${(i % (across + 1)) / across} 0 ${Math.floor(i / (across + 1)) / along}`);
    const plate = Array.from({ length: across * along }, (_, i) => {
      const at = Math.floor(i / across) * (across + 1) + (i % across) + 1;
      return `f ${at} ${at + across + 1} ${at + across + 2} ${at + 1}`;
    });
    await drop(visit, { [`plate${across}.obj`]: [...points, ...plate, ''].join('\n') });
    await visit.wait(([name, count]) => document.getElementById('subject').textContent === name &&
      document.getElementById('facts').textContent.includes(`${count} faces`), [`plate${across}.obj`, faces]);
    await visit.drawn();
    await visit.picture(`plate${across}`);
    pictures.push(await visit.pixels());
  }
  const apart = difference(...pictures, 12);
  assert.ok(apart < 0.02 && covered(pictures[0]) > 0.1, `${apart} of the picture differ`);
});

visits('creases of a glTF are found, and stay on its edges', { ...ALL_PIXELS, hash: '#show=cage&tab=surface' }, async (visit) => {
  await visit.level(2);
  // The sample cube as glTF, its node turned and moved; then the same under a joint that bends it.
  const cube = await (await fetch(`${daemon.url}/v1/models/${await site.model('cube.obj')}/surface.gltf?level=0&polygons=ngon&normals=none`)).json();
  cube.nodes[0] = { ...cube.nodes[0], translation: [1, 2, 3], rotation: [0, 0.6, 0, 0.8] };
  const open = async (name, document) => {
    await drop(visit, { [name]: JSON.stringify(document) });
    await visit.wait((wanted) => document.getElementById('subject').textContent === wanted, name);
    await visit.wait(() => document.getElementById('facts').textContent.startsWith('Level 2'));
    await visit.tab('Surface');
    for (;;) {
      await visit.drawn();
      const pixels = await visit.pixels();
      if (covered(pixels) > 0.002) return pixels; // its cage is there
    }
  };
  const isPurple = (pixels, i) => pixels[i] > pixels[i + 1] + 40 && pixels[i + 2] > pixels[i + 1] + 10;
  const purple = (pixels) => {
    let count = 0;
    for (let i = 0; i < pixels.length; i += 4) if (isPurple(pixels, i)) count++;
    return count;
  };
  const smooth = await open('cube.gltf', cube);
  assert.equal(purple(smooth), 0);
  await visit.page.getByLabel('Creases').selectOption('auto');
  await visit.wait(() => document.getElementById('legend').textContent.includes('crease, infinite'));
  await visit.drawn();
  const creased = await visit.pixels();
  assert.ok(purple(creased) > 500, `${purple(creased)} pixels of creases`);
  await visit.picture('creases');
  // All edges of the cube are creases: these reach as far as the cage.
  const { width } = await visit.page.locator('#stage').boundingBox();
  const reach = (pixels, is) => {
    const found = { left: Infinity, right: 0, top: Infinity, bottom: 0 };
    for (let i = 0; i < pixels.length; i += 4) {
      if (!is(pixels, i)) continue;
      const [x, y] = [(i / 4) % width, Math.floor(i / 4 / width)];
      found.left = Math.min(found.left, x);
      found.right = Math.max(found.right, x);
      found.top = Math.min(found.top, y);
      found.bottom = Math.max(found.bottom, y);
    }
    return found;
  };
  const cage = reach(smooth, (pixels, i) => pixels[i] < 120);
  const found = reach(creased, isPurple);
  for (const side of Object.keys(cage)) assert.ok(Math.abs(cage[side] - found[side]) < 5, `${side}: ${cage[side]} of the cage, ${found[side]} of creases`);
  await visit.page.getByLabel('Creases').selectOption('none');
  await visit.wait(() => document.getElementById('legend').hidden || !document.getElementById('legend').textContent.includes('crease'));
  await visit.page.getByLabel('Creases').selectOption('auto');
  // Joints: one that holds all points, moved up.
  const places = Buffer.from(cube.buffers[0].uri.split(',')[1], 'base64');
  const count = cube.accessors[cube.meshes[0].primitives[0].attributes.POSITION].count;
  const skin = Buffer.concat([Buffer.alloc(4 * count), Buffer.from(new Float32Array(Array.from({ length: 4 * count }, (_, i) => (i % 4 ? 0 : 1))).buffer)]);
  const start = places.length;
  cube.buffers[0] = { byteLength: start + skin.length, uri: `data:application/octet-stream;base64,${Buffer.concat([places, skin]).toString('base64')}` };
  cube.bufferViews.push({ buffer: 0, byteOffset: start, byteLength: 4 * count }, { buffer: 0, byteOffset: start + 4 * count, byteLength: 16 * count });
  cube.accessors.push({ bufferView: cube.bufferViews.length - 2, componentType: 5121, count, type: 'VEC4' }, { bufferView: cube.bufferViews.length - 1, componentType: 5126, count, type: 'VEC4' });
  Object.assign(cube.meshes[0].primitives[0].attributes, { JOINTS_0: cube.accessors.length - 2, WEIGHTS_0: cube.accessors.length - 1 });
  cube.nodes = [{ mesh: 0, skin: 0, translation: [1, 2, 3] }, { name: 'joint', translation: [0, 5, 0], scale: [1, 2, 1] }];
  cube.skins = [{ joints: [1] }];
  cube.scenes = [{ nodes: [0, 1] }];
  cube.extensionsRequired = cube.extensionsUsed = undefined;
  await open('skin.gltf', cube);
  await visit.page.getByLabel('Creases').selectOption('auto');
  await visit.wait(() => document.getElementById('legend').textContent.includes('crease, infinite'));
  await visit.drawn();
  const skinned = await visit.pixels();
  await visit.picture('creases of a skin');
  assert.ok(purple(skinned) > 150, `${purple(skinned)} pixels of creases`);
  // So do the extraordinary points, the cube's corners.
  for (const name of ['surface', 'cage']) await visit.shows(name, false);
  await visit.shows('points', true);
  const corners = reach(await visit.pixels(), (pixels, i) => pixels[i + 2] > 180 && pixels[i] < 100);
  const creases = reach(skinned, isPurple);
  for (const side of Object.keys(creases)) assert.ok(Math.abs(creases[side] - corners[side]) < 8, `${side}: ${creases[side]} of creases, ${corners[side]} of corners`);
});

visits('each overlay changes the picture, and goes again', {}, async (visit) => {
  await visit.level(2);
  const usual = await visit.pixels();
  for (const name of ['wireframe', 'normals', 'skeleton']) {
    await visit.shows(name, true);
    assert.ok(difference(usual, await visit.pixels()) > 0.001, name);
    await visit.shows(name, false);
    assert.ok(difference(usual, await visit.pixels()) < 0.0005, `${name} is gone`);
  }
});

visits('levels that were loaded tell the server’s milliseconds', { ...UNDRAWN, first: 'cube.obj', hash: '#tab=surface' }, async (visit) => {
  await visit.level(2);
  await visit.wait(() => document.querySelector('tr[data-level="7"]'));
  await visit.page.getByRole('button', { name: 'Show level 3' }).click();
  await visit.level(3);
  const told = await visit.page.locator('#panel-surface tbody tr').evaluateAll((rows) => rows.map(({ lastElementChild }) => lastElementChild.textContent));
  for (const [level, text] of told.entries()) assert.match(text, level === 2 || level === 3 ? /^[\d.]+ ms$/ : /^–$/, `level ${level}`);
});

visits('a large cage is drawn where somebody asks for it', { first: 'cube.obj', hash: '#level=0&show=cage' }, async (visit) => {
  await visit.level(0);
  await drop(visit, { 'grid.json': JSON.stringify({ meshes: [{ shape: { kind: 'grid', size: [4, 4], segments: [320, 320] } }] }) });
  const ask = visit.page.getByRole('button', { name: 'Draw it' });
  await ask.waitFor();
  assert.match(await visit.text('#legend'), /a cage of 205,440 edges is not drawn/);
  await visit.drawn();
  assert.ok(covered(await visit.pixels()) < 0.001);
  await ask.click();
  await ask.waitFor({ state: 'detached' });
  let seen = 0;
  for (let looks = 0; seen < 0.1 && looks < 60; looks++) {
    await visit.page.waitForTimeout(250);
    seen = covered(await visit.pixels());
  }
  assert.ok(seen > 0.1, `${seen} of the picture is covered`);
});

visits('a checker lies along the UVs', { first: 'cube.obj', hash: '#show=surface' }, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'square.obj': 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n' });
  await visit.wait(() => document.getElementById('subject').textContent === 'square.obj');
  await visit.level(2);
  const plain = await visit.pixels();
  await visit.shows('uv', true);
  assert.ok(difference(plain, await visit.pixels()) > 0.05);
});

visits('a large model is drawn beside the canvas: coarse while it turns, then fine, and its URL brings back that', { viewport: { width: 1280, height: 640 }, hash: '#level=4&show=surface' }, async (visit) => {
  await visit.level(4);
  await visit.drawn();
  const still = await visit.pixels();
  assert.ok(covered(still) > 0.1, `${covered(still)} of the picture is covered`);
  const box = await visit.page.locator('#view').boundingBox();
  await visit.page.mouse.move(box.x + 300, box.y + 300);
  await visit.page.mouse.down();
  await visit.page.mouse.move(box.x + 420, box.y + 340, { steps: 4 });
  await visit.page.mouse.up();
  for (let i = 0; i < 8; i++) await visit.page.mouse.wheel(0, -200); // until it reaches all edges
  await visit.wait(() => 'unfinished' in document.getElementById('view').dataset);
  await visit.wait(() => location.hash.includes('view='));
  await visit.drawn();
  const moved = difference(still, await visit.pixels());
  await visit.page.setViewportSize(DESKTOP.viewport); // a larger one
  await visit.drawn();
  const turned = await visit.pixels();
  const other = await Visit.begin(site.browser, await visit.address(), DESKTOP);
  await other.level(4);
  await other.drawn();
  const others = await other.pixels();
  const apart = difference(turned, others);
  assert.ok(moved > 0.05 && apart < moved / 10, `another visitor sees ${apart} otherwise, the turn changed ${moved}`);
  const upper = (pixels) => pixels.subarray(0, 4 * Math.floor(pixels.length / 32));
  assert.ok(difference(upper(turned), upper(others)) < 0.02, 'it is whole where the picture has grown');
  await other.end();
});

visits('its URL brings back what it shows', { hash: '#tab=surface&level=1&encoding=quantized&show=cage&theme=dark' }, async (visit) => {
  await visit.level(1);
  assert.equal(await visit.page.getByLabel('Encoding').inputValue(), 'quantized');
  assert.equal(await visit.page.locator('#shown [data-name=surface]').getAttribute('aria-pressed'), 'false');
  assert.equal(await visit.page.locator('html').getAttribute('data-theme'), 'dark');
  const here = await visit.address();
  await visit.page.evaluate(() => (location.hash = 'level=3'));
  await visit.level(3);
  await visit.page.goto(here);
  await visit.level(1);
  await visit.wait(() => !document.getElementById('legend').hidden);
  await visit.drawn();
  const still = await visit.pixels();
  const box = await visit.page.locator('#view').boundingBox();
  await visit.page.mouse.move(box.x + 300, box.y + 300);
  await visit.page.mouse.down();
  await visit.page.mouse.move(box.x + 420, box.y + 340, { steps: 4 });
  await visit.page.mouse.up();
  await visit.page.mouse.wheel(0, -200);
  await visit.wait(() => location.hash.includes('view='));
  await visit.drawn();
  const turned = await visit.pixels();
  const moved = difference(still, turned);
  const other = await Visit.begin(site.browser, await visit.address());
  await other.level(1);
  await other.wait(() => !document.getElementById('legend').hidden);
  await other.drawn();
  const apart = difference(turned, await other.pixels()); // the view is rounded, lines are thin
  assert.ok(apart < moved / 3, `another visitor sees ${apart} otherwise, the turn changed ${moved}`);
  await other.end();
});

visits('on a phone', { ...PHONE }, async (visit) => {
  await visit.level(2);
  const overflow = () => visit.page.evaluate(() => document.scrollingElement.scrollWidth - innerWidth);
  for (const name of ['Models', 'Surface', 'Edit', 'Sculpt', 'Rotation', 'Scripts']) {
    await visit.page.getByRole('tab', { name }).tap();
    await visit.drawn();
    assert.ok((await overflow()) <= 0, `${name} is ${await overflow()} too wide`);
    await visit.picture(`phone ${name}`);
  }
  await visit.page.evaluate(() => scrollTo(0, 480));
  assert.ok(await visit.page.evaluate(() => document.elementFromPoint(195, 100).id === 'view'), 'the picture stays over what is scrolled');
  await visit.page.evaluate(() => scrollTo(0, 0));
  assert.ok(covered(await visit.pixels()) > 0.1);
  await visit.page.getByRole('button', { name: 'Play' }).tap();
  await visit.wait(() => parseFloat(document.querySelector('.clock').textContent) > 0.2);
  await visit.page.getByRole('button', { name: 'Pause' }).tap();
  await visit.page.getByRole('tab', { name: 'Rotation' }).tap();
  await visit.page.getByRole('button', { name: /^Use XZY/ }).tap();
  await visit.wait(() => document.querySelector('.verdict')?.textContent.startsWith('XZY stays clear'));
  await visit.page.getByRole('tab', { name: 'Surface' }).tap();
  await visit.page.getByRole('button', { name: 'Show level 1', exact: true }).tap();
  await visit.level(1);
});

visits('by keyboard alone', { hash: '#show=surface,cage,points,follow' }, async (visit) => {
  await visit.level(2);
  const { keyboard } = visit.page;
  const turnTo = async (from, to) => {
    await visit.reach(from, 'Shift+Tab');
    for (let i = 0; i < 6 && (await visit.focused()) !== to; i++) await keyboard.press('ArrowRight');
  };
  await visit.reach('tank.json, level 2');
  const before = await visit.pixels();
  await keyboard.press('ArrowLeft');
  await keyboard.press('ArrowLeft');
  await visit.drawn();
  const turned = await visit.pixels();
  assert.ok(difference(before, turned) > 0.01, 'arrows orbit');
  await keyboard.press('-');
  await keyboard.press('-');
  await visit.drawn();
  assert.ok(covered(await visit.pixels()) < covered(turned), 'minus zooms out');
  await keyboard.press('?');
  const hidden = await visit.page.locator('#keys').evaluate((sheet) => [...sheet.querySelectorAll('h3')].filter((title) => title.getBoundingClientRect().right > sheet.getBoundingClientRect().right).map(({ textContent }) => textContent));
  assert.deepEqual(hidden, [], 'the sheet of keys shows all of them');
  await keyboard.press('Escape');
  await keyboard.press('f');
  await visit.drawn();
  assert.ok(Math.abs(covered(await visit.pixels()) - covered(turned)) < 0.02, 'F frames');
  await keyboard.press(' ');
  await visit.wait(() => parseFloat(document.querySelector('.clock').textContent) > 0.1);
  await keyboard.press(' ');
  await visit.reach('Models');
  await keyboard.press('ArrowRight');
  assert.equal(await visit.focused(), 'Surface');
  await visit.reach('Level');
  await keyboard.press('ArrowLeft');
  await visit.level(1);
  await visit.reach('Parts: ');
  await keyboard.press(' ');
  await visit.wait(() => document.querySelector('.outliner').open);
  assert.ok(await visit.page.getByRole('button', { name: 'Play' }).isVisible(), 'the space bar opened the parts, and played nothing');

  // Which order keeps the node that comes nearest to lock away from it.
  await turnTo('Surface', 'Rotation');
  await visit.page.locator('.verdict.locked').waitFor();
  await visit.reach('Use XZY');
  await keyboard.press('Enter');
  await visit.wait(() => document.querySelector('.verdict')?.textContent.startsWith('XZY stays clear'));

  // A script, copied.
  await visit.page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
  await turnTo('Rotation', 'Scripts');
  await visit.reach('Python');
  await keyboard.press('Enter');
  await visit.reach('Copy: This surface');
  await keyboard.press('Enter');
  await visit.page.getByText('Copied').waitFor();
  assert.match(await visit.page.evaluate(() => navigator.clipboard.readText()), /^import shutil\nimport urllib\.request\n/);
});

visits('axe finds nothing to mend, in the light colours and in the dark', DESKTOP, async (visit) => {
  await visit.level(2);
  await visit.page.evaluate(readFileSync(axe, 'utf8'));
  const look = async (theme, rules) => {
    for (const tab of ['Models', 'Surface', 'Edit', 'Sculpt', 'Rotation', 'Scripts']) {
      await visit.tab(tab);
      await visit.page.waitForTimeout(500);
      const { violations } = await visit.page.evaluate((only) => axe.run(only ? { runOnly: only } : {}), rules);
      const said = violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target, failureSummary }) => `${target} ${failureSummary}`).join('; ')}`);
      assert.deepEqual(said, [], `${tab}, ${theme}`);
      await visit.picture(`${tab} ${theme}`);
    }
  };
  await look('light');
  await visit.page.setViewportSize(TABLET.viewport);
  await visit.page.getByRole('button', { name: 'Change to the dark theme' }).click();
  await look('dark', ['color-contrast']); // alone differs
});
