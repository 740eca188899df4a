// The page at /: what a person does while something else is under way. Acts come in an order by chance, faster than the answers
// to them; whenever all is still, address, picture, slider, list and panels must tell of the same model. TESTED_ACTS and
// TESTED_SEEDS do more of them, by hand: TESTED_ACTS=200 TESTED_SEEDS=1,2,3 node --test tests/browser/page_crossing.test.mjs.
import assert from 'node:assert/strict';

import { CUBE, delayAnswers, drop, open, PYRAMID, UNDRAWN } from './page_driver.mjs';

const ACTS = Number(process.env.TESTED_ACTS ?? 40);
const SEEDS = (process.env.TESTED_SEEDS ?? '3').split(',').map(Number);
const DELAY = 400; // ms, the most that an answer comes late
const TOGETHER = 6; // acts, at most, between two rests
const TABS = ['models', 'surface', 'edit', 'sculpt', 'animation', 'scripts'];

const site = open({ first: 'block.obj', files: { 'block.obj': CUBE } });
const { daemon, visits } = site;

/** Numbers from 0 to below n, by chance. */
function chance(seed) {
  let state = seed * 7919 + 1;
  return (n) => {
    state = (state * 48271) % 2147483647;
    return Math.floor((state / 2147483647) * n);
  };
}

/** Clicks the nth of what a selector finds, seen or not; false where there is none. */
const press = ({ page }, selector, n) => page.evaluate(([wanted, k]) => {
  const found = [...document.querySelectorAll(wanted)].filter((element) => element.checkVisibility() && !element.disabled);
  found[k % found.length]?.focus();
  found[k % found.length]?.click();
  return found.length > 0;
}, [selector, n]);

/** A place of the stage's middle. */
async function somewhere({ page }, pick) {
  const { x, y, width, height } = await page.locator('#view').boundingBox();
  return [x + width / 2 + pick(60) - 30, y + height / 2 + pick(60) - 30];
}

const isModal = ({ page }) => page.evaluate(() => Boolean(document.querySelector('dialog[open]')));
let isDown = false; // the button of the mouse

const ACTIONS = {
  tab: (visit, pick) => press(visit, `[data-name=${TABS[pick(TABS.length)]}][role=tab]`, 0),
  sculpt: (visit) => press(visit, '[data-name=sculpt][role=tab]', 0),
  edit: (visit) => press(visit, '[data-name=edit][role=tab]', 0),
  level: ({ page }, pick) => page.evaluate((level) => {
    const slider = [...document.querySelectorAll('[aria-label=Level]')].find((element) => element.checkVisibility());
    if (!slider) return;
    slider.focus();
    slider.value = level;
    for (const type of ['input', 'change']) slider.dispatchEvent(new Event(type));
  }, pick(4)),
  model: (visit, pick) => press(visit, '.model', pick(9)),
  version: (visit, pick) => press(visit, '.version', pick(9)),
  undo: ({ page }) => page.keyboard.press('Control+z'),
  redo: ({ page }) => page.keyboard.press('Control+Shift+z'),
  back: ({ page }) => page.evaluate(() => navigation.currentEntry.index > 0 && history.back()),
  async hand(visit, pick) { // a stroke, a drag of a handle, a selection, or a turn of the camera: begun here, ended later
    if (isDown) await visit.page.mouse.up();
    else {
      await visit.page.mouse.move(...(await somewhere(visit, pick)));
      await visit.page.mouse.down();
    }
    isDown = !isDown;
    await visit.page.mouse.move(...(await somewhere(visit, pick)), { steps: 2 });
  },
  async stroke(visit, pick) {
    if (isDown) return;
    await visit.page.mouse.move(...(await somewhere(visit, pick)));
    await visit.page.mouse.down();
    await visit.page.mouse.move(...(await somewhere(visit, pick)), { steps: 3 });
    await visit.page.mouse.up();
  },
  brush: (visit, pick) => press(visit, '.brushes button', pick(6)),
  async extrude({ page }, pick) {
    await page.evaluate((face) => {
      const [chosen] = [...document.querySelectorAll('[aria-label=Selection]')].filter((element) => element.checkVisibility());
      if (!chosen) return;
      chosen.value = `[${face}]`;
      chosen.dispatchEvent(new Event('change'));
      [...document.querySelectorAll('#panel-edit button')].find(({ textContent }) => textContent === 'Extrude')?.click();
    }, pick(5));
  },
  async key({ page }, pick) {
    await page.locator('#view').focus();
    await page.keyboard.press(['e', 'i', 'b', 'g', 'Escape', 'Enter', 'n', 'x', 'f', ' '][pick(10)]);
  },
  drop: (visit, pick) => drop(visit, { 'pyramid.obj': `# ${pick(1e6)}\n${PYRAMID}` }),
  shape: (visit, pick) => press(visit, '[role=menuitem]', pick(5)),
  remove: (visit, pick) => press(visit, '.models .close[title=Delete]', pick(9)),
  restore: (visit) => press(visit, '.gone button', 0),
  async rename(visit, pick) {
    await press(visit, '.models .close[title=Rename]', pick(9));
    if (!(await isModal(visit))) return;
    await visit.page.keyboard.type(`named ${pick(100)}`);
    await visit.page.keyboard.press(pick(2) ? 'Enter' : 'Escape');
  },
  cancel: (visit) => press(visit, '#cancel, .upload button', 0),
  chip: (visit, pick) => press(visit, '#shown [data-name]', pick(9)),
  rule: ({ page }, pick) => page.evaluate((n) => {
    const select = [...document.querySelectorAll('#panel-surface select')].filter((element) => element.checkVisibility())[0];
    if (!select) return;
    select.value = ['catmull-clark', 'bilinear'][n];
    select.dispatchEvent(new Event('change', { bubbles: true }));
  }, pick(2)),
};

/** Lets go of all, and waits until nothing goes on. */
async function rest(visit) {
  const { page } = visit;
  if (isDown) await page.mouse.up();
  isDown = false;
  for (let quiet = 0; quiet < 3; quiet++) {
    await visit.drawn();
    await page.waitForTimeout(100);
    if (await page.evaluate(() => 'opening' in document.querySelector('canvas').dataset || !document.getElementById('busy').hidden || Boolean(document.querySelector('.upload')))) quiet = -1;
  }
}

/** What the page tells, in all its places. */
const told = ({ page }) => page.evaluate(() => {
  const given = new URLSearchParams(location.hash.slice(1));
  const text = (selector) => document.querySelector(selector)?.textContent ?? null;
  const blank = [...document.querySelectorAll('.empty')].find((element) => element.checkVisibility());
  return {
    model: given.get('model'), level: given.get('level'), from: given.get('from'), edits: given.get('edits'),
    scheme: given.get('scheme') ?? 'catmull-clark', quads: given.get('quads') ?? 'auto',
    drawn: document.querySelector('canvas').dataset.level ?? null, said: document.querySelector('canvas').getAttribute('aria-label'),
    facts: text('#facts'), subject: text('#subject'), blank: blank?.textContent ?? null,
    sliders: [...document.querySelectorAll('[aria-label=Level]')].map(({ value }) => value),
    isListed: Boolean(document.querySelector('.models [aria-current=true]')), name: document.querySelector('.model[aria-current=true] .name')?.textContent ?? null,
    list: document.querySelector('[aria-label=Edits]').value, isEditing: !document.querySelector('#panel-edit').hidden,
    notices: [...document.querySelectorAll('.notice')].map((notice) => notice.innerText.replace(/\s+/g, ' ')),
  };
});

/** What two of the places tell otherwise. */
async function faultsOf(page) {
  if (page.blank) return page.drawn === null && page.facts === '' ? [] : ['a blank stage has facts'];
  const faults = [];
  const check = (isRight, text) => isRight || faults.push(text);
  const counts = await (await fetch(`${daemon.url}/v1/models/${page.model}/surface.json?${new URLSearchParams({ level: page.level, scheme: page.scheme, quads: page.quads })}`)).json();
  const { vertices, faces } = counts;
  check(page.drawn === page.level, 'another level is drawn than the address names');
  check(page.sliders.every((level) => level === page.level), 'the slider has another level');
  check(page.facts.startsWith(`Level ${page.level} · ${String(vertices).replace(/\B(?=(\d{3})+$)/g, ',')} point`) && page.facts.includes(` · ${String(faces).replace(/\B(?=(\d{3})+$)/g, ',')} face`), `the picture is of another model: ${vertices} points, ${faces} faces`);
  check(page.isListed, 'the list has no entry for the model');
  check(page.name === null || page.subject === page.name || page.subject.startsWith(`${page.name}, `), 'the list has another name');
  if (page.isEditing && page.edits) check(JSON.stringify(JSON.parse(page.list)) === JSON.stringify(JSON.parse(page.edits)), 'the panel has other edits');
  return faults;
}

for (const seed of SEEDS)
  visits(`acts that cross each other leave the page in one mind, ${seed}`, { ...UNDRAWN, refused: [404], isAlone: true, hash: '#level=2' }, async (visit) => {
    const { page } = visit;
    const pick = chance(seed);
    await visit.level(2);
    await delayAnswers(page, DELAY, seed);
    const done = [];
    for (let i = 0; i < ACTS;) {
      const before = await told(visit);
      const names = [];
      for (let k = 1 + pick(TOGETHER); k > 0; k--, i++) {
        const name = Object.keys(ACTIONS)[pick(Object.keys(ACTIONS).length)];
        names.push(name);
        await ACTIONS[name](visit, pick);
        await page.waitForTimeout(pick(3) * pick(100));
      }
      done.push(names.join(' '));
      await rest(visit);
      const now = await told(visit);
      const faults = [...(await faultsOf(now)), ...visit.faults.splice(0)];
      assert.deepEqual(faults, [], `after ${done.slice(-4).join(' | ')}:\n${JSON.stringify(before)}\n${JSON.stringify(now)}`);
    }
    // All steps can be taken back and done again.
    const ends = [];
    for (const key of ['Control+Shift+z', 'Control+z', 'Control+Shift+z']) {
      const name = key === 'Control+z' ? 'Undo' : 'Redo';
      for (let i = 0; i < 100 && (await page.getByRole('button', { name, exact: true, disabled: false }).isVisible()); i++) {
        await page.keyboard.press(key);
        await rest(visit);
      }
      const now = await told(visit);
      assert.deepEqual(await faultsOf(now), []);
      ends.push([now.model, now.edits, now.from]);
    }
    assert.deepEqual(ends[2], ends[0]);
  });
