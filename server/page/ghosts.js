// Ghosts of a node in the picture: copies that turn as another interpolation between the keys of its clip has them.
import { AxesHelper, Euler, Group, MathUtils, Matrix4, MeshBasicMaterial, Quaternion } from 'three';

const COLOURS = { slerp: '#2f7de1', euler: '#d9822b' };

/** Where the samples of a table take the node. part: of the clip. */
export function sampled(table, part) {
  const last = table.header.poses - 1;
  const at = Math.min(Math.max(part, 0), 1) * last;
  const of = (k) => new Quaternion(...table.part(Math.min(k, last), 0, 'rotation'));
  return of(Math.floor(at)).slerp(of(Math.floor(at) + 1), at % 1);
}

/** Where Euler angles take it, each interpolated on its own from key to key. A track of such angles goes so itself: the angles of
 *  its keys alone do not tell which way round. */
export function eulered({ times, keys, order, path, isEuler }, time, part) {
  if (isEuler) return sampled(path, part);
  let i = times.findIndex((key) => key > time) - 1;
  if (i === -2) i = times.length - 1;
  const [a, b] = [keys[Math.max(i, 0)], keys[Math.min(i + 1, keys.length - 1)]];
  const span = times[i + 1] - times[i];
  const t = span > 0 ? (time - times[i]) / span : 0;
  const angles = a.map((angle, k) => MathUtils.degToRad(angle + (b[k] - angle) * t));
  return new Quaternion().setFromEuler(new Euler(...angles, order));
}

/** A copy of an object, without its children, with the ghost's material. */
function shell(object, material) {
  const isLine = object.isLine || object.isPoints;
  const copy = isLine ? new Group() : object.clone(false);
  if (copy.isMesh) {
    copy.material = material;
    copy.renderOrder = 4;
  }
  return copy;
}

export class Ghosts {
  #all = []; // [{kind, object, followers: [part of the ghost, object that it follows]}]

  constructor(viewport) {
    this.viewport = viewport;
  }

  clear() {
    for (const { object } of this.#all) {
      object.removeFromParent();
      object.traverse((part) => {
        part.material?.dispose();
        if (part.isLine) part.geometry.dispose(); // only axes own their geometry; meshes share the surface's
      });
    }
    this.#all = [];
    this.viewport.invalidate();
  }

  /** kinds: of COLOURS; data: what eulered takes, the node, and its poses by slerp. */
  make(kinds, data) {
    this.clear();
    this.data = data;
    const node = this.#node;
    for (const kind of node ? kinds : []) {
      const material = new MeshBasicMaterial({ color: COLOURS[kind], transparent: true, opacity: 0.42, depthWrite: false });
      const object = new Group();
      const followers = [];
      const copy = (from, into) => {
        for (const child of from.children.filter(({ isMesh, children }) => isMesh || children.length > 0)) {
          const part = shell(child, material);
          followers.push([part, child]);
          into.add(part);
          copy(child, part);
        }
      };
      const top = shell(node, material);
      top.position.set(0, 0, 0);
      top.quaternion.identity();
      top.scale.set(1, 1, 1);
      object.add(top);
      copy(node, top);
      let hasMesh = false;
      object.traverse((part) => (hasMesh ||= Boolean(part.isMesh)));
      const { camera, controls } = this.viewport;
      if (!hasMesh) object.add(new AxesHelper(camera.position.distanceTo(controls.target) / 12).setColors(COLOURS[kind], COLOURS[kind], COLOURS[kind]));
      Object.assign(object, { matrixAutoUpdate: false, renderOrder: 4 });
      this.viewport.ghosts.add(object);
      this.#all.push({ kind, object, followers });
    }
    this.viewport.invalidate();
  }

  get #node() {
    return this.viewport.model?.nodes.get(this.data.node);
  }

  /** Puts them where they are at a time of a clip. */
  pose(time, duration) {
    const node = this.#all.length > 0 && this.#node;
    if (!node) return;
    this.viewport.scene.updateMatrixWorld();
    for (const { kind, object, followers } of this.#all) {
      for (const [part, of] of followers) for (const member of ['position', 'quaternion', 'scale']) part[member].copy(of[member]);
      const part = duration > 0 ? time / duration : 0;
      const rotation = kind === 'slerp' ? sampled(this.data.slerp, part) : eulered(this.data, time, part);
      object.matrix.compose(node.position, rotation, node.scale).premultiply(node.parent?.matrixWorld ?? new Matrix4());
    }
  }
}
