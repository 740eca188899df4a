// Types of babylon.js, the plugin for Babylon.js.
import type { ISceneLoaderPluginAsync } from '@babylonjs/core/Loading/sceneLoader.js';

import type { SurfaceOptions, Tweend } from './tweend.js';

/**
 * A plugin for `RegisterSceneLoaderPlugin`. Then `ImportMeshAsync`, `AppendSceneAsync` and `LoadAssetContainerAsync` load a stored
 * model by its id as `${id}.tweend`, and with the option `pluginExtension: '.tweend'` any file that tweend reads, by its URL, as
 * a File or as bytes; the daemon does not store it.
 */
export function tweendPlugin(tweend: Tweend, surface?: SurfaceOptions): ISceneLoaderPluginAsync;
