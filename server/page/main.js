// The page: creates its parts, and loads the model that the state names.
import { Animation } from './animation.js';
import { Beside } from './beside.js';
import { borrowed, clipsOf } from './borrowed_clips.js';
import { Cage, creasesOf } from './cage.js';
import { download, tweend, withKey } from './client.js';
import { ClipPanel } from './clip_panel.js';
import { isCharacter, isMotion } from './clips.js';
import { byId, bytes, fixed, make, menu, plural } from './dom.js';
import { EditPanel } from './edit_panel.js';
import { parse } from './glb.js';
import { showKeys } from './keys.js';
import { Look } from './look.js';
import { Models } from './models.js';
import { busy, fail, isUnanswered, marked, tell } from './notices.js';
import { edgesOf, Opening } from './opening.js';
import { Outliner } from './outliner.js';
import { OverlayChips } from './overlay_chips.js';
import { RotationPanel } from './rotation_panel.js';
import { confirmLarge, isLarge, ScriptsPanel } from './scripts_panel.js';
import { SculptPanel } from './sculpt_panel.js';
import { Splitter } from './splitter.js';
import { change, isStep, leftOut, note, openOther, state, SURFACE, surfaceOptions, watch } from './state.js';
import { Steps } from './steps.js';
import { SurfacePanel } from './surface_panel.js';
import { panes } from './tabs.js';
import { Timeline } from './timeline.js';
import { Viewport } from './viewport.js';

const CAGE_MOST = 200000; // edges of the largest cage that is drawn without asking: larger ones take seconds
const PATIENCE = 1000; // ms that what lies over a surface waits for its picture, and then the counts of levels for that
const THUMBNAIL_AFTER = 2000; // ms: reading it waits for the first picture, and for what compiles its shaders
const THUMBNAIL = { width: 112, height: 84, type: 'image/webp' };
const CAGE = ['creases', 'details', 'quads']; // the state that determines the cage

// ---- parts ----

const viewport = new Viewport(byId('view'));
if (!viewport.renderer) byId('stage').append(make('p', { className: 'unseen' }, 'This browser has no WebGL 2, by which the page draws. All else works.'));
const animation = new Animation(viewport, (time) => {
  timeline.show(time);
  rotation.tick();
  if (!animation.playing && !animation.live && state('tab') === 'scripts') scripts.show();
});
const timeline = new Timeline(animation);
timeline.onReport = (report) => viewport.setCarrier(report?.root.node);
const models = new Models(panes.models);
const steps = new Steps(viewport);
const surface = new SurfacePanel(panes.surface);
const clipPanel = new ClipPanel(panes.animation, { animation, timeline, models });
const outliner = new Outliner(panes.surface);
const rotation = new RotationPanel(panes.animation, { viewport, animation, timeline });
const beside = new Beside({ viewport, loadCage, onShow: () => {
  animation.pose();
  edit.showSides();
} });
const edit = new EditPanel(panes.edit, { viewport, models, beside, steps });
const sculpt = new SculptPanel(panes.sculpt, { viewport, models, steps, levelSlider: surface.levelSlider() });
const scripts = new ScriptsPanel(panes.scripts, { animation, surface });

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
  levels: (described, options, init) => withKey(() => tweend.levels(described, options, init)),
  confirm: (size, level) => confirmLarge(size, `Level ${level}`),
  isMuch: isLarge,
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
viewport.onCarrier = () => framed && frame();

// ---- what is shown ----

/** Resolves when what a hand has made is stored: the models that are made of the shown one are its next steps then. */
const handsSettled = () => marked(Promise.all([sculpt.settled(), edit.requests.settled.then(() => edit.requests.ready)]));

/** Takes back the last step, or does it again, of this visit; where there is none, the last edit of the list. */
async function goThroughSteps(isBack) {
  if (isBack && sculpt.takeBack()) return;
  await handsSettled();
  if (!isBack) steps.redo();
  else if (steps.canUndo) steps.undo();
  else if (edit.canTakeBack) edit.takeBack();
}

const undo = make('button', { className: 'chip', title: 'Ctrl+Z', onclick: () => goThroughSteps(true) }, 'Undo');
const redo = make('button', { className: 'chip', title: 'Ctrl+Shift+Z', onclick: () => goThroughSteps(false) }, 'Redo');

function showSteps() {
  const isHere = [undo, redo].includes(document.activeElement);
  undo.disabled = !steps.canUndo && !edit.canTakeBack;
  redo.disabled = !steps.canRedo;
  undo.hidden = redo.hidden = undo.disabled && redo.disabled;
  if (isHere) (undo.disabled ? redo : undo).focus(); // what is disabled has no focus
}
steps.onChange = edit.onEdits = showSteps;
steps.onStep = (from, made) => models.addVersion(made, from);
steps.onAside = (of, made) => models.isRemoved(made) || tell('Kept in the list', make('p', {}, `What was made of ${models.nameOf(of)} came after another model was opened: it is the newest version.`));
showSteps();

const overlays = new OverlayChips(viewport, { isTooLarge, drawLarge });
const look = new Look(viewport, () => models.nameOf(model ?? {}));
const plus = make('button', { className: 'chip', 'aria-label': 'New shape', title: 'New shape' }, '+');
byId('shown').append(plus, undo, redo, ...overlays.buttons, make('button', { className: 'chip', id: 'frame', title: 'F', onclick: () => frameAnew() }, 'Frame'), look.button);
for (const button of [plus, byId('empty-shape')]) menu(button, 'Shapes', edit.shapes);

const showOverlays = () => overlays.show(model, parts?.materials ?? []);

function isTooLarge(described) {
  return edgesOf(described) > CAGE_MOST && !isLargeWanted;
}

function drawLarge() {
  isLargeWanted = true;
  openCage(model);
}

// ---- loading ----

/** Takes away what is shown of a model, in the picture and beside it. */
function clear() {
  viewport.setCage(null);
  viewport.clearModel();
  timeline.empty();
  rotation.open();
  clipPanel.open([]);
  outliner.open(null);
  edit.close();
  sculpt.leave();
  surface.open(null);
  scripts.open(null);
  document.title = 'tweend';
  byId('view').setAttribute('aria-label', 'No model');
  delete byId('view').dataset.level;
}

const blank = make('div', { className: 'empty', role: 'status', hidden: true });
byId('stage').append(blank);

/** Says why there is no picture, with buttons for what can be done: [text, function]. */
function sayBlank(title, ...ways) {
  blank.replaceChildren(make('h2', {}, title), make('div', { className: 'row' },
    ...ways.map(([text, onclick]) => make('button', { onclick }, text))));
  blank.hidden = false;
}

const again = ['Try again', () => openModel()];

function sayUnknown() {
  clear();
  timeline.expect(false);
  const other = models.first();
  sayBlank('The model cannot be opened', again, ...(other && other !== state('model') ? [['Another model', () => openOther(other)]] : []));
}

/** Resolves when the model's picture is there. Without a graphics card that of a large one takes seconds, and says so. */
async function drawn() {
  const task = busy('Drawing');
  await viewport.drawn();
  task.done();
}

/** Resolves when a promise does, or after so many milliseconds. */
const soon = (promise, ms) => Promise.race([promise, new Promise((resolve) => setTimeout(resolve, ms))]);

/** Makes a function that opens something mark the canvas meanwhile. */
const marking = (open) => (...given) => marked(open(...given));

const [openModel, openSurface, openCage, openClip] = [readModel, readSurface, readCage, readClip].map(marking);

function showName() {
  byId('subject').textContent = models.nameOf(model);
  document.title = `${models.nameOf(model)} – tweend`;
}
models.onRename = () => model && showName();

async function readModel() {
  const id = state('model');
  loading?.abort();
  loadingCage?.abort();
  animation.close(isStep());
  model = shown = framed = parts = null;
  isLargeWanted = false;
  rotation.clearGhosts();
  if (!isStep()) clear();
  blank.hidden = true;
  overlays.showLegend(model);
  byId('facts').textContent = '';
  byId('subject').textContent = '';
  if (!id) {
    if (models.first()) change({ model: models.first() });
    else {
      timeline.expect(false);
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
    timeline.expect(model.clips.length > 0 || state('borrowed') !== ''); // before the first picture, which would be drawn again in another size
    showOverlays();
    models.tell(model);
    surface.open(model);
    scripts.open(model);
  } catch (error) {
    if (state('model') !== id || loading !== controller) return;
    fail('The model cannot be opened', error, openModel);
    sayUnknown();
    return;
  } finally {
    task.done();
  }
  showName();
  const surfaceOpened = openSurface();
  edit.open(model);
  await soon(surfaceOpened.then(() => shown && drawn()), PATIENCE); // the picture has priority
  if (model?.id !== id) return;
  const others = Promise.all([openCage(model), openClip()]);
  const opened = Promise.all([surfaceOpened, others]);
  viewport.hold(soon(others, PATIENCE));
  await soon(opened, PATIENCE);
  if (state('model') === id) surface.count();
  await opened;
  if (model?.id !== id) return;
  frame(); // again, since the cage may be larger, or the pose another
  setTimeout(() => keepThumbnail(id), THUMBNAIL_AFTER);
}

/** Keeps a picture of a model, without what hands mark on it. */
async function keepThumbnail(id) {
  if (model?.id !== id || !shown || models.lineages.pictures[id]) return;
  if (edit.hasMarks) setTimeout(() => keepThumbnail(id), THUMBNAIL_AFTER);
  else models.keepPicture(id, await viewport.picture(THUMBNAIL));
}

/** The level to show in place of one that was refused, cancelled or broken: the highest that there is, else the control mesh;
 *  null where not even that can be, or where the daemon does not answer: the same may be there later. */
async function levelInstead({ level, ...options }, error, signal) {
  const { status } = error;
  if (level === 0 || isUnanswered(error) || [401, 403, 404].includes(status)) return null;
  if (![400, 422].includes(status)) return 0;
  const highest = await opening.highest(model, options, { signal }).catch(() => null); // nor are the others
  return highest < level ? highest : null;
}

/** After a level that cannot be shown: the picture that is there, else another level, else a word. */
function goBack(instead) {
  if (shown) return change(shown);
  if (instead !== null) return change({ level: instead });
  viewport.clearModel();
  dropOldCage(model);
  delete byId('view').dataset.level;
  if (!viewport.cage) sayBlank('Nothing is shown', again);
  return undefined;
}

async function readSurface() {
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
    await sculpt.settled(); // a stroke is of the surface that is shown
    signal.throwIfAborted();
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
    const instead = shown ? null : await levelInstead(options, error, signal);
    if (loading !== controller) return;
    fail(`Level ${options.level} cannot be shown${instead ? `, level ${instead} is` : ''}`, error,
      () => (state('level') === String(options.level) ? openSurface() : change({ level: options.level })));
    goBack(instead);
  } finally {
    task.done();
  }
}

/** Loads the cage of a model; null when it has none, or one too large to draw unasked. */
async function loadCage(described, signal) {
  if (edgesOf(described) === 0 || isTooLarge(described)) return null;
  const parsed = await opening.cage(described, surfaceOptions(), { signal });
  const faced = parsed.bearers.filter(([, mesh]) => described.meshes[mesh].faces > 0);
  return new Cage(described.id, parsed, faced, await creasesOf(parsed.parser));
}

/** Takes away the cage of the model before, which stays through a step until the next is there. */
function dropOldCage({ id }) {
  if (viewport.cage?.of !== id) viewport.setCage(null);
}

async function readCage(described) {
  overlays.showLegend(model);
  loadingCage?.abort();
  const controller = (loadingCage = new AbortController());
  const { signal } = controller;
  const task = isLargeWanted ? busy('The cage', controller) : null;
  try {
    const cage = await loadCage(described, signal);
    signal.throwIfAborted();
    viewport.setCage(cage);
    if (cage) blank.hidden = true;
    animation.pose();
    overlays.showLegend(model);
    edit.openCage();
  } catch (error) {
    if (!signal.aborted) dropOldCage(described);
    fail('The cage cannot be shown', error, () => openCage(described));
  } finally {
    task?.done();
  }
}

async function readClip() {
  const shownModel = model;
  const clips = await clipsOf(model);
  if (model !== shownModel) return;
  const named = (name) => clips.find(({ value }) => value === name) ?? null;
  const clip = named(state('clip')) ?? clips[0] ?? null;
  const opened = animation.open(model, clip, clip && named(state('blend')));
  timeline.open(model, clip, clips);
  rotation.open();
  marked(clipPanel.open(clips));
  await opened;
  clipPanel.show();
}

/** A dropped file of nothing but clips plays on the character that is shown. */
models.onDrop = async (dropped) => {
  await handsSettled();
  const id = state('model');
  if (!id || !isMotion(dropped)) return false;
  const on = model ?? (await withKey(() => tweend.describe(id)).catch(() => null)); // it may be opening still
  if (state('model') !== id || !on || !isCharacter(on)) return false;
  change({ borrowed: [...new Set([...borrowed(), dropped.id])].join(','), clip: `${dropped.id}/${dropped.clips[0].name}`, t: 0, tab: 'animation' });
  return true;
};

watch((names) => {
  if (names.has('tab')) {
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
  else if (event.key === ' ' && !event.target.closest('button, a, summary, [role=tab]')) timeline.toggle();
  else return;
  event.preventDefault();
});

/** Says what the address has that means nothing. */
function sayLeftOut() {
  if (leftOut().length > 0) tell('Left out of the address', make('p', {}, `${leftOut().join(', ')}: there is no such value.`));
}
addEventListener('hashchange', sayLeftOut);

showTheme();
showOverlays();
sayLeftOut();
if (state('model')) openModel();
if (state('beside')) beside.open();
models.load();
await models.known;
if (!state('model') && models.first()) change({ model: models.first() });
else if (!state('model')) timeline.expect(false);
else if (!model && !blank.hidden) sayUnknown(); // others are known now
