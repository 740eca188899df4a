// The client of tweend, for web pages and node. The public classes are documented in tweend.d.ts.
// @ts-self-types="./tweend.d.ts"

/** An error answer, with the fields of its problem document (RFC 9457). */
export class TweendError extends Error {
  name = 'TweendError';

  constructor(response, problem) {
    super(problem.detail ?? problem.title ?? `${response.status} ${response.statusText}`);
    this.status = response.status;
    this.problem = problem;
    this.title = problem.title;
    this.detail = problem.detail;
    this.errors = problem.errors ?? [];
    this.line = problem.line;
    this.requestId = problem.instance ?? response.headers.get('X-Request-Id') ?? undefined;
    this.retryAfter = secondsToWait(response.headers);
  }
}

/** What Retry-After says, a number or a date, in seconds from now. */
function secondsToWait(headers) {
  const text = headers.get('Retry-After') ?? '';
  const seconds = /^\d+$/.test(text) ? Number(text) : Math.max(0, (Date.parse(text) - Date.now()) / 1000);
  return Number.isNaN(seconds) ? undefined : seconds;
}

/** Statuses after which a retry may succeed. With the first two nothing was done yet; others may come after the request was. */
const REFUSED = [429, 503];
const PASSING = [...REFUSED, 408, 502, 504];
const LONGEST_WAIT = 30; // seconds

/** The milliseconds to wait before a request is sent once more; undefined if that is not to be. tried: how often it was. */
function pauseAfter({ status, headers }, method, tried) {
  if (!(/^(GET|HEAD)$/i.test(method) ? PASSING : REFUSED).includes(status)) return undefined;
  const seconds = secondsToWait(headers) ?? 2 ** tried * (0.25 + Math.random() / 4);
  return seconds <= LONGEST_WAIT ? seconds * 1000 : undefined;
}

async function checked(response) {
  if (response.ok) return response;
  const problem = await response.json().catch(() => ({})); // a proxy's error is not JSON
  throw new TweendError(response, problem);
}

/** Throws for an answer that no daemon gives: other servers have no such path, or answer all paths with their page. */
function assertDaemon({ status, headers }, base) {
  const type = headers.get('Content-Type') ?? '';
  if (type.startsWith('text/html') && [200, 404, 405, 501].includes(status))
    throw new TypeError(`${base} is no tweend daemon: it answers with a web page. Give the daemon's URL, as in new Tweend('http://127.0.0.1:8080')`);
}

/** The daemon that served this module, alone or within its viewer. */
function guessBase() {
  const { url } = import.meta; // apart from new URL, where bundlers would take it for the address of a file
  if (!/^https?:.*\/(tweend|viewer)\.js$/.test(url) || url.includes('/node_modules/'))
    throw new TypeError("this module does not come from a daemon: give the daemon's URL, as in new Tweend('http://127.0.0.1:8080')");
  return new URL('.', url);
}

function idOf(model) {
  const id = typeof model === 'string' ? model : model?.id;
  if (!id) throw new TypeError('a model is expected: its id, or what upload and describe resolve with');
  return encodeURIComponent(id);
}

/** The options as "?level=2&at=0,1", without those that are undefined. What is no list of values is JSON. */
function queryOf(options = {}) {
  const list = (value) => {
    if (typeof value !== 'object') return encodeURIComponent(value);
    return value?.[Symbol.iterator] ? Array.from(value, encodeURIComponent).join() : encodeURIComponent(JSON.stringify(value));
  };
  const pairs = Object.entries(options).filter(([, value]) => value !== undefined);
  return pairs.length > 0 ? `?${pairs.map(([name, value]) => `${name}=${list(value)}`).join('&')}` : '';
}

/** The body and media type to fetch with: one file as it is, several files as a form. */
function bodyOf(source, type) {
  if (Array.isArray(source)) {
    const form = new FormData();
    for (const file of source) form.append('file', file, file.name);
    return { body: form };
  }
  // fetch would send other values as text: "undefined", or "[object Object]" for a plain object, of this realm or another.
  const prototype = source !== null && typeof source === 'object' ? Object.getPrototypeOf(source) : null;
  if (typeof source !== 'string' && (prototype === null || Object.getPrototypeOf(prototype) === null))
    throw new TypeError('upload takes a Blob or File, a list of Files, bytes, or text: of a document JSON.stringify(document)');
  // The daemon detects the format from the bytes; the type that browsers guess from a file's name may be one it refuses.
  return { body: source, type: type ?? 'application/octet-stream' };
}

// Binary answers begin with four letters, a version and the length of the JSON before their rows of floats.
const PREFIX = 12, POSES = 0x54575042, POINTS = 0x54575342;

function lengthOfHead(prefix, letters, name) {
  if (prefix.getUint32(0) !== letters || prefix.getUint32(4, true) !== 1) throw new TypeError(`the answer is no ${name} of version 1`);
  return prefix.getUint32(8, true);
}

/** Points in the form of surface.bin. */
function pointsBody(rows) {
  const json = JSON.stringify({ points: rows.length / 3, stride: 3 });
  const head = new TextEncoder().encode(json.padEnd(Math.ceil(json.length / 4) * 4));
  const prefix = new DataView(new ArrayBuffer(PREFIX));
  [POINTS, 1, head.length].forEach((value, i) => prefix.setUint32(4 * i, value, i > 0));
  return new Blob([prefix, head, rows]);
}

const PIECE = 1 << 16; // bytes

/** Makes requests for fetch whose body is a stream, and reports how much was taken from it. Browsers cannot send these. */
async function streamed({ headers, body, ...init }, onProgress) {
  const copy = new Response(body); // a form gets its media type
  const type = copy.headers.get('Content-Type');
  const blob = body instanceof Blob ? body : await copy.blob();
  return () => {
    let sent = 0;
    const stream = new ReadableStream({
      async pull(out) {
        const piece = new Uint8Array(await blob.slice(sent, sent + PIECE).arrayBuffer());
        out.enqueue(piece);
        onProgress((sent += piece.length), blob.size);
        if (sent === blob.size) out.close();
      },
    });
    const given = { ...(type && { 'Content-Type': type }), 'Content-Length': String(blob.size), ...headers };
    return { ...init, headers: given, body: stream, duplex: 'half' };
  };
}

/** Like fetch, but reports the progress of sending. */
function sendWithProgress(url, { method, headers, body, signal }, onProgress) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    const abort = () => request.abort();
    request.open(method, url);
    for (const [name, value] of Object.entries(headers)) request.setRequestHeader(name, value);
    request.upload.onprogress = ({ loaded, total }) => onProgress(loaded, total);
    request.onload = () => {
      const lines = request.getAllResponseHeaders().trim().split('\r\n');
      const fields = lines.map((line) => [line.slice(0, line.indexOf(':')), line.slice(line.indexOf(':') + 1)]);
      resolve(new Response(request.response, { status: request.status, statusText: request.statusText, headers: fields }));
    };
    request.onerror = () => reject(new TypeError('the upload failed on its way'));
    request.onabort = () => reject(signal.reason);
    request.onloadend = () => signal?.removeEventListener('abort', abort);
    if (signal?.aborted) return reject(signal.reason);
    signal?.addEventListener('abort', abort);
    request.send(body);
  });
}

/** A clip of another model. */
const BORROWED = /^[0-9a-f]{32}\//;

/** The nodes of a description as a document has them. Descriptions tell parents by name: a node whose parent shares its name with
 *  others has none in the document. Mixed clips do not need it, as they play on the nodes of the model that borrows them. */
function nodesOf({ nodes }) {
  const counts = new Map();
  for (const { name } of nodes) counts.set(name, (counts.get(name) ?? 0) + 1);
  return nodes.map(({ name, parent, rest: { matrix, ...rest } }) => ({ name, ...(counts.get(parent) === 1 && { parent }), ...rest }));
}

/** The options that say which poses there are, whatever their times and form. */
const POSED = ['clip', 'nodes', 'interpolation', 'retarget', 'map', 'feet', 'root_motion', 'root_axes', 'in_place'];

function split(options, names) {
  const entries = Object.entries(options);
  const part = (isNamed) => Object.fromEntries(entries.filter(([name]) => names.includes(name) === isNamed));
  return [part(true), part(false)];
}

export class Tweend {
  #fetch;

  constructor(base, { key, fetch, retries = 3 } = {}) {
    const url = base === undefined ? guessBase() : new URL(base, globalThis.document?.baseURI);
    this.base = url.origin + url.pathname.replace(/\/*$/, '/');
    this.key = key;
    this.retries = retries;
    this.#fetch = fetch;
  }

  // ---- requests ----

  url(path) {
    return new URL(path, this.base).href;
  }

  #headers(url, headers) {
    // Only the daemon gets the key.
    return this.key && url.startsWith(this.base) ? { Authorization: `Bearer ${this.key}`, ...headers } : { ...headers };
  }

  #send(url, init) {
    return this.#fetch ? this.#fetch(url, init) : fetch(url, init);
  }

  /** Sends what `send` sends until the daemon does not put it off any more. */
  async #insist(url, send, { method = 'GET', signal, retries = this.retries, onWait }) {
    for (let tried = 0; ; tried++) {
      const response = await send();
      const wait = tried < retries && url.startsWith(this.base) ? pauseAfter(response, method, tried) : undefined;
      if (wait === undefined) {
        if (url.startsWith(`${this.base}v1/`)) assertDaemon(response, this.base);
        return checked(response);
      }
      const refusal = await checked(response).catch((error) => error);
      signal?.throwIfAborted();
      onWait?.(wait / 1000, refusal);
      await pause(wait, signal);
      signal?.throwIfAborted();
    }
  }

  async request(path, { headers, retries, ...init } = {}) {
    const url = this.url(path);
    const isOnce = init.body instanceof ReadableStream;
    const send = () => this.#send(url, { ...init, headers: this.#headers(url, headers) });
    return this.#insist(url, send, { ...init, retries: isOnce ? 0 : retries });
  }

  async #json(path, init) {
    return (await this.request(path, init)).json();
  }

  #post(path, document, init) {
    const headers = { 'Content-Type': 'application/json' };
    return this.#json(path, { ...init, method: 'POST', headers, body: JSON.stringify(document) });
  }

  async sign(url, seconds) {
    if (!this.key) return this.url(url);
    // The daemon may be behind a prefix that it does not know.
    const path = `/${this.url(url).slice(this.base.length)}`;
    const signed = await this.#post('v1/sign', { url: path, seconds });
    return this.url(signed.url.slice(1));
  }

  // ---- models ----

  async upload(source, { name, type, onProgress, ...options } = {}) {
    const { body, type: contentType } = bodyOf(source, type);
    const url = this.url(`v1/models${queryOf({ name: name ?? (source.name || undefined) })}`);
    const headers = this.#headers(url, contentType && { 'Content-Type': contentType });
    const init = { method: 'POST', headers, body, signal: options.signal };
    let send = () => this.#send(url, init);
    if (onProgress && globalThis.XMLHttpRequest) {
      if (!this.#fetch) send = () => sendWithProgress(url, init, onProgress);
    } else if (onProgress) {
      const next = await streamed(init, onProgress);
      send = () => this.#send(url, next());
    }
    return (await this.#insist(url, send, { method: 'POST', ...options })).json();
  }

  async mix(model, layers, { name = 'mix', ...options } = {}) {
    const description = await this.describe(model, options);
    const { id } = description;
    const document = {
      nodes: nodesOf(description),
      clips: [{ name, layers: layers.map(({ clip, ...layer }) => ({ clip: clip === undefined || BORROWED.test(clip) ? clip : `${id}/${clip}`, ...layer })) }],
    };
    return `${idOf(await this.upload(JSON.stringify(document), { name, ...options }))}/${name}`;
  }

  describe(model, init) {
    return this.#json(`v1/models/${idOf(model)}`, init);
  }

  edit(model, edits, { mesh, quads, name, ...init } = {}) {
    return this.#post(`v1/models/${idOf(model)}/edits${queryOf({ quads, name })}`, { mesh, edits }, init);
  }

  sculpt(model, points, { level, mesh, quads, name, ...init } = {}) {
    const path = `v1/models/${idOf(model)}/detail${queryOf({ level, mesh, quads, name })}`;
    const list = (values) => Array.from(values);
    if (points.indices) return this.#post(path, { space: 'mesh', indices: list(points.indices), positions: list(points.positions) }, init);
    const headers = { 'Content-Type': 'application/octet-stream' };
    return this.#json(path, { ...init, method: 'POST', headers, body: pointsBody(Float32Array.from(points)) });
  }

  coarsen(model, { mesh, levels, scheme, boundary, quads, name, ...init } = {}) {
    const query = queryOf({ mesh, levels, scheme, boundary, quads, name });
    return this.#json(`v1/models/${idOf(model)}/coarsen${query}`, { ...init, method: 'POST' });
  }

  async *list({ limit, after, ...init } = {}) {
    for (let path = `v1/models${queryOf({ limit, after })}`; path; ) {
      const { models, next } = await this.#json(path, init);
      yield* models;
      path = next && `v1/models${new URL(next, this.base).search}`;
    }
  }

  async remove(model, init) {
    await this.request(`v1/models/${idOf(model)}`, { ...init, method: 'DELETE' });
  }

  sourceUrl(model, options) {
    return this.url(`v1/models/${idOf(model)}/source${queryOf(options)}`);
  }

  // ---- surfaces ----

  surfaceUrl(model, options, form = 'glb') {
    return this.url(`v1/models/${idOf(model)}/surface.${form}${queryOf(options)}`);
  }

  surface(model, options, form, init) {
    return this.request(this.surfaceUrl(model, options, form), init);
  }

  async surfaceOf(source, options, form = 'glb', init) {
    const { body, type } = bodyOf(source);
    const headers = type && { 'Content-Type': type };
    return this.request(`v1/surface.${form}${queryOf(options)}`, { ...init, method: 'POST', headers, body });
  }

  async points(model, options, init) {
    const bytes = await (await this.surface(model, options, 'bin', init)).arrayBuffer();
    return new Float32Array(bytes, PREFIX + lengthOfHead(new DataView(bytes), POINTS, 'surface.bin'));
  }

  async levels(model, options, init) {
    return (await this.#json(this.url(`v1/models/${idOf(model)}/levels.json${queryOf(options)}`), init)).levels;
  }

  surfaceCounts(model, options, init) {
    return this.#json(this.surfaceUrl(model, options, 'json'), init);
  }

  // ---- poses ----

  poseUrl(model, options, form = 'json') {
    return this.url(`v1/models/${idOf(model)}/pose.${form}${queryOf(options)}`);
  }

  /** Requests poses; sends the times and the map in a body where the URL would become too long. */
  #askPoses(model, { at, map, ...options }, form, init) {
    const url = this.poseUrl(model, { at, map, ...options }, form);
    const [hasTimes, hasMap] = [at, map].map((value) => typeof value === 'object');
    if (url.length < 4000 || !(hasTimes || hasMap)) return this.request(url, init);
    const headers = { 'Content-Type': 'application/json' };
    const body = JSON.stringify({ ...(hasTimes && { times: Array.from(at) }), ...(hasMap && { map }) });
    const rest = { ...options, ...(!hasTimes && { at }), ...(!hasMap && { map }) };
    return this.request(this.poseUrl(model, rest, form), { ...init, method: 'POST', headers, body });
  }

  async pose(model, options = {}, init) {
    return (await this.#askPoses(model, options, 'json', init)).json();
  }

  async poseStream(model, options = {}, init) {
    return PoseStream.open((await this.#askPoses(model, options, 'bin', init)).body);
  }

  async poseTable(model, options, init) {
    return (await this.poseStream(model, options, init)).table();
  }

  tracks(model, options, init) {
    return this.#json(`v1/models/${idOf(model)}/tracks${queryOf(options)}`, init);
  }

  rotations(request, init) {
    return this.#post('v1/rotations', request, init);
  }

  // ---- players ----

  async play(model, objects, options = {}) {
    const [which, { fps = 60, signal, ...settings }] = split(options, POSED);
    const { header: { duration } } = await this.poseTable(model, { ...which, at: 0 }, { signal });
    // Rounds the steps up so that the last one is the clip's end.
    const times = duration > 0 ? { from: 0, to: duration, fps: Math.ceil(duration * fps) / duration } : { at: 0 };
    return new Player(objects, await this.poseTable(model, { ...which, ...times }, { signal }), settings);
  }

  liveUrl(model, options) {
    return this.url(`v1/models/${idOf(model)}/live${queryOf(options)}`);
  }

  async live(model, objects, options) {
    const player = new LivePlayer(this, model, objects, options);
    await player.begun;
    options?.signal?.throwIfAborted();
    return player;
  }
}

// ---- poses in binary -----------------------------------------------------------------------------

/** Reads the bytes of a stream as they arrive. */
class Bytes {
  #chunk = new Uint8Array(0);
  #reader;

  constructor(stream) {
    this.#reader = stream.getReader();
  }

  /** Writes the next bytes to `out` and returns their number, at least one unless `out` is empty. */
  async some(out) {
    while (this.#chunk.length === 0 && out.length > 0) {
      const { done, value } = await this.#reader.read();
      if (done) throw new TypeError('the answer ended before its last byte');
      this.#chunk = value;
    }
    const taken = this.#chunk.subarray(0, out.length);
    out.set(taken);
    this.#chunk = this.#chunk.subarray(taken.length);
    return taken.length;
  }

  async fill(out) {
    for (let size = 0; size < out.length; ) size += await this.some(out.subarray(size));
    return out;
  }

  cancel() {
    return this.#reader.cancel();
  }
}

const BLOCK = 1 << 14; // floats

export class PoseStream {
  #bytes;

  constructor(header, bytes) {
    this.header = header;
    this.#bytes = bytes;
  }

  static async open(stream) {
    const bytes = new Bytes(stream);
    const prefix = new DataView((await bytes.fill(new Uint8Array(PREFIX))).buffer);
    const header = await bytes.fill(new Uint8Array(lengthOfHead(prefix, POSES, 'pose.bin')));
    return new PoseStream(JSON.parse(new TextDecoder().decode(header)), bytes);
  }

  async *[Symbol.asyncIterator]() {
    const { poses, stride } = this.header;
    try {
      for (let left = poses; left > 0; ) {
        const count = Math.min(left, Math.max(1, Math.floor(BLOCK / stride)));
        const block = new Float32Array(count * stride);
        const bytes = new Uint8Array(block.buffer);
        for (let size = 0, row = 0; row < count; ) {
          size += await this.#bytes.some(bytes.subarray(size));
          for (; row < count && (row + 1) * stride * 4 <= size; row++) yield block.subarray(row * stride, (row + 1) * stride);
        }
        left -= count;
      }
    } finally {
      await this.#bytes.cancel();
    }
  }

  async table() {
    const rows = new Float32Array(this.header.poses * this.header.stride);
    await this.#bytes.fill(new Uint8Array(rows.buffer));
    return new PoseTable(this.header, rows);
  }
}

export class PoseTable {
  constructor(header, rows) {
    this.header = header;
    this.rows = rows;
  }

  row(pose) {
    const { stride } = this.header;
    return this.rows.subarray(pose * stride, (pose + 1) * stride);
  }

  part(pose, node, name) {
    const { nodes, stride, node_stride, layout } = this.header;
    const { offset, components } = layout.find((part) => part.name === name);
    const index = typeof node === 'number' ? node : nodes.indexOf(node);
    const start = pose * stride + index * node_stride + offset;
    return this.rows.subarray(start, start + components);
  }

  weights(pose, node) {
    const { nodes, weights = [] } = this.header;
    const index = typeof node === 'number' ? node : nodes.indexOf(node);
    const part = weights.find((part) => part.node === index);
    return part && this.row(pose).subarray(part.offset, part.offset + part.components);
  }

  root(pose, name) {
    const { offset, components } = this.header.root.find((part) => part.name === name);
    return this.row(pose).subarray(offset, offset + components);
  }
}

// ---- objects -------------------------------------------------------------------------------------

/** All objects of a tree or scene; anything else is returned as it is. */
function listOf(objects) {
  if (objects.traverse) {
    const all = [];
    objects.traverse((object) => all.push(object)); // three.js
    return all;
  }
  if (objects.getDescendants) return [objects, ...objects.getDescendants()]; // a node of Babylon.js
  return objects.getNodes?.() ?? objects; // a scene or container of Babylon.js
}

/** The object for each name, or undefined. Objects with equal names are each found once. */
function find(objects, names) {
  if (typeof objects === 'function') return names.map((name, i) => objects(name, i));
  const list = listOf(objects);
  if (!(Symbol.iterator in list)) return names.map((name) => list[name]);
  const named = new Map(); // by the name in the file, which three.js keeps in userData beside a sanitised one
  const add = (name, object) => named.set(name, [...(named.get(name) ?? []), object]);
  for (const object of list) if (object.userData?.name !== undefined) add(object.userData.name, object);
  for (const object of list) if (object.userData?.name === undefined) add(object.name, object);
  return names.map((name) => named.get(name)?.shift());
}

/** The meshes of a node's object: itself, or what it has below it that is of no other node. */
function meshesOf(object, found) {
  if (object.morphTargetInfluences || object.morphTargetManager) return [object];
  const below = object.getChildren?.() ?? object.children ?? [];
  return below.filter((child) => !found.includes(child) && child.userData?.name === undefined).flatMap((child) => meshesOf(child, found));
}

/** The meshes of each of the nodes with morph weights. */
const findMeshes = (objects, { weights = [] }) => weights.map(({ node }) => (objects[node] ? meshesOf(objects[node], objects) : []));

/** Sets the morph weights of meshes, t from row a to row b, and returns them. */
function morph(meshes, { weights }, a, b, t) {
  return weights && Object.fromEntries(weights.map(({ name, offset, components }, place) => {
    const now = lerp(a, b, offset, t, components);
    for (const { morphTargetInfluences: influences, morphTargetManager: manager } of meshes[place])
      now.forEach((value, i) => {
        if (influences) influences[i] = value;
        else if (i < manager.numTargets) manager.getTarget(i).influence = value; // of Babylon.js
      });
    return [name, now];
  }));
}

const AXES = ['x', 'y', 'z', 'w'];

/** Sets a vector or quaternion of three.js or Babylon.js, a list, or anything with x, y, z. */
function put(target, values) {
  if (Array.isArray(target) || ArrayBuffer.isView(target)) values.forEach((value, i) => (target[i] = value));
  else if (target.set) target.set(...values);
  else values.forEach((value, i) => (target[AXES[i]] = value));
}

/** Offsets of a node's numbers in a row, and their count. */
const ROTATION = 0;
const TRANSLATION = 4;
const SCALE = 7;
const WIDTH = 10;

/** Interpolates from a to b the short way at constant speed; both quaternions are at index `at`. */
function slerp(a, b, at, t) {
  let dot = 0;
  for (let i = at; i < at + 4; i++) dot += a[i] * b[i];
  const sign = dot < 0 ? -1 : 1;
  let apart = 0;
  let along = 0;
  for (let i = at; i < at + 4; i++) {
    apart += (sign * b[i] - a[i]) ** 2;
    along += (sign * b[i] + a[i]) ** 2;
  }
  const angle = 2 * Math.atan2(Math.sqrt(apart), Math.sqrt(along)); // acos is imprecise for small angles
  const part = (t) => (angle < 1e-4 ? t : Math.sin(t * angle) / Math.sin(angle));
  const [u, v] = [part(1 - t), sign * part(t)];
  return AXES.map((_, i) => u * a[at + i] + v * b[at + i]);
}

const lerp = (a, b, at, t, count = 3) => Array.from({ length: count }, (_, i) => (1 - t) * a[at + i] + t * b[at + i]);

/** Moves the objects to the pose at t, 0 to 1, between two rows. */
function apply(objects, a, b, t) {
  objects.forEach((object, node) => {
    if (!object) return;
    const at = node * WIDTH;
    // Babylon.js: rotationQuaternion is null until it is set, and scale is called scaling.
    if (object.rotationQuaternion === null) object.rotationQuaternion = object.rotation.toQuaternion();
    put(object.rotationQuaternion ?? object.quaternion, slerp(a, b, at + ROTATION, t));
    put(object.position, lerp(a, b, at + TRANSLATION, t));
    put(object.scaling ?? object.scale, lerp(a, b, at + SCALE, t));
  });
}

/** The motion of the whole figure at t between two rows that end with it: rotation and translation. */
function rootOf(a, b, t) {
  const at = a.length - TRANSLATION - 3;
  return { rotation: slerp(a, b, at + ROTATION, t), translation: lerp(a, b, at + TRANSLATION, t) };
}

// ---- players -------------------------------------------------------------------------------------

/** Plays a table of poses on the local clock. */
export class Player {
  #objects;
  #meshes;
  #last; // ms, time of the last update; undefined: time stands still until the next update
  #time; // seconds, before looping
  #playing;

  constructor(objects, table, { time = 0, speed = 1, loop = 'repeat', playing = true } = {}) {
    if (table.header.as !== 'trs') throw new TypeError('a player takes poses as=trs');
    this.table = table;
    this.#objects = find(objects, table.header.nodes);
    this.missing = table.header.nodes.filter((_, i) => !this.#objects[i]);
    this.#meshes = findMeshes(this.#objects, table.header);
    this.#time = time;
    this.speed = speed;
    this.loop = loop;
    this.#playing = playing;
  }

  get playing() {
    return this.#playing;
  }

  set playing(value) {
    this.#playing = value;
    this.#last = undefined;
  }

  get duration() {
    return this.table.header.duration;
  }

  get time() {
    const { duration } = this;
    if (this.loop === 'clamp' || duration === 0) return Math.min(Math.max(this.#time, 0), duration);
    const period = this.loop === 'pingpong' ? 2 * duration : duration;
    const phase = ((this.#time % period) + period) % period;
    return phase > duration ? period - phase : phase;
  }

  set time(seconds) {
    this.#time = seconds;
    this.#last = undefined;
  }

  update(now = performance.now()) {
    if (this.playing && this.#last !== undefined) this.#time += (Math.max(0, now - this.#last) / 1000) * this.speed;
    this.#last = now;
    const { table, time } = this;
    const { times } = table.header;
    let [from, to] = [0, times.length - 1]; // binary search for the step that contains the time
    while (to - from > 1) {
      const middle = (from + to) >> 1;
      if (times[middle] <= time) from = middle;
      else to = middle;
    }
    const span = times[to] - times[from];
    const t = span > 0 ? Math.min(Math.max((time - times[from]) / span, 0), 1) : 0;
    const [a, b] = [table.row(from), table.row(to)];
    apply(this.#objects, a, b, t);
    this.weights = morph(this.#meshes, table.header, a, b, t);
    if (table.header.root) this.root = rootOf(a, b, t);
    return time;
  }
}

/** The minimum of the values of the last 15 to 30 seconds, which the network and the server delayed least. Small changes of
 * the minimum are approached gradually, so that playback does not jump. */
class Least {
  #now = Infinity;
  #before = Infinity;
  #since = -Infinity;

  tell(value, at) {
    if (at - this.#since > 15000) [this.#before, this.#now, this.#since] = [this.#now, Infinity, at];
    this.#now = Math.min(this.#now, value);
    const least = Math.min(this.#now, this.#before);
    this.value = Math.abs(least - this.value) < 250 ? this.value + (least - this.value) / 4 : least;
  }
}

/** Yields the events of an event stream (WHATWG HTML, section 9.2) as objects of their fields, until the signal aborts. */
async function* readEvents(stream, signal) {
  const reader = stream.pipeThrough(new TextDecoderStream()).getReader();
  // fetch should end the stream, but in Node.js 18 it may have lost the signal to the garbage collector.
  const stop = () => reader.cancel().catch(() => {});
  signal.addEventListener('abort', stop);
  let text = '';
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done || signal.aborted) return;
      const blocks = (text + value).split('\n\n');
      text = blocks.pop();
      for (const block of blocks) yield Object.fromEntries(block.split('\n').map((line) => line.split(/: ?(.*)/s)));
    }
  } finally {
    signal.removeEventListener('abort', stop);
    await stop(); // a stream that broke has nothing to cancel
  }
}

/** Resolves after `ms`, or as soon as the signal aborts. */
function pause(ms, signal) {
  return new Promise((resolve) => {
    const stop = () => {
      clearTimeout(timer);
      signal?.removeEventListener('abort', stop);
      resolve();
    };
    const timer = setTimeout(stop, ms);
    signal?.addEventListener('abort', stop);
    if (signal?.aborted) stop();
  });
}

// A browser opens six connections to an origin over HTTP/1, of which each live stream takes one: the next request waits.
const MANY_STREAMS = 4;
const openStreams = new Map(); // number by origin, of all clients of this page
let warned = false;

/** Counts a stream that has begun, and warns once before requests begin to wait. Returns what uncounts it. */
function countStream(url, { statusText }) {
  const { origin } = new URL(url);
  const count = (step) => openStreams.set(origin, (openStreams.get(origin) ?? 0) + step).get(origin);
  const inBrowser = globalThis.document ?? globalThis.WorkerGlobalScope;
  if (count(1) >= MANY_STREAMS && !warned && inBrowser && statusText) { // HTTP/2 has no status text
    warned = true;
    console.warn(`tweend: ${MANY_STREAMS} live streams from ${origin} are open. Browsers have six connections to an origin over ` +
      'HTTP/1: with six streams every other request waits. End streams with player.close() or the signal given to live(); play() needs none.');
  }
  return () => count(-1);
}

/** Plays the daemon's live stream. */
export class LivePlayer {
  #abort = new AbortController();
  #objects = [];
  #meshes;
  #header; // of a pose in binary, which frames are put into the form of
  #frames = []; // {number, time, row}, ascending; shown between the first and the second
  #step; // ms between frames
  #start; // server time of frame 0 in ms, if given
  #offset = new Least(); // local clock minus server clock
  #origin = new Least(); // server time of frame 0, as estimated from the frames
  #retry = 1000;
  #last; // number of the last frame received
  missing = [];
  ended = false;
  connected = false; // false while it waits for the daemon to answer again

  constructor(tweend, model, objects, { delay, signal, ...options } = {}) {
    const { as = 'trs', fps = 30, speed = 1, start } = options;
    if (as !== 'trs') throw new TypeError('a player takes poses as=trs');
    this.#step = 1000 / fps;
    this.#start = start;
    this.speed = speed;
    this.delay = delay ?? 100 + this.#step;
    signal?.addEventListener('abort', () => this.close());
    if (signal?.aborted) this.close();
    this.begun = new Promise((resolve, reject) => {
      this.done = this.#run(tweend, model, objects, options, resolve);
      this.done.then(resolve, reject);
    });
  }

  get serverTime() {
    return performance.now() - this.#offset.value;
  }

  close() {
    this.#abort.abort();
  }

  async #run(tweend, model, objects, options, begun) {
    const { signal } = this.#abort;
    try {
      const [which] = split(options, POSED);
      const { header } = await tweend.poseTable(model, { ...which, at: 0 }, { signal });
      this.#header = header;
      this.#objects = find(objects, header.nodes);
      this.missing = header.nodes.filter((_, i) => !this.#objects[i]);
      this.#meshes = findMeshes(this.#objects, header);
      while (!this.ended) {
        const wait = await this.#connect(tweend, tweend.liveUrl(model, options), begun);
        signal.throwIfAborted(); // a pause begun now would not be told
        if (!this.ended) await pause(wait, signal);
        signal.throwIfAborted();
      }
    } catch (error) {
      if (!signal.aborted) throw error;
    }
  }

  /** Reads the stream until it ends or breaks; returns the ms to wait before reconnecting. */
  async #connect(tweend, url, begun) {
    let uncount;
    try {
      const headers = { Accept: 'text/event-stream' };
      if (this.#last !== undefined) headers['Last-Event-ID'] = String(this.#last);
      const response = await tweend.request(url, { headers, cache: 'no-store', retries: 0, signal: this.#abort.signal });
      this.ended = response.status === 204;
      if (this.ended) return 0;
      uncount = countStream(url, response);
      this.connected = true;
      [this.#offset, this.#origin] = [new Least(), new Least()]; // another replica may answer, with another clock
      for await (const { retry, event, id, data } of readEvents(response.body, this.#abort.signal)) {
        if (retry) this.#retry = Number(retry);
        else if (event === 'end') this.ended = true;
        else if (data) this.#take(Number(id), data, begun);
      }
    } catch (error) {
      if (error instanceof TweendError && !PASSING.includes(error.status)) throw error;
      return Math.max(this.#retry, (error.retryAfter ?? 0) * 1000);
    } finally {
      this.connected = false;
      uncount?.();
    }
    return this.#retry;
  }

  #take(number, data, begun) {
    const local = performance.now();
    const { now, t, rotation, translation, scale, weights, root } = JSON.parse(data);
    const row = new Float32Array(this.#header.stride);
    rotation.forEach((value, node) => {
      row.set(value, node * WIDTH + ROTATION);
      row.set(translation[node], node * WIDTH + TRANSLATION);
      row.set(scale[node], node * WIDTH + SCALE);
    });
    for (const { name, offset } of this.#header.weights ?? []) row.set(weights[name], offset);
    if (root) row.set([...root.rotation, ...root.translation], row.length - 7);
    this.#offset.tell(local - now, local);
    this.#origin.tell(this.#start ?? now - number * this.#step, local);
    this.#last = number;
    this.#frames.push({ number, time: t, row });
    this.#forget(local);
    begun();
  }

  /** The local time at which a frame is to be shown. */
  #due(frame) {
    return this.#origin.value + frame.number * this.#step + this.#offset.value + this.delay;
  }

  /** Drops the frames before the one shown now. */
  #forget(now) {
    while (this.#frames.length > 1 && this.#due(this.#frames[1]) <= now) this.#frames.shift();
  }

  update(now = performance.now()) {
    this.#forget(now);
    const [a, b = a] = this.#frames;
    if (!a) return undefined;
    const span = this.#due(b) - this.#due(a);
    const leaps = Math.abs(b.time - a.time) * 1000 > 1.5 * span * Math.abs(this.speed); // the clip has started over
    const t = span > 0 && !leaps ? Math.min(Math.max((now - this.#due(a)) / span, 0), 1) : 0;
    apply(this.#objects, a.row, b.row, t);
    this.weights = morph(this.#meshes, this.#header, a.row, b.row, t);
    if (this.#header.root) this.root = rootOf(a.row, b.row, t);
    this.time = a.time + t * (b.time - a.time);
    return this.time;
  }
}
