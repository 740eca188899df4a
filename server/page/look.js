// The menu for how the picture looks: light, exposure, turntable, and the picture as a file.
import { byId, choice, make } from './dom.js';
import { change, state, watch } from './state.js';

const LIGHTS = [['studio', 'Studio'], ['sun', 'Sunlight'], ['overcast', 'Overcast'], ['evening', 'Evening'], ['rim', 'Dark room']];

export class Look {
  /** viewport: whose look it is. nameOf(): of the file that a picture is saved as. */
  constructor(viewport, nameOf) {
    Object.assign(this, { viewport, nameOf });
    this.button = make('button', { type: 'button', className: 'chip' }, 'Look');
    this.value = make('output', { className: 'value' });
    this.exposure = make('input', { type: 'range', min: -2, max: 2, step: 0.1, 'aria-label': 'Exposure', oninput: () => change({ exposure: this.exposure.value }) });
    this.turns = make('input', { type: 'checkbox', onchange: () => change({ turntable: this.turns.checked }) });
    this.lights = choice('Light', LIGHTS, state('light'), (light) => change({ light }));
    this.panel = make('div', { className: 'menu look', role: 'dialog', 'aria-label': 'Look', popover: 'auto' },
      this.lights,
      make('div', { className: 'slider' }, make('span', {}, 'Exposure'), this.exposure, this.value),
      make('label', { className: 'check' }, this.turns, make('span', {}, 'Turntable')),
      make('button', { type: 'button', onclick: () => this.save() }, 'Save picture (PNG)'));
    this.button.setAttribute('aria-haspopup', 'dialog');
    this.button.popoverTargetElement = this.panel;
    byId('stage').append(this.panel);
    this.panel.addEventListener('toggle', ({ newState }) => {
      const { left, bottom } = this.button.getBoundingClientRect();
      if (newState === 'open') Object.assign(this.panel.style, { left: `${Math.max(8, Math.min(left, innerWidth - this.panel.offsetWidth - 8))}px`, top: `${bottom + 4}px` });
    });
    watch((names) => ['light', 'exposure', 'turntable'].some((name) => names.has(name)) && this.show());
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
    const href = await this.viewport.picture();
    make('a', { href, download: `${this.nameOf().replace(/\.\w+$/, '')}.png` }).click();
  }
}
