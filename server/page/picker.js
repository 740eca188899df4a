// Picks faces, edges and points of the control cage in the viewport. Their indices are those that edits use.
import {
  BufferGeometry, DoubleSide, Float32BufferAttribute, Mesh, MeshBasicMaterial, Points, PointsMaterial, Raycaster, Vector2, Vector3,
} from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';

import { polygonsOf } from './polygons.js';

const COLOUR = 0xf08a00;
const STILL = 5;  // pixels that the pointer may move during a click
const REACH = 7;  // pixels beside the cage at which a click still hits it
const AROUND = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]];
const MESSAGE = { depthTest: false, transparent: true };

/** The meshes of a GLB of level 0 with polygons=ngon, as edits see them: [{points: [Vector3], faces: [[point]]}]. */
export function readCages(parser) {
  const array = async (accessor) => (accessor === undefined ? null : (await parser.getDependency('accessor', accessor)).array);
  return Promise.all((parser.json.meshes ?? []).map(async ({ primitives: all, extras }) => {
    const primitives = all.filter(({ mode = 4 }) => mode === 4); // triangles only: an uploaded file may have lines and points too
    if (primitives.length === 0) return { points: [], faces: [] };
    const pointOf = await array(extras?.tweend?.points); // the point of each vertex: UVs split points
    const faceAt = await array(extras?.tweend?.faces); // the face of each polygon: primitives group faces by material, and holes come last
    const position = await parser.getDependency('accessor', primitives[0].attributes.POSITION); // shared by all primitives
    const [points, faces] = [[], []];
    let count = 0;
    for (const { indices } of [...primitives, ...(extras?.tweend?.holes ?? [])]) {
      for (const polygon of polygonsOf(await array(indices))) {
        const face = polygon.map((vertex) => pointOf?.[vertex] ?? vertex);
        face.forEach((point, i) => (points[point] ??= new Vector3().fromBufferAttribute(position, polygon[i])));
        faces[faceAt?.[count] ?? count] = face;
        count++;
      }
    }
    return { points: Array.from(points, (point) => point ?? new Vector3()), faces }; // an uploaded file may have points without faces
  }));
}

const edgesOf = (face) => face.map((a, i) => [a, face[(i + 1) % face.length]]);
const sameEdge = ([a, b], [c, d]) => (a === c && b === d) || (a === d && b === c);

/** Whether two entries of a selection are the same element. */
export const isSame = (a, b) => (Array.isArray(a) ? sameEdge(a, b) : a === b);

export class Picker {
  /** onPick(object, element, more) is called for a click or tap on the cage. element: null when it hits nothing. more:
   *  with Shift, or by touch, which has no Shift. */
  constructor(viewport, onPick) {
    Object.assign(this, { viewport, onPick, objects: [], kind: 'faces', isOn: false });
    this.fill = new MeshBasicMaterial({ color: COLOUR, opacity: 0.45, side: DoubleSide, ...MESSAGE });
    this.line = new LineMaterial({ color: COLOUR, linewidth: 4, ...MESSAGE });
    this.dot = new PointsMaterial({ color: COLOUR, size: 9, sizeAttenuation: false, ...MESSAGE });
    const { canvas } = viewport;
    canvas.addEventListener('pointerdown', ({ clientX, clientY }) => (this.down = [clientX, clientY]));
    canvas.addEventListener('pointerup', (event) => this.#click(event));
  }

  /** cages: from readCages; bearers: [object, index of its cage] for the objects that show them. */
  setCages(cages, bearers) {
    this.viewport.canvas.dataset.pickable = '';
    this.objects = bearers.map(([object, mesh]) => {
      const { points, faces } = cages[mesh];
      const faceOf = []; // the face of each triangle
      const index = faces.flatMap((face, k) => face.slice(2).flatMap((c, at) => {
        faceOf.push(k);
        return [face[0], face[at + 1], c];
      }));
      const geometry = new BufferGeometry().setFromPoints(points).setIndex(index);
      return { points, faces, faceOf, object, mesh, solid: new Mesh(geometry, this.fill) };
    });
  }

  #click(event) {
    if (!this.isOn || event.button !== 0 || !this.down) return;
    const { clientX: x, clientY: y, shiftKey, pointerType } = event;
    if (Math.hypot(x - this.down[0], y - this.down[1]) > STILL || this.viewport.isBeside(x)) return;
    const box = this.viewport.canvas.getBoundingClientRect();
    for (const [dx, dy] of AROUND) {
      const at = new Vector2(((x + dx * REACH - box.left) / box.width) * 2 - 1, 1 - ((y + dy * REACH - box.top) / box.height) * 2);
      const found = this.#hit(at);
      if (found) return this.onPick(found.object, this.#element(found), shiftKey || pointerType === 'touch');
    }
    this.onPick(0, null, shiftKey);
  }

  /** The nearest face at a place of the picture, in coordinates from -1 to 1. */
  #hit(at) {
    const ray = new Raycaster();
    ray.setFromCamera(at, this.viewport.camera);
    const hits = this.objects.flatMap(({ solid, object, faceOf }, i) => {
      solid.matrixWorld.copy(object.matrixWorld);
      return ray.intersectObject(solid).map(({ distance, point, faceIndex }) => ({ object: i, distance, point, face: faceOf[faceIndex] }));
    });
    return hits.sort((a, b) => a.distance - b.distance)[0];
  }

  #element({ object: i, face, point }) {
    const { points, faces, object } = this.objects[i];
    const corners = faces[face];
    const place = object.worldToLocal(point.clone());
    const nearest = (list, distance) => list.reduce((best, entry) => (distance(entry) < distance(best) ? entry : best));
    if (this.kind === 'faces') return face;
    if (this.kind === 'vertices') return nearest(corners, (i) => points[i].distanceTo(place));
    const away = ([a, b]) => {
      const along = points[b].clone().sub(points[a]);
      const part = place.clone().sub(points[a]).dot(along) / Math.max(along.lengthSq(), 1e-30);
      return points[a].clone().addScaledVector(along, Math.min(Math.max(part, 0), 1)).distanceTo(place);
    };
    return nearest(edgesOf(corners), away);
  }

  /** The elements of a selection as a list; null when only the daemon can tell. */
  resolve(object, selection) {
    const { points, faces } = this.objects[object];
    const all = { faces: () => faces.map((_, i) => i), vertices: () => points.map((_, i) => i), edges: () => this.edges(object) };
    if (Array.isArray(selection)) return selection.filter((element) => this.#exists(object, element));
    return selection === 'all' ? all[this.kind]() : null;
  }

  #exists(object, element) {
    const { points, faces } = this.objects[object];
    if (this.kind === 'edges') return Array.isArray(element) && element.length === 2 && element.every((i) => i in points);
    return element in (this.kind === 'faces' ? faces : points);
  }

  edges(object) {
    const known = new Map();
    for (const edge of this.objects[object].faces.flatMap(edgesOf)) known.set(String([...edge].sort((a, b) => a - b)), edge);
    return [...known.values()];
  }

  /** Highlights elements of an object. */
  draw(i, list) {
    this.clear();
    const { points, faces, object } = this.objects[i] ?? {};
    if (object && list?.length > 0) {
      if (this.kind === 'faces') {
        const index = list.flatMap((face) => faces[face].slice(2).flatMap((c, at) => [faces[face][0], faces[face][at + 1], c]));
        this.drawn = new Mesh(new BufferGeometry().setFromPoints(points).setIndex(index), this.fill);
      } else if (this.kind === 'edges') {
        this.drawn = new LineSegments2(new LineSegmentsGeometry().setPositions(list.flatMap(([a, b]) => [...points[a], ...points[b]])), this.line);
      } else {
        const places = new Float32BufferAttribute(list.flatMap((i) => [...points[i]]), 3);
        this.drawn = new Points(new BufferGeometry().setAttribute('position', places), this.dot);
      }
      this.drawn.renderOrder = 4;
      object.add(this.drawn);
    }
    this.viewport.invalidate();
  }

  clear() {
    this.drawn?.removeFromParent();
    this.drawn?.geometry.dispose();
    this.drawn = null;
    this.viewport.invalidate();
  }

  /** Disables picking until the next cage. */
  close() {
    this.clear();
    delete this.viewport.canvas.dataset.pickable;
    for (const { solid } of this.objects) solid.geometry.dispose();
    this.objects = [];
  }
}
