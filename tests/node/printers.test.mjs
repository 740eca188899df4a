// What surface.stl, surface.ply and surface.3mf say of a model, as three's loaders, admesh, assimp and lib3mf read them: the
// triangles, bounds, volume and shells of the GLB of the same model. Equal points are equal bytes: a closed cage gives closed files.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Matrix4, Vector3 } from 'three';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';

import { Daemon, root } from './daemon.mjs';
import { load } from './player.mjs';

const daemon = new Daemon();
const folder = mkdtempSync(join(tmpdir(), 'printers-'));
before(() => daemon.start());
after(() => daemon.remove());
after(() => rmSync(folder, { recursive: true }));

async function ask(model, query, headers = {}) {
  const response = await fetch(`${model}/surface.${query}`, { headers });
  const bytes = Buffer.from(await response.arrayBuffer());
  assert.ok(response.ok, `${query}: ${bytes}`);
  return { bytes, response, warning: decodeURIComponent(response.headers.get('X-Tweend-Warning') ?? '') };
}

const buffer = (bytes) => new Uint8Array(bytes).buffer;

// ---- triangles --------------------------------------------------------------------------------------------

/** [triangles][3 corners][x, y, z] of a loader's geometry, as one array. */
function trianglesOf(geometry, matrix = new Matrix4()) {
  const { position } = geometry.attributes, index = geometry.index?.array, count = index ? index.length : position.count;
  const order = matrix.determinant() < 0 ? [0, 2, 1] : [0, 1, 2], point = new Vector3(), out = new Float64Array(3 * count);
  for (let i = 0; i < count; i++) {
    const corner = i - (i % 3) + order[i % 3];
    point.fromBufferAttribute(position, index ? index[corner] : corner).applyMatrix4(matrix).toArray(out, 3 * i);
  }
  return out;
}

async function trianglesOfGlb(bytes) {
  const { scene } = await load(bytes), all = [];
  scene.updateMatrixWorld(true);
  scene.traverse((mesh) => { if (mesh.isMesh) all.push(trianglesOf(mesh.geometry, mesh.matrixWorld)); });
  const out = new Float64Array(all.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const triangles of all) { out.set(triangles, at); at += triangles.length; }
  return out;
}

const countOf = (triangles) => triangles.length / 9;

/** The sum over all triangles of `measure` of their three corners. */
function sumOf(triangles, measure) {
  const corners = [new Vector3(), new Vector3(), new Vector3()];
  let sum = 0;
  for (let at = 0; at < triangles.length; at += 9) sum += measure(...corners.map((corner, k) => corner.fromArray(triangles, at + 3 * k)));
  return sum;
}

const scratch = new Vector3();
const volumeOf = (triangles) => sumOf(triangles, (a, b, c) => a.dot(scratch.crossVectors(b, c)) / 6);
const areaOf = (triangles) => sumOf(triangles, (a, b, c) => b.sub(a).cross(c.sub(a)).length() / 2);

function boundsOf(triangles) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  triangles.forEach((x, i) => { low[i % 3] = Math.min(low[i % 3], x); high[i % 3] = Math.max(high[i % 3], x); });
  return [...low, ...high];
}

/** [corners] the number of each one's point, by exact coordinates; and how many points there are. */
function pointsOf(triangles) {
  const numbers = new Map(), points = new Uint32Array(triangles.length / 3);
  let count = 0;
  const inside = (map, x) => { if (!map.has(x)) map.set(x, new Map()); return map.get(x); };
  for (let i = 0; i < points.length; i++) {
    const last = inside(inside(numbers, triangles[3 * i]), triangles[3 * i + 1]), z = triangles[3 * i + 2];
    if (!last.has(z)) last.set(z, count++);
    points[i] = last.get(z);
  }
  return { points, count };
}

/** By exact coordinates: pieces that share points, and edges whose two directions do not occur equally often. */
function shellsOf(triangles) {
  const { points, count } = pointsOf(triangles), parents = Array.from({ length: count }, (_, i) => i), edges = new Map();
  const find = (point) => { while (parents[point] !== point) point = parents[point] = parents[parents[point]]; return point; };
  points.forEach((point, i) => {
    const next = points[i % 3 === 2 ? i - 2 : i + 1];
    parents[find(point)] = find(next);
    const edge = Math.min(point, next) * 2 ** 26 + Math.max(point, next);
    edges.set(edge, (edges.get(edge) ?? 0) + (point < next ? 1 : -1));
  });
  const shells = parents.filter((parent, i) => parent === i).length;
  return { points: count, shells, open: [...edges.values()].filter((sum) => sum !== 0).length };
}

const near = (a, b, relative, what) => assert.ok(Math.abs(a - b) <= relative * Math.max(Math.abs(a), Math.abs(b)) + 1e-12, `${what}: ${a}, ${b}`);

// ---- programs that print -------------------------------------------------------------------------------------

/** What admesh says of an STL: facets, those with open edges, shells, volume, bounds, what it would have to mend. */
function admesh(bytes) {
  const file = join(folder, 'part.stl');
  writeFileSync(file, bytes);
  const text = execFileSync('admesh', [file], { encoding: 'utf8' });
  const number = (name) => Number(text.match(new RegExp(`${name}\\s*[:=]\\s*(\\S+?),?\\s`))[1]);
  const mended = ['Degenerate facets', 'Edges fixed', 'Facets removed', 'Facets added', 'Facets reversed', 'Backwards edges', 'Normals fixed'];
  return {
    facets: number('Number of facets'), open: number('Total disconnected facets'), shells: number('Number of parts'), volume: number('Volume'),
    bounds: ['Min X', 'Min Y', 'Min Z', 'Max X', 'Max Y', 'Max Z'].map(number), mended: mended.filter((name) => number(name) > 0),
  };
}

/** What assimp reads from a file: faces, and the least and the greatest coordinates. */
function assimp(form, bytes) {
  const file = join(folder, `part.${form}`);
  writeFileSync(file, bytes);
  const text = execFileSync('assimp', ['info', file], { encoding: 'utf8' });
  const points = ['Minimum', 'Maximum'].flatMap((name) => text.match(`${name} point\\s+\\((.*)\\)`)[1].trim().split(/\s+/).map(Number));
  return { faces: Number(text.match(/Faces:\s+(\d+)/)[1]), bounds: points };
}

/** What lib3mf, strict, says of a 3MF. */
const judge = join(root, 'build/tests/threemf_facts'), hasLib3mf = existsSync(judge);
function lib3mf(bytes) {
  const file = join(folder, 'part.3mf');
  writeFileSync(file, bytes);
  return JSON.parse(execFileSync(judge, [file], { encoding: 'utf8' }));
}

/** What PrusaSlicer says of a file: facets, parts, volume and bounds of all its objects. It is not among the packages of the tests, as it
 * and what it needs take 434 MB. Null where it does not load the file. */
const hasPrusa = (process.env.PATH ?? '').split(':').some((place) => existsSync(join(place, 'prusa-slicer')));
function prusa(form, bytes) {
  const file = join(folder, `part.${form}`);
  writeFileSync(file, bytes);
  const { status, stdout } = spawnSync('prusa-slicer', ['--info', file], { encoding: 'utf8' });
  if (status !== 0) return null;
  const numbers = (name) => [...stdout.matchAll(new RegExp(`^${name} = +(\\S+)`, 'gm'))].map(([, text]) => Number(text));
  const sum = (name) => numbers(name).reduce((a, b) => a + b, 0), axes = ['x', 'y', 'z'];
  return {
    facets: sum('number_of_facets'), parts: sum('number_of_parts'), volume: sum('volume'),
    bounds: [...axes.map((axis) => Math.min(...numbers(`min_${axis}`))), ...axes.map((axis) => Math.max(...numbers(`max_${axis}`)))],
  };
}

// ---- models -----------------------------------------------------------------------------------------------

const sample = (name) => readFileSync(join(root, 'server/samples', name));
const shape = (shape, more = {}, node = {}) => Buffer.from(JSON.stringify({ meshes: [{ name: 'part', shape, ...more }], nodes: [{ name: 'part', mesh: 'part', ...node }] }));
const models = {
  cube: { bytes: sample('cube.obj'), closed: true },
  octopus: { bytes: sample('octopus.obj') },
  tank: { bytes: sample('tank.json') },
  'creased box': { bytes: shape({ kind: 'box', size: [2, 1, 3], segments: [2, 1, 2] }, { edits: [{ edit: 'crease', edges: { sharper_than: 60 }, sharpness: 10 }] }), closed: true },
  'half creased sphere': { bytes: shape({ kind: 'uv_sphere', radius: 1, segments: 7, rings: 5 }, { edits: [{ edit: 'crease', edges: { inside: { min: [-2, 0, -2], max: [2, 2, 2] } }, sharpness: 1.5 }] }), closed: true },
  'mirrored cone': { bytes: shape({ kind: 'cone', radius: 1, height: 2, segments: 5 }, {}, { translation: [3, 1, 0], rotation: [0, 0.6, 0, 0.8], scale: [-1, 2, 0.5] }), closed: true },
  torus: { bytes: shape({ kind: 'torus', radius: 2, tube: 0.5, segments: 6, sides: 4 }), closed: true },
  grid: { bytes: shape({ kind: 'grid', size: [2, 2], segments: [3, 2] }) },
};

/** admesh finds one closed shell with nothing to mend; assimp reads the same triangles. */
async function readByPrograms(model, level, triangles) {
  const stl = (await ask(model, `stl?level=${level}&unit=m`)).bytes, ply = (await ask(model, `ply?level=${level}`)).bytes;
  const { facets, open, shells, volume, bounds, mended } = admesh(stl);
  const { solid } = JSON.parse((await ask(model, `json?level=${level}&shells=true`)).bytes);
  assert.deepEqual([solid.shells, solid.closed, solid.inverted, solid.triangles], [1, 1, 0, facets]);
  near(solid.volume, volume, 1e-4, 'volume of surface.json');
  assert.deepEqual({ facets, open, shells, mended }, { facets: countOf(triangles), open: 0, shells: 1, mended: [] });
  near(volume, volumeOf(triangles), 1e-4, 'volume by admesh');
  const size = Math.max(...boundsOf(triangles).map(Math.abs));
  const read = [assimp('stl', stl), assimp('ply', ply)];
  for (const found of [bounds, ...read.map((one) => one.bounds)])
    boundsOf(triangles).forEach((bound, i) => assert.ok(Math.abs(bound - found[i]) < 1e-5 * size, `${bound}, ${found[i]}`));
  assert.deepEqual(read.map(({ faces }) => faces), [countOf(triangles), countOf(triangles)]);
}

for (const [name, { bytes, closed }] of Object.entries(models))
  for (const level of [0, 1, 2, 3, 4])
    test(`${name}, level ${level}: triangles, bounds, volume and shells are those of the GLB`, async () => {
      const model = await daemon.upload(bytes);
      const glb = await trianglesOfGlb((await ask(model, `glb?level=${level}`)).bytes);
      const stl = trianglesOf(new STLLoader().parse(buffer((await ask(model, `stl?level=${level}&unit=m`)).bytes)));
      const ply = trianglesOf(new PLYLoader().parse(buffer((await ask(model, `ply?level=${level}`)).bytes)));
      const shells = shellsOf(stl);
      assert.deepEqual(shellsOf(ply), shells);
      if (closed) assert.deepEqual([shells.shells, shells.open], [1, 0]);
      if (closed) await readByPrograms(model, level, glb);
      const [bounds, area, volume] = [boundsOf(glb), areaOf(glb), volumeOf(glb)];
      const size = Math.max(...bounds.map(Math.abs));
      for (const [form, triangles] of Object.entries({ stl, ply })) {
        assert.equal(countOf(triangles), countOf(glb), form);
        boundsOf(triangles).forEach((bound, i) => assert.ok(Math.abs(bound - bounds[i]) < 1e-6 * size, form));
        near(areaOf(triangles), area, 1e-5, `${form}: area`);
        assert.ok(Math.abs(volumeOf(triangles) - volume) < 1e-5 * size * area, `${form}: volume`);
      }
    });

test('the lengths of surface.json are those of the answers, which ranges cut anywhere', async () => {
  for (const { bytes } of Object.values(models))
    for (const query of ['level=0', 'level=0&polygons=ngon', 'level=2', 'level=3&polygons=ngon', 'level=1&normals=none']) {
      const model = await daemon.upload(bytes);
      const { forms } = JSON.parse((await ask(model, `json?${query}`)).bytes);
      for (const form of ['glb', 'gltf', 'stl', 'ply']) {
        const { bytes: whole, response } = await ask(model, `${form}?${query}`);
        assert.equal(whole.length, forms[form], `${form}?${query}`);
        assert.equal(Number(response.headers.get('Content-Length')), forms[form]);
        const head = await fetch(`${model}/surface.${form}?${query}`, { method: 'HEAD' });
        assert.equal(Number(head.headers.get('Content-Length')), forms[form]);
        for (const share of [0.1, 0.5, 0.9]) {
          const from = Math.floor(whole.length * share), to = Math.min(whole.length - 1, from + 777);
          const part = await ask(model, `${form}?${query}`, { Range: `bytes=${from}-${to}` });
          assert.equal(part.response.status, 206);
          assert.ok(part.bytes.equals(whole.subarray(from, to + 1)), `${form}?${query} from ${from}`);
        }
      }
    }
});

test('polygons=ngon keeps the faces of the surface in a PLY', async () => {
  const models_of = { 'mirrored cone': [3, 5], 'creased box': [4] };
  for (const [name, cage] of Object.entries(models_of))
    for (const [level, sizes] of [[0, cage], [1, [4]]]) {
      const model = await daemon.upload(models[name].bytes);
      const { bytes } = await ask(model, `ply?level=${level}&polygons=ngon&normals=none`);
      const text = bytes.toString('latin1'), head = text.indexOf('end_header\n') + 11;
      const [vertices, faces] = ['vertex', 'face'].map((element) => Number(text.match(`element ${element} (\\d+)`)[1]));
      const wedges = text.includes('float texcoord'), floats = text.includes('property float s\n') ? 5 : 3, seen = new Set();
      let at = head + 4 * floats * vertices;
      for (let face = 0; face < faces; face++) {
        seen.add(bytes[at]);
        at += 1 + 4 * bytes[at];
        if (wedges) at += 1 + 4 * bytes[at];
      }
      assert.equal(at, bytes.length);
      assert.deepEqual([...seen].sort(), sizes);
      const counts = JSON.parse((await ask(model, `json?level=${level}`)).bytes);
      assert.deepEqual([vertices, faces], [counts.vertices, counts.faces]);
      // Uploaded again, it has the same surface.
      const again = JSON.parse((await ask(await daemon.upload(bytes), 'json?level=0')).bytes);
      assert.deepEqual([again.vertices, again.faces], [vertices, faces]);
    }
});

test('a PLY has the normals of the surface, its colours, and texture coordinates at corners where they have seams', async () => {
  const model = await daemon.upload(sample('octopus.obj'));
  const { bytes, warning } = await ask(model, 'ply?level=2');
  assert.doesNotMatch(warning, /without/);
  assert.match(bytes.subarray(0, 1000).toString('latin1'), /property list uchar float texcoord/);
  const geometry = new PLYLoader().parse(buffer(bytes));
  const { scene } = await load((await ask(model, 'glb?level=2')).bytes);
  const key = (attribute, i) => [0, 1, 2].map((c) => attribute.getComponent(i, c).toFixed(4)).join(' ');
  const wanted = new Map();
  scene.traverse(({ isMesh, geometry: g }) => {
    if (!isMesh) return;
    const { position, normal, uv, color } = g.attributes;
    for (let i = 0; i < position.count; i++) {
      const place = key(position, i);
      if (!wanted.has(place)) wanted.set(place, []);
      wanted.get(place).push({ normal: new Vector3().fromBufferAttribute(normal, i), uv: [uv.getX(i), 1 - uv.getY(i)], color: color && [0, 1, 2].map((c) => color.getComponent(i, c)) });
    }
  });
  const { position, normal, uv, color } = geometry.attributes;
  const byIndex = geometry.index ? geometry.toNonIndexed().attributes : geometry.attributes;
  for (let i = 0; i < position.count; i++) {
    const rows = wanted.get(key(position, i));
    assert.ok(rows, 'the point is one of the GLB');
    assert.ok(rows.some((row) => row.normal.dot(new Vector3().fromBufferAttribute(normal, i)) > 0.9999));
    if (color) assert.ok(rows.some((row) => row.color.every((c, k) => Math.abs(c - color.getComponent(i, k)) < 0.01)));
  }
  assert.ok(color, 'the octopus has colours');
  const uvs = (uv ?? byIndex.uv);
  assert.ok(uvs, 'there are texture coordinates');
  for (let i = 0; i < byIndex.position.count; i++) {
    const rows = wanted.get(key(byIndex.position, i));
    assert.ok(rows.some((row) => Math.hypot(row.uv[0] - uvs.getX(i), row.uv[1] - uvs.getY(i)) < 1e-5), `uv ${i}`);
  }
});

// ---- shells -----------------------------------------------------------------------------------------------

/** An OBJ of cubes, each of 2 x 2 x 2 at x; faces that `keep` refuses are left out, those that `turn` names turned round. */
function cubes(...parts) {
  let text = '', count = 0;
  const quads = [[1, 4, 3, 2], [5, 6, 7, 8], [1, 2, 6, 5], [2, 3, 7, 6], [3, 4, 8, 7], [4, 1, 5, 8]];
  for (const { x, without = [], turned = [] } of parts) {
    for (const [a, b, c] of [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]) text += `v ${a + x} ${b} ${c}\n`;
    quads.forEach((quad, i) => {
      if (without.includes(i)) return;
      text += `f ${(turned.includes(i) ? [...quad].reverse() : quad).map((corner) => corner + count).join(' ')}\n`;
    });
    count += 8;
  }
  return Buffer.from(text);
}

const all = [0, 1, 2, 3, 4, 5];
const prints = {
  'two cubes': { bytes: cubes({ x: 0 }, { x: 5 }), solid: { shells: 2, closed: 2, inverted: 0 }, warns: /^1; the model's metres/ },
  'a box without a side': { bytes: cubes({ x: 0, without: [1] }, { x: 5 }), solid: { shells: 2, closed: 1, inverted: 0, open: 4 }, warns: /1 shell is not closed, (4|8|16|32) open edges/ },
  'a cube inside out': { bytes: cubes({ x: 0 }, { x: 5, turned: all }), solid: { shells: 2, closed: 2, inverted: 1 }, warns: /1 shell is inside out/ },
  'a cube with a face turned round': { bytes: cubes({ x: 0, turned: [2] }), solid: { shells: 1, closed: 0, inverted: 0, flipped: 4 }, warns: /1 shell is not closed, \d+ edges are of two faces of opposite sides/ },
  'a fin on a cube': { bytes: Buffer.concat([cubes({ x: 0 }), Buffer.from('v 1 3 -1\nv 1 3 1\nf 3 9 10 7\n')]), solid: { shells: 1, closed: 0, inverted: 0, open: 3, crowded: 1 }, warns: /1 shell is not closed, \d+ open edges, \d+ edges? ha(s|ve) more than two faces/ },
};

for (const [name, { bytes, solid, warns }] of Object.entries(prints))
  test(`${name}: surface.json tells its shells as admesh does`, async () => {
    const model = await daemon.upload(bytes);
    for (const level of [0, 1, 2, 3]) {
      const more = level > 0 ? '&creases=none' : '';
      const told = JSON.parse((await ask(model, `json?level=${level}&shells=true&unit=mm${more}`)).bytes);
      const { shells, closed, inverted, triangles, open_edges, crowded_edges, flipped_edges, volume, area } = told.solid;
      const edges = 2 ** level;
      assert.deepEqual({ shells, closed, inverted }, { shells: solid.shells, closed: solid.closed, inverted: solid.inverted });
      assert.deepEqual([open_edges, crowded_edges, flipped_edges], [solid.open, solid.crowded, solid.flipped].map((count = 0) => count * edges));
      assert.equal(told.meshes[0].shells.length, shells);
      const sum = told.meshes[0].shells.reduce((sum, shell) => sum + (shell.volume ?? 0), 0);
      assert.ok(Math.abs(sum - volume) < 1e-6 * area ** 1.5, 'volume of the mesh');
      const { bytes: stl, warning } = await ask(model, `stl?level=${level}${more}`);
      assert.match(warning, warns);
      const facets = trianglesOf(new STLLoader().parse(buffer(stl)));
      near(areaOf(facets), area, 1e-5, 'area');
      assert.equal(countOf(facets), triangles);
      const judge = admesh(stl);
      if (!solid.crowded) assert.equal(judge.open, open_edges, 'every open edge is of one facet');
      if (!solid.crowded) assert.equal(judge.shells, shells);
      if (closed === shells && !inverted) near(judge.volume, volume, 1e-4, 'volume by admesh');
    }
  });

// ---- 3MF --------------------------------------------------------------------------------------------------

for (const [name, { bytes, closed }] of Object.entries(models))
  for (const level of [0, 1, 2, 4])
    test(`${name}, level ${level}: lib3mf reads the triangles of the GLB`, { skip: !hasLib3mf && 'lib3mf 1 is not there' }, async () => {
      const model = await daemon.upload(bytes);
      const { bytes: package3mf, response } = await ask(model, `3mf?level=${level}`);
      assert.equal(response.headers.get('Content-Type'), 'model/3mf');
      assert.equal(response.headers.get('Content-Length'), null);
      const { unit, warnings, items } = lib3mf(package3mf), glb = await trianglesOfGlb((await ask(model, `glb?level=${level}`)).bytes);
      assert.deepEqual([unit, warnings], [1, 0], 'millimetres, without a warning');
      assert.equal(items.reduce((sum, item) => sum + item.triangles, 0), countOf(glb));
      const size = 1000 * Math.max(...boundsOf(glb).map(Math.abs)), volume = items.reduce((sum, item) => sum + item.volume, 0);
      assert.ok(Math.abs(volume - 1e9 * volumeOf(glb)) < 1e-5 * size * 1e6 * areaOf(glb), `volume: ${volume}`);
      boundsOf(glb).forEach((bound, i) => {
        const own = (i < 3 ? Math.min : Math.max)(...items.map(({ bounds }) => bounds[i]));
        assert.ok(Math.abs(1000 * bound - own) < 1e-5 * size, `${1000 * bound}, ${own}`);
      });
      for (const { type, valid, manifold } of items) {
        assert.ok(valid);
        assert.equal(type, manifold ? 'model' : 'surface');
        assert.ok(!closed || manifold);
      }
    });

const noPrusa = { skip: !hasPrusa && 'PrusaSlicer is not installed' };
for (const name of ['cube', 'tank', 'mirrored cone'])
  test(`${name}: PrusaSlicer reads the triangles of the GLB from each form, and slices them`, noPrusa, async () => {
    const model = await daemon.upload(models[name].bytes);
    for (const level of [0, 3]) {
      const glb = await trianglesOfGlb((await ask(model, `glb?level=${level}`)).bytes), { shells } = shellsOf(glb);
      for (const [form, scale] of [['stl', 1000], ['3mf', 1000], ['obj', 1]]) {
        if (form === 'obj' && level === 0) continue; // it reads no polygons of over four corners
        const read = prusa(form, (await ask(model, `${form}?level=${level}${form === 'obj' ? '' : '&unit=mm'}`)).bytes);
        assert.deepEqual([read.facets, read.parts], [countOf(glb), form === 'obj' || form === 'stl' ? shells : read.parts], form);
        near(read.volume, volumeOf(glb) * scale ** 3, 2e-4, `${form}: volume`);
        const size = scale * Math.max(...boundsOf(glb).map(Math.abs));
        if (form !== '3mf') boundsOf(glb).forEach((bound, i) => assert.ok(Math.abs(bound * scale - read.bounds[i]) < 1e-5 * size, form));
      }
    }
    const stl = join(folder, 'part.stl'), gcode = join(folder, 'part.gcode');
    writeFileSync(stl, (await ask(model, 'stl?level=2&scale=0.01&unit=mm')).bytes);
    execFileSync('prusa-slicer', ['--export-gcode', '--center', '100,100', '-o', gcode, stl], { stdio: 'ignore' });
    assert.ok(readFileSync(gcode, 'utf8').match(/^G1 /gm).length > 1000);
  });

test('PrusaSlicer loads no 3MF with an open mesh, which a warning says; it loads the STL', noPrusa, async () => {
  const model = await daemon.upload(sample('octopus.obj'));
  const { bytes, warning } = await ask(model, '3mf?level=1');
  assert.match(warning, /type surface, for which PrusaSlicer refuses the whole file/);
  assert.equal(prusa('3mf', bytes), null);
  assert.equal(prusa('stl', (await ask(model, 'stl?level=1')).bytes).facets, 2304);
});

test('a 3MF has an object a mesh, items by node with their transforms, and materials', { skip: !hasLib3mf && 'lib3mf 1 is not there' }, async () => {
  const tank = await daemon.upload(sample('tank.json'));
  const { bytes, warning } = await ask(tank, '3mf?level=1&clip=none');
  const { items, materials } = lib3mf(bytes);
  assert.equal(items.length, 9);
  assert.equal(new Set(items.map(({ object }) => object)).size, 5);
  assert.deepEqual(items.slice(0, 2).map(({ name, part }) => [name, part]), [['hull', 'hull'], ['wheel', 'wheel_front_left']]);
  assert.deepEqual(materials.map(({ name }) => name), ['hull', 'wheel', 'turret', 'barrel', 'antenna', 'none']);
  assert.deepEqual(materials[0].color, [124, 158, 105, 255]);
  assert.doesNotMatch(warning, /millimetres/);
  const inches = lib3mf((await ask(tank, '3mf?level=1&clip=none&unit=in&scale=2')).bytes);
  assert.equal(inches.unit, 3);
  items.forEach(({ bounds }, i) => bounds.forEach((bound, k) => near(inches.items[i].bounds[k], (bound * 2) / 25.4, 1e-5, 'inches')));
  // The same request gives the same bytes; a name may hold anything.
  assert.ok(bytes.equals((await ask(tank, '3mf?level=1&clip=none')).bytes));
  const odd = await daemon.upload(shape({ kind: 'box', size: [1, 1, 1] }, { name: 'a & <b>' }, { mesh: 'a & <b>', name: 'é>' }));
  assert.deepEqual(lib3mf((await ask(odd, '3mf')).bytes).items.map(({ name, part }) => [name, part]), [['a & <b>', 'é>']]);
});

test('mirrored and flat nodes have objects of their own', { skip: !hasLib3mf && 'lib3mf 1 is not there' }, async () => {
  const nodes = [[1, 1, 1], [-1, 1, 1], [1, -2, 1], [1, 0, 1]].map((scale, i) => ({ name: `n${i}`, mesh: 'part', scale }));
  const model = await daemon.upload(Buffer.from(JSON.stringify({ meshes: [{ name: 'part', shape: { kind: 'box', size: [1, 1, 1] } }], nodes })));
  const { items } = lib3mf((await ask(model, '3mf?level=0')).bytes);
  const objects = [...new Set(items.map(({ object }) => object))];
  assert.deepEqual(items.map(({ object }) => objects.indexOf(object)), [0, 1, 1, 2]);
  items.forEach(({ volume }, i) => near(volume, [1e9, 1e9, 2e9, 0][i], 1e-6, 'volume'));
});

test('STL comes in millimetres unless it is told, and says so', async () => {
  const model = await daemon.upload(sample('cube.obj'));
  for (const [query, factor, told] of [['', 1000, /millimetres/], ['?unit=mm', 1000, null], ['?unit=in', 1 / 0.0254, null], ['?unit=m&scale=3', 3, null], ['?scale=0.001', 1, /millimetres/]]) {
    const { bytes, warning } = await ask(model, `stl${query}${query ? '&' : '?'}level=0`);
    const bounds = boundsOf(trianglesOf(new STLLoader().parse(buffer(bytes))));
    bounds.forEach((bound) => near(Math.abs(bound), factor, 1e-6, query));
    if (told) assert.match(warning, told); else assert.equal(warning, '');
    assert.match(bytes.subarray(0, 80).toString('latin1'), /^tweend [\d.]+, unit: (mm|in|m)\0/);
  }
  const { warning } = await ask(model, 'ply?level=0');
  assert.equal(warning, '');
  for (const wrong of ['stl?unit=furlong', 'stl?scale=0', 'stl?scale=-1', 'stl?clip=all', 'stl?meshes=none', 'glb?unit=mm', 'obj?scale=2', 'stl?shells=true', 'json?shells=1', '3mf?unit=km', '3mf?meshes=none'])
    assert.equal((await fetch(`${model}/surface.${wrong}`)).status, 400, wrong);
});

test('Accept chooses, and answers have the name of the model', async () => {
  const model = await daemon.upload(sample('cube.obj'));
  for (const form of ['stl', 'ply', '3mf']) {
    const response = await fetch(`${model}/surface?level=1`, { headers: { Accept: `model/${form}` } });
    assert.equal(response.headers.get('Content-Type'), `model/${form}`);
    assert.match(response.headers.get('Content-Disposition'), new RegExp(`\\.${form}"`));
    assert.ok(Buffer.from(await response.arrayBuffer()).equals((await ask(model, `${form}?level=1`)).bytes));
  }
});

test('what STL and PLY have no place for is told', async () => {
  const octopus = await daemon.upload(sample('octopus.obj')), tank = await daemon.upload(sample('tank.json'));
  const told = Buffer.from(models.cube.bytes.toString().replace(/^(v .*)$/gm, '$1 1 0.5 0').replace(/^f.*$/gm, (face) => face.replace(/ (\d+)\S*/g, ' $1/1')).replace(/^f/m, 'vt 0.5 0.5\nf'));
  assert.match((await ask(await daemon.upload(told), 'stl?unit=m')).warning, /surface\.stl is without: texture coordinates, colours/);
  assert.match((await ask(octopus, 'stl?unit=m')).warning, /^2; 1 shell is not closed, 32 open edges/);
  assert.match((await ask(tank, 'stl?unit=m&clip=none')).warning, /surface\.stl is without: the nodes, which are one mesh/);
  const hard = await daemon.upload(models['creased box'].bytes);
  assert.match((await ask(hard, 'ply')).warning, /surface\.ply is without: all but one normal of a point/);
});

test('a model far from the origin keeps its shape, and its place is told', async () => {
  const far = [4e6, 0, -5e6];
  const corners = [...Array(8).keys()].map((i) => `v ${[i & 1, (i >> 1) & 1, i >> 2].map((x, c) => x * 0.25 + far[c]).join(' ')}`);
  const faces = ['1 3 4 2', '5 6 8 7', '1 2 6 5', '3 7 8 4', '1 5 7 3', '2 4 8 6'].map((face) => `f ${face}`);
  const model = await daemon.upload(`${corners.join('\n')}\n${faces.join('\n')}\n`);
  for (const form of ['stl', 'ply']) {
    const { bytes, warning } = await ask(model, `${form}?level=0&unit=m`);
    assert.match(warning, /moved by -4000000.25, 0, 5e\+06 of the model/);
    const triangles = trianglesOf(form === 'stl' ? new STLLoader().parse(buffer(bytes)) : new PLYLoader().parse(buffer(bytes)));
    near(volumeOf(triangles), 0.25 ** 3, 1e-6, form);
    assert.equal(shellsOf(triangles).open, 0);
    const { forms } = JSON.parse((await ask(model, 'json?level=0')).bytes);
    assert.equal(forms[form], bytes.length);
  }
});

test('a 3MF of a model far from the origin is moved as a whole', { skip: !hasLib3mf && 'lib3mf 1 is not there' }, async () => {
  const nodes = [4e6, 4e6 + 3].map((x, i) => ({ name: `n${i}`, mesh: 'part', translation: [x, 0, -5e6] }));
  const model = await daemon.upload(JSON.stringify({ meshes: [{ name: 'part', shape: { kind: 'box', size: [1, 1, 1] } }], nodes }));
  const { bytes, warning } = await ask(model, '3mf?level=0&unit=m');
  assert.match(warning, /moved by -4e\+06, 0, 5e\+06 of the model/);
  const { items } = lib3mf(bytes);
  items.forEach(({ bounds }, i) => bounds.forEach((bound, k) => near(bound, [-0.5 + 3 * i, -0.5, -0.5, 0.5 + 3 * i, 0.5, 0.5][k], 1e-6, `bound ${k}`)));
});

test('skinned and posed models are at their joints', async () => {
  const model = await daemon.upload(sample('tank.json'));
  const glb = await trianglesOfGlb((await ask(model, 'glb?level=1&clip=drive&at=1.7')).bytes);
  const stl = trianglesOf(new STLLoader().parse(buffer((await ask(model, 'stl?level=1&clip=drive&at=1.7&unit=m')).bytes)));
  boundsOf(stl).forEach((bound, i) => assert.ok(Math.abs(bound - boundsOf(glb)[i]) < 1e-5));
});
