// An arm of three bones that bends and swells: a skinned, morphed, mapped mesh with a clip, as glTF.
import { CylinderGeometry } from 'three';

const HEIGHT = 4;
const BONES = 3;

export function figure() {
  const geometry = new CylinderGeometry(0.5, 0.7, HEIGHT, 12, 8).translate(0, HEIGHT / 2, 0);
  const { position, normal, uv } = geometry.attributes;
  const chunks = [];
  const document = {
    asset: { version: '2.0' },
    scene: 0,
    scenes: [{ nodes: [0, 1] }],
    nodes: [
      { name: 'arm', mesh: 0, skin: 0 },
      ...[...Array(BONES).keys()].map((bone) => ({
        name: `bone_${bone}`,
        translation: [0, bone ? HEIGHT / BONES : 0, 0],
        ...(bone < BONES - 1 && { children: [bone + 2] }),
      })),
    ],
    meshes: [{ primitives: [{ material: 0 }], weights: [0] }],
    materials: [{ pbrMetallicRoughness: { baseColorFactor: [0.9, 0.5, 0.3, 1], metallicFactor: 0 } }],
    accessors: [],
    bufferViews: [],
  };
  let size = 0;
  const add = (array, type, more) => {
    const bytes = Buffer.from(array.buffer, array.byteOffset, array.byteLength);
    document.bufferViews.push({ buffer: 0, byteOffset: size, byteLength: bytes.length });
    const componentType = { Float32Array: 5126, Uint16Array: 5123, Uint8Array: 5121 }[array.constructor.name];
    const count = array.length / { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 }[type];
    size += (bytes.length + 3) & ~3;
    chunks.push(bytes, Buffer.alloc(-bytes.length & 3));
    return document.accessors.push({ bufferView: document.bufferViews.length - 1, componentType, count, type, ...more }) - 1;
  };
  const bounds = (array) => {
    const axis = (k) => [...array].filter((_, i) => i % 3 === k);
    return { min: [0, 1, 2].map((k) => Math.min(...axis(k))), max: [0, 1, 2].map((k) => Math.max(...axis(k))) };
  };

  // Each point hangs on the two bones that it lies between.
  const joints = new Uint8Array(4 * position.count);
  const weights = new Float32Array(4 * position.count);
  const swollen = new Float32Array(3 * position.count);
  for (let i = 0; i < position.count; i++) {
    const place = Math.min((position.getY(i) / HEIGHT) * BONES, BONES - 1);
    const bone = Math.min(Math.floor(place), BONES - 2);
    joints.set([bone, bone + 1], 4 * i);
    weights.set([1 - (place - bone), place - bone], 4 * i);
    if (place === bone + 1) joints[4 * i] = 0; // a joint without weight is 0
    if (place === bone) joints[4 * i + 1] = 0;
    swollen.set([position.getX(i) * 0.4, 0, position.getZ(i) * 0.4], 3 * i);
  }
  const binds = new Float32Array([...Array(BONES).keys()].flatMap((bone) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, (-bone * HEIGHT) / BONES, 0, 1]));
  document.skins = [{ joints: [1, 2, 3], inverseBindMatrices: add(binds, 'MAT4') }];
  const primitive = document.meshes[0].primitives[0];
  primitive.attributes = {
    POSITION: add(position.array, 'VEC3', bounds(position.array)),
    NORMAL: add(normal.array, 'VEC3'),
    TEXCOORD_0: add(uv.array, 'VEC2'),
    JOINTS_0: add(joints, 'VEC4'),
    WEIGHTS_0: add(weights, 'VEC4'),
  };
  primitive.targets = [{ POSITION: add(swollen, 'VEC3', bounds(swollen)) }];
  primitive.indices = add(Uint16Array.from(geometry.index.array), 'SCALAR');

  const times = add(new Float32Array([0, 1, 2]), 'SCALAR', { min: [0], max: [2] });
  const turn = (angle) => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
  const turns = add(new Float32Array([turn(0), turn(0.9), turn(-0.4)].flat()), 'VEC4');
  const swelling = add(new Float32Array([0, 1, 0.25]), 'SCALAR');
  document.animations = [
    {
      name: 'bend',
      samplers: [{ input: times, output: turns }, { input: times, output: swelling }],
      channels: [
        { sampler: 0, target: { node: 2, path: 'rotation' } },
        { sampler: 0, target: { node: 3, path: 'rotation' } },
        { sampler: 1, target: { node: 0, path: 'weights' } },
      ],
    },
  ];
  document.buffers = [{ byteLength: size, uri: `data:application/octet-stream;base64,${Buffer.concat(chunks).toString('base64')}` }];
  return JSON.stringify(document);
}
