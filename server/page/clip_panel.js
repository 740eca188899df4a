// The panel for the played clip: what it is like, in sentences; blending it with another clip; and keeping the result.
import { html, nothing, render } from 'lit-html';

import { download, tweend, withKey } from './client.js';
import { isCharacter, layersOf, optionsOf, titleOf } from './clips.js';
import { carriedOver, sentencesOf } from './clip_words.js';
import { make, saveBlob, seconds } from './dom.js';
import { busy, fail } from './notices.js';
import { change, state, surfaceOptions, watch } from './state.js';
import { amount, choice } from './templates.js';

export class ClipPanel {
  /** models: the list that new models are added to. */
  constructor(panel, { animation, timeline, models }) {
    Object.assign(this, { animation, timeline, models });
    this.content = make('section', { className: 'clip', 'aria-label': 'Played clip' });
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
      : html`<button type="button" class="small" @click=${() => this.animation.seekInClip(time)}>${seconds(time)}</button>`}</li>`;
    const others = (this.clips ?? []).filter(({ value }) => value !== clip.value);
    return render(html`
      <h2>${titleOf(clip)}</h2>
      ${report ? html`<ul class="sentences">${sentencesOf(report, model.nodes.length, isCharacter(model)).map(sentence)}</ul>` : nothing}
      ${retarget ? html`<details><summary>Carried over to this skeleton</summary>${carriedOver(retarget).map((text) => html`<p class="dim">${text}</p>`)}</details>` : nothing}
      ${others.length > 0 ? choice('Blend with', 'blend', [['', 'Nothing'], ...others.map((entry) => [entry.value, titleOf(entry)])]) : nothing}
      ${other || state('blend') ? amount('Blend', 'weight', [0, 1, 0.01], `${Math.round(100 * Number(state('weight')))} %`) : nothing}
      ${clip.isBorrowed || state('blend') ? html`<div class="row">
        <button type="button" class="primary" @click=${() => this.save()}>Save GLB</button>
        <button type="button" @click=${() => this.keep()}>Keep as a model</button></div>` : nothing}`, this.content);
  }

  /** How requests name what is played; a blend is stored first, as a model that has only it. */
  async #request() {
    const { clip, model } = this.animation;
    const other = this.clips.find(({ value }) => value === state('blend'));
    if (!other) return optionsOf(clip);
    return { clip: await withKey(() => tweend.mix(model, layersOf([clip, other], Number(state('weight'))), { name: 'blend' })) };
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
    return this.#with('Saving', surfaceOptions(), (blob) => saveBlob(blob, `${this.#name}.glb`));
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
