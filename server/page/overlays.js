// Overlays of a surface: the edges of its faces, its normals, the tree of nodes, a checker along its UVs.
import {
  BufferAttribute, BufferGeometry, CanvasTexture, Color, Float32BufferAttribute, Group, LineBasicMaterial, LineSegments, MeshStandardMaterial, NearestFilter,
  Points, PointsMaterial, RepeatWrapping, SRGBColorSpace, Vector3,
} from 'three';

/** Adds lines or points that follow a mesh, including its skin. The renderer skins any object that has a skeleton. */
export function addTo(mesh, object) {
  const { geometry } = object;
  if (mesh.isSkinnedMesh) {
    Object.assign(object, { isSkinnedMesh: true, skeleton: mesh.skeleton, bindMatrix: mesh.bindMatrix,
      bindMatrixInverse: mesh.bindMatrixInverse, bindMode: mesh.bindMode, frustumCulled: false });
    for (const name of ['skinIndex', 'skinWeight'])
      if (!geometry.attributes[name]) geometry.setAttribute(name, mesh.geometry.attributes[name]);
  }
  mesh.add(object);
  return object;
}

/** How what is seen through the surface is drawn. */
export const THROUGH = { depthTest: false, transparent: true };

/** A geometry of places, [x, y, z, …], with an index of triangles where one is given. */
export function geometryOf(places, index) {
  const geometry = new BufferGeometry().setAttribute('position', new Float32BufferAttribute(places, 3));
  return index ? geometry.setIndex(index) : geometry;
}

export const linesOn = (mesh, geometry, material) => addTo(mesh, new LineSegments(geometry, material));

/** Gives a geometry the morph targets of a mesh; pick(attribute) selects the values of the geometry's vertices. */
export function morphAs(geometry, mesh, pick = (attribute) => attribute) {
  const { position } = mesh.geometry.morphAttributes;
  if (position) Object.assign(geometry, { morphTargetsRelative: true, morphAttributes: { position: position.map(pick) } });
  return geometry;
}

/** A geometry of some vertices of a mesh, with their skin and morph targets. */
export function pick(mesh, vertices) {
  const geometry = morphAs(new BufferGeometry(), mesh, (from) =>
    new Float32BufferAttribute(vertices.flatMap((i) => [from.getX(i), from.getY(i), from.getZ(i)]), 3));
  for (const name of mesh.isSkinnedMesh ? ['position', 'skinIndex', 'skinWeight'] : ['position']) {
    const from = mesh.geometry.attributes[name];
    const values = vertices.flatMap((i) => Array.from({ length: from.itemSize }, (_, k) => from.getComponent(i, k)));
    geometry.setAttribute(name, name === 'skinIndex' ? new BufferAttribute(new Uint16Array(values), 4) : new Float32BufferAttribute(values, from.itemSize));
  }
  return geometry;
}

export const meshesOf = (root) => {
  const meshes = [];
  root.traverse((object) => object.isMesh && meshes.push(object));
  return meshes;
};

/** The vertices of a geometry's triangles, three of each. */
export const cornersOf = ({ index, attributes: { position } }) => index?.array ?? Uint32Array.from({ length: position.count }, (_, i) => i);

/** Index pairs of the edges of a triangle list. quads: each two triangles make one face, without the edge that they
 *  share. */
function edgesOf(index, quads) {
  const edges = [];
  for (let i = 0; i + 2 < index.length; i += quads ? 6 : 3) {
    const sides = [];
    for (let t = i; t < Math.min(i + (quads ? 6 : 3), index.length); t += 3)
      for (let k = 0; k < 3; k++) sides.push([index[t + k], index[t + ((k + 1) % 3)]]);
    for (const [a, b] of sides) if (!sides.some(([c, d]) => c === b && d === a)) edges.push(a, b);
  }
  return edges;
}

class Overlay {
  constructor(root) {
    this.root = root;
    this.parts = [];
  }

  show(visible) {
    if (visible && this.parts.length === 0) this.parts = meshesOf(this.root).map((mesh) => this.make(mesh));
    for (const part of this.parts) part.visible = visible;
  }

  dispose() {
    this.material.dispose();
    for (const part of this.parts) part.geometry.dispose();
  }
}

export class Wireframe extends Overlay {
  constructor(root, { quads }) {
    super(root);
    this.quads = quads;
    this.material = new LineBasicMaterial({ transparent: true, opacity: 0.55 });
  }

  make(mesh) {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', mesh.geometry.attributes.position);
    geometry.setIndex(edgesOf(cornersOf(mesh.geometry), this.quads));
    return linesOn(mesh, geometry, this.material);
  }

  setTheme(name) {
    this.material.color.set(name === 'dark' ? 0x0b0d10 : 0x2b3340);
  }
}

const NORMALS_MOST = 20000;

export class Normals extends Overlay {
  constructor(root) {
    super(root);
    this.material = new LineBasicMaterial({ color: 0x2f9e6b });
  }

  make(mesh) {
    const { position, normal } = mesh.geometry.attributes;
    mesh.geometry.computeBoundingSphere();
    const length = mesh.geometry.boundingSphere.radius / 25;
    const vertices = []; // each twice: where a line begins and where it ends
    for (let i = 0; normal && i < position.count; i += Math.ceil(position.count / NORMALS_MOST)) vertices.push(i, i);
    const geometry = pick(mesh, vertices);
    const [from, along] = [new Vector3(), new Vector3()];
    for (let k = 1; k < vertices.length; k += 2) {
      along.fromBufferAttribute(normal, vertices[k]).normalize();
      geometry.attributes.position.setXYZ(k, ...from.fromBufferAttribute(position, vertices[k]).addScaledVector(along, length));
    }
    return linesOn(mesh, geometry, this.material);
  }
}

/** Draws nodes as points, with a line from each to its parent, visible through the surface. */
export class Skeleton {
  constructor(nodes) {
    const known = new Set(nodes.values());
    this.joints = [...known];
    this.bones = this.joints.filter((object) => known.has(object.parent)).map((object) => [object.parent, object]);
    const geometry = (count) => geometryOf(new Float32Array(3 * count));
    this.lines = new LineSegments(geometry(2 * this.bones.length), new LineBasicMaterial({ color: 0xd9822b, ...THROUGH }));
    this.points = new Points(geometry(this.joints.length), new PointsMaterial({ color: 0xd9822b, size: 6, sizeAttenuation: false, ...THROUGH }));
    this.object = new Group().add(this.lines, this.points);
    for (const part of this.object.children) Object.assign(part, { frustumCulled: false, renderOrder: 3 });
    this.object.visible = false;
  }

  update() {
    if (!this.object.visible) return;
    const at = new Vector3();
    const place = (attribute, i, object) => attribute.setXYZ(i, ...at.setFromMatrixPosition(object.matrixWorld));
    const [lines, points] = [this.lines.geometry.attributes.position, this.points.geometry.attributes.position];
    this.joints.forEach((joint, i) => place(points, i, joint));
    this.bones.forEach(([from, to], i) => [from, to].forEach((end, k) => place(lines, 2 * i + k, end)));
    lines.needsUpdate = points.needsUpdate = true;
  }
}

let checker = null;

/** One material for all meshes with UVs: squares of a sixteenth, whose hue and lightness tell their place along u and
 *  v. */
export function checkered() {
  if (checker) return checker;
  const size = 16;
  const canvas = Object.assign(document.createElement('canvas'), { width: size, height: size });
  const context = canvas.getContext('2d');
  const colour = new Color();
  for (let x = 0; x < size; x++)
    for (let y = 0; y < size; y++) {
      context.fillStyle = `#${colour.setHSL(x / size, 0.45, (x + y) % 2 ? 0.42 + y / 60 : 0.68 + y / 80).getHexString()}`;
      context.fillRect(x, y, 1, 1);
    }
  const map = new CanvasTexture(canvas);
  Object.assign(map, { magFilter: NearestFilter, wrapS: RepeatWrapping, wrapT: RepeatWrapping, colorSpace: SRGBColorSpace, flipY: false });
  checker = new MeshStandardMaterial({ map, roughness: 0.8, metalness: 0, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
  return checker;
}
