// Sizes of level 4 of a cage as float, quantized and compressed glTF, compared with npm's gltfpack of the float answer
// at the same number of bits; MB of float data a second, cold (including measuring the grid) and warm; peak resident
// memory at levels 4 and 6.
// usage: node tests/bench/encodings.mjs BUILD [OBJ...]
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { basename, join } from 'node:path';

import { Daemon, root } from '../node/daemon.mjs';

const gltfpack = createRequire(join(root, 'tests/node/package.json'))('gltfpack');
const [build, ...files] = process.argv.slice(2);
const cages = files.length > 0 ? files : ['tank.json', 'octopus.obj'].map((name) => join(root, 'server/samples', name));
process.env.TESTED_BINARY = join(build, 'tweend');

async function pack(glb, flags) {
  let packed;
  const files = { read: () => glb, write: (_, bytes) => (packed = bytes.slice()) };
  await gltfpack.pack(['-i', 'in.glb', '-o', 'out.glb', '-kn', '-km', '-ke', '-kv', ...flags], files);
  return packed.length;
}

async function get(url) {
  const start = performance.now();
  const response = await fetch(url);
  const bytes = new Uint8Array(await response.arrayBuffer());
  if (!response.ok) throw new Error(Buffer.from(bytes).toString());
  return { bytes, seconds: (performance.now() - start) / 1000 };
}

const SAME_BITS = ['-vp', '16', '-vt', '16', '-vn', '8', '-vc', '16', '-vpn'];
const row = (...cells) => console.log(cells.map((cell, i) => (i ? String(cell).padStart(13) : cell.padEnd(24))).join(''));
row('level 4', 'bytes', 'gltfpack', 'ratio', 'cold, MB/s', 'warm, MB/s', 'peak 4, MB', 'peak 6, MB');

for (const cage of cages) {
  let float;
  for (const encoding of ['float', 'quantized', 'meshopt']) {
    const daemon = new Daemon(['--plan-cache', '64MiB']);
    try {
      await daemon.start();
      const peak = () => Math.round(readFileSync(`/proc/${daemon.process.pid}/status`, 'utf8').match(/VmHWM:\s+(\d+)/)[1] / 1024);
      const model = await daemon.upload(readFileSync(cage));
      const url = (level) => `${model}/surface.glb?level=${level}&encoding=${encoding}`;
      const cold = await get(url(4));
      const times = [];
      for (let i = 0; i < 7; i++) times.push((await get(url(4))).seconds);
      const warm = times.sort((a, b) => a - b)[3];
      const peak4 = peak();
      await get(url(6));
      float ??= cold.bytes;
      const peer = encoding === 'float' ? float.length : await pack(float, encoding === 'meshopt' ? ['-c', ...SAME_BITS] : SAME_BITS);
      const speed = (seconds) => Math.round(float.length / seconds / 1e6);
      row(`${basename(cage)}, ${encoding}`, cold.bytes.length, peer, (cold.bytes.length / peer).toFixed(2), speed(cold.seconds),
        speed(warm), peak4, peak());
    } finally {
      await daemon.remove();
    }
  }
}
