// Which models this browser made from which, by edits and strokes: the versions of one work. The daemon knows nothing of
// it, as models are immutable there and equal for all; so it is kept in the browser's own storage, with names that were
// given here and with thumbnails. Another browser lists each version as a model.

import { storage as kept } from './storage.js';

const THUMBNAILS_MOST = 300;

export class Lineages {
  #storage;
  #key;

  /** base: the daemon's address; several may be behind one origin. */
  constructor(base, storage = kept) {
    this.#storage = storage;
    this.#key = `tweend ${base}`;
    this.readAgain();
  }

  /** Reads what another tab may have written. */
  readAgain() {
    this.works = this.#read('works', []); // [{name, versions: [{id, at}]}], at: Unix milliseconds
    this.pictures = this.#read('pictures', {}); // by model: a data URL
    this.forgotten = this.#read('forgotten', []); // ids, the last time
  }

  /** Whether a key of the storage is of these. */
  has(key) {
    return key === null || key.startsWith(`${this.#key} `);
  }

  #read(what, otherwise) {
    try {
      return JSON.parse(this.#storage.getItem(`${this.#key} ${what}`)) ?? otherwise;
    } catch {
      return otherwise;
    }
  }

  #write(what, value) {
    try {
      this.#storage.setItem(`${this.#key} ${what}`, JSON.stringify(value));
    } catch {
      // the storage is full: this is lost when the page is left
    }
  }

  #keep() {
    this.#write('works', this.works);
  }

  /** The work that a model is a version of; undefined for a model that this browser has not made or named. */
  of(id) {
    return this.works.find(({ versions }) => versions.some((version) => version.id === id));
  }

  /** Notes that a model came from another, or from nothing. */
  add(made, from, at = Date.now()) {
    if (this.of(made)) return;
    const work = this.of(from);
    if (work) work.versions.push({ id: made, at });
    else this.works.push({ versions: from && from !== made ? [{ id: from }, { id: made, at }] : [{ id: made, at }] });
    this.#keep();
  }

  rename(id, name) {
    if (!this.of(id)) this.add(id, undefined, null);
    this.of(id).name = name || undefined;
    this.#keep();
  }

  forget(ids) {
    for (const work of this.works) work.versions = work.versions.filter(({ id }) => !ids.includes(id));
    this.works = this.works.filter(({ versions }) => versions.length > 0);
    for (const id of ids) delete this.pictures[id];
    this.#keep();
    this.#write('pictures', this.pictures);
    this.#write('forgotten', ids); // other tabs hear of what changes: these may have been in no work
  }

  setPicture(id, url) {
    delete this.pictures[id]; // the newest come last
    this.pictures[id] = url;
    for (const old of Object.keys(this.pictures).slice(0, -THUMBNAILS_MOST)) delete this.pictures[old];
    this.#write('pictures', this.pictures);
  }

  /** The listed models as works, the newest first: [{id: of the newest version, name, format, bytes, at, picture, versions}].
   *  isWhole: all models are listed, so that a version that is not has gone. */
  group(models, isWhole) {
    const listed = new Map(models.map((model) => [model.id, model]));
    const works = new Map();
    for (const model of models) {
      const work = this.of(model.id) ?? model;
      const known = work.versions ?? [{ id: model.id }];
      const versions = known.filter(({ id }) => listed.has(id) || !isWhole).map((version) => ({ ...listed.get(version.id), ...version, picture: this.pictures[version.id] }));
      const { id, at } = versions.at(-1);
      const first = versions.find(({ name }) => name);
      works.set(work, { id, at, name: work.name ?? first?.name ?? id.slice(0, 8), format: versions.at(-1).format ?? model.format,
        bytes: versions.at(-1).bytes, picture: versions.findLast(({ picture }) => picture)?.picture, versions });
    }
    return [...works.values()].sort((a, b) => (b.at ?? 0) - (a.at ?? 0) || a.name.localeCompare(b.name));
  }
}
