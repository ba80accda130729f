// Opens the page in a real browser and drives it by the role and label of its controls, as a user would.
//
//     const lab = await open('scene=pendulum&play=0', { backend: 'webgl' });
//     await lab.click('Button', 'Step');
//     assert.equal((await lab.state()).steps, 1);
//     await lab.close();        // fails the test if the console has errors
//
// Time on an open page advances only with the frames that a gesture or a wait of the test requests, 50 ms each (inside.mjs), so that
// a slow machine misses nothing.
//
// Environment: `PAGE`, folder of the page; `NATIVE`, the native program; `TOOL`, the server of the page; `CHROMIUM`, the browser.
// Firefox is in firefox.mjs.

import assert from 'node:assert/strict';
import { spawn, execFile } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { promisify } from 'node:util';

import pixelmatch from 'pixelmatch';
import { chromium } from 'playwright-core';
import { PNG } from 'pngjs';

import { driveTime, drawNothing } from './inside.mjs';

export const ROOT = fileURLToPath(new URL('../../', import.meta.url));
export const PAGE = path.resolve(process.env.PAGE ?? path.join(ROOT, 'target/page'));
const NATIVE = process.env.NATIVE ?? path.join(ROOT, 'target/debug/jointplay');
const TOOL = process.env.TOOL ?? path.join(ROOT, 'target/tools/debug/jointplay-web');
/** Folder for pictures of failed tests. */
const FAILED = path.join(ROOT, 'web/failed');

/** A host name of this machine that the page takes for a public address. */
export const ELSEWHERE = 'laboratory.example';

// One set for both backends. Without the Vulkan flags WebGPU starts and draws nothing.
const FLAGS = [
    '--no-sandbox',
    '--enable-unsafe-webgpu',
    '--enable-features=Vulkan',
    '--use-vulkan=swiftshader',
    '--use-angle=swiftshader',
    '--disable-quic',
    '--no-first-run',
    '--disable-background-networking',
    '--disable-component-update',
    '--disable-sync',
    `--host-resolver-rules=MAP ${ELSEWHERE} 127.0.0.1`,
    '--no-proxy-server',
    // Optimising code that runs only briefly costs more time than it saves.
    `--js-flags=${process.env.JS_FLAGS ?? '--wasm-tiering-budget=500000000'}`,
];

/** The smallest window with its panels side by side: software rendering draws some hundred thousand pixels a second. */
export const SIZE = { width: 760, height: 480 };

/** A wait fails after this time, ms, and at least so many attempts: on a busy machine the attempts decide. */
export const TIMEOUT = 300_000;
const MIN_ATTEMPTS = 100;

let server;
let browser;
/** The page that opens all others. */
let opener;
/** Open pages: one that a failed test left open would slow down the next test. */
const opened = new Set();

/** Serves `folder`; `rest`: port, host. Returns its first output, its address, its process, and a function that ends it. */
export function serveFolder(folder, ...rest) {
    return serveBy(TOOL, ['serve', folder, ...rest.map(String)]);
}

/** As `serveFolder`, where the system lets the server open only `count` files. */
export function serveWithFiles(count, folder) {
    return serveBy('sh', ['-c', `ulimit -n ${count} && exec "$0" serve "$1"`, TOOL, folder]);
}

async function serveBy(program, given) {
    const child = spawn(program, given, { stdio: ['ignore', 'pipe', 'inherit'] });
    const output = await new Promise((found, failed) => {
        child.once('error', failed);
        child.once('exit', (code) => failed(new Error(`${TOOL} ended with ${code}`)));
        child.stdout.once('data', (text) => found(String(text)));
    });
    child.removeAllListeners('exit');
    const ended = new Promise((done) => child.once('exit', done));
    const end = () => {
        child.kill();
        return ended;
    };
    return { output, address: output.split('\n')[0], pid: child.pid, end };
}

/** Serves the page below a sub-path; returns the address of its folder. */
export async function serve() {
    if (!server) {
        const { address, end } = await serveFolder(path.dirname(PAGE));
        server = { end, address: `${address}${path.basename(PAGE)}/` };
    }
    return server.address;
}

async function launch() {
    const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
    browser ??= await chromium.launch({ executablePath, headless: true, args: FLAGS });
    return browser;
}

/** Ends browser and server. To be called after the last test of all files that run together. */
export async function quit() {
    await browser?.close();
    await server?.end();
    browser = opener = server = undefined;
}

/**
 * An empty page of Chromium: {context, page, first, end}, where `first` adds a script that runs before all others. Pages without a
 * context of their own are opened by one page, so that they share a process, which compiles the program once.
 */
async function emptyPage(size, options) {
    const started = await launch();
    let [context, page] = [opener?.context()];
    if (options) {
        context = await started.newContext({ viewport: size, serviceWorkers: 'block', ...options });
        page = await context.newPage();
    } else {
        if (!opener) {
            context = await started.newContext({ serviceWorkers: 'block', permissions: ['clipboard-read', 'clipboard-write'] });
            opener = await context.newPage();
            await opener.goto(`${await serve()}icon.svg`);
        }
        [page] = await Promise.all([opener.waitForEvent('popup'), opener.evaluate(() => void globalThis.open('about:blank'))]);
        await page.setViewportSize(size);
    }
    return { context, page, first: (script) => page.addInitScript(script), end: () => (options ? context : page).close() };
}

/** A page under test that has loaded nothing yet; options as for `open`. */
export async function blank({ size = SIZE, before = [], context, ownTime = false, picture = false, empty = emptyPage } = {}) {
    for (const lab of opened) await lab.close({ errors: true });
    const { first, ...own } = await empty(size, context);
    const lab = new Lab(own);
    opened.add(lab);
    // For Playwright's own waits.
    lab.page.setDefaultTimeout(2 * TIMEOUT);
    for (const script of [ownTime ? [] : driveTime, picture ? [] : drawNothing, before].flat()) await first(script);
    return lab;
}

/**
 * Opens the page. `query`: what follows `?`. Options: `backend` 'webgl' or 'webgpu' (appended to the query), `size`
 * {width, height}, `fragment` (what follows `#`), `before` (functions that run in the page before its scripts),
 * `context` (options of a Playwright context, e.g. {hasTouch: true}), `expectTrouble` (do not wait for a picture),
 * `picture` (draw it), `ownTime` (time follows the clock, as for a user), `empty` (opens an empty page of another browser,
 * firefox.mjs), `at` (the address of a page that the test itself serves).
 */
export async function open(query = '', options = {}) {
    const { backend, fragment = '', expectTrouble = false } = options;
    const address = options.at ?? (await serve());
    const lab = await blank(options);
    const parts = [query, backend ? `renderer=${backend}` : ''].filter(Boolean).join('&');
    await lab.page.goto(`${address}${parts ? `?${parts}` : ''}${fragment ? `#${fragment}` : ''}`);
    await lab.started();
    if (!expectTrouble) {
        const trouble = await lab.evaluate(() => globalThis.jointplay.trouble);
        assert.equal(trouble, null, `the page did not start: ${JSON.stringify(trouble)}`);
    }
    return lab;
}

/** A page under test. */
export class Lab {
    constructor({ context, page, end }) {
        this.context = context;
        this.end = end;
        /** The Playwright page. */
        this.page = page;
        /** Errors on the console. */
        this.errors = [];
        page.on('console', (message) => message.type() === 'error' && this.errors.push(message.text()));
        page.on('pageerror', (error) => this.errors.push(String(error)));
    }

    /** Closes the page. Errors on its console fail the test unless `errors` expects them. */
    async close({ errors = false } = {}) {
        opened.delete(this);
        await this.end();
        if (!errors) assert.deepEqual(this.errors, [], 'errors on the console');
    }

    /** Runs a function in the page and returns its result; `undefined` while another page replaces it. */
    async evaluate(call, argument) {
        try {
            return await this.page.evaluate(call, argument);
        } catch (error) {
            if (/context was destroyed|navigation/.test(error.message)) return undefined;
            throw error;
        }
    }

    /** Waits until the laboratory, or the reason why it cannot run, is visible. Time stands still from then on. */
    async started() {
        await this.until(async () => {
            await this.evaluate(() => globalThis.drivenTime?.free());
            return this.evaluate(() => globalThis.jointplay?.ready || globalThis.jointplay?.trouble);
        }, 'the page does not start');
        await this.evaluate(() => globalThis.drivenTime && (globalThis.drivenTime.held = true));
    }

    /** Draws `count` frames; time advances with them. */
    async frame(count = 1) {
        await this.evaluate(async (count) => {
            if (globalThis.drivenTime) return globalThis.drivenTime.step(count);
            for (; count > 0; count -= 1) await new Promise(requestAnimationFrame);
        }, count);
    }

    /** State of the laboratory: `state` in src/web/page.rs. */
    async state() {
        return JSON.parse(await this.page.evaluate(() => globalThis.jointplay.page.state()));
    }

    /** Visible controls and texts: [{role, label, text, value, on, disabled, rect}], see src/web/mirror.rs. */
    async widgets() {
        return JSON.parse((await this.page.evaluate(() => globalThis.jointplay.page.widgets())) || '[]');
    }

    /** The control of this role and label; waits for it. */
    async find(role, label) {
        let widgets = [];
        const found = await this.until(async () => {
            widgets = await this.widgets();
            return widgets.find((widget) => widget.role === role && widget.label === label);
        }, () => `no ${role} "${label}" among ${widgets.map((w) => `${w.role} "${w.label}"`).join(', ')}`);
        return found;
    }

    /** Whether such a control is visible now. */
    async has(role, label) {
        return (await this.widgets()).some((widget) => widget.role === role && widget.label === label);
    }

    /** Clicks the middle of a control. */
    async click(role, label) {
        await this.frame();
        await this.clickAt(...middle(await this.find(role, label)));
    }

    /** Clicks a point. */
    async clickAt(x, y) {
        await this.drag([[x, y]]);
    }

    /** Drags with the left button along `points` [[x, y], …], with at least one frame between two of them. */
    async drag(points) {
        const [first, ...rest] = points;
        const { mouse } = this.page;
        await mouse.move(...first);
        await this.frame();
        await mouse.down();
        await this.frame();
        for (const point of rest) {
            await mouse.move(...point);
            await this.frame();
        }
        await mouse.up();
        // The first frame handles the release, the second shows its consequences.
        await this.frame(2);
    }

    /** An element of the updated mirror, by its accessible role and name. */
    async element(role, name) {
        await this.frame(2);
        const found = this.page.getByRole(role, { name, exact: true });
        await this.until(async () => {
            await this.page.evaluate(() => globalThis.jointplay.mirror.follow());
            return (await found.count()) > 0;
        }, `no ${role} "${name}"`);
        return found.first();
    }

    /** Activates an element without pointer or keyboard, even out of sight. */
    async activate(role, name) {
        await (await this.element(role, name)).evaluate((element) => element.click());
        await this.frame(2);
    }

    /** Adjusts a field likewise: sets `value`, or moves it by `steps` steps. */
    async adjust(role, name, { value, steps }) {
        await (await this.element(role, name)).evaluate((element, [value, steps]) => {
            if (steps) element.stepUp(steps);
            else element.value = value;
            element.dispatchEvent(new Event('input', { bubbles: true }));
        }, [value, steps]);
        await this.frame(2);
    }

    /** Drags a slider to `part` (0 left, 1 right end) of its travel. */
    async slide(label, part) {
        const { rect } = await this.find('Slider', label);
        const [x0, y0, x1, y1] = rect;
        const [y, from] = [(y0 + y1) / 2, (x0 + x1) / 2];
        const to = x0 + part * (x1 - x0);
        await this.drag([[from, y], [(from + to) / 2, y], [to, y]]);
    }

    /**
     * Fingers on the screen, one for each of `paths` [[x, y], …], all of one length. They touch down one after the other, move
     * together, and are lifted. A function as the last argument is called before they are lifted.
     */
    async fingers(...paths) {
        const beforeLift = typeof paths.at(-1) === 'function' ? paths.pop() : () => {};
        const cdp = await this.context.newCDPSession(this.page);
        const send = async (type, touchPoints) => {
            await cdp.send('Input.dispatchTouchEvent', { type, touchPoints });
            await this.frame();
        };
        const at = (step, count = paths.length) => paths.slice(0, count).map((path, id) => ({ x: path[step][0], y: path[step][1], id }));
        for (let count = 1; count <= paths.length; count += 1) {
            await send('touchStart', at(0, count));
        }
        for (let step = 1; step < paths[0].length; step += 1) {
            await send('touchMove', at(step));
        }
        await beforeLift();
        await send('touchEnd', []);
        await cdp.detach();
        await this.frame();
    }

    /** Taps a control with a finger. */
    async tap(role, label) {
        await this.frame();
        await this.fingers([middle(await this.find(role, label))]);
    }

    /** Drops a file on the laboratory. */
    async drop(name, text) {
        await this.page.evaluate(([name, text]) => {
            const dataTransfer = new DataTransfer();
            dataTransfer.items.add(new File([text], name));
            const canvas = document.getElementById('laboratory');
            for (const kind of ['dragover', 'drop']) {
                canvas.dispatchEvent(new DragEvent(kind, { dataTransfer, bubbles: true, cancelable: true }));
            }
        }, [name, text]);
        await this.frame();
    }

    /** The summary for screen readers. */
    async summary() {
        return this.page.locator('#summary').textContent();
    }

    /** The widget whose text contains `words`; waits for it. */
    async findText(words) {
        let widgets = [];
        return this.until(async () => {
            widgets = await this.widgets();
            return widgets.find(({ label, text }) => label?.includes(words) || text?.includes(words));
        }, () => `no text "${words}": ${widgets.map((w) => w.label).join(' | ')}`);
    }

    /** Presses a key, by its name in Playwright. */
    async key(name) {
        await this.page.keyboard.down(name);
        await this.frame();
        await this.page.keyboard.up(name);
        await this.frame();
    }

    /** Pauses, and runs to `seconds`. */
    async runTo(seconds) {
        await this.page.evaluate((time) => globalThis.jointplay.page.runTo(time), seconds);
        await this.frame();
    }

    /** Frames drawn so far. */
    frames() {
        return this.page.evaluate(() => globalThis.jointplay.page.frames());
    }

    /** Waits until the page has drawn no new picture for three quarters of a second. */
    async settle() {
        await this.until(async () => {
            const before = await this.frames();
            await this.frame(15);
            return (await this.frames()) === before;
        }, 'the page does not come to rest');
    }

    /**
     * Waits until `test` returns something true, and returns it. Draws a frame after each attempt. `message`: a text, or a function
     * that returns one.
     */
    async until(test, message) {
        const end = Date.now() + TIMEOUT;
        for (let attempts = 1; ; attempts += 1) {
            const result = await test();
            if (result) return result;
            if (Date.now() > end && attempts > MIN_ATTEMPTS) assert.fail(typeof message === 'function' ? message() : message);
            await this.frame();
        }
    }

    /** Delivers the messages of workers up to the next one of this kind, which is awaited and returned. Needs `holdWorkers`. */
    async nextMessage(kind) {
        let timer;
        // The duration of a computation depends on the machine.
        const late = new Promise((_, failed) => {
            timer = setTimeout(() => failed(new Error(`no message ${kind} of the worker`)), 2 * TIMEOUT);
        });
        const delivered = this.page.evaluate((kind) => globalThis.heldPost.deliver(kind), kind);
        return Promise.race([delivered, late]).finally(() => clearTimeout(timer));
    }

    /** Enables drawing from here on. */
    async draw() {
        await this.page.evaluate(() => (globalThis.drawsNothing = false));
        // The page redraws only after a change, such as a moved pointer.
        await this.page.mouse.move(1, 1);
        await this.frame();
        await this.page.mouse.move(2, 2);
        await this.frame();
    }

    /** The screen as a pngjs picture. `clip`: {x, y, width, height}. */
    async pixels(clip) {
        assert.ok(!(await this.page.evaluate(() => globalThis.drawsNothing)), 'opened without a picture');
        return PNG.sync.read(await this.page.screenshot({ clip }));
    }
}

function middle({ rect: [x0, y0, x1, y1] }) {
    return [(x0 + x1) / 2, (y0 + y1) / 2];
}

/** Number of different colours: an empty picture has few. */
export function colours(picture) {
    const seen = new Set();
    for (let at = 0; at < picture.data.length; at += 4) seen.add(picture.data.readUInt32LE(at));
    return seen.size;
}

/** Share of the pixels that differ visibly. If it is above `limit`, both pictures and their difference are saved under `name`. */
export function difference(a, b, name, limit) {
    assert.deepEqual([a.width, a.height], [b.width, b.height]);
    const out = new PNG({ width: a.width, height: a.height });
    const share = pixelmatch(a.data, b.data, out.data, a.width, a.height, { threshold: 0.15 }) / (a.width * a.height);
    if (name && share > limit) {
        fs.mkdirSync(FAILED, { recursive: true });
        for (const [kind, picture] of Object.entries({ page: a, native: b, difference: out })) {
            fs.writeFileSync(path.join(FAILED, `${name}.${kind}.png`), PNG.sync.write(picture));
        }
    }
    return share;
}

const run = promisify(execFile);

/** Standard output of the native program. */
export async function native(...args) {
    const { stdout } = await run(NATIVE, args, { maxBuffer: 1 << 26 });
    return stdout;
}

/** The whole window at `seconds`, drawn by the native program. */
export async function nativeWindow(scene, seconds, { width, height } = SIZE, theme = 'light') {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'jointplay-frame-'));
    try {
        const size = `${width}x${height}`;
        await native('render', scene, '--ui', '--at', `${seconds}s`, '--size', size, '--theme', theme, '--out', folder, '--force', '--quiet');
        return PNG.sync.read(fs.readFileSync(path.join(folder, 'frame_00000.png')));
    } finally {
        fs.rmSync(folder, { recursive: true, force: true });
    }
}
