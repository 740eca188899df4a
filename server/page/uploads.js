// Uploads: by a file dialog, or by dropping files anywhere.
import { tweend, withKey } from './client.js';
import { byId, bytes, make } from './dom.js';
import { explain, mayPass } from './notices.js';
import { change, state } from './state.js';

const ASIDES = /\.(mtl|png|jpe?g|webp|tga|bmp|tiff?)$/i; // files that an OBJ refers to
const GLTF = /\.(glb|gltf|vrma?)$/i;
const MODELS = /\.(glb|gltf|vrma?|obj|stl|ply|bvh|json)$/i;
const MOTIONS = /\.(bvh|vrma)$/i; // nothing but clips, for models that come with them or are shown
const SUFFIXES = '.glb,.gltf,.bin,.png,.jpg,.jpeg,.webp,.vrm,.vrma,.obj,.stl,.ply,.bvh,.json';

/** The files that an entry of a file system is or, as a folder, holds. */
async function filesOf(entry) {
  if (entry.isFile) return [await new Promise((resolve, reject) => entry.file(resolve, reject))];
  const reader = entry.createReader();
  const read = () => new Promise((resolve, reject) => reader.readEntries(resolve, reject)); // some at a time, then none
  const found = [];
  for (let some = await read(); some.length > 0; some = await read()) found.push(...some);
  return (await Promise.all(found.map(filesOf))).flat();
}

/** The files that were dropped, and those in dropped folders. */
async function filesIn({ items }) {
  const found = [...items].filter(({ kind }) => kind === 'file').map((item) => item.webkitGetAsEntry() ?? item.getAsFile()); // all at once: the items last as long as the event
  return (await Promise.all(found.map((one) => (one instanceof File ? [one] : filesOf(one))))).flat();
}

/** Shows the panel where it is hidden: something stands there that a person waits for. */
const showPanel = () => state('panel') === '0' && change({ panel: '' });

export class Uploads {
  /** onStored(model, isFirst) is awaited for each model that was stored; isFirst: of those that were given with it. */
  constructor(onStored) {
    this.onStored = onStored;
    this.input = make('input', { type: 'file', multiple: true, accept: SUFFIXES, className: 'hidden', tabIndex: -1, 'aria-label': 'Files to upload' });
    this.input.addEventListener('change', () => {
      this.take([...this.input.files]);
      this.input.value = '';
    });
    this.button = make('button', { className: 'primary', onclick: () => this.input.click() }, 'Upload');
    this.said = make('p', { className: 'dim', role: 'status' });
    this.progress = make('div', { className: 'uploads' }, this.said);
    byId('empty-choose').addEventListener('click', () => this.input.click());
    this.#catchDrops();
  }

  #catchDrops() {
    const drop = byId('drop');
    const hasFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes('Files');
    let depth = 0;
    addEventListener('dragenter', (event) => {
      if (!hasFiles(event)) return;
      depth++;
      drop.hidden = false;
    });
    addEventListener('dragleave', (event) => {
      if (hasFiles(event) && --depth <= 0) drop.hidden = true;
    });
    addEventListener('dragover', (event) => hasFiles(event) && event.preventDefault());
    addEventListener('drop', (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      depth = 0;
      drop.hidden = true;
      filesIn(event.dataTransfer).then((files) => this.take(files), (error) => this.note('The files cannot be read', ...explain(error)));
    });
  }

  /** Uploads files as one model each, clips for others last, a glTF together with the files that are no models, which it may
   *  name. Leaves out the material files of an OBJ. What was said of files before goes. */
  async take(given) {
    for (const note of this.progress.querySelectorAll('.problem')) note.remove();
    this.said.textContent = '';
    const hasObj = given.some(({ name }) => /\.obj$/i.test(name));
    const isAside = ({ name }) => hasObj && ASIDES.test(name);
    const files = given.filter((file) => !isAside(file));
    if (files.length < given.length) {
      const names = given.filter(isAside).map(({ name }) => name).join(', ');
      this.note(`Left out: ${names}`, make('p', {}, 'Of an OBJ the names of its materials are kept, not their colours and textures. Export GLB to keep those.'));
    }
    const isGltf = ({ name }) => GLTF.test(name);
    const named = files.some(isGltf) ? files.filter(({ name }) => !MODELS.test(name)) : [];
    const isMotion = ({ name }) => MOTIONS.test(name);
    const models = files.filter((file) => !named.includes(file)).sort((a, b) => isMotion(a) - isMotion(b));
    let stored = 0;
    change({ tab: 'models' });
    for (const [i, model] of models.entries()) {
      const end = await this.#send(named.length > 0 && isGltf(model) ? [model, ...named] : model, model.name, stored === 0);
      if (end === 'stored') stored++;
      const left = end === 'cancelled' ? models.length - i : 0;
      this.said.textContent = [stored > 1 && `${stored} models are stored, and in the list.`, left > 1 && `${left} files are not sent.`].filter(Boolean).join(' ');
      if (left > 0) return;
    }
  }

  /** Resolves with 'stored', 'refused' or 'cancelled'. */
  async #send(source, name, isFirst) {
    const controller = new AbortController();
    const bar = make('progress', { max: 1, value: 0, 'aria-label': `Upload of ${name}` });
    const said = make('span', { className: 'dim' }, 'sending');
    const cancel = make('button', { className: 'small', onclick: () => controller.abort() }, 'Cancel');
    const row = make('div', { className: 'upload' }, make('span', { className: 'name' }, name), said, cancel, bar);
    this.progress.append(row);
    const onProgress = (loaded, total) => {
      if (loaded < total) showPanel();
      bar.value = total ? loaded / total : 0;
      said.textContent = loaded < total ? `${bytes(loaded)} of ${bytes(total)}` : 'reading';
    };
    const onWait = (wait, { detail = 'the daemon is busy' }) => {
      showPanel();
      bar.value = 0;
      said.textContent = `${detail}, sent again in ${Math.ceil(wait)} s`;
    };
    try {
      const model = await withKey(() => tweend.upload(source, { name, onProgress, onWait, signal: controller.signal }));
      row.remove();
      await this.onStored(model, isFirst);
      return 'stored';
    } catch (error) {
      row.remove();
      if (error.name === 'AbortError') return 'cancelled';
      const again = () => {
        note.remove();
        this.#send(source, name, true);
      };
      const note = this.note(mayPass(error) ? `${name} could not be sent` : `${name} was refused`, ...explain(error), ...(await linesOf(source, error)),
        mayPass(error) && make('button', { className: 'small', onclick: again }, 'Send again'));
      return 'refused';
    }
  }

  /** Shows a note above the list until it is closed, or other files are given. */
  note(title, ...content) {
    const note = make('div', { className: 'problem', role: 'alert' }, make('h3', {}, title), ...content.filter(Boolean));
    note.prepend(make('button', { className: 'close', 'aria-label': 'Close', onclick: () => note.remove() }, '×'));
    this.progress.append(note);
    showPanel();
    return note;
  }
}

/** The lines of a text file around the one that the error names. */
async function linesOf(source, { line }) {
  if (!line || !(source instanceof Blob) || source.size > 32e6) return [];
  const lines = (await source.text()).replace(/\n$/, '').split('\n');
  const rows = [];
  for (let i = Math.max(1, line - 2); i <= Math.min(lines.length, line + 2); i++)
    rows.push(make('div', { className: i === line ? 'here' : '' }, make('i', {}, String(i)), (lines[i - 1] ?? '').slice(0, 120) || ' '));
  return [make('pre', { tabIndex: 0, 'aria-label': `Lines round line ${line}` }, ...rows)];
}
