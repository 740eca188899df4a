// What went wrong, in the API's words and at the place that it names; and what is under way.
import { TweendError } from '../../api/client/tweend.js';

import { withKey } from './client.js';
import { byId, make } from './dom.js';

/** Whether an error is that of a request without an answer, as browsers call it. */
const isUnanswered = (error) => error instanceof TypeError && /fetch|network|load failed/i.test(error.message);

/** An error as elements: title, detail, places. */
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

/** Shows an error until it is closed. about: what was tried. again(), where it is given, tries once more. */
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

/** Requests of which each is of the answer to the one before. */
export class OneAtATime {
  isRunning = false;

  /** Resolves with whether it was done: not while another one runs, and not where it fails, which is shown. */
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

/** Says what is under way, with a way to cancel it, until `done` is called. Shown when it takes a while. */
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
