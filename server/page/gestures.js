// Edits made by one movement of the hand: the pointer's way, or typed digits, give the amount. Pure: what a gesture asks
// of the picture is in its `frame`.
//   frame: { centre, start, now: places of the picture in pixels, each [x, y]
//            scale: lengths of the mesh's space per pixel
//            along(v): where a vector of the mesh's space goes in the picture, [x, y] in pixels
//            inPlane([x, y]): the vector of the mesh's space that a way in the picture means
//            normal: of the selection, view: towards the camera, both unit vectors of the mesh's space }
import { vectors } from './cage_mesh.js';

const { dot } = vectors;
const FLAT = 0.2; // a direction that is seen shorter than this part of its length points at the camera
const STEP_PX = 12; // the way that a press of an arrow key counts for
const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const round = (value) => Number(value.toPrecision(3));

const way = ({ start, now }) => [now[0] - start[0], now[1] - start[1]];
const away = ([x, y], [cx, cy]) => Math.hypot(x - cx, y - cy);

/** How far a way in the picture goes along a direction of the mesh's space. */
function pulled(frame, direction) {
  const [x, y] = frame.along(direction);
  const [dx, dy] = way(frame);
  const length = Math.hypot(x, y);
  return length * frame.scale < FLAT ? -dy * frame.scale : (dx * x + dy * y) / length ** 2;
}

const turn = ({ start, now, centre }) => {
  const [a, b] = [start, now].map(([x, y]) => Math.atan2(centre[1] - y, x - centre[0]));
  return ((((b - a) * 180) / Math.PI + 540) % 360) - 180;
};

/** Each: key: that begins it, as people know it from Blender; of: the kinds it takes; amount(frame, axis); edit(amount, axis,
 *  frame), null where nothing would happen; say(amount). axis: a letter, or null. */
export const GESTURES = {
  move: {
    text: 'Move', key: 'g', of: ['faces', 'edges', 'vertices'], takesAxis: true,
    amount: (frame, axis) => (axis ? pulled(frame, AXES[axis]) : frame.inPlane(way(frame))),
    edit(amount, axis) {
      const by = Array.isArray(amount) ? amount : AXES[axis ?? 'x'].map((part) => part * amount);
      return by.some((part) => part !== 0) ? { edit: 'move', by: by.map(round) } : null;
    },
    say: (amount) => [amount].flat().map(round).join(', '),
  },
  rotate: {
    text: 'Rotate', key: 'r', of: ['faces', 'edges', 'vertices'], takesAxis: true,
    amount: (frame, axis) => turn(frame) * (axis && dot(AXES[axis], frame.view) < 0 ? -1 : 1),
    edit: (amount, axis, { view }) => (amount ? { edit: 'rotate', axis: axis ?? view.map(round), degrees: round(amount) } : null),
    say: (amount) => `${round(amount)}°`,
  },
  scale: {
    text: 'Scale', key: 's', of: ['faces', 'edges', 'vertices'], takesAxis: true,
    amount: ({ start, now, centre }) => away(now, centre) / Math.max(away(start, centre), 1),
    edit: (amount, axis) => (amount !== 1 ? { edit: 'scale', by: axis ? AXES[axis].map((part) => (part ? round(amount) : 1)) : round(amount) } : null),
    say: (amount) => `${round(amount)} ×`,
  },
  extrude: {
    text: 'Extrude', key: 'e', of: ['faces'],
    amount: (frame) => pulled(frame, frame.normal),
    edit: (distance) => (distance ? { edit: 'extrude', distance: round(distance) } : null),
    say: (distance) => `${round(distance)}`,
  },
  inset: {
    text: 'Inset', key: 'i', of: ['faces'],
    amount: ({ start, now, centre, scale }) => Math.max(0, (away(start, centre) - away(now, centre)) * scale),
    edit: (amount) => (amount ? { edit: 'inset', amount: round(amount) } : null),
    say: (amount) => `${round(amount)}`,
  },
  crease: {
    text: 'Crease', key: 'E', of: ['edges'],
    amount: (frame) => Math.min(10, Math.max(0, Math.round((way(frame)[0] / 30) * 10) / 10)),
    edit: (sharpness) => ({ edit: 'crease', sharpness: Math.min(10, Math.max(0, sharpness)) }),
    say: (sharpness) => (sharpness >= 10 ? 'infinite' : `${round(sharpness)}`),
  },
  loop_cut: {
    text: 'Loop cut', key: 'Ctrl+r', of: ['faces', 'edges', 'vertices'], isOfEdge: true,
    amount: ({ count }) => count,
    edit: (cuts) => ({ edit: 'loop_cut', cuts: Math.min(100, Math.max(1, Math.round(cuts))) }),
    say: (cuts) => `${Math.round(cuts)}`,
  },
};

/** A gesture that goes on. */
export class Gesture {
  typed = '';
  axis = null;
  count = 1; // of cuts

  /** frame: as above, without `now`. */
  constructor(name, frame) {
    this.name = name;
    this.kind = GESTURES[name];
    this.frame = { ...frame, now: frame.start };
  }

  moveTo(place) {
    this.frame.start ??= place;
    this.frame.now = place;
  }

  get amount() {
    if (this.typed !== '') return Number(this.typed); // NaN until it is a number
    if (!this.frame.start && !this.kind.isOfEdge) return this.name === 'scale' ? 1 : 0;
    return this.kind.amount({ ...this.frame, count: this.count }, this.axis);
  }

  /** The edit so far, without its selection; null where it would change nothing, or what is typed is no number yet. */
  get edit() {
    return this.typed !== '' && Number.isNaN(this.amount) ? null : this.kind.edit(this.amount, this.axis, this.frame);
  }

  get words() {
    return `${this.kind.text} ${this.typed || this.kind.say(this.amount)}${this.axis ? ` along ${this.axis}` : ''}`;
  }

  /** Takes a key; returns whether it was one of the gesture's. */
  type(key) {
    const arrows = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (/^[\d.]$/.test(key) || (key === '-' && this.typed === '')) this.typed += key;
    else if (key === ',') this.typed += '.';
    else if (key === '-') this.typed = this.typed.slice(1);
    else if (key === 'Backspace') this.typed = this.typed.slice(0, -1);
    else if (this.kind.takesAxis && key in AXES) this.axis = this.axis === key ? null : key;
    else if (this.kind.isOfEdge && key in arrows) this.add(arrows[key][0] - arrows[key][1]);
    else if (key in arrows) {
      const { start, now, centre } = this.frame;
      const from = now ?? [centre[0] + 100, centre[1]];
      this.frame.start = start ?? from;
      this.frame.now = from.map((value, i) => value + STEP_PX * arrows[key][i]);
    } else return false;
    return true;
  }

  /** More cuts, or fewer. */
  add(by) {
    this.typed = '';
    this.count = Math.min(100, Math.max(1, this.count + by));
  }
}
