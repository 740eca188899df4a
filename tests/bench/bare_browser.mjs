// Chromium as a person has it: driven by Chrome's protocol alone, of which a page has only the domain Page. What drivers of tests
// switch on besides (stacks of each request, scripts of their own) takes a page a tenth longer.
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

/** Within the page, as text: once its canvas has been drawn and shown, the address says so. */
const TELL = `(${() => {
  new MutationObserver((_, observer) => {
    observer.disconnect();
    requestAnimationFrame(() => history.replaceState(null, '', `#drawn=${performance.now()}`));
  }).observe(document, { subtree: true, attributeFilter: ['data-frames'] });
}})()`;

export class BareBrowser {
  #asked = new Map(); // by the ids of messages
  #heard = new Set(); // functions that get each event

  static async start(args) {
    const browser = new BareBrowser();
    browser.folder = mkdtempSync(join(tmpdir(), 'bare-browser-'));
    browser.process = spawn(process.env.CHROMIUM ?? '/usr/bin/chromium-headless-shell', ['--no-sandbox', '--remote-debugging-pipe',
      '--disable-background-networking', '--disable-component-update', '--force-prefers-reduced-motion', `--user-data-dir=${browser.folder}`, ...args],
    { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
    let rest = '';
    browser.process.stdio[4].setEncoding('utf8').on('data', (text) => {
      const messages = (rest + text).split('\0');
      rest = messages.pop();
      for (const message of messages) browser.#hear(JSON.parse(message));
    });
    await browser.#send('Browser.getVersion');
    return browser;
  }

  #hear({ id, result, error, ...event }) {
    if (id === undefined) return this.#heard.forEach((use) => use(event));
    const { resolve, reject } = this.#asked.get(id);
    this.#asked.delete(id);
    return error ? reject(new Error(error.message)) : resolve(result);
  }

  #send(method, params = {}, sessionId = undefined) {
    const id = (this.last = (this.last ?? 0) + 1);
    this.process.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
    return new Promise((resolve, reject) => this.#asked.set(id, { resolve, reject }));
  }

  /** An empty tab with an empty cache: open(url) resolves with the milliseconds until its canvas was first drawn. */
  async tab({ width, height }) {
    const { browserContextId } = await this.#send('Target.createBrowserContext');
    const { targetId } = await this.#send('Target.createTarget', { url: 'about:blank', browserContextId, width, height });
    const { sessionId } = await this.#send('Target.attachToTarget', { targetId, flatten: true });
    await this.#send('Page.enable', {}, sessionId);
    await this.#send('Page.addScriptToEvaluateOnNewDocument', { source: TELL }, sessionId);
    return { open: (url) => new Promise((resolve, reject) => {
      const use = (event) => {
        const drawn = event.sessionId === sessionId && /#drawn=([\d.]+)/.exec(event.params.url)?.[1];
        if (!drawn) return;
        this.#heard.delete(use);
        resolve(Number(drawn));
      };
      this.#heard.add(use);
      this.#send('Page.navigate', { url }, sessionId).catch(reject);
    }) };
  }

  async close() {
    const ended = new Promise((resolve) => this.process.on('exit', resolve));
    this.#send('Browser.close').catch(() => {});
    await ended;
    rmSync(this.folder, { recursive: true, force: true, maxRetries: 5 });
  }
}
