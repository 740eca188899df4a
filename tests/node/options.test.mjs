// Every option of surfaces on models that have everything: the validator agrees, the counts and sizes told
// beforehand are exact, limits hold to the byte, and the bytes are the same from any number of threads.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { after, before, test } from 'node:test';


import { Daemon } from './daemon.mjs';
import { objections } from './objections.mjs';
import { writeSamples } from './samples.mjs';

// ---- models -----------------------------------------------------------------------------------------

/** A bent sheet of columns x rows quads with colours, the middle column cut by a UV seam. */
function sheet(columns, rows, face) {
  const lines = [];
  for (let y = 0; y <= rows; y++)
    for (let x = 0; x <= columns; x++)
      lines.push(`v ${x} ${y} ${Math.sin(x + y * y) / 2} ${x / columns} ${y / rows} 0.5`);
  for (let y = 0; y <= rows; y++)
    for (let x = 0; x <= columns + 1; x++) lines.push(`vt ${x / columns / 1.1} ${y / rows}`);
  const half = columns / 2;
  for (let y = 0; y < rows; y++)
    for (let x = 0; x < columns; x++) {
      const corner = (dx, dy) =>
        `${(y + dy) * (columns + 1) + x + dx + 1}/${(y + dy) * (columns + 2) + x + dx + 1 + (x >= half)}`;
      lines.push(...face(x, y, [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]));
    }
  return lines;
}

const tags = [
  't crease 2/1/0 8 9 10',
  't crease 2/1/0 9 10 10',
  't crease 2/1/0 15 16 1.5',
  't crease 2/1/0 16 23 3.25',
  't corner 1/1/0 18 10',
  't corner 1/1/0 25 0.75',
  't hole 1/0/0 8',
];

const quads = ['o sheet', ...sheet(6, 5, (x, y, corners) => [
  ...(x % 2 ? [] : [`usemtl ${y % 2 ? 'red' : 'blue'}`, `g row${y} ${x < 3 ? 'left' : 'right'}`]),
  ...(x === 4 && y === 3 // two triangles
    ? [`f ${corners[0]} ${corners[1]} ${corners[2]}`, `f ${corners[2]} ${corners[3]} ${corners[0]}`]
    : [`f ${corners.join(' ')}`]),
]), ...tags].join('\n');

const triangles = ['o sheet', 'g all', ...sheet(6, 5, (x, y, corners) => [
  `g part${(x + y) % 3}`,
  `f ${corners[0]} ${corners[1]} ${corners[2]}`,
  `f ${corners[2]} ${corners[3]} ${corners[0]}`,
]), ...tags].join('\n');

/** Two objects, and a third of faces with 3, 5 and 6 corners: a bow tie and an edge of three faces. */
const parts = `o one
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1
g top\nf 1 2 5\nf 2 3 5\nf 3 4 5\ng top left\nf 4 1 5\ng\nusemtl ground\nf 4 3 2 1
o two
v 5 0 0\nv 6 0 0\nv 6 1 0\nv 5.5 2 0\nv 5 1 0
f 6 7 8 9 10
o three
v 9 0 0\nv 10 0 0\nv 11 1 0\nv 10 2 0\nv 9 2 0\nv 8 1 0\nv 9 1 2\nv 8 -1 0\nv 7 -1 1
g fan\nf 11 12 13 14 15 16\nf 12 11 17\nf 11 12 17\nf 11 18 19
`;

/** Shapes without a normal of their own: a cube that is a point, one that is a line, a needle, a doubled face. */
const cube = 'f -8 -5 -6 -7\nf -4 -3 -2 -1\nf -8 -7 -3 -4\nf -7 -6 -2 -3\nf -6 -5 -1 -2\nf -5 -8 -4 -1\n';
const degenerate = `o point
${'v 0 0 0\n'.repeat(8)}${cube}o line
${[0, 1, 2, 3, 4, 5, 6, 7].map((x) => `v ${x} 0 0\n`).join('')}${cube}o needle
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1e15\nf -5 -2 -3 -4\nf -5 -4 -1\nf -4 -3 -1\nf -3 -2 -1\nf -2 -5 -1
o double
v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nf -1 -2 -3
`;

const sampleOf = Object.fromEntries(writeSamples().map((sample) => [sample.name, sample.glb]));

/** A box whose sides are shaded flat, with lengths of normals that exporters write, and one side without any. */
const shaded = `o box
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
vn 0 0 -2\nvn 0 0 0.9999\nvn 0 -0.001 0\nvn 1 0 0\nvn 0 0 0
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
f 1/1/1 4/2/1 3/3/1 2/4/1\nf 5/1/2 6/2/2 7/3/2 8/4/2\nf 1/1/3 2/2/3 6/3/3 5/4/3\nf 2/1/4 3/2/4 7/3/4 6/4/4
f 3/1/5 4/2/5 8/3/5 7/4/5\nf 4/1 1/2 5/3\nf 5/3 8/4 4/1
`;

/** [{name, bytes, options: queries}] */
const models = [
  {
    name: 'quads',
    bytes: quads,
    options: [
      ...[0, 1, 2, 3, 4].map((level) => `level=${level}`),
      ...['catmull-clark', 'bilinear'].flatMap((scheme) =>
        ['edge-and-corner', 'edge-only', 'none', 'open'].flatMap((boundary) =>
          ['uniform', 'chaikin'].map((creasing) =>
            `level=2&scheme=${scheme}&boundary=${boundary}&creasing=${creasing}`))),
      ...['corners-only', 'none', 'corners-plus1', 'corners-plus2', 'boundaries', 'all'].map((uv) => `level=3&uv=${uv}`),
      'level=2&triangles=smooth',
      'level=3&limit=true',
      'level=3&limit=true&boundary=open',
      'level=2&normals=none',
      ...[0, 1, 2].map((level) => `level=${level}&polygons=ngon`),
      ...['none', 'normals', 'angle:20', 'auto', 'auto&crease_sharpness=1.5'].map((creases) => `level=2&creases=${creases}`),
    ],
  },
  {
    name: 'triangles',
    bytes: triangles,
    options: [
      ...[0, 1, 2, 3].map((level) => `level=${level}&scheme=loop`),
      ...['edge-only', 'none', 'open'].map((boundary) => `level=2&scheme=loop&boundary=${boundary}`),
      'level=2&scheme=loop&creasing=chaikin',
      'level=2&scheme=loop&limit=true',
      'level=2&scheme=loop&uv=all',
      'level=2&scheme=loop&normals=none',
      'level=1&scheme=loop&polygons=ngon',
      'level=1&triangles=smooth',
    ],
  },
  {
    name: 'parts',
    bytes: parts,
    options: [0, 1, 2, 3].flatMap((level) => [`level=${level}`, `level=${level}&limit=true`]),
  },
  {
    name: 'degenerate',
    bytes: degenerate,
    options: [0, 1, 2, 4].flatMap((level) =>
      ['', '&limit=true', '&scheme=bilinear'].map((rest) => `level=${level}${rest}`)),
  },
  {
    name: 'skinned_and_mapped_0',
    bytes: sampleOf.skinned_and_mapped_0,
    options: [
      ...[0, 1, 2].map((level) => `level=${level}`),
      ...['off', 'auto', 'ngon'].map((quads) => `level=1&quads=${quads}`),
      'level=1&quads=off&scheme=loop',
      'level=2&scheme=bilinear',
      'level=1&limit=true',
      'level=1&normals=none',
      'level=1&boundary=open',
      'level=2&polygons=ngon',
    ],
  },
  {
    name: 'shaded',
    bytes: shaded,
    options: ['', '&normals=limit', '&normals=none', '&polygons=ngon', '&limit=true'].flatMap((rest) =>
      [`level=0${rest}`, `level=0&creases=auto${rest}`]),
  },
  { name: 'forty_morphs', bytes: sampleOf.forty_morphs, options: ['level=1', 'level=1&limit=true&normals=none'] },
  { name: 'two_maps', bytes: sampleOf.two_maps, options: ['level=0', 'level=1', 'level=2&uv=all', 'level=1&limit=true'] },
  { name: 'textured', bytes: sampleOf.textured, options: ['level=2', 'level=2&quads=auto&uv=boundaries'] },
  {
    name: 'animated',
    bytes: sampleOf.animated,
    options: [
      'level=1',
      ...['', '&at=0.7', '&at=0,0.5,1', '&from=0&to=1&fps=12', '&tolerance=0.5'].map((rest) => `clip=aim${rest}`),
    ],
  },
];

const cases = models.flatMap(({ name, bytes, options }) => options.map((query) => ({ name, bytes, query })));

// ---- the daemons --------------------------------------------------------------------------------------

const one = new Daemon(['--threads', '1', '--io-threads', '1']);
const four = new Daemon(['--threads', '4', '--io-threads', '2', '--queue', '400']);
const addresses = new Map(); // of a daemon: model name to address

before(async () => {
  for (const daemon of [one, four]) {
    await daemon.start();
    const found = {};
    for (const { name, bytes } of models) found[name] = await daemon.upload(bytes);
    addresses.set(daemon, found);
  }
});
after(async () => {
  await one.remove();
  await four.remove();
});

/** An OBJ shows the same meshes, but holds no animation; one time poses the meshes. */
function fitting(query, form) {
  if (form !== 'obj' || /(^|&)at=[^,&]*(&|$)/.test(query)) return query;
  return query.split('&').filter((part) => !/^(clip|at|from|to|fps|tolerance|tolerance_m)=/.test(part)).join('&');
}

const address = (daemon, { name, query }, form) =>
  `${addresses.get(daemon)[name]}/surface.${form}?${fitting(query, form)}`;

async function get(daemon, one, form) {
  const answer = await fetch(address(daemon, one, form));
  const bytes = Buffer.from(await answer.arrayBuffer());
  assert.equal(answer.status, 200, `${form} ${bytes.subarray(0, 500)}`);
  return { bytes, length: answer.headers.get('content-length') };
}

const sha256 = (bytes) => createHash('sha256').update(bytes).digest('hex');

/** The JSON chunk of a GLB. */
const jsonOf = (glb) => JSON.parse(glb.subarray(20, 20 + glb.readUInt32LE(12)));

// ---- what holds of every answer -------------------------------------------------------------------------

/** A normal map asks for tangents, which go with the normals that a query may do without. */
const GENERATED = 'MESH_PRIMITIVE_GENERATED_TANGENT_SPACE';

async function objectionsTo(bytes, query) {
  return (await objections(bytes)).filter((line) => !line.startsWith(`${GENERATED} `) || !query.includes('normals=none'));
}

/** Lines of an OBJ that begin with the keyword. */
const statements = (text, keyword) => text.split('\n').filter((line) => line.startsWith(`${keyword} `));

function sum(numbers) {
  return numbers.reduce((total, number) => total + number, 0);
}

for (const asked of cases) {
  test(`${asked.name} ${asked.query}: valid, and as foretold`, async () => {
    const foretold = JSON.parse((await get(one, asked, 'json')).bytes);
    const glb = await get(one, asked, 'glb');
    const gltf = await get(one, asked, 'gltf');
    const obj = (await get(one, asked, 'obj')).bytes.toString();
    assert.deepEqual(await objectionsTo(glb.bytes, asked.query), []);
    assert.deepEqual(await objectionsTo(gltf.bytes, asked.query), []);
    assert.equal(glb.bytes.length, foretold.bytes);
    assert.equal(Number(glb.length), foretold.bytes);
    assert.equal(Number(gltf.length), gltf.bytes.length);

    const faces = statements(obj, 'f').map((line) => line.split(' ').length - 1);
    // A level 0 of polygons has holes as well, in extras; an OBJ has none.
    const query = asked.query.replace('level=0&polygons=ngon', 'level=0');
    const withoutHoles = JSON.parse((await get(one, { ...asked, query }, 'json')).bytes);
    assert.equal(faces.length, withoutHoles.faces);
    assert.equal(statements(obj, 'v').length, withoutHoles.vertices);
    for (const count of ['vertices', 'edges', 'faces'])
      assert.equal(sum(foretold.meshes.map((mesh) => mesh[count])), foretold[count]);
    const document = jsonOf(glb.bytes);
    const primitives = document.meshes.flatMap((mesh) => mesh.primitives).filter((primitive) => 'indices' in primitive); // a mesh without faces has none
    const indices = primitives.map((primitive) => document.accessors[primitive.indices].count);
    assert.equal(sum(indices), 3 * sum(faces.map((size) => size - 2)));
  });
}

test('edges foretold are those of the faces', async () => {
  for (const asked of cases.filter(({ name }) => name === 'quads' || name === 'triangles')) {
    const foretold = JSON.parse((await get(one, asked, 'json')).bytes);
    const edges = new Set();
    for (const line of statements((await get(one, asked, 'obj')).bytes.toString(), 'f')) {
      const points = line.slice(2).split(' ').map((corner) => Number(corner.split('/')[0]));
      points.forEach((point, i) => {
        const next = points[(i + 1) % points.length];
        edges.add(point < next ? `${point} ${next}` : `${next} ${point}`);
      });
    }
    assert.equal(edges.size, foretold.edges, asked.query);
  }
});

test('groups of a primitive are ranges of its indices, one after the other', async () => {
  const document = jsonOf((await get(one, { name: 'quads', query: 'level=2' }, 'glb')).bytes);
  const seen = new Set();
  for (const { extras, indices } of document.meshes[0].primitives) {
    let end = 0;
    for (const { names, start, count } of extras.groups) {
      assert.equal(start, end);
      assert.ok(count > 0 && count % 24 === 0); // a corner of the cage becomes 4 quads
      end = start + count;
      seen.add(names.join(' '));
    }
    assert.equal(end, document.accessors[indices].count);
  }
  assert.equal(seen.size, 10);
});

/** Readers of files leave collapsed faces out; tweend JSON says what it means. */
test('where nothing tells of a normal it is +Y', async () => {
  const faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
  const positions = Array.from({ length: 8 }, () => [0, 0, 0]);
  const point = await one.upload(JSON.stringify({ meshes: [{ name: 'point', positions, faces }], nodes: [{ mesh: 'point' }] }));
  for (const query of ['level=0', 'level=2', 'level=2&limit=true', 'level=2&scheme=bilinear']) {
    const normals = statements(await (await fetch(`${point}/surface.obj?${query}`)).text(), 'vn');
    assert.ok(normals.length >= 8, `${normals.length} normals`);
    assert.deepEqual([...new Set(normals)], ['vn 0 1 0']);
  }
});

// ---- the same bytes -------------------------------------------------------------------------------------

test('one thread or four, alone or all at once, now or again: the same bytes', async () => {
  const forms = ['glb', 'gltf', 'obj'];
  const wanted = cases.flatMap((asked) => forms.map((form) => ({ asked, form })));
  const hashes = [];
  for (const { asked, form } of wanted) hashes.push(sha256((await get(one, asked, form)).bytes));
  for (let round = 0; round < 2; round++) {
    const together = await Promise.all(wanted.map(({ asked, form }) => get(four, asked, form)));
    together.forEach(({ bytes }, i) => {
      const { asked, form } = wanted[i];
      assert.equal(sha256(bytes), hashes[i], `${asked.name} ${asked.query} ${form}`);
    });
  }
});

// ---- limits ---------------------------------------------------------------------------------------------

test('a limit on the size of answers holds to the byte', async () => {
  const sizes = [];
  for (const asked of cases) sizes.push(JSON.parse((await get(one, asked, 'json')).bytes).bytes);
  const limit = [...sizes].sort((a, b) => a - b)[sizes.length >> 1];
  for (const [flag, isOver] of [[limit, (size) => size > limit], [limit - 1, (size) => size >= limit]]) {
    const limited = new Daemon(['--max-output', String(flag)]);
    try {
      await limited.start();
      const found = {};
      for (const { name, bytes } of models) found[name] = await limited.upload(bytes);
      addresses.set(limited, found);
      for (const [i, asked] of cases.entries()) {
        const status = isOver(sizes[i]) ? 422 : 200;
        for (const [method, form] of [['GET', 'json'], ['HEAD', 'glb'], ['GET', 'glb']]) {
          const answer = await fetch(address(limited, asked, form), { method });
          await answer.arrayBuffer();
          assert.equal(answer.status, status, `${method} ${form} ${asked.name} ${asked.query}`);
        }
      }
    } finally {
      await limited.remove();
    }
  }
});
