// openapi.json: its operations, and whether an answer is one that it documents.
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import Ajv from 'ajv/dist/2020.js';
import { root } from '../node/daemon.mjs';

export const file = join(root, 'api/openapi.json');
export const document = JSON.parse(readFileSync(file, 'utf8'));

/** What a "$ref" points to; the object itself without one. */
export const resolve = (object) =>
  object?.$ref ? object.$ref.slice(2).split('/').reduce((place, name) => place[name], document) : object;

const methods = ['get', 'post', 'delete'];

/** [{ path, method, operation, parameters, content }], parameters of the path and of the operation together. */
export const operations = Object.entries(document.paths).flatMap(([path, item]) =>
  methods
    .filter((method) => item[method])
    .map((method) => ({
      path,
      method: method.toUpperCase(),
      operation: item[method],
      parameters: [...(item.parameters ?? []), ...(item[method].parameters ?? [])].map(resolve),
      content: resolve(item[method].requestBody)?.content ?? {},
    })),
);

/** The operation that a request is for; HEAD is GET's. */
export function find(method, target) {
  const unescaped = (escaped, hex) => {
    const character = String.fromCharCode(parseInt(hex, 16));
    return /[\w.~-]/.test(character) ? character : escaped;
  };
  const path = target.replace(/[?#].*/s, '').replace(/%([0-9a-f]{2})/gi, unescaped);
  const fits = (pattern) =>
    pattern.split('/').length === path.split('/').length &&
    new RegExp(`^${pattern.replaceAll('.', '\\.').replace('{id}', '[0-9a-f]{32}')}$`).test(path);
  return operations.find((one) => one.method === (method === 'HEAD' ? 'GET' : method) && fits(one.path));
}

// What any request may be refused with, as the component says in words.
const refusals = document.components.responses.Refused.description.match(/\b[45]\d\d\b/g).map(Number);

// Answers have no member that is not documented: clients may get such from later versions, tests may not.
const ajv = new Ajv({ strict: false });
ajv.addSchema(closed(document), 'document');

function closed(value) {
  if (Array.isArray(value)) return value.map(closed);
  if (typeof value !== 'object' || value === null) return value;
  const copy = Object.fromEntries(Object.entries(value).map(([name, member]) => [name, closed(member)]));
  const isOpen = copy.type === 'object' && copy.properties && copy.additionalProperties === undefined;
  return isOpen ? { ...copy, additionalProperties: false } : copy;
}

const escape = (name) => name.replaceAll('~', '~0').replaceAll('/', '~1');

const responseOf = ({ responses }, status) => resolve(responses[status] ?? (refusals.includes(status) ? responses.default : undefined));

/** Fields that any answer may have: of HTTP itself, of CORS, and those that the document's introduction names. */
const EVERYWHERE = new Set([
  'allow', 'cache-control', 'connection', 'content-encoding', 'content-length', 'content-type', 'date', 'transfer-encoding', 'vary',
  'access-control-allow-headers', 'access-control-allow-methods', 'access-control-allow-origin', 'access-control-expose-headers',
  'access-control-max-age', 'ratelimit', 'ratelimit-policy', 'server-timing', 'timing-allow-origin', 'x-accel-buffering',
  'x-content-type-options', 'x-request-id',
]);

/** Of the names of an answer's fields those that neither the operation nor EVERYWHERE documents. */
export function strayFields({ operation }, status, names) {
  const known = [status, ...(status === 304 ? [200] : [])] // RFC 9110, 15.4.5
    .flatMap((each) => Object.keys(responseOf(operation, each)?.headers ?? {}))
    .map((name) => name.toLowerCase());
  return names.filter((name) => !EVERYWHERE.has(name) && !known.includes(name));
}

/** What is wrong with an answer to the operation; null: nothing. body: a JSON text, or undefined. */
export function fault({ path, method, operation }, status, type, body) {
  const documented = operation.responses[status] ?? (refusals.includes(status) ? operation.responses.default : undefined);
  if (!documented) return `${status} is not documented`;
  const { content } = responseOf(operation, status);
  if (!type) return content && status < 300 ? 'it has no Content-Type' : null;
  if (!content) return `${status} documents no content, this is ${type}`;
  const name = type.replace(/ *;.*/, '');
  if (!content[name]) return `${status} documents no ${name}`;
  if (!body || status === 206 || !content[name].schema || !/json$/.test(name) || name.endsWith('ndjson')) return null;
  const head = documented.$ref ?? `#/paths/${escape(path)}/${method.toLowerCase()}/responses/${status}`;
  const check = ajv.getSchema(`document${head}/content/${escape(name)}/schema`);
  return check(JSON.parse(body)) ? null : ajv.errorsText(check.errors);
}
