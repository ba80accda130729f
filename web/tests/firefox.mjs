// Firefox for the tests of `npm run test:full`: `open(query, { empty: emptyFirefox })`, where `lab.page` is a page of Puppeteer.
//
// Environment: `FIREFOX`, the browser.

import { spawn } from 'node:child_process';

import puppeteer from 'puppeteer-core';

import { TIMEOUT } from './harness.mjs';

/** The browser and its screen. */
let firefox;

/** Starts Firefox on a virtual screen, without which it has no WebGL2, and with Puppeteer: Playwright drives only its own build. */
async function launch() {
    if (firefox) return firefox.browser;
    const screen = spawn('Xvfb', ['-displayfd', '1', '-screen', '0', '1280x1024x24'], { stdio: ['ignore', 'pipe', 'ignore'] });
    const display = await new Promise((found, failed) => {
        screen.once('error', failed);
        screen.once('exit', (code) => failed(new Error(`Xvfb ended with ${code}`)));
        screen.stdout.once('data', (text) => found(`:${String(text).trim()}`));
    });
    const browser = await puppeteer.launch({
        browser: 'firefox',
        executablePath: process.env.FIREFOX ?? '/usr/bin/firefox-esr',
        headless: false,
        env: { ...process.env, DISPLAY: display, LIBGL_ALWAYS_SOFTWARE: '1', MOZ_CRASHREPORTER_DISABLE: '1' },
        extraPrefsFirefox: { 'webgl.force-enabled': true },
        protocolTimeout: 2 * TIMEOUT,
    });
    firefox = { browser, screen };
    return browser;
}

/** An empty page of Firefox. */
export async function emptyFirefox(size) {
    const context = await (await launch()).createBrowserContext();
    const page = await context.newPage();
    await page.setViewport(size);
    return { context, page, first: (script) => page.evaluateOnNewDocument(script), end: () => context.close() };
}

/** Ends the browser and its screen. To be called after the last test. */
export async function quitFirefox() {
    await firefox?.browser.close();
    firefox?.screen.removeAllListeners('exit');
    firefox?.screen.kill();
    firefox = undefined;
}
