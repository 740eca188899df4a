// The steps of a lineage of models, edits and strokes alike: each shows the model that it made, and can be undone and
// done again. The tab keeps them, so that they outlive a reload.
import { isStep, note, state, step, watch } from './state.js';
import { ofTab } from './storage.js';

const NAMES = ['model', 'from', 'edits', 'quads', 'beside']; // what a step changes
const KEPT = 'tweend-steps';
const KEPT_MOST = 100;

export class Steps {
  #past = [];
  #future = [];

  constructor(viewport) {
    this.viewport = viewport;
    this.onChange = () => {};
    this.onStep = () => {}; // called with a model and the one that a new step made from it
    this.onAside = () => {}; // called with a model, of which steps were made while another is shown, and the last of them
    this.#readKept();
    watch((names) => {
      if (!names.has('model') || isStep()) return;
      [this.#past, this.#future] = [[], []]; // another lineage
      this.#readKept();
      this.onChange();
    });
  }

  /** Takes up the steps of this tab where the page shows what the last of them left. */
  #readKept() {
    try {
      const { past, now, future } = JSON.parse(ofTab.getItem(KEPT)) ?? {};
      if (now.model === state('model')) [this.#past, this.#future] = [past, future];
    } catch {
      // another version of the page wrote something else
    }
  }

  #keep() {
    try {
      ofTab.setItem(KEPT, JSON.stringify({ past: this.#past.slice(-KEPT_MOST), now: this.#now(), future: this.#future.slice(-KEPT_MOST) }));
    } catch {
      // the storage is full: the steps are lost when the page is left
    }
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  /** Changes the state to that of new steps, which were made from a model, and shows the last of them. Where another model
   *  has been opened meanwhile, that stays. */
  go(model, ...steps) {
    let [now, from] = [this.#now(), model.id];
    const isAside = now.model !== from;
    for (const next of steps) {
      this.onStep(from, next.model);
      from = next.model;
      if (isAside) continue;
      this.#past.push(now);
      now = { ...now, ...next };
    }
    if (isAside) return this.onAside(model, from);
    this.#future = [];
    return this.#show(now);
  }

  /** Likewise, to what a step before those of this visit was made from: it can be done again. */
  goBack(model, before) {
    const [now, future] = [this.#now(), this.#future];
    this.go(model, before);
    if (now.model !== model.id) return;
    [this.#past, this.#future] = [[], [...future, now]];
    this.#keep();
    this.onChange();
  }

  undo() {
    if (!this.canUndo) return;
    this.#future.push(this.#now());
    this.#show(this.#past.pop());
  }

  redo() {
    if (!this.canRedo) return;
    this.#past.push(this.#now());
    this.#show(this.#future.pop());
  }

  #now() {
    return Object.fromEntries(NAMES.map((name) => [name, state(name)]));
  }

  #show(next) {
    note('view', this.viewport.view);
    step(next);
    this.#keep();
    this.onChange();
  }
}
