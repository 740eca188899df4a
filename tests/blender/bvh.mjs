// BVH between the daemon and Blender, in the working folder, around bvh.py:
// bvh.mjs make URL      writes NAME.bvh, files of motion capture and pose.bvh of models, and NAME.json: which model it is
// bvh.mjs compare URL   fails where a joint of Blender is farther than 1e-4 of the height from where the model has it, or
//                       where the file that Blender exports has it when it is uploaded
import assert from 'node:assert/strict'
import { readFileSync, readdirSync, writeFileSync } from 'node:fs'
import { dirname, join } from 'node:path'
import { fileURLToPath } from 'node:url'

import { HEIGHT, mocap } from '../node/mocap.mjs'

const [task, daemon] = process.argv.slice(2)
const root = join(dirname(fileURLToPath(import.meta.url)), '../..')

async function upload(text) {
  const answer = await fetch(`${daemon}/v1/models`, { method: 'POST', body: text })
  const body = await answer.json()
  assert.ok(answer.ok, body.detail)
  return `${daemon}/v1/models/${body.id}`
}

const write = (name, text, facts) => {
  writeFileSync(`${name}.bvh`, text)
  writeFileSync(`${name}.json`, JSON.stringify(facts))
}

async function make() {
  // Blender reads no joint of fewer than three turns, and takes 0 where a joint has fewer than three positions, not its
  // OFFSET: "mixed" comes to it by pose.bvh alone.
  const styles = { plain: {}, wraps: { wraps: true, seed: 4 }, mixed: { mixed: true, seed: 7 }, orders: { mixed: 'orders', seed: 5 }, windows: { lineEnd: '\r\n', trailing: true, seed: 2 } }
  for (const [name, style] of Object.entries(styles)) {
    const { text, seconds } = mocap(20, style)
    const model = await upload(text)
    if (name !== 'mixed') write(name, text, { model, query: '', seconds, height: HEIGHT })
    const written = await fetch(`${model}/pose.bvh?fps=60`)
    write(`written_${name}`, await written.text(), { model, query: '', seconds: 1 / 60, height: HEIGHT })
  }
  const tank = await upload(readFileSync(join(root, 'server/samples/tank.json')))
  for (const order of ['', '&order=XYZ']) {
    const written = await fetch(`${tank}/pose.bvh?clip=drive&fps=10&nodes=all${order}`)
    write(`tank${order.slice(-3)}`, await written.text(), { model: tank, query: '&clip=drive', seconds: 0.1, height: 3 })
  }
}

/** The farthest that a joint is from where a model has it, and how many were compared. */
async function farthest(places, { model, query, seconds, height }) {
  const [first] = Object.values(places)
  const at = first.map((_, frame) => Math.fround(frame * seconds)).join()
  const { nodes, poses } = await (await fetch(`${model}/pose.json?space=world&at=${at}${query}`)).json()
  let [worst, count] = [0, 0]
  for (const [name, list] of Object.entries(places)) {
    const node = nodes.indexOf(name)
    if (node < 0) continue
    list.forEach((place, frame) => {
      worst = Math.max(worst, Math.hypot(...place.map((x, i) => x - poses[frame].translation[node][i])) / height)
      count++
    })
  }
  return { worst, count }
}

async function compare() {
  const names = readdirSync('.').filter((name) => name.endsWith('.places'))
  assert.equal(names.length, 11)
  for (const file of names) {
    const name = file.slice(0, -'.places'.length)
    const places = JSON.parse(readFileSync(file))
    const facts = JSON.parse(readFileSync(`${name}.json`))
    const read = await farthest(places, facts)
    const again = await farthest(places, { ...facts, model: await upload(readFileSync(`${name}.again`)), query: '' })
    console.log(name, read, again)
    const most = Object.keys(places).length * Object.values(places)[0].length
    for (const { worst, count } of [read, again]) assert.ok(count >= 0.9 * most && worst < 1e-4, `${name}: ${worst} of the height, ${count} of ${most} places`)
  }
}

await (task === 'make' ? make() : compare())
