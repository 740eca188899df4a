// The page: creates its parts, and loads the model that the state names.
import { Animation } from './animation.js';
import { Beside } from './beside.js';
import { borrowed, clipsOf } from './borrowed_clips.js';
import { Cage, creaseColour, creasesOf, FEW, MANY } from './cage.js';
import { download, tweend, withKey } from './client.js';
import { ClipPanel } from './clip_panel.js';
import { isCharacter, isMotion } from './clips.js';
import { byId, bytes, count, fixed, make, menu, plural } from './dom.js';
import { EditPanel } from './edit_panel.js';
import { showKeys } from './keys.js';
import { Look } from './look.js';
import { Models } from './models.js';
import { busy, fail } from './notices.js';
import { edgesOf, Opening } from './opening.js';
import { Outliner } from './outliner.js';
import { RotationPanel } from './rotation_panel.js';
import { confirmLarge, ScriptsPanel } from './scripts_panel.js';
import { SculptPanel } from './sculpt_panel.js';
import { Splitter } from './splitter.js';
import { change, isStep, note, openOther, setUsual, shows, state, SURFACE, surfaceOptions, toggle, watch } from './state.js';
import { Steps } from './steps.js';
import { SurfacePanel } from './surface_panel.js';
import { Timeline } from './timeline.js';
import { parse, Viewport } from './viewport.js';

const CAGE_MOST = 200000; // edges of the largest cage that is drawn without asking: larger ones take seconds
const PATIENCE = 1000; // ms that what lies over a surface waits for its picture, and then the counts of levels for that
const THUMBNAIL_AFTER = 2000; // ms: reading it waits for the first picture, and for what compiles its shaders
const THUMBNAIL = { width: 112, height: 84, type: 'image/webp' };
const CAGE_USUAL = 2000; // edges of the largest cage that is shown unasked
const CAGE = ['creases', 'details', 'quads']; // the state that determines the cage
const OVERLAYS = [['surface', 'Surface'], ['cage', 'Cage'], ['points', 'Points'], ['wireframe', 'Wireframe'], ['normals', 'Normals'],
  ['skeleton', 'Skeleton'], ['uv', 'UV'], ['trail', 'Trail'], ['floor', 'Floor'], ['follow', 'Follow']];
const TABS = [['models', 'Models'], ['surface', 'Surface'], ['edit', 'Edit'], ['sculpt', 'Sculpt'], ['animation', 'Rotation'], ['scripts', 'Scripts']];

// ---- tabs ----

const panels = Object.fromEntries(TABS.map(([name]) => [name,
  make('div', { role: 'tabpanel', id: `panel-${name}`, 'aria-labelledby': `tab-${name}`, className: 'pane' })]));
const tabs = TABS.map(([name, text]) => {
  const tab = make('button', { type: 'button', role: 'tab', id: `tab-${name}`, 'aria-controls': `panel-${name}`, onclick: () => change({ tab: name }) }, text);
  tab.dataset.name = name;
  return tab;
});
byId('tabs').append(...tabs);
byId('tabs').addEventListener('keydown', (event) => {
  const at = tabs.indexOf(document.activeElement);
  const next = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: tabs.length - 1 }[event.key];
  if (next === undefined || at < 0) return;
  event.preventDefault();
  const tab = tabs.at(next % tabs.length);
  tab.focus();
  change({ tab: tab.dataset.name });
});
byId('panel').append(...Object.values(panels));

function showTab() {
  for (const tab of tabs) {
    const chosen = tab.dataset.name === state('tab');
    tab.setAttribute('aria-selected', chosen);
    tab.tabIndex = chosen ? 0 : -1;
    panels[tab.dataset.name].hidden = !chosen;
  }
}

// ---- parts ----

const viewport = new Viewport(byId('view'));
if (!viewport.renderer) byId('stage').append(make('p', { className: 'unseen' }, 'This browser has no WebGL 2, by which the page draws. All else works.'));
const animation = new Animation(viewport, (time) => {
  timeline.show(time);
  rotation.tick(time);
  if (!animation.playing && !animation.live && state('tab') === 'scripts') scripts.render();
});
const timeline = new Timeline(animation);
const models = new Models(panels.models);
const steps = new Steps(viewport);
const surface = new SurfacePanel(panels.surface);
const clipPanel = new ClipPanel(panels.animation, { animation, timeline, models });
const outliner = new Outliner(panels.surface);
const rotation = new RotationPanel(panels.animation, { viewport, animation, timeline });
const beside = new Beside({ viewport, loadCage, onShow: () => {
  animation.pose();
  edit.showSides();
} });
const edit = new EditPanel(panels.edit, { viewport, models, beside, steps });
const sculpt = new SculptPanel(panels.sculpt, { viewport, models, steps, levelSlider: surface.levelSlider() });
const scripts = new ScriptsPanel(panels.scripts, { animation, surface });

// ---- theme ----

const dark = matchMedia('(prefers-color-scheme: dark)');

function showTheme() {
  const theme = state('theme') || (dark.matches ? 'dark' : 'light');
  document.documentElement.dataset.theme = theme;
  byId('theme').textContent = theme === 'dark' ? 'Light' : 'Dark';
  byId('theme').setAttribute('aria-label', `Change to the ${theme === 'dark' ? 'light' : 'dark'} theme`);
  viewport.setTheme(theme);
}
dark.addEventListener('change', showTheme);
byId('help').addEventListener('click', showKeys);
new Splitter();
byId('theme').addEventListener('click', () => change({ theme: document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark' }));

const opening = new Opening({
  count: (described, options, init) => withKey(() => tweend.surfaceCounts(described, options, init)),
  load: (described, options, init) => download(tweend.surfaceUrl(described, options), init),
  parse,
  confirm: (size, level) => confirmLarge(size, `Level ${level}`),
});
let model = null; // description of the shown model
let loading = null; // controller of the surface's download
let loadingCage = null;
let isLargeWanted = false; // the user asked for the model's large cage
let shown = null; // the state of the shown surface
let framed = null; // id of the model that the camera was moved to
let parts = null; // the parsed surface

// ---- the camera ----

/** Moves the camera to the URL's view, or frames the model. */
function frame() {
  viewport.frame();
  if (state('view')) viewport.view = state('view');
}

function frameAnew() {
  note('view', '');
  frame();
}

viewport.onView = () => note('view', viewport.view);


// ---- what is shown ----

/** Takes back the last step, or does it again, of this visit; where there is none, the last edit of the list. */
function goThroughSteps(isBack) {
  if (!isBack) steps.redo();
  else if (steps.canUndo) steps.undo();
  else if (edit.canTakeBack) edit.takeBack();
}

const undo = make('button', { type: 'button', className: 'chip', title: 'Ctrl+Z', onclick: () => goThroughSteps(true) }, 'Undo');
const redo = make('button', { type: 'button', className: 'chip', title: 'Ctrl+Shift+Z', onclick: () => goThroughSteps(false) }, 'Redo');

function showSteps() {
  const isHere = [undo, redo].includes(document.activeElement);
  undo.disabled = !steps.canUndo && !edit.canTakeBack;
  redo.disabled = !steps.canRedo;
  undo.hidden = redo.hidden = undo.disabled && redo.disabled;
  if (isHere) (undo.disabled ? redo : undo).focus(); // what is disabled has no focus
}
steps.onChange = edit.onEdits = showSteps;
steps.onStep = (from, made) => models.lineages.add(made, from);
showSteps();

const chips = OVERLAYS.map(([name, text]) => {
  const chip = make('button', { type: 'button', className: 'chip', onclick: () => toggle(name) }, text);
  chip.dataset.name = name;
  return chip;
});
const look = new Look(viewport, () => models.nameOf(model ?? {}));
const plus = make('button', { type: 'button', className: 'chip', 'aria-label': 'New shape', title: 'New shape' }, '+');
byId('shown').append(plus, undo, redo, ...chips, make('button', { type: 'button', className: 'chip', id: 'frame', title: 'F', onclick: () => frameAnew() }, 'Frame'), look.button);
for (const button of [plus, byId('empty-shape')]) menu(button, 'Shapes', edit.shapes);

/** What there is of the model to be shown. */
function isThere(name) {
  if (!model) return true;
  const { meshes, nodes, clips } = model;
  const some = (test) => meshes.some(test);
  switch (name) {
    case 'uv': return some((mesh) => mesh.uv_sets > 0);
    case 'points': return some((mesh) => mesh.extraordinary_vertices > 0);
    case 'skeleton': return nodes.length > 1;
    case 'trail': case 'follow': return clips.length > 0 || borrowed().length > 0;
    default: return meshes.length > 0;
  }
}

/** Chooses what flatters: no cage over triangles, textures and many edges, unless it is edited. */
function chooseUsual() {
  const meshes = model?.meshes ?? [];
  const isAllTriangles = meshes.length > 0 && meshes.every(({ faces, face_sizes: sizes, paired_quads: pairs }) => faces > 0 && sizes[3] === faces && !pairs);
  const isDense = meshes.reduce((sum, mesh) => sum + mesh.edges, 0) > CAGE_USUAL;
  const isPlain = !isDense && !isAllTriangles && !parts?.materials.some(({ isTextured }) => isTextured);
  const wantsCage = meshes.length > 0 && (isPlain || (state('tab') === 'edit' && !isDense));
  setUsual(['surface', 'floor', 'follow', ...(wantsCage ? ['cage', 'points'] : [])]);
}

function showOverlays() {
  chooseUsual();
  for (const chip of chips) {
    chip.setAttribute('aria-pressed', shows(chip.dataset.name));
    chip.hidden = !isThere(chip.dataset.name);
  }
  const follows = viewport.shown.has('follow');
  viewport.show(new Set(OVERLAYS.map(([name]) => name).filter(shows)));
  if (state('view') && model && follows !== shows('follow')) viewport.onView(); // a view is relative to what it follows
  showLegend();
}

const isTooLarge = (described) => edgesOf(described) > CAGE_MOST && !isLargeWanted;

function drawLarge() {
  isLargeWanted = true;
  openCage(model);
}

/** Shows the legend of the colours in use, and the choices for how the model is drawn. */
function showLegend() {
  const { cage } = viewport;
  const entries = [];
  const entry = (colour, text) => {
    const swatch = make('i');
    swatch.style.backgroundColor = colour;
    entries.push(make('li', {}, swatch, text));
  };
  if (cage && shows('points')) {
    if (cage.valences.has('few')) entry(FEW, 'valence under 4');
    if (cage.valences.has('many')) entry(MANY, 'valence over 4');
  }
  if (cage && shows('cage'))
    for (const sharpness of [...cage.sharpnesses].sort((a, b) => a - b).slice(0, 5))
      entry(`#${creaseColour(sharpness).getHexString()}`, sharpness >= 10 ? 'crease, infinite' : `crease ${sharpness}`);
  if (model && isTooLarge(model) && shows('cage'))
    entries.push(make('li', {}, `a cage of ${count(edgesOf(model))} edges is not drawn`, make('button', { type: 'button', className: 'small', onclick: drawLarge }, 'Draw it')));
  const pairs = model?.meshes.reduce((sum, mesh) => sum + (mesh.paired_quads ?? 0), 0);
  const ask = (text, label, next) =>
    entries.push(make('li', {}, text, make('button', { type: 'button', className: 'small', onclick: () => change(next) }, label)));
  if (pairs > 0 && state('quads') === 'auto') ask(plural(pairs, 'joined quad'), 'Split them', { quads: 'ngon' });
  if (pairs > 0 && state('quads') === 'ngon') ask(plural(pairs, 'split quad'), 'Join them', { quads: 'auto' });
  const hard = model?.meshes.reduce((sum, mesh) => sum + (mesh.hard_edges?.file ?? 0), 0);
  if (hard > 0 && state('creases') === 'file') ask(plural(hard, 'hard edge'), 'Round them', { creases: 'tags' });
  if (hard > 0 && state('creases') === 'tags') ask(plural(hard, 'rounded edge'), 'Keep them hard', { creases: 'file' });
  byId('legend').replaceChildren(make('ul', {}, ...entries));
  byId('legend').hidden = entries.length === 0;
}

// ---- loading ----

function clear() {
  viewport.setCage(null);
  viewport.clearModel();
}

const blank = make('div', { className: 'empty', role: 'status', hidden: true });
byId('stage').append(blank);

/** Says why there is no picture, with buttons for what can be done: [text, function]. */
function sayBlank(title, ...ways) {
  blank.replaceChildren(make('h2', {}, title), make('div', { className: 'row' },
    ...ways.map(([text, onclick]) => make('button', { type: 'button', onclick }, text))));
  blank.hidden = false;
}

const again = ['Try again', () => openModel()];

function sayUnknown() {
  clear();
  const other = models.first();
  sayBlank('The model cannot be opened', again, ...(other && other !== state('model') ? [['Another model', () => openOther(other)]] : []));
}

/** Resolves when a promise does, or after so many milliseconds. */
const soon = (promise, ms) => Promise.race([promise, new Promise((resolve) => setTimeout(resolve, ms))]);

async function openModel() {
  const id = state('model');
  loading?.abort();
  loadingCage?.abort();
  animation.close();
  model = shown = framed = parts = null;
  isLargeWanted = false;
  rotation.clearGhosts();
  if (!isStep()) clear();
  blank.hidden = true;
  showLegend();
  byId('facts').textContent = '';
  byId('subject').textContent = '';
  delete byId('view').dataset.opening;
  if (!id) {
    if (models.first()) change({ model: models.first() });
    else {
      timeline.open(null, null);
      byId('empty').hidden = false;
    }
    return;
  }
  byId('empty').hidden = true;
  const controller = (loading = new AbortController());
  const task = busy('Reading the model', controller);
  try {
    const described = await withKey(() => tweend.describe(id, { signal: controller.signal }));
    if (state('model') !== id) return;
    if (state('level') === 'auto') {
      const level = await opening.level(described, surfaceOptions(), { signal: controller.signal });
      if (state('model') !== id) return;
      if (state('level') === 'auto') change({ level });
    }
    model = described;
    showOverlays();
    models.tell(model);
  } catch (error) {
    if (state('model') !== id || loading !== controller) return;
    fail('The model cannot be opened', error, openModel);
    sayUnknown();
    return;
  } finally {
    task.done();
  }
  byId('view').dataset.opening = '';
  byId('subject').textContent = models.nameOf(model);
  document.title = `${models.nameOf(model)} – tweend`;
  const surfaceOpened = openSurface();
  edit.open(model);
  await soon(surfaceOpened.then(() => viewport.drawn()), PATIENCE); // the picture has priority
  if (model?.id !== id) return;
  const others = Promise.all([openCage(model), openClip()]);
  const opened = Promise.all([surfaceOpened, others]);
  viewport.hold(soon(others, PATIENCE));
  await soon(opened, PATIENCE);
  if (state('model') === id) surface.count();
  await opened;
  if (model?.id !== id) return;
  delete byId('view').dataset.opening;
  frame(); // again, since the cage may be larger, or the pose another
  setTimeout(() => keepThumbnail(id), THUMBNAIL_AFTER);
}

async function keepThumbnail(id) {
  if (model?.id !== id || !shown || models.lineages.pictures[id]) return;
  models.keepPicture(id, await viewport.picture(THUMBNAIL));
}

/** After a level that was refused, cancelled or broken: the picture that is there, else the control mesh, else a word. */
function goBack(level, { status }) {
  if (shown) return change(shown);
  if (level > 0 && ![401, 403, 404].includes(status)) return change({ level: 0 });
  viewport.clearModel();
  if (!viewport.cage) sayBlank('Nothing is shown', again);
}

async function openSurface() {
  if (!model) return;
  loading?.abort();
  const controller = (loading = new AbortController());
  const { signal } = controller;
  const options = surfaceOptions();
  const task = busy(`Level ${options.level}`, controller);
  try {
    const { counts, answer, parsed } = await opening.surface(model, options, { signal,
      onProgress: (loaded, total) => task.say(`Level ${options.level}: ${bytes(loaded)}${total ? ` of ${bytes(total)}` : ''}`),
      onLoaded: () => task.say(`Level ${options.level}: drawing`) });
    shown = Object.fromEntries(SURFACE.map((name) => [name, state(name)]));
    parts = parsed;
    viewport.setModel(parsed, options);
    showOverlays();
    outliner.open(model, parsed.materials);
    sculpt.open(model, parsed, counts.level);
    surface.tell(answer);
    animation.pose();
    rotation.makeGhosts();
    if (framed !== model.id) frame();
    framed = model.id;
    blank.hidden = true;
    byId('facts').textContent = `Level ${options.level} · ${plural(counts.vertices, 'point')} · ${plural(counts.faces, 'face')} · ${bytes(answer.size)} · ${answer.ms.toFixed(1)} ms`;
    const { x, y, z } = viewport.controls.target;
    byId('view').setAttribute('aria-label', `${model.name || 'A model'}, level ${options.level}: ${plural(counts.faces, 'face')} round ${[x, y, z].map((v) => fixed(v, 1)).join(', ')}. ` +
      'Arrow keys orbit, with Shift they pan, plus and minus zoom, F frames, space plays.');
    byId('view').dataset.level = options.level;
  } catch (error) {
    if (loading !== controller) return; // another took its place
    fail(`Level ${options.level} cannot be shown`, error, () => (state('level') === String(options.level) ? openSurface() : change({ level: options.level })));
    goBack(options.level, error);
  } finally {
    task.done();
  }
}

/** Loads the cage of a model; null when it has none, or one too large to draw unasked. */
async function loadCage(described, signal) {
  if (edgesOf(described) === 0 || isTooLarge(described)) return null;
  const parsed = await opening.cage(described, surfaceOptions(), { signal });
  const faced = parsed.bearers.filter(([, mesh]) => described.meshes[mesh].faces > 0);
  return new Cage(parsed, faced, await creasesOf(parsed.parser));
}

async function openCage(described) {
  showLegend();
  loadingCage?.abort();
  const controller = (loadingCage = new AbortController());
  const { signal } = controller;
  const task = isLargeWanted ? busy('The cage', controller) : null;
  try {
    const cage = await loadCage(described, signal);
    signal.throwIfAborted();
    viewport.setCage(cage);
    animation.pose();
    showLegend();
    edit.openCage();
  } catch (error) {
    fail('The cage cannot be shown', error, () => openCage(described));
  } finally {
    task?.done();
  }
}

async function openClip() {
  const shownModel = model;
  const clips = await clipsOf(model);
  if (model !== shownModel) return;
  const named = (name) => clips.find(({ value }) => value === name) ?? null;
  const clip = named(state('clip')) ?? clips[0] ?? null;
  const opened = animation.open(model, clip, clip && named(state('blend')));
  timeline.open(model, clip, clips);
  rotation.open();
  clipPanel.open(clips);
  await opened;
  clipPanel.show();
}

/** A dropped file of nothing but clips plays on the character that is shown. */
models.onDrop = async (dropped) => {
  if (!model || !isMotion(dropped) || !isCharacter(model)) return false;
  change({ borrowed: [...new Set([...borrowed(), dropped.id])].join(','), clip: `${dropped.id}/${dropped.clips[0].name}`, t: 0, tab: 'animation' });
  return true;
};

watch((names) => {
  if (names.has('tab')) {
    showTab();
    showSteps();
    showOverlays();
  }
  if (names.has('theme')) showTheme();
  if (names.has('show')) showOverlays();
  if (names.has('model') || (names.has('level') && state('level') === 'auto')) openModel();
  else if (SURFACE.some((name) => names.has(name))) openSurface();
  if (CAGE.some((name) => names.has(name)) && !names.has('model') && model) openCage(model);
  if (names.has('view') && model && !names.has('model')) frame();
  if (['clip', 'blend', 'borrowed'].some((name) => names.has(name)) && !names.has('model') && model) openClip();
});

addEventListener('keydown', (event) => {
  const isTyping = event.target.matches('input:not([type=range], [type=checkbox]), textarea') || event.target.closest('dialog, [role=menu]');
  if ((event.ctrlKey || event.metaKey) && !event.altKey && event.key.toLowerCase() === 'z' && !isTyping) {
    event.preventDefault();
    goThroughSteps(!event.shiftKey);
    return;
  }
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest('input, select, textarea, dialog, [role=menu]')) return;
  if (event.key === 'f' || event.key === 'F') frameAnew();
  else if (event.key === '?') showKeys();
  else if (event.key === ' ' && !event.target.closest('button, a, [role=tab]')) timeline.toggle();
  else return;
  event.preventDefault();
});

showTab();
showTheme();
showOverlays();
scripts.render();
if (state('model')) openModel();
if (state('beside')) beside.open();
await models.load();
if (!state('model') && models.first()) change({ model: models.first() });
