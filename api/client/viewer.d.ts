// Types of viewer.js, the custom element.
import type { GLTF } from 'three/addons/loaders/GLTFLoader.js';

import type { Tweend } from './tweend.js';

/**
 * Shows a model that is turned by mouse, touch and arrow keys. Attributes:
 * - `model`: the id of a stored model; or `src`: the URL of a file, which the daemon does not store
 * - `base`: the daemon's URL; default: that of the daemon that served the module
 * - `level`: of subdivision
 * - `clip`: the clip that plays, without end; `speed`: how fast
 * - `options`: more parameters of `surface` in the form of a query, as in `creases=auto&retarget=auto`
 * - `auto-rotate`: it turns by itself; `alt`: what is read out in place of the picture
 *
 * Events: `load`, and `error` with the error in its `error`.
 */
export class TweendViewer extends HTMLElement {
  /** The client that asks the daemon: set one with a key where the daemon asks for keys. */
  client: Tweend;
  /** What is shown. */
  readonly gltf: GLTF | undefined;
}

/** Defines the element; default name: `tweend-viewer`. */
export function defineViewer(name?: string): void;

declare global {
  interface HTMLElementTagNameMap {
    'tweend-viewer': TweendViewer;
  }
}
