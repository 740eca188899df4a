// What the page's address may say: the names, the value of each where the address is silent, and which values are fit.

const any = () => true;
const oneOf = (...values) => (text) => values.includes(text);
const like = (pattern) => (text) => pattern.test(text);
const isFlag = oneOf('false', 'true');
const isNumber = (text) => text.trim() !== '' && Number.isFinite(Number(text));
const between = (least, most) => (text) => isNumber(text) && Number(text) >= least && Number(text) <= most;

/** The place of a camera and the one that it looks at, which must differ. */
function isView(text) {
  const numbers = text.split(',');
  return numbers.length === 6 && numbers.every(isNumber) && [0, 1, 2].some((i) => Number(numbers[i]) !== Number(numbers[i + 3]));
}

function isList(text) {
  try {
    return Array.isArray(JSON.parse(text));
  } catch {
    return false;
  }
}

/** Stops of exposure, either way. */
export const STOPS = 2;

/** What determines the surface of a model: the parameters of its request. name: [default, isFit(text)]. */
export const OF_SURFACE = {
  level: ['auto', like(/^\d{1,9}$/)], // until a model is opened, which chooses one
  scheme: ['catmull-clark', oneOf('loop', 'bilinear')],
  boundary: ['edge-and-corner', oneOf('edge-only', 'none', 'open')],
  uv: ['corners-only', oneOf('none', 'corners-plus1', 'corners-plus2', 'boundaries', 'all')],
  creases: ['file', like(/^(tags|normals|auto|none|angle:[0-9.eE+-]+)$/)],
  quads: ['auto', oneOf('ngon', 'off')],
  limit: ['false', isFlag],
  details: ['true', isFlag],
  encoding: ['float', oneOf('quantized', 'meshopt')],
};

/** What else concerns the shown model only. */
export const OF_MODEL = {
  clip: ['', any],
  borrowed: ['', like(/^[0-9a-f]{32}(,[0-9a-f]{32})*$/)], // ids of models whose clips are offered too
  blend: ['', any], // the clip that is blended in
  weight: ['0.5', between(0, 1)], // of that
  t: ['0', isNumber],
  node: ['', any],
  view: ['', isView],
  mesh: ['0', like(/^\d+$/)],
  from: ['', like(/^[0-9a-f]{32}$/)],
  edits: ['', isList],
  beside: ['', like(/^[0-9a-f]{32}$/)],
};

/** What a person likes, whatever is shown: kept in the browser, and in the address only where that says otherwise. */
export const OF_PERSON = {
  theme: ['', oneOf('light', 'dark')],
  panel: ['', like(/^\d+$/)], // its width; 0: hidden
  language: ['curl', oneOf('JavaScript', 'Python')], // of scripts
};

export const NAMES = {
  tab: ['models', oneOf('surface', 'edit', 'sculpt', 'animation', 'scripts')],
  model: ['', any],
  ...OF_SURFACE,
  show: ['', any], // what the page finds fit
  ...OF_MODEL,
  speed: ['1', (text) => between(-1000, 1000)(text) && Number(text) !== 0],
  loop: ['repeat', oneOf('pingpong', 'clamp')],
  order: ['XYZ', oneOf('XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX')],
  ghosts: ['off', oneOf('both', 'slerp', 'euler')],
  light: ['studio', oneOf('sun', 'overcast', 'evening', 'rim')],
  exposure: ['0', between(-STOPS, STOPS)],
  turntable: ['false', isFlag],
  split: ['50', between(0, 100)],
  ...OF_PERSON,
};

/** The default values of a table. */
export const defaultsOf = (table) => Object.fromEntries(Object.entries(table).map(([name, [value]]) => [name, value]));

/** Whether a name may have a value. */
export const isFit = (name, text) => text === NAMES[name][0] || NAMES[name][1](text);

/** Reads an address's fragment, without its "#": {given: the values that are fit by name, unfit: the others, as "name=value"}. */
export function readAddress(fragment) {
  const said = [...new URLSearchParams(fragment)].filter(([name]) => Object.hasOwn(NAMES, name));
  const [fit, unfit] = [true, false].map((wanted) => said.filter(([name, text]) => isFit(name, text) === wanted));
  return { given: Object.fromEntries(fit), unfit: unfit.map(([name, text]) => `${name}=${text}`) };
}
