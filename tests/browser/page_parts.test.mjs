// Parts of the page that need no browser: amounts of gestures, works and their versions, sentences about a clip, what
// opening a model asks.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';

import { isFit, NAMES, OF_SURFACE, readAddress } from '../../server/page/address.js';
import { carriedOver, sentencesOf } from '../../server/page/clip_words.js';
import { blendWeights, layersOf, partOf } from '../../server/page/clips.js';
import { Gesture } from '../../server/page/gestures.js';
import { Lineages } from '../../server/page/lineages.js';
import { firstLevel, Opening } from '../../server/page/opening.js';

/** A camera that looks along -z: 100 pixels are one unit. */
const frame = (start) => ({
  centre: [200, 200], start, scale: 0.01, normal: [0, 1, 0], view: [0, 0, 1],
  along: ([x, y]) => [100 * x, -100 * y], inPlane: ([dx, dy]) => [dx / 100, -dy / 100, 0],
});
const made = (name, start, place, ...keys) => {
  const gesture = new Gesture(name, frame(start));
  if (place) gesture.moveTo(place);
  for (const key of keys) assert.ok(gesture.type(key), key);
  return gesture.edit;
};

test('the hand’s way is an amount', () => {
  assert.deepEqual(made('extrude', [300, 300], [320, 250]), { edit: 'extrude', distance: 0.5 });
  assert.deepEqual(made('inset', [300, 200], [270, 200]), { edit: 'inset', amount: 0.3 });
  assert.equal(made('inset', [300, 200], [330, 200]), null, 'outwards is nothing');
  assert.deepEqual(made('move', [0, 0], [50, -20]), { edit: 'move', by: [0.5, 0.2, 0] });
  assert.deepEqual(made('move', [0, 0], [50, -20], 'y'), { edit: 'move', by: [0, 0.2, 0] });
  assert.deepEqual(made('scale', [300, 200], [350, 200]), { edit: 'scale', by: 1.5 });
  assert.deepEqual(made('scale', [300, 200], [350, 200], 'z'), { edit: 'scale', by: [1, 1, 1.5] });
  assert.deepEqual(made('rotate', [300, 200], [200, 100]), { edit: 'rotate', axis: [0, 0, 1], degrees: 90 });
  assert.deepEqual(made('rotate', [300, 200], [200, 100], 'z'), { edit: 'rotate', axis: 'z', degrees: 90 });
  assert.equal(made('extrude', [300, 300], [300, 300]), null);
});

test('what is typed counts before the way: where it is no number yet, nothing is done', () => {
  for (const keys of ['-', '.', '-.', '1.2.']) assert.equal(made('move', [0, 0], [50, -20], ...keys), null, keys);
  assert.deepEqual(made('move', [0, 0], [50, -20], '-', 'Backspace'), { edit: 'move', by: [0.5, 0.2, 0] });
});

test('typed digits count before the way; arrows go on', () => {
  assert.deepEqual(made('extrude', [0, 0], [0, 90], '-', '0', '.', '2', '5'), { edit: 'extrude', distance: -0.25 });
  assert.deepEqual(made('move', null, null, '2'), { edit: 'move', by: [2, 0, 0] });
  assert.deepEqual(made('move', null, null, 'z', '1', ',', '5'), { edit: 'move', by: [0, 0, 1.5] });
  assert.deepEqual(made('extrude', [0, 0], [0, 90], '1', '2', 'Backspace'), { edit: 'extrude', distance: 1 });
  assert.deepEqual(made('loop_cut', null, null), { edit: 'loop_cut', cuts: 1 });
  assert.deepEqual(made('loop_cut', null, null, 'ArrowUp', 'ArrowUp'), { edit: 'loop_cut', cuts: 3 });
  assert.deepEqual(made('extrude', null, null, 'ArrowUp', 'ArrowUp'), { edit: 'extrude', distance: 0.24 });
  assert.equal(new Gesture('extrude', frame([0, 0])).type('q'), false);
});

test('an address may say what the API takes, and no more', () => {
  const { parameters } = JSON.parse(readFileSync(new URL('../../api/openapi.json', import.meta.url))).components;
  for (const name of [...Object.keys(OF_SURFACE), 'order', 'loop']) {
    const { schema } = parameters[name === 'limit' ? 'limit_surface' : name];
    const values = schema.enum ?? (schema.type === 'boolean' ? ['false', 'true'] : schema.pattern?.match(/\w+(?=[|)])/g) ?? ['auto', '0', '12']);
    assert.ok(values.length > 1, name);
    for (const value of values) assert.ok(isFit(name, value), `${name}=${value}`);
    for (const value of ['', 'foo', `${values[1]} `, '-1']) assert.equal(isFit(name, value), false, `${name}=${value}`);
  }
  assert.ok(isFit('creases', 'angle:30'));
});

test('what an address says that means nothing is left out, and told', () => {
  const id = 'ab'.repeat(16);
  const fit = { tab: 'edit', model: id, level: '3', view: '1,2,3,0,0,0', t: '-0.5', weight: '1', exposure: '-2', edits: '[{"edit":"flip"}]', borrowed: `${id},${id}`, panel: '0', theme: 'dark', language: 'curl', show: 'cage' };
  assert.deepEqual(readAddress(new URLSearchParams({ ...fit, other: 'x' }).toString()), { given: fit, unfit: [] });
  for (const [name, ...values] of [['tab', '', 'x'], ['level', '-1', '2.5', 'NaN'], ['t', '', 'x', 'Infinity'], ['mesh', '-1', '1.5'], ['view', '1,2', '1,2,3,4,5,x', '1,2,3,1,2,3'], ['speed', '0', 'x'],
    ['weight', '1.01', '-1', ''], ['edits', '7', '[', '{}'], ['from', 'x'], ['borrowed', `${id},`], ['theme', 'purple'], ['panel', '-1'], ['language', 'cobol']])
    for (const value of values)
      assert.deepEqual(readAddress(new URLSearchParams({ [name]: value, model: id }).toString()), { given: { model: id }, unfit: [`${name}=${value}`] });
  for (const [name, [value]] of Object.entries(NAMES)) assert.ok(isFit(name, value), name);
});

const listed = (...ids) => ids.map((id) => ({ id, name: `${id}.obj`, format: 'obj', bytes: 1 }));
class Storage extends Map {
  getItem(key) { return this.get(key) ?? null; }
  setItem(key, value) { this.set(key, value); }
}

test('edits of a model are its versions, and one entry of the list', () => {
  const storage = new Storage();
  const lineages = new Lineages('http://a/', storage);
  lineages.add('b', 'a', 1000);
  lineages.add('c', 'b', 2000);
  lineages.add('c', 'x', 3000); // is known
  const [work, other] = lineages.group(listed('a', 'b', 'c', 'd'), true);
  assert.deepEqual([work.id, work.name, work.versions.map(({ id }) => id)], ['c', 'a.obj', ['a', 'b', 'c']]);
  assert.deepEqual([other.id, other.versions.length], ['d', 1]);
  lineages.rename('b', 'mine');
  lineages.setPicture('c', 'data:,');
  const again = new Lineages('http://a/', storage);
  assert.deepEqual([again.group(listed('c'), false)[0].name, again.group(listed('c'), false)[0].picture, again.group(listed('c'), false)[0].versions.length], ['mine', 'data:,', 3]);
  assert.equal(again.group(listed('a', 'b'), true)[0].id, 'b', 'what has gone is no version');
  assert.equal(new Lineages('http://b/', storage).works.length, 0, 'another daemon');
  again.forget(['a', 'b', 'c']);
  assert.equal(again.works.length, 0);
  again.rename('d', 'later');
  const [renamed] = again.group(listed('d'), true);
  assert.deepEqual([renamed.name, Boolean(renamed.at)], ['later', false], 'a name is no new version');
  storage.setItem = () => { throw new Error('full'); };
  again.add('f', 'e');
  assert.equal(again.of('e').versions.length, 2);
});

const report = (more) => ({ loop: { angle: 0, distance: 0, node: null, speed: 0 }, root: { node: null, distance: 0, speed: 0, turn: 0 }, still: [], feet: ['left', 'right'], contacts: [], noise: [], pops: [], ...more });
const said = (more, isFigure = true) => sentencesOf(report(more), 5, isFigure).map(({ mark, text }) => `${mark}: ${text}`);

test('a clip is judged in sentences', () => {
  assert.deepEqual(said(), ['good: Loops without a seam.', ': Stays in its place.']);
  assert.equal(said({ loop: { angle: 40.2, distance: 0.3, node: 'hips', speed: 1 } })[0], 'bad: Does not loop: between its end and its start hips leaps by 40° and 0.30 m.');
  assert.equal(said({ root: { node: 'hips', distance: 1.5, speed: 0.75, turn: -90 } })[1], ': hips goes 1.50 m at 0.75 m/s and turns by -90°.');
  assert.equal(said({ root: { node: 'hips', distance: 0.0001, speed: 0.1, turn: 0 } })[1], ': hips moves at 0.10 m/s and ends where it began.');
  const contacts = [{ node: 'left', from: 0.1, to: 0.4, slide: 0.002 }, { node: 'right', from: 0.5, to: 0.9, slide: 0.05 }];
  assert.ok(said({ contacts }).includes('bad: Feet touch the ground 2 times; right slides by 5.0 cm.'));
  assert.ok(said({ contacts: contacts.slice(0, 1) }).includes('good: Feet touch the ground 1 time; none slides.'));
  assert.ok(said({ feet: [] }).includes(': Contacts with the ground are not judged: no foot is known by its name.'));
  assert.equal(said({ feet: [] }, false).length, 2);
  assert.ok(said({ pops: [{ node: 'hand', time: 0.5, angle: 31 }] }).includes('bad: One key of hand leaps by 31°.'));
  assert.ok(said({ noise: [{ node: 'hand', path: 'rotation', rms: 0.4 }] }).includes('bad: Jitters: hand by 0.4°.'));
  assert.ok(said({ still: ['a'] }).includes(': 1 node never moves: a.'));
  assert.ok(said({ still: ['a', 'b'] }).includes(': 2 nodes never move: a, b.'));
});

test('how a clip was carried over agrees in number', () => {
  const words = (follow, rest) => carriedOver({ bones: Array(follow), scale: 1, without_target: [], without_source: Array(rest) });
  assert.deepEqual(words(1, 1), ['1 bone follows, ways are 1.00 times as long.', '1 bone keeps the rest pose.']);
  assert.deepEqual(words(20, 2), ['20 bones follow, ways are 1.00 times as long.', '2 bones keep the rest pose.']);
});

test('morph weights blend as layers do', () => {
  const [first, second] = [{ face: [0, 1], brow: [1] }, { face: [1, 0], lid: [0.5] }];
  assert.deepEqual(blendWeights(first, second, 0.25), { face: [0.25, 0.75], brow: [1], lid: [0.5] });
  assert.deepEqual(blendWeights(first, second, 0), first);
  assert.deepEqual(blendWeights(first, second, 1), second);
});

test('what one clip of a blend moves alone is as it moves it, while both play', () => {
  const parts = (first, second) => [0, 0.25, 1].map((part) => partOf(first, second, part));
  assert.deepEqual([parts(true, true), parts(true, false), parts(false, true)], [[0, 0.25, 1], [0, 0, 1], [0, 1, 1]]);
});

test('a blend has two layers in one phase, whose weights sum to 1', () => {
  const layers = layersOf([{ value: 'walk' }, { value: 'other/run', isBorrowed: true }], 0.25);
  assert.deepEqual(layers, [{ clip: 'walk', weight: 0.75, sync: true }, { clip: 'other/run', weight: 0.25, sync: true, retarget: 'auto' }]);
});

/** An opening whose daemon notes what it is asked. fits: whether a level may be as large as it is. counts: the answer,
 *  or what is thrown. */
function opened({ fits = true, counts = { bytes: 7 }, levels = [] } = {}) {
  const asked = [];
  const opening = new Opening({
    count: async (model, options) => {
      asked.push(['count', options]);
      if (counts instanceof Error) throw counts;
      return counts;
    },
    load: async (model, options) => (asked.push(['load', options]), { blob: new Blob(['glb']) }),
    parse: async (bytes) => `parsed ${new TextDecoder().decode(bytes)}`,
    levels: async (model, options) => (asked.push(['levels', options]), levels),
    confirm: async (size) => (asked.push(['confirm', size]), fits),
    isMuch: (size) => size > 100,
  });
  return { opening, asked };
}
const withEdges = (edges) => ({ meshes: [{ edges: edges - 1 }, { edges: 1 }] });
const { signal } = new AbortController();

test('a small model opens with the level whose error is not seen, of at most 50,000 faces', async () => {
  const { opening, asked } = opened({ counts: { level: 4 } });
  assert.equal(await opening.level(withEdges(2000), { level: 'auto', limit: 'true', encoding: 'meshopt' }, { signal }), 4);
  assert.deepEqual(asked, [['count', { level: 'auto', error: '0.1%', faces: 50000, limit: 'true', encoding: 'float' }]]);
});

test('the counts of the level that a model opens with are asked for once', async () => {
  const { opening, asked } = opened({ counts: { level: 4, bytes: 7 } });
  const model = withEdges(12);
  const options = { level: 'auto', encoding: 'meshopt' };
  assert.equal(await opening.level(model, options, { signal }), 4);
  for (const [of, given, times] of [[model, { ...options, level: 4 }, 1], [model, { ...options, level: 4, limit: 'true' }, 2], [withEdges(12), { ...options, level: 4 }, 3]]) {
    assert.equal((await opening.surface(of, given, { signal })).counts.bytes, 7);
    assert.equal(asked.filter(([what]) => what === 'count').length, times);
  }
});

test('a model whose errors take long, or are not told, opens with level 2, or the highest under 200,000 faces', async () => {
  assert.deepEqual([12, 25000, 25001, 100001].map((edges) => firstLevel(withEdges(edges))), [2, 2, 1, 0]);
  assert.equal(firstLevel({ meshes: [] }), 2);
  for (const model of [{ meshes: [] }, withEdges(2001)]) {
    const { opening, asked } = opened({ counts: { level: 4 } });
    assert.equal(await opening.level(model, {}, { signal }), 2);
    assert.deepEqual(asked, [], 'nothing is asked');
  }
  const refused = (status) => opened({ counts: Object.assign(new Error(), { status }) }).opening.level(withEdges(12), {}, { signal });
  assert.equal(await refused(422), 2);
  await assert.rejects(refused(), Error, 'without an answer there is no level');
});

test('a small level is loaded while it is counted, a large one when its size is wanted', async () => {
  const small = opened();
  const { counts, parsed } = await small.opening.surface(withEdges(12), { level: 2 }, { signal });
  assert.deepEqual([counts.bytes, parsed], [7, 'parsed glb']);
  assert.deepEqual(small.asked, [['count', { level: 2 }], ['load', { level: 2 }]]);
  const large = opened();
  await large.opening.surface(withEdges(6250), { level: 2 }, { signal });
  assert.deepEqual(large.asked.map(([what]) => what), ['count', 'confirm', 'load']);
  const refused = opened({ fits: false });
  await assert.rejects(refused.opening.surface(withEdges(6250), { level: 2 }, { signal }), { name: 'AbortError' });
  assert.deepEqual(refused.asked.map(([what]) => what), ['count', 'confirm']);
});

test('the highest level is one that is made, and loaded without a question', async () => {
  const [small, large, refused] = [{ bytes: 100 }, { bytes: 101 }, { bytes: null, refused: 'too many faces' }];
  for (const [given, level] of [[[small, small, large, refused], 1], [[small, small, small, refused], 2], [[refused], null], [[], null]]) {
    const { opening, asked } = opened({ levels: given.map((facts, i) => ({ level: i, ...facts })) });
    assert.equal(await opening.highest(withEdges(12), { limit: 'true', encoding: 'meshopt' }, { signal }), level);
    assert.deepEqual(asked, [['levels', { limit: 'true', encoding: 'float' }]]);
  }
});

test('the size of what is compressed is asked without compressing; an opening that was left shows nothing', async () => {
  const { opening, asked } = opened();
  await opening.surface(withEdges(12), { level: 1, encoding: 'meshopt' }, { signal });
  assert.deepEqual(asked.map(([, { encoding }]) => encoding), ['float', 'meshopt']);
  const controller = new AbortController();
  await assert.rejects(opening.surface(withEdges(12), { level: 1 }, { signal: controller.signal, onLoaded: () => controller.abort() }), { name: 'AbortError' });
});

test('a cage is level 0 in polygons, by the rules of its surface that concern it', async () => {
  const { opening, asked } = opened();
  assert.equal(await opening.cage(withEdges(12), { level: 3, creases: 'auto', encoding: 'meshopt' }, { signal }), 'parsed glb');
  assert.deepEqual(asked, [['load', { level: 0, normals: 'none', polygons: 'ngon', clip: 'none', details: undefined, quads: undefined, creases: 'auto' }]]);
});
