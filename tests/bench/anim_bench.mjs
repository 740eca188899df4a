// The scenes of anim_bench.c sampled by three.js: nanoseconds a joint and time. Packages: npm ci in tests/node.
import { readFileSync } from 'node:fs';
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

function print(name, runs) {
  const [least, median, most] = [runs[0], runs[RUNS >> 1], runs[RUNS - 1]].map((ns) => ns.toFixed(1));
  console.log(`  ${name.padEnd(28)} ${median.padStart(7)} ns (${least} to ${most})`);
}

const machine = /model name\s*: (.*)/.exec(readFileSync('/proc/cpuinfo', 'utf8'))?.[1] ?? 'unknown machine';
console.log(`three.js ${REVISION}, node ${process.version}, ${machine}; median of ${RUNS} runs (least to most)`);
for (const joints of [24, 100, 1000])
  for (const keys of [10, 1000]) {
    const samplers = Array.from({ length: joints }, () => makeTrack(keys).createInterpolant());
    const ordered = Array.from({ length: 512 }, (_, i) => (10 * i) / 512);
    console.log(`${joints} joints, ${keys} keys each`);
    print('pose by pose, in order', measure(samplers, ordered, false));
    print('pose by pose, at random', measure(samplers, ordered.map(() => 10 * Math.random()), false));
    print('10,000 times, by track', measure(samplers, Array.from({ length: 10000 }, (_, i) => i / 1000), true));
  }
