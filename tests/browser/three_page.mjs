// A page in Chromium on the daemon's own origin, so that it may ask it, with three.js at hand.
import { readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

import { launch } from './chromium.mjs';

const THREE = join(dirname(fileURLToPath(import.meta.url)), 'node_modules/three');
const PAGE = `<link rel="icon" href="data:,"><script type="importmap">
  {"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>`;

/** {browser, page}; the test closes the browser. */
export async function openPage(daemon) {
  const browser = await launch();
  const page = await browser.newPage();
  await page.route(`${daemon.url}/page`, (route) => route.fulfill({ contentType: 'text/html', body: PAGE }));
  await page.route(`${daemon.url}/three/**`, (route) => {
    const path = new URL(route.request().url()).pathname.slice('/three/'.length);
    return route.fulfill({ contentType: 'text/javascript', body: readFileSync(join(THREE, path)) });
  });
  await page.goto(`${daemon.url}/page`);
  return { browser, page };
}
