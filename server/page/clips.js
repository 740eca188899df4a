// The clips that a model can play: its own, and those of other models that were dropped on it, which the daemon carries
// over to its skeleton.
import { tweend, withKey } from './client.js';
import { state } from './state.js';

const BORROWED = /^([0-9a-f]{32})\/(.*)$/s;

/** How requests name a clip: {clip} of the model's own, {clip, retarget} of another model. */
export const optionsOf = ({ value, isBorrowed }) => ({ clip: value, ...(isBorrowed && { retarget: 'auto' }) });

/** Whether a model can wear clips of others: it has a skeleton and something that is seen. */
export const isCharacter = ({ meshes, skins, humanoid, nodes }) => meshes.length > 0 && (skins.length > 0 || Boolean(humanoid)) && nodes.length > 1;

/** Whether a model is nothing but clips, to be played by others. */
export const isMotion = ({ meshes, clips }) => meshes.length === 0 && clips.length > 0;

const described = new Map();

/** What a model has; asked once. */
function describe(id) {
  if (!described.has(id)) described.set(id, withKey(() => tweend.describe(id)));
  return described.get(id);
}

/** The ids of the models whose clips are offered beside the shown model's own. */
export const borrowed = () => state('borrowed').split(',').filter(Boolean);

/** [{value: as `clip` of a request, name, duration, isBorrowed, from: name of the file}] */
export async function clipsOf(model) {
  const own = model.clips.map(({ name, duration }) => ({ value: name, name, duration, isBorrowed: false }));
  const ids = new Set([...borrowed(), ...[state('clip'), state('blend')].map((clip) => BORROWED.exec(clip)?.[1]).filter(Boolean)]);
  ids.delete(model.id);
  const others = await Promise.all([...ids].map(async (id) => {
    const { clips, name: from } = await describe(id).catch(() => (described.delete(id), { clips: [] }));
    return clips.map(({ name, duration }) => ({ value: `${id}/${name}`, name, duration, isBorrowed: true, from: from ?? id.slice(0, 8) }));
  }));
  return [...own, ...others.flat()];
}

/** The name of a clip for a person. */
export const titleOf = ({ name, from }) => (from ? `${name} (${from})` : name);

/** A document whose one clip blends two clips of stored models, in one phase. weight: of the second. */
export function blendOf(model, [first, second], weight) {
  const layer = (clip, part) => ({ clip: clip.isBorrowed ? clip.value : `${model.id}/${clip.value}`, weight: part, sync: true, ...(clip.isBorrowed && { retarget: 'auto' }) });
  return { clips: [{ name: 'blend', layers: [layer(first, 1 - weight), layer(second, weight)] }] };
}
