// Shows the original beside an edited model: both in one picture, split by a line that can be dragged, and a table of
// facts of both.
import { html, render } from 'lit-html';

import { download, tweend, withKey } from './client.js';
import { byId, count, make } from './dom.js';
import { parse } from './glb.js';
import { busy, fail, marked } from './notices.js';
import { change, note, state, SURFACE, surfaceOptions, watch } from './state.js';

const FACTS = [['vertices', 'Points'], ['faces', 'Faces'], ['components', 'Pieces'], ['boundary_loops', 'Holes and borders'],
  ['boundary_edges', 'Edges of these'], ['nonmanifold_edges', 'Non-manifold edges'], ['reversed_edges', 'Edges wound against each other']];

export class Beside {
  /** loadCage(described, signal) resolves with a model's cage; onShow() is called when the original is shown. */
  constructor({ viewport, loadCage, onShow }) {
    Object.assign(this, { viewport, loadCage, onShow });
    this.line = make('input', { type: 'range', className: 'split', min: 0, max: 100, step: 1, hidden: true,
      'aria-label': 'Line between the original and the edited model', oninput: () => this.move() });
    this.sides = make('div', { className: 'sides', hidden: true, 'aria-hidden': 'true' }, make('span', {}, 'Original'), make('span', {}, 'Edited'));
    byId('view').after(this.line, this.sides); // below the other overlays
    this.table = make('table', { hidden: true });
    watch((names) => {
      if (['beside', ...SURFACE].some((name) => names.has(name))) this.open();
      if (names.has('split')) this.place();
    });
    this.place();
  }

  move() {
    note('split', this.line.value);
    this.place();
  }

  place() {
    const part = Number(state('split')) / 100;
    this.line.value = part * 100;
    this.sides.style.left = `calc(12px + (100% - 24px) * ${part})`; // centre of the slider's thumb
    this.viewport.setSplit(part);
  }

  /** Loads the original, with the level and rules of the surface. */
  open() {
    return marked(this.#read());
  }

  async #read() {
    this.loading?.abort();
    const id = state('beside');
    if (!id) {
      this.close();
      return;
    }
    const controller = (this.loading = new AbortController());
    const { signal } = controller;
    const options = surfaceOptions();
    if (options.level === 'auto') return; // the model beside it chooses one
    const task = busy('The original', controller);
    try {
      const described = await withKey(() => tweend.describe(id, { signal }));
      const [answer, cage] = await Promise.all([download(tweend.surfaceUrl(id, options), { signal }), this.loadCage(described, signal)]);
      const parsed = await parse(await answer.blob.arrayBuffer());
      signal.throwIfAborted();
      this.described = described;
      this.viewport.setBeside(parsed, options, cage);
      this.line.hidden = this.sides.hidden = false;
      this.onShow();
    } catch (error) {
      fail('The original cannot be shown', error);
      if (this.loading === controller) change({ beside: '' });
    } finally {
      task.done();
    }
  }

  close() {
    this.described = null;
    this.viewport.setBeside(null);
    this.line.hidden = this.sides.hidden = this.table.hidden = true;
  }

  /** Fills the table of facts of both. mesh: the index of the edited mesh. */
  tell(model, mesh) {
    const both = [this.described?.meshes[mesh], model?.meshes[mesh]];
    this.table.hidden = both.includes(undefined);
    if (this.table.hidden) return;
    render(html`<thead><tr>${['Has', 'Original', 'Edited'].map((text) => html`<th scope="col">${text}</th>`)}</tr></thead>
      <tbody>${FACTS.map(([name, text]) => html`<tr><td>${text}</td>${both.map((facts) => html`<td>${count(facts[name])}</td>`)}</tr>`)}</tbody>`, this.table);
  }
}
