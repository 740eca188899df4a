// What the pictures in README are drawn with: the faces of an OBJ, and paths of SVG.

/** An OBJ as { points, objects: [{ name, first: index of its first point, faces: [[index of a point]] }] }. */
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

/** A colour of 0 to 255 as SVG writes it. */
export const hex = (colour) => `#${colour.map((x) => Math.round(x).toString(16).padStart(2, '0')).join('')}`;

/** Classes of CSS rules, each made once. */
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

/** Faces { style: a class, corners: integers } as paths in their order. share: whether neighbours of one style share a path. */
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
