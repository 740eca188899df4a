// What a program for Node.js does: upload with progress, a mixed clip, poses.
import { Tweend, TweendError, type Layer } from 'tweend';

export async function run(url: string, tank: string): Promise<object> {
  const tweend = new Tweend(url, { retries: 1 });
  const sent: number[] = [];
  const model = await tweend.upload(tank, { name: 'tank', onProgress: (bytes) => sent.push(bytes) });
  const layers: Layer[] = [{ clip: 'drive', weight: 0.5 }, { clip: 'aim', mode: 'additive', reference: 0 }];
  const clip = await tweend.mix(model, layers, { name: 'both' });
  const table = await tweend.poseTable(model, { clip, at: [0, 1], root_motion: 'auto' });
  // @ts-expect-error: a layer has a clip
  const faulty: Layer[] = [{ weight: 1 }];
  const refused = await tweend.mix(model, faulty).catch((error: unknown) => (error instanceof TweendError ? error.status : 0));
  return { sent: sent.at(-1), rows: table.rows.length, stride: table.header.stride, root: table.root(1, 'translation').length, refused };
}
