// Finds what a ray hits of a mesh, without a look at each of its triangles: those of a run, which follow each other, lie near
// each other, and are looked at if the ray hits the box of the run.
import { Box3, Matrix4, Ray } from 'three';

const RUN = 64; // triangles

const known = new WeakMap(); // by geometry

/** The boxes of the runs of a geometry: [least x y z, most x y z, …]. Found when they are first asked for, which may be before
 *  a ray needs them, and again when the places have changed. */
export function boxesOf(geometry) {
  const { index, attributes: { position } } = geometry;
  const version = position.isInterleavedBufferAttribute ? position.data.version : position.version;
  const last = known.get(geometry);
  if (last?.version === version) return last.bounds;
  const { count } = index ?? position;
  const bounds = new Float64Array(6 * Math.ceil(count / 3 / RUN));
  for (let at = 0; at < bounds.length; at += 6) bounds.fill(Infinity, at, at + 3).fill(-Infinity, at + 3, at + 6);
  for (let i = 0; i < count; i++) {
    const vertex = index ? index.getX(i) : i;
    const at = 6 * Math.floor(i / 3 / RUN);
    const [x, y, z] = [position.getX(vertex), position.getY(vertex), position.getZ(vertex)];
    if (x < bounds[at]) bounds[at] = x;
    if (y < bounds[at + 1]) bounds[at + 1] = y;
    if (z < bounds[at + 2]) bounds[at + 2] = z;
    if (x > bounds[at + 3]) bounds[at + 3] = x;
    if (y > bounds[at + 4]) bounds[at + 4] = y;
    if (z > bounds[at + 5]) bounds[at + 5] = z;
  }
  known.set(geometry, { bounds, version });
  return bounds;
}

const [ray, box, inverse] = [new Ray(), new Box3(), new Matrix4()];

/** What a raycaster hits of a mesh, the nearest first; as by caster.intersectObject(mesh, false). */
export function hitsOn(mesh, caster) {
  if (mesh.morphTargetInfluences || mesh.isSkinnedMesh) return caster.intersectObject(mesh, false); // its places are not the geometry's
  const { geometry } = mesh;
  const { start, count } = geometry.drawRange;
  const bounds = boxesOf(geometry);
  ray.copy(caster.ray).applyMatrix4(inverse.copy(mesh.matrixWorld).invert());
  const hits = [];
  for (let at = 0; at < bounds.length; at += 6) {
    box.min.fromArray(bounds, at);
    box.max.fromArray(bounds, at + 3);
    if (!ray.intersectsBox(box)) continue;
    geometry.setDrawRange(3 * RUN * (at / 6), 3 * RUN);
    mesh.raycast(caster, hits);
  }
  geometry.setDrawRange(start, count);
  return hits.sort((a, b) => a.distance - b.distance);
}
