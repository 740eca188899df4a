// What a program for Deno does: with the package, and with the module as the daemon serves it.
import { Tweend } from 'tweend';

const [url = '', served = ''] = Deno.args;
const tweend = new Tweend(url);
const sent: number[] = [];
const model = await tweend.upload('{"meshes": [{"name": "a", "shape": {"kind": "box"}}]}', { onProgress: (bytes) => sent.push(bytes) });
const points: Float32Array = await tweend.points(model, { level: 1 });
// @ts-expect-error: no such form
const faulty = () => tweend.surfaceUrl(model, {}, 'fbx');
const module: { Tweend: typeof Tweend } = await import(served);
const { faces } = await new module.Tweend().surfaceCounts(model, { level: 1 });
console.log(JSON.stringify({ sent, bytes: model.bytes, points: points.length, faces, faulty: faulty.length }));
