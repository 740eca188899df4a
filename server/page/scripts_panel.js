// Shows the requests for what is shown, as curl, JavaScript or Python, and offers downloads in every format.
import { html, nothing, render } from 'lit-html';

import { download, tweend, withKey } from './client.js';
import { optionsOf } from './clips.js';
import { ask, byId, bytes, make, saveAs, saveBlob } from './dom.js';
import { busy, fail } from './notices.js';
import { LANGUAGES, scriptOf } from './scripts.js';
import { change, state, surfaceOptions, watch } from './state.js';
import { codeLine } from './templates.js';

const LARGE = 100e6;

/** Whether so many bytes are loaded only after a question. */
export const isLarge = (size) => (size ?? 0) > LARGE;

/** Asks the user before loading as much. */
export async function confirmLarge(size, what) {
  if (!isLarge(size)) return true;
  return Boolean(await ask({
    title: `${bytes(size)} to load`,
    content: [make('p', {}, `${what} has ${bytes(size)}. A browser may run out of memory with it.`)],
    confirm: 'Load it all',
  }));
}

export class ScriptsPanel {
  constructor(panel, { animation, surface }) {
    Object.assign(this, { animation, surface, model: null });
    this.content = make('div');
    panel.append(make('h2', {}, 'For scripts'), this.content);
    this.whole = byId('download');
    this.whole.addEventListener('click', (event) => this.save(event, this.whole.href, this.whole.download, `glb ${state('encoding')}`));
    watch(() => this.open(this.model));
    this.open(null);
  }

  /** Offers the requests of a model; null: there is none, or it has gone. */
  open(model) {
    this.model = model;
    if (state('tab') === 'scripts') this.show();
    this.offer();
  }

  /** Offers what is shown as a file. */
  offer() {
    const id = this.model?.id;
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
    const given = Object.entries({ model: this.model.id, level, clip, options: new URLSearchParams({ ...options, ...more }) })
      .filter(([, value]) => String(value ?? '') !== '').map(([name, value]) => `${name}="${String(value).replaceAll('&', '&amp;').replaceAll('"', '&quot;')}"`);
    return `<script type="module" src="${tweend.base}viewer.js"></script>\n<tweend-viewer ${given.join(' ')} auto-rotate></tweend-viewer>`;
  }

  /** The requests as [title, URL, what scriptOf takes besides]; module: the same by the daemon's own module. */
  requests() {
    const { id } = this.model;
    const options = { ...surfaceOptions(), ...this.clipped };
    const list = [
      ['This surface', tweend.surfaceUrl(id, options), { file: `${id.slice(0, 8)}.glb` }],
      ['Its counts', tweend.surfaceUrl(id, options, 'json'), {}],
    ];
    const { clip } = this.animation;
    if (clip) {
      const pose = { ...optionsOf(clip), at: Math.round(this.animation.clipTime * 1000) / 1000 };
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

  show() {
    if (!this.model) return render(html`<p class="dim">Choose a model: its requests are shown here.</p>`, this.content);
    const hasKey = Boolean(tweend.key);
    const language = state('language');
    const opening = `const { Tweend } = await import('${tweend.base}tweend.js');\nconst tweend = new Tweend(${hasKey ? "undefined, { key: prompt('Key') }" : ''});\n`;
    const request = ([title, url, { module, ...options }]) => html`${codeLine(title, scriptOf(language, url, { ...options, hasKey }))}
      ${module && language === 'JavaScript' ? codeLine(`${title}, on a page`, opening + module) : nothing}`;
    const link = ([label, url, name]) => html`<li><a href=${url} download=${name} @click=${(event) => this.save(event, url, name, label)}>${label}</a></li>`;
    return render(html`<p class="dim">The address of this page holds its state: whoever opens it sees the same.</p>
      <h3>Downloads</h3><ul class="downloads">${this.downloads().map(link)}</ul>
      <h3>Requests</h3>
      <div class="row" role="group" aria-label="Language">${LANGUAGES.map((name) => html`<button type="button" class="chip"
        aria-pressed=${name === language} @click=${() => change({ language: name })}>${name}</button>`)}</div>
      ${state('blend') ? html`<p class="dim">Of a blend its first clip is asked for. It has requests of its own when it is kept as a model, by the tab Rotation.</p>` : nothing}
      ${this.requests().map(request)}
      <h3>On a web page</h3>${codeLine('HTML', this.snippet)}`, this.content);
  }

  /** What can be downloaded, as [label, URL, name of the file]. */
  downloads() {
    const { id } = this.model;
    const options = { ...surfaceOptions(), ...this.clipped };
    const surface = (form, kind) => [`${form} ${kind ?? ''}`.trim(),
      tweend.surfaceUrl(id, { ...options, ...(kind === 'ngon' ? { encoding: 'float', polygons: kind } : { encoding: kind }), download: 1 }, form),
      `${id.slice(0, 8)}.${form}`];
    const { clip } = this.animation;
    const span = clip && { ...optionsOf(clip), from: 0, to: clip.duration ?? this.animation.duration, fps: 60 };
    return [surface('glb', 'float'), surface('glb', 'quantized'), surface('glb', 'meshopt'), surface('glb', 'ngon'), surface('gltf', 'float'), surface('obj'),
      ['source', tweend.sourceUrl(id, { download: 1 }), `${id.slice(0, 8)}`],
      ...(clip ? ['json', 'ndjson', 'bin', 'csv'] : []).map((form) => [`pose ${form}`, tweend.poseUrl(id, span, form), `poses.${form}`])];
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
    if (!tweend.key && !isLarge(size)) return;
    event.preventDefault();
    if (!(await confirmLarge(size, `This ${label}`))) return;
    const signed = tweend.key ? await this.sign(url) : url;
    if (signed) return saveAs(signed, name);
    const controller = new AbortController();
    const task = busy(`Loading ${name}`, controller);
    try {
      const onProgress = (loaded, total) => task.say(`Loading ${name}: ${bytes(loaded)}${total ? ` of ${bytes(total)}` : ''}`);
      const { blob } = await download(url, { signal: controller.signal, onProgress });
      saveBlob(blob, name);
    } catch (error) {
      fail(`${name} cannot be loaded`, error);
    } finally {
      task.done();
    }
  }
}
