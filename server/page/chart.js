// A chart of curves over the time of a clip: axes, values under the pointer, a part chosen by dragging, and a click that
// seeks. Charts move together.
import uPlot from 'uplot';

import { make } from './dom.js';

const HEIGHT = 144; // pixels
const DEGREES = [0.1, 0.5, 1, 5, 10, 15, 30, 45, 90, 180, 360, 720, 1440]; // between the lines of a grid
const STILL = 3;    // pixels that the pointer may move during a click

const variable = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Values with gaps where they leap, as angles do that wrap round. */
const gapped = (values, leap) => values.map((value, i) => (leap && i > 0 && Math.abs(value - values[i - 1]) > leap ? null : value));

export class Chart {
  /** names: of the curves, in the colours c0, c1, …; unit: of their values; range: [low, high]; leap: a difference that is a
   *  gap; digits: behind the point. onSeek(seconds) is called for a click. */
  constructor({ label, names, unit = '', range, leap = 0, digits = 1, onSeek }) {
    Object.assign(this, { names, unit, leap, digits });
    this.outputs = names.map(() => make('output'));
    this.legend = make('ul', { className: 'keys' }, ...names.map((name, k) => make('li', { className: `c${k}` }, name, this.outputs[k])));
    this.box = make('div', { className: 'chart', role: 'img', 'aria-label': label });
    this.now = make('div', { className: 'now' });
    const axis = { stroke: variable('--dim'), font: '11px system-ui, sans-serif', grid: { stroke: variable('--line'), width: 1 }, ticks: { stroke: variable('--line'), size: 4 } };
    this.plot = new uPlot({
      width: 300, height: HEIGHT, legend: { show: false }, padding: [6, 14, 0, 0],
      scales: { x: { time: false }, y: { range } },
      axes: [{ ...axis, size: 26, values: (plot, splits) => splits.map((t) => `${t} s`) },
        { ...axis, size: 46, space: 22, ...(unit === '°' && { incrs: DEGREES }), values: (plot, splits) => splits.map((value) => `${value}${unit}`) }],
      cursor: { sync: { key: 'rotation', setSeries: false, scales: ['x', null] }, y: false, points: { size: 6 } },
      series: [{}, ...names.map((name, k) => ({ label: name, stroke: variable(`--c${k}`), width: 1.6, points: { show: false } }))],
      hooks: { setCursor: [({ cursor: { idx } }) => this.#tell(idx)], setScale: [() => this.tick(this.time)] },
    }, [[], ...names.map(() => [])], this.box);
    this.box.plot = this.plot; // which README's pictures of the page are drawn from
    this.plot.over.append(this.now);
    let from = 0;
    this.plot.over.addEventListener('pointerdown', ({ clientX }) => (from = clientX));
    this.plot.over.addEventListener('click', ({ clientX }) => {
      if (Math.abs(clientX - from) <= STILL) onSeek(this.plot.posToVal(clientX - this.plot.over.getBoundingClientRect().left, 'x'));
    });
    this.watcher = new ResizeObserver(([{ contentRect: { width } }]) => width > 0 && this.plot.setSize({ width, height: HEIGHT }));
    this.watcher.observe(this.box);
  }

  /** times: ascending, seconds; columns: the values of each curve. */
  set(times, columns) {
    this.columns = columns;
    this.times = times;
    this.plot.setData([times, ...columns.map((values) => gapped(values, this.leap))]);
  }

  /** Shows the values at the pointer, or at the present time. */
  #tell(index) {
    const at = index ?? this.#nearest(this.time ?? 0);
    this.columns?.forEach((values, k) => {
      const value = values[at] ?? 0;
      this.outputs[k].textContent = `${value.toFixed(this.digits).replace(/^-(0\.?0*)$/, '$1')}${this.unit}`;
    });
  }

  #nearest(time) {
    const { times = [] } = this;
    const after = times.findIndex((t) => t >= time);
    if (after <= 0) return after < 0 ? times.length - 1 : 0;
    return times[after] - time < time - times[after - 1] ? after : after - 1;
  }

  /** Marks the present time. */
  tick(time) {
    this.time = time;
    if (!this.times) return;
    const { min, max } = this.plot.scales.x;
    this.now.hidden = !(time >= min && time <= max);
    this.now.style.left = `${this.plot.valToPos(time, 'x')}px`;
    if (this.plot.cursor.idx === null || this.plot.cursor.idx === undefined) this.#tell(null);
  }

  dispose() {
    this.watcher.disconnect();
    this.plot.destroy();
  }
}
