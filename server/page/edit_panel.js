// The panel for modelling: shapes to start from, the selection, edits as buttons, and their list as text. A model in
// tweend JSON contains its list of edits; for any other, the URL holds the original model and the list.
import { download, tweend } from './client.js';
import { choice, make, plural } from './dom.js';
import { meshName, stemOf } from './models.js';
import { fail, OneAtATime } from './notices.js';
import { isSame, Picker, readCages } from './picker.js';
import { codeLine, quote } from './scripts_panel.js';
import { CHOICES, CLEANING, editOf, EDITS, printEdits, SHAPES } from './shapes.js';
import { change, isStep, openOther, state, watch } from './state.js';

const DOCUMENT_MOST = 1e6; // bytes of the largest model whose text is edited
const KINDS = [['faces', 'Faces'], ['edges', 'Edges'], ['vertices', 'Points']];
const wordsOf = (name) => (name[0].toUpperCase() + name.slice(1)).replaceAll('_', ' ');

const hasDecimalComma = (0.5).toLocaleString().includes(',');

/** The numbers of a text: between blanks, semicolons or commas; a comma within a number is a decimal point where the
 *  browser's language writes it so. NaN stands for what is no number. */
function numbersOf(text) {
  const isBlankSeparated = /[\s;]/.test(text.trim());
  const words = text.split(hasDecimalComma && (isBlankSeparated || text.split(',').length === 2) ? /[\s;]+/ : /[\s;,]+/);
  return words.map((word) => word.replace(/,$/, '')).filter(Boolean).map((word) => Number(hasDecimalComma ? word.replace(',', '.') : word));
}

/** Creates input fields for parameters, typed by their initial values. use() is called for Enter in one. read() returns
 *  the present values; null, with a mark on the field, where one is no number. */
export function fieldsOf(parameters, about, use = () => {}) {
  const fields = Object.entries(parameters).map(([name, value]) => {
    const label = `${about}: ${name}`;
    if (CHOICES[name]) {
      const select = make('select', { 'aria-label': label }, ...CHOICES[name].map((text) => make('option', { value: text, selected: text === value }, text)));
      return { name, read: () => select.value, label: make('label', { className: 'parameter' }, make('span', { 'aria-hidden': 'true' }, name), select) };
    }
    const input = make('input', { type: 'text', 'aria-label': label, value: [value].flat().join(', '), autocomplete: 'off',
      oninput: () => tell(''), onkeydown: (event) => event.key === 'Enter' && use() });
    const tell = (fault) => {
      input.setCustomValidity(fault);
      input.setAttribute('aria-invalid', fault !== '');
    };
    const wanted = [value].flat().length;
    const read = () => {
      const numbers = numbersOf(input.value);
      const isGood = numbers.length === wanted && numbers.every(Number.isFinite);
      tell(isGood ? '' : wanted === 1 ? 'A number is expected.' : `${wanted} numbers are expected.`);
      if (!isGood) input.reportValidity();
      return isGood ? (Array.isArray(value) ? numbers : numbers[0]) : undefined;
    };
    return { name, read, label: make('label', { className: 'parameter' }, make('span', { 'aria-hidden': 'true' }, name), input) };
  });
  const read = () => {
    const values = fields.map(({ name, read: readField }) => [name, readField()]);
    return values.some(([, value]) => value === undefined) ? null : Object.fromEntries(values);
  };
  return { labels: fields.map(({ label }) => label), read };
}

export class EditPanel {
  /** models: the list that new models are added to. beside: shows the original. steps: of the lineage. */
  constructor(panel, { viewport, models, beside, steps }) {
    Object.assign(this, { viewport, models, beside, steps, selection: [], edits: [] });
    this.onEdits = () => {}; // called when the list of edits has changed
    this.requests = new OneAtATime();
    this.picker = new Picker(viewport, (...picked) => this.pick(...picked));
    this.shape = make('div', { className: 'parameters' });
    this.kinds = KINDS.map(([kind, text]) => make('button', { type: 'button', className: 'chip', onclick: () => this.choose(kind) }, text));
    this.chosen = make('input', { type: 'text', 'aria-label': 'Selection', autocomplete: 'off', spellcheck: false, onchange: () => this.type() });
    this.said = make('p', { className: 'dim selected', role: 'status' });
    this.buttons = make('div', { className: 'edits' });
    this.text = make('textarea', { rows: 7, 'aria-label': 'Edits', spellcheck: false });
    this.use = make('button', { type: 'button', className: 'primary', onclick: () => this.applyText() }, 'Apply');
    this.curl = make('div');
    this.cleaning = CLEANING.map((form) => {
      const box = make('input', { type: 'checkbox', checked: true });
      const values = make('div', { className: 'edit' });
      return { form, box, values, row: make('div', { className: 'edit' }, make('label', { className: 'check' }, box, make('span', {}, wordsOf(form.edit))), values) };
    });
    this.besides = make('input', { type: 'checkbox', onchange: () => this.showBeside() });
    this.cleaned = make('p', { className: 'dim cleaned', role: 'status' });
    this.body = make('div', {},
      make('h3', {}, 'Scan'),
      make('div', { className: 'row' },
        make('button', { type: 'button', className: 'primary', onclick: () => this.cleanUp() }, 'Clean up'),
        make('label', { className: 'check' }, this.besides, make('span', {}, 'Beside the original'))),
      make('details', {}, make('summary', {}, 'Steps of a clean-up'), ...this.cleaning.map(({ row }) => row)),
      this.cleaned, beside.table,
      make('h3', {}, 'Select'),
      make('div', { className: 'row', role: 'group', 'aria-label': 'What is selected' }, ...this.kinds),
      this.chosen, this.said, this.buttons,
      make('h3', {}, 'Edits so far'), this.text,
      make('div', { className: 'row' }, this.use),
      this.curl);
    panel.append(
      make('h2', {}, 'Edit'),
      choice('New', Object.keys(SHAPES).map((kind) => [kind, wordsOf(kind)]), 'box', (kind) => this.showShape(kind)),
      this.shape, this.body);
    this.showShape('box');
    this.choose('faces');
    viewport.canvas.addEventListener('keydown', (event) => this.key(event));
    watch((names) => {
      if (names.has('model')) this.close();
      if (names.has('tab')) this.open(this.model);
      if (names.has('quads') && !names.has('model') && state('from')) this.turnTo(this.mesh); // the faces have changed
      if (names.has('beside')) this.showSides();
    });
    this.close();
  }

  showShape(kind) {
    const fields = fieldsOf(SHAPES[kind], wordsOf(kind), () => begin());
    const begin = () => {
      const values = fields.read();
      if (values) this.begin({ kind, ...values });
    };
    this.shape.replaceChildren(...fields.labels, make('button', { type: 'button', className: 'primary', onclick: begin }, 'Make'));
  }

  /** Creates a model of one shape. */
  begin(shape) {
    return this.requests.run(async () => {
      const model = await this.upload({ meshes: [{ name: shape.kind, shape }] }, shape.kind);
      this.selection = [];
      await this.models.load();
      openOther(model.id);
    });
  }

  upload(document, name) {
    return tweend.upload(JSON.stringify(document), { name, type: 'application/json' });
  }

  // ---- the model ----

  close() {
    if (!this.requests.isRunning) this.selection = []; // the selection was of another model
    this.picker.close();
    this.model = null;
    this.cleaned.textContent = '';
    this.body.hidden = !isStep(); // a step keeps the focus and what is scrolled to
  }

  /** Shows the edits of a model, once it is loaded and the panel is visible. */
  async open(model) {
    this.model = model;
    this.picker.isOn = Boolean(model) && state('tab') === 'edit';
    this.picker.clear();
    if (!this.picker.isOn || model.meshes.length === 0) return;
    const isText = model.format === 'tweend' && model.bytes < DOCUMENT_MOST;
    try {
      const document = isText ? JSON.parse(await (await download(tweend.sourceUrl(model))).blob.text()) : null;
      const kept = state('from') ? JSON.parse(state('edits')) : [];
      if (this.model !== model || state('tab') !== 'edit') return;
      Object.assign(this, { document, kept });
    } catch (error) {
      fail('The edits of the model cannot be shown', error, () => this.open(this.model));
      return;
    }
    this.showSteps();
    this.showEdits();
    this.body.hidden = false;
    await this.openCage();
  }

  /** The index of the edited mesh. */
  get mesh() {
    return Math.min(Number(state('mesh')) || 0, this.model.meshes.length - 1);
  }

  showEdits() {
    this.edits = (this.document ? this.document.meshes[this.mesh].edits : this.kept) ?? [];
    this.text.value = printEdits(this.edits);
    this.onEdits();
    this.showSides();
    const [path, body] = this.document ? ['v1/models', this.documentWith(this.edits)]
      : [`v1/models/${this.source}/edits`, { mesh: meshName(this.model, this.mesh), edits: this.edits }];
    const key = tweend.key ? '-H "Authorization: Bearer $KEY" ' : '';
    this.curl.replaceChildren(codeLine('curl', `curl ${key}-H 'Content-Type: application/json' -d ${quote(JSON.stringify(body))} ${quote(tweend.url(path))}`));
  }

  /** Enables picking, once the viewport has the cage. */
  async openCage() {
    const { model, viewport: { cage } } = this;
    if (!cage || !this.picker.isOn) return;
    const cages = await readCages(cage.parser);
    if (this.model !== model || this.viewport.cage !== cage) return;
    this.picker.close();
    this.picker.setCages(cages, cage.bearers);
    this.select(this.selection);
  }

  // ---- selecting ----

  choose(kind) {
    this.kind = this.picker.kind = kind;
    KINDS.forEach(([name], i) => this.kinds[i].setAttribute('aria-pressed', name === kind));
    const offered = EDITS.filter(({ of }) => of.includes(kind) || of.length === 0);
    const isPlain = ({ parameters }) => Object.keys(parameters).length === 0;
    this.buttons.replaceChildren(...offered.filter((form) => !isPlain(form)).map((form) => this.row(form)),
      make('div', { className: 'parameters' }, ...offered.filter(isPlain).map((form) => this.row(form))));
    this.select([]);
  }

  /** The index of the picker's object that shows the mesh; -1 when there is none. */
  get object() {
    return !this.model ? -1 : this.picker.objects.findIndex(({ mesh }) => mesh === this.mesh);
  }

  select(selection) {
    const list = this.object < 0 ? [] : this.picker.resolve(this.object, selection);
    this.selection = this.object >= 0 && Array.isArray(selection) ? list : selection;
    this.chosen.value = JSON.stringify(this.selection);
    this.picker.draw(this.object, list);
    const words = KINDS.find(([kind]) => kind === this.kind)[1].toLowerCase();
    const name = this.model?.meshes.length > 1 ? ` of ${this.model.meshes[this.mesh].name ?? `mesh ${this.mesh}`}` : '';
    if (!list) return this.say(`The daemon finds these ${words}${name}.`);
    this.say(list.length > 0 ? `${plural(list.length, words.slice(0, -1))}${name}` : `Click ${words} in the viewport, with Shift more of them; N and P step through them.`);
  }

  say(text) {
    this.said.textContent = text;
  }

  pick(object, element, more) {
    if (element === null) return more || this.select([]);
    const { mesh } = this.picker.objects[object];
    const isOther = mesh !== this.mesh;
    if (isOther) this.turnTo(mesh);
    if (!more || isOther || !Array.isArray(this.selection)) return this.select([element]);
    const others = this.selection.filter((known) => !isSame(known, element));
    this.select(others.length < this.selection.length ? others : [...others, element]);
  }

  /** Switches to another mesh. A list in the URL belongs to one mesh, so the next one starts with the model as it
   *  is. */
  turnTo(mesh) {
    change({ mesh, from: '', edits: '', beside: '' });
    this.kept = [];
    this.showSteps();
    this.showEdits();
  }

  /** Takes the typed selection: JSON, or a word. */
  type() {
    const text = this.chosen.value.trim();
    try {
      this.select(text ? JSON.parse(text) : []);
    } catch {
      this.select(text);
    }
  }

  /** N and P in the viewport select the next or previous element; with Shift they add it. */
  key(event) {
    const by = { n: 1, p: -1 }[event.key.toLowerCase()];
    if (!by || !this.picker.isOn || this.object < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const all = this.picker.resolve(this.object, 'all');
    const last = Array.isArray(this.selection) ? all.findIndex((element) => this.selection.length > 0 && isSame(element, this.selection.at(-1))) : -1;
    const next = all.at((last < 0 ? (by > 0 ? 0 : -1) : last + by) % all.length);
    this.select(event.shiftKey && Array.isArray(this.selection) ? [...this.selection.filter((known) => !isSame(known, next)), next] : [next]);
  }

  // ---- edits ----

  row(form) {
    const text = wordsOf(form.edit);
    const use = () => {
      const values = fields.read();
      if (values) this.edit(form, values);
    };
    const fields = fieldsOf(form.parameters, text, use);
    const button = make('button', { type: 'button', onclick: use }, text);
    return make('div', { className: 'edit' }, button, ...fields.labels);
  }

  edit(form, parameters) {
    const isNone = Array.isArray(this.selection) && this.selection.length === 0;
    if (form.of.length > 0 && isNone) return this.say(`Select ${this.kind} first.`);
    if (form.edit === 'loop_cut' && !Array.isArray(this.selection)) return this.say('A loop cut is of one edge.');
    return this.apply([...this.edits, editOf(form, parameters, this.kind, this.selection)], form);
  }

  applyText() {
    try {
      const edits = JSON.parse(this.text.value);
      if (!Array.isArray(edits)) throw new Error('a list is expected');
      return this.apply(edits);
    } catch (error) {
      return fail('The list is no JSON', error);
    }
  }

  /** The id of the model that the list of edits applies to, unless the model is a document. */
  get source() {
    return state('from') || this.model.id;
  }

  documentWith(edits) {
    const meshes = this.document.meshes.map((mesh, i) => (i === this.mesh ? { ...mesh, edits: edits.length > 0 ? edits : undefined } : mesh));
    return { ...this.document, meshes };
  }

  /** The id of the model without its edits. */
  async original() {
    if (!this.document || this.edits.length === 0) return this.source;
    return (await this.upload(this.documentWith([]), stemOf(this.model))).id;
  }

  /** The id of the model to edit: when triangles are not joined to quads, that of a model in which they stay. */
  async split() {
    const isSplit = state('quads') !== 'auto' && this.model.meshes.some(({ paired_quads: pairs }) => pairs > 0);
    if (this.document || state('from') || !isSplit) return this.source;
    return (await tweend.edit(this.source, [], { mesh: meshName(this.model, this.mesh), quads: state('quads'), name: stemOf(this.model) })).id;
  }

  /** Makes a model by a list of edits and opens it. stays: keep the selection; shown: other changes of the state.
   *  Resolves with the daemon's answer. */
  async go(edits, { stays = false, ...shown } = {}) {
    const source = await this.split();
    const isKept = !this.document && edits.length > 0;
    const name = `${stemOf(this.model)}, ${plural(edits.length, 'edit')}`;
    const made = edits.length === 0 ? { id: await this.original() }
      : isKept ? await tweend.edit(source, edits, { mesh: meshName(this.model, this.mesh), name })
        : await this.upload(this.documentWith(edits), name);
    if (!stays) this.selection = [];
    await this.models.load();
    this.steps.go({ model: made.id, from: isKept ? source : '', edits: isKept ? JSON.stringify(edits) : '',
      quads: isKept ? 'auto' : state('quads'), beside: edits.length > 0 ? state('beside') : '', ...shown });
    return made;
  }

  apply(edits, { stays } = {}) {
    return this.requests.run(() => this.go(edits, { stays }));
  }

  /** Whether the list has an edit that can be taken back, though no step of this visit made it. */
  get canTakeBack() {
    return this.picker.isOn && this.edits.length > 0;
  }

  takeBack() {
    return this.apply(this.edits.slice(0, -1));
  }

  // ---- scans ----

  showSteps() {
    const { faces, bounds: { min, max } } = this.model.meshes[this.mesh];
    const size = Math.hypot(...max.map((value, i) => value - min[i]));
    for (const step of this.cleaning) {
      const { labels, read } = fieldsOf(step.form.parameters({ faces, size }), `Clean up, ${step.form.edit}`);
      step.read = read;
      step.values.replaceChildren(...labels);
    }
  }

  /** Applies all chosen steps at once, and shows level 0, at which a scan is examined. */
  cleanUp() {
    const chosen = this.cleaning.filter(({ box }) => box.checked).map(({ form, read }) => ({ form, values: read() }));
    if (chosen.some(({ values }) => !values)) return;
    const edits = chosen.map(({ form, values }) => ({ edit: form.edit, ...values, ...form.also }));
    if (edits.length === 0) return this.cleaned.replaceChildren('No step is chosen.');
    return this.requests.run(async () => {
      const beside = await this.original();
      const { made = {} } = await this.go([...this.edits, ...edits], { level: 0, beside });
      const said = [made.spikes && `${plural(made.spikes.vertices.length, 'spike')} put back`, made.patches && `${plural(made.patches.faces.length, 'face')} in holes`];
      this.cleaned.textContent = said.filter(Boolean).join(', ');
    });
  }

  showBeside() {
    return this.requests.run(async () => change({ beside: this.besides.checked ? await this.original() : '' }));
  }

  showSides() {
    if (!this.model) return;
    this.besides.checked = state('beside') !== '';
    this.besides.disabled = this.edits.length === 0 && !this.besides.checked;
    this.beside.tell(this.model, this.mesh);
  }
}
