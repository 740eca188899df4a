// The panel for sculpting: dragging a point of the surface moves the points around it softly. The daemon stores the
// move as details of the shown level; all other levels follow.
import {
  Box3, BufferGeometry, Float32BufferAttribute, Group, LineBasicMaterial, LineLoop, Matrix3, Plane, Points, PointsMaterial, Raycaster, Vector2, Vector3,
} from 'three';

import { Brush, Grip } from './brush.js';
import { tweend, withKey } from './client.js';
import { choice, fixed, make } from './dom.js';
import { fieldsOf } from './edit_panel.js';
import { meshName, stemOf } from './models.js';
import { busy, fail, OneAtATime } from './notices.js';
import { change, firstOf, isStep, state, watch } from './state.js';

const RULES = ['scheme', 'boundary', 'creases', 'limit', 'encoding', 'details']; // points can be sent only while these have their default values
const COLOUR = 0xf08a00;
const MESSAGE = { color: COLOUR, depthTest: false, transparent: true };
const ROUND = Array.from({ length: 64 }, (_, i) => [Math.cos((i * Math.PI) / 32), Math.sin((i * Math.PI) / 32), 0]);

/** Marks the brush: a dot at its centre, and a ring of its radius. */
function makeMarker() {
  const dot = new Points(new BufferGeometry().setAttribute('position', new Float32BufferAttribute([0, 0, 0], 3)),
    new PointsMaterial({ ...MESSAGE, size: 9, sizeAttenuation: false }));
  const ring = new LineLoop(new BufferGeometry().setAttribute('position', new Float32BufferAttribute(ROUND.flat(), 3)), new LineBasicMaterial(MESSAGE));
  const marker = new Group().add(dot, ring);
  for (const part of marker.children) part.renderOrder = 4;
  marker.visible = false;
  return marker;
}

/** Moves points of a mesh by a stroke in its space. */
function moved(points, { brush, by }) {
  const place = new Vector3();
  for (let i = 0; i < points.length; i += 3) {
    const pull = brush.at(place.fromArray(points, i));
    if (pull) place.fromArray(points, i).addScaledVector(by, pull.part).toArray(points, i);
  }
  return points;
}

export class SculptPanel {
  /** models: the list that new models are added to. steps: of the lineage. levelSlider: an element. */
  constructor(panel, { viewport, models, steps, levelSlider }) {
    Object.assign(this, { viewport, models, steps, bearers: [], picked: null, wanted: { index: -1 }, stroke: null, size: 0, picking: Promise.resolve() });
    this.requests = new OneAtATime();
    this.marker = makeMarker();
    viewport.own.add(this.marker);
    viewport.onFrame.push(() => this.#mark());

    this.reach = make('input', { type: 'range', min: 1, max: 100, value: 25, 'aria-label': 'Radius', oninput: () => this.showRadius() });
    this.length = make('output', { className: 'value' });
    this.along = 'plane';
    this.point = make('input', { type: 'text', inputMode: 'numeric', 'aria-label': 'Point', autocomplete: 'off', onchange: () => this.pickNumber(() => Number(this.point.value)) });
    this.said = make('p', { className: 'dim', role: 'status' });
    this.details = make('input', { type: 'checkbox', onchange: () => change({ details: this.details.checked }) });
    const row = (text, about, parameters, vector) => {
      const use = () => {
        const values = read();
        if (values) this.moveBy(() => vector(values));
      };
      const { labels, read } = fieldsOf(parameters, about, use);
      return make('div', { className: 'edit' }, make('button', { type: 'button', onclick: use }, text), ...labels);
    };
    this.rules = make('p', { className: 'warning' }, 'Only a surface by the usual rules, with its details, can be sculpted. ',
      make('button', { type: 'button', className: 'small', onclick: () => change(firstOf(RULES)) }, 'Show it so'));
    this.body = make('div', {},
      make('div', { className: 'slider' }, make('span', {}, 'Radius'), this.reach, this.length),
      choice('A drag moves', [['plane', 'In the plane of the picture'], ['normal', 'Along the normal (or with Shift)']], 'plane', (along) => (this.along = along)),
      make('h3', {}, 'Point'), this.point, this.said,
      make('div', { className: 'edits' },
        row('Move', 'Stroke', { by: [0, 0.1, 0] }, ({ by }) => new Vector3(...by)),
        row('Push', 'Push', { distance: 0.1 }, ({ distance }) => this.normal.multiplyScalar(distance))));
    panel.append(
      make('h2', {}, 'Sculpt'),
      make('p', { className: 'dim' }, 'Drag the surface: its level takes the new places, all other levels follow.'),
      levelSlider,
      make('label', { className: 'check' }, this.details, make('span', {}, 'Details of the levels')),
      this.rules, this.body);

    const { canvas } = viewport;
    canvas.addEventListener('pointerdown', (event) => this.#down(event), { capture: true }); // called before the camera's listener
    canvas.addEventListener('pointermove', (event) => this.#drag(event));
    canvas.addEventListener('pointerup', () => this.#up());
    canvas.addEventListener('pointercancel', () => this.#drop());
    canvas.addEventListener('keydown', (event) => this.#key(event));
    watch((names) => {
      if (names.has('model')) this.close();
      if (names.has('tab') || RULES.some((name) => names.has(name))) this.show();
    });
    this.show();
  }

  // ---- the surface ----

  get isOn() {
    return state('tab') === 'sculpt' && this.bearers.length > 0 && this.isUsual;
  }

  get isUsual() {
    return Object.entries(firstOf(RULES)).every(([name, value]) => state(name) === value);
  }

  show() {
    this.details.checked = state('details') === 'true';
    this.details.disabled = this.details.checked && !this.model?.meshes.some(({ details }) => details.length > 0);
    this.rules.hidden = this.isUsual;
    this.body.hidden = !this.isUsual;
    this.viewport.canvas.toggleAttribute('data-sculpts', this.isOn);
    this.viewport.invalidate();
  }

  close() {
    this.stroke = null;
    if (!isStep()) Object.assign(this, { picked: null, wanted: { index: -1 } });
    this.bearers = [];
    this.show();
  }

  /** Takes over the surface of a level that the viewport now shows. */
  open(model, { scene, bearers }, level) {
    Object.assign(this, { model, level, stroke: null });
    this.bearers = bearers.map(([object, mesh]) => {
      const parts = [];
      object.traverse((part) => part.userData.own && !part.isSkinnedMesh && parts.push(part));
      return { object, mesh, parts };
    });
    this.size = new Box3().setFromObject(scene, true).getSize(new Vector3()).length() / 2;
    this.points = new Map(); // of meshes, as they come
    this.point.value = '';
    this.showRadius();
    this.pick(this.wanted.index, this.wanted.place);
    this.show();
  }

  /** The points of a bearer's mesh; loaded when first needed. */
  async pointsOf({ mesh }) {
    const options = { level: this.level, mesh: meshName(this.model, mesh), normals: 'none', quads: state('quads') };
    if (!this.points.has(mesh)) this.points.set(mesh, withKey(() => tweend.points(this.model, options)));
    return (await this.points.get(mesh)).slice();
  }

  // ---- the point ----

  get radius() {
    return (this.size * Number(this.reach.value)) / 100;
  }

  showRadius() {
    this.length.textContent = Number(this.radius.toPrecision(2));
    this.viewport.invalidate();
  }

  /** Puts the brush on the point of a bearer that is nearest to a place in its space. index -1: no point. */
  pick(index, place) {
    let nearest = Infinity;
    const at = new Vector3();
    this.picked = null;
    this.wanted = { index, place }; // so that changing the level does not move the brush
    for (const { geometry: { attributes: { position, normal } } } of this.bearers[index]?.parts ?? [])
      for (let i = 0; i < position.count; i++) {
        const distance = at.fromBufferAttribute(position, i).distanceToSquared(place);
        if (distance >= nearest) continue;
        nearest = distance;
        this.picked = { index, centre: at.clone(), normal: new Vector3().fromBufferAttribute(normal, i) };
      }
    const hint = this.bearers.length > 0 && this.bearers.every(({ parts }) => parts.length === 0) ? 'Meshes with a skin cannot be sculpted here.' : 'Click a point; N and P step through them.';
    this.say(this.picked ? `A point at ${this.#at().toArray().map((value) => fixed(value, 3)).join(', ')}` : hint);
    this.viewport.invalidate();
  }

  say(text) {
    this.said.textContent = text;
  }

  /** The world position of the picked point. */
  #at() {
    const { index, centre } = this.picked;
    const { object } = this.bearers[index];
    return object.localToWorld(centre.clone().add(this.stroke?.by ?? new Vector3()));
  }

  #mark() {
    this.marker.visible = this.isOn && this.picked !== null;
    if (!this.marker.visible) return;
    this.marker.position.copy(this.#at());
    this.marker.quaternion.copy(this.viewport.camera.quaternion);
    this.marker.scale.setScalar(this.radius);
  }

  /** The surface normal at the picked point, in world space. */
  get normal() {
    const { index, normal } = this.picked;
    return normal.clone().applyMatrix3(new Matrix3().getNormalMatrix(this.bearers[index].object.matrixWorld)).normalize();
  }

  /** Picks a point by its index in the mesh, which numberOf(points) returns. */
  pickNumber(numberOf) {
    this.picking = this.picking.then(() => this.#pickNumber(numberOf)); // keys may come faster than points
    return this.picking;
  }

  async #pickNumber(numberOf) {
    const index = this.picked?.index ?? 0;
    if (!this.isOn) return;
    try {
      const bearer = this.bearers[index];
      const points = await this.pointsOf(bearer);
      if (this.bearers[index] !== bearer) return;
      const count = points.length / 3;
      const number = ((Math.round(numberOf(points)) % count) + count) % count || 0;
      this.pick(index, new Vector3().fromArray(points, 3 * number));
      this.point.value = number;
    } catch (error) {
      fail('The points cannot be loaded', error);
    }
  }

  /** The index of the picked point; -1 without one. */
  #numberIn(points) {
    if (this.point.value !== '') return Number(this.point.value); // tells apart points at the same place
    if (!this.picked) return -1;
    const place = this.picked.centre;
    const at = new Vector3();
    let [nearest, number] = [Infinity, -1];
    for (let i = 0; i < points.length / 3; i++) {
      const distance = at.fromArray(points, 3 * i).distanceToSquared(place);
      if (distance < nearest) [nearest, number] = [distance, i];
    }
    return number;
  }

  /** N and P pick the next and the previous point. */
  #key(event) {
    if (event.key === 'Escape') return this.#drop();
    const by = { n: 1, p: -1 }[event.key];
    if (!by || !this.isOn || event.ctrlKey || event.metaKey || event.altKey) return undefined;
    event.preventDefault();
    return this.pickNumber((points) => this.#numberIn(points) + by);
  }

  // ---- strokes ----

  /** A raycaster through a place of the window. */
  #aim({ clientX, clientY }) {
    const box = this.viewport.canvas.getBoundingClientRect();
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2(((clientX - box.left) / box.width) * 2 - 1, 1 - ((clientY - box.top) / box.height) * 2), this.viewport.camera);
    return caster;
  }

  #down(event) {
    if (this.stroke?.drag) return this.#drop(); // a second finger: the two move the camera
    if (!this.isOn || event.button !== 0 || this.viewport.isBeside(event.clientX)) return undefined;
    const caster = this.#aim(event);
    const hits = this.bearers.flatMap(({ parts }, index) => caster.intersectObjects(parts, false).map((hit) => ({ ...hit, index })));
    if (hits.length === 0) return undefined;
    this.#holdCamera(true);
    if (this.requests.isRunning) return undefined;
    const { index, point } = hits.sort((a, b) => a.distance - b.distance)[0];
    this.point.value = '';
    this.pick(index, this.bearers[index].object.worldToLocal(point.clone()));
    this.#begin();
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.viewport.camera.getWorldDirection(new Vector3()), this.#at());
    this.stroke.drag = { plane, from: caster.ray.intersectPlane(plane, new Vector3()) };
    return undefined;
  }

  /** During a stroke, one finger or the left button does not move the camera. */
  #holdCamera(isHeld) {
    this.viewport.controls.enableRotate = !isHeld;
    this.viewport.controls.enablePan = !isHeld;
  }

  #begin() {
    const { object, parts } = this.bearers[this.picked.index];
    const brush = new Brush(this.picked.centre, object.matrixWorld, this.radius);
    this.stroke = { brush, by: new Vector3(), grips: parts.map(({ geometry }) => new Grip(geometry, brush)) };
    this.pointsOf(this.bearers[this.picked.index]).catch(() => {}); // errors reach the call that needs the points
  }

  /** Moves the points under the brush by a world vector. */
  #move(by) {
    const { object } = this.bearers[this.picked.index];
    this.stroke.by = by.clone().applyMatrix3(new Matrix3().setFromMatrix4(object.matrixWorld).invert());
    for (const grip of this.stroke.grips) grip.move(this.stroke.by);
    this.viewport.invalidate();
  }

  #drag(event) {
    if (!this.stroke?.drag) return;
    const { plane, from } = this.stroke.drag;
    const by = this.#aim(event).ray.intersectPlane(plane, new Vector3())?.sub(from);
    if (!by) return;
    const up = new Vector3(0, 1, 0).transformDirection(this.viewport.camera.matrixWorld);
    this.#move(this.along === 'normal' || event.shiftKey ? this.normal.multiplyScalar(by.dot(up)) : by);
  }

  #up() {
    this.#holdCamera(false);
    if (!this.stroke?.drag) return undefined;
    return this.stroke.by.lengthSq() > 0 ? this.#finish() : this.#drop();
  }

  /** Cancels the stroke: moves the points back. */
  #drop() {
    this.#holdCamera(false);
    if (!this.stroke || this.requests.isRunning) return;
    for (const grip of this.stroke.grips) grip.move(new Vector3());
    this.stroke = null;
    this.viewport.invalidate();
  }

  /** Makes a stroke by numbers. vector(): how far the picked point moves. */
  async moveBy(vector) {
    await this.picking; // a number that was just typed, while its points are still coming
    if (this.requests.isRunning) return undefined;
    if (!this.picked) return this.say('Pick a point first.');
    this.#begin();
    this.#move(vector());
    return this.#finish();
  }

  /** Sends the points as the stroke left them, and shows the model that the daemon makes. */
  async #finish() {
    const { stroke, picked, model, level } = this;
    stroke.drag = null;
    const controller = new AbortController();
    const task = busy(`Level ${level}: keeping the stroke`, controller);
    const isDone = await this.requests.run(async () => {
      const { mesh } = this.bearers[picked.index];
      const points = moved(await this.pointsOf(this.bearers[picked.index]), stroke);
      const made = await tweend.sculpt(model, points, { level, mesh: meshName(model, mesh), name: `${stemOf(model)}, sculpted`, quads: state('quads'), signal: controller.signal });
      await this.models.load();
      if (this.stroke !== stroke) return; // another model was opened meanwhile
      this.stroke = null;
      this.wanted = { index: picked.index, place: picked.centre.add(stroke.by) };
      this.steps.go({ model: made.id, from: '', edits: '', quads: 'auto' }); // the new model has its polygons
    });
    task.done();
    if (!isDone) this.#drop();
  }
}
