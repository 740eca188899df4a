// Files as three.js reads and plays them.
import { AnimationMixer, LoopOnce, Texture } from 'three';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

globalThis.self = globalThis; // the loader looks for a browser's names
globalThis.ProgressEvent ??= class extends Event {};

/** Pixels play no part here, and node has no decoder for them. */
const withoutPixels = () => ({ name: 'without-pixels', loadTexture: async () => new Texture() });

/** glTF as text or bytes, or GLB. */
export async function load(file) {
  const isText = typeof file === 'string' || file[0] === '{'.charCodeAt(0);
  return new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).register(withoutPixels).parseAsync(isText ? file.toString() : new Uint8Array(file).buffer, '');
}

/** In the file's order. */
export const nodesOf = (gltf) => gltf.parser.getDependencies('node');

/** Moves the scene to a time of its first clip; the end holds. */
export function playerOf(gltf) {
  const mixer = new AnimationMixer(gltf.scene);
  const action = mixer.clipAction(gltf.animations[0]);
  action.setLoop(LoopOnce).clampWhenFinished = true;
  action.play();
  return (time) => {
    action.paused = false;
    mixer.setTime(time);
    gltf.scene.updateMatrixWorld(true);
  };
}
