// The steps of a lineage of models, edits and strokes alike: each shows the model that it made, and can be undone and
// done again.
import { isStep, note, state, step, watch } from './state.js';

const NAMES = ['model', 'from', 'edits', 'quads', 'beside']; // what a step changes

export class Steps {
  #past = [];
  #future = [];

  constructor(viewport) {
    this.viewport = viewport;
    this.onChange = () => {};
    this.onStep = () => {}; // called with a model and the one that a new step made from it
    watch((names) => {
      if (!names.has('model') || isStep()) return;
      [this.#past, this.#future] = [[], []]; // another lineage
      this.onChange();
    });
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  /** Changes the state to that of new steps, and shows the last of them. */
  go(...steps) {
    let now = this.#now();
    for (const next of steps) {
      this.onStep(now.model, next.model);
      this.#past.push(now);
      now = { ...now, ...next };
    }
    this.#future = [];
    this.#show(now);
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
    this.onChange();
  }
}
