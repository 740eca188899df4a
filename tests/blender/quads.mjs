// node quads.mjs ANSWER.obj QUADS.json NAME: prints how many quads of the source there are, how many of them the OBJ
// has, and how many others it has.
import { readFileSync } from 'node:fs'

const [answer, quads, name] = process.argv.slice(2)
const rows = readFileSync(answer, 'utf8').split('\n').map((line) => line.trim().split(/\s+/))
const points = rows.filter(([word]) => word === 'v').map((row) => row.slice(1, 4).map(Number))
const faces = rows.filter(([word]) => word === 'f').map((row) => row.slice(1).map((corner) => points[parseInt(corner, 10) - 1]))

/** The places of the corners, in whatever order. */
const keyOf = (corners) => corners.map((point) => point.map((x) => x.toFixed(4).replace('-0.0000', '0.0000')).join()).sort().join(' ')

const source = new Set(JSON.parse(readFileSync(quads))[name].map(keyOf))
const found = faces.filter((face) => face.length === 4).map(keyOf)
const right = found.filter((key) => source.has(key)).length
console.log(source.size, right, found.length - right)
