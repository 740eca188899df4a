// The list of models, and uploads: by a file dialog, or by dropping files anywhere.
import { tweend, withKey } from './client.js';
import { ask, byId, bytes, make } from './dom.js';
import { explain, fail } from './notices.js';
import { change, openOther, state, watch } from './state.js';

const PAGE = 100;
const ASIDES = /\.(mtl|png|jpe?g|webp|tga|bmp|tiff?)$/i; // files that an OBJ refers to
const SUFFIXES = '.glb,.gltf,.bin,.png,.jpg,.jpeg,.webp,.obj,.stl,.ply,.bvh,.json';

/** The name by which requests find a mesh; undefined when the model has only one. */
export const meshName = ({ meshes }, mesh) => (meshes.length > 1 ? meshes[mesh].name ?? `mesh_${mesh}` : undefined);

/** The name of a model without the suffix for its edits. */
export const stemOf = ({ name }) => (name ?? '').replace(/, (\d+ edits?|sculpted)$/, '');

export class Models {
  constructor(panel) {
    this.input = make('input', { type: 'file', multiple: true, accept: SUFFIXES, className: 'hidden', tabIndex: -1, 'aria-label': 'Files to upload' });
    this.input.addEventListener('change', () => {
      this.upload([...this.input.files]);
      this.input.value = '';
    });
    const choose = make('button', { type: 'button', className: 'primary', onclick: () => this.input.click() }, 'Upload');
    this.progress = make('div', { className: 'uploads' });
    this.warnings = make('div', { role: 'status' });
    this.list = make('ul', { className: 'models' });
    this.more = make('button', { type: 'button', className: 'quiet wide', hidden: true, onclick: () => this.load(true) }, 'More');
    panel.append(
      make('div', { className: 'row' }, make('h2', {}, 'Models'), make('span', { className: 'space' }), choose, this.input),
      make('p', { className: 'dim' }, 'Drop files anywhere: GLB, glTF with its files, OBJ, STL, PLY, BVH, tweend JSON.'),
      this.progress, this.warnings, this.list, this.more);
    byId('empty-choose').addEventListener('click', () => this.input.click());
    this.catchDrops();
    watch((names) => {
      if (names.has('model')) this.warnings.replaceChildren();
      if (names.has('model') || names.has('tab')) this.mark();
    });
  }

  catchDrops() {
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
      this.upload([...event.dataTransfer.files]);
    });
  }

  /** Uploads files: together as one model when one of several is a glTF, or when all but one GLB are no models, else
   *  as one model each. Leaves out the material files of an OBJ. */
  upload(files) {
    const asides = files.some(({ name }) => /\.obj$/i.test(name)) ? files.filter(({ name }) => ASIDES.test(name)) : [];
    if (asides.length > 0) {
      const names = asides.map(({ name }) => name).join(', ');
      this.note('problem', `Left out: ${names}`, make('p', {}, 'Of an OBJ the names of its materials are kept, not their colours and textures. Export GLB to keep those.'));
      return this.upload(files.filter((file) => !asides.includes(file)));
    }
    const models = files.filter(({ name }) => /\.(glb|gltf|obj|stl|ply|json)$/i.test(name));
    const main = files.find(({ name }) => /\.gltf$/i.test(name)) ?? (models.length === 1 && /\.glb$/i.test(models[0].name) ? models[0] : null);
    if (main && files.length > 1) return this.send(files, main.name);
    return files.reduce((before, file) => before.then(() => this.send(file, file.name)), Promise.resolve());
  }

  async send(source, name) {
    const controller = new AbortController();
    const bar = make('progress', { max: 1, value: 0, 'aria-label': `Upload of ${name}` });
    const said = make('span', { className: 'dim' }, 'sending');
    const cancel = make('button', { type: 'button', className: 'small', onclick: () => controller.abort() }, 'Cancel');
    const row = make('div', { className: 'upload' }, make('span', { className: 'name' }, name), said, cancel, bar);
    this.progress.append(row);
    change({ tab: 'models' });
    const onProgress = (loaded, total) => {
      bar.value = total ? loaded / total : 0;
      said.textContent = loaded < total ? `${bytes(loaded)} of ${bytes(total)}` : 'reading';
    };
    try {
      const model = await withKey(() => tweend.upload(source, { name, onProgress, signal: controller.signal }));
      row.remove();
      await this.load();
      openOther(model.id);
    } catch (error) {
      row.remove();
      if (error.name === 'AbortError') return;
      this.note('problem', `${name} was refused`, ...explain(error), ...(await this.place(source, error)));
    }
  }

  /** Shows a note above the list until it is closed. */
  note(className, title, ...content) {
    const note = make('div', { className, role: 'alert' }, make('h3', {}, title), ...content);
    note.prepend(make('button', { type: 'button', className: 'close', 'aria-label': 'Close', onclick: () => note.remove() }, '×'));
    this.progress.append(note);
  }

  /** The lines of a text file around the one that the error names. */
  async place(source, { line }) {
    if (!line || !(source instanceof Blob) || source.size > 32e6) return [];
    const lines = (await source.text()).split('\n');
    const rows = [];
    for (let i = Math.max(1, line - 2); i <= Math.min(lines.length, line + 2); i++)
      rows.push(make('div', { className: i === line ? 'here' : '' }, make('i', {}, String(i)), (lines[i - 1] ?? '').slice(0, 120) || ' '));
    return [make('pre', { tabIndex: 0, 'aria-label': `Lines round line ${line}` }, ...rows)];
  }

  async load(more = false) {
    try {
      const models = await withKey(async () => {
        const found = [];
        const listed = tweend.list({ limit: PAGE, after: more ? this.last : undefined });
        for await (const model of listed) {
          found.push(model);
          if (found.length === PAGE) break;
        }
        return found;
      });
      this.last = models.at(-1)?.id; // the daemon lists in the order of ids
      this.known = (more ? [...this.known, ...models] : models).sort((a, b) => (a.name ?? '').localeCompare(b.name ?? ''));
      this.more.hidden = models.length < PAGE;
      this.show();
    } catch (error) {
      this.known ??= [];
      fail('The models cannot be listed', error, () => this.load(more));
    }
    byId('empty').hidden = this.known.length > 0 || state('model') !== '';
  }

  show() {
    const { scrollTop } = this.list;
    this.list.replaceChildren(...this.known.map((model) => this.row(model)));
    this.list.scrollTop = scrollTop;
    this.mark();
  }

  row({ id, name, format, bytes: size }) {
    const open = make('button', { type: 'button', className: 'model', onclick: () => openOther(id) },
      make('span', { className: 'name' }, name || id.slice(0, 8)), make('span', { className: 'dim' }, `${format} · ${bytes(size)}`));
    open.dataset.id = id;
    const remove = make('button', { type: 'button', className: 'close', 'aria-label': `Delete ${name || id}`, onclick: () => this.remove(id, name || id) }, '×');
    return make('li', {}, open, remove);
  }

  async remove(id, name) {
    const at = this.known.findIndex((model) => model.id === id);
    const about = make('p', {}, 'The daemon forgets it, and addresses that show it find nothing.');
    if (!(await ask({ title: `Delete ${name}?`, content: [about], confirm: 'Delete' }))) return;
    const focusNear = () => this.list.querySelectorAll('.model')[Math.min(at, this.known.length - 1)]?.focus();
    this.known = this.known.filter((model) => model.id !== id);
    this.show();
    focusNear();
    if (state('model') === id) openOther(this.first()); // leave it first: requests for it would fail
    try {
      await withKey(() => tweend.remove(id));
    } catch (error) {
      fail(`${name} cannot be deleted`, error);
    }
    const isHere = this.list.contains(document.activeElement);
    await this.load();
    if (isHere) focusNear();
  }

  /** Shows the warnings of the shown model: more than two behind their number. */
  tell({ warnings }) {
    const lines = warnings.map((warning) => make('p', { className: 'warning' }, warning));
    const many = () => make('details', {}, make('summary', { className: 'warning' }, `${lines.length} warnings`), ...lines);
    this.warnings.replaceChildren(...(lines.length > 2 ? [many()] : lines));
  }

  mark() {
    for (const button of this.list.querySelectorAll('.model')) {
      if (button.dataset.id === state('model')) {
        button.setAttribute('aria-current', 'true');
        const [row, list] = [button, this.list].map((element) => element.getBoundingClientRect()); // scroll only the list
        if (row.top < list.top || row.bottom > list.bottom) this.list.scrollTop += (row.top + row.bottom - list.top - list.bottom) / 2;
      }
      else button.removeAttribute('aria-current');
    }
  }

  /** The id of the model to show first: the animated sample, else the first model. */
  first() {
    return (this.known?.find(({ name }) => name === 'tank.json') ?? this.known?.[0])?.id ?? '';
  }
}
