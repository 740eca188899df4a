// What renders the page on a server imports all of it there.
import { Tweend } from 'tweend';
import { TweendViewer } from 'tweend/viewer';

import { box } from './model';

export async function run(url: string): Promise<object> {
  let guessed = '';
  try {
    guessed = new Tweend().base;
  } catch (error) {
    guessed = String(error);
  }
  return { id: await box(new Tweend(url)), element: TweendViewer.name, guessed };
}
