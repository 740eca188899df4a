// three.js sees in every file what the library says is there: counts, bounds, transforms, poses.
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { Box3, Vector3 } from 'three';

import { load, nodesOf, playerOf } from './player.mjs';
import { writeSamples } from './samples.mjs';

const A_TENTH_OF_A_DEGREE = Math.PI / 1800;

/** Geometries of a mesh, one a material; three makes a group of several. */
async function geometriesOf(gltf, index) {
  const object = await gltf.parser.getDependency('mesh', index);
  return (object.isMesh ? [object] : object.children).map((mesh) => mesh.geometry);
}

function assertNear(found, wanted, tolerance, what) {
  assert.equal(found.length, wanted.length, what);
  for (let i = 0; i < found.length; i++) {
    const limit = tolerance * Math.max(1, Math.abs(wanted[i]));
    assert.ok(Math.abs(found[i] - wanted[i]) <= limit, `${what}: number ${i} is ${found[i]}, not ${wanted[i]}`);
  }
}

/** tolerance: of each node's matrix. */
function assertMatrices(found, wanted, tolerance, what) {
  assert.equal(found.length * 16, wanted.length, what);
  found.forEach((matrix, i) =>
    assertNear(matrix.elements, wanted.slice(16 * i, 16 * i + 16), tolerance(i), `${what}, node ${i}`),
  );
}

async function assertMeshes(gltf, meshes) {
  assert.equal(gltf.parser.json.meshes?.length ?? 0, meshes.length);
  for (const [index, wanted] of meshes.entries()) {
    const geometries = await geometriesOf(gltf, index);
    const positions = geometries[0].attributes.position;
    assert.equal(positions.count, wanted.vertices);
    assert.equal(geometries.reduce((sum, geometry) => sum + geometry.index.count, 0), 3 * wanted.triangles);
    const bounds = new Box3();
    for (let i = 0; i < positions.count; i++) {
      bounds.expandByPoint(new Vector3().fromBufferAttribute(positions, i));
    }
    assertNear(bounds.min.toArray(), wanted.min, 1e-7, 'minimum');
    assertNear(bounds.max.toArray(), wanted.max, 1e-7, 'maximum');
  }
}

async function assertPoses(gltf, facts) {
  const nodes = await nodesOf(gltf);
  const moveTo = playerOf(gltf);
  for (const pose of facts.poses) {
    moveTo(pose.t);
    const tolerance = (node) => (facts.sampled.includes(node) ? A_TENTH_OF_A_DEGREE : 1e-5);
    assertMatrices(nodes.map((node) => node.matrix), pose.local, tolerance, `pose at ${pose.t}`);
  }
}

/** Vertices where joints and morph targets put them, in the world. */
async function assertSkinned(gltf, wanted) {
  const node = (await nodesOf(gltf))[0];
  let skinned;
  node.traverse((object) => (skinned ??= object.isSkinnedMesh ? object : undefined));
  gltf.scene.updateMatrixWorld(true);
  const { position, skinWeight, tangent, normal } = skinned.geometry.attributes;
  assert.equal(position.count, wanted.length);
  const [at, along, up] = [new Vector3(), new Vector3(), new Vector3()];
  for (let i = 0; i < position.count; i++) {
    skinned.getVertexPosition(i, at).applyMatrix4(skinned.matrixWorld);
    assertNear(at.toArray(), wanted[i], 1e-6, `vertex ${i}`);
    const sum = skinWeight.getX(i) + skinWeight.getY(i) + skinWeight.getZ(i) + skinWeight.getW(i);
    assert.ok(Math.abs(sum - 1) < 1e-6, `weights of vertex ${i}`);
    along.fromBufferAttribute(tangent, i);
    assert.ok(Math.abs(along.dot(up.fromBufferAttribute(normal, i))) < 1e-6, `tangent of vertex ${i}`);
  }
}

for (const { name, glb, gltf: json, facts } of writeSamples()) {
  for (const [suffix, bytes] of [['glb', glb], ['gltf', json]]) {
    test(`${name}.${suffix} holds what the library says`, async () => {
      const gltf = await load(bytes);
      await assertMeshes(gltf, facts.meshes);
      assert.equal(gltf.parser.json.nodes?.length ?? 0, facts.nodes);
      gltf.scene?.updateMatrixWorld(true);
      if (facts.nodes === 0) return;
      const nodes = await nodesOf(gltf);
      assertMatrices(nodes.map((node) => node.matrix), facts.local, () => 1e-6, 'local transform');
      assertMatrices(nodes.map((node) => node.matrixWorld), facts.world, () => 1e-6, 'world transform');
    });
  }
  if (facts.skinned) {
    test(`${name}.glb puts its vertices where the library does`, async () =>
      assertSkinned(await load(glb), facts.skinned));
  }
  if (facts.poses) {
    test(`${name}.glb moves as the library says`, async () => assertPoses(await load(glb), facts));
  }
}
