// Draws the control cage: the edges of its polygons, creases coloured by sharpness, extraordinary points.
import {
  BufferAttribute, BufferGeometry, CanvasTexture, Color, Float32BufferAttribute, LineBasicMaterial, LinearFilter, Points, PointsMaterial, Vector3,
} from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';

import { addTo, cornersOf, linesOn, meshesOf, morphAs, pick } from './overlays.js';
import { polygonsOf, structure } from './polygons.js';

const COLOURS = { light: 0x1f2933, dark: 0xe4e9f0 };
export const FEW = '#2f7de1';  // valence below 4
export const MANY = '#e0533d'; // valence above 4

/** The colour of a crease: from yellow (nearly smooth) to red (sharpness 4 and more); purple when infinitely sharp. */
export function creaseColour(sharpness) {
  return sharpness >= 10 ? new Color(0xa3216f) : new Color().setHSL(0.14 - (0.14 * Math.min(sharpness, 4)) / 4, 0.88, 0.5);
}

/** Maps each vertex to the first one at the same place: files split vertices along seams. */
function weld(position) {
  const known = new Map();
  return Uint32Array.from({ length: position.count }, (_, i) => {
    const key = `${position.getX(i)} ${position.getY(i)} ${position.getZ(i)}`;
    if (!known.has(key)) known.set(key, i);
    return known.get(key);
  });
}

/** For each vertex a measure of the distance between its lines: the geometric mean of its shortest and its mean edge.
 *  edges: pairs of vertices. */
function spacingOf(position, edges) {
  const shortest = new Float32Array(position.count).fill(Infinity);
  const sums = new Float32Array(position.count);
  const counts = new Uint32Array(position.count);
  const [a, b] = [new Vector3(), new Vector3()];
  for (let i = 0; i < edges.length; i += 2) {
    const length = a.fromBufferAttribute(position, edges[i]).distanceTo(b.fromBufferAttribute(position, edges[i + 1]));
    for (const vertex of [edges[i], edges[i + 1]]) {
      shortest[vertex] = Math.min(shortest[vertex], length);
      sums[vertex] += length;
      counts[vertex]++;
    }
  }
  return sums.map((sum, i) => (counts[i] > 0 ? Math.sqrt((shortest[i] * sum) / counts[i]) : 0));
}

/** Makes a material fade where the attribute `spacing` is small on the screen, so that a dense cage does not hide the
 *  surface: from 4 % of half the picture's height down to 1 %. bias: depth offset towards the camera. */
function fadeWhereDense(material, bias) {
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = `attribute float spacing;\nvarying float seen;\n${shader.vertexShader}`.replace('#include <project_vertex>', `#include <project_vertex>
      float apart = spacing * length(modelViewMatrix[0].xyz) * projectionMatrix[1][1] / gl_Position.w;
      seen = mix(0.1, 1.0, smoothstep(0.01, 0.04, apart));
      gl_Position.z -= float(${bias}) * gl_Position.w;`);
    if (!shader.vertexShader.includes('<skinning_vertex>'))
      shader.vertexShader = shader.vertexShader.replace('#include <common>', '#include <common>\n#include <skinning_pars_vertex>')
        .replace('#include <begin_vertex>', '#include <skinbase_vertex>\n#include <begin_vertex>\n#include <skinning_vertex>'); // the shader of points has no skinning
    shader.fragmentShader = `varying float seen;\n${shader.fragmentShader}`.replace('#include <color_fragment>', '#include <color_fragment>\ndiffuseColor.a *= seen;');
  };
}

let dot = null;
function round() {
  if (dot) return dot;
  const canvas = Object.assign(document.createElement('canvas'), { width: 16, height: 16 });
  const context = canvas.getContext('2d', { willReadFrequently: true }); // drawn by the processor, at once
  context.fillStyle = '#fff';
  context.arc(8, 8, 7, 0, 7);
  context.fill();
  dot = Object.assign(new CanvasTexture(canvas), { minFilter: LinearFilter, generateMipmaps: false });
  return dot;
}

export class Cage {
  /** of: the model's id. Then the parsed GLB of level 0 with polygons=ngon. bearers: those of its bearers that have faces. creases:
   *  what creasesOf finds in it. */
  constructor(of, { scene, nodes, morphs, parser }, bearers, creases) {
    Object.assign(this, { of, object: scene, nodes, morphs, parser, bearers });
    this.lines = new LineBasicMaterial({ transparent: true, opacity: 0.9, depthWrite: false });
    this.hidden = new LineBasicMaterial({ transparent: true, opacity: 0.08, depthTest: false });
    this.sharp = new LineMaterial({ linewidth: 3, vertexColors: true, depthWrite: false, polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2 });
    this.thin = new LineBasicMaterial({ vertexColors: true, depthWrite: false, transparent: true }); // transparent, so drawn after the edges
    this.dots = new PointsMaterial({ sizeAttenuation: false, vertexColors: true,
      map: round(), alphaTest: 0.5, transparent: true });
    fadeWhereDense(this.lines, 0);
    fadeWhereDense(this.hidden, 0);
    fadeWhereDense(this.dots, 0.0001); // otherwise the surface would hide half of each dot
    this.parts = { cage: [], points: [] };
    this.sharpnesses = new Set();
    this.valences = new Set();
    for (const mesh of meshesOf(scene)) this.add(mesh);
    scene.updateMatrixWorld(true);
    for (const [node, index] of bearers) if (creases[index].length > 0) this.parts.cage.push(this.creases(meshesOf(node)[0], creases[index])); // all of its primitives share their vertices
    const marks = this.parts.points.reduce((sum, { geometry }) => sum + geometry.attributes.position.count, 0);
    this.dots.size = marks > 10000 ? 2 : marks > 2000 ? 3 : marks > 300 ? 5 : 9;
  }

  add(mesh) {
    const { position } = mesh.geometry.attributes;
    const same = weld(position);
    const { edges, extraordinary } = structure(polygonsOf(cornersOf(mesh.geometry)).map((polygon) => polygon.map((i) => same[i])));
    mesh.material = new LineBasicMaterial({ visible: false });
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', position);
    morphAs(geometry, mesh);
    geometry.setIndex(edges);
    const spacing = spacingOf(position, edges);
    geometry.setAttribute('spacing', new BufferAttribute(spacing, 1));
    const hidden = linesOn(mesh, geometry, this.hidden);
    hidden.renderOrder = 1;
    this.parts.cage.push(linesOn(mesh, geometry, this.lines), hidden);
    if (extraordinary.length > 0) this.parts.points.push(this.points(mesh, extraordinary, spacing));
  }

  points(mesh, extraordinary, spacing) {
    const geometry = pick(mesh, extraordinary.map(([i]) => i));
    geometry.setAttribute('spacing', new Float32BufferAttribute(extraordinary.map(([i]) => spacing[i]), 1));
    const [few, many] = [new Color(FEW), new Color(MANY)];
    geometry.setAttribute('color', new Float32BufferAttribute(extraordinary.flatMap(([, n]) => (n < 4 ? few : many).toArray()), 3));
    for (const [, n] of extraordinary) this.valences.add(n < 4 ? 'few' : 'many');
    return addTo(mesh, Object.assign(new Points(geometry, this.dots), { renderOrder: 2 }));
  }

  /** Adds wide lines. A skinned mesh gets thin ones, as wide lines cannot be skinned. */
  creases(mesh, list) {
    const colours = list.flatMap(({ sharpness }) => {
      const colour = creaseColour(sharpness).toArray();
      return [...colour, ...colour];
    });
    for (const { sharpness } of list) this.sharpnesses.add(sharpness);
    const ends = pick(mesh, list.flatMap(({ edge }) => edge));
    if (mesh.isSkinnedMesh) {
      ends.setAttribute('color', new Float32BufferAttribute(colours, 3));
      return Object.assign(linesOn(mesh, ends, this.thin), { renderOrder: 1 });
    }
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(ends.attributes.position.array);
    geometry.setColors(colours);
    const lines = Object.assign(new LineSegments2(geometry, this.sharp), { renderOrder: 1 });
    mesh.add(lines);
    return lines;
  }

  setTheme(name) {
    this.lines.color.set(COLOURS[name]);
    this.hidden.color.set(COLOURS[name]);
  }

  show(cage, points) {
    for (const part of this.parts.cage) part.visible = cage;
    for (const part of this.parts.points) part.visible = points;
  }

  dispose() {
    this.object.removeFromParent();
    this.object.traverse((object) => {
      object.geometry?.dispose();
      object.skeleton?.dispose();
    });
    for (const material of [this.lines, this.hidden, this.sharp, this.thin, this.dots]) material.dispose();
  }
}

/** The creases of each mesh of a GLB of level 0 with polygons=ngon: [{edge: two vertices, sharpness}]. */
export function creasesOf(parser) {
  const array = async (accessor) => (await parser.getDependency('accessor', accessor)).array;
  return Promise.all((parser.json.meshes ?? []).map(async ({ extras }) => {
    const { points, creases } = extras?.tweend ?? {};
    if (!creases) return [];
    const [ends, sharpness] = await Promise.all([array(creases.edges), array(creases.sharpness)]);
    const vertexOf = new Map(); // by point: UVs split points
    if (points !== undefined) (await array(points)).forEach((point, vertex) => vertexOf.set(point, vertex));
    const vertex = (point) => vertexOf.get(point) ?? point;
    return [...sharpness].map((value, i) => ({ edge: [vertex(ends[2 * i]), vertex(ends[2 * i + 1])], sharpness: value }));
  }));
}
