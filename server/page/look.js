// The menu for how the picture looks: light, exposure, turntable, and the picture as a file.
import { byId, check, choice, floats, make, saveAs, slider } from './dom.js';
import { change, note, state, watch } from './state.js';

const LIGHTS = [['studio', 'Studio'], ['sun', 'Sunlight'], ['overcast', 'Overcast'], ['evening', 'Evening'], ['rim', 'Dark room']];

export class Look {
  /** viewport: whose look it is. nameOf(): of the file that a picture is saved as. */
  constructor(viewport, nameOf) {
    Object.assign(this, { viewport, nameOf });
    this.button = make('button', { className: 'chip' }, 'Look');
    this.value = make('output', { className: 'value' });
    this.exposure = make('input', { type: 'range', min: -2, max: 2, step: 0.1, 'aria-label': 'Exposure', oninput: () => change({ exposure: this.exposure.value }) });
    this.turns = make('input', { type: 'checkbox', onchange: () => change({ turntable: this.turns.checked }) });
    this.lights = choice('Light', LIGHTS, state('light'), (light) => change({ light }));
    const panel = make('div', { className: 'menu look', role: 'dialog', 'aria-label': 'Look' }, this.lights, slider('Exposure', this.exposure, this.value),
      check(this.turns, 'Turntable'), make('button', { onclick: () => this.save() }, 'Save picture (PNG)'));
    byId('stage').append(panel);
    floats(this.button, panel);
    watch((names) => ['light', 'exposure', 'turntable'].some((name) => names.has(name)) && this.show());
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) note('turntable', false); // until it is asked for here
    this.show();
  }

  show() {
    const stops = Math.min(Math.max(Number(state('exposure')) || 0, -2), 2);
    this.exposure.value = stops;
    this.value.textContent = `${stops > 0 ? '+' : ''}${stops.toFixed(1)}`;
    this.turns.checked = state('turntable') === 'true';
    this.lights.lastChild.value = LIGHTS.some(([name]) => name === state('light')) ? state('light') : 'studio';
    this.viewport.setLight(this.lights.lastChild.value, 2 ** stops);
    this.viewport.turn(this.turns.checked);
  }

  async save() {
    saveAs(await this.viewport.picture(), `${this.nameOf().replace(/\.\w+$/, '')}.png`);
  }
}
