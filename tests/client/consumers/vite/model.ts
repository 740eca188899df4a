import type { Tweend } from 'tweend';

export async function box(tweend: Tweend): Promise<string> {
  return (await tweend.upload('{"meshes": [{"shape": {"kind": "box"}}]}')).id;
}
