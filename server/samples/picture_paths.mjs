// Draws README's pictures: reads the faces of an OBJ and makes SVG paths.

/** Parses an OBJ into { points, objects: [{ name, first: index of its first point, faces: [[index of a point]] }] }. */
export function readObj(text) {
  const points = [];
  const objects = [];
  for (const line of text.split('\n')) {
    const [word, ...rest] = line.trim().split(/\s+/);
    if (word === 'o') objects.push({ name: rest.join(' '), first: points.length, faces: [] });
    else if (word === 'v') points.push(rest.slice(0, 3).map(Number));
    else if (word === 'f') objects.at(-1).faces.push(rest.map((corner) => parseInt(corner, 10) - 1));
  }
  return { points, objects };
}

export const minus = (a, b) => a.map((x, i) => x - b[i]);

/** A colour with components from 0 to 255 in SVG's notation. */
export const hex = (colour) => `#${colour.map((x) => Math.round(x).toString(16).padStart(2, '0')).join('')}`;

/** CSS classes, one for each distinct rule. */
export class Styles {
  classes = new Map();

  of(rule) {
    if (!this.classes.has(rule)) this.classes.set(rule, `c${this.classes.size.toString(36)}`);
    return this.classes.get(rule);
  }

  toString() {
    return [...this.classes].map(([rule, name]) => `.${name}{${rule}}`).join('');
  }
}

/** Prints faces { style: a class, corners: integers } as paths, in order. share: neighbours of one style share a
 *  path. */
export function pathsOf(faces, share) {
  const paths = [];
  let last;
  for (const { style, corners } of faces) {
    const steps = corners.slice(1).map((p, i) => minus(p, corners[i]).join(' ')).join(' ').replace(/ -/g, '-');
    const outline = `M${corners[0].join(' ')}l${steps}z`;
    if (style === last && share) paths[paths.length - 1] += outline;
    else paths.push(`<path class="${style}" d="${outline}`);
    last = style;
  }
  return paths.map((path) => `${path}"/>`).join('\n');
}

/** The faces of an OBJ, each with its points and its object's name. */
export function facesOf(text) {
  const { points, objects } = readObj(text);
  return objects.flatMap(({ name, faces }) => faces.map((face) => ({ name, points: face.map((i) => points[i]) })));
}

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const unit = (a) => a.map((x) => x / (Math.hypot(...a) || 1));

/** Rotates a point into a view from the right (yaw) and from above (pitch). */
function seen([x, y, z], { yaw, pitch }) {
  const [c, s, d, t] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  const depth = s * x + c * z;
  return [c * x - s * z, d * y - t * depth, t * y + d * depth];
}

const SHADES = 32;
const LIGHT = unit([-0.45, 0.75, 0.6]);

/** Draws faces { points, colour, inside?, behind? } as SVG paths into a box [left, top, width, height]. Faces that look
 *  away and have no colour inside are left out; the others are painted from far to near. */
export function draw(styles, faces, view, [left, top, width, height], edges) {
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
