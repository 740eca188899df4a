// Bundles the page into one HTML file and writes its Content-Security-Policy:
//   node build.mjs FOLDER    FOLDER: has the packages in node_modules; receives page.html and page.policy
import { createHash } from 'node:crypto';
import { readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const folder = resolve(process.argv[2]);
const own = (name) => fileURLToPath(new URL(name, import.meta.url));
const { buildSync } = createRequire(join(folder, 'package.json'))('esbuild');

function bundle(entry, options) {
  const { outputFiles } = buildSync({
    entryPoints: [own(entry)], bundle: true, minify: true, write: false, charset: 'utf8', logLevel: 'warning',
    nodePaths: [join(folder, 'node_modules')], ...options,
  });
  return outputFiles[0].text.trim();
}

const script = bundle('main.js', { format: 'esm', target: 'es2022', legalComments: 'eof' });
const style = bundle('style.css', { target: 'es2022' });
const html = readFileSync(own('index.html'), 'utf8').replace(/\n\s*/g, '\n')
  .replace('<!--style-->', () => `<style>${style}</style>`)
  .replace('<!--script-->', () => `<script type="module">${script}</script>`);

const hash = (text) => `'sha256-${createHash('sha256').update(text).digest('base64')}'`;
const policy = [
  "default-src 'none'",
  `script-src ${hash(script)} 'wasm-unsafe-eval'`, // the decoder of EXT_meshopt_compression is WebAssembly
  `style-src ${hash(style)}`,
  "img-src 'self' blob: data:", // textures
  "connect-src 'self' blob: data:",
  "base-uri 'none'", "form-action 'none'", "frame-ancestors 'self'",
].join('; ');

writeFileSync(join(folder, 'page.html'), html);
writeFileSync(join(folder, 'page.policy'), policy);
