// The panel for the parameters of the surface, and for the counts, size and time of each level.
import { tweend, withKey } from './client.js';
import { bytes, choice, count, make } from './dom.js';
import { change, state, SURFACE, surfaceOptions, watch } from './state.js';

const LEVELS = 10;
const COUNTED = ['surface', 'sculpt', 'scripts']; // tabs that tell of other levels than the shown one
const CHOICES = [
  ['scheme', 'Scheme', [['catmull-clark', 'Catmull-Clark'], ['loop', 'Loop (triangles)'], ['bilinear', 'Bilinear']]],
  ['boundary', 'Boundary', [['edge-and-corner', 'Edge and corner'], ['edge-only', 'Edge only'], ['none', 'None'], ['open', 'Open']]],
  ['uv', 'UV rule', [['corners-only', 'Corners only'], ['none', 'None'], ['corners-plus1', 'Corners plus 1'],
    ['corners-plus2', 'Corners plus 2'], ['boundaries', 'Boundaries'], ['all', 'All']]],
  ['creases', 'Creases', [['file', 'As the file shows'], ['tags', 'As tagged'], ['normals', 'From normals'], ['auto', 'Auto'], ['none', 'None']]],
  ['quads', 'Triangles', [['auto', 'Join quads'], ['ngon', 'As in the file']]],
  ['encoding', 'Encoding', [['float', 'Float'], ['quantized', 'Quantized'], ['meshopt', 'Meshopt']]],
];

export class SurfacePanel {
  constructor(panel) {
    this.sliders = [];
    this.fields = make('div', { className: 'fields' });
    this.limit = make('input', { type: 'checkbox', onchange: () => change({ limit: this.limit.checked }) });
    this.body = make('tbody');
    panel.append(
      make('h2', {}, 'Subdivision'),
      this.levelSlider(),
      this.fields,
      make('label', { className: 'check' }, this.limit, make('span', {}, 'Points on the limit surface')),
      make('table', {},
        make('caption', {}, 'What each level has'),
        make('thead', {}, make('tr', {}, ...['Level', 'Points', 'Faces', 'Size', 'Server'].map((text) => make('th', { scope: 'col' }, text)))),
        this.body));
    this.measured = new Map();
    watch((names) => {
      if (names.has('model')) this.clear();
      const asked = SURFACE.some((name) => name !== 'level' && names.has(name));
      if (asked || names.has('level')) this.render();
      if (asked || (names.has('tab') && this.isDue)) this.count();
    });
    this.render();
  }

  /** Creates a slider for the level; all sliders show the same value. */
  levelSlider() {
    const output = make('output', { className: 'value' });
    const slider = make('input', { type: 'range', min: 0, max: LEVELS, step: 1, 'aria-label': 'Level',
      oninput: () => (output.textContent = slider.value), onchange: () => change({ level: slider.value }) });
    this.sliders.push({ slider, output });
    this.#showLevel();
    return make('div', { className: 'slider' }, make('span', {}, 'Level'), slider, output);
  }

  #showLevel() {
    for (const { slider, output } of this.sliders) {
      output.textContent = state('level');
      slider.value = state('level') === 'auto' ? 0 : state('level');
    }
  }

  render() {
    this.#showLevel();
    this.limit.checked = state('limit') === 'true';
    const focused = document.activeElement?.closest?.('.fields label')?.firstChild?.textContent;
    this.fields.replaceChildren(...CHOICES.map(([name, label, options]) => choice(label, options, state(name), (value) => change({ [name]: value }))));
    for (const label of this.fields.children) if (focused && label.firstChild.textContent === focused) label.lastChild.focus();
    for (const row of this.body.rows) row.toggleAttribute('aria-current', row.dataset.level === state('level'));
  }

  #key(level) {
    return JSON.stringify([state('model'), { ...surfaceOptions(), level: Number(level) }]);
  }

  /** Records the size and time of a level that was loaded. */
  tell({ size, ms }) {
    this.measured.set(this.#key(state('level')), { size, ms });
    this.fill();
  }

  clear() {
    this.controller?.abort();
    this.levels = [];
    this.refusal = '';
    this.fill();
  }

  /** Requests the counts of all levels that the daemon would make, when they are seen. */
  async count() {
    this.clear();
    this.isDue = !COUNTED.includes(state('tab'));
    if (!state('model') || this.isDue) return;
    const { signal } = (this.controller = new AbortController());
    try {
      this.levels = await withKey(() => tweend.levels(state('model'), { ...surfaceOptions(), level: undefined }, { signal }));
    } catch (error) {
      if (signal.aborted) return;
      this.refusal = error.detail ?? error.message;
    }
    const deepest = Math.max(...this.levels.filter(({ refused }) => !refused).map(({ level }) => level), 0);
    if (this.levels.length > 0) for (const { slider } of this.sliders) slider.max = deepest;
    this.render();
    this.fill();
  }

  /** The size that the daemon predicts for a level; null when unknown. */
  predicted(level) {
    return this.levels?.find((entry) => entry.level === Number(level))?.bytes ?? null;
  }

  fill() {
    const rows = (this.levels ?? []).map(({ level, vertices, faces, bytes: size, refused }) => {
      const seen = this.measured.get(this.#key(level));
      const open = make('button', { type: 'button', disabled: Boolean(refused), 'aria-label': `Show level ${level}`, onclick: () => change({ level }) }, String(level));
      const row = make('tr', { title: refused ?? '', className: refused ? 'refused' : '' },
        make('td', {}, open), make('td', {}, count(vertices)), make('td', {}, count(faces)),
        make('td', {}, refused ? 'over limit' : bytes(size ?? seen?.size)), make('td', {}, seen ? `${seen.ms.toFixed(1)} ms` : '–'));
      row.dataset.level = level;
      row.toggleAttribute('aria-current', String(level) === state('level'));
      return row;
    });
    if (this.refusal) rows.push(make('tr', { className: 'refused' }, make('td', { colSpan: 5 }, `Refused: ${this.refusal}`)));
    this.body.replaceChildren(...rows);
  }
}
