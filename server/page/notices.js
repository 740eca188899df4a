// Shows errors, in the API's words and with the place that they name, and progress.
import { TweendError } from '../../api/client/tweend.js';

import { withKey } from './client.js';
import { byId, make } from './dom.js';
import { isStep, watch } from './state.js';

/** Whether an error means that a request got no answer, in the words of browsers. */
export const isUnanswered = (error) => error instanceof TypeError && /fetch|network|load failed|upload failed/i.test(error.message);

/** An error as a list of elements: title, detail, places. */
export function explain(error) {
  if (isUnanswered(error)) return [make('p', {}, 'The daemon does not answer: it may have been stopped, or the network is gone.')];
  if (!(error instanceof TweendError)) return [make('p', {}, String(error.message ?? error))];
  const places = error.errors.slice(0, 5).map(({ pointer, detail }) => make('li', {}, make('code', {}, pointer), ` ${detail}`));
  const wait = error.retryAfter ? ` Try again in ${error.retryAfter} s.` : '';
  return [
    make('p', {}, make('strong', {}, `${error.status} ${error.title ?? ''}`)),
    places.length ? make('ul', {}, ...places) : make('p', {}, `${error.detail ?? ''}${wait}`),
    error.line && !error.detail?.includes(`line ${error.line}:`) ? make('p', {}, 'Line ', make('code', {}, String(error.line))) : null,
    error.requestId ? make('p', { className: 'dim' }, `Request ${error.requestId}`) : null,
  ].filter(Boolean);
}

/** Whether the same request may succeed later, or with a key: nothing is wrong with what it asks. */
export const mayPass = (error) => isUnanswered(error) || error.status >= 500 || [401, 429].includes(error.status);

const NARROW = 760; // pixels: the panel stands below the stage, as style.css says

const isAbort = (error) => error?.name === 'AbortError';

/** Lifts what stands at the stage's bottom and in its middle above the notices. */
function makeRoom() {
  const [list, stage] = [byId('notices'), byId('stage')].map((element) => element.getBoundingClientRect());
  const covered = list.height > 0 && list.left < stage.right ? Math.max(0, stage.bottom - list.top) : 0;
  byId('stage').style.setProperty('--covered', `${covered}px`);
  document.body.style.paddingBottom = innerWidth <= NARROW && list.height > 0 ? `${list.height + 32}px` : ''; // so that the panel can be scrolled beyond them
}

const room = new ResizeObserver(makeRoom);
for (const element of [byId('notices'), byId('stage')]) room.observe(element);
addEventListener('scroll', makeRoom, { passive: true });

/** Shows words below a title, until they are closed. */
export function tell(title, ...content) {
  const close = make('button', { className: 'close', 'aria-label': 'Close', onclick: () => notice.remove() }, '×');
  const notice = make('div', { className: 'notice' }, close, make('h2', {}, title), ...content);
  const list = byId('notices');
  if (list.children.length > 2) list.firstChild.remove();
  list.append(notice);
  list.scrollTop = list.scrollHeight;
  return notice;
}

/** Shows an error. about: what failed. again(), if given, tries once more. */
export function fail(about, error, again) {
  if (isAbort(error)) return;
  const retry = () => {
    notice.remove();
    again();
  };
  const notice = tell(about, ...explain(error), ...(again && mayPass(error) ? [make('button', { className: 'small again', onclick: retry }, 'Try again')] : []));
  notice.classList.add('failure');
}

watch((names) => {
  if (names.has('model')) for (const old of document.querySelectorAll(isStep() ? '.again' : '.failure')) old.remove(); // what failed was asked for another model
});

/** Runs requests one at a time, as each depends on the answer to the one before. */
export class OneAtATime {
  isRunning = false;
  settled = Promise.resolve(); // when the one that runs has ended
  ready = Promise.resolve(); // when what requests depend on besides is there
  #release = null; // resolves it

  /** Says whether what requests depend on is still to come: they wait for it. */
  hold(isHeld) {
    if (isHeld && !this.#release) this.ready = new Promise((resolve) => (this.#release = resolve));
    if (isHeld) return;
    this.#release?.();
    this.#release = null;
  }

  /** Resolves with whether the request succeeded. Refuses while another runs, and says so; shows a failure, which may be tried
   *  again. */
  async run(request) {
    if (!this.isRunning) return (this.settled = marked(this.#try(request)));
    this.refusal?.remove();
    this.refusal = tell('Not done', make('p', {}, 'The edit before is still being made.'));
    return false;
  }

  async #try(request) {
    this.isRunning = true;
    const task = busy('Editing');
    try {
      await this.ready;
      await withKey(request);
      return true;
    } catch (error) {
      fail('This cannot be done', error, () => this.run(request));
      return false;
    } finally {
      this.isRunning = false;
      task.done();
      this.refusal?.remove();
    }
  }
}

const tasks = new Set(); // those running, in the order of their start
let shown; // the task whose text is shown and which the button cancels

/** Shows the newest of the tasks that are due. */
function showTask() {
  shown = [...tasks].filter(({ isDue }) => isDue).at(-1);
  byId('busy').hidden = !shown;
  byId('cancel').hidden = !shown?.controller;
  if (shown) byId('busy-text').textContent = shown.text;
}

/** Shows that a task is running, after half a second, until done() is called; with a button to cancel it where it has a controller. */
export function busy(text, controller) {
  const task = { text, controller, isDue: false };
  const set = (changes) => {
    Object.assign(task, changes);
    showTask();
  };
  const timer = setTimeout(() => set({ isDue: true }), 500);
  tasks.add(task);
  return {
    say: (next) => set({ text: next }),
    done: () => {
      clearTimeout(timer);
      tasks.delete(task);
      showTask();
    },
  };
}

byId('cancel').addEventListener('click', () => shown?.controller.abort());

let underway = 0; // of what the address names

/** The canvas is marked until a promise is settled: what it shows is not yet what the address names. */
export async function marked(promise) {
  underway++;
  byId('view').dataset.opening = '';
  try {
    return await promise;
  } finally {
    if (--underway === 0) delete byId('view').dataset.opening;
  }
}
