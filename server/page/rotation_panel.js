// Shows one node's rotation over a clip: quaternion and Euler angles as curves, how far they are from gimbal lock, where
// slerp and the interpolation of Euler angles part, and in the picture ghosts of both and the node's way.
import { html, render } from 'lit-html';
import { Color, MathUtils } from 'three';

import { tweend, withKey } from './client.js';
import { optionsOf } from './clips.js';
import { draw, fixed, make, seconds } from './dom.js';
import { eulered, Ghosts, sampled } from './ghosts.js';
import { fail, marked } from './notices.js';
import { change, shows, state, watch } from './state.js';
import { choice } from './templates.js';
import { disposeTrail, trailOf } from './trail.js';

const ORDERS = ['XYZ', 'XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX'];
const GHOSTS = [['off', 'None'], ['both', 'Slerp and Euler'], ['slerp', 'Slerp'], ['euler', 'Euler angles, key to key']];
const SAMPLES = 240;
const KEYS_MOST = 2000;
const BAND = 320; // width of the band's drawing
const LEAST_HIGH = 10; // degrees that the axis of angles reaches
const LOCKED = 0.1; // cosine of the middle angle at which an Euler rate is ten times the body's
const NEAR = 0.35;

/** The middle angle's distance from lock in degrees, of its cosine. */
const degreesOf = (cosine) => MathUtils.radToDeg(Math.asin(Math.min(Math.max(cosine, 0), 1)));
const fromLock = (cosine) => `${fixed(degreesOf(cosine), 1)}°`;

/** Degrees between two rotations, of single precision: the arc cosine of their product would be as coarse as 0.03. */
function degreesBetween(a, b) {
  const [p, q] = [a.toArray(), b.toArray()];
  const chord = (sign) => Math.hypot(...p.map((value, i) => value - sign * q[i]));
  return MathUtils.radToDeg(4 * Math.asin(Math.min(chord(1), chord(-1)) / 2));
}

/** How near a track comes to lock in its own order: a mark. */
const markOf = ({ gimbal: { cos_middle: cosine } }) => (cosine < LOCKED ? '● ' : cosine < NEAR ? '◐ ' : '');

export class RotationPanel {
  constructor(panel, { viewport, animation, timeline }) {
    Object.assign(this, { viewport, animation, timeline });
    this.content = make('div');
    panel.append(make('h2', {}, 'Rotation'), this.content);
    this.ghosts = new Ghosts(viewport);
    this.charts = [];
    this.trail = null;
    viewport.onFrame.push(() => this.ghosts.pose(animation.clipTime, this.#duration));
    watch((names) => {
      if (names.has('node') || names.has('order') || names.has('theme')) this.open();
      else if (names.has('ghosts')) this.makeGhosts();
      if (names.has('tab') && !this.data) this.open();
      if (names.has('show')) this.showTrail();
    });
    viewport.onClick((event) => state('tab') === 'animation' && this.choose(event));
  }

  /** Seconds of the clip whose rotations are shown; in a blend it may play faster or slower. */
  get #duration() {
    return this.animation.clip?.duration ?? this.animation.duration;
  }

  /** Chooses the node that is at a place of the picture. */
  choose(event) {
    const known = new Set(this.tracks?.map(({ node }) => node));
    const node = this.viewport.nodesAt(event).find((name) => known.has(name));
    if (node) change({ node });
  }

  close() {
    this.controller?.abort();
    this.clearGhosts();
    for (const chart of this.charts) chart.dispose();
    this.charts = [];
    this.data = this.tracks = null;
    this.clearTrail();
  }

  /** Shows the selected node in the animation's clip. */
  open() {
    return marked(this.#read());
  }

  async #read() {
    this.close();
    const { model, clip } = this.animation;
    this.content.ariaBusy = 'false';
    if (!clip) {
      this.say(`${model ? 'This model has no clip. ' : ''}A clip’s rotation tracks are shown here as curves.`);
      return;
    }
    if (state('tab') !== 'animation' && state('ghosts') === 'off' && !shows('trail')) return;
    const { signal } = (this.controller = new AbortController());
    this.content.ariaBusy = 'true'; // what is shown is of the node, order or clip before
    try {
      const { tracks } = await this.timeline.tracksOf;
      if (signal.aborted) return;
      if (tracks.length === 0) {
        this.say('This clip turns no node.');
        return;
      }
      this.tracks = [...tracks].sort((a, b) => a.gimbal.cos_middle - b.gimbal.cos_middle);
      const track = tracks.find(({ node }) => node === state('node')) ?? this.tracks[0];
      const [data, { Chart }] = await Promise.all([this.ask(model, clip, track, signal), import('./chart.js')]); // evaluating it takes a while
      if (signal.aborted) return;
      this.data = data;
      this.show(track, Chart);
      this.makeGhosts();
      this.showTrail();
      this.tick();
    } catch (error) {
      if (!signal.aborted) fail('The rotation cannot be shown', error);
    } finally {
      if (!signal.aborted) this.content.ariaBusy = 'false';
    }
  }

  say(text) {
    render(html`<p class="dim">${text}</p>`, this.content);
  }

  async ask(model, clip, track, signal) {
    const order = state('order');
    const duration = this.#duration;
    const span = duration > 0 ? { from: 0, to: duration, fps: (SAMPLES - 1) / duration } : { at: 0 };
    const common = { ...optionsOf(clip), nodes: [track.node] };
    const euler = { as: 'euler', order, unit: 'degrees' };
    const times = track.times.slice(0, KEYS_MOST);
    const [path, angles, slerp, keys] = await withKey(() => Promise.all([
      tweend.poseTable(model, { ...common, ...span }, { signal }),
      tweend.poseTable(model, { ...common, ...span, ...euler }, { signal }),
      tweend.poseTable(model, { ...common, ...span, interpolation: 'slerp' }, { signal }),
      tweend.poseTable(model, { ...common, ...euler, at: times }, { signal }),
    ]));
    const column = (table, part, k) => Array.from({ length: table.header.poses }, (_, i) => table.part(i, 0, part)[k]);
    const middle = 'XYZ'.indexOf(order[1]);
    const eulers = [0, 1, 2].map((k) => column(angles, 'euler', k));
    const data = {
      node: track.node, order, times, path, slerp, samples: [...slerp.header.times],
      isEuler: track.kind === 'euler' && track.interpolation === 'euler' && track.gimbal.order === order,
      quaternion: [0, 1, 2, 3].map((k) => column(path, 'rotation', k)),
      eulers,
      distance: eulers[middle].map((angle) => Math.abs(Math.cos(MathUtils.degToRad(angle)))),
      keys: times.map((_, i) => [...keys.part(i, 0, 'euler')]),
    };
    data.apart = data.samples.map((time, i) => {
      const part = i / Math.max(data.samples.length - 1, 1);
      return degreesBetween(sampled(slerp, part), eulered(data, time, part));
    });
    return data;
  }

  show(track, Chart) {
    const { quaternion, eulers, distance, order, samples, apart } = this.data;
    const high = 1.1 * Math.max(LEAST_HIGH, ...eulers.flat().map((angle) => Math.abs(angle)));
    const most = Math.max(...apart);
    const chart = (options, columns) => {
      const made = new Chart({ ...options, onSeek: (time) => this.animation.seekInClip(time) });
      made.set(samples, columns);
      this.charts.push(made);
      return [made.box, made.legend];
    };
    this.band = this.drawBand(distance);
    this.lockNow = make('output', { className: 'value' });
    const nearest = Math.min(...distance);
    const least = Math.min(nearest, track.orders[order] ?? 1); // the samples of the curve may miss the minimum
    const verdict = least < LOCKED ? 'locks' : least < NEAR ? 'comes near lock' : 'stays clear of lock';
    const best = track.best_order;
    const offersBetter = best !== order && (track.orders[best] ?? 0) > (track.orders[order] ?? 0) + 0.01;
    const facts = [
      ['Keys', `${track.keys}, ${track.kind}, ${track.interpolation}`],
      ['Turns in all', `${track.total_degrees.toFixed(1)}°`],
      ['Largest step', `${track.largest_step_degrees.toFixed(1)}°`],
      ['Fastest', `${track.peak_degrees_per_second.toFixed(0)}°/s at ${track.peak_time.toFixed(2)} s`],
    ];
    render(html`<div class="fields one">
        ${choice('Node, nearest to lock first', 'node', this.tracks.map((entry) => [entry.node, `${markOf(entry)}${entry.node}, ${fromLock(entry.gimbal.cos_middle)} from lock`]), track.node)}
        ${choice('Euler order', 'order', ORDERS.map((name) => [name, `${name}, ${fromLock(track.orders[name] ?? 1)} from lock`]))}</div>
      <h3>Distance from gimbal lock${this.lockNow}</h3>${this.band.svg}
      <p class=${least < LOCKED ? 'verdict locked' : 'verdict'}><strong>${order} ${verdict}</strong>: ${fromLock(least)} from lock at ${
        seconds(samples[distance.indexOf(nearest)])}. At lock the outer two axes turn about one line, and angles leap.</p>
      ${offersBetter ? html`<button type="button" class="wide" @click=${() => this.use(best)}>Use ${best}, which stays ${fromLock(track.orders[best])} away</button>`
        : html`<p class="dim">No order does better than ${order} here.</p>`}
      <h3>Euler angles, ${order}</h3>
      ${chart({ label: `Euler angles of ${track.node} in order ${order}`, names: ['x', 'y', 'z'], unit: '°', range: [-high, high], leap: 180 }, eulers)}
      <h3>Quaternion</h3>
      ${chart({ label: `Quaternion components of ${track.node}`, names: ['x', 'y', 'z', 'w'], range: [-1.05, 1.05], digits: 3 }, quaternion)}
      <h3>Between slerp and Euler angles, key to key</h3>
      ${chart({ label: `Angle between slerp and Euler angles of ${track.node}`, names: ['apart'], unit: '°', range: [0, Math.max(1, most * 1.1)] }, [apart])}
      <p class="dim">${most < 0.5 ? 'Both go the same way.' : `They are up to ${fixed(most, 0)}° apart, at ${seconds(samples[apart.indexOf(most)])}.`}</p>
      <p class="dim">Click a curve to go there; drag to see a part, double-click for all.</p>
      <div class="fields one">${choice('Ghosts', 'ghosts', GHOSTS)}</div>
      <ul class="keys ghosts"><li class="slerp">slerp</li><li class="euler">angles in ${order}</li></ul>
      <h3>Track</h3><dl>${facts.map(([name, value]) => html`<dt>${name}</dt><dd>${value}</dd>`)}</dl>
      ${track.warnings.map((warning) => html`<p class="warning">${warning}</p>`)}`, this.content);
  }

  /** Chooses an order by the button that offers it, which is gone then: the list of orders has the focus next. */
  use(order) {
    this.content.querySelectorAll('select')[1].focus();
    change({ order });
  }

  drawBand(distance) {
    const svg = draw('svg', { viewBox: `0 0 ${BAND} 16`, class: 'band', preserveAspectRatio: 'none', role: 'img', 'aria-label': 'Distance from gimbal lock over the clip' });
    const calm = new Color('#8fa3b8');
    const [warn, stop] = [new Color('#e0a33d'), new Color('#d92d20')];
    distance.forEach((value, i) => {
      const colour = value > NEAR ? calm.clone().lerp(warn, Math.max(0, 1 - (value - NEAR) / 0.3))
        : value > LOCKED ? warn.clone().lerp(stop, (NEAR - value) / (NEAR - LOCKED)) : stop;
      svg.append(draw('rect', { x: (i / distance.length) * BAND, y: 0, width: BAND / distance.length + 0.5, height: 16,
        fill: `#${colour.getHexString()}`, 'data-locked': value < LOCKED }));
    });
    const now = draw('line', { class: 'now', y1: 0, y2: 16 });
    svg.append(now);
    return { svg, now };
  }

  /** Moves the marks to the present time, and shows the values there. */
  tick() {
    if (!this.data || state('tab') !== 'animation') return;
    const { distance } = this.data;
    const time = this.animation.clipTime;
    const part = this.#duration > 0 ? time / this.#duration : 0;
    const i = Math.min(Math.round(part * (distance.length - 1)), distance.length - 1);
    for (const chart of this.charts) chart.tick(time);
    for (const end of ['x1', 'x2']) this.band.now.setAttribute(end, part * BAND);
    this.lockNow.textContent = fromLock(distance[i]);
    this.lockNow.classList.toggle('locked', distance[i] < LOCKED);
  }

  // ---- the node's way ----

  clearTrail() {
    if (this.trail) disposeTrail(this.trail);
    this.trail = null;
    this.viewport.invalidate();
  }

  showTrail() {
    return marked(this.#readTrail());
  }

  async #readTrail() {
    this.clearTrail();
    const { data } = this;
    if (!shows('trail')) return undefined;
    if (!data) return this.controller && !this.controller.signal.aborted ? undefined : this.open();
    const { model, clip } = this.animation;
    const duration = this.#duration;
    const span = duration > 0 ? { from: 0, to: duration, fps: (SAMPLES - 1) / duration } : { at: 0 };
    try {
      const table = await withKey(() => tweend.poseTable(model, { ...optionsOf(clip), nodes: [data.node], space: 'world', as: 'matrix', ...span }, { signal: this.controller.signal }));
      const object = this.viewport.model?.nodes.get(data.node);
      if (this.data !== data || !shows('trail') || !object) return undefined;
      this.clearTrail();
      this.trail = trailOf(object, table, data.times.map((time) => Math.round((time / (duration || 1)) * (SAMPLES - 1))));
      this.viewport.ghosts.add(this.trail);
      this.viewport.invalidate();
    } catch (error) {
      if (error.name !== 'AbortError') fail('The way of the node cannot be shown', error);
    }
    return undefined;
  }

  clearGhosts() {
    this.ghosts.clear();
  }

  makeGhosts() {
    const kinds = { both: ['slerp', 'euler'], slerp: ['slerp'], euler: ['euler'] }[state('ghosts')] ?? [];
    if (this.data) this.ghosts.make(kinds, this.data);
  }
}
