// A scan as scanners make them, with all that a clean-up is for.

/** A ball of radius 1 whose points are off by up to 2 %, as OBJ. It is open at both poles and at two places of its side, has
 *  five spikes, faces that are turned round, and a triangle that floats beside it. */
export function scan() {
  let seed = 7;
  const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
  const [bands, round] = [24, 48];
  const [points, faces] = [[], []];
  for (let i = 0; i <= bands; i++)
    for (let k = 0; k < round; k++) {
      const [a, b] = [(Math.PI * i) / bands, (2 * Math.PI * k) / round];
      const radius = points.length % 211 === 100 ? 1.6 : 0.98 + 0.04 * random();
      points.push([Math.sin(a) * Math.cos(b), Math.cos(a), Math.sin(a) * Math.sin(b)].map((x) => radius * x));
    }
  const at = (i, k) => i * round + (k % round) + 1;
  for (let i = 1; i < bands - 1; i++)
    for (let k = 0; k < round; k++) {
      const isHole = (i > 6 && i < 10 && k > 3 && k < 8) || (i === 15 && k < 2);
      const face = [at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)];
      if (!isHole) faces.push(i === 12 && k % 7 === 0 ? face.reverse() : face);
    }
  faces.push([1, 2, 3].map((k) => points.length + k));
  points.push([2, 0, 0], [2.1, 0, 0], [2, 0.1, 0]);
  return [...points.map((point) => `v ${point.join(' ')}`), ...faces.map((face) => `f ${face.join(' ')}`)].join('\n');
}
