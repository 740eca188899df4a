// Handles on the selection that move, turn and scale it: three's TransformControls, as edits in the mesh's space.
import { Object3D, Vector3 } from 'three';
import { TransformControls } from 'three/addons/controls/TransformControls.js';

const MODES = { move: 'translate', rotate: 'rotate', scale: 'scale' };
const round = (value) => Number(value.toPrecision(6));

export class Gizmo {
  /** onMove(edit) is called while a handle is dragged, onEnd(edit) when it is let go; edit: null where nothing moved. */
  constructor(viewport, { onMove, onEnd }) {
    Object.assign(this, { viewport, onMove, onEnd });
    this.mode = null;
    this.controls = null; // made when first placed: the handles have some dozens of geometries
    this.pivot = new Object3D();
  }

  #make() {
    const { viewport } = this;
    const controls = new TransformControls(viewport.camera, viewport.canvas);
    controls.setSpace('local');
    controls.setSize(0.9);
    controls.addEventListener('change', () => viewport.invalidate());
    controls.addEventListener('dragging-changed', ({ value }) => {
      viewport.controls.enabled = !value;
      if (value) return;
      const edit = this.#edit();
      this.#rest();
      this.onEnd(edit);
    });
    controls.addEventListener('objectChange', () => this.onMove(this.#edit()));
    viewport.own.add(controls.getHelper());
    return controls;
  }

  /** Whether the pointer is on a handle. */
  get isHeld() {
    return this.controls?.object !== undefined && (this.controls.dragging || this.controls.axis !== null);
  }

  /** Puts the handles onto a place in an object's space; mode: null for none. */
  place(mode, object, centre) {
    this.mode = mode;
    this.controls?.detach();
    this.pivot.removeFromParent();
    if (!mode || !object || !centre) return this.viewport.invalidate();
    this.controls ??= this.#make();
    this.centre = centre;
    object.add(this.pivot);
    this.#rest();
    this.pivot.updateWorldMatrix(true, false);
    this.controls.setMode(MODES[mode]);
    this.controls.attach(this.pivot);
    return this.viewport.invalidate();
  }

  #rest() {
    this.pivot.position.set(...this.centre);
    this.pivot.quaternion.identity();
    this.pivot.scale.setScalar(1);
  }

  /** What was done to the handles, as an edit without a selection. */
  #edit() {
    const { position, quaternion, scale } = this.pivot;
    if (this.mode === 'move') {
      const by = position.clone().sub(new Vector3(...this.centre)).toArray().map(round);
      return by.some((value) => value !== 0) ? { edit: 'move', by } : null;
    }
    if (this.mode === 'scale') {
      const by = scale.toArray().map(round);
      return by.some((value) => value !== 1) ? { edit: 'scale', by } : null;
    }
    const half = new Vector3(quaternion.x, quaternion.y, quaternion.z);
    const degrees = round((2 * Math.atan2(half.length(), quaternion.w) * 180) / Math.PI);
    return degrees !== 0 ? { edit: 'rotate', axis: half.normalize().toArray().map(round), degrees } : null;
  }
}
