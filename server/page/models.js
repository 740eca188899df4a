// The list of models: one entry for each work, with its versions.
import { html, nothing, render } from 'lit-html';
import { repeat } from 'lit-html/directives/repeat.js';

import { tweend, withKey } from './client.js';
import { ask, byId, bytes, make, plural } from './dom.js';
import { Lineages } from './lineages.js';
import { fail } from './notices.js';
import { openOther, state, watch } from './state.js';
import { Uploads } from './uploads.js';

const PAGE = 100;
const LISTED_MOST = 1000; // in an answer of the daemon
const UNDO_MS = 10000;
const SEARCH_FROM = 8; // entries from which on a field to search in them is shown

/** The name by which requests find a mesh; undefined when the model has only one. */
export const meshName = ({ meshes }, mesh) => (meshes.length > 1 ? meshes[mesh].name ?? `mesh_${mesh}` : undefined);

/** The name of a model without the suffix for its edits. */
export const stemOf = ({ name }) => (name ?? '').replace(/, (\d+ edits?|sculpted)$/, '');

/** When a version was made, in words. */
function when(at) {
  const date = new Date(at);
  const isToday = date.toDateString() === new Date().toDateString();
  return date.toLocaleString([], isToday ? { timeStyle: 'short' } : { dateStyle: 'medium' });
}

export class Models {
  constructor(panel) {
    this.lineages = new Lineages(tweend.base);
    this.listed = [];
    this.wanted = PAGE; // models that are listed, at most
    this.told = new Map(); // by id: descriptions of models that were stored or opened here, which stand in the list in any case
    this.known = new Promise((resolve) => (this.onKnown = resolve)); // until the models could be listed once
    this.onRename = () => {}; // called when a model has another name in the list
    this.onDrop = async () => false; // whether a stored model goes onto the shown one, in place of being opened
    this.uploads = new Uploads(async (model, isFirst) => {
      this.lineages.add(model.id);
      this.told.set(model.id, model);
      await this.load();
      if (!(await this.onDrop(model)) && isFirst) openOther(model.id);
    });
    this.warnings = make('div', { role: 'status' });
    this.search = make('input', { type: 'search', placeholder: 'Search', 'aria-label': 'Search models', hidden: true, oninput: () => this.show() });
    this.list = make('ul', { className: 'models' });
    this.gone = make('div', { className: 'gone', role: 'status' });
    this.more = make('button', { className: 'quiet wide', hidden: true, onclick: () => this.load(this.wanted + PAGE) }, 'More');
    panel.append(
      make('div', { className: 'row' }, make('h2', {}, 'Models'), make('span', { className: 'space' }), this.uploads.button, this.uploads.input),
      make('p', { className: 'dim' }, 'Drop files or a folder anywhere: GLB, glTF with its files, OBJ, STL, PLY, BVH, VRM, tweend JSON.'),
      this.uploads.progress, this.warnings, this.search, this.gone, this.list, this.more);
    addEventListener('pagehide', () => this.finishRemoval(true));
    addEventListener('storage', ({ key }) => { // another tab has stored, renamed, deleted or drawn a model
      if (!this.lineages.has(key)) return;
      this.lineages.readAgain();
      for (const id of this.lineages.forgotten) this.told.delete(id);
      this.onRename();
      this.load();
    });
    watch((names) => {
      if (names.has('model')) render(nothing, this.warnings);
      if (names.has('model') && this.isRemoved(state('model'))) this.#restore(); // somebody went back to it
      if (names.has('model') || names.has('tab')) this.show();
    });
  }

  /** Lists so many of the daemon's models. */
  async load(wanted = this.wanted) {
    this.wanted = wanted;
    const asked = (this.asked = {}); // an older answer may come after a newer one
    try {
      const models = await withKey(async () => {
        const found = [];
        for await (const model of tweend.list({ limit: Math.min(wanted, LISTED_MOST) })) if (found.push(model) === wanted) break;
        return found;
      });
      if (asked !== this.asked) return;
      this.more.hidden = models.length < wanted;
      const told = this.more.hidden ? [] : [...this.told.values()]; // the daemon lists in the order of ids
      this.listed = [...new Map([...told, ...models].map((model) => [model.id, model])).values()];
      this.show();
      byId('empty').hidden = this.listed.length > 0 || state('model') !== '';
      this.onKnown();
    } catch (error) {
      if (asked === this.asked) fail('The models cannot be listed', error, () => this.load());
    }
  }

  get works() {
    const ids = this.removal?.ids ?? [];
    return this.lineages.group(this.listed.filter(({ id }) => !ids.includes(id)), this.more.hidden);
  }

  show() {
    const { works } = this;
    const wanted = this.search.value.trim().toLowerCase();
    this.search.hidden = works.length < SEARCH_FROM && !wanted;
    const focused = this.list.contains(document.activeElement) && document.activeElement;
    render(repeat(works.filter(({ name }) => name.toLowerCase().includes(wanted)), ({ versions }) => versions[0].id, (work) => this.#entry(work)), this.list);
    if (focused && focused !== document.activeElement) focused.focus({ preventScroll: true }); // its entry has another place
    if (state('model') !== this.scrolledTo) this.#scrollToShown();
    this.scrolledTo = state('model');
  }

  /** Scrolls the list, and nothing round it, to the shown model. */
  #scrollToShown() {
    const [row, list] = [this.list.querySelector('[aria-current]'), this.list].map((element) => element?.getBoundingClientRect());
    if (row && (row.top < list.top || row.bottom > list.bottom)) this.list.scrollTop += (row.top + row.bottom - list.top - list.bottom) / 2;
  }

  #entry({ id, name, format, bytes: size, at, picture, versions }) {
    const isShown = versions.some((version) => version.id === state('model'));
    const facts = [format, size === undefined ? null : bytes(size), at && when(at)].filter(Boolean).join(' · ');
    const version = (one, i) => html`<li><button type="button" class="version" aria-current=${one.id === state('model') ? 'true' : nothing}
      @click=${() => openOther(one.id)}>${i + 1}. ${one.name ?? one.id.slice(0, 8)}<span class="dim">${one.at ? when(one.at) : ''}</span></button></li>`;
    return html`<li>
      <div class="row">
        <button type="button" class="model" data-id=${id} aria-current=${isShown ? 'true' : nothing} @click=${() => isShown || openOther(id)}>
          ${picture ? html`<img class="thumbnail" src=${picture} alt="" width="56" height="42">` : html`<span class="thumbnail" aria-hidden="true">${format}</span>`}
          <span class="about"><span class="name" title=${name}>${name}</span><span class="dim">${facts}</span></span>
        </button>
        <button type="button" class="close" aria-label="Rename ${name}" title="Rename" @click=${() => this.rename(id, name)}>✎</button>
        <button type="button" class="close" aria-label="Delete ${name}" title="Delete" @click=${() => this.remove(versions, name)}>×</button>
      </div>
      ${versions.length > 1 ? html`<details class="versions"><summary>${plural(versions.length, 'version')}</summary><ol>${versions.map(version).reverse()}</ol></details>` : nothing}
    </li>`;
  }

  async rename(id, name) {
    const input = make('input', { type: 'text', value: name, 'aria-label': 'Name' });
    const about = make('p', {}, 'The name is kept in this browser; the daemon keeps the one that the model came with.');
    const given = await ask({ title: `Rename ${name}`, content: [about, input], confirm: 'Rename', read: () => input.value.trim() });
    if (given === null) return;
    this.lineages.rename(id, given);
    this.show();
    this.onRename();
  }

  /** Takes a work from the list; the daemon forgets it when the time to undo is over. */
  remove(versions, name) {
    this.finishRemoval();
    const at = this.works.findIndex((work) => work.versions[0].id === versions[0].id);
    const ids = versions.map(({ id }) => id);
    const isShown = ids.includes(state('model'));
    const shown = state('model');
    this.removal = { ids, name, timer: setTimeout(() => this.finishRemoval(), UNDO_MS) };
    this.gone.replaceChildren(`${name} is deleted. `, make('button', { className: 'small', onclick: () => {
      this.#restore();
      if (isShown) openOther(shown);
      this.#focusEntry(at);
    } }, 'Undo'));
    if (isShown) openOther(this.first()); // leave it first: requests for it would fail
    this.show();
    this.#focusEntry(at);
  }

  #focusEntry(at) {
    const buttons = this.list.querySelectorAll('.model');
    buttons[Math.min(at, buttons.length - 1)]?.focus();
  }

  /** Puts what was removed back into the list. */
  #restore() {
    clearTimeout(this.removal.timer);
    this.removal = null;
    this.gone.replaceChildren();
    this.show();
  }

  /** Notes that a model was made of another, which may be leaving the list: it leaves with it. */
  addVersion(made, from) {
    this.lineages.add(made, from);
    if (this.isRemoved(from)) this.removal.ids.push(made);
  }

  /** Whether a model has left the list, and can come back yet. */
  isRemoved(id) {
    return this.removal?.ids.includes(id) ?? false;
  }

  /** Deletes what was removed, now. Other tabs list what is left when the lineages forget it. */
  async finishRemoval(isLeaving = false) {
    if (!this.removal) return;
    const { ids, name, timer } = this.removal;
    clearTimeout(timer);
    this.removal = null;
    this.listed = this.listed.filter(({ id }) => !ids.includes(id));
    if (this.gone.contains(document.activeElement)) this.#focusEntry(0);
    this.gone.replaceChildren();
    const deleted = Promise.all(ids.map((id) => this.#delete(id, name))); // all at once: none would be sent once the page is left
    this.lineages.forget(isLeaving ? ids : (await deleted).filter(Boolean));
    if (!isLeaving) this.load(); // what could not be deleted is there still
  }

  /** Resolves with the id of a model that is gone, null where it stays. */
  async #delete(id, name) {
    try {
      await withKey(() => tweend.remove(id, { keepalive: true }));
    } catch (error) {
      if (error.status !== 404) return fail(`${name} cannot be deleted`, error) ?? null; // a version may have gone before
    }
    this.told.delete(id);
    return id;
  }

  /** Shows the warnings of the shown model: more than two behind their number. */
  tell(model) {
    const { warnings } = model;
    this.told.set(model.id, model);
    const lines = warnings.map((warning) => html`<p class="warning">${warning}</p>`);
    render(lines.length > 2 ? html`<details><summary class="warning">${lines.length} warnings</summary>${lines}</details>` : lines, this.warnings);
  }

  /** Keeps a picture of the shown model. */
  keepPicture(id, url) {
    this.lineages.setPicture(id, url);
    this.show();
  }

  /** The name of a model in the list. */
  nameOf({ id, name }) {
    return this.lineages.of(id)?.name ?? name ?? id;
  }

  /** The id of the model to show first: the animated sample, else the first model. */
  first() {
    const { works } = this;
    return (works.find(({ name }) => name === 'tank.json') ?? works[0])?.id ?? '';
  }
}
