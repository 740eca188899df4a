// Compares the points of an OBJ with those of a JSON file, as sets: nearest.mjs ANSWER.obj EXPECTED.json PATH
// PATH leads to the list in the JSON ("surfaces.2.points"). Fails when a point of either is farther than 1e-5
// from all of the other's, or when there are more of one.
import { readFileSync } from 'node:fs'

const TOLERANCE = 1e-5
const [answer, expected, path] = process.argv.slice(2)
const found = readFileSync(answer, 'utf8')
  .split('\n')
  .filter((line) => line.startsWith('v '))
  .map((line) => line.slice(2).trim().split(' ').map(Number))
const wanted = path.split('.').reduce((value, key) => value[key], JSON.parse(readFileSync(expected, 'utf8')))

// Points by the cell of a grid that is coarser than the tolerance.
const CELL = 1e-2
const cell = (point, shift) => point.map((x, i) => Math.floor(x / CELL) + shift[i]).join()
const SHIFTS = [-1, 0, 1].flatMap((x) => [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((z) => [x, y, z])))

function worst(from, to) {
  const cells = new Map()
  for (const point of to) {
    const key = cell(point, [0, 0, 0])
    cells.set(key, [...(cells.get(key) ?? []), point])
  }
  let most = 0
  for (const point of from) {
    let least = Infinity
    for (const shift of SHIFTS)
      for (const other of cells.get(cell(point, shift)) ?? [])
        least = Math.min(least, Math.hypot(...point.map((x, i) => x - other[i])))
    most = Math.max(most, least)
  }
  return most
}

const difference = Math.max(worst(found, wanted), worst(wanted, found))
console.log(`${found.length} points, ${wanted.length} expected, at most ${difference} apart`)
process.exit(found.length === wanted.length && difference < TOLERANCE ? 0 : 1)
