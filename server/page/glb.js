// Parses GLBs for the viewport.
import { Color, MeshBasicMaterial } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const loader = new GLTFLoader();
// A cage has lines in place of materials: their textures are not decoded for it.
const cageLoader = new GLTFLoader().register(() => ({ name: 'no materials', loadMaterial: async () => new MeshBasicMaterial() }));

/** Gives the loader meshopt's decoder, which compiles WebAssembly as soon as it is evaluated, for a GLB that names it. */
async function prepare(buffer) {
  const json = new Uint8Array(buffer, 20, new DataView(buffer).getUint32(12, true));
  if (loader.meshoptDecoder || !new TextDecoder().decode(json).includes('meshopt_compression')) return;
  loader.setMeshoptDecoder((await import('three/addons/libs/meshopt_decoder.module.js')).MeshoptDecoder);
}

/** Whether a material states a look. A missing material does not: glTF makes it a metal, which is black without
 *  surroundings. Nor does that of an OBJ, which has only a name and is no metal. */
const saysLook = (material) => material !== undefined && !/^\{"pbrMetallicRoughness":\{"metallicFactor":0\}\}$/.test(JSON.stringify({ ...material, name: undefined }));

/** The names that the node of a mesh may have in poses: its index where it has no name, or one that another node has too. A
 *  nameless one may be an addition of the answer, whose mesh is the parent's in the file. */
function namesAbove(object, { associations, json }) {
  const index = associations.get(object)?.nodes;
  if (!object.parent) return [];
  if (index === undefined) return namesAbove(object.parent, { associations, json }); // one of several primitives
  const { name } = json.nodes[index];
  return [`node_${index}`, ...(name === undefined ? namesAbove(object.parent, { associations, json }) : [name])];
}

/** Parses a GLB into {scene, nodes: objects by the file's node names, bearers: [object, index of its mesh] for the nodes with
 *  a mesh, in the file's order, morphs: [{names: of the node, object: a mesh with morph targets, rest: their weights}],
 *  materials: their looks, parser: the loader's}. isCage: the materials do not matter. */
export async function parse(buffer, { isCage = false } = {}) {
  await prepare(buffer);
  const gltf = await (isCage ? cageLoader : loader).parseAsync(buffer, '');
  const nodes = new Map();
  const bearers = [];
  const morphs = [];
  gltf.scene.updateMatrixWorld(true);
  gltf.scene.traverse((object) => {
    const index = gltf.parser.associations.get(object)?.nodes;
    if (index === undefined || !gltf.parser.json.nodes[index]) return;
    const name = gltf.parser.json.nodes[index].name ?? `node_${index}`;
    if (!nodes.has(name)) nodes.set(name, object);
    const { mesh } = gltf.parser.json.nodes[index];
    if (mesh !== undefined) bearers[index] = [object, mesh];
  });
  gltf.scene.traverse((object) => {
    if (object.isLight) object.layers.disableAll(); // the file's lights are in candela: with the viewport's own lights they would overexpose everything
    if (!object.isMesh) return;
    const { meshes, primitives } = gltf.parser.associations.get(object) ?? {};
    const primitive = gltf.parser.json.meshes[meshes]?.primitives[primitives ?? 0];
    object.userData = { isPlain: !saysLook(gltf.parser.json.materials?.[primitive?.material]) };
    if (object.isSkinnedMesh) object.frustumCulled = false; // its bounds are valid only at rest
    if (object.morphTargetInfluences) morphs.push({ names: namesAbove(object, gltf.parser), object, rest: [...object.morphTargetInfluences] });
  });
  const materials = (gltf.parser.json.materials ?? []).map(({ name, pbrMetallicRoughness: { baseColorFactor: factor, baseColorTexture: texture } = {} }) =>
    ({ name, colour: new Color(...(factor ?? [1, 1, 1])).getStyle(), isTextured: texture !== undefined }));
  return { scene: gltf.scene, nodes, bearers: bearers.filter(Boolean), morphs, materials, parser: gltf.parser };
}
