// What the played clip is like, in sentences: does it loop, how far does it go, which feet slide, what leaps. Blends it
// with another clip, and keeps the result.
import { html, nothing, render } from 'lit-html';

import { download, tweend, withKey } from './client.js';
import { blendOf, optionsOf, titleOf } from './clips.js';
import { fixed, make, plural, seconds } from './dom.js';
import { busy, fail } from './notices.js';
import { change, state, surfaceOptions, watch } from './state.js';

const SEAMLESS = 2;    // degrees between the first and the last pose that nobody sees
const NOISY = 0.15;    // degrees of jitter that are seen
const MOST = 5;        // entries of a list that are shown
const SLIDES = 0.01;   // of a contact's figure: less is no slide

const degrees = (value) => `${fixed(value, value < 10 ? 1 : 0)}°`;
const length = (value) => (Math.abs(value) < 0.1 ? `${fixed(100 * value, 1)} cm` : `${fixed(value, 2)} m`);

/** Sentences about a clip: [{mark: good, fair or bad; text; time: to seek, if any}]. report: of /tracks. */
export function sentencesOf({ loop, root, still, contacts, noise, pops }, nodes) {
  const list = [];
  const say = (mark, text, time) => list.push({ mark, text, time });
  if (loop.angle <= SEAMLESS && loop.distance < 0.01) say('good', 'Loops without a seam.');
  else say(loop.angle < 15 ? 'fair' : 'bad', `Does not loop: between its end and its start ${loop.node ?? 'it'} leaps by ${degrees(loop.angle)}${loop.distance >= 0.01 ? ` and ${length(loop.distance)}` : ''}.`, 0);
  if (root.node && root.speed > 0.01) say('', `${root.node} goes ${length(root.distance)} at ${fixed(root.speed, 2)} m/s${Math.abs(root.turn) >= 5 ? ` and turns by ${degrees(root.turn)}` : ''}.`);
  else say('', 'Stays in its place.');
  const worst = [...contacts].sort((a, b) => b.slide - a.slide)[0];
  if (worst) say(worst.slide < SLIDES ? 'good' : 'bad', `Feet touch the ground ${plural(contacts.length, 'time')}; ${worst.slide < SLIDES ? 'none slides' : `${worst.node} slides by ${length(worst.slide)}`}.`, worst.from);
  const jitter = noise.filter(({ path, rms }) => path === 'rotation' && rms > NOISY).sort((a, b) => b.rms - a.rms);
  if (jitter.length > 0) say('bad', `Jitters: ${jitter.slice(0, 3).map(({ node, rms }) => `${node} by ${degrees(rms)}`).join(', ')}.`);
  for (const { node, time, angle } of [...pops].sort((a, b) => b.angle - a.angle).slice(0, MOST)) say('bad', `One key of ${node} leaps by ${degrees(angle)}.`, time);
  if (still.length > 0 && still.length < nodes) say('', `${plural(still.length, 'node')} never ${still.length === 1 ? 'moves' : 'move'}: ${still.slice(0, 3).join(', ')}${still.length > 3 ? ' …' : ''}.`);
  return list;
}

/** How a borrowed clip was carried over, in sentences. */
function carriedOver({ bones, scale, without_target: lost, without_source: resting }) {
  const list = [`${plural(bones.length, 'bone')} follow, ways are ${fixed(scale, 2)} times as long.`];
  if (lost.length > 0) list.push(`Nothing here follows ${lost.slice(0, 3).join(', ')}${lost.length > 3 ? ` and ${lost.length - 3} more` : ''}.`);
  if (resting.length > 0) list.push(`${plural(resting.length, 'bone')} keep${resting.length === 1 ? 's' : ''} the rest pose.`);
  return list;
}

export class ClipPanel {
  /** models: the list that new models are added to. */
  constructor(panel, { animation, timeline, models }) {
    Object.assign(this, { animation, timeline, models });
    this.content = make('section', { 'aria-label': 'Clip' });
    panel.append(this.content);
    watch((names) => {
      if (names.has('tab')) this.open();
      if (names.has('weight')) this.show();
    });
  }

  /** Tells of the played clip. clips: those that it may be blended with. */
  async open(clips = this.clips) {
    this.clips = clips;
    this.told = null;
    this.show();
    const { clip } = this.animation;
    if (!clip || state('tab') !== 'animation') return;
    const told = await this.timeline.tracksOf;
    if (this.animation.clip !== clip) return;
    this.told = told;
    this.show();
  }

  show() {
    const { clip, model, other } = this.animation;
    if (!clip) return render(nothing, this.content);
    const { report, retarget } = this.told ?? {};
    const sentence = ({ mark, text, time }) => html`<li class=${`mark ${mark}`}>${text} ${time === undefined ? nothing
      : html`<button type="button" class="small" @click=${() => this.animation.seek(time)}>${seconds(time)}</button>`}</li>`;
    const others = (this.clips ?? []).filter(({ value }) => value !== clip.value);
    const choices = [['', 'Nothing'], ...others.map((entry) => [entry.value, titleOf(entry)])];
    return render(html`
      <h3>${titleOf(clip)}</h3>
      ${report ? html`<ul class="sentences">${sentencesOf(report, model.nodes.length).map(sentence)}</ul>` : nothing}
      ${retarget ? html`<details><summary>Carried over to this skeleton</summary>${carriedOver(retarget).map((text) => html`<p class="dim">${text}</p>`)}</details>` : nothing}
      ${others.length > 0 ? html`<label class="field"><span>Blend with</span>
        <select @change=${({ target }) => change({ blend: target.value })}>${choices.map(([value, text]) => html`<option value=${value} ?selected=${value === state('blend')}>${text}</option>`)}</select></label>` : nothing}
      ${other || state('blend') ? html`<div class="slider"><span>Blend</span>
        <input type="range" min="0" max="1" step="0.01" aria-label="Blend" .value=${state('weight')} @input=${({ target }) => change({ weight: target.value })}>
        <output class="value">${Math.round(100 * Number(state('weight')))} %</output></div>` : nothing}
      ${clip.isBorrowed || state('blend') ? html`<div class="row">
        <button type="button" class="primary" @click=${() => this.save()}>Save GLB</button>
        <button type="button" @click=${() => this.keep()}>Keep as a model</button></div>` : nothing}`, this.content);
  }

  /** How requests name what is played; a blend is stored first, as a model that has only it. */
  async #request() {
    const { clip, model } = this.animation;
    const other = this.clips.find(({ value }) => value === state('blend'));
    if (!other) return optionsOf(clip);
    const { id } = await withKey(() => tweend.upload(JSON.stringify(blendOf(model, [clip, other], Number(state('weight')))), { name: 'blend', type: 'application/json' }));
    return { clip: `${id}/blend`, ...([clip, other].some(({ isBorrowed }) => isBorrowed) && { retarget: 'auto' }) };
  }

  /** Does something with the bytes of a surface that has the played clip. */
  async #with(what, options, use) {
    const controller = new AbortController();
    const task = busy(what, controller);
    try {
      const { blob } = await download(tweend.surfaceUrl(this.animation.model, { ...options, ...(await this.#request()) }), { signal: controller.signal });
      await use(blob);
    } catch (error) {
      fail('The clip cannot be saved', error);
    } finally {
      task.done();
    }
  }

  get #name() {
    return `${(this.animation.model.name ?? 'model').replace(/\.\w+$/, '')}, ${state('blend') ? 'blend' : this.animation.clip.name}`;
  }

  /** Downloads the shown level with the played clip. */
  save() {
    return this.#with('Saving', surfaceOptions(), (blob) => {
      const href = URL.createObjectURL(blob);
      make('a', { href, download: `${this.#name}.glb` }).click();
      setTimeout(() => URL.revokeObjectURL(href), 60000);
    });
  }

  /** Stores the model with the played clip as its own, as a version of the shown one. */
  keep() {
    return this.#with('Keeping', { level: 0, polygons: 'ngon' }, async (blob) => {
      const { model } = this.animation;
      const made = await withKey(() => tweend.upload(blob, { name: this.#name, type: 'model/gltf-binary' }));
      this.models.lineages.add(made.id, model.id);
      await this.models.load();
      change({ model: made.id, clip: '', blend: '', borrowed: '', weight: '0.5' });
    });
  }
}
