// A plugin of Babylon.js' scene loader for all that tweend reads: files, which the daemon does not store, and stored models.
import { AppendSceneAsync, ImportMeshAsync, LoadAssetContainerAsync } from '@babylonjs/core/Loading/sceneLoader.js';
import { LoadFile } from '@babylonjs/core/Misc/fileTools.js';
import '@babylonjs/loaders/glTF/2.0/index.js';

const MODEL = /([0-9a-f]{32})\.tweend$/;
const GLB = { pluginExtension: '.glb' };

export function tweendPlugin(tweend, surface = {}) {
  /** The daemon's GLB of what loadFile found: a stored model's id, or the bytes of a file. */
  const glbOf = async (found) => {
    const answer = await (typeof found === 'string' ? tweend.surface(found, surface) : tweend.surfaceOf(found, surface));
    return new Uint8Array(await answer.arrayBuffer());
  };
  return {
    name: 'tweend',
    extensions: { '.tweend': { isBinary: true } },

    loadFile(scene, source, rootUrl, onSuccess, onProgress, useArrayBuffer, onError) {
      const found = ArrayBuffer.isView(source) ? source : MODEL.exec(source)?.[1];
      if (!found) return LoadFile(source, onSuccess, onProgress, undefined, true, onError);
      onSuccess(found);
      return null;
    },

    async importMeshAsync(meshNames, scene, found, rootUrl, onProgress) {
      return ImportMeshAsync(await glbOf(found), scene, { ...GLB, meshNames, onProgress });
    },

    async loadAsync(scene, found, rootUrl, onProgress) {
      return AppendSceneAsync(await glbOf(found), scene, { ...GLB, onProgress });
    },

    async loadAssetContainerAsync(scene, found, rootUrl, onProgress) {
      return LoadAssetContainerAsync(await glbOf(found), scene, { ...GLB, onProgress });
    },
  };
}
