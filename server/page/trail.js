// The way of a node over a clip, as a line in the world: through the middle of its mesh, or its origin.
import { Box3, Group, Line, LineBasicMaterial, Matrix4, Points, PointsMaterial, Vector3 } from 'three';

import { geometryOf, THROUGH } from './overlays.js';

const COLOUR = 0x0a9b7c;
const LOOK = { color: COLOUR, ...THROUGH };

/** The place of a node's object whose way is shown, in the object's own space. */
function middleOf(object) {
  const box = new Box3().setFromObject(object);
  return box.isEmpty() ? new Vector3() : object.worldToLocal(box.getCenter(new Vector3()));
}

const lineOf = (places) => geometryOf(places.flatMap((place) => place.toArray()));

/** table: poses of the node as world matrices; keys: places in it that are keys. */
export function trailOf(object, table, keys) {
  const middle = middleOf(object);
  const places = Array.from({ length: table.header.poses }, (_, i) => middle.clone().applyMatrix4(new Matrix4().fromArray(table.part(i, 0, 'matrix'))));
  const trail = new Group().add(new Line(lineOf(places), new LineBasicMaterial({ ...LOOK, opacity: 0.9 })),
    new Points(lineOf(keys.map((key) => places[Math.min(key, places.length - 1)])), new PointsMaterial({ ...LOOK, size: 7, sizeAttenuation: false })));
  for (const part of trail.children) Object.assign(part, { renderOrder: 4, frustumCulled: false });
  return trail;
}

export function disposeTrail(trail) {
  trail.removeFromParent();
  for (const { geometry, material } of trail.children) for (const part of [geometry, material]) part.dispose();
}
