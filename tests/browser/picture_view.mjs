// The page's viewport as paths of SVG: shapes are the daemon's, colours are those that the page drew.
import { PerspectiveCamera, Vector3 } from 'three';

import { structure } from '../../server/page/polygons.js';
import { hex, minus, pathsOf, readObj, Styles } from '../../server/samples/picture_paths.mjs';

export const DENSITY = 2; // pixels of the screenshot and of the depth buffer to one of the page
const UNIT = 10; // coordinates are tenths of a pixel
const SHADES = 4; // green is rounded to multiples, and the others with it: hues stay
const LEAST = 4; // pixels, of which a face is drawn
const CUT = 6; // pixels on both sides, from which on faces count as going through each other
const SPLITS = 3; // rounds
const NEARER = { line: 0.004, dot: 0.025 }; // of the depth: by how much each may lie behind what it still covers, as in cage.js

/** Pixels that polygons cover: inside(pixel, 1 / depth) for each; a polygon's corners are [x, y, 1 / depth]. */
function rasterize([width, height], corners, inside) {
  for (let k = 1; k + 1 < corners.length; k++) {
    const [a, b, c] = [corners[0], corners[k], corners[k + 1]];
    const area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if (area === 0) continue;
    const range = (i, end) => [Math.max(0, Math.ceil(Math.min(a[i], b[i], c[i]))), Math.min(end - 1, Math.floor(Math.max(a[i], b[i], c[i])))];
    const [[left, right], [top, bottom]] = [range(0, width), range(1, height)];
    for (let y = top; y <= bottom; y++)
      for (let x = left; x <= right; x++) {
        const v = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area;
        const w = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area;
        if (v >= 0 && w >= 0 && v + w <= 1) inside(y * width + x, a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2]));
      }
  }
}

/** Which face each pixel shows (-1: none), and 1 / depth there. */
function depthBuffer(size, faces) {
  const top = new Int32Array(size[0] * size[1]).fill(-1);
  const near = new Float64Array(top.length);
  faces.forEach((corners, face) => rasterize(size, corners, (pixel, depth) => {
    if (depth > near[pixel]) [near[pixel], top[pixel]] = [depth, face];
  }));
  return { top, near };
}

/** For each pair of faces, as the number nearer * faces.length + other, the pixels where the nearer one hides the other. */
function overlapsOf(size, faces, top) {
  const seen = new Set(top);
  const overlaps = new Map();
  faces.forEach((corners, face) => seen.has(face) && rasterize(size, corners, (pixel) => {
    if (top[pixel] === face || top[pixel] < 0) return;
    const key = top[pixel] * faces.length + face;
    overlaps.set(key, (overlaps.get(key) ?? 0) + 1);
  }));
  return [...overlaps].map(([key, pixels]) => {
    const [front, back] = [Math.floor(key / faces.length), key % faces.length];
    return { front, back, pixels, otherwise: overlaps.get(back * faces.length + front) ?? 0 };
  });
}

/** Faces that go through each other are split, and what goes through each other of their parts again. */
function splitAtCuts(size, faces) {
  for (let round = 0; round < SPLITS; round++) {
    const cut = new Set();
    for (const { front, pixels, otherwise } of overlapsOf(size, faces, depthBuffer(size, faces).top))
      if (Math.min(pixels, otherwise) > CUT) cut.add(front);
    faces = faces.flatMap((corners, face) => (cut.has(face) ? quarters(corners) : [corners]));
  }
  return faces;
}

/** Four quads for a quad: 1 / depth is linear on the picture, so means of corners lie on the face. */
function quarters(corners) {
  const mean = (...points) => points[0].map((_, i) => points.reduce((sum, point) => sum + point[i], 0) / points.length);
  const middles = corners.map((corner, i) => mean(corner, corners[(i + 1) % corners.length]));
  return corners.map((corner, i) => [corner, middles[i], mean(...corners), middles.at(i - 1)]);
}

/** The faces that are seen, in an order of painting that leaves as many pixels as it can to the face that is nearest there. */
function paintingOrder(size, faces, top) {
  const seen = new Map();
  for (const face of top) seen.set(face, (seen.get(face) ?? 0) + 1);
  const under = new Map([...seen].filter(([face, pixels]) => face >= 0 && pixels >= LEAST).map(([face]) => [face, []])); // those to be painted before it
  for (const { front, back, pixels, otherwise } of overlapsOf(size, faces, top))
    if (pixels > otherwise && under.has(back)) under.get(front)?.push(back);
  const depth = (face) => faces[face].reduce((sum, corner) => sum + corner[2], 0) / faces[face].length;
  const entered = new Set();
  const order = [];
  const paint = (face) => {
    if (entered.has(face)) return; // painted, or a circle of faces
    entered.add(face);
    under.get(face).forEach(paint);
    order.push(face);
  };
  [...under.keys()].sort((a, b) => depth(a) - depth(b)).forEach(paint);
  return order;
}

/** The mean of the colours that a picture has where each face is seen. */
function coloursOf(top, pixels) {
  const sums = new Map();
  top.forEach((face, pixel) => {
    const sum = sums.get(face) ?? sums.set(face, [0, 0, 0, 0]).get(face);
    for (let k = 0; k < 3; k++) sum[k] += pixels[4 * pixel + k];
    sum[3]++;
  });
  return new Map([...sums].map(([face, [r, g, b, count]]) => {
    const green = Math.min(252, Math.round(g / count / SHADES) * SHADES);
    const beside = (sum) => Math.min(255, green + Math.round((sum - g) / count));
    return [face, hex([beside(r), green, beside(b)])];
  }));
}

/**
 * surface, cage: OBJs. view: the camera's place and what it looks at, six numbers. size: pixels of the page.
 * pixels: the surface alone as the page draws it. creases: [{ object, edge, colour }]. dots, edge: colours.
 */
export function drawView({ surface, cage, view, size, pixels, creases, few, many, edge }) {
  const camera = new PerspectiveCamera(35, size[0] / size[1]); // as in viewport.js
  camera.position.set(...view.slice(0, 3));
  camera.lookAt(new Vector3(...view.slice(3)));
  camera.updateMatrixWorld();
  const buffer = size.map((length) => length * DENSITY);
  const project = (point) => {
    const at = new Vector3(...point).applyMatrix4(camera.matrixWorldInverse);
    const depth = -at.z;
    at.applyMatrix4(camera.projectionMatrix);
    return [((at.x + 1) / 2) * buffer[0] - 0.5, ((1 - at.y) / 2) * buffer[1] - 0.5, 1 / depth];
  };
  const rounded = ([x, y]) => [x, y].map((value) => Math.round(((value + 0.5) / DENSITY) * UNIT));

  const { points, objects } = readObj(surface);
  const projected = points.map(project);
  const faces = splitAtCuts(buffer, objects.flatMap((object) => object.faces.map((face) => face.map((i) => projected[i]))));
  const { top, near } = depthBuffer(buffer, faces);
  const colours = coloursOf(top, pixels);
  const styles = new Styles();
  const painted = paintingOrder(buffer, faces, top).map((face) => {
    const colour = colours.get(face);
    return { style: styles.of(`fill:${colour};stroke:${colour}`), corners: faces[face].map(rounded) };
  });

  const isSeen = ([x, y, depth], nearer) => {
    const [column, row] = [Math.round(x), Math.round(y)];
    if (column < 0 || row < 0 || column >= buffer[0] || row >= buffer[1]) return false;
    return depth * (1 + nearer) >= near[row * buffer[0] + column];
  };
  const segment = (a, b) => `M${rounded(a).join(' ')}l${minus(rounded(b), rounded(a)).join(' ')}`.replace(/ -/g, '-');
  /** The parts of a line that are seen, as a path. */
  const seenParts = ([a, b]) => {
    const steps = Math.max(1, Math.ceil(Math.hypot(b[0] - a[0], b[1] - a[1])));
    const at = (step) => a.map((value, i) => value + ((b[i] - value) * step) / steps);
    let path = '';
    let from = -1;
    for (let step = 0; step <= steps + 1; step++) {
      const seen = step <= steps && isSeen(at(step), NEARER.line);
      if (seen && from < 0) from = step;
      if (seen || from < 0) continue;
      if (step - 1 > from) path += segment(at(from), at(step - 1));
      from = -1;
    }
    return path;
  };

  const control = readObj(cage);
  const places = control.points.map(project);
  const lines = [];
  const sharp = new Map(); // colour: path
  const dots = [];
  for (const { name, first, faces: polygons } of control.objects) {
    const { edges, extraordinary } = structure(polygons);
    for (let i = 0; i < edges.length; i += 2) lines.push([places[edges[i]], places[edges[i + 1]]]);
    for (const { object, edge: ends, colour } of creases)
      if (object === name) sharp.set(colour, (sharp.get(colour) ?? '') + seenParts(ends.map((i) => places[first + i])));
    for (const [point, valence] of extraordinary)
      if (isSeen(places[point], NEARER.dot)) dots.push([places[point], valence < 4 ? few : many]);
  }
  dots.sort(([a], [b]) => a[2] - b[2]);
  return `<g transform="scale(${1 / UNIT})" fill="none" stroke-width="10" stroke-linejoin="round" stroke-linecap="round">
<style>${styles}</style>
${pathsOf(painted, true)}
${[...sharp].map(([colour, path]) => `<path stroke="${colour}" stroke-width="30" d="${path}"/>`).join('\n')}
<g stroke="${edge}"><path opacity=".9" d="${lines.map(seenParts).join('')}"/><path opacity=".08" d="${lines.map((ends) => segment(...ends)).join('')}"/></g>
${dots.map(([at, colour]) => `<circle cx="${rounded(at)[0]}" cy="${rounded(at)[1]}" r="40" fill="${colour}"/>`).join('')}
</g>`;
}
