// Bundles the page and the API reference, each into one HTML file, writes their Content-Security-Policies, and bundles the viewer:
//   node build.mjs FOLDER    FOLDER: has the packages in node_modules; receives page.html, page.policy, docs.html, docs.policy
//                            and viewer.js, and what is no policy by brotli too, as FILE.br
import { createHash } from 'node:crypto';
import { readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { brotliCompressSync } from 'node:zlib';

const folder = resolve(process.argv[2]);
const own = (name) => fileURLToPath(new URL(name, import.meta.url));
const { buildSync } = createRequire(join(folder, 'package.json'))('esbuild');

function bundle(entry, options) {
  const { outputFiles } = buildSync({
    entryPoints: [own(entry)], bundle: true, minify: true, write: false, logLevel: 'warning',
    nodePaths: [join(folder, 'node_modules')], ...options,
  });
  return outputFiles[0].text.trim();
}

function save(name, text) {
  writeFileSync(join(folder, name), text);
  writeFileSync(join(folder, `${name}.br`), brotliCompressSync(text));
}

const hash = (text) => `'sha256-${createHash('sha256').update(text).digest('base64')}'`;

/** A script that may stand inside <script>: HTML takes comments and tags in it for its own. They stand in strings, templates
 * and regular expressions only, and so does what is not ASCII: without it a browser keeps a byte for each letter, not two,
 * and decodes and parses the page in half the time. */
const inlined = (script) => script.replace(/<(?=!--|\/?script)/gi, '\\x3C')
  .replace(/[^\0-\x7F]/g, (letter) => `\\u${letter.charCodeAt(0).toString(16).padStart(4, '0')}`);

/** policy: what the Content-Security-Policy allows besides the file's own script and style. */
function write(name, { html, script, style, policy }) {
  const text = readFileSync(own(html), 'utf8').replace(/\n\s*/g, '\n')
    .replace('<!--style-->', () => `<style>${style}</style>`)
    .replace('<!--script-->', () => `<script type="module">${script}</script>`);
  const whole = ["default-src 'none'", `script-src ${hash(script)} ${policy.scripts ?? ''}`.trim(), `style-src ${hash(style)}`,
    `img-src ${policy.images}`, `connect-src ${policy.requests}`, "base-uri 'none'", "form-action 'none'", "frame-ancestors 'self'"];
  save(`${name}.html`, text);
  writeFileSync(join(folder, `${name}.policy`), whole.join('; '));
}

write('page', {
  html: 'index.html',
  script: inlined(bundle('main.js', { format: 'esm', target: 'es2022', legalComments: 'eof' })),
  style: bundle('style.css', { target: 'es2022' }),
  policy: {
    scripts: "'wasm-unsafe-eval'", // the decoder of EXT_meshopt_compression is WebAssembly
    images: "'self' blob: data:", // textures
    requests: "'self' blob: data:",
  },
});

// The bundle of Swagger UI leaves the notices of what it holds to files beside it.
const beside = (name) => readFileSync(join(folder, 'node_modules/swagger-ui-dist', name), 'utf8');
const notices = `/*! ${beside('NOTICE').trim()}\nApache License 2.0, https://www.apache.org/licenses/LICENSE-2.0 */\n${beside('swagger-ui-es-bundle.js.LICENSE.txt')}`;

write('docs', {
  html: 'docs.html',
  script: inlined(`${bundle('docs.js', { format: 'esm', target: 'es2022', legalComments: 'eof' })}\n${notices}`),
  style: bundle('docs.css', { target: 'es2022' }),
  policy: { images: 'blob: data:', requests: "'self'" }, // icons of the style sheet
});

save('viewer.js', bundle('viewer.js', { format: 'esm', target: 'es2022', legalComments: 'eof' }));
