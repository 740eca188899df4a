// The clips that a model can play: its own, and those of other models that were dropped on it, which the daemon carries
// over to its skeleton.
import { tweend, withKey } from './client.js';
import { namedApart } from './clips.js';
import { state } from './state.js';

const BORROWED = /^([0-9a-f]{32})\/(.*)$/s;

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
  const own = namedApart(model.clips).map(({ value, name, duration }) => ({ value, name, duration, isBorrowed: false }));
  const ids = new Set([...borrowed(), ...[state('clip'), state('blend')].map((clip) => BORROWED.exec(clip)?.[1]).filter(Boolean)]);
  ids.delete(model.id);
  const others = await Promise.all([...ids].map(async (id) => {
    const { clips, name: from } = await describe(id).catch(() => (described.delete(id), { clips: [] }));
    return namedApart(clips).map(({ value, name, duration }) => ({ value: `${id}/${value}`, name, duration, isBorrowed: true, from: from ?? id.slice(0, 8) }));
  }));
  return [...own, ...others.flat()];
}
