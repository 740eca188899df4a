// Shows one node's rotation over a clip: quaternion and Euler angles as curves, how far they are from gimbal lock, where
// slerp and the interpolation of Euler angles part, and in the picture ghosts of both and the node's way.
import { AxesHelper, Color, Euler, Group, MathUtils, Matrix4, MeshBasicMaterial, Quaternion } from 'three';

import { Chart } from './chart.js';
import { tweend, withKey } from './client.js';
import { optionsOf } from './clips.js';
import { choice, draw, fixed, make, seconds } from './dom.js';
import { fail } from './notices.js';
import { change, shows, state, watch } from './state.js';
import { disposeTrail, trailOf } from './trail.js';

const ORDERS = ['XYZ', 'XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX'];
const SAMPLES = 240;
const KEYS_MOST = 2000;
const BAND = 320; // width of the band's drawing
const LOCKED = 0.1; // cosine of the middle angle at which an Euler rate is ten times the body's
const NEAR = 0.35;
const GHOSTS = { slerp: '#2f7de1', euler: '#d9822b' };

/** The middle angle's distance from lock in degrees, of its cosine. */
const degreesOf = (cosine) => MathUtils.radToDeg(Math.asin(Math.min(Math.max(cosine, 0), 1)));
const fromLock = (cosine) => `${fixed(degreesOf(cosine), 1)}°`;

/** How near a track comes to lock in its own order: a mark. */
const markOf = ({ gimbal: { cos_middle: cosine } }) => (cosine < LOCKED ? '● ' : cosine < NEAR ? '◐ ' : '');

export class RotationPanel {
  constructor(panel, { viewport, animation, timeline }) {
    Object.assign(this, { viewport, animation, timeline });
    this.panel = panel;
    this.content = make('div');
    panel.append(make('h2', {}, 'Rotation'), this.content);
    this.ghosts = [];
    this.charts = [];
    this.trail = null;
    viewport.onFrame.push(() => this.poseGhosts());
    watch((names) => {
      if (names.has('node') || names.has('order') || names.has('theme')) this.open();
      else if (names.has('ghosts')) this.makeGhosts();
      if (names.has('tab') && !this.data) this.open();
      if (names.has('show')) this.showTrail();
    });
    this.catchClicks();
  }

  /** A click on the picture chooses the node that is there. */
  catchClicks() {
    const { canvas } = this.viewport;
    let from = null;
    canvas.addEventListener('pointerdown', ({ clientX, clientY }) => (from = [clientX, clientY]));
    canvas.addEventListener('pointerup', (event) => {
      if (state('tab') !== 'animation' || !from || Math.hypot(event.clientX - from[0], event.clientY - from[1]) > 5) return;
      const known = new Set(this.tracks?.map(({ node }) => node));
      const node = this.viewport.nodesAt(event).find((name) => known.has(name));
      if (node) change({ node });
    });
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
  async open() {
    this.close();
    const { model, clip } = this.animation;
    if (!clip) {
      this.content.replaceChildren(make('p', { className: 'dim' }, 'This model has no clip. A clip’s rotation tracks are shown here as curves.'));
      return;
    }
    if (state('tab') !== 'animation' && state('ghosts') === 'off' && !shows('trail')) return;
    const { signal } = (this.controller = new AbortController());
    try {
      const { tracks } = await this.timeline.tracksOf;
      if (signal.aborted) return;
      if (tracks.length === 0) {
        this.content.replaceChildren(make('p', { className: 'dim' }, 'This clip turns no node.'));
        return;
      }
      this.tracks = [...tracks].sort((a, b) => a.gimbal.cos_middle - b.gimbal.cos_middle);
      const track = tracks.find(({ node }) => node === state('node')) ?? this.tracks[0];
      this.data = await this.ask(model, clip, track, signal);
      if (signal.aborted) return;
      this.render(track);
      this.makeGhosts();
      this.showTrail();
      this.tick(this.animation.time ?? 0);
    } catch (error) {
      if (!signal.aborted) fail('The rotation cannot be shown', error);
    }
  }

  async ask(model, clip, track, signal) {
    const order = state('order');
    const { duration } = this.animation;
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
      track, node: track.node, order, times, slerp, samples: [...slerp.header.times],
      quaternion: [0, 1, 2, 3].map((k) => column(path, 'rotation', k)),
      eulers,
      distance: eulers[middle].map((angle) => Math.abs(Math.cos(MathUtils.degToRad(angle)))),
      keys: times.map((_, i) => [...keys.part(i, 0, 'euler')]),
    };
    data.apart = data.samples.map((time, i) => MathUtils.radToDeg(new Quaternion(...slerp.part(i, 0, 'rotation')).angleTo(eulered(data, time))));
    return data;
  }

  render(track) {
    const { quaternion, eulers, distance, order, samples, apart } = this.data;
    const nodes = this.tracks.map((entry) => [entry.node, `${markOf(entry)}${entry.node}, ${fromLock(entry.gimbal.cos_middle)} from lock`]);
    const high = Math.max(180, ...eulers.flat().map((angle) => Math.abs(angle)));
    const onSeek = (time) => this.animation.seek(time);
    const most = Math.max(...apart);
    const chart = (options, columns) => {
      const made = new Chart({ ...options, onSeek });
      made.set(samples, columns);
      this.charts.push(made);
      return made;
    };
    const q = chart({ label: `Quaternion components of ${track.node}`, names: ['x', 'y', 'z', 'w'], range: [-1.05, 1.05], digits: 3 }, quaternion);
    const e = chart({ label: `Euler angles of ${track.node} in order ${order}`, names: ['x', 'y', 'z'], unit: '°', range: [-high, high], leap: 180 }, eulers);
    const p = chart({ label: `Angle between slerp and Euler angles of ${track.node}`, names: ['apart'], unit: '°', range: [0, Math.max(1, most * 1.1)] }, [apart]);
    this.band = this.drawBand(distance);
    const nearest = Math.min(...distance);
    const least = Math.min(nearest, track.orders[order] ?? 1); // the samples of the curve may miss the minimum
    const at = samples[distance.indexOf(nearest)];
    const verdict = least < LOCKED ? 'locks' : least < NEAR ? 'comes near lock' : 'stays clear of lock';
    this.lockNow = make('output', { className: 'value' });
    const offersBetter = track.best_order !== order && (track.orders[track.best_order] ?? 0) > (track.orders[order] ?? 0) + 0.01;
    this.content.replaceChildren(
      make('div', { className: 'fields one' },
        choice('Node, nearest to lock first', nodes, track.node, (node) => change({ node })),
        choice('Euler order', ORDERS.map((name) => [name, `${name}, ${fromLock(track.orders[name] ?? 1)} from lock`]), order, (next) => change({ order: next }))),
      make('h3', {}, 'Distance from gimbal lock', this.lockNow), this.band.svg,
      make('p', { className: least < LOCKED ? 'verdict locked' : 'verdict' },
        make('strong', {}, `${order} ${verdict}`), `: ${fromLock(least)} from lock at ${seconds(at)}. `,
        'At lock the outer two axes turn about one line, and angles leap.'),
      offersBetter
        ? make('button', { type: 'button', className: 'wide', onclick: () => change({ order: track.best_order }) },
          `Use ${track.best_order}, which stays ${fromLock(track.orders[track.best_order])} away`)
        : make('p', { className: 'dim' }, `No order does better than ${order} here.`),
      make('h3', {}, `Euler angles, ${order}`), e.box, e.legend,
      make('h3', {}, 'Quaternion'), q.box, q.legend,
      make('h3', {}, 'Between slerp and Euler angles, key to key'), p.box, p.legend,
      make('p', { className: 'dim' }, most < 0.5 ? 'Both go the same way.' : `They are up to ${fixed(most, 0)}° apart, at ${seconds(samples[apart.indexOf(most)])}.`),
      make('p', { className: 'dim' }, 'Click a curve to go there; drag to see a part, double-click for all.'),
      make('div', { className: 'fields one' }, choice('Ghosts', [['off', 'None'], ['both', 'Slerp and Euler'], ['slerp', 'Slerp'], ['euler', 'Euler angles, key to key']],
        state('ghosts'), (ghosts) => change({ ghosts }))),
      make('ul', { className: 'keys ghosts' }, make('li', { className: 'slerp' }, 'slerp'), make('li', { className: 'euler' }, `angles in ${order}`)),
      this.facts(track));
  }

  facts(track) {
    const rows = [
      ['Keys', `${track.keys}, ${track.kind}, ${track.interpolation}`],
      ['Turns in all', `${track.total_degrees.toFixed(1)}°`],
      ['Largest step', `${track.largest_step_degrees.toFixed(1)}°`],
      ['Fastest', `${track.peak_degrees_per_second.toFixed(0)}°/s at ${track.peak_time.toFixed(2)} s`],
    ];
    return make('div', {}, make('h3', {}, 'Track'),
      make('dl', {}, ...rows.flatMap(([name, value]) => [make('dt', {}, name), make('dd', {}, value)])),
      ...track.warnings.map((warning) => make('p', { className: 'warning' }, warning)));
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
  tick(time) {
    if (!this.data || state('tab') !== 'animation') return;
    const { distance } = this.data;
    const part = this.animation.duration > 0 ? time / this.animation.duration : 0;
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

  async showTrail() {
    this.clearTrail();
    const { data } = this;
    if (!shows('trail')) return undefined;
    if (!data) return this.controller && !this.controller.signal.aborted ? undefined : this.open();
    const { model, clip, duration } = this.animation;
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

  // ---- ghosts ----

  clearGhosts() {
    for (const { object } of this.ghosts) {
      this.viewport.ghosts.remove(object);
      object.traverse((part) => {
        part.material?.dispose();
        if (part.isLine) part.geometry.dispose(); // only axes own their geometry; meshes share the surface's
      });
    }
    this.ghosts = [];
    this.viewport.invalidate();
  }

  makeGhosts() {
    this.clearGhosts();
    const node = this.data && this.viewport.model?.nodes.get(this.data.node);
    if (state('ghosts') === 'off' || !node) return;
    for (const kind of state('ghosts') === 'both' ? ['slerp', 'euler'] : [state('ghosts')]) {
      const material = new MeshBasicMaterial({ color: GHOSTS[kind], transparent: true, opacity: 0.42, depthWrite: false });
      const object = new Group();
      const followers = []; // [part of the ghost, object that it follows]
      const copy = (from, into) => {
        for (const child of from.children.filter(({ isMesh, children }) => isMesh || children.length > 0)) {
          const part = shell(child, material);
          followers.push([part, child]);
          into.add(part);
          copy(child, part);
        }
      };
      const top = shell(node, material);
      top.position.set(0, 0, 0);
      top.quaternion.identity();
      top.scale.set(1, 1, 1);
      object.add(top);
      copy(node, top);
      let hasMesh = false;
      object.traverse((part) => (hasMesh ||= Boolean(part.isMesh)));
      if (!hasMesh) object.add(new AxesHelper(this.viewport.camera.position.distanceTo(this.viewport.controls.target) / 12).setColors(GHOSTS[kind], GHOSTS[kind], GHOSTS[kind]));
      object.matrixAutoUpdate = false;
      object.renderOrder = 4;
      this.viewport.ghosts.add(object);
      this.ghosts.push({ kind, object, followers });
    }
    this.viewport.invalidate();
  }

  poseGhosts() {
    const node = this.ghosts.length > 0 && this.viewport.model?.nodes.get(this.data.node);
    if (!node) return;
    this.viewport.scene.updateMatrixWorld();
    for (const { kind, object, followers } of this.ghosts) {
      for (const [part, of] of followers) for (const member of ['position', 'quaternion', 'scale']) part[member].copy(of[member]);
      const rotation = kind === 'slerp' ? this.slerped(this.animation.time ?? 0) : eulered(this.data, this.animation.time ?? 0);
      object.matrix.compose(node.position, rotation, node.scale).premultiply(node.parent?.matrixWorld ?? new Matrix4());
    }
  }

  slerped(time) {
    const { slerp } = this.data;
    const last = slerp.header.poses - 1;
    const at = this.animation.duration > 0 ? Math.min(Math.max(time / this.animation.duration, 0), 1) * last : 0;
    const [i, t] = [Math.floor(at), at % 1];
    const of = (k) => new Quaternion(...slerp.part(Math.min(k, last), 0, 'rotation'));
    return of(i).slerp(of(i + 1), t);
  }
}

/** Where the angles of a track's keys, each interpolated on its own, take the node. */
function eulered({ times, keys, order }, time) {
  let i = times.findIndex((key) => key > time) - 1;
  if (i === -2) i = times.length - 1;
  const [a, b] = [keys[Math.max(i, 0)], keys[Math.min(i + 1, keys.length - 1)]];
  const span = times[i + 1] - times[i];
  const t = span > 0 ? (time - times[i]) / span : 0;
  const angles = a.map((angle, k) => MathUtils.degToRad(angle + (b[k] - angle) * t));
  return new Quaternion().setFromEuler(new Euler(...angles, order));
}

/** A copy of an object, without its children, with the ghost's material. */
function shell(object, material) {
  const isLine = object.isLine || object.isPoints;
  const copy = isLine ? new Group() : object.clone(false);
  if (copy.isMesh) {
    copy.material = material;
    copy.renderOrder = 4;
  }
  return copy;
}
