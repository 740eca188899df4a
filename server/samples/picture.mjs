// Draws picture.svg from a running daemon's answers: node picture.mjs http://127.0.0.1:8080 > picture.svg
//
// Above: the octopus as it was uploaded, and its surface. Below: the tank's surface in two poses.

import { readFileSync } from 'node:fs';

import { draw, facesOf, Styles } from './picture_paths.mjs';

const daemon = process.argv[2];

async function ask(path, sample) {
  const body = readFileSync(new URL(sample, import.meta.url));
  const answer = await fetch(daemon + path, { method: 'POST', body });
  if (!answer.ok) throw new Error(`${path}: ${await answer.text()}`);
  return answer.text();
}

const styles = new Styles();

const octopus = { colour: [216, 106, 88], inside: [120, 48, 52] };
const tank = {
  hull: [124, 158, 102], wheel: [92, 96, 104], turret: [138, 172, 112], barrel: [110, 130, 104], antenna: [214, 92, 70],
};

const octopusFaces = async (level) =>
  facesOf(await ask(`/v1/surface.obj?level=${level}`, 'octopus.obj')).map((face) => ({ ...face, ...octopus }));
const tankFaces = async (time) =>
  facesOf(await ask(`/v1/surface.obj?level=1&clip=drive&at=${time}`, 'tank.json'))
    .map((face) => ({ ...face, colour: tank[face.name.split('_')[0]], behind: face.name === 'hull' ? 0.1 : 0 })); // sorted farther back, since its faces are large

const front = { yaw: 0.6, pitch: 0.35 };
const side = { yaw: 0.85, pitch: 0.42 };
const drawing = [
  draw(styles, await octopusFaces(0), front, [20, 20, 760, 560], '#5a2a2a'),
  draw(styles, await octopusFaces(2), front, [820, 20, 760, 560]),
  draw(styles, await tankFaces(0), side, [80, 620, 640, 510]),
  draw(styles, await tankFaces(1.3), side, [880, 620, 640, 510]),
].join('\n');
console.log(`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1600 1150" stroke-linejoin="round">
<title>An octopus as it was uploaded and its subdivision surface; a tank in two poses of its clip</title>
<style>${styles}</style>
${drawing}
</svg>`);
