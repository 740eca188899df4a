// The shapes and edits that the panel offers, with their parameters as in openapi.json. The initial values also give
// the parameters' types.

export const SHAPES = {
  box: { size: [1, 1, 1], segments: [1, 1, 1] },
  grid: { size: [2, 2], segments: [4, 4] },
  quad_sphere: { radius: 1, segments: 2 },
  uv_sphere: { radius: 1, segments: 16, rings: 8 },
  icosphere: { radius: 1, level: 1 },
  ellipsoid: { radii: [1, 0.6, 0.8], segments: 2 },
  cylinder: { radius: 0.5, height: 1, segments: 8, rings: 1, caps: 'ngon' },
  cone: { radius: 0.5, height: 1, segments: 8, rings: 1, caps: 'ngon' },
  torus: { radius: 1, tube: 0.4, segments: 12, sides: 6 },
};

/** What people call shapes, edits and their parameters, where the API's names do not say it. */
const WORDS = {
  quad_sphere: 'Sphere', uv_sphere: 'Globe', corner: 'Sharp corner', merge: 'Merge points', flip: 'Flip faces', hole: 'Make a hole',
  weld: 'Weld points', despike: 'Remove spikes', drop_pieces: 'Drop small pieces', fill: 'Fill holes', orient: 'Turn faces outward', quads: 'Make quads',
  max_edges: 'edges at most', caps: 'ends',
};

/** A name of the API in a person's words. */
export const wordsOf = (name) => WORDS[name] ?? (name[0].toUpperCase() + name.slice(1)).replaceAll('_', ' ');
export const parameterWords = (name) => (WORDS[name] ?? name).replaceAll('_', ' ');

const ANY = ['faces', 'edges', 'vertices'];

/** of: the kinds of selection that an edit takes; empty: it applies to the whole mesh. stays: the selected elements
 *  still exist afterwards. */
export const EDITS = [
  { edit: 'extrude', of: ['faces'], parameters: { distance: 0.25 }, stays: true },
  { edit: 'inset', of: ['faces'], parameters: { amount: 0.1 }, stays: true },
  { edit: 'loop_cut', of: ['edges'], parameters: { cuts: 1 } },
  { edit: 'subdivide', of: ['faces', 'edges'], parameters: { cuts: 1 } },
  { edit: 'crease', of: ['edges'], parameters: { sharpness: 2 }, stays: true },
  { edit: 'corner', of: ['vertices'], parameters: { sharpness: 10 }, stays: true },
  { edit: 'move', of: ANY, parameters: { by: [0, 0.25, 0] }, stays: true },
  { edit: 'rotate', of: ANY, parameters: { axis: 'y', degrees: 15 }, stays: true },
  { edit: 'scale', of: ANY, parameters: { by: [0.8, 0.8, 0.8] }, stays: true },
  { edit: 'merge', of: ['vertices'], parameters: {} },
  { edit: 'flip', of: ['faces'], parameters: {}, stays: true },
  { edit: 'hole', of: ['faces'], parameters: {}, stays: true },
  { edit: 'delete', of: ANY, parameters: {} },
  { edit: 'mirror', of: [], parameters: { axis: 'x' } },
  { edit: 'weld', of: [], parameters: { distance: 0.001 } },
  { edit: 'smooth', of: [], parameters: { iterations: 10 } },
  { edit: 'despike', of: [], parameters: { factor: 2 } },
  { edit: 'drop_pieces', of: [], parameters: { faces: 100 } },
  { edit: 'fill', of: [], parameters: {} },
  { edit: 'orient', of: [], parameters: {} },
  { edit: 'triangulate', of: [], parameters: {} },
  { edit: 'quads', of: [], parameters: {} },
];

/** The steps that clean a scan, in order, with parameters for a mesh of that many faces and that size. An edit that
 *  finds nothing to do is no error. */
export const CLEANING = [
  { edit: 'weld', parameters: ({ size }) => ({ distance: Number((size * 1e-5).toPrecision(1)) }) },
  { edit: 'drop_pieces', parameters: ({ faces }) => ({ faces: Math.ceil(faces / 100) }) },
  { edit: 'despike', parameters: () => ({ factor: 2 }), also: { name: 'spikes' } },
  // A border of more edges is the outline of the scan rather than a hole in it.
  { edit: 'fill', parameters: ({ faces }) => ({ max_edges: Math.max(8, Math.round(2 * Math.sqrt(faces))) }), also: { method: 'fair', optional: true, name: 'patches' } },
  { edit: 'orient', parameters: () => ({}) },
  { edit: 'smooth', parameters: () => ({ iterations: 10 }) },
];

const SCAN_LEAST = 1000; // faces
/** Whether a mesh looks like a scan: many faces, no tags, and damage that scans have or nothing but triangles. */
export function isScan({ format, meshes }, mesh) {
  const { faces, face_sizes: sizes, creases, components, boundary_loops: borders, reversed_edges: reversed, skinned } = meshes[mesh];
  const isDamaged = components > 1 || borders > 1 || reversed > 0;
  return format !== 'tweend' && !skinned && creases === 0 && faces >= SCAN_LEAST && (isDamaged || sizes[3] === faces);
}

export const CHOICES = { caps: ['ngon', 'fan', 'none'], axis: ['x', 'y', 'z'] };

/** The edit of a form's values. A loop cut takes one edge. */
export function editOf({ edit, of }, parameters, kind, selection) {
  if (of.length === 0) return { edit, ...parameters };
  if (edit === 'loop_cut') return { edit, edge: selection[0], ...parameters };
  return { edit, [kind]: selection, ...parameters };
}

/** A list of edits as text, one a line. */
export const printEdits = (edits) => (edits.length === 0 ? '[]' : `[\n${edits.map((edit) => `  ${JSON.stringify(edit)}`).join(',\n')}\n]`);
