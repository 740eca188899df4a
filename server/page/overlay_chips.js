// The chips for what is shown of a model, what is fit to be shown of it unasked, and the legend of the colours in use.
import { html, render } from 'lit-html';

import { borrowed } from './borrowed_clips.js';
import { creaseColour, FEW, MANY } from './cage.js';
import { byId, chips, count, plural, press } from './dom.js';
import { edgesOf } from './opening.js';
import { change, setUsual, shows, state, toggle } from './state.js';

const OVERLAYS = [['surface', 'Surface'], ['cage', 'Cage'], ['points', 'Points'], ['wireframe', 'Wireframe'], ['normals', 'Normals'],
  ['skeleton', 'Skeleton'], ['uv', 'UV'], ['trail', 'Trail'], ['floor', 'Floor'], ['follow', 'Follow']];
const CAGE_USUAL = 2000; // edges of the largest cage that is shown unasked
const CREASES_MOST = 5; // that the legend tells apart

/** What there is of a model to be shown. */
function isThere(name, { meshes, nodes, clips }) {
  switch (name) {
    case 'uv': return meshes.some((mesh) => mesh.uv_sets > 0);
    case 'points': return meshes.some((mesh) => mesh.extraordinary_vertices > 0);
    case 'skeleton': return nodes.length > 1;
    case 'trail': case 'follow': return clips.length > 0 || borrowed().length > 0;
    default: return meshes.length > 0;
  }
}

/** What flatters: no cage over triangles, textures and many edges, unless it is edited; nor over what is sculpted. materials: of
 *  the surface. */
function usualOf({ meshes }, materials) {
  const isAllTriangles = meshes.every(({ faces, face_sizes: sizes, paired_quads: pairs }) => faces > 0 && sizes[3] === faces && !pairs);
  const isDense = edgesOf({ meshes }) > CAGE_USUAL;
  const isPlain = !isDense && !isAllTriangles && !materials.some(({ isTextured }) => isTextured);
  const wantsCage = meshes.length > 0 && state('tab') !== 'sculpt' && (isPlain || (state('tab') === 'edit' && !isDense));
  return ['surface', 'floor', 'follow', ...(wantsCage ? ['cage', 'points'] : [])];
}

const sum = ({ meshes }, of) => meshes.reduce((all, mesh) => all + (of(mesh) ?? 0), 0);

/** The other way to read what a file says of some of its elements: [text, label of a button, the state that it changes]. */
function otherReadings(model) {
  const pairs = sum(model, ({ paired_quads: quads }) => quads);
  const hard = sum(model, ({ hard_edges: edges }) => edges?.file);
  return [
    pairs > 0 && { auto: [plural(pairs, 'joined quad'), 'Split them', { quads: 'ngon' }], ngon: [plural(pairs, 'split quad'), 'Join them', { quads: 'auto' }] }[state('quads')],
    hard > 0 && { file: [plural(hard, 'hard edge'), 'Round them', { creases: 'tags' }], tags: [plural(hard, 'rounded edge'), 'Keep them hard', { creases: 'file' }] }[state('creases')],
  ].filter(Boolean);
}

export class OverlayChips {
  /** isTooLarge(model): whether its cage is not drawn, until drawLarge() is called. */
  constructor(viewport, { isTooLarge, drawLarge }) {
    Object.assign(this, { viewport, isTooLarge, drawLarge });
    this.buttons = chips(OVERLAYS, toggle);
  }

  /** model: null for none; materials: of the shown surface. */
  show(model, materials) {
    const { viewport } = this;
    setUsual(usualOf(model ?? { meshes: [] }, materials));
    press(this.buttons, shows);
    for (const button of this.buttons) button.hidden = model !== null && !isThere(button.dataset.name, model);
    const follows = viewport.shown.has('follow');
    viewport.show(new Set(OVERLAYS.map(([name]) => name).filter(shows)));
    if (state('view') && model && follows !== shows('follow')) viewport.onView(); // a view is relative to what it follows
    this.showLegend(model);
  }

  showLegend(model) {
    const { cage } = this.viewport;
    const entry = (colour, text) => html`<li><i .style=${`background-color: ${colour}`}></i>${text}</li>`;
    const ask = (text, label, act) => html`<li>${text}<button type="button" class="small" @click=${act}>${label}</button></li>`;
    const sharpnesses = [...(cage?.sharpnesses ?? [])].sort((a, b) => a - b).slice(0, CREASES_MOST);
    const entries = [
      ...(cage && shows('points') ? [cage.valences.has('few') && entry(FEW, 'valence under 4'), cage.valences.has('many') && entry(MANY, 'valence over 4')] : []),
      ...(shows('cage') ? sharpnesses.map((sharpness) => entry(`#${creaseColour(sharpness).getHexString()}`, sharpness >= 10 ? 'crease, infinite' : `crease ${sharpness}`)) : []),
      model && shows('cage') && this.isTooLarge(model) && ask(`a cage of ${count(edgesOf(model))} edges is not drawn`, 'Draw it', this.drawLarge),
      ...(model ? otherReadings(model).map(([text, label, next]) => ask(text, label, () => change(next))) : []),
    ].filter(Boolean);
    render(html`<ul>${entries}</ul>`, byId('legend'));
    byId('legend').hidden = entries.length === 0;
  }
}
