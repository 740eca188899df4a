// What users of the types write; what may not compile says so.
import { LivePlayer, Player, Tweend, TweendError, type Edit, type Layer, type PoseOptions, type SurfaceOptions } from '../../api/client/tweend.js';

const tweend = new Tweend('https://models.example/', { key: 'k' });

export async function surfaces(file: File): Promise<number> {
  const model = await tweend.upload(file, { onProgress: (sent, total) => console.log(sent / total) });
  const options: SurfaceOptions = { level: 2, scheme: 'loop', crease_sharpness: 'infinite', weld: 0.001, limit: true };
  const faces: number = (await tweend.surfaceCounts(model, options)).faces;
  const sizes: (number | null)[] = (await tweend.levels(model, { encoding: 'quantized' })).map(({ bytes }) => bytes);
  const url: string = tweend.surfaceUrl(model.id, options, 'obj');
  await tweend.sign(url, 60);
  // @ts-expect-error: no such scheme
  tweend.surfaceUrl(model, { scheme: 'cubic' });
  // @ts-expect-error: no such parameter
  tweend.surfaceUrl(model, { depth: 2 });
  // @ts-expect-error: no such form
  tweend.surfaceUrl(model, {}, 'fbx');
  // @ts-expect-error: a level is a number
  tweend.surface(model, { level: '2' });
  for await (const { id, name } of tweend.list({ limit: 10 })) console.log(id, name?.length);
  return faces;
}

export async function edits(id: string): Promise<number[] | undefined> {
  const list: Edit[] = [{ edit: 'inset', faces: { facing: [0, 1, 0] }, amount: 0.1, name: 'rim' }, { edit: 'crease', edges: { sharper_than: 30 } }];
  // @ts-expect-error: an inset needs an amount
  await tweend.edit(id, [{ edit: 'inset', faces: 'all' }]);
  // @ts-expect-error: no such edit
  await tweend.edit(id, [{ edit: 'bevel' }]);
  return (await tweend.edit(id, list, { mesh: 'hull' })).made?.rim?.vertices;
}

export async function poses(id: string): Promise<Float32Array> {
  const options: PoseOptions = { clip: 'drive', at: [0, 0.5], nodes: ['hull'], space: 'world', interpolation: 'nlerp' };
  for await (const row of await tweend.poseStream(id, options)) console.log(row.length);
  // @ts-expect-error: the daemon knows no such order
  await tweend.pose(id, { as: 'euler', order: 'XYX' });
  const table = await tweend.poseTable(id, options, { signal: AbortSignal.timeout(1000) });
  return table.part(0, 'hull', 'rotation');
}

export async function borrowed(id: string, lender: string): Promise<string[]> {
  const clip = `${lender}/walk`;
  const options: PoseOptions = { clip, retarget: 'auto', map: { 'Hips 1': 'pelvis', tail: null }, at: 0 };
  await tweend.pose(id, options);
  // @ts-expect-error: no such way
  await tweend.pose(id, { retarget: 'always' });
  // @ts-expect-error: bones are names
  await tweend.pose(id, { retarget: 'auto', map: { hips: 3 } });
  const { retarget } = await tweend.tracks(id, { clip, retarget: 'auto' });
  return retarget?.bones.map(({ source, target, by, aligned }) => `${source} ${target} ${by} ${aligned.toFixed()}`) ?? [];
}

export async function mixed(id: string, lender: string): Promise<string> {
  const layers: Layer[] = [
    { clip: 'walk', weight: { times: [0, 1], values: [1, 0] }, sync: true },
    { clip: `${lender}/run`, retarget: 'auto', weight: 0.5, nodes: ['spine'] },
  ];
  // @ts-expect-error: no such mode
  await tweend.mix(id, [{ clip: 'walk', mode: 'multiply' }]);
  const clip = await tweend.mix(id, layers, { name: 'stroll', retries: 0 });
  const player = await tweend.play(id, [], { clip, root_motion: 'auto', root_axes: 'x,z' });
  const [x = 0] = player.root?.translation ?? [];
  const live = await tweend.live(id, [], { clip, retarget: 'auto', map: { hip: 'pelvis' }, feet: 'hold', root_motion: 'auto' });
  return tweend.surfaceUrl(id, { clip, retarget: 'auto', map: { hip: null }, feet: 'hold', in_place: true, at: [x, live.root?.rotation[3] ?? 1] });
}

export async function unstored(file: File, client = new Tweend('/below/', { retries: 5 })): Promise<number> {
  client.retries = 2;
  const answer = await client.surfaceOf([file], { level: 1 }, 'stl', { signal: AbortSignal.timeout(1000), retries: 1 });
  // @ts-expect-error: an upload is no document
  await client.surfaceOf({ meshes: [] });
  return (await answer.arrayBuffer()).byteLength;
}

class Vector3 {
  x = 0;
  y = 0;
  z = 0;
  set(x: number, y: number, z: number) {
    return Object.assign(this, { x, y, z });
  }
}

export async function players(id: string, scene: { traverse(visit: (object: object) => void): void }): Promise<number> {
  const player: Player = await tweend.play(id, scene, { clip: 'drive', loop: 'pingpong', speed: 0.5 });
  player.time = player.duration / 2;
  player.speed = player.weights?.face[0] ?? 1;
  const hull = { position: new Vector3(), scale: new Vector3(), quaternion: { x: 0, y: 0, z: 0, w: 1 } };
  const live: LivePlayer = await tweend.live(id, { hull }, { fps: 60, start: Date.now(), delay: 50 });
  // @ts-expect-error: a player decides what its poses are
  await tweend.live(id, { hull }, { as: 'matrix' });
  // @ts-expect-error: nothing to move
  await tweend.play(id, { hull: { name: 'hull' } });
  live.update(performance.now());
  return player.update();
}

export function tell(error: unknown): string {
  if (!(error instanceof TweendError)) return String(error);
  return `${error.status} ${error.errors[0]?.pointer ?? error.line} ${error.problem.predicted?.faces} ${error.retryAfter ?? 0 + 1}`;
}
