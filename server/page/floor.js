// A floor under the model with the soft shadow of what stands on it. The shadow is the model's outline from above, drawn
// small and blurred: it costs no shadow map, which software would take long for.
import { CanvasTexture, LinearFilter, Matrix4, Mesh, MeshBasicMaterial, PlaneGeometry, Vector3 } from 'three';

const SIZE = 128;        // pixels of the drawing
const BLUR = 6;
const WIDE = 1.7;        // times the model's largest extent
const TRIANGLES_MOST = 1500;
const STANDS_IN_MOST = 12; // pixels
const AGAIN_MS = 120;    // a moving model's shadow is drawn so often

export class Floor {
  constructor() {
    this.canvas = Object.assign(document.createElement('canvas'), { width: SIZE, height: SIZE });
    this.context = this.canvas.getContext('2d', { willReadFrequently: true }); // by the processor: WebGL in software takes seconds for the path
    this.texture = Object.assign(new CanvasTexture(this.canvas), { minFilter: LinearFilter, generateMipmaps: false }); // it is blurred anyway
    this.object = new Mesh(new PlaneGeometry(1, 1).rotateX(-Math.PI / 2), new MeshBasicMaterial({ map: this.texture, transparent: true, depthWrite: false }));
    this.object.visible = false;
    this.rest = new Vector3();
    this.drawn = 0;
  }

  /** Puts the floor under what is in a box. moved: how far that is from its place at rest. */
  place(box, moved) {
    const size = box.getSize(new Vector3());
    const side = Math.max(size.x, size.z, size.y / 2, 1e-6) * WIDE;
    box.getCenter(this.object.position);
    this.object.position.y = box.min.y - side * 0.004; // below what is flat
    this.object.scale.setScalar(side);
    this.rest = this.object.position.clone().sub(moved);
    this.drawn = 0;
  }

  /** Keeps the floor below what a clip has moved so far, at its height. */
  follow({ x, z }) {
    Object.assign(this.object.position, { x: this.rest.x + x, z: this.rest.z + z });
  }

  /** Draws the shadow of meshes; seldom, while they move. Returns whether it did. */
  draw(meshes, now = performance.now()) {
    if (!this.object.visible || now - this.drawn < AGAIN_MS) return false;
    this.drawn = now;
    const { context } = this;
    context.clearRect(0, 0, SIZE, SIZE);
    context.filter = `blur(${BLUR}px)`;
    context.fillStyle = 'rgb(0 0 0 / 0.5)';
    context.beginPath();
    const total = meshes.reduce((sum, { geometry }) => sum + (geometry.index ?? geometry.attributes.position).count / 3, 0);
    const step = Math.max(1, Math.ceil(total / TRIANGLES_MOST));
    for (const mesh of meshes) this.#add(mesh, step);
    context.fill();
    context.filter = 'none';
    this.texture.needsUpdate = true;
    return true;
  }

  /**
   * Adds every so many triangles of a mesh to the path, all turned the same way. A square somewhere on the triangle stands in
   * for those that are left out: a larger triangle would reach beyond the model where it is long.
   */
  #add(mesh, step) {
    const { index, attributes: { position } } = mesh.geometry;
    const { x, z } = this.object.position;
    const scale = SIZE / this.object.scale.x;
    const toPixels = new Matrix4().makeTranslation(SIZE / 2, 0, SIZE / 2).scale(new Vector3(scale, scale, scale))
      .multiply(new Matrix4().makeTranslation(-x, 0, -z)).multiply(mesh.matrixWorld);
    const [a, b, c] = [new Vector3(), new Vector3(), new Vector3()];
    const { count } = index ?? position;
    for (let i = 0; i + 2 < count; i += 3 * step) {
      [a, b, c].forEach((corner, k) => mesh.getVertexPosition(index ? index.getX(i + k) : i + k, corner).applyMatrix4(toPixels));
      const twiceArea = (b.x - a.x) * (c.z - a.z) - (b.z - a.z) * (c.x - a.x);
      const [second, third] = twiceArea < 0 ? [c, b] : [b, c];
      this.context.moveTo(a.x, a.z);
      this.context.lineTo(second.x, second.z);
      this.context.lineTo(third.x, third.z);
      this.context.closePath();
      if (step === 1) continue;
      const side = Math.min(Math.sqrt(Math.abs(twiceArea) * step), STANDS_IN_MOST);
      let [u, v] = [(i * 0.7549) % 1, (i * 0.5698) % 1]; // evenly, from i to i
      if (u + v > 1) [u, v] = [1 - u, 1 - v];
      this.context.rect(a.x + u * (b.x - a.x) + v * (c.x - a.x) - side / 2, a.z + u * (b.z - a.z) + v * (c.z - a.z) - side / 2, side, side);
    }
  }

  setTheme(name) {
    this.object.material.opacity = name === 'dark' ? 1 : 0.7;
  }
}
