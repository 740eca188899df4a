// Samples the scenes of anim_bench.c with three.js: nanoseconds per joint and time, compared with those that anim_bench
// wrote as JSON, to which they are added. Packages: npm ci in tests/node. usage: node anim_bench.mjs JSON
import { readFileSync, writeFileSync } from 'node:fs';
import { performance } from 'node:perf_hooks';
import { QuaternionKeyframeTrack, REVISION } from '../node/node_modules/three/build/three.module.js';

const RUNS = 9;

// Irregular key times over ten seconds, unit quaternions.
function makeTrack(keyCount) {
  const times = new Float32Array(keyCount);
  const values = new Float32Array(4 * keyCount);
  for (let key = 0, time = 0; key < keyCount; key++, time += 0.05 + Math.random() * Math.random()) {
    times[key] = time;
    const q = [0, 1, 2, 3].map(() => Math.random() - 0.5);
    values.set(q.map((x) => x / Math.hypot(...q)), 4 * key);
  }
  const scale = 10 / times[keyCount - 1];
  return new QuaternionKeyframeTrack('joint.quaternion', times.map((t) => t * scale), values);
}

function measure(samplers, times, byTrack) {
  const runs = [];
  for (let run = 0; run <= RUNS; run++) {
    const start = performance.now();
    if (byTrack) for (const sampler of samplers) for (const time of times) sampler.evaluate(time);
    else for (const time of times) for (const sampler of samplers) sampler.evaluate(time);
    runs.push(((performance.now() - start) * 1e6) / (times.length * samplers.length));
  }
  runs.shift(); // the first one compiles
  return runs.sort((a, b) => a - b);
}

const [file] = process.argv.slice(2);
const rows = JSON.parse(readFileSync(file, 'utf8'));

// Adds the peer's numbers to the row of the same scene.
function compare(scene, name, runs) {
  const [least, median, most] = [runs[0], runs[RUNS >> 1], runs[RUNS - 1]];
  const row = rows.find((known) => known.scene === scene && known.name === name);
  row.three = { median, least, most, ratio: median / row.median };
  const text = [least, median, most].map((ns) => ns.toFixed(1));
  console.log(`  ${name.padEnd(34)} ${text[1].padStart(10)} ns (${text[0]} to ${text[2]})   ` +
    `tweend ${row.median.toFixed(2)}, ratio ${row.three.ratio.toFixed(1)}`);
}

console.log(`three.js ${REVISION}, node ${process.version}; median of ${RUNS} runs (least to most)`);
for (const joints of [24, 100, 1000])
  for (const keys of [10, 1000]) {
    const samplers = Array.from({ length: joints }, () => makeTrack(keys).createInterpolant());
    const ordered = Array.from({ length: 512 }, (_, i) => (10 * i) / 512);
    const count = joints > 100 ? 1000 : 10000; // more times would only take longer
    const bulk = Array.from({ length: count }, (_, i) => (10 * i) / count);
    const scene = `${joints} joints, ${keys} keys`;
    console.log(scene);
    compare(scene, 'in order', measure(samplers, ordered, false));
    compare(scene, 'at random', measure(samplers, ordered.map(() => 10 * Math.random()), false));
    compare(scene, '10,000 times', measure(samplers, bulk, true));
  }
writeFileSync(file, JSON.stringify(rows, null, 1) + '\n');
