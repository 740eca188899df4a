// A floor under the model with the soft shadow of what stands on it. The shadow is the model's outline from above, drawn
// small and blurred: it costs no shadow map, which software would take long for.
import { CanvasTexture, Mesh, MeshBasicMaterial, PlaneGeometry, Vector3 } from 'three';

const SIZE = 128;        // pixels of the drawing
const BLUR = 6;
const WIDE = 1.7;        // times the model's largest extent
const TRIANGLES_MOST = 6000;
const AGAIN_MS = 120;    // a moving model's shadow is drawn so often

export class Floor {
  constructor() {
    this.canvas = Object.assign(document.createElement('canvas'), { width: SIZE, height: SIZE });
    this.context = this.canvas.getContext('2d', { willReadFrequently: true }); // drawn by the processor: as a texture, the path takes software seconds
    this.texture = new CanvasTexture(this.canvas);
    this.object = new Mesh(new PlaneGeometry(1, 1).rotateX(-Math.PI / 2), new MeshBasicMaterial({ map: this.texture, transparent: true, depthWrite: false }));
    this.object.visible = false;
    this.drawn = 0;
  }

  /** Puts the floor under what is in a box. */
  place(box) {
    const size = box.getSize(new Vector3());
    const side = Math.max(size.x, size.z, size.y / 2, 1e-6) * WIDE;
    box.getCenter(this.object.position);
    this.object.position.y = box.min.y - side * 0.004; // below what is flat
    this.object.scale.setScalar(side);
    this.drawn = 0;
  }

  /** Draws the shadow of meshes; seldom, while they move. */
  draw(meshes, now = performance.now()) {
    if (!this.object.visible || now - this.drawn < AGAIN_MS) return;
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
  }

  /** Adds every so many triangles of a mesh to the path, all turned the same way; larger where some are left out. */
  #add(mesh, step) {
    const { index, attributes: { position } } = mesh.geometry;
    const { x: centreX, z: centreZ } = this.object.position;
    const scale = SIZE / this.object.scale.x;
    const grown = Math.sqrt(step);
    const place = new Vector3();
    const at = (vertex) => {
      mesh.getVertexPosition(vertex, place).applyMatrix4(mesh.matrixWorld);
      return [SIZE / 2 + (place.x - centreX) * scale, SIZE / 2 + (place.z - centreZ) * scale];
    };
    const { count } = index ?? position;
    for (let i = 0; i + 2 < count; i += 3 * step) {
      const corners = [0, 1, 2].map((k) => at(index ? index.getX(i + k) : i + k));
      const [a, b, c] = corners;
      const middle = [0, 1].map((k) => (a[k] + b[k] + c[k]) / 3);
      const isTurned = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) < 0;
      (isTurned ? [a, c, b] : corners).forEach((corner, k) => {
        const [x, y] = corner.map((value, axis) => middle[axis] + (value - middle[axis]) * grown);
        if (k === 0) this.context.moveTo(x, y);
        else this.context.lineTo(x, y);
      });
      this.context.closePath();
    }
  }

  setTheme(name) {
    this.object.material.opacity = name === 'dark' ? 1 : 0.7;
  }
}
