// Sends the edits of edits.py to a daemon, and compares what comes back with what Blender made of them:
// edits.mjs ORIGIN EDITS.json. Points are one within 1e-5, whatever their order; faces run over the same points
// the same way round; edits.py tells what of that is not the same.
import { readFileSync } from 'node:fs'

const TOLERANCE = 1e-5
const [origin, file] = process.argv.slice(2)

function readObj(text) {
  const lines = text.split('\n').map((line) => line.trim().split(/\s+/))
  return {
    points: lines.filter(([word]) => word === 'v').map((words) => words.slice(1, 4).map(Number)),
    faces: lines.filter(([word]) => word === 'f').map((words) => words.slice(1).map((corner) => parseInt(corner) - 1)),
  }
}

// For each point the first other one at its place; undefined where there is none.
function match(points, others) {
  const CELL = 1e-2
  const key = (point, shift = [0, 0, 0]) => point.map((x, i) => Math.floor(x / CELL) + shift[i]).join()
  const cells = new Map()
  others.forEach((point, i) => cells.set(key(point), [...(cells.get(key(point)) ?? []), i]))
  const steps = [-1, 0, 1]
  const shifts = steps.flatMap((x) => steps.flatMap((y) => steps.map((z) => [x, y, z])))
  return points.map((point) =>
    shifts
      .flatMap((shift) => cells.get(key(point, shift)) ?? [])
      .find((i) => Math.hypot(...point.map((x, k) => x - others[i][k])) < TOLERANCE),
  )
}

function fromLeast(face) {
  const least = face.indexOf(Math.min(...face))
  return [...face.slice(least), ...face.slice(0, least)].join()
}

// How many of a list another one does not have, each as often.
function missing(list, others) {
  const counts = new Map()
  for (const item of others) counts.set(item, (counts.get(item) ?? 0) + 1)
  return list.filter((item) => {
    const left = counts.get(item) ?? 0
    counts.set(item, left - 1)
    return left <= 0
  }).length
}

async function differs({ body, same, points, faces }) {
  const response = await fetch(`${origin}/v1/surface.obj?level=0`, {
    method: 'POST',
    headers: { 'Content-Type': 'application/json' },
    body: JSON.stringify(body),
  })
  const text = await response.text()
  if (response.status !== 200) return text
  const found = readObj(text)
  if (same !== 'places' && found.points.length !== points.length)
    return `${found.points.length} points, not ${points.length}`
  // Suzanne has points at one place.
  const first = match(points, points)
  const places = match(found.points, points).map((i) => first[i])
  const once = (list) => (same === 'places' ? [...new Set(list)] : list)
  const others = missing(once(places), first) + missing(once(first), places)
  if (others > 0) return `${others} points are elsewhere`
  if (same === 'points') return found.faces.length < faces.length ? '' : 'Blender divides no face'
  if (found.faces.length !== faces.length) return `${found.faces.length} faces, not ${faces.length}`
  const cycles = (list, names) => list.map((face) => fromLeast(face.map((i) => names[i])))
  const strangers = missing(cycles(found.faces, places), cycles(faces, first))
  return strangers > 0 ? `${strangers} faces are others` : ''
}

const edits = JSON.parse(readFileSync(file, 'utf8'))
let failed = edits.length === 0 ? 1 : 0
for (const edit of edits) {
  const difference = await differs(edit)
  if (difference) console.log(`${edit.name}: ${difference}`)
  failed += difference !== ''
}
process.exit(failed > 0 ? 1 : 0)
