// What a page with three.js does, without the picture: loads files and stored models, with a manager that counts.
import { LoadingManager, type Mesh } from 'three';
import { Tweend } from 'tweend';
import { TweendLoader } from 'tweend/three';

export async function run(url: string, obj: string): Promise<object> {
  const tweend = new Tweend(url);
  const told: string[] = [];
  const manager = new LoadingManager(() => told.push('all'), undefined, () => told.push('failed'));
  const loader = new TweendLoader(manager).setClient(tweend).setSurface({ level: 2 });
  // @ts-expect-error: no such scheme
  loader.setSurface({ level: 2, scheme: 'cubic' });
  // @ts-expect-error: a URL is text
  const faulty = () => loader.load(3, () => {});
  loader.setSurface({ level: 2 });
  const facesOf = (scene: { traverse(visit: (object: object) => void): void }) => {
    let faces = 0;
    scene.traverse((object) => (faces += ((object as Mesh).geometry?.index?.count ?? 0) / 3));
    return faces;
  };
  const parsed = await loader.parseAsync(obj);
  const { id } = await tweend.upload(obj);
  const stored = await loader.loadAsync(id);
  if (facesOf((await loader.modelAsync({ id })).scene) !== facesOf(stored.scene)) throw new Error('the same model has other faces');
  const file = await loader.loadAsync(tweend.sourceUrl(id));
  const missing: unknown = await loader.loadAsync('0'.repeat(32)).catch((error: Error) => error.name);
  const broken: unknown = await loader.parseAsync('v 0 0 x').catch((error: Error) => error.name);
  const left = loader.loadAsync(id).catch((error: Error) => error.name);
  loader.abort();
  return { faces: [parsed, stored, file].map(({ scene }) => facesOf(scene)), missing, broken, left: await left, told, faulty: faulty.length };
}
