// Shows one node's rotation over a clip: quaternion and Euler angles as curves, the distance to gimbal lock, and ghosts
// that show where slerp and the interpolation of Euler angles would take the node.
import { AxesHelper, Color, Euler, Group, MathUtils, Matrix4, MeshBasicMaterial, Quaternion } from 'three';

import { tweend, withKey } from './client.js';
import { choice, draw, fixed, make } from './dom.js';
import { fail } from './notices.js';
import { change, state, watch } from './state.js';

const ORDERS = ['XYZ', 'XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX'];
const SAMPLES = 240;
const KEYS_MOST = 2000;
const [WIDTH, HEIGHT] = [320, 84];
const LOCKED = 0.1; // cosine of the middle angle at which an Euler rate is ten times the body's
const NEAR = 0.35;
const GHOSTS = { slerp: '#2f7de1', euler: '#d9822b' };

/** A chart of curves over time. lines: [{name, values}], with values between low and high. */
function chart(label, lines, [low, high], marks) {
  const y = (value) => HEIGHT - 4 - ((value - low) / (high - low)) * (HEIGHT - 8);
  const x = (i, count) => (count > 1 ? (i / (count - 1)) * WIDTH : 0);
  const svg = draw('svg', { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: 'chart', preserveAspectRatio: 'none', role: 'img', 'aria-label': label });
  for (const mark of marks) svg.append(draw('line', { x1: 0, x2: WIDTH, y1: y(mark), y2: y(mark), class: 'mark' }));
  lines.forEach(({ values, leaps }, k) => {
    let path = '';
    values.forEach((value, i) => {
      const jumps = i === 0 || (leaps && Math.abs(value - values[i - 1]) > leaps);
      path += `${jumps ? 'M' : 'L'}${x(i, values.length).toFixed(1)} ${y(value).toFixed(1)}`;
    });
    svg.append(draw('path', { d: path, class: `curve c${k}` }));
  });
  const now = draw('line', { class: 'now', y1: 0, y2: HEIGHT, x1: -9, x2: -9 });
  svg.append(now);
  return { svg, now };
}

const legend = (names) => make('ul', { className: 'keys' }, ...names.map((name, k) => make('li', { className: `c${k}` }, name, make('output'))));

export class RotationPanel {
  constructor(panel, { viewport, animation, timeline }) {
    Object.assign(this, { viewport, animation, timeline });
    this.panel = panel;
    this.content = make('div');
    panel.append(make('h2', {}, 'Rotation'), this.content);
    this.ghosts = [];
    viewport.onFrame.push(() => this.poseGhosts());
    watch((names) => {
      if (names.has('node') || names.has('order')) this.open();
      else if (names.has('ghosts')) this.makeGhosts();
      if (names.has('tab') && !this.data) this.open();
    });
  }

  /** Shows the selected node in the animation's clip. */
  async open() {
    this.controller?.abort();
    this.clearGhosts();
    this.data = null;
    const { model, clip } = this.animation;
    if (!clip) {
      this.content.replaceChildren(make('p', { className: 'dim' }, 'This model has no clip. A clip’s rotation tracks are shown here as curves.'));
      return;
    }
    if (state('tab') !== 'animation' && state('ghosts') === 'off') return;
    const { signal } = (this.controller = new AbortController());
    try {
      const { tracks } = await this.timeline.tracksOf;
      if (signal.aborted) return;
      if (tracks.length === 0) {
        this.content.replaceChildren(make('p', { className: 'dim' }, 'This clip turns no node.'));
        return;
      }
      const track = tracks.find(({ node }) => node === state('node')) ?? tracks[0];
      this.data = await this.ask(model, clip, track, signal);
      if (signal.aborted) return;
      this.render(tracks, track);
      this.makeGhosts();
      this.tick(this.animation.time ?? 0);
    } catch (error) {
      if (!signal.aborted) fail('The rotation cannot be shown', error);
    }
  }

  async ask(model, clip, track, signal) {
    const order = state('order');
    const span = clip.duration > 0 ? { from: 0, to: clip.duration, fps: (SAMPLES - 1) / clip.duration } : { at: 0 };
    const common = { clip: clip.name, nodes: [track.node] };
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
    return {
      node: track.node, order, times, slerp,
      quaternion: [0, 1, 2, 3].map((k) => column(path, 'rotation', k)),
      eulers,
      distance: eulers[middle].map((angle) => Math.abs(Math.cos(MathUtils.degToRad(angle)))),
      keys: times.map((_, i) => [...keys.part(i, 0, 'euler')]),
    };
  }

  render(tracks, track) {
    const { quaternion, eulers, distance, order } = this.data;
    const nodes = tracks.map(({ node }) => [node, node]);
    const high = Math.max(180, ...eulers.flat().map((angle) => Math.abs(angle)));
    const q = chart(`Quaternion components of ${track.node}`, quaternion.map((values) => ({ values })), [-1, 1], [0]);
    const e = chart(`Euler angles of ${track.node} in order ${order}`, eulers.map((values) => ({ values, leaps: 180 })), [-high, high], [-180, -90, 0, 90, 180]);
    this.nows = [q.now, e.now];
    this.legends = [legend(['x', 'y', 'z', 'w']), legend(['x', 'y', 'z'])];
    this.band = this.drawBand(distance);
    const nearest = Math.min(...distance);
    const least = Math.min(nearest, track.orders[order] ?? 1); // the samples of the curve may miss the minimum
    const at = (distance.indexOf(nearest) / Math.max(distance.length - 1, 1)) * this.animation.duration;
    const verdict = least < LOCKED ? 'locks' : least < NEAR ? 'comes near lock' : 'stays clear of lock';
    this.lockNow = make('output', { className: 'value' });
    const offersBetter = track.best_order !== order && (track.orders[track.best_order] ?? 0) > (track.orders[order] ?? 0) + 0.01;
    this.content.replaceChildren(
      make('div', { className: 'fields' },
        choice('Node', nodes, track.node, (node) => change({ node })),
        choice('Euler order', ORDERS.map((name) => [name, name]), order, (next) => change({ order: next }))),
      make('h3', {}, 'Quaternion'), q.svg, this.legends[0],
      make('h3', {}, `Euler angles, ${order}, degrees`), e.svg, this.legends[1],
      make('h3', {}, 'Distance from gimbal lock', this.lockNow), this.band.svg,
      make('p', { className: least < LOCKED ? 'verdict locked' : 'verdict' },
        make('strong', {}, `${order} ${verdict}`), `: least ${least.toFixed(3)} at ${at.toFixed(2)} s. `,
        'It is the cosine of the middle angle; near 0 the outer two axes turn about one line, and angles leap.'),
      offersBetter
        ? make('button', { type: 'button', className: 'wide', onclick: () => change({ order: track.best_order }) },
          `Use ${track.best_order}, which stays ${track.orders[track.best_order].toFixed(2)} away`)
        : make('p', { className: 'dim' }, `No order does better than ${order} here.`),
      make('h3', {}, 'Ghosts'),
      make('div', { className: 'fields one' }, choice('Shown', [['off', 'None'], ['both', 'Slerp and Euler'], ['slerp', 'Slerp'], ['euler', 'Euler angles, key to key']],
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
    const svg = draw('svg', { viewBox: `0 0 ${WIDTH} 16`, class: 'band', preserveAspectRatio: 'none', role: 'img', 'aria-label': 'Distance from gimbal lock over the clip' });
    const calm = new Color('#8fa3b8');
    const [warn, stop] = [new Color('#e0a33d'), new Color('#d92d20')];
    distance.forEach((value, i) => {
      const colour = value > NEAR ? calm.clone().lerp(warn, Math.max(0, 1 - (value - NEAR) / 0.3))
        : value > LOCKED ? warn.clone().lerp(stop, (NEAR - value) / (NEAR - LOCKED)) : stop;
      svg.append(draw('rect', { x: (i / distance.length) * WIDTH, y: 0, width: WIDTH / distance.length + 0.5, height: 16,
        fill: `#${colour.getHexString()}`, 'data-locked': value < LOCKED }));
    });
    const now = draw('line', { class: 'now', y1: 0, y2: 16 });
    svg.append(now);
    this.nows.push(now);
    return { svg };
  }

  /** Moves the marks to the present time, and shows the values there. */
  tick(time) {
    if (!this.data || state('tab') !== 'animation') return;
    const { quaternion, eulers, distance } = this.data;
    const part = this.animation.duration > 0 ? time / this.animation.duration : 0;
    const i = Math.round(part * (distance.length - 1));
    for (const now of this.nows) for (const end of ['x1', 'x2']) now.setAttribute(end, part * WIDTH);
    const say = (list, columns, digits) => list.querySelectorAll('output').forEach((output, k) => (output.textContent = fixed(columns[k][i], digits)));
    say(this.legends[0], quaternion, 3);
    say(this.legends[1], eulers, 1);
    this.lockNow.textContent = distance[i].toFixed(3);
    this.lockNow.classList.toggle('locked', distance[i] < LOCKED);
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
      const rotation = kind === 'slerp' ? this.slerped(this.animation.time ?? 0) : this.eulered(this.animation.time ?? 0);
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

  eulered(time) {
    const { times, keys, order } = this.data;
    let i = times.findIndex((key) => key > time) - 1;
    if (i === -2) i = times.length - 1;
    const [a, b] = [keys[Math.max(i, 0)], keys[Math.min(i + 1, keys.length - 1)]];
    const span = times[i + 1] - times[i];
    const t = span > 0 ? (time - times[i]) / span : 0;
    const angles = a.map((angle, k) => MathUtils.degToRad(angle + (b[k] - angle) * t));
    return new Quaternion().setFromEuler(new Euler(...angles, order));
  }
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
