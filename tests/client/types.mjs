// The part of api/client/tweend.d.ts that openapi.json makes: options out of the parameters of paths, and the documents
// that go and come. `node types.mjs` writes it; the tests compare.
import { readFileSync, writeFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';

import openapiTS, { astToString } from 'openapi-typescript';
import ts from 'typescript';

const api = new URL('../../api/', import.meta.url);
const file = new URL('client/tweend.d.ts', api);
const MARK = '// ---- from openapi.json, by tests/client/types.mjs ----\n';

/** Options and whose query parameters they are. */
const OPTIONS = {
  ListOptions: '/v1/models',
  SourceOptions: '/v1/models/{id}/source',
  SurfaceOptions: '/v1/models/{id}/surface',
  PoseOptions: '/v1/models/{id}/pose',
  LiveOptions: '/v1/models/{id}/live',
  TracksOptions: '/v1/models/{id}/tracks',
};

/** What may be a list too, which the module joins by commas. */
const LISTS = { at: { type: 'number' }, nodes: { type: 'string' }, feet: { type: 'string' } };

/** What is an object, which the module writes as JSON. */
const OBJECTS = { map: { type: 'object', additionalProperties: { type: ['string', 'null'] } } };

/** Comments as JSDoc wants them, in lines of some length. */
function tidy(text) {
  const wrap = (line, head, words) => {
    const lines = [head];
    for (const word of words.split(' ')) {
      if (`${lines.at(-1)}${word}`.length > 116) lines.push(head.replace('/**', ' *'));
      lines[lines.length - 1] += `${word} `;
    }
    return lines.map((line) => line.trimEnd()).join('\n');
  };
  return text
    .replace(/^ +/gm, (spaces) => ' '.repeat(2 * Math.floor(spaces.length / 4) + (spaces.length % 4)))
    .replace(/^ *(\/\*\*|\*) @enum .*\n/gm, '')
    .replaceAll('@description ', '')
    .replace(/^( *(?:\/\*)?\* )(.*)$/gm, wrap)
    .replace(/components\["schemas"\]\["(\w+)"\]/g, '$1');
}

/** The declarations: of each schema an interface, or a type where it is no object. */
export async function generate() {
  const { paths, components, openapi, info } = JSON.parse(readFileSync(new URL('openapi.json', api)));
  const schemas = { ...components.schemas };
  delete schemas.TweendJson; // an upload is bytes
  for (const [name, path] of Object.entries(OPTIONS)) {
    const used = [...(paths[path].parameters ?? []), ...(paths[path].get.parameters ?? [])];
    const whole = used.map(({ $ref, ...own }) => ($ref ? components.parameters[$ref.split('/').at(-1)] : own));
    const queried = whole.filter((parameter) => parameter.in === 'query');
    const typeOf = ({ name, schema }) => {
      if (OBJECTS[name]) return { oneOf: [schema, OBJECTS[name]] };
      return LISTS[name] && !schema.enum ? { oneOf: [schema, LISTS[name], { type: 'array', items: LISTS[name] }] } : schema;
    };
    const properties = queried.map((parameter) => [parameter.name, { ...typeOf(parameter), description: parameter.description }]);
    schemas[name] = { type: 'object', properties: Object.fromEntries(properties) };
  }
  const nodes = await openapiTS({ openapi, info, paths: {}, components: { schemas } }, { defaultNonNullable: false });
  const members = nodes.find((node) => node.name?.text === 'components').members.find((member) => member.name.text === 'schemas').type.members;
  const exported = [ts.factory.createModifier(ts.SyntaxKind.ExportKeyword)];
  const declarations = members.map((member) => {
    const declaration = ts.isTypeLiteralNode(member.type)
      ? ts.factory.createInterfaceDeclaration(exported, member.name.text, undefined, undefined, member.type.members)
      : ts.factory.createTypeAliasDeclaration(exported, member.name.text, undefined, member.type);
    return ts.setSyntheticLeadingComments(declaration, ts.getSyntheticLeadingComments(member));
  });
  return tidy(astToString(declarations));
}

/** What tweend.d.ts is to be. */
export async function declarations() {
  const [own] = readFileSync(file, 'utf8').split(MARK);
  return `${own}${MARK}\n${await generate()}`;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) writeFileSync(file, await declarations());
