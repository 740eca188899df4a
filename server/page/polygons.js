// The control cage as a mesh of polygons: its edges and extraordinary points.

/** The polygons of a triangle list in FB_ngon_encoding: consecutive triangles that begin with the same vertex are a
 *  fan. */
export function polygonsOf(index) {
  const polygons = [];
  for (let i = 0; i < index.length; i += 3) {
    const [a, b, c] = [index[i], index[i + 1], index[i + 2]];
    const last = polygons.at(-1);
    if (last && last[0] === a && last.at(-1) === b) last.push(c);
    else polygons.push([a, b, c]);
  }
  return polygons;
}

/** The edges (index pairs) of all polygons, and [point, valence] for the points inside whose valence is not 4. */
export function structure(polygons) {
  const edges = new Map();
  for (const polygon of polygons)
    polygon.forEach((a, i) => {
      const b = polygon[(i + 1) % polygon.length];
      if (a === b) return;
      const key = a < b ? a * 2 ** 26 + b : b * 2 ** 26 + a;
      edges.set(key, (edges.get(key) ?? 0) + 1);
    });
  const valence = new Map();
  const border = new Set();
  for (const [key, faces] of edges)
    for (const point of [Math.floor(key / 2 ** 26), key % 2 ** 26]) {
      valence.set(point, (valence.get(point) ?? 0) + 1);
      if (faces !== 2) border.add(point);
    }
  return {
    edges: [...edges.keys()].flatMap((key) => [Math.floor(key / 2 ** 26), key % 2 ** 26]),
    extraordinary: [...valence].filter(([point, n]) => n !== 4 && !border.has(point)),
  };
}
