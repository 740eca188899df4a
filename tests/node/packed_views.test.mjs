// Compressed buffer views of uploads against meshoptimizer's own decoder: what MeshoptEncoder packs, in both versions of the codec
// and with all filters, is read as the same glTF with the bytes that MeshoptDecoder makes of it.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { MeshoptDecoder, MeshoptEncoder } from 'meshoptimizer';

import { Daemon } from './daemon.mjs';

const daemon = new Daemon();
before(async () => {
  await Promise.all([daemon.start(), MeshoptDecoder.ready, MeshoptEncoder.ready]);
});
after(() => daemon.remove());

/** Numbers from 0 to 1, the same in every run. */
function* numbers(seed) {
  for (let x = seed; ; ) yield (x = (Math.imul(x, 1664525) + 1013904223) >>> 0) / 2 ** 32;
}

const FLOAT = 5126;
const BYTE = 5120;
const UNSIGNED_BYTE = 5121;
const SHORT = 5122;
const UNSIGNED_SHORT = 5123;

const glbOf = (json, binary) => {
  const text = Buffer.from(JSON.stringify(json).padEnd(Math.ceil(JSON.stringify(json).length / 4) * 4));
  const head = Buffer.alloc(20);
  head.write('glTF');
  [2, 28 + text.length + binary.length, text.length, 0x4e4f534a].forEach((value, i) => head.writeUInt32LE(value, 4 + 4 * i));
  const behind = Buffer.alloc(8);
  behind.writeUInt32LE(binary.length);
  behind.write('BIN\0', 4);
  return Buffer.concat([head, text, behind, binary]);
};

/**
 * A GLB of triangles. views: [{ name, bytes, stride, mode, filter, attributes: [[semantic, offset, type, componentType, normalized]] }], of
 * count elements each; one without attributes is the indices. extension: undefined for plain views.
 */
function glb(views, count, extension, version, fallback = {}) {
  const json = {
    asset: { version: '2.0' },
    buffers: [{}, { byteLength: views.reduce((sum, { bytes }) => sum + bytes.length, 0), ...fallback }],
    bufferViews: [],
    accessors: [],
    meshes: [{ primitives: [{ attributes: {} }] }],
    nodes: [{ mesh: 0 }],
    scenes: [{ nodes: [0] }],
    scene: 0,
    extensionsUsed: ['KHR_mesh_quantization', ...(extension ? [extension] : [])],
  };
  json.extensionsRequired = json.extensionsUsed;
  const [primitive] = json.meshes[0].primitives;
  const parts = [];
  let size = 0;
  let place = 0;
  for (const { bytes, stride, mode, filter = 'NONE', attributes } of views) {
    const elements = bytes.length / stride;
    // At level 3 the encoder tries all modes of version 1.
    const packed =
      mode === 'ATTRIBUTES'
        ? MeshoptEncoder.encodeVertexBufferLevel(bytes, elements, stride, 3, version)
        : MeshoptEncoder.encodeGltfBuffer(bytes, elements, stride, mode, version);
    const decoded = new Uint8Array(bytes.length);
    MeshoptDecoder.decodeGltfBuffer(decoded, elements, stride, packed, mode, filter);
    const stored = extension ? packed : decoded;
    json.bufferViews.push({
      buffer: extension ? 1 : 0,
      byteOffset: extension ? place : size,
      byteLength: bytes.length,
      ...(attributes && { byteStride: stride }),
      ...(extension && {
        extensions: { [extension]: { buffer: 0, byteOffset: size, byteLength: packed.length, byteStride: stride, count: elements, mode, filter } },
      }),
    });
    parts.push(Buffer.from(stored), Buffer.alloc(-stored.length & 3));
    size += stored.length + (-stored.length & 3);
    place += bytes.length;
    for (const [semantic, byteOffset, type, componentType, normalized] of attributes ?? []) {
      primitive.attributes[semantic] = json.accessors.length;
      const bounds = semantic === 'POSITION' ? { min: [-100, -100, -100], max: [100, 100, 100] } : {};
      json.accessors.push({ bufferView: json.bufferViews.length - 1, byteOffset, type, componentType, normalized, count, ...bounds });
    }
    if (attributes) continue;
    primitive.indices = json.accessors.length;
    json.accessors.push({ bufferView: json.bufferViews.length - 1, type: 'SCALAR', componentType: stride === 2 ? UNSIGNED_SHORT : 5125, count: elements });
  }
  json.buffers[0].byteLength = size;
  if (!extension) json.buffers.length = 1;
  return glbOf(json, Buffer.concat(parts));
}

/** Bytes of `count` elements whose columns go all ways: still, slow, fast, of one bit, wild, small steps of 16 and of 32 bits. */
function columns(count, stride, random) {
  const out = Buffer.alloc(count * stride);
  for (let column = 0; column < stride; column += 4) {
    const kind = Math.floor(random.next().value * 7);
    let value = Math.floor(random.next().value * 2 ** 32);
    for (let i = 0; i < count; i++) {
      const r = random.next().value;
      if (kind === 1) value += Math.floor(r * 3) - 1;
      if (kind === 2) value += Math.floor(r * 60000) - 30000;
      if (kind === 3) value ^= r < 0.5 ? 0x01000100 : 0;
      if (kind === 4) value = Math.floor(r * 2 ** 32);
      if (kind === 5) value ^= Math.floor(r * 16) << 13;
      if (kind === 6 && r < 0.02) value += 0x01010101;
      out.writeUInt32LE(value >>> 0, i * stride + column);
    }
  }
  return out;
}

const answer = async (file) => {
  const model = await daemon.upload(file);
  const response = await fetch(`${model}/surface.glb?level=0&weld=none&quads=off&creases=none&normals=none`);
  assert.equal(response.status, 200, await response.clone().text());
  return Buffer.from(await response.arrayBuffer());
};

/** The points of a strip, whose x are as floats and so that no face is thin. */
const points = (count) => Float32Array.from({ length: 3 * count }, (_, i) => [Math.floor(i / 6) / 8, (Math.floor(i / 3) % 2) + 0.1, (i % 5) / 7][i % 3]);
const positions = (count) => ({ bytes: Buffer.from(points(count).buffer), stride: 12, mode: 'ATTRIBUTES', attributes: [['POSITION', 0, 'VEC3', FLOAT]] });

const indices = (count, Type) => {
  const corners = (i) => Math.floor(i / 3) + (Math.floor(i / 3) % 2 ? [1, 0, 2] : [0, 1, 2])[i % 3];
  return { bytes: Buffer.from(Type.from({ length: 3 * (count - 2) }, (_, i) => corners(i)).buffer), stride: Type.BYTES_PER_ELEMENT, mode: 'TRIANGLES' };
};

/** Application attributes over the columns, as pairs of whole numbers: at most 12, which are spread. */
function pairs(stride) {
  const count = Math.min(stride / 4, 12);
  return Array.from({ length: count }, (_, i) => [`_P${i}`, 4 * Math.floor((i * stride) / 4 / count), 'VEC2', UNSIGNED_SHORT]);
}

const FORMS = [['EXT_meshopt_compression', 0], ['KHR_meshopt_compression', 0], ['KHR_meshopt_compression', 1]];

for (const [extension, version] of FORMS) {
  test(`${extension}, version ${version}: columns of all kinds are read as meshoptimizer reads them`, async () => {
    const random = numbers(41);
    for (const stride of [4, 8, 12, 20, 32, 64, 252])
      for (const count of [3, 16, 17, 255, 256, 300, 1000]) {
        const views = [
          positions(count),
          { bytes: columns(count, stride, random), stride, mode: 'ATTRIBUTES', attributes: pairs(stride) },
          indices(count, count % 2 ? Uint32Array : Uint16Array),
        ];
        const packed = await answer(glb(views, count, extension, version));
        assert.deepEqual(packed, await answer(glb(views, count, undefined, version)), `${stride} ${count}`);
      }
  });

  test(`${extension}, version ${version}: filters are undone`, async () => {
    const count = 333;
    const random = numbers(7);
    const floats = (width, make) => new Float32Array(Array.from({ length: width * count }, (_, i) => make(random.next().value, i % width)));
    const vectors = floats(4, (r, k) => (k === 3 ? 1 : r - 0.5));
    for (let i = 0; i < count; i++) {
      const length = Math.hypot(...vectors.subarray(4 * i, 4 * i + 3));
      for (let k = 0; k < 3; k++) vectors[4 * i + k] /= length;
    }
    const colors = floats(4, (r) => (r < 0.1 ? 0 : r > 0.9 ? 1 : r));
    for (const [stride, bits] of [[4, 8], [4, 5], [8, 16], [8, 10]]) {
      const narrow = stride === 4;
      const view = (bytes, stride, filter, ...attribute) => ({ bytes: Buffer.from(bytes), stride, mode: 'ATTRIBUTES', filter, attributes: [attribute] });
      const views = [
        view(MeshoptEncoder.encodeFilterExp(points(count), count, 12, 15), 12, 'EXPONENTIAL', 'POSITION', 0, 'VEC3', FLOAT),
        view(MeshoptEncoder.encodeFilterOct(vectors, count, stride, bits), stride, 'OCTAHEDRAL', 'NORMAL', 0, 'VEC3', narrow ? BYTE : SHORT, true),
      ];
      const coded = MeshoptEncoder.encodeFilterColor(colors, count, stride, bits);
      if (extension === 'KHR_meshopt_compression') // the other one has no filter of colours
        views.push(view(coded, stride, 'COLOR', 'COLOR_0', 0, 'VEC4', narrow ? UNSIGNED_BYTE : UNSIGNED_SHORT, true));
      assert.deepEqual(await answer(glb(views, count, extension, version)), await answer(glb(views, count, undefined, version)), `${stride} ${bits}`);
    }
  });
}

test('what stands in for compressed bytes is not needed', async () => {
  const count = 20;
  const views = [
    positions(count),
    indices(count, Uint16Array),
  ];
  const plain = await answer(glb(views, count, undefined, 0));
  for (const extension of ['EXT_meshopt_compression', 'KHR_meshopt_compression']) {
    const tag = { extensions: { [extension]: { fallback: true } } };
    for (const fallback of [{}, tag, { uri: 'beside.bin' }, { uri: 'beside.bin', ...tag }])
      assert.deepEqual(await answer(glb(views, count, extension, 0, fallback)), plain, JSON.stringify(fallback));
    // In a form, with the other files and without it.
    const file = glb(views, count, extension, 0, { uri: 'beside.bin', ...tag });
    const length = file.readUInt32LE(12);
    const json = JSON.parse(file.subarray(20, 20 + length));
    json.buffers[0].uri = 'packed.bin';
    const form = (...more) => {
      const body = new FormData();
      const files = { 'a.gltf': JSON.stringify(json), 'packed.bin': file.subarray(28 + length), 'beside.bin': Buffer.alloc(json.buffers[1].byteLength) };
      for (const name of ['a.gltf', ...more]) body.append('file', new Blob([files[name]]), name);
      return fetch(`${daemon.url}/v1/models`, { method: 'POST', body });
    };
    for (const more of [['packed.bin'], ['packed.bin', 'beside.bin']]) {
      const { id } = await (await form(...more)).json();
      const response = await fetch(`${daemon.url}/v1/models/${id}/surface.glb?level=0&weld=none&quads=off&creases=none&normals=none`);
      assert.deepEqual(Buffer.from(await response.arrayBuffer()), plain, more.join());
    }
    assert.match((await (await form('beside.bin')).json()).detail, /packed\.bin.* was not sent/);
  }
});
