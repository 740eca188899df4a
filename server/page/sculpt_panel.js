// The panel for sculpting: strokes of a brush move points of the surface. The daemon stores them as details of the shown
// level; all other levels follow. A stroke may begin while those before it are being stored, and end before its points are
// there. Nothing that happens meanwhile loses one: another level waits for the hand, and what another model leaves behind is
// stored as a version of its own model.
import { Box3, Group, LineBasicMaterial, LineLoop, Matrix3, Plane, Points, PointsMaterial, Vector3 } from 'three';

import { apply, Brush, BRUSHES, grab, turnedBy } from './brush.js';
import { tweend, withKey } from './client.js';
import { check, chips, choice, fixed, make, press, slider } from './dom.js';
import { fieldsOf } from './fields.js';
import { meshName, stemOf } from './models.js';
import { busy, fail, marked, mayPass, tell } from './notices.js';
import { geometryOf, THROUGH } from './overlays.js';
import { boxesOf, hitsOn } from './ray_hits.js';
import { SculptMesh } from './sculpt_mesh.js';
import { change, firstOf, isStep, state, watch } from './state.js';

const RULES = ['scheme', 'boundary', 'creases', 'limit', 'encoding', 'details']; // points can be sent only while these have their default values
const TOOLS = [['grab', 'Grab'], ['draw', 'Draw'], ['smooth', 'Smooth'], ['inflate', 'Inflate'], ['flatten', 'Flatten'], ['crease', 'Crease']];
const HINTS = {
  grab: 'Drag a point; with Shift it goes along its normal.', draw: 'Drag to raise the surface; with Ctrl to lower it.',
  smooth: 'Drag over bumps.', inflate: 'Drag to blow up what is under the brush; with Ctrl to shrink it.',
  flatten: 'Drag to make a plane.', crease: 'Drag along a fold; with Ctrl along a ridge.',
};
const SPACING = 0.25; // of the radius, between two dabs of a stroke
const MIRRORS = { x: [-1, 1, 1], y: [1, -1, 1], z: [1, 1, -1] };
const COLOUR = 0xf08a00;
const LOOK = { color: COLOUR, ...THROUGH };
const ROUND = Array.from({ length: 64 }, (_, i) => [Math.cos((i * Math.PI) / 32), Math.sin((i * Math.PI) / 32), 0]);

/** Marks the brush: a dot at its centre, and a ring of its radius. */
function makeMarker() {
  const dot = new Points(geometryOf([0, 0, 0]), new PointsMaterial({ ...LOOK, size: 9, sizeAttenuation: false }));
  const ring = new LineLoop(geometryOf(ROUND.flat()), new LineBasicMaterial(LOOK));
  const marker = new Group().add(dot, ring);
  for (const part of marker.children) part.renderOrder = 4;
  marker.visible = false;
  return marker;
}

export class SculptPanel {
  /** models: the list that new models are added to. steps: of the lineage. levelSlider: an element. */
  constructor(panel, { viewport, models, steps, levelSlider }) {
    Object.assign(this, { viewport, models, steps, bearers: [], picked: null, wanted: { index: -1 }, stroke: null, picking: Promise.resolve() });
    this.hands = new Set(); // strokes from the press of the button on, until they are in the queue or dropped
    this.free = []; // called when none is left, and none is being stored
    this.work = this.#begun();
    this.marker = makeMarker();
    viewport.own.add(this.marker);
    viewport.onFrame.push(() => this.#mark());

    this.tools = chips(TOOLS, (name) => this.use(name));
    this.hint = make('p', { className: 'dim' });
    this.reach = make('input', { type: 'range', min: 1, max: 100, value: 25, 'aria-label': 'Radius', oninput: () => this.showRadius() });
    this.length = make('output', { className: 'value' });
    this.strength = make('input', { type: 'range', min: 1, max: 100, value: 50, 'aria-label': 'Strength', oninput: () => (this.force.textContent = `${this.strength.value} %`) });
    this.force = make('output', { className: 'value' }, '50 %');
    this.forces = slider('Strength', this.strength, this.force);
    this.along = 'plane';
    this.ways = choice('A drag moves', [['plane', 'In the plane of the picture'], ['normal', 'Along the normal (or with Shift)']], 'plane', (along) => (this.along = along));
    this.mirror = '';
    this.point = make('input', { type: 'text', inputMode: 'numeric', 'aria-label': 'Point', autocomplete: 'off', onchange: () => this.pickNumber(() => Number(this.point.value)) });
    this.said = make('p', { className: 'dim', role: 'status' });
    this.details = make('input', { type: 'checkbox', onchange: () => change({ details: this.details.checked }) });
    const row = (text, about, parameters, vector) => {
      const use = () => {
        const values = read();
        if (values) this.moveBy(() => vector(values));
      };
      const { labels, read } = fieldsOf(parameters, about, use);
      return make('div', { className: 'edit' }, make('button', { onclick: use }, text), ...labels);
    };
    this.rules = make('p', { className: 'warning' }, 'Only a surface by the usual rules, with its details, can be sculpted. ',
      make('button', { className: 'small', onclick: () => change(firstOf(RULES)) }, 'Show it so'));
    this.levels = make('div', {}, make('p', { className: 'dim' }, 'Drag the surface: its level takes the new places, all other levels follow.'),
      levelSlider, check(this.details, 'Details of the levels'));
    this.unfit = make('p', { className: 'dim' });
    this.body = make('div', {},
      make('div', { className: 'row brushes', role: 'group', 'aria-label': 'Brush' }, ...this.tools), this.hint,
      slider('Radius', this.reach, this.length), this.forces,
      make('div', { className: 'fields one' }, this.ways,
        choice('Symmetry', [['', 'None'], ['x', 'Left and right (X)'], ['y', 'Up and down (Y)'], ['z', 'Front and back (Z)']], '', (axis) => (this.mirror = axis))),
      make('h3', {}, 'Point'), this.point, this.said,
      make('div', { className: 'edits' },
        row('Move', 'Stroke', { by: [0, 0.1, 0] }, ({ by }) => new Vector3(...by)),
        row('Push', 'Push', { distance: 0.1 }, ({ distance }) => this.normal.multiplyScalar(distance))));
    panel.append(make('h2', {}, 'Sculpt'), this.levels, this.unfit, this.rules, this.body);

    const { canvas } = viewport;
    canvas.addEventListener('pointerdown', (event) => this.#down(event), { capture: true }); // called before the camera's listener
    canvas.addEventListener('pointermove', (event) => this.#drag(event));
    canvas.addEventListener('pointerup', () => this.#up());
    canvas.addEventListener('pointercancel', () => this.#drop());
    canvas.addEventListener('pointerleave', () => this.#hover(null));
    canvas.addEventListener('wheel', (event) => this.#wheel(event), { capture: true, passive: false });
    canvas.addEventListener('keydown', (event) => this.#key(event));
    watch((names) => {
      if (names.has('model')) this.close();
      if (names.has('tab') || RULES.some((name) => names.has(name))) this.show();
    });
    this.use('grab');
    this.leave();
  }

  use(tool) {
    this.tool = tool;
    press(this.tools, (name) => name === tool);
    this.hint.textContent = HINTS[tool];
    this.forces.hidden = tool === 'grab';
    this.ways.hidden = tool !== 'grab';
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
    const isFit = this.unfit.textContent === '';
    this.unfit.hidden = isFit;
    this.levels.hidden = !isFit;
    this.rules.hidden = !isFit || this.isUsual;
    this.body.hidden = !isFit || !this.isUsual;
    this.viewport.canvas.toggleAttribute('data-sculpts', this.isOn);
    if (this.isOn) this.showRadius();
    for (const bearer of this.isOn ? this.bearers : []) this.meshOf(bearer).catch(() => {}); // errors reach the stroke that needs it
    this.viewport.invalidate();
  }

  /** Strokes of one model: queue: those that wait to be stored; stored: steps that are stored, but not shown yet. */
  #begun() {
    return { model: null, queue: [], stored: [], isStoring: false };
  }

  /** What is not stored yet of the model before is stored beside the one that comes. */
  close() {
    if (this.#isMoved) this.#finish();
    else if (this.work.queue.length > 0) this.#store();
    this.#holdCamera(false);
    this.hands.delete(this.stroke?.held);
    this.held = this.stroke = this.hovered = null;
    this.work = this.#begun();
    this.#tellFree();
    if (!isStep()) Object.assign(this, { picked: null, wanted: { index: -1 } });
    this.bearers = [];
    this.show();
  }

  /** Shows that there is no surface. */
  leave() {
    this.unfit.textContent = 'Open a model, or make a shape.';
    this.show();
  }

  /** Takes over the surface of a level that the viewport now shows. */
  open(model, { scene, bearers }, level) {
    Object.assign(this, { model, level, scene, size: null, hovered: null });
    this.work.model = model;
    this.bearers = bearers.map(([object, mesh]) => {
      const parts = [];
      object.traverse((part) => part.userData.own && !part.isSkinnedMesh && parts.push(part));
      return { object, mesh, parts };
    });
    const isRigid = this.bearers.some(({ parts }) => parts.length > 0);
    this.unfit.textContent = isRigid ? '' : this.bearers.length > 0 ? 'Meshes with a skin cannot be sculpted here.' : 'This model has no surface.';
    this.meshes = new Map(); // SculptMesh by index, as they come
    this.loaded = new Map(); // those that are there
    this.point.value = '';
    this.pick(this.wanted.index, this.wanted.place);
    this.show();
  }

  /** The points of a bearer's mesh; loaded when first needed. */
  meshOf({ mesh }) {
    const { meshes, loaded, bearers } = this;
    const load = async () => {
      const options = { level: this.level, mesh: meshName(this.model, mesh), quads: state('quads') };
      const points = await withKey(() => tweend.points(this.model, options));
      const geometries = bearers.filter((bearer) => bearer.mesh === mesh).flatMap(({ parts }) => parts.map(({ geometry }) => geometry));
      loaded.set(mesh, new SculptMesh(points, geometries));
      geometries.forEach(boxesOf);
      return loaded.get(mesh);
    };
    if (!meshes.has(mesh)) meshes.set(mesh, marked(load()).catch((error) => {
      meshes.delete(mesh); // they are asked for again by the next stroke
      throw error;
    }));
    return meshes.get(mesh);
  }

  // ---- the point ----

  get radius() {
    if (!this.scene) return 0;
    this.size ??= new Box3().setFromObject(this.scene, true).getSize(new Vector3()).length() / 2;
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
    this.say(this.picked ? `A point at ${this.#at().toArray().map((value) => fixed(value, 3)).join(', ')}` : 'Click a point; N and P step through them.');
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
    const place = this.stroke?.dabbed ?? this.hovered ?? (this.picked && this.bearers[this.picked.index] ? this.#at() : null);
    this.marker.visible = this.isOn && place !== null;
    if (!this.marker.visible) return;
    this.marker.position.copy(place);
    this.marker.quaternion.copy(this.viewport.camera.quaternion);
    this.marker.scale.setScalar(this.radius);
  }

  /** The surface normal at the picked point, in world space. */
  get normal() {
    const { index, normal } = this.picked;
    return normal.clone().applyMatrix3(new Matrix3().getNormalMatrix(this.bearers[index].object.matrixWorld)).normalize();
  }

  /** Picks a point by its index in the mesh, which numberOf(mesh) returns. */
  pickNumber(numberOf) {
    this.picking = marked(this.picking.then(() => this.#pickNumber(numberOf))); // keys may come faster than points
    return this.picking;
  }

  async #pickNumber(numberOf) {
    const index = this.picked?.index ?? 0;
    if (!this.isOn) return;
    try {
      const bearer = this.bearers[index];
      const mesh = await this.meshOf(bearer);
      if (this.bearers[index] !== bearer) return;
      const count = mesh.points.length / 3;
      const number = ((Math.round(numberOf(mesh)) % count) + count) % count || 0;
      this.pick(index, mesh.at(number, new Vector3()));
      this.point.value = number;
    } catch (error) {
      fail('The points cannot be loaded', error);
    }
  }

  /** The index of the picked point; -1 without one. */
  #numberIn(mesh) {
    if (this.point.value !== '') return Number(this.point.value); // tells apart points at the same place
    return this.picked ? mesh.nearest(this.picked.centre) : -1;
  }

  /** N and P pick the next and the previous point; brackets change the radius. */
  #key(event) {
    if (event.key === 'Escape') return this.#drop();
    if (!this.isOn || event.ctrlKey || event.metaKey || event.altKey) return undefined;
    if (event.key === '[' || event.key === ']') return this.#widen(event.key === ']' ? 1 : -1);
    const by = { n: 1, p: -1 }[event.key];
    if (!by) return undefined;
    event.preventDefault();
    return this.pickNumber((mesh) => this.#numberIn(mesh) + by);
  }

  /** The wheel changes the radius with Shift, and during a stroke. */
  #wheel(event) {
    const by = event.deltaY || event.deltaX;
    if (!this.isOn || !by || (!event.shiftKey && !this.stroke)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    this.#widen(by < 0 ? 1 : -1);
  }

  #widen(by) {
    this.reach.value = Math.round(Number(this.reach.value) * 1.12 ** by + by / 2);
    this.showRadius();
  }

  // ---- strokes ----

  /** The nearest place of the surface under the pointer: {index: of the bearer, point, face}. */
  #hit(event, caster = this.viewport.rayAt(event)) {
    const hits = this.bearers.flatMap(({ parts }, index) => parts.flatMap((part) => hitsOn(part, caster)).map((hit) => ({ ...hit, index })));
    return hits.sort((a, b) => a.distance - b.distance)[0];
  }

  #hover(event) {
    const next = event && this.tool !== 'grab' ? this.#hit(event)?.point ?? null : null;
    if (next === this.hovered) return;
    this.hovered = next;
    this.viewport.invalidate();
  }

  /** What the hand does before the points are there is done when they are. */
  async #down(event) {
    if (this.held?.isDown) return this.#drop(); // a second finger: the two move the camera
    if (!this.isOn || event.button !== 0 || this.viewport.isBeside(event.clientX)) return undefined;
    const caster = this.viewport.rayAt(event);
    const hit = this.#hit(event, caster);
    if (!hit) return undefined;
    this.#holdCamera(true);
    const bearer = this.bearers[hit.index];
    this.point.value = '';
    this.pick(hit.index, bearer.object.worldToLocal(hit.point.clone()));
    const { picked, tool } = this;
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.viewport.camera.getWorldDirection(new Vector3()), this.#at());
    const held = (this.held = { isDown: true, moves: [] });
    this.hands.add(held);
    const mesh = this.loaded.get(bearer.mesh) ?? (await this.meshOf(bearer).catch((error) => fail('The points cannot be loaded', error)));
    if (!this.hands.has(held)) return undefined; // it was dropped
    if (!mesh || this.bearers[hit.index] !== bearer) {
      if (mesh && (tool !== 'grab' || held.moves.length > 0)) tell('The stroke is not kept', make('p', {}, 'Another model was opened before its points were there.'));
      return this.#letGo(held);
    }
    this.picked = picked; // another stroke may have begun meanwhile
    this.#begin(mesh, tool);
    this.stroke.held = held;
    this.stroke.drag = { plane, from: caster.ray.intersectPlane(plane, new Vector3()) };
    if (tool !== 'grab') this.#dab(event, hit);
    for (const move of held.moves) this.#drag(...move);
    if (!held.isDown) this.#end();
    return undefined;
  }

  /** A stroke has ended: it is in the queue, or dropped. */
  #letGo(held) {
    this.hands.delete(held);
    this.#tellFree();
  }

  /** Those who wait for the strokes may go on. */
  #tellFree() {
    if (this.hands.size === 0 && !this.work.isStoring) for (const goOn of this.free.splice(0)) goOn();
  }

  /** Resolves when no hand is at a stroke, and none is being stored. */
  async settled() {
    while (this.hands.size > 0 || this.work.isStoring) await new Promise((resolve) => this.free.push(resolve));
  }

  /** During a stroke, one finger or the left button does not move the camera. */
  #holdCamera(isHeld) {
    this.viewport.controls.enableRotate = !isHeld;
    this.viewport.controls.enablePan = !isHeld;
    if (!isHeld && this.held) this.held.isDown = false;
  }

  /** The brush at a place of an object, and its mirror image. */
  #brushes(centre, { matrixWorld }) {
    const images = [[1, 1, 1], ...(this.mirror ? [MIRRORS[this.mirror]] : [])];
    return images.map((signs) => ({ brush: new Brush(centre.clone().multiply(new Vector3(...signs)), matrixWorld, this.radius), signs: new Vector3(...signs) }));
  }

  #begin(mesh, tool = 'grab') {
    const { object } = this.bearers[this.picked.index];
    const held = this.#brushes(this.picked.centre, object).map(({ brush, signs }) => {
      const [indices, weights] = brush.under(mesh.points);
      const slopes = new Map(indices.map((point) => [point, brush.slopeAt(mesh.at(point, new Vector3()))]));
      return { indices, weights, slopes, signs };
    });
    mesh.hold();
    this.stroke = { mesh, tool, index: this.picked.index, by: new Vector3(), under: held, from: mesh.points.slice(), moved: new Set(), quads: state('quads') };
  }

  /** Moves the points that were under the brush by a world vector. */
  #move(by) {
    const { mesh, under, from, moved } = this.stroke;
    const { object } = this.bearers[this.stroke.index];
    this.stroke.by = by.clone().applyMatrix3(new Matrix3().setFromMatrix4(object.matrixWorld).invert());
    const [own, image] = under;
    grab(mesh, own, from, this.stroke.by);
    if (image) {
      const both = new Map(own.indices.map((point, k) => [point, k]));
      const mirrored = this.stroke.by.clone().multiply(image.signs);
      const sum = mesh.points.slice(); // where both reach, their moves add up
      grab(mesh, image, from, mirrored);
      for (const point of image.indices)
        for (let i = 3 * point; both.has(point) && i < 3 * point + 3; i++) mesh.points[i] += sum[i] - from[i];
    }
    for (const { indices } of under) for (const point of indices) moved.add(point);
    const turn = (point, normal) => under.reduce((turned, { slopes, signs }) =>
      (slopes.has(point) ? turnedBy(this.stroke.by.clone().multiply(signs), slopes.get(point), turned) : turned), normal);
    mesh.show(moved, turn);
    this.viewport.invalidate();
  }

  /** Puts one dab of the brush where the pointer is, stronger with the pressure of a pen. */
  #dab(event, hit) {
    const { mesh, moved, tool: used } = this.stroke;
    const { object } = this.bearers[this.stroke.index];
    const centre = object.worldToLocal(hit.point.clone());
    const pressure = event.pointerType === 'pen' ? event.pressure : 1;
    const strength = (Number(this.strength.value) / 100) * pressure * (event.ctrlKey ? -1 : 1);
    const tool = event.shiftKey ? 'smooth' : used;
    const normal = mesh.normalAt(mesh.nearest(centre));
    const facing = normal.lengthSq() > 0 ? normal : hit.face.normal;
    const dabs = this.#brushes(centre, object).map(({ brush, signs }) => BRUSHES[tool](mesh, brush, strength, facing.clone().multiply(signs)));
    const dabbed = apply(mesh, dabs);
    for (const point of dabbed) moved.add(point);
    mesh.show(dabbed);
    this.stroke.dabbed = hit.point.clone();
    this.viewport.invalidate();
  }

  /** caster: through where the pointer was. */
  #drag(event, caster = this.viewport.rayAt(event)) {
    if (!this.stroke?.drag) {
      if (this.held?.isDown) this.held.moves.push([event, caster]);
      else if (this.isOn && event.buttons === 0 && event.pointerType !== 'touch') this.#hover(event);
      return;
    }
    if (this.stroke.tool !== 'grab') {
      const hit = this.#hit(event, caster);
      if (hit?.index === this.stroke.index && hit.point.distanceTo(this.stroke.dabbed) > SPACING * this.radius) this.#dab(event, hit);
      return;
    }
    const { plane, from } = this.stroke.drag;
    const by = caster.ray.intersectPlane(plane, new Vector3())?.sub(from);
    if (!by) return;
    const up = new Vector3(0, 1, 0).transformDirection(this.viewport.camera.matrixWorld);
    this.#move(this.along === 'normal' || event.shiftKey ? this.normal.multiplyScalar(by.dot(up)) : by);
  }

  #up() {
    this.#holdCamera(false);
    if (this.stroke?.drag) this.#end();
  }

  /** Whether the stroke in the hand has moved points. */
  get #isMoved() {
    return Boolean(this.stroke) && (this.stroke.tool === 'grab' ? this.stroke.by.lengthSq() > 0 : this.stroke.moved.size > 0);
  }

  #end() {
    if (this.#isMoved) this.#finish();
    else this.#drop();
  }

  /** Cancels the stroke: moves the points back. */
  #drop() {
    this.#holdCamera(false);
    const { held } = this;
    this.held = null;
    if (this.stroke) {
      const { mesh, from, moved } = this.stroke;
      mesh.restore(from, moved);
      this.stroke = null;
      this.viewport.invalidate();
      this.#showStored();
    }
    this.#letGo(held);
  }

  /** Takes back the stroke that is in the hand, or the last that waits for a daemon which does not answer. Returns whether there
   *  was one. */
  takeBack() {
    if (this.held?.isDown) {
      this.#drop();
      return true;
    }
    const { queue, isStoring } = this.work;
    if (isStoring || queue.length === 0) return false;
    const { mesh, indices } = queue.pop();
    mesh.restore(mesh.stored, indices);
    for (const kept of queue) kept.indices.forEach((point, k) => mesh === kept.mesh && mesh.points.set(kept.positions.slice(3 * k, 3 * k + 3), 3 * point));
    mesh.show(indices);
    this.viewport.invalidate();
    this.#showStored();
    return true;
  }

  /** Makes a stroke by numbers. vector(): how far the picked point moves. */
  async moveBy(vector) {
    await this.picking; // a number that was just typed, while its points are still coming
    if (!this.picked) return this.say('Pick a point first.');
    const { index } = this.picked;
    const mesh = await this.meshOf(this.bearers[index]).catch((error) => fail('The points cannot be loaded', error, () => this.moveBy(vector)));
    if (!mesh || this.picked?.index !== index) return undefined;
    this.#begin(mesh);
    this.#move(vector());
    return this.#finish();
  }

  // ---- storing ----

  /** Puts the stroke into the queue. */
  #finish() {
    const { mesh, index, moved, by, held, quads } = this.stroke;
    const indices = [...moved];
    const positions = indices.flatMap((point) => [...mesh.points.subarray(3 * point, 3 * point + 3)]);
    this.work.queue.push({ level: this.level, mesh, indices, positions, of: this.bearers[index].mesh, index, picked: this.picked, quads });
    if (this.picked) this.picked = { ...this.picked, centre: this.picked.centre.clone().add(by) };
    this.wanted = this.picked ? { index, place: this.picked.centre } : this.wanted;
    this.stroke = null;
    this.#mark();
    const stored = this.#store();
    this.#letGo(held);
    return stored;
  }

  /** Stores the strokes of a queue, one after the other, each as a model made from the one before. Where the daemon does not
   *  answer, they stay in the queue and on the surface, until it is asked again. */
  async #store(work = this.work) {
    const { model, queue, stored } = work;
    if (queue.length === 0 || work.isStoring) return;
    work.isStoring = true;
    const controller = new AbortController();
    const task = busy('Keeping the stroke', controller);
    try {
      for (; queue.length > 0; queue.shift()) {
        const [{ level, mesh, of, indices, positions, quads }] = queue;
        const options = { level, mesh: meshName(model, of), name: `${stemOf(model)}, sculpted`, quads: stored.length > 0 ? undefined : quads, signal: controller.signal };
        const made = await withKey(() => tweend.sculpt(stored.at(-1)?.model ?? model, { indices, positions }, options));
        indices.forEach((point, k) => mesh.stored.set(positions.slice(3 * k, 3 * k + 3), 3 * point));
        stored.push({ model: made.id, from: '', edits: '', quads: 'auto' }); // the new model has its polygons
      }
    } catch (error) {
      fail('The stroke cannot be kept', error, () => this.#store(work));
      if (!mayPass(error)) this.#giveUp(work);
    } finally {
      work.isStoring = false;
      task.done();
    }
    this.#showStored(work);
    this.#tellFree();
  }

  /** Takes back the strokes of a queue, of which the daemon refuses the first. */
  #giveUp(work) {
    const [{ index, picked }] = work.queue;
    const isHere = work === this.work;
    if (isHere) this.#drop(); // what is in the hand was built on it
    for (const { mesh, indices } of work.queue.splice(0)) mesh.restore(mesh.stored, indices);
    if (isHere && picked) this.pick(index, picked.centre);
  }

  /** Shows the newest model, unless the hand is at the next stroke. */
  #showStored(work = this.work) {
    const { model, queue, stored } = work;
    if (queue.length > 0 || stored.length === 0 || (work === this.work && this.stroke)) return;
    this.steps.go(model, ...stored.splice(0));
    this.models.load();
  }
}
