// The panel for the parameters of the surface, and for the counts, size and time of each level.
import { html, nothing, render } from 'lit-html';

import { tweend, withKey } from './client.js';
import { bytes, count, make, slider } from './dom.js';
import { change, state, SURFACE, surfaceOptions, watch } from './state.js';
import { choice, flag } from './templates.js';

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
    this.measured = new Map();
    this.content = make('div');
    this.slider = this.levelSlider();
    panel.append(make('h2', {}, 'Subdivision'), this.slider, this.content);
    watch((names) => {
      const asked = SURFACE.some((name) => name !== 'level' && names.has(name));
      if (asked || names.has('level')) this.show();
      if (asked || (names.has('tab') && this.isDue)) this.count();
    });
    this.open(null);
  }

  /** Shows what is asked of a model; null: there is none, or it has gone. */
  open(model) {
    this.model = model;
    this.#clear();
  }

  /** Creates a slider for the level; all sliders show the same value. */
  levelSlider() {
    const output = make('output', { className: 'value' });
    const range = make('input', { type: 'range', min: 0, max: LEVELS, step: 1, 'aria-label': 'Level',
      oninput: () => (output.textContent = range.value), onchange: () => change({ level: range.value }) });
    this.sliders.push({ range, output });
    this.#showLevel();
    return slider('Level', range, output);
  }

  #showLevel() {
    for (const { range, output } of this.sliders) {
      output.textContent = state('level');
      range.value = state('level') === 'auto' ? 0 : state('level');
    }
  }

  #key(level) {
    return JSON.stringify([this.model?.id, { ...surfaceOptions(), level: Number(level) }]);
  }

  /** Records the size and time of a level that was loaded. */
  tell({ size, ms }) {
    this.measured.set(this.#key(state('level')), { size, ms });
    this.show();
  }

  #clear() {
    this.controller?.abort();
    this.levels = [];
    this.refusal = '';
    this.show();
  }

  /** Requests the counts of all levels that the daemon would make, when they are seen. */
  async count() {
    this.#clear();
    this.isDue = !COUNTED.includes(state('tab'));
    if (!this.model || this.isDue) return;
    const { signal } = (this.controller = new AbortController());
    try {
      this.levels = await withKey(() => tweend.levels(this.model, { ...surfaceOptions(), level: undefined }, { signal }));
    } catch (error) {
      if (signal.aborted) return;
      this.refusal = error.detail ?? error.message;
    }
    const deepest = Math.max(...this.levels.filter(({ refused }) => !refused).map(({ level }) => level), 0);
    if (this.levels.length > 0) for (const { range } of this.sliders) range.max = deepest;
    this.show();
  }

  /** The size that the daemon predicts for a level; null when unknown. */
  predicted(level) {
    return this.levels.find((entry) => entry.level === Number(level))?.bytes ?? null;
  }

  #row({ level, vertices, faces, bytes: size, refused }) {
    const seen = this.measured.get(this.#key(level));
    return html`<tr data-level=${level} title=${refused ?? ''} class=${refused ? 'refused' : ''} ?aria-current=${String(level) === state('level')}>
      <td><button type="button" ?disabled=${Boolean(refused)} aria-label="Show level ${level}" @click=${() => change({ level })}>${level}</button></td>
      <td>${count(vertices)}</td><td>${count(faces)}</td>${refused ? html`<td colspan="2">over limit</td>` : html`<td>${bytes(size ?? seen?.size)}</td><td>${seen ? `${seen.ms.toFixed(1)} ms` : '–'}</td>`}</tr>`;
  }

  show() {
    this.#showLevel();
    this.slider.hidden = !this.model;
    if (!this.model) return render(html`<p class="dim">Open a model: what each level of it has is shown here.</p>`, this.content);
    return render(html`<div class="fields">${CHOICES.map(([name, label, options]) => choice(label, name, options))}</div>
      ${flag('Points on the limit surface', 'limit')}
      <table><caption>What each level has</caption>
        <thead><tr>${['Level', 'Points', 'Faces', 'Size', 'Server'].map((text) => html`<th scope="col">${text}</th>`)}</tr></thead>
        <tbody>${this.levels.map((level) => this.#row(level))}${this.refusal ? html`<tr class="refused"><td colspan="5">Refused: ${this.refusal}</td></tr>` : nothing}</tbody></table>`, this.content);
  }
}
