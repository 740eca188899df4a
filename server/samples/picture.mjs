// Draws picture.svg from a running daemon's answers: node picture.mjs http://127.0.0.1:8080 > picture.svg
//
// Above: the octopus as it was uploaded, and its surface. Below: the tank's surface in two poses.
// Faces that look away are left out, the rest are painted from far to near.

import { readFileSync } from 'node:fs';

import { hex, minus, pathsOf, readObj, Styles } from './picture_paths.mjs';

const daemon = process.argv[2];

async function ask(path, sample) {
  const body = readFileSync(new URL(sample, import.meta.url));
  const answer = await fetch(daemon + path, { method: 'POST', body });
  if (!answer.ok) throw new Error(`${path}: ${await answer.text()}`);
  return answer.text();
}

/** The faces of an OBJ, each with its points and its object's name. */
function facesOf(text) {
  const { points, objects } = readObj(text);
  return objects.flatMap(({ name, faces }) => faces.map((face) => ({ name, points: face.map((i) => points[i]) })));
}

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const unit = (a) => a.map((x) => x / (Math.hypot(...a) || 1));

/** Seen from the right and above. */
function seen([x, y, z], { yaw, pitch }) {
  const [c, s, d, t] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  const depth = s * x + c * z;
  return [c * x - s * z, d * y - t * depth, t * y + d * depth];
}

const SHADES = 32;
const LIGHT = unit([-0.45, 0.75, 0.6]);

const styles = new Styles();

/** Faces { points, colour, inside?, behind? } as paths of an SVG, in a box [left, top, width, height]. */
function draw(faces, view, [left, top, width, height], edges) {
  const turned = faces.map(({ points, ...rest }) => ({ points: points.map((p) => seen(p, view)), ...rest }));
  const all = turned.flatMap((face) => face.points);
  const bound = (i, pick) => all.reduce((m, p) => pick(m, p[i]), all[0][i]);
  const low = [0, 1].map((i) => bound(i, Math.min));
  const high = [0, 1].map((i) => bound(i, Math.max));
  const scale = Math.min(width / (high[0] - low[0]), height / (high[1] - low[1]));
  const at = ([x, y]) => [
    Math.round(left + width / 2 + (x - (low[0] + high[0]) / 2) * scale),
    Math.round(top + height / 2 - (y - (low[1] + high[1]) / 2) * scale),
  ];
  const painted = [];
  for (const { points, colour, inside, behind = 0 } of turned) {
    let normal = unit(cross(minus(points[2], points[0]), minus(points.at(-1), points[1])));
    const away = normal[2] <= 0;
    if (away && !inside) continue;
    if (away) normal = normal.map((x) => -x);
    const light = 0.38 + 0.62 * Math.max(0, dot(normal, LIGHT));
    const shade = Math.round(light * SHADES) / SHADES;
    const fill = hex((away ? inside : colour).map((x) => x * shade));
    const style = styles.of(`fill:${fill};stroke:${edges ?? fill}`);
    painted.push({ depth: points.reduce((s, p) => s + p[2], 0) / points.length - behind, style, corners: points.map(at) });
  }
  painted.sort((a, b) => a.depth - b.depth);
  return pathsOf(painted, !edges);
}

const octopus = { colour: [216, 106, 88], inside: [120, 48, 52] };
const tank = {
  hull: [124, 158, 102], wheel: [92, 96, 104], turret: [138, 172, 112], barrel: [110, 130, 104], antenna: [214, 92, 70],
};

const octopusFaces = async (level) =>
  facesOf(await ask(`/v1/surface.obj?level=${level}`, 'octopus.obj')).map((face) => ({ ...face, ...octopus }));
const tankFaces = async (time) =>
  facesOf(await ask(`/v1/surface.obj?level=1&clip=drive&at=${time}`, 'tank.json'))
    .map((face) => ({ ...face, colour: tank[face.name], behind: face.name === 'hull' ? 0.1 : 0 })); // its faces are large

const front = { yaw: 0.6, pitch: 0.35 };
const side = { yaw: 0.85, pitch: 0.42 };
const drawing = [
  draw(await octopusFaces(0), front, [20, 20, 760, 560], '#5a2a2a'),
  draw(await octopusFaces(2), front, [820, 20, 760, 560]),
  draw(await tankFaces(0), side, [80, 620, 640, 510]),
  draw(await tankFaces(1.3), side, [880, 620, 640, 510]),
].join('\n');
console.log(`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1600 1150" stroke-linejoin="round">
<title>An octopus as it was uploaded and its subdivision surface; a tank in two poses of its clip</title>
<style>${styles}</style>
${drawing}
</svg>`);
