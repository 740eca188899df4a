// The selection of the Edit tab: faces, edges or points of one mesh, as a list or as a rule that the API knows.
import { isSameEdge } from './cage_mesh.js';
import { plural } from './dom.js';

export const KINDS = [['faces', 'Faces'], ['edges', 'Edges'], ['vertices', 'Points']];

const wordOf = (kind) => KINDS.find(([name]) => name === kind)[1].toLowerCase();
const isSame = (a, b) => (Array.isArray(a) ? isSameEdge(a, b) : a === b);

/** A list with an element added, or taken out where it was in. */
function toggled(list, element) {
  const others = list.filter((known) => !isSame(known, element));
  return others.length < list.length ? others : [...list, element];
}

/** What can be done to a selection as a whole: a list of the mesh's elements to another. */
const CHANGES = {
  all: (mesh, kind) => mesh.all(kind),
  none: () => [],
  invert: (mesh, kind, list) => mesh.all(kind).filter((element) => !list.some((known) => isSame(known, element))),
  grow: (mesh, kind, list) => mesh.grow(kind, list),
  shrink: (mesh, kind, list) => mesh.shrink(kind, list),
  linked: (mesh, kind, list) => mesh.linked(kind, list),
  loop: (mesh, kind, list) => list.flatMap((edge) => mesh.loop(edge)),
  ring: (mesh, kind, list) => list.flatMap((edge) => mesh.ring(edge)),
};

export class Selection {
  kind = 'faces';
  value = []; // a list, or a rule as the API takes it

  /** picker: shows the selection. objectOf(): the index of the picker's object that is edited; -1: none. onChange() is
   *  called when another selection is made. */
  constructor(picker, objectOf, onChange) {
    Object.assign(this, { picker, objectOf, onChange });
  }

  get mesh() {
    return this.picker.objects[this.objectOf()]?.mesh ?? null;
  }

  /** The selected elements; null where only the daemon knows them. */
  get list() {
    return this.mesh?.select(this.kind, this.value) ?? (Array.isArray(this.value) ? this.value : null);
  }

  get isEmpty() {
    return this.list?.length === 0;
  }

  set(value) {
    const list = this.mesh?.select(this.kind, value);
    this.value = list && Array.isArray(value) ? list : value;
    this.picker.draw(this.objectOf(), list);
    this.onChange();
  }

  /** Changes the kind of elements; those of the new kind that are of the selected points stay selected. */
  choose(kind) {
    const { mesh, list } = this;
    const points = mesh && list?.length > 0 ? mesh.pointsIn(this.kind, list) : [];
    this.kind = this.picker.kind = kind;
    this.picker.hover();
    this.set(points.length > 0 ? mesh.within(kind, points) : []);
  }

  /** name: of CHANGES. */
  change(name) {
    const { mesh, list, kind } = this;
    if (!mesh || !list || (kind !== 'edges' && ['loop', 'ring'].includes(name))) return;
    const changed = CHANGES[name](mesh, kind, list);
    const known = kind === 'edges' ? new Map(changed.map((edge) => [mesh.keyOf(edge), edge])) : new Set(changed);
    this.set([...known.values()]);
  }

  /** Selects an element: more: beside those that are selected. by: 'loop' or 'ring' of an edge, or of the face's. */
  pick(element, { more = false, by } = {}) {
    const { mesh, list, kind } = this;
    const picked = by && kind === 'edges' ? mesh[by](element) : [element];
    if (!more || !list) return this.set(picked);
    if (picked.length === 1) return this.set(toggled(list, element));
    return this.set([...list, ...picked.filter((edge) => !list.some((known) => isSame(known, edge)))]);
  }

  /** Selects the next or the previous element of the mesh. */
  step(by, more) {
    const { mesh, list, kind } = this;
    if (!mesh) return;
    const all = mesh.all(kind);
    const last = list?.length > 0 ? all.findIndex((element) => isSame(element, list.at(-1))) : -1;
    const next = all.at((last < 0 ? (by > 0 ? 0 : -1) : last + by) % all.length);
    this.set(more && list ? [...list.filter((known) => !isSame(known, next)), next] : [next]);
  }

  /** In words. name: of the mesh where there are several. */
  say(name) {
    const { list } = this;
    const of = name ? ` of ${name}` : '';
    if (!list) return `The daemon finds these ${wordOf(this.kind)}${of}.`;
    if (list.length > 0) return `${plural(list.length, wordOf(this.kind).slice(0, -1))}${of}`;
    return `Click ${wordOf(this.kind)} in the picture, with Shift more of them; each tap adds one.`;
  }
}
