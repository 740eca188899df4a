// Shows errors, in the API's words and with the place that they name, and progress.
import { TweendError } from '../../api/client/tweend.js';

import { withKey } from './client.js';
import { byId, make } from './dom.js';

/** Whether an error means that a request got no answer, in the words of browsers. */
const isUnanswered = (error) => error instanceof TypeError && /fetch|network|load failed/i.test(error.message);

/** An error as a list of elements: title, detail, places. */
export function explain(error) {
  if (isUnanswered(error)) return [make('p', {}, 'The daemon does not answer: it may have been stopped, or the network is gone.')];
  if (!(error instanceof TweendError)) return [make('p', {}, String(error.message ?? error))];
  const places = error.errors.slice(0, 5).map(({ pointer, detail }) => make('li', {}, make('code', {}, pointer), ` ${detail}`));
  const wait = error.retryAfter ? ` Try again in ${error.retryAfter} s.` : '';
  return [
    make('p', {}, make('strong', {}, `${error.status} ${error.title ?? ''}`)),
    places.length ? make('ul', {}, ...places) : make('p', {}, `${error.detail ?? ''}${wait}`),
    error.line ? make('p', {}, 'Line ', make('code', {}, String(error.line))) : null,
    error.requestId ? make('p', { className: 'dim' }, `Request ${error.requestId}`) : null,
  ].filter(Boolean);
}

const isAbort = (error) => error?.name === 'AbortError';

/** Shows an error until it is closed. about: what failed. again(), if given, tries once more. */
export function fail(about, error, again) {
  if (isAbort(error)) return;
  const retry = () => {
    notice.remove();
    again();
  };
  const mayPass = again && (isUnanswered(error) || error.status >= 500);
  const close = make('button', { type: 'button', className: 'close', 'aria-label': 'Close', onclick: () => notice.remove() }, '×');
  const notice = make('div', { className: 'notice' }, close, make('h2', {}, about), ...explain(error),
    ...(mayPass ? [make('button', { type: 'button', className: 'small', onclick: retry }, 'Try again')] : []));
  const list = byId('notices');
  if (list.children.length > 2) list.firstChild.remove();
  list.append(notice);
}

/** Runs requests one at a time, as each depends on the answer to the one before. */
export class OneAtATime {
  isRunning = false;

  /** Resolves with whether the request succeeded. Refuses while another runs; shows a failure. */
  async run(request) {
    if (this.isRunning) return false;
    this.isRunning = true;
    try {
      await withKey(request);
      return true;
    } catch (error) {
      fail('This cannot be done', error);
      return false;
    } finally {
      this.isRunning = false;
    }
  }
}

let current = null;

/** Shows that a task is running, after half a second, with a button to cancel it, until done() is called. */
export function busy(text, controller) {
  const own = { text, controller };
  current = own;
  const show = () => {
    if (current !== own) return;
    byId('busy-text').textContent = own.text;
    byId('busy').hidden = false;
  };
  const timer = setTimeout(show, 500);
  return {
    say: (next) => {
      own.text = next;
      if (current === own && !byId('busy').hidden) byId('busy-text').textContent = next;
    },
    done: () => {
      clearTimeout(timer);
      if (current !== own) return;
      current = null;
      byId('busy').hidden = true;
    },
  };
}

byId('cancel').addEventListener('click', () => current?.controller.abort());
