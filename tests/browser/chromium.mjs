// Starts the browser of a test: Debian's Chromium without the parts round the page, which cost more than the page does.
import { chromium } from 'playwright-core';

// What WebGL draws is laid into the page without the GPU process: to do that there too takes a third more.
export const IN_SOFTWARE = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-gpu-compositing'];
// To smooth the edges of what it draws takes as long again; to prepare shaders for what is never drawn, and to optimise
// scripts of pages that last seconds, takes more than it saves.
const ROUGH = [...IN_SOFTWARE, '--webgl-antialiasing-mode=none',
  '--disable-angle-features=supportsGraphicsPipelineLibrary,warmUpPipelineCacheAtLink', '--js-flags=--no-maglev,--no-opt'];

export const launch = (drawing = ROUGH) =>
  chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium-headless-shell', args: ['--no-sandbox', ...drawing] });

/** Software draws, on processors that other tests use too: a picture may take many times what it takes alone. */
export const PATIENCE_MS = 120000;
