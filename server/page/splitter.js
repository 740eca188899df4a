// The line between the picture and the panel: dragging it, or arrows, change the panel's width; a button hides the panel.
import { byId, make } from './dom.js';
import { note, state, watch } from './state.js';

const [LEAST, MOST] = [300, 720]; // pixels
const STEP = 24;

export class Splitter {
  constructor() {
    const aside = document.querySelector('aside');
    this.line = make('div', { className: 'splitter', role: 'separator', tabIndex: 0, 'aria-label': 'Width of the panel', 'aria-orientation': 'vertical', 'aria-controls': 'panel', 'aria-valuemin': LEAST, 'aria-valuemax': MOST });
    this.button = make('button', { className: 'quiet', id: 'hide', onclick: () => this.#set(state('panel') === '0' ? '' : 0) });
    byId('theme').before(this.button);
    aside.before(this.line);
    this.line.addEventListener('pointerdown', (event) => {
      event.preventDefault();
      this.line.setPointerCapture(event.pointerId);
    });
    this.line.addEventListener('pointermove', ({ pointerId, clientX }) => this.line.hasPointerCapture(pointerId) && this.#set(innerWidth - clientX));
    this.line.addEventListener('dblclick', () => this.#set(''));
    this.line.addEventListener('keydown', (event) => {
      const by = { ArrowLeft: STEP, ArrowRight: -STEP }[event.key];
      if (!by) return;
      event.preventDefault();
      this.#set(aside.clientWidth + by);
    });
    new ResizeObserver(() => this.line.setAttribute('aria-valuenow', aside.clientWidth || LEAST)).observe(aside);
    watch((names) => names.has('panel') && this.show());
    this.show();
  }

  #set(width) {
    note('panel', width ? Math.round(Math.min(Math.max(width, LEAST), Math.min(MOST, innerWidth - 300))) : width);
    this.show();
  }

  show() {
    const width = state('panel');
    const isHidden = width === '0';
    document.documentElement.classList.toggle('panel-hidden', isHidden);
    if (Number(width) > 0) document.documentElement.style.setProperty('--panel', `min(${Math.min(Math.max(Number(width), LEAST), MOST)}px, 100vw - 300px)`);
    else document.documentElement.style.removeProperty('--panel');
    this.button.textContent = isHidden ? 'Show panel' : 'Hide panel';
    this.button.setAttribute('aria-expanded', !isHidden);
  }
}
