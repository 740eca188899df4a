// The control cage: its polygons' edges, creases coloured by sharpness, extraordinary points.
import {
  BufferAttribute, BufferGeometry, CanvasTexture, Color, Float32BufferAttribute, Group, LineBasicMaterial, Points, PointsMaterial,
} from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';

import { linesOn } from './overlays.js';

const COLOURS = { light: { edge: 0x1f2933, dim: 0x1f2933 }, dark: { edge: 0xe4e9f0, dim: 0xe4e9f0 } };
export const FEW = '#2f7de1';  // valence under 4
export const MANY = '#e0533d'; // over 4

/** The colour of a crease: from yellow (nearly smooth) to red (4 and more); purple where it is infinitely sharp. */
export function creaseColour(sharpness) {
  return sharpness >= 10 ? new Color(0xa3216f) : new Color().setHSL(0.14 - (0.14 * Math.min(sharpness, 4)) / 4, 0.88, 0.5);
}

/** The polygons of a triangle list in FB_ngon_encoding: triangles in turn that begin with one vertex are a fan. */
export function polygonsOf(index) {
  const polygons = [];
  for (let i = 0; i < index.length; i += 3) {
    const [a, b, c] = [index[i], index[i + 1], index[i + 2]];
    const last = polygons.at(-1);
    if (last && last[0] === a && last.at(-1) === b) last.push(c);
    else polygons.push([a, b, c]);
  }
  return polygons;
}

/** One number for all vertices of a mesh that lie at one place: files split them along seams. */
function weld(position) {
  const known = new Map();
  return Uint32Array.from({ length: position.count }, (_, i) => {
    const key = `${position.getX(i)} ${position.getY(i)} ${position.getZ(i)}`;
    if (!known.has(key)) known.set(key, i);
    return known.get(key);
  });
}

/** Edges (index pairs) of all polygons, and for each point its valence where it lies inside. */
export function structure(polygons) {
  const edges = new Map();
  for (const polygon of polygons)
    polygon.forEach((a, i) => {
      const b = polygon[(i + 1) % polygon.length];
      if (a === b) return;
      const key = a < b ? a * 2 ** 26 + b : b * 2 ** 26 + a;
      edges.set(key, (edges.get(key) ?? 0) + 1);
    });
  const valence = new Map();
  const border = new Set();
  for (const [key, faces] of edges)
    for (const point of [Math.floor(key / 2 ** 26), key % 2 ** 26]) {
      valence.set(point, (valence.get(point) ?? 0) + 1);
      if (faces !== 2) border.add(point);
    }
  return {
    edges: [...edges.keys()].flatMap((key) => [Math.floor(key / 2 ** 26), key % 2 ** 26]),
    extraordinary: [...valence].filter(([point, n]) => n !== 4 && !border.has(point)),
  };
}

let dot = null;
function round() {
  if (dot) return dot;
  const canvas = Object.assign(document.createElement('canvas'), { width: 32, height: 32 });
  const context = canvas.getContext('2d');
  context.fillStyle = '#fff';
  context.arc(16, 16, 14, 0, 7);
  context.fill();
  dot = new CanvasTexture(canvas);
  return dot;
}

export class Cage {
  /** model: the GLB of level 0 with polygons=ngon, parsed. creases: {mesh name or '': [{a, b, sharpness}]} by places. */
  constructor({ scene, nodes }, creases) {
    this.object = scene;
    this.nodes = nodes;
    this.lines = new LineBasicMaterial({ transparent: true, opacity: 0.9, depthWrite: false });
    this.hidden = new LineBasicMaterial({ transparent: true, opacity: 0.08, depthTest: false });
    this.sharp = new LineMaterial({ linewidth: 3, vertexColors: true, depthWrite: false, polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2 });
    this.dots = new PointsMaterial({ sizeAttenuation: false, vertexColors: true,
      map: round(), alphaTest: 0.5, transparent: true });
    // A little before their places, or the surface would cut them in half.
    this.dots.onBeforeCompile = (shader) => {
      shader.vertexShader = shader.vertexShader.replace('#include <project_vertex>', '#include <project_vertex>\ngl_Position.z -= 0.0001 * gl_Position.w;');
    };
    this.parts = { cage: [], points: [] };
    this.sharpnesses = new Set();
    this.valences = new Set();
    const meshes = [];
    scene.traverse((object) => object.isMesh && meshes.push(object));
    for (const mesh of meshes) this.add(mesh, creases);
    const marks = this.parts.points.reduce((sum, { geometry }) => sum + geometry.attributes.position.count, 0);
    this.dots.size = marks > 10000 ? 2 : marks > 2000 ? 3 : marks > 300 ? 5 : 9;
    if (creases['']) this.parts.cage.push(this.creases(scene, creases['']));
  }

  add(mesh, creases) {
    const { position } = mesh.geometry.attributes;
    const same = weld(position);
    const index = mesh.geometry.index?.array ?? Uint32Array.from({ length: position.count }, (_, i) => i);
    const { edges, extraordinary } = structure(polygonsOf(index).map((polygon) => polygon.map((i) => same[i])));
    mesh.material = new LineBasicMaterial({ visible: false });
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', position);
    geometry.setIndex(edges);
    const hidden = linesOn(mesh, geometry, this.hidden);
    hidden.renderOrder = 1;
    this.parts.cage.push(linesOn(mesh, geometry, this.lines), hidden);
    if (extraordinary.length > 0) this.parts.points.push(this.points(mesh, extraordinary));
    const own = creases[mesh.userData.mesh];
    if (own) this.parts.cage.push(this.creases(mesh, own));
  }

  points(mesh, extraordinary) {
    const geometry = new BufferGeometry();
    const pick = (name) => {
      const from = mesh.geometry.attributes[name];
      const values = extraordinary.flatMap(([i]) => Array.from({ length: from.itemSize }, (_, k) => from.getComponent(i, k)));
      geometry.setAttribute(name, name === 'skinIndex' ? new BufferAttribute(new Uint16Array(values), 4) : new Float32BufferAttribute(values, from.itemSize));
    };
    pick('position');
    if (mesh.isSkinnedMesh) ['skinIndex', 'skinWeight'].forEach(pick);
    const [few, many] = [new Color(FEW), new Color(MANY)];
    geometry.setAttribute('color', new Float32BufferAttribute(extraordinary.flatMap(([, n]) => (n < 4 ? few : many).toArray()), 3));
    for (const [, n] of extraordinary) this.valences.add(n < 4 ? 'few' : 'many');
    const points = new Points(geometry, this.dots);
    if (mesh.isSkinnedMesh)
      Object.assign(points, { isSkinnedMesh: true, skeleton: mesh.skeleton, bindMatrix: mesh.bindMatrix,
        bindMatrixInverse: mesh.bindMatrixInverse, bindMode: mesh.bindMode, frustumCulled: false });
    points.renderOrder = 2;
    mesh.add(points);
    return points;
  }

  creases(parent, list) {
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(list.flatMap(({ a, b }) => [...a, ...b]));
    geometry.setColors(list.flatMap(({ sharpness }) => creaseColour(sharpness).toArray().flatMap((c, i, all) => (i ? [] : [...all, ...all]))));
    for (const { sharpness } of list) this.sharpnesses.add(sharpness);
    const lines = new LineSegments2(geometry, this.sharp);
    lines.renderOrder = 1;
    parent.add(lines);
    return lines;
  }

  setTheme(name) {
    this.lines.color.set(COLOURS[name].edge);
    this.hidden.color.set(COLOURS[name].dim);
  }

  show(cage, points) {
    for (const part of this.parts.cage) part.visible = cage;
    for (const part of this.parts.points) part.visible = points;
  }

  dispose() {
    this.object.traverse((object) => object.geometry?.dispose());
    for (const material of [this.lines, this.hidden, this.sharp, this.dots]) material.dispose();
  }
}

const finite = (points) => points.every((p) => p && p.length >= 3 && p.every(Number.isFinite));

/** What an OBJ or tweend JSON says of creases, as places: {mesh name: [{a, b, sharpness}]}. An OBJ's bear no name. */
export function creasesOf(format, text) {
  const found = {};
  const put = (name, a, b, sharpness) => {
    if (sharpness > 0 && finite([a, b])) (found[name] ??= []).push({ a, b, sharpness });
  };
  if (format === 'tweend') {
    for (const [i, { name, positions = [], creases = [] }] of (JSON.parse(text).meshes ?? []).entries())
      for (const { edge, sharpness } of creases) put(name ?? `mesh_${i}`, positions[edge[0]], positions[edge[1]], sharpness);
  } else if (format === 'obj') {
    const points = [];
    for (const line of text.split('\n')) {
      const words = line.trim().split(/\s+/);
      if (words[0] === 'v') points.push(words.slice(1, 4).map(Number));
      else if (words[0] === 't' && words[1] === 'crease') {
        const [ints, floats] = words[2].split('/').map(Number);
        const ends = words.slice(3, 3 + ints).map(Number);
        const sharpness = words.slice(3 + ints, 3 + ints + floats).map(Number);
        // A tag is one edge, or a chain of them with a sharpness each.
        for (let i = 0; i + 1 < ends.length; i++)
          put('', points[ends[i]], points[ends[i + 1]], sharpness[Math.min(i, sharpness.length - 1)]);
      }
    }
  }
  return found;
}
