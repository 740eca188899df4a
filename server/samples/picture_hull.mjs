// Draws hull.svg from a running daemon's answers: node picture_hull.mjs http://127.0.0.1:8080 > hull.svg
//
// The cages that the script of api/GUIDE.md makes, and the surface of the last one.

import { readFileSync } from 'node:fs';

import { draw, facesOf, Styles } from './picture_paths.mjs';

const daemon = process.argv[2];
const guide = readFileSync(new URL('../../api/GUIDE.md', import.meta.url), 'utf8');
const [section] = guide.match(/^## A model from a script\n.*?(?=^## )/ms);
const [box, ...steps] = [...section.matchAll(/'({.*?})'/gs)].map(([, json]) => json);

/** Creates a model by a request; resolves with its URL. */
async function make(url, body) {
  const answer = await fetch(url, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body });
  if (!answer.ok) throw new Error(`${body}: ${await answer.text()}`);
  return `${daemon}/v1/models/${(await answer.json()).id}`;
}

const facesAt = async (model, level) =>
  facesOf(await (await fetch(`${model}/surface.obj?level=${level}&normals=none`)).text())
    .map((face) => ({ ...face, colour: [124, 158, 102], inside: [74, 88, 66] }));

const styles = new Styles();
const view = { yaw: -0.75, pitch: 0.42 };
const cells = [0, 1].flatMap((row) => [0, 1, 2].map((column) => [20 + 540 * column, 20 + 360 * row, 480, 320]));
const drawing = [];
let model = await make(`${daemon}/v1/models`, box);
for (const step of steps) {
  model = await make(`${model}/edits`, `{"edits": [${step}]}`);
  drawing.push(draw(styles, await facesAt(model, 0), view, cells[drawing.length], '#2f3b2a'));
}
drawing.push(draw(styles, await facesAt(model, 2), view, cells[drawing.length]));
console.log(`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1600 720" stroke-linejoin="round">
<title>The steps from a box to the hull of a tank, and its surface</title>
<style>${styles}</style>
${drawing.join('\n')}
</svg>`);
