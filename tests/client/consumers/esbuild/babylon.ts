// What a page with Babylon.js does, without the picture.
import { NullEngine } from '@babylonjs/core/Engines/nullEngine.js';
import { ImportMeshAsync, LoadAssetContainerAsync, RegisterSceneLoaderPlugin, AppendSceneAsync } from '@babylonjs/core/Loading/sceneLoader.js';
import { Scene } from '@babylonjs/core/scene.js';
import { Tweend } from 'tweend';
import { tweendPlugin } from 'tweend/babylon';

export async function run(url: string, tank: string): Promise<object> {
  const tweend = new Tweend(url);
  RegisterSceneLoaderPlugin(tweendPlugin(tweend, { level: 1 }));
  // @ts-expect-error: a level is a number
  const faulty = () => tweendPlugin(tweend, { level: 'high' });
  const model = await tweend.upload(tank);
  const scene = new Scene(new NullEngine());
  const { meshes, animationGroups } = await ImportMeshAsync(`${model.id}.tweend`, scene);
  const faces = meshes.reduce((sum, mesh) => sum + mesh.getTotalIndices() / 3, 0);
  const container = await LoadAssetContainerAsync(new TextEncoder().encode(tank), scene, { pluginExtension: '.tweend' });
  const player = await tweend.play(model, container, { clip: 'drive' });
  player.update(0);
  const before = scene.meshes.length;
  await AppendSceneAsync(tweend.sourceUrl(model), scene, { pluginExtension: '.tweend' });
  const missing: unknown = await ImportMeshAsync(`${'0'.repeat(32)}.tweend`, scene).catch((error: Error) => /no model/.test(error.message) || error.message);
  return {
    faces, groups: animationGroups.map(({ name }) => name), same: container.meshes.length === meshes.length, unmoved: player.missing,
    appended: scene.meshes.length - before === meshes.length, missing, faulty: faulty.length,
  };
}
