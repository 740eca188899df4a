// BVH between the daemon and Blender, in the working folder, around bvh.py:
// bvh.mjs make URL      writes NAME.bvh, files of motion capture and pose.bvh of models, and NAME.json: which model it is
// bvh.mjs compare URL   fails where a joint of Blender is farther than 1e-4 of the height from where the model has it, or
//                       where the files that Blender exports have it when they are uploaded
import assert from 'node:assert/strict'
import { readFileSync, readdirSync, writeFileSync } from 'node:fs'
import { dirname, join } from 'node:path'
import { fileURLToPath } from 'node:url'

import { biped, HEIGHT as BIPED_HEIGHT, numbersOf } from '../node/biped.mjs'
import { HEIGHT, mocap } from '../node/mocap.mjs'

const [task, daemon] = process.argv.slice(2)
const root = join(dirname(fileURLToPath(import.meta.url)), '../..')

async function upload(text) {
  const answer = await fetch(`${daemon}/v1/models`, { method: 'POST', body: text, headers: { 'Content-Type': 'application/octet-stream' } })
  const body = await answer.json()
  assert.ok(answer.ok, body.detail)
  return `${daemon}/v1/models/${body.id}`
}

const write = (name, text, facts) => {
  writeFileSync(`${name}.bvh`, text)
  writeFileSync(`${name}.json`, JSON.stringify(facts))
}

/** A chain of joints that rest in any rotation and scale, and turn. uneven: two of the scales are no uniform ones. */
function chain(uneven) {
  const random = numbersOf(uneven ? 8 : 9)
  const turn = () => {
    const q = [random(), random(), random(), random()]
    return q.map((x) => x / Math.hypot(...q))
  }
  const scale = (i) => (uneven && i % 5 === 2 ? [1.3, 0.7, 1] : Array(3).fill(i % 3 === 1 ? 2 : i % 3 === 2 ? 0.5 : 1))
  const nodes = Array.from({ length: 12 }, (_, i) => ({ name: `joint${i}`, ...(i && { parent: `joint${i - 1}` }), translation: [random(), 1, random()], rotation: turn(), scale: scale(i) }))
  const tracks = nodes.map(({ name, rotation }) => ({ node: name, path: 'rotation', times: [0, 0.3, 1], quaternions: [rotation, turn(), turn()] }))
  return JSON.stringify({ nodes, clips: [{ name: 'turns', tracks }] })
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
  const clip = { seed: 7, keys: 9, seconds: 1, most: 1.5 }
  const rigs = {
    figure: [biped({ names: 'mixamo', seed: 3, clip }), BIPED_HEIGHT],
    giant: [biped({ names: 'unreal', seed: 5, scale: 100, down: 0.8, clip }), 100 * BIPED_HEIGHT],
    chain: [chain(false), 12],
    uneven: [chain(true), 12],
  }
  for (const [name, [text, height]] of Object.entries(rigs)) {
    const model = await upload(text)
    const written = await fetch(`${model}/pose.bvh?fps=20`)
    write(name, await written.text(), { model, query: '', seconds: 1 / 20, height })
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
  assert.equal(names.length, 15)
  for (const file of names) {
    const name = file.slice(0, -'.places'.length)
    const places = JSON.parse(readFileSync(file))
    const facts = JSON.parse(readFileSync(`${name}.json`))
    const most = Object.keys(places).length * Object.values(places)[0].length
    const check = async (what, facts) => {
      const { worst, count } = await farthest(places, facts)
      console.log(`${name} ${what}: ${worst} of the height, ${count} of ${most} places`)
      assert.ok(count >= 0.9 * most && worst < 1e-4, `${name} ${what}: ${worst} of the height, ${count} of ${most} places`)
    }
    await check('read', facts)
    const exports = readdirSync('.').filter((other) => other.startsWith(`${name}.again`))
    assert.equal(exports.length, /^\s*CHANNELS 6 (?=[^]*^\s*CHANNELS 6 )/m.test(readFileSync(`${name}.bvh`)) ? 3 : 4, `${exports}`)
    for (const again of exports) await check(again, { ...facts, model: await upload(readFileSync(again)), query: '' })
  }
}

await (task === 'make' ? make() : compare())
