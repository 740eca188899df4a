// Every operation by what openapi.json gives as examples, defaults and values of its parameters, and by mistakes
// of each kind: all answers are documented, and all that is documented is answered.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Daemon } from '../node/daemon.mjs';
import { fault, operations } from './document.mjs';

const daemon = new Daemon(['--sample', '--api-keys', 'reader', '--url-keys', 'signer']);
const plain = new Daemon(['--sample']); // without keys
before(() => Promise.all([daemon.start(), plain.start()]));
after(() => Promise.all([daemon.remove(), plain.remove()]));

const missing = '0'.repeat(32);
const usual = { Authorization: 'Bearer reader' };

// What fetch cannot send, and what takes more than one request to reach: other suites do.
const rare = ['411', '413', '429', '500', '503', '507', 'default'];

// What is there only where the build found npm.
const isOptional = ({ path }) => ['/', '/docs', '/example.html', '/viewer.js'].includes(path);

// No sample is a refinement of another cage, or has a point alone: edits.bats and detail.bats find some.
const isRefused = ({ path }) => /\/(coarsen|detail)$/.test(path);
// What is needed, and of the sample's several meshes the one whose points are asked for.
const isNeeded = ({ path }, { name, required, in: place }) => place === 'query' && (required || (name === 'mesh' && path.endsWith('{id}/surface.bin')));
// Some examples have joints and no mesh, of which there are no points.
const hasNoPoints = ({ path }) => path === '/v1/surface.bin';
const expected = (asked) => (isOptional(asked) ? /^2|^404/ : isRefused(asked) ? /^422/ : hasNoPoints(asked) ? /^2|^422/ : /^2/);

/** Sends a request, checks that its answer is documented, and returns the answer's status. */
async function ask(asked, { id, query = '', headers = {}, body, of = daemon }) {
  const path = asked.path.replace('{id}', id ?? asked.parameters.find(({ name }) => name === 'id')?.example);
  const needed = asked.parameters.filter((parameter) => isNeeded(asked, parameter) && !query.startsWith(parameter.name));
  const whole = [...needed.map(({ name, example }) => `${name}=${example}`), query].filter(Boolean).join('&');
  const target = `${path}${whole && '?'}${whole}`;
  const answer = await fetch(of.url + target, { method: asked.method, headers: { ...usual, ...headers }, body });
  const type = answer.headers.get('Content-Type');
  let text;
  if (type === 'text/event-stream') await answer.body.cancel(); // some have no end
  else text = await answer.text();
  const wrong = fault(asked, answer.status, type, text);
  assert.equal(wrong, null, `${asked.method} ${target} ${JSON.stringify(headers)}: ${answer.status} ${text?.slice(0, 500)}`);
  return answer.status;
}

/** Bodies of the examples: [{ type, text }]; one that is empty where none is taken. */
function bodies({ content }) {
  if (Object.keys(content).length === 0) return [{}];
  return Object.entries(content).flatMap(([type, { example, examples }]) =>
    [example, ...Object.values(examples ?? {}).map(({ value }) => value)]
      .filter((value) => value !== undefined)
      .map((value) => ({ type, text: typeof value === 'string' ? value : JSON.stringify(value) })),
  );
}

const withBody = ({ type, text }) => (type ? { headers: { 'Content-Type': type }, body: text } : {});

/** Values of a parameter that the document names. */
function values({ schema, example }) {
  const choices = [schema, ...(schema.oneOf ?? [])].flatMap((one) => one.enum ?? (one.const ? [one.const] : []));
  return new Set([example, schema.default, ...choices].filter((value) => value !== undefined).map(String));
}

const wrong = [
  '',
  '[',
  '{"unknown":1}',
  '{"meshes":[{"positions":[],"faces":[[0,1,2]]}]}',
  '{"times":[1e999]}',
  '{"rotations":[{"quaternion":[0,0,0,0]}]}',
  '{"url":"/nowhere"}',
];

/** Mistakes, and requests of caches: each of one kind. */
function* oddRequests(asked, sent) {
  yield { query: 'nonsense=1', ...sent };
  yield { headers: { ...sent.headers, Accept: 'image/png' }, body: sent.body };
  yield { headers: { ...sent.headers, Authorization: '' }, body: sent.body };
  yield { headers: { ...sent.headers, Authorization: 'Bearer nobody' }, body: sent.body };
  if (asked.path.includes('{id}')) yield { id: missing, ...sent };
  if (asked.method !== 'POST') yield { headers: { 'If-Match': '"another"' } };
  if (asked.method === 'GET') {
    yield { headers: { 'If-None-Match': '*' } };
    yield { headers: { Range: 'bytes=0-11' } };
    yield { headers: { Range: 'bytes=999999999-' } };
    yield { headers: { 'Last-Event-ID': '999999' } };
  }
  const takes = (name) => asked.parameters.some((parameter) => parameter.name === name);
  if (takes('map') && asked.path.includes('{id}')) {
    const { example } = asked.parameters.find(({ name }) => name === 'id');
    yield { query: `clip=${example}/clip_0&retarget=auto&map=%7B%22nobody%22:null%7D`, ...sent };
  }
  if (!sent.body) return;
  if (takes('clip')) yield { query: takes('at') ? 'clip=missing&at=0' : 'clip=missing', ...sent };
  for (const body of wrong) yield { headers: { 'Content-Type': 'application/json' }, body };
  yield { headers: { 'Content-Type': 'image/png' }, body: sent.body };
  yield { headers: { ...sent.headers, 'Content-Encoding': 'br' }, body: sent.body };
}

for (const asked of [...operations].sort((a, b) => (a.method === 'DELETE') - (b.method === 'DELETE')))
  test(`${asked.operation.operationId} answers as documented`, async () => {
    const seen = new Set();
    const see = async (request) => {
      const status = String(await ask(asked, request));
      seen.add(status);
      return status;
    };
    const sent = bodies(asked).map(withBody);
    for (const parameter of asked.parameters.filter(({ in: place }) => place !== 'path'))
      for (const value of values(parameter)) {
        const inQuery = parameter.in === 'query';
        const query = inQuery ? `${parameter.name}=${encodeURIComponent(value)}` : '';
        await see({ ...sent[0], query, headers: { ...sent[0].headers, ...(inQuery ? {} : { [parameter.name]: value }) } });
      }
    for (const request of oddRequests(asked, sent[0])) await see(request);
    for (const request of sent) assert.match(await see(request), expected(asked));
    for (const request of [...sent, sent[0]]) await see({ ...request, of: plain }); // what is stored is there the second time
    if (isOptional(asked)) return;
    const isRare = (status) => rare.includes(status) || (isRefused(asked) && /^2/.test(status));
    const unseen = Object.keys(asked.operation.responses).filter((status) => !isRare(status) && !seen.has(status));
    assert.deepEqual(unseen, []);
  });
