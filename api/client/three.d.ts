// Types of three.js, the loader for three.js.
import type { FileLoader, LoadingManager } from 'three';
import { Loader } from 'three';
import type { GLTF, GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

import type { ModelId, SurfaceOptions, Tweend } from './tweend.js';

/** Loads what tweend reads (OBJ, STL, PLY, BVH, glTF, GLB, tweend JSON) as its surface, with the result of GLTFLoader. */
export class TweendLoader extends Loader<GLTF> {
  constructor(manager?: LoadingManager);
  /** Reads files before they go to the daemon. */
  readonly files: FileLoader;
  /** Reads the daemon's GLB: for `encoding: 'meshopt'` it needs `setMeshoptDecoder`. */
  readonly gltf: GLTFLoader;
  /** The client that asks the daemon. Default: of the daemon that served this module. */
  setClient(tweend: Tweend): this;
  /** Level, rules and clips of the surfaces. */
  setSurface(options: SurfaceOptions): this;
  /** url: of a file, which the daemon does not store; or the id of a stored model. */
  load(url: string, onLoad: (gltf: GLTF) => void, onProgress?: (event: ProgressEvent) => void, onError?: (error: unknown) => void): void;
  /** Loads a stored model; the manager is told nothing. */
  modelAsync(model: ModelId): Promise<GLTF>;
  /** bytes: a file's content, or its text. */
  parse(bytes: ArrayBuffer | string, path: string, onLoad: (gltf: GLTF) => void, onError?: (error: unknown) => void): void;
  parseAsync(bytes: ArrayBuffer | string, path?: string): Promise<GLTF>;
  /** Calls off what is being loaded. */
  abort(): this;
}
