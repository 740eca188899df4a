// README's pictures of the page: the script draws them, and those in the tree say what the page says.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { root } from '../node/daemon.mjs';
import { launch } from './chromium.mjs';

const readme = readFileSync(join(root, 'README.md'), 'utf8');
let browser, page, folder;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'tweend-pictures-'));
  execFileSync('node', [fileURLToPath(new URL('pictures.mjs', import.meta.url)), folder]);
  browser = await launch();
  page = await browser.newPage();
});

after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true });
});

/** The words of a picture, which must be one of vectors alone. */
async function wordsOf(file) {
  const text = readFileSync(file, 'utf8');
  assert.ok(text.length < 200000, `${text.length} bytes`);
  assert.doesNotMatch(text.replace(/ xmlns="[^"]*"/g, ''), /<image|<script|<foreignObject|href|url\(|:\/\/|data:|NaN|undefined/);
  const { fault, faces, words } = await page.evaluate((svg) => {
    const picture = new DOMParser().parseFromString(svg, 'image/svg+xml');
    return {
      fault: picture.querySelector('parsererror')?.textContent,
      faces: [...picture.querySelectorAll('path[class]')].reduce((sum, path) => sum + path.getAttribute('d').split('z').length - 1, 0),
      words: [...picture.querySelectorAll('text')].map(({ textContent }) => textContent).join(' '),
    };
  }, text);
  assert.equal(fault, undefined);
  assert.ok(faces > 1000, `${faces} faces`);
  return words;
}

for (const [name, said] of [['surface', /Level 2 · 3,530 points.* What each level has/], ['rotation', / gimbal lock.*Euler angles, XYZ/]])
  test(`the picture ${name}.svg is vectors alone, and says what the page says`, async () => {
    const kept = `server/page/pictures/${name}.svg`;
    assert.ok(readme.includes(`](${kept})`), `README shows ${kept}`);
    const words = await wordsOf(join(folder, `${name}.svg`));
    assert.match(words, said);
    const others = await wordsOf(join(root, kept));
    const length = Math.min(words.length, others.length); // fonts decide what is below the window's end
    assert.ok(length > 300, words);
    assert.equal(others.slice(0, length), words.slice(0, length));
  });
