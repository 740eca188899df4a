// The state of the page, kept in the URL's fragment, so that a person who is sent the URL sees the same.
import { defaultsOf, isFit, NAMES, OF_MODEL, OF_PERSON, OF_SURFACE, readAddress } from './address.js';
import { storage } from './storage.js';

const DEFAULTS = defaultsOf(NAMES);
for (const name of Object.keys(OF_PERSON)) {
  const kept = storage.getItem(`tweend ${name}`);
  if (kept !== null && isFit(name, kept)) DEFAULTS[name] = kept;
}

/** The names that determine the surface of a model. */
export const SURFACE = Object.keys(OF_SURFACE);

const OTHER_MODEL = defaultsOf({ ...OF_MODEL, ...OF_SURFACE });

const listeners = new Set();
let unfit = []; // what the address said last that means nothing, as "name=value"
let values = read();
if (unfit.length > 0) write();

function read() {
  const said = readAddress(location.hash.slice(1));
  unfit = said.unfit;
  return { ...DEFAULTS, ...said.given };
}

function write() {
  const changed = Object.entries(values).filter(([name, value]) => value !== DEFAULTS[name]);
  const hash = new URLSearchParams(changed).toString();
  if (hash !== location.hash.slice(1)) history.replaceState(null, '', hash ? `#${hash}` : location.pathname + location.search);
}

function tell(next) {
  const changed = new Set(Object.keys(DEFAULTS).filter((name) => next[name] !== values[name]));
  if (changed.size === 0) return;
  values = next;
  for (const listener of listeners) listener(changed);
}

/** The present value of a name. */
export const state = (name) => values[name];

/** The default values of names. */
export const firstOf = (names) => Object.fromEntries(names.map((name) => [name, DEFAULTS[name]]));

/** The next values as texts; keeps those that a person likes. */
function textsOf(next) {
  const texts = Object.fromEntries(Object.entries(next).map(([name, value]) => [name, String(value)]));
  for (const name of Object.keys(texts).filter((each) => each in OF_PERSON)) storage.setItem(`tweend ${name}`, (DEFAULTS[name] = texts[name]));
  return texts;
}

/** Changes values and notifies the listeners. */
export function change(next) {
  tell({ ...values, ...textsOf(next) });
  write();
}

let isStepping = false;

/** Whether the change that listeners are notified of is a step. */
export const isStep = () => isStepping;

/** Like change, for a model that was made of the shown one: the picture stays until the next is there. */
export function step(next) {
  isStepping = true;
  change(next);
  isStepping = false;
}

/** Shows another model with default settings for its parts; adds an entry to the browser's history. The same one is opened
 *  again: it may be that it could not be. */
export function openOther(model) {
  const isSame = model === values.model;
  if (values.model && !isSame) history.pushState(null, '', location.href);
  change({ model, ...OTHER_MODEL });
  if (isSame) for (const listener of listeners) listener(new Set(['model']));
}

/** Writes a value to the URL without notifying listeners: the time while a clip plays. */
export function note(name, value) {
  values = { ...values, ...textsOf({ [name]: value }) };
  write();
}

/** Registers listener(names), called after names have changed. */
export function watch(listener) {
  listeners.add(listener);
}

addEventListener('hashchange', () => {
  tell(read());
  if (unfit.length > 0) write();
});

/** What was left out of the address, when it was last read. */
export const leftOut = () => unfit;

let usual = new Set(['surface', 'cage', 'points', 'floor', 'follow']); // what is shown where the address does not say

/** Says what is fit to be shown of the model. */
export function setUsual(names) {
  usual = new Set(names);
}

/** The names of what is shown. */
const shown = () => (values.show ? new Set(values.show.split(',')) : usual);

export const shows = (name) => shown().has(name);

export function toggle(name) {
  const names = [...shown()];
  change({ show: (shows(name) ? names.filter((n) => n !== name) : [...names, name]).join(',') || 'nothing' });
}

/** The parameters of a surface request that differ from the API's defaults, and the level. */
export function surfaceOptions() {
  const differing = SURFACE.filter((name) => name !== 'level' && values[name] !== DEFAULTS[name]);
  return { level: values.level === 'auto' ? 'auto' : Number(values.level), ...Object.fromEntries(differing.map((name) => [name, values[name]])) };
}
