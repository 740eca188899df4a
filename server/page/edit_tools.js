// The tools of the Edit tab on the picture: a bar of buttons, the keys that Blender's users expect, handles on the
// selection, boxes, and gestures with their preview.
import { Matrix4, Vector3 } from 'three';

import { byId, count, icon, make, press } from './dom.js';
import { previewOf } from './edit_preview.js';
import { GESTURES, Gesture } from './gestures.js';
import { Gizmo } from './gizmo.js';
import { state } from './state.js';

const TOOLS = [['select', 'Select (W)', 'M4 2l8 6-3.6.8L10.5 13l-1.8.8-2-4.2L4 12z'],
  ['box', 'Select by a box (B)', 'M3 3h2M7 3h2M11 3h2v2M13 7v2M13 11v2h-2M9 13H7M5 13H3v-2M3 9V7M3 5V3'],
  ['move', 'Move by handles', 'M8 1.5v13M1.5 8h13M8 1.5L6 4M8 1.5L10 4M8 14.5L6 12M8 14.5L10 12M1.5 8L4 6M1.5 8L4 10M14.5 8L12 6M14.5 8L12 10'],
  ['rotate', 'Rotate by handles', 'M13.5 8A5.5 5.5 0 1 1 11.5 3.8M11.5 1v3h-3'],
  ['scale', 'Scale by handles', 'M2.5 9.500v4h4zM2.500 13.500L13 3M9 2.500h4.500V7']];
const ACTIONS = [['extrude', 'Extrude (E)', 'M3 9v4.500h10V9M3 9h10M8 9V1.500M8 1.500L5.500 4M8 1.500L10.500 4'],
  ['inset', 'Inset (I)', 'M2 2h12v12H2zM5 5h6v6H5z'],
  ['loop_cut', 'Loop cut (Ctrl+R)', 'M2 2h12v12H2zM8 2v12']];
const KEYS = { a: 'all', l: 'linked' }; // of changes to the selection
const KINDS_BY_KEY = { 1: 'vertices', 2: 'edges', 3: 'faces' };

/** Single letters are taken where nothing else would take them: on the picture, or when nothing has the focus. */
const isOnPicture = ({ target }) => target === document.body || Boolean(target.closest?.('#stage') && !target.closest('input, [role=menu]'));

export class EditTools {
  /** panel: the EditPanel, which applies edits to its selection. */
  constructor({ viewport, picker, selection, panel }) {
    Object.assign(this, { viewport, picker, selection, panel, tool: 'select', gesture: null });
    this.gizmo = new Gizmo(viewport, { onMove: (edit) => this.#preview(edit), onEnd: (edit) => this.#finish(edit) });
    picker.isBusy = () => this.gizmo.isHeld || this.gesture !== null || this.tool === 'box';
    const button = ([name, label, path], act) => make('button', { title: label, 'aria-label': label, 'data-name': name, onclick: () => act(name) }, icon(path));
    this.tools = TOOLS.map((entry) => button(entry, (name) => this.use(name)));
    this.bar = make('div', { className: 'tools', role: 'toolbar', 'aria-label': 'Tools', 'aria-orientation': 'vertical', hidden: true },
      ...this.tools, make('hr'), ...ACTIONS.map((entry) => button(entry, (name) => this.begin(name))));
    this.words = make('span', { role: 'status' });
    this.said = make('div', { className: 'gesture', hidden: true }, this.words,
      make('button', { className: 'small primary', onclick: () => this.confirm() }, 'Apply'),
      make('button', { className: 'small', onclick: () => this.cancel() }, 'Cancel'));
    this.box = make('div', { className: 'box', hidden: true });
    byId('stage').append(this.bar, this.box, this.said);
    const { canvas } = viewport;
    canvas.addEventListener('pointerdown', (event) => this.#down(event), { capture: true }); // before the camera's
    canvas.addEventListener('pointermove', (event) => this.#move(event));
    canvas.addEventListener('pointerup', (event) => this.#up(event));
    canvas.addEventListener('pointercancel', () => this.cancel());
    canvas.addEventListener('contextmenu', (event) => this.gesture && event.preventDefault());
    canvas.addEventListener('wheel', (event) => this.#wheel(event), { capture: true, passive: false });
    canvas.addEventListener('dblclick', (event) => this.#double(event));
    addEventListener('keydown', (event) => this.#key(event), { capture: true });
    this.use('select');
  }

  /** Shows the tools where there is something to edit. */
  show() {
    this.bar.hidden = !this.isOn;
    this.viewport.canvas.toggleAttribute('data-boxes', this.isOn && this.tool === 'box');
    if (!this.isOn) this.cancel();
    this.place();
  }

  get isOn() {
    return this.picker.isOn && this.picker.objects.length > 0;
  }

  use(tool) {
    this.cancel();
    this.tool = tool;
    press(this.tools, (name) => name === tool);
    this.show();
  }

  /** Puts the handles onto the selection. */
  place() {
    const { list, mesh, kind } = this.selection;
    const isShown = this.isOn && list?.length > 0 && mesh && !this.gesture && ['move', 'rotate', 'scale'].includes(this.tool);
    this.gizmo.place(isShown ? this.tool : null, this.#object, isShown && mesh.centreOf(kind, list));
  }

  get #object() {
    return this.picker.objects[this.selection.objectOf()]?.object;
  }

  // ---- gestures ----

  /** Begins an edit by hand. */
  begin(name) {
    this.cancel();
    const { of, isOfEdge, text } = GESTURES[name];
    const { list, mesh, kind } = this.selection;
    if (!this.isOn || !mesh) return;
    if (!of.includes(kind)) return this.panel.say(`${text} is for ${of[0]}.`);
    if (!isOfEdge && !list) return this.panel.say('Only the daemon finds these. A button of the panel edits them.');
    if (!isOfEdge && list.length === 0) return this.panel.say(`Select ${kind === 'vertices' ? 'points' : kind} first.`);
    this.edge = isOfEdge ? (kind === 'edges' && list?.length > 0 ? list.at(-1) : mesh.edges[0]) : null;
    this.gesture = new Gesture(name, this.#frame(isOfEdge && !(list?.length > 0) ? mesh.all(kind) : list));
    this.viewport.controls.enabled = false;
    this.said.hidden = false;
    this.viewport.canvas.focus({ preventScroll: true });
    this.place();
    this.#show();
  }

  /** What a gesture asks of the picture. */
  #frame(list) {
    const { mesh, kind } = this.selection;
    const [object, { camera }] = [this.#object, this.viewport];
    const middle = new Vector3(...mesh.centreOf(kind, list));
    const seen = (place) => {
      const { x, y } = this.viewport.seen(object.localToWorld(place.clone()));
      return [x, y];
    };
    const centre = seen(middle);
    const reach = object.localToWorld(middle.clone()).distanceTo(camera.position) / 1000;
    const along = (v) => { // measured over a short way, as perspective bends long ones
      const to = seen(middle.clone().addScaledVector(new Vector3(...v), reach));
      return to.map((value, i) => (value - centre[i]) / reach);
    };
    const toMesh = new Matrix4().copy(object.matrixWorld).invert();
    const direction = (v) => v.transformDirection(camera.matrixWorld).transformDirection(toMesh);
    const [right, up, back] = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)].map(direction);
    const scale = 1 / Math.max(Math.hypot(...along(right.toArray())), 1e-9);
    const inPlane = ([dx, dy]) => right.clone().multiplyScalar(dx * scale).addScaledVector(up, -dy * scale).toArray();
    return { centre, scale, along, inPlane, start: this.pointer ?? null, normal: mesh.normalIn(kind, list), view: back.toArray() };
  }

  /** The whole edit of the gesture, with its selection. */
  get #edit() {
    const { edit, kind } = this.gesture;
    return edit && (kind.isOfEdge ? { ...edit, edge: this.edge } : edit);
  }

  #preview(edit) {
    const { mesh, kind, list } = this.selection;
    this.picker.show(this.selection.objectOf(), edit && previewOf(mesh, kind, list ?? [], edit));
  }

  #show() {
    this.#preview(this.#edit);
    this.words.textContent = this.gesture.words;
    this.said.title = this.gesture.kind.takesAxis ? 'Type a number; X, Y and Z keep to an axis' : 'Type a number';
  }

  confirm() {
    if (!this.gesture) return;
    const edit = this.#edit;
    this.#end();
    this.#finish(edit);
  }

  cancel() {
    if (this.gesture) {
      this.#end();
      this.#finish(null);
    }
    if (!this.corner) return;
    this.corner = null;
    this.box.hidden = true;
    this.box.textContent = '';
    this.picker.hover();
  }

  #end() {
    this.gesture = null;
    this.viewport.controls.enabled = true;
    this.said.hidden = true;
    this.place();
  }

  #finish(edit) {
    if (edit) this.panel.applyByHand(edit);
    else this.picker.show(this.selection.objectOf(), null);
  }

  // ---- the pointer ----

  #placeOf({ clientX, clientY }) {
    const { left, top } = this.viewport.canvas.getBoundingClientRect();
    return [clientX - left, clientY - top];
  }

  #down(event) {
    if (!this.isOn) return;
    if (this.gesture) {
      event.stopImmediatePropagation();
      if (event.button === 2) this.cancel();
      else if (event.pointerType === 'touch') this.gesture.frame.start = this.#placeOf(event);
      else this.confirm();
    } else if (this.tool === 'box' && event.button === 0 && event.isPrimary) {
      event.stopImmediatePropagation();
      this.viewport.canvas.setPointerCapture(event.pointerId);
      this.corner = this.#placeOf(event);
    }
  }

  #move(event) {
    this.pointer = this.#placeOf(event);
    if (this.corner) return this.#drawBox(event);
    if (!this.gesture) return undefined;
    if (this.gesture.kind.isOfEdge) this.edge = this.#edgeAt(event) ?? this.edge;
    this.gesture.moveTo(this.pointer);
    return this.#show();
  }

  #up(event) {
    if (this.gesture && event.pointerType === 'touch' && this.gesture.frame.now) return this.confirm();
    if (!this.corner) return undefined;
    const rectangle = this.#rectangle(event);
    this.cancel();
    const found = this.picker.inBox(this.selection.objectOf(), rectangle);
    const isMore = event.shiftKey || event.pointerType === 'touch'; // as a tap adds
    return this.selection.set(isMore && this.selection.list ? [...new Map([...this.selection.list, ...found].map((element) => [String(element), element])).values()] : found);
  }

  #rectangle(event) {
    const [[x, y], [cornerX, cornerY]] = [this.#placeOf(event), this.corner];
    return [Math.min(x, cornerX), Math.min(y, cornerY), Math.max(x, cornerX), Math.max(y, cornerY)];
  }

  #drawBox(event) {
    const [left, top, right, bottom] = this.#rectangle(event);
    Object.assign(this.box.style, { left: `${left}px`, top: `${top}px`, width: `${right - left}px`, height: `${bottom - top}px` });
    this.box.hidden = false;
    this.drawn = [left, top, right, bottom];
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      if (!this.corner) return;
      const i = this.selection.objectOf();
      const found = this.picker.inBox(i, this.drawn);
      this.picker.hover(i, found);
      this.box.textContent = found.length > 0 ? count(found.length) : '';
    });
  }

  /** The edge of the edited mesh that is nearest to a place. */
  #edgeAt(event) {
    const { kind } = this.picker;
    this.picker.kind = 'edges';
    const found = this.picker.at(event);
    this.picker.kind = kind;
    return found?.object === this.selection.objectOf() ? found.element : null;
  }

  #wheel(event) {
    if (!this.gesture?.kind.isOfEdge) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    this.gesture.add(event.deltaY < 0 ? 1 : -1);
    this.#show();
  }

  /** A double click takes the loop of an edge. */
  #double(event) {
    if (!this.isOn || this.gesture || this.selection.kind !== 'edges') return;
    const edge = this.#edgeAt(event);
    if (edge) this.selection.pick(edge, { by: 'loop', more: event.shiftKey });
  }

  // ---- keys ----

  #key(event) {
    if (!this.isOn || state('tab') !== 'edit' || !isOnPicture(event)) return;
    if (this.gesture ? this.#keyOfGesture(event) : this.#keyOfTools(event)) {
      event.preventDefault();
      event.stopPropagation();
    }
  }

  #keyOfGesture(event) {
    if (event.target.closest?.('.gesture') && ['Enter', ' '].includes(event.key)) return false; // its own buttons
    if (event.key === 'Enter') this.confirm();
    else if (event.key === 'Escape') this.cancel();
    else if (event.ctrlKey || event.metaKey || event.altKey || !this.gesture.type(event.key)) return false;
    else this.#show();
    return true;
  }

  #keyOfTools({ key, ctrlKey, metaKey, altKey, shiftKey, target }) {
    const name = key.toLowerCase();
    const isControl = ctrlKey || metaKey;
    if (isControl && name === 'r' && !shiftKey) return this.begin('loop_cut') ?? true;
    if (isControl && ['+', '=', '-'].includes(key)) return target === this.viewport.canvas && (this.selection.change(key === '-' ? 'shrink' : 'grow') ?? true);
    if (isControl && name === 'i') return this.selection.change('invert') ?? true;
    if (altKey && name === 'a') return this.selection.change('none') ?? true;
    if (isControl || altKey) return false;
    const gesture = Object.keys(GESTURES).find((each) => GESTURES[each].key === (shiftKey ? key : name));
    if (gesture) return this.begin(gesture) ?? true;
    if (shiftKey) return false;
    if (name === 'escape' && this.tool !== 'select') return this.use('select') ?? true;
    if (name === 'b' || name === 'w') return this.use(name === 'b' ? 'box' : 'select') ?? true;
    if (name === 'x' || name === 'delete') return this.panel.deleteSelected() ?? true;
    if (KEYS[name]) return this.selection.change(KEYS[name]) ?? true;
    if (KINDS_BY_KEY[name]) return this.panel.choose(KINDS_BY_KEY[name]) ?? true;
    return false;
  }
}
