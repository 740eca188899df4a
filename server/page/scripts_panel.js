// Shows the requests for what is shown, as curl, JavaScript and Python, and offers downloads in every format.
import { download, tweend, withKey } from './client.js';
import { optionsOf } from './clips.js';
import { ask, byId, bytes, make } from './dom.js';
import { busy, fail } from './notices.js';
import { scriptsOf } from './scripts.js';
import { state, surfaceOptions, watch } from './state.js';

export { quote } from './scripts.js';

const LARGE = 100e6;

/** Asks the user before loading more than LARGE bytes. */
export async function confirmLarge(size, what) {
  if (size === null || size === undefined || size <= LARGE) return true;
  return Boolean(await ask({
    title: `${bytes(size)} to load`,
    content: [make('p', {}, `${what} has ${bytes(size)}. A browser may run out of memory with it.`)],
    confirm: 'Load it all',
  }));
}

/** A line of code with a button that copies it. */
export function codeLine(label, text) {
  const copy = make('button', { type: 'button', className: 'small', 'aria-label': `Copy the ${label} line`, onclick: async () => {
    const isCopied = await navigator.clipboard?.writeText(text).then(() => true, () => false);
    copy.textContent = isCopied ? 'Copied' : 'Not allowed';
    setTimeout(() => (copy.textContent = 'Copy'), 1500);
  } }, 'Copy');
  return make('div', { className: 'code' }, make('span', {}, label), copy, make('pre', { tabIndex: 0, 'aria-label': label }, text));
}

export class ScriptsPanel {
  constructor(panel, { animation, surface }) {
    Object.assign(this, { animation, surface });
    this.content = make('div');
    panel.append(make('h2', {}, 'For scripts'), this.content);
    this.whole = byId('download');
    this.whole.addEventListener('click', (event) => this.save(event, this.whole.href, this.whole.download, `glb ${state('encoding')}`));
    watch(() => {
      if (state('tab') === 'scripts') this.render();
      this.offer();
    });
    this.offer();
  }

  /** Offers what is shown as a file. */
  offer() {
    const id = state('model');
    this.whole.hidden = !id;
    if (id) Object.assign(this.whole, { href: tweend.surfaceUrl(id, { ...surfaceOptions(), ...this.clipped, download: 1 }), download: `${id.slice(0, 8)}.glb`, title: `Level ${state('level')} as GLB` });
  }

  /** What names the clip in the request of a surface, where it is not one of the model's own. */
  get clipped() {
    const { clip } = this.animation;
    return clip?.isBorrowed ? optionsOf(clip) : {};
  }

  /** What shows the surface on another page. */
  get snippet() {
    const { level, ...options } = surfaceOptions();
    const { clip, ...more } = this.clipped;
    const given = Object.entries({ model: state('model'), level, clip, options: new URLSearchParams({ ...options, ...more }) })
      .filter(([, value]) => String(value ?? '') !== '').map(([name, value]) => `${name}="${String(value).replaceAll('&', '&amp;').replaceAll('"', '&quot;')}"`);
    return `<script type="module" src="${tweend.base}viewer.js"></script>\n<tweend-viewer ${given.join(' ')} auto-rotate></tweend-viewer>`;
  }

  /** The requests as [title, URL, what scriptsOf takes besides]. */
  requests() {
    const id = state('model');
    const options = { ...surfaceOptions(), ...this.clipped };
    const list = [
      ['This surface', tweend.surfaceUrl(id, options), { file: `${id.slice(0, 8)}.glb` }],
      ['Its counts', tweend.surfaceUrl(id, options, 'json'), {}],
    ];
    const { clip } = this.animation;
    if (clip) {
      const pose = { ...optionsOf(clip), at: Math.round((this.animation.time ?? 0) * 1000) / 1000 };
      const all = { ...optionsOf(clip), from: 0, to: clip.duration ?? this.animation.duration, fps: 60 };
      const live = { ...optionsOf(clip), loop: state('loop'), speed: Number(state('speed')), fps: 30 };
      list.push(
        ['This pose', tweend.poseUrl(id, pose), {}],
        ['The clip at 60 a second', tweend.poseUrl(id, all, 'bin'), { file: 'poses.bin' }],
        ['The live stream', tweend.liveUrl(id, live), { isStream: true, module: '// gltf: the surface as GLTFLoader of three.js loads it\n' +
          `const player = await tweend.live('${id}', gltf.scene, ${JSON.stringify(live)});\nplayer.update(); // before each frame` }]);
    }
    return list;
  }

  render() {
    if (!state('model')) {
      this.content.replaceChildren(make('p', { className: 'dim' }, 'Choose a model: its requests are shown here.'));
      return;
    }
    const hasKey = Boolean(tweend.key);
    const opening = `const { Tweend } = await import('${tweend.base}tweend.js');\nconst tweend = new Tweend(undefined${hasKey ? ', { key }' : ''});\n`;
    const entries = this.requests().map(([title, url, { module, ...options }]) => {
      const codes = Object.entries(scriptsOf(url, { ...options, hasKey }));
      if (module) codes.push(['On a page', opening + module]);
      return make('section', {}, make('h3', {}, title), ...codes.map(([label, code]) => codeLine(label, code)));
    });
    entries.push(make('section', {}, make('h3', {}, 'On a web page'), codeLine('HTML', this.snippet)));
    this.content.replaceChildren(
      make('p', { className: 'dim' }, 'The address of this page holds its state: whoever opens it sees the same.'),
      make('h3', {}, 'Downloads'), this.downloads(), ...entries);
  }

  downloads() {
    const id = state('model');
    const options = { ...surfaceOptions(), ...this.clipped };
    const surface = (form, kind) => [`${form} ${kind ?? ''}`.trim(),
      tweend.surfaceUrl(id, { ...options, ...(kind === 'ngon' ? { encoding: 'float', polygons: kind } : { encoding: kind }), download: 1 }, form),
      `${id.slice(0, 8)}.${form}`];
    const list = [surface('glb', 'float'), surface('glb', 'quantized'), surface('glb', 'meshopt'), surface('glb', 'ngon'), surface('gltf', 'float'), surface('obj'),
      ['source', tweend.sourceUrl(id, { download: 1 }), `${id.slice(0, 8)}`]];
    const { clip } = this.animation;
    const span = clip && { ...optionsOf(clip), from: 0, to: clip.duration ?? this.animation.duration, fps: 60 };
    for (const form of clip ? ['json', 'ndjson', 'bin', 'csv'] : []) list.push([`pose ${form}`, tweend.poseUrl(id, span, form), `poses.${form}`]);
    return make('ul', { className: 'downloads' }, ...list.map(([label, url, name]) => {
      const anchor = make('a', { href: url, download: name, onclick: (event) => this.save(event, url, name, label) }, label);
      return make('li', {}, anchor);
    }));
  }

  /** The URL signed for a minute; null when the daemon signs none. */
  async sign(url) {
    if (this.signsNone) return null;
    try {
      return await withKey(() => tweend.sign(url, 60));
    } catch (error) {
      this.signsNone = error.status === 404;
      if (!this.signsNone) fail('The download cannot be signed', error);
      return null;
    }
  }

  /** Downloads a URL. A link cannot send a key: with a key, the daemon signs the URL, or the page fetches the bytes
   *  itself. */
  async save(event, url, name, label) {
    const size = /glb (float|quantized|ngon)|gltf/.test(label) ? this.surface.predicted(state('level')) : null;
    if (!tweend.key && (size ?? 0) <= LARGE) return;
    event.preventDefault();
    if (!(await confirmLarge(size, `This ${label}`))) return;
    const follow = (href) => make('a', { href, download: name }).click();
    const signed = tweend.key ? await this.sign(url) : url;
    if (signed) return follow(signed);
    const controller = new AbortController();
    const task = busy(`Loading ${name}`, controller);
    try {
      const onProgress = (loaded, total) => task.say(`Loading ${name}: ${bytes(loaded)}${total ? ` of ${bytes(total)}` : ''}`);
      const { blob } = await download(url, { signal: controller.signal, onProgress });
      const href = URL.createObjectURL(blob);
      follow(href);
      setTimeout(() => URL.revokeObjectURL(href), 60000);
    } catch (error) {
      fail(`${name} cannot be loaded`, error);
    } finally {
      task.done();
    }
  }
}
