// Starts the browser of a test: Debian's Chromium without the parts round the page, which cost more than the page does.
import { chromium } from 'playwright-core';

const IN_SOFTWARE = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader'];

export const launch = (drawing = IN_SOFTWARE) =>
  chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium-headless-shell', args: ['--no-sandbox', ...drawing] });
