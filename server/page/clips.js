// Clips as requests and people name them, models that wear clips of others, and blends of two clips.

/** How requests name a clip: {clip} of the model's own, {clip, retarget} of another model. */
export const optionsOf = ({ value, isBorrowed }) => ({ clip: value, ...(isBorrowed && { retarget: 'auto' }) });

/** Clips with {value: how a request asks for it}: its name, or clip_N where an earlier one has that name; name: as people
 *  tell them apart. */
export const namedApart = (clips) => clips.map((clip, index) => {
  const isSecond = clips.findIndex(({ name }) => name === clip.name) < index;
  return { ...clip, ...(isSecond ? { value: `clip_${index}`, name: `${clip.name} (${index + 1})` } : { value: clip.name }) };
});

/** Whether a model can wear clips of others: it has a skeleton and something that is seen. */
export const isCharacter = ({ meshes, skins, humanoid, nodes }) => meshes.length > 0 && (skins.length > 0 || Boolean(humanoid)) && nodes.length > 1;

/** Whether a model is nothing but clips, to be played by others. */
export const isMotion = ({ meshes, clips }) => meshes.length === 0 && clips.length > 0;

/** The name of a clip for a person. */
export const titleOf = ({ name, from }) => (from ? `${name} (${from})` : name);

/** The layers of a clip that blends two of a model's clips, in one phase. weight: of the second. */
export function layersOf([first, second], weight) {
  const layer = (clip, part) => ({ clip: clip.value, weight: part, sync: true, ...(clip.isBorrowed && { retarget: 'auto' }) });
  return [layer(first, 1 - weight), layer(second, weight)];
}

/** Numbers between those of two lists. */
export const mixed = (a, b, part) => a.map((value, i) => value + (b[i] - value) * part);

/** The part of the second clip in what a node has of a blend, as the daemon blends layers: what one of those that play moves
 *  alone is as it moves it. first, second: whether they move it; part: of the second in the blend. */
export const partOf = (first, second, part) => (part > 0 && part < 1 && first !== second ? Number(second) : part);

/** Blends morph weights of two clips, by node, in the same way. */
export function blendWeights(first, second, part) {
  const [a, b] = [part < 1 ? first : {}, part > 0 ? second : {}];
  return { ...a, ...b, ...Object.fromEntries(Object.keys(a).filter((node) => node in b).map((node) => [node, mixed(a[node], b[node], part)])) };
}
