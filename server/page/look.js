// The menu for how the picture looks: light, exposure, turntable, and the picture as a file.
import { html, render } from 'lit-html';

import { STOPS } from './address.js';
import { byId, fixed, floats, make, saveAs } from './dom.js';
import { note, state, watch } from './state.js';
import { amount, choice, flag } from './templates.js';

const LIGHTS = [['studio', 'Studio'], ['sun', 'Sunlight'], ['overcast', 'Overcast'], ['evening', 'Evening'], ['rim', 'Dark room']];

export class Look {
  /** viewport: whose look it is. nameOf(): of the file that a picture is saved as. */
  constructor(viewport, nameOf) {
    Object.assign(this, { viewport, nameOf });
    this.button = make('button', { className: 'chip' }, 'Look');
    this.panel = make('div', { className: 'menu look', role: 'dialog', 'aria-label': 'Look' });
    byId('stage').append(this.panel);
    floats(this.button, this.panel);
    watch((names) => ['light', 'exposure', 'turntable'].some((name) => names.has(name)) && this.show());
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) note('turntable', false); // until it is asked for here
    this.show();
  }

  show() {
    const stops = Number(state('exposure'));
    render(html`${choice('Light', 'light', LIGHTS)}
      ${amount('Exposure', 'exposure', [-STOPS, STOPS, 0.1], `${stops > 0 ? '+' : ''}${fixed(stops, 1)}`)}
      ${flag('Turntable', 'turntable')}
      <button type="button" @click=${() => this.save()}>Save picture (PNG)</button>`, this.panel);
    this.viewport.setLight(state('light'), 2 ** stops);
    this.viewport.turn(state('turntable') === 'true');
  }

  async save() {
    saveAs(await this.viewport.picture(), `${this.nameOf().replace(/\.\w+$/, '')}.png`);
  }
}
