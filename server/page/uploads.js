// Uploads: by a file dialog, or by dropping files anywhere.
import { tweend, withKey } from './client.js';
import { byId, bytes, make } from './dom.js';
import { explain } from './notices.js';
import { change, openOther } from './state.js';

const ASIDES = /\.(mtl|png|jpe?g|webp|tga|bmp|tiff?)$/i; // files that an OBJ refers to
const MODELS = /\.(glb|gltf|vrma?|obj|stl|ply|bvh|json)$/i;
const SUFFIXES = '.glb,.gltf,.bin,.png,.jpg,.jpeg,.webp,.vrm,.vrma,.obj,.stl,.ply,.bvh,.json';

export class Uploads {
  /** onStored(model) is awaited for each model that was stored; if it resolves with true, the model is not opened. */
  constructor(onStored) {
    this.onStored = onStored;
    this.input = make('input', { type: 'file', multiple: true, accept: SUFFIXES, className: 'hidden', tabIndex: -1, 'aria-label': 'Files to upload' });
    this.input.addEventListener('change', () => {
      this.take([...this.input.files]);
      this.input.value = '';
    });
    this.button = make('button', { className: 'primary', onclick: () => this.input.click() }, 'Upload');
    this.progress = make('div', { className: 'uploads' });
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
      this.take([...event.dataTransfer.files]);
    });
  }

  /** Uploads files: together as one model when one of several is a glTF, or when all but one GLB are no models, else
   *  as one model each. Leaves out the material files of an OBJ. */
  take(files) {
    const asides = files.some(({ name }) => /\.obj$/i.test(name)) ? files.filter(({ name }) => ASIDES.test(name)) : [];
    if (asides.length > 0) {
      const names = asides.map(({ name }) => name).join(', ');
      this.note(`Left out: ${names}`, make('p', {}, 'Of an OBJ the names of its materials are kept, not their colours and textures. Export GLB to keep those.'));
      return this.take(files.filter((file) => !asides.includes(file)));
    }
    const models = files.filter(({ name }) => MODELS.test(name));
    const main = files.find(({ name }) => /\.gltf$/i.test(name)) ?? (models.length === 1 && /\.glb$/i.test(models[0].name) ? models[0] : null);
    if (main && files.length > 1) return this.#send(files, main.name);
    return files.reduce((before, file) => before.then(() => this.#send(file, file.name)), Promise.resolve());
  }

  async #send(source, name) {
    const controller = new AbortController();
    const bar = make('progress', { max: 1, value: 0, 'aria-label': `Upload of ${name}` });
    const said = make('span', { className: 'dim' }, 'sending');
    const cancel = make('button', { className: 'small', onclick: () => controller.abort() }, 'Cancel');
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
      if (!(await this.onStored(model))) openOther(model.id);
    } catch (error) {
      row.remove();
      if (error.name === 'AbortError') return;
      this.note(`${name} was refused`, ...explain(error), ...(await linesOf(source, error)));
    }
  }

  /** Shows a note above the list until it is closed. */
  note(title, ...content) {
    const note = make('div', { className: 'problem', role: 'alert' }, make('h3', {}, title), ...content);
    note.prepend(make('button', { className: 'close', 'aria-label': 'Close', onclick: () => note.remove() }, '×'));
    this.progress.append(note);
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
