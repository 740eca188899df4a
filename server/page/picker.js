// Picks faces, edges and points of the control cage in the viewport, by a click or a box, and highlights them. Their
// indices are those that edits use.
import { DoubleSide, Group, Mesh, MeshBasicMaterial, Points, PointsMaterial, Vector3 } from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';

import { CageMesh } from './cage_mesh.js';
import { geometryOf, THROUGH } from './overlays.js';
import { polygonsOf } from './polygons.js';
import { boxesOf, hitsOn } from './ray_hits.js';
import { isStill } from './viewport.js';

const COLOURS = { selected: 0xf08a00, hovered: 0x2f7de1 };
const REACH = 7; // pixels beside the cage at which a click still hits it
const AROUND = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]];

/** The meshes of a GLB of level 0 with polygons=ngon, as edits see them: [CageMesh]. */
export function readCages(parser) {
  const array = async (accessor) => (accessor === undefined ? null : (await parser.getDependency('accessor', accessor)).array);
  return Promise.all((parser.json.meshes ?? []).map(async ({ primitives: all, extras }) => {
    const primitives = all.filter(({ mode = 4 }) => mode === 4); // triangles only: an uploaded file may have lines and points too
    if (primitives.length === 0) return new CageMesh({ points: [], faces: [] });
    const pointOf = await array(extras?.tweend?.points); // the point of each vertex: UVs split points
    const faceAt = await array(extras?.tweend?.faces); // the face of each polygon: primitives group faces by material, and holes come last
    const position = await parser.getDependency('accessor', primitives[0].attributes.POSITION); // shared by all primitives
    const [points, faces] = [[], []];
    let count = 0;
    for (const { indices } of [...primitives, ...(extras?.tweend?.holes ?? [])]) {
      for (const polygon of polygonsOf(await array(indices))) {
        const face = polygon.map((vertex) => pointOf?.[vertex] ?? vertex);
        face.forEach((point, i) => (points[point] ??= [0, 1, 2].map((k) => position.getComponent(polygon[i], k))));
        faces[faceAt?.[count] ?? count] = face;
        count++;
      }
    }
    return new CageMesh({ points: Array.from(points, (point) => point ?? [0, 0, 0]), faces }); // an uploaded file may have points without faces
  }));
}

const fanOf = (corners) => corners.slice(2).flatMap((c, at) => [corners[0], corners[at + 1], c]);

/** What is drawn over a cage in one colour. */
class Marks {
  constructor(colour, { opacity, width, size = 8 }) {
    this.fill = new MeshBasicMaterial({ color: colour, opacity, side: DoubleSide, ...THROUGH });
    this.line = new LineMaterial({ color: colour, linewidth: width, ...THROUGH });
    this.dot = new PointsMaterial({ color: colour, size, sizeAttenuation: false, ...THROUGH });
    this.object = new Group();
  }

  #faces({ points, faces }, list) {
    return new Mesh(geometryOf(list.flatMap((face) => fanOf(faces[face]).flatMap((point) => points[point]))), this.fill);
  }

  #edges({ points }, list) {
    return new LineSegments2(new LineSegmentsGeometry().setPositions(list.flatMap(([a, b]) => [...points[a], ...points[b]])), this.line);
  }

  #put(object, renderOrder, ...parts) {
    for (const part of parts) this.object.add(Object.assign(part, { renderOrder }));
    object.add(this.object);
  }

  /** Highlights elements of a mesh. */
  highlight(of, kind, list) {
    this.clear();
    if (list.length === 0) return;
    const { mesh, object } = of;
    const part = kind === 'faces' ? this.#faces(mesh, list) : kind === 'edges' ? this.#edges(mesh, list)
      : new Points(geometryOf(list.flatMap((point) => mesh.points[point])), this.dot);
    this.#put(object, 4, part);
  }

  /** Draws what an edit will make: the changed faces with all of their edges. */
  preview({ object }, made) {
    this.clear();
    const edges = made.changed.flatMap((face) => made.faces[face].map((a, at, corners) => [a, corners[(at + 1) % corners.length]]));
    this.#put(object, 5, this.#faces(made, made.changed), this.#edges(made, edges));
  }

  clear() {
    for (const { geometry } of this.object.children) geometry.dispose();
    this.object.clear().removeFromParent();
    this.object.visible = true;
  }
}

export class Picker {
  /** onPick(object, element, event) is called for a click or tap on the cage. element: null when it hits nothing. */
  constructor(viewport, onPick) {
    Object.assign(this, { viewport, onPick, objects: [], kind: 'faces', isOn: false, isBusy: () => false });
    this.selected = new Marks(COLOURS.selected, { opacity: 0.45, width: 4, size: 9 });
    this.hovered = new Marks(COLOURS.hovered, { opacity: 0.25, width: 3 });
    this.preview = new Marks(COLOURS.selected, { opacity: 0.3, width: 2 });
    const { canvas } = viewport;
    viewport.onClick((event) => this.#click(event));
    canvas.addEventListener('pointerdown', (event) => this.#press(event));
    canvas.addEventListener('pointermove', (event) => this.#hover(event));
    canvas.addEventListener('pointerleave', () => this.hover());
  }

  /** cages: from readCages; bearers: [object, index of its cage] for the objects that show them. */
  setCages(cages, bearers) {
    this.viewport.canvas.dataset.pickable = '';
    this.objects = bearers.map(([object, index]) => {
      const mesh = cages[index];
      const faceOf = []; // the face of each triangle
      const triangles = mesh.faces.flatMap((corners, face) => {
        const fan = fanOf(corners);
        for (let i = 0; i < fan.length; i += 3) faceOf.push(face);
        return fan;
      });
      const solid = new Mesh(geometryOf(mesh.points.flat(), triangles), this.selected.fill);
      boxesOf(solid.geometry);
      return { mesh, faceOf, object, index, solid };
    });
  }

  // ---- by the pointer ----

  #click(event) {
    if (!this.isOn || this.isBusy()) return;
    const found = this.at(event);
    this.onPick(found?.object ?? 0, found?.element ?? null, event);
  }

  /** The element at a place of the window, or near it: {object, element}; null where there is none. */
  at({ clientX: x, clientY: y }) {
    for (const [dx, dy] of AROUND) {
      const found = this.#hit({ clientX: x + dx * REACH, clientY: y + dy * REACH });
      if (found) return { object: found.object, element: this.#element(found) };
    }
    return null;
  }

  #foresee(event) {
    const found = this.isBusy() || this.viewport.isBeside(event.clientX) ? null : this.at(event);
    this.hover(found?.object, found ? [found.element] : []);
  }

  /** A finger shows what it will select when it is lifted, until it moves away. */
  #press(event) {
    if (!this.isOn || event.pointerType !== 'touch') return;
    this.pressed = event.isPrimary ? event : null; // two fingers select nothing
    if (this.pressed) this.#foresee(event);
    else this.hover();
  }

  #hover(event) {
    if (event.pointerType === 'touch') {
      if (!this.pressed || isStill(this.pressed, event)) return;
      this.pressed = null;
      this.hover();
      return;
    }
    if (!this.isOn || event.buttons !== 0 || this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      if (this.isOn) this.#foresee(event);
    });
  }

  /** Highlights elements of an object that would be selected now. */
  hover(i, list = []) {
    const under = `${i} ${this.kind} ${list.join(' ')}`;
    if (under === this.under || (list.length === 0 && !this.under)) return;
    this.under = list.length > 0 ? under : null;
    this.hovered.highlight(this.objects[i], this.kind, list);
    this.viewport.invalidate();
  }

  /** The nearest face at a place of the window. */
  #hit(event) {
    const ray = this.viewport.rayAt(event);
    const hits = this.objects.flatMap(({ solid, object, faceOf }, i) => {
      solid.matrixWorld.copy(object.matrixWorld);
      return hitsOn(solid, ray).map(({ distance, point, faceIndex }) => ({ object: i, distance, point, face: faceOf[faceIndex] }));
    });
    return hits.sort((a, b) => a.distance - b.distance)[0];
  }

  #element({ object: i, face, point }) {
    const { mesh, object } = this.objects[i];
    const corners = mesh.faces[face];
    const at = (index) => new Vector3(...mesh.points[index]);
    const place = object.worldToLocal(point.clone());
    const nearest = (list, distance) => list.reduce((best, entry) => (distance(entry) < distance(best) ? entry : best));
    if (this.kind === 'faces') return face;
    if (this.kind === 'vertices') return nearest(corners, (index) => at(index).distanceTo(place));
    const away = ([a, b]) => {
      const along = at(b).sub(at(a));
      const part = place.clone().sub(at(a)).dot(along) / Math.max(along.lengthSq(), 1e-30);
      return at(a).addScaledVector(along, Math.min(Math.max(part, 0), 1)).distanceTo(place);
    };
    return nearest(corners.map((_, k) => mesh.edgeOf(face, k)), away);
  }

  /** The elements of an object that a box of the picture holds by their middles, on faces towards the camera. */
  inBox(i, [left, top, right, bottom]) {
    const { mesh, object } = this.objects[i];
    const eye = object.worldToLocal(this.viewport.camera.position.clone());
    const isInside = (point) => {
      const { x, y, z } = this.viewport.seen(object.localToWorld(point));
      return z < 1 && x >= left && x <= right && y >= top && y <= bottom;
    };
    const isSeen = mesh.faces.map((corners, face) => eye.clone().sub(new Vector3(...mesh.points[corners[0]])).dot(new Vector3(...mesh.normalOf(face))) > 0);
    const facesOf = { faces: (face) => [face], edges: (edge) => mesh.sidesOf(edge).map(({ face }) => face), vertices: (point) => mesh.facesAt(point) }[this.kind];
    return mesh.all(this.kind).filter((element) => facesOf(element).some((face) => isSeen[face]) && isInside(new Vector3(...mesh.centreOf(this.kind, [element]))));
  }

  // ---- what is seen ----

  /** Highlights elements of an object. */
  draw(i, list) {
    this.clear();
    if (this.objects[i] && list) this.selected.highlight(this.objects[i], this.kind, list);
    this.viewport.invalidate();
  }

  /** Shows what an edit will make of an object; null: nothing. */
  show(i, preview) {
    if (preview) this.preview.preview(this.objects[i], preview);
    else this.preview.clear();
    this.selected.object.visible = !preview;
    this.viewport.invalidate();
  }

  clear() {
    this.selected.clear();
    this.preview.clear();
    this.viewport.invalidate();
  }

  /** Disables picking until the next cage. */
  close() {
    this.clear();
    this.hover();
    delete this.viewport.canvas.dataset.pickable;
    for (const { solid } of this.objects) solid.geometry.dispose();
    this.objects = [];
  }
}
