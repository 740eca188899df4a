// The panel for modelling: the shape, the selection, edits as buttons, and their list as text. A model in tweend JSON
// contains its list of edits; for any other, the URL holds the original model and the list.
import { render } from 'lit-html';

import { download, tweend } from './client.js';
import { check, chips, make, plural, press } from './dom.js';
import { EditTools } from './edit_tools.js';
import { fieldsOf } from './fields.js';
import { meshName, stemOf } from './models.js';
import { fail, marked, OneAtATime } from './notices.js';
import { Picker, readCages } from './picker.js';
import { quote } from './scripts.js';
import { KINDS, Selection } from './selection.js';
import { CLEANING, editOf, EDITS, isScan, printEdits, SHAPES, wordsOf } from './shapes.js';
import { change, isStep, openOther, state, watch } from './state.js';
import { codeLine } from './templates.js';

const DOCUMENT_MOST = 1e6; // bytes of the largest model whose text is edited
const SELECTING = [['all', 'All'], ['none', 'None'], ['invert', 'Invert'], ['grow', 'Grow'], ['shrink', 'Shrink'], ['linked', 'Linked'], ['loop', 'Loop'], ['ring', 'Ring']];

export class EditPanel {
  /** models: the list that new models are added to. beside: shows the original. steps: of the lineage. */
  constructor(panel, { viewport, models, beside, steps }) {
    Object.assign(this, { viewport, models, beside, steps, edits: [] });
    this.onEdits = () => {}; // called when the list of edits has changed
    this.requests = new OneAtATime();
    this.picker = new Picker(viewport, (...picked) => this.pick(...picked));
    this.selection = new Selection(this.picker, () => this.object, () => this.showSelection());
    this.tools = new EditTools({ viewport, picker: this.picker, selection: this.selection, panel: this });
    this.shape = make('div');
    this.kinds = chips(KINDS, (kind) => this.choose(kind));
    this.changes = SELECTING.map(([name, text]) => make('button', { className: 'small', 'data-name': name, onclick: () => this.selection.change(name) }, text));
    this.chosen = make('input', { type: 'text', 'aria-label': 'Selection', autocomplete: 'off', spellcheck: false, onchange: () => this.type() });
    this.said = make('p', { className: 'dim selected', role: 'status' });
    this.buttons = make('div', { className: 'edits' });
    this.whole = make('div', { className: 'edits' }, ...this.rows(EDITS.filter(({ of }) => of.length === 0)));
    this.text = make('textarea', { rows: 7, 'aria-label': 'Edits', spellcheck: false });
    this.use = make('button', { className: 'primary', onclick: () => this.applyText() }, 'Apply');
    this.curl = make('div');
    this.cleaning = CLEANING.map((form) => {
      const box = make('input', { type: 'checkbox', checked: true });
      const values = make('div', { className: 'edit' });
      return { form, box, values, row: make('div', { className: 'edit' }, check(box, wordsOf(form.edit)), values) };
    });
    this.besides = make('input', { type: 'checkbox', onchange: () => this.showBeside() });
    this.sided = check(this.besides, 'Beside the original');
    this.cleaned = make('p', { className: 'dim cleaned', role: 'status' });
    this.scan = make('details', { className: 'group' }, make('summary', {}, 'Clean up a scan'),
      make('button', { className: 'primary', onclick: () => this.cleanUp() }, 'Clean up'),
      make('details', {}, make('summary', {}, 'Steps of a clean-up'), ...this.cleaning.map(({ row }) => row)));
    this.wholes = make('details', { className: 'group' }, make('summary', {}, 'Edits of the whole mesh'), this.whole);
    this.body = make('div', {},
      this.shape, this.cleaned, this.sided, beside.table,
      make('h3', {}, 'Selection'),
      make('div', { className: 'row', role: 'group', 'aria-label': 'What is selected' }, ...this.kinds),
      make('div', { className: 'changes', role: 'group', 'aria-label': 'Select more or others' }, ...this.changes),
      this.said, this.chosen, this.buttons,
      this.wholes, this.scan,
      make('h3', {}, 'Edits so far'), this.text,
      make('div', { className: 'row' }, this.use),
      this.curl);
    this.hint = make('p', { className: 'dim' });
    panel.append(make('h2', {}, 'Edit'), this.hint, this.body);
    this.choose('faces');
    viewport.canvas.addEventListener('keydown', (event) => this.key(event));
    watch((names) => {
      if (names.has('model')) this.close();
      if (names.has('tab') && this.model) this.open(this.model);
      if (names.has('quads') && !names.has('model') && state('from')) this.turnTo(this.mesh); // the faces have changed
      if (names.has('beside')) this.showSides();
    });
    this.close();
  }

  /** The shapes to start from, as [text, function]. */
  get shapes() {
    return Object.keys(SHAPES).map((kind) => [wordsOf(kind), () => this.begin({ kind, ...SHAPES[kind] })]);
  }

  /** Creates a model of one shape. */
  begin(shape) {
    return this.requests.run(async () => {
      const model = await this.upload({ meshes: [{ name: shape.kind, shape }] }, wordsOf(shape.kind).toLowerCase());
      this.selection.value = [];
      this.models.lineages.add(model.id);
      await this.models.load();
      openOther(model.id);
      change({ tab: 'edit' });
    });
  }

  /** Shows the parameters of the shape that the mesh is made of. */
  showShape() {
    const shape = this.document?.meshes[this.mesh].shape;
    const isKnown = shape && SHAPES[shape.kind];
    this.shape.hidden = !isKnown;
    if (!isKnown) return;
    const values = Object.fromEntries(Object.entries(SHAPES[shape.kind]).map(([name, value]) => [name, shape[name] ?? value]));
    const text = wordsOf(shape.kind);
    const use = () => {
      const read = fields.read();
      if (read) this.reshape({ kind: shape.kind, ...read });
    };
    const fields = fieldsOf(values, text, use);
    const focused = this.shape.contains(document.activeElement) && document.activeElement.getAttribute('aria-label');
    this.shape.replaceChildren(make('h3', {}, text),
      make('div', { className: 'parameters' }, ...fields.labels, make('button', { 'aria-label': `Change the ${text.toLowerCase()}`, onclick: use }, 'Change')));
    if (focused) [...this.shape.querySelectorAll('input, select, button')].find((field) => field.getAttribute('aria-label') === focused)?.focus();
  }

  /** Changes the shape below the edits. */
  reshape(shape) {
    return this.ask(async () => {
      const meshes = this.document.meshes.map((mesh, i) => (i === this.mesh ? { ...mesh, shape } : mesh));
      const { model } = this;
      const made = await this.upload({ ...this.document, meshes }, model.name);
      this.steps.go(model, { model: made.id });
      this.models.load();
    });
  }

  upload(document, name) {
    return tweend.upload(JSON.stringify(document), { name, type: 'application/json' });
  }

  // ---- the model ----

  close() {
    if (!this.requests.isRunning && !isStep()) this.selection.value = []; // the selection was of another model
    this.picker.close();
    this.model = null;
    this.requests.hold(isStep());
    this.tools.show();
    this.cleaned.textContent = '';
    this.body.hidden = !isStep(); // a step keeps the focus and what is scrolled to
    this.hint.textContent = 'Open a model, or make a shape.';
    this.hint.hidden = !this.body.hidden;
  }

  /** Shows the edits of a model, once it is loaded and the panel is visible. */
  open(model) {
    return marked(this.#open(model));
  }

  async #open(model) {
    this.model = model;
    this.requests.hold(true);
    const isRead = await this.#read(model);
    if (this.model !== model) return;
    this.requests.hold(false);
    if (isRead) await this.openCage();
  }

  /** Resolves with whether there are edits to show. */
  async #read(model) {
    Object.assign(this, { document: null, kept: [], edits: [] });
    this.picker.isOn = Boolean(model) && state('tab') === 'edit';
    this.picker.clear();
    this.picker.hover();
    this.tools.show();
    if (!this.picker.isOn) return false;
    if (model.meshes.length === 0) {
      this.hint.textContent = 'This model has no surface.';
      return false;
    }
    const isText = model.format === 'tweend' && model.bytes < DOCUMENT_MOST;
    try {
      const document = isText ? JSON.parse(await (await download(tweend.sourceUrl(model))).blob.text()) : null;
      const kept = state('from') ? JSON.parse(state('edits') || '[]') : [];
      if (this.model !== model || state('tab') !== 'edit') return false;
      Object.assign(this, { document, kept });
    } catch (error) {
      fail('The edits of the model cannot be shown', error, () => this.open(this.model));
      return false;
    }
    this.showSteps();
    this.showEdits();
    this.body.hidden = false;
    this.hint.hidden = true;
    return true;
  }

  /** The index of the edited mesh. */
  get mesh() {
    return Math.min(Number(state('mesh')), this.model.meshes.length - 1);
  }

  showEdits() {
    this.edits = (this.document ? this.document.meshes[this.mesh].edits : this.kept) ?? [];
    this.text.value = printEdits(this.edits);
    this.onEdits();
    this.showShape();
    this.showSides();
    const [path, body] = this.document ? ['v1/models', this.documentWith(this.edits)]
      : [`v1/models/${this.source}/edits`, { mesh: meshName(this.model, this.mesh), edits: this.edits }];
    const key = tweend.key ? '-H "Authorization: Bearer $KEY" ' : '';
    render(codeLine('curl', `curl ${key}-H 'Content-Type: application/json' -d ${quote(JSON.stringify(body))} ${quote(tweend.url(path))}`), this.curl);
  }

  /** Enables picking, once the viewport has the cage: through a step it keeps that of the model before. */
  async openCage() {
    const { model, viewport: { cage } } = this;
    if (!cage || cage.of !== model?.id || !this.picker.isOn) return;
    const cages = await readCages(cage.parser);
    if (this.model !== model || this.viewport.cage !== cage) return;
    this.picker.close();
    this.picker.setCages(cages, cage.bearers);
    this.selection.set(this.selection.value);
    this.tools.show();
  }

  // ---- selecting ----

  /** Whether the selection, or an edit that a hand makes, is marked in the picture. */
  get hasMarks() {
    return this.picker.isOn && (!this.selection.isEmpty || this.tools.gesture !== null);
  }

  choose(kind) {
    this.selection.choose(kind);
    press(this.kinds, (name) => name === kind);
    for (const button of this.changes) button.hidden = kind !== 'edges' && ['loop', 'ring'].includes(button.dataset.name);
    this.buttons.replaceChildren(...this.rows(EDITS.filter(({ of }) => of.includes(kind))));
  }

  /** The index of the picker's object that shows the mesh; -1 when there is none. */
  get object() {
    return !this.model ? -1 : this.picker.objects.findIndex(({ index }) => index === this.mesh);
  }

  showSelection() {
    if (!this.chosen) return; // while it is built
    this.chosen.value = JSON.stringify(this.selection.value);
    this.say(this.selection.say(this.model?.meshes.length > 1 ? this.model.meshes[this.mesh].name ?? `mesh ${this.mesh}` : ''));
    this.tools.place();
  }

  say(text) {
    this.said.textContent = text;
  }

  /** Shift adds, as a tap does, which has no Shift; Alt takes the loop of an edge, with Ctrl its ring. */
  pick(object, element, { shiftKey, altKey, ctrlKey, pointerType }) {
    const more = shiftKey || pointerType === 'touch';
    if (element === null) return more || this.selection.set([]);
    const { index } = this.picker.objects[object];
    const isOther = index !== this.mesh;
    if (isOther) this.turnTo(index);
    return this.selection.pick(element, { more: more && !isOther, by: altKey ? (ctrlKey ? 'ring' : 'loop') : undefined });
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
      this.selection.set(text ? JSON.parse(text) : []);
    } catch {
      this.selection.set(text);
    }
  }

  /** N and P in the viewport select the next or previous element; with Shift they add it. */
  key(event) {
    const by = { n: 1, p: -1 }[event.key.toLowerCase()];
    if (!by || !this.picker.isOn || this.object < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.selection.step(by, event.shiftKey);
  }

  // ---- edits ----

  /** A row for each edit, those without parameters together in the last. */
  rows(forms) {
    const isPlain = ({ parameters }) => Object.keys(parameters).length === 0;
    return [...forms.filter((form) => !isPlain(form)).map((form) => this.row(form)),
      make('div', { className: 'parameters' }, ...forms.filter(isPlain).map((form) => this.row(form)))];
  }

  row(form) {
    const text = wordsOf(form.edit);
    const use = () => {
      const values = fields.read();
      if (values) this.edit(form, values);
    };
    const fields = fieldsOf(form.parameters, text, use);
    const button = make('button', { onclick: use }, text);
    return make('div', { className: 'edit' }, button, ...fields.labels);
  }

  edit(form, parameters) {
    const { kind, value, isEmpty } = this.selection;
    if (form.of.length > 0 && isEmpty) return this.say(`Select ${wordsOf(kind).toLowerCase()} first.`);
    if (form.edit === 'loop_cut' && !Array.isArray(value)) return this.say('A loop cut is of one edge.');
    return this.add(editOf(form, parameters, kind, value), form);
  }

  deleteSelected() {
    return this.edit(EDITS.find(({ edit }) => edit === 'delete'), {});
  }

  /** Applies an edit that a hand made; its preview stays until the daemon has answered. */
  async applyByHand(edit) {
    const { kind, value } = this.selection;
    const whole = edit.edge ? edit : { edit: edit.edit, [kind]: value, ...edit };
    const isDone = await this.add(whole, EDITS.find((form) => form.edit === edit.edit));
    if (!isDone) this.picker.show(this.object, null);
  }

  applyText() {
    try {
      const edits = JSON.parse(this.text.value);
      if (!Array.isArray(edits)) throw new Error('a list is expected');
      return this.apply(() => edits);
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

  /** Makes a model by a list of edits and opens it. stays: keep the selection; isBack: the list is the one before; isBeside: show
   *  the original beside it; shown: other changes of the state. Resolves with the daemon's answer. */
  async go(edits, { stays = false, isBack = false, isBeside = false, ...shown } = {}) {
    const { model, mesh } = this;
    const isKept = !this.document && edits.length > 0;
    const name = `${stemOf(model)}, ${plural(edits.length, 'edit')}`;
    const whole = isKept || edits.length === 0 ? null : this.documentWith(edits);
    const [source, original] = await Promise.all([this.split(), (isBeside || edits.length === 0) && this.original()]); // another model may be opened meanwhile
    const made = edits.length === 0 ? { id: original }
      : isKept ? await tweend.edit(source, edits, { mesh: meshName(model, mesh), name })
        : await this.upload(whole, name);
    if (!stays && state('model') === model.id) this.selection.value = [];
    this.steps[isBack ? 'goBack' : 'go'](model, { model: made.id, from: isKept ? source : '', edits: isKept ? JSON.stringify(edits) : '',
      quads: isKept ? 'auto' : state('quads'), beside: isBeside ? original : edits.length > 0 ? state('beside') : '', ...shown });
    this.models.load();
    return made;
  }

  /** Asks for something of the shown model, once its edits are there; for nothing where another model is shown by then. */
  ask(request) {
    const id = state('model');
    return this.requests.run(async () => state('model') === id && this.model && request());
  }

  /** edit(edits): the next list of edits, of the one so far; options: those of go. */
  apply(edit, options) {
    return this.ask(() => this.go(edit(this.edits), options));
  }

  /** Adds an edit of a form. */
  add(edit, { stays }) {
    return this.apply((edits) => [...edits, edit], { stays });
  }

  /** Whether the list has an edit that can be taken back, though no step of this visit made it. */
  get canTakeBack() {
    return this.picker.isOn && this.edits.length > 0;
  }

  takeBack() {
    return this.apply((edits) => edits.slice(0, -1), { isBack: true });
  }

  // ---- scans ----

  showSteps() {
    const { faces, bounds: { min, max } } = this.model.meshes[this.mesh];
    const size = Math.hypot(...max.map((value, i) => value - min[i]));
    if (!state('from')) { // what was cleaned stays where it is
      this.scan.open = isScan(this.model, this.mesh);
      if (this.scan.open) this.shape.after(this.scan);
      else this.wholes.after(this.scan);
    }
    for (const step of this.cleaning) {
      const { labels, read } = fieldsOf(step.form.parameters({ faces, size }), `Clean up, ${wordsOf(step.form.edit).toLowerCase()}`);
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
    return this.ask(async () => {
      const { id, made = {} } = await this.go([...this.edits, ...edits], { level: 0, isBeside: true });
      if (state('model') !== id) return;
      const said = [made.spikes && `${plural(made.spikes.vertices.length, 'spike')} put back`, made.patches && `${plural(made.patches.faces.length, 'face')} in holes`];
      this.cleaned.textContent = said.filter(Boolean).join(', ');
    });
  }

  showBeside() {
    return this.ask(async () => {
      const { model } = this;
      const beside = this.besides.checked ? await this.original() : '';
      if (this.model === model) change({ beside });
    });
  }

  showSides() {
    if (!this.model) return;
    this.besides.checked = state('beside') !== '';
    this.sided.hidden = this.edits.length === 0 && !this.besides.checked;
    this.beside.tell(this.model, this.mesh);
  }
}
