// The daemon that served the page, and its API key. The key is kept for the lifetime of the tab.
import { Tweend, TweendError } from '../../api/client/tweend.js';

import { ask, byId, make } from './dom.js';
import { ofTab } from './storage.js';

const KEPT = 'tweend-key';

/** The daemon, addressed relative to the page, which may be served below a prefix. */
export const tweend = new Tweend(new URL('.', document.baseURI).href, { key: ofTab.getItem(KEPT) ?? undefined });

function keep(key) {
  tweend.key = key || undefined;
  if (key) ofTab.setItem(KEPT, key);
  else ofTab.removeItem(KEPT);
  byId('key').hidden = !key;
}

let asking = null;

/** Asks for a key, only once for all waiting requests. Resolves with true when a key was entered. */
function askForKey(why = '') {
  const input = make('input', { type: 'password', autocomplete: 'off' });
  asking ??= ask({
    title: 'API key',
    content: [make('p', {}, why || 'This daemon asks for a key. It is kept for this tab alone.'),
      make('label', { className: 'field' }, make('span', {}, 'Key'), input)],
    confirm: 'Use key',
    read: () => input.value.trim(),
  }).finally(() => (asking = null));
  return asking.then((key) => {
    if (key === null) return false;
    keep(key);
    return true;
  });
}

/** Resolves as `request` does. When the key or its rights are refused, asks for another key and tries again. */
export async function withKey(request) {
  for (;;) {
    try {
      return await request();
    } catch (error) {
      // Where keys are asked for, 403 concerns one that was sent; else it concerns the page's origin.
      const concernsKey = error.status === 401 || (error.status === 403 && tweend.key);
      if (!(error instanceof TweendError) || !concernsKey) throw error;
      if (!(await askForKey(tweend.key ? `The daemon says: ${error.detail}.` : ''))) throw error;
    }
  }
}

/** Downloads an answer, reporting progress. Resolves with its body and the server's milliseconds. */
export async function download(url, { signal, onProgress } = {}) {
  const response = await withKey(() => tweend.request(url, { signal }));
  const total = Number(response.headers.get('Content-Length')) || undefined;
  const chunks = [];
  let size = 0;
  for (const reader = response.body.getReader(); ; ) {
    const { done, value } = await reader.read();
    if (done) break;
    chunks.push(value);
    onProgress?.((size += value.length), total);
  }
  return { blob: new Blob(chunks), size, ms: serverTime(response) };
}

/** Milliseconds that the server worked before it began to send. */
function serverTime(response) {
  const parts = [...(response.headers.get('Server-Timing') ?? '').matchAll(/(\w+);dur=([\d.]+)/g)];
  return parts.reduce((sum, [, name, ms]) => (name === 'work' ? sum + Number(ms) : sum), 0);
}

byId('key').hidden = !tweend.key;
byId('key').addEventListener('click', () => askForKey('Another key for this tab; an empty one forgets it.'));
