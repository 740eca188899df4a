// Draws README's pictures of the page as SVG, from the page in Chromium: node pictures.mjs [FOLDER]
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

import { Daemon, root } from '../node/daemon.mjs';
import { IN_SOFTWARE, launch } from './chromium.mjs';
import { DESKTOP, TABLET, Visit } from './page_driver.mjs';
import { drawPage } from './picture_page.mjs';
import { DENSITY, drawView } from './picture_view.mjs';

const PICTURES = [
  { name: 'surface', title: 'The page, light: the surface of a tank under its control cage, and the counts of each level', hash: '#tab=surface', options: DESKTOP },
  { name: 'rotation', title: 'The page, dark: what a clip is like, and how near a rotation comes to gimbal lock', hash: '#tab=animation', options: TABLET },
];
const VIEW = [4.278, 3.755, 6.189, 0, 1.188, 0.2]; // where the camera stands, what it looks at: all of the tank is seen
const folder = process.argv[2] ?? join(root, 'server/page/pictures');
const tank = readFileSync(join(root, 'server/samples/tank.json'), 'utf8');

async function draw(browser, daemon, model, { title, hash, options }) {
  const visit = await Visit.begin(browser, `${daemon.url}/`, { ...options, hash: `${hash}&view=${VIEW}`, deviceScaleFactor: DENSITY });
  await visit.level(2);
  await visit.wait(() => document.querySelectorAll('#legend li').length > 2);
  await visit.wait(() => document.querySelectorAll('.ticks line').length > 0);
  if (hash.includes('surface')) await visit.wait(() => document.querySelector('tr[data-level="8"]'));
  if (hash.includes('animation')) await visit.wait(() => document.querySelector('.chart'));
  await visit.drawn();
  const { parts, canvas, family } = await visit.page.evaluate(drawPage);
  const colours = await visit.page.evaluate(() =>
    Object.fromEntries([...document.querySelectorAll('#legend li')].map((li) => [li.textContent, li.firstChild.style.backgroundColor])));
  for (const name of ['cage', 'points']) await visit.shows(name, false);
  const pixels = await visit.pixels();
  const theme = await visit.page.evaluate(() => document.documentElement.dataset.theme);
  await visit.end();

  const obj = async (level) => (await fetch(`${model}/surface.obj?level=${level}&clip=drive&at=0&normals=none`)).text();
  const creases = JSON.parse(tank).meshes.flatMap((mesh) =>
    (mesh.creases ?? []).map(({ edge, sharpness }) => ({ object: mesh.name, edge, colour: colours[`crease ${sharpness}`] })));
  const { width, height } = canvas;
  const drawing = drawView({ surface: await obj(2), cage: await obj(0), view: VIEW, size: [width, height], pixels, creases,
    few: colours['valence under 4'], many: colours['valence over 4'], edge: theme === 'dark' ? '#e4e9f0' : '#1f2933' });
  const page = options.viewport;
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${page.width}" height="${page.height}" viewBox="0 0 ${page.width} ${page.height}" font-family="${family}">
<title>${title}</title>
<style>text{font-variant-numeric:tabular-nums}</style>
${parts.join('\n').replace('CANVAS', () => `<svg x="${canvas.left}" y="${canvas.top}" width="${width}" height="${height}">${drawing}</svg>`)}
</svg>
`;
}

const daemon = new Daemon(['--sample']);
let browser;
try {
  await daemon.start();
  browser = await launch(IN_SOFTWARE);
  const model = await daemon.upload(tank);
  mkdirSync(folder, { recursive: true });
  for (const picture of PICTURES) writeFileSync(join(folder, `${picture.name}.svg`), await draw(browser, daemon, model, picture));
} finally {
  await browser?.close();
  await daemon.remove();
}
