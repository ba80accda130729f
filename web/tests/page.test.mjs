// The page in a browser: it starts, shows the picture of the native window, reacts to input, and explains failures.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { after, test } from 'node:test';
import { pathToFileURL } from 'node:url';

import { blank, colours, difference, nativeWindow, open, PAGE, quit, serve, SIZE } from './harness.mjs';

after(quit);

/** An instant during the first impacts, s, with visible force arrows. */
const INSTANT = 0.00785;

/**
 * Largest share of pixels that may differ from the native frame of the same state. Another driver shifts edges and letters by
 * fractions of a pixel; a missing body or panel changes some per cent.
 */
const TOLERANCE = 0.01;

let frames;
/** Frames of the native program at that instant, and at another one. */
const nativeFrames = () => (frames ??= Promise.all([INSTANT, 0.3].map((seconds) => nativeWindow('spcmm', seconds))));

/** Records the text of every compiled shader. */
function recordShaders() {
    globalThis.compiled = [];
    const { shaderSource } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.shaderSource = function (shader, text) {
        globalThis.compiled.push(text);
        return shaderSource.call(this, shader, text);
    };
}

for (const backend of ['webgl', 'webgpu']) {
    test(`${backend}: the page shows the same picture as the native window`, async (t) => {
        const frames = nativeFrames();
        const lab = await open('scene=spcmm&play=0&theme=light', { backend, picture: true, before: recordShaders });
        const { renderer } = await lab.state();
        assert.match(renderer, backend === 'webgl' ? /^gl / : /^webgpu\b(?!.*\(\))/i);
        const start = await lab.pixels();
        await lab.runTo(INSTANT);
        await lab.settle();
        assert.equal((await lab.state()).shown_s, INSTANT);
        const shown = await lab.pixels();
        assert.ok(colours(shown) > 500, `${colours(shown)} colours: an empty picture?`);
        const [same, later] = await frames;
        const share = difference(shown, same, `window_${backend}`, TOLERANCE);
        t.diagnostic(`${share} of the pixels differ from the native frame`);
        assert.ok(share < TOLERANCE, `${share} of the pixels differ`);
        // The comparison detects a change of the pose, and the picture has followed it.
        for (const [what, other] of Object.entries({ start, later })) {
            const far = difference(shown, other);
            assert.ok(far > 2 * share, `${what} differs by ${far}, the same by ${share}`);
        }
        if (backend === 'webgl') {
            // Software rendering skips a branch that egui needs for its own tests (canvas.js). The switch still has this name, and no
            // shader reads it.
            const texts = await lab.page.evaluate(() => globalThis.compiled);
            assert.ok(texts.some((text) => /uint predictable_texture_filtering;/.test(text)), 'has the switch another name?');
            assert.ok(!texts.some((text) => /\.predictable_texture_filtering/.test(text)));
        }
        await lab.close();
    });
}

test('keys and mouse play, step, reset, move a slider and present, without a first click', async () => {
    const lab = await open('play=1', { backend: 'webgl' });
    await lab.until(async () => (await lab.state()).time_s > 0, 'time does not pass');
    await lab.key('Space');
    const paused = await lab.state();
    assert.equal(paused.playing, false);
    await lab.frame(5);
    assert.equal((await lab.state()).state_hash, paused.state_hash, 'time passes in a pause');
    await lab.click('Button', 'Step');
    assert.equal((await lab.state()).steps, paused.steps + 1);
    await lab.key('ArrowLeft');
    assert.equal((await lab.state()).state_hash, paused.state_hash, 'a step back');

    // F5 must not reload the page.
    await lab.page.evaluate(() => {
        addEventListener('keydown', (event) => (globalThis.isPrevented = event.defaultPrevented), { capture: true });
    });
    await lab.key('F5');
    await lab.find('Button', 'Leave');
    assert.ok(!(await lab.has('Button', 'Save')), 'the panels are still there');
    assert.equal(await lab.page.evaluate(() => globalThis.isPrevented), true, 'the browser reloads the page');
    await lab.key('Escape');
    await lab.find('Button', 'Save');
    assert.equal((await lab.state()).state_hash, paused.state_hash);

    await lab.click('Button', 'Restart');
    const start = await lab.state();
    assert.equal(start.time_s, 0);
    await lab.runTo(0.02);
    const plain = await lab.state();
    await lab.click('Button', 'Restart');
    assert.equal((await lab.state()).state_hash, start.state_hash, 'a reset is a new start');
    await lab.slide('Clearance', 0.9);
    const changed = (await lab.state()).changed_parameters['contact.clearance'];
    assert.ok(parseFloat(changed) > 0.3, `the slider set ${changed}`);
    await lab.click('Button', 'Restart');
    await lab.runTo(0.02);
    const loose = await lab.state();
    assert.notEqual(loose.state_hash, plain.state_hash);
    // More play means a longer fall and a harder first impact.
    assert.ok(Math.max(...loose.peak_normal_N) > Math.max(...plain.peak_normal_N));
    await lab.close();
});

test('a first visit opens on one ball, and a later one on the machine', async () => {
    const first = await open('', { backend: 'webgl' });
    await first.find('Button', 'The whole machine');
    assert.ok(!(await first.has('Button', 'Save')), 'the panels are there');
    assert.ok(await first.page.evaluate(() => localStorage.getItem('jointplay visited')));
    await first.key('Escape');
    await first.find('Button', 'Save');
    await first.close();
    const later = await open('', { backend: 'webgl', before: [() => localStorage.setItem('jointplay visited', '1')] });
    await later.find('Button', 'Save');
    assert.ok(!(await later.has('Button', 'The whole machine')), 'the visit is repeated');
    await later.close();
    // Without storage it is shown.
    const withheld = () => Object.defineProperty(globalThis, 'localStorage', { get: () => { throw new Error('withheld'); } });
    const strange = await open('', { backend: 'webgl', before: [withheld] });
    await strange.find('Button', 'The whole machine');
    await strange.close();
});

test('loading shows its progress, and then time follows the clock', async () => {
    const lab = await open('', {
        backend: 'webgl',
        ownTime: true,
        before: () => {
            globalThis.stages = [];
            addEventListener('DOMContentLoaded', () => {
                const [bar, stage] = [document.getElementById('progress'), document.getElementById('stage')];
                new MutationObserver(() => globalThis.stages.push([bar.value, stage.textContent])).observe(stage, { childList: true });
            });
            // The program arrives in four parts, each after the progress of the previous one is shown.
            const { fetch } = globalThis;
            globalThis.fetch = async (address, ...rest) => {
                const response = await fetch(address, ...rest);
                if (!String(address).includes('.wasm')) return response;
                const code = new Uint8Array(await response.arrayBuffer());
                let part = 0;
                const parts = new ReadableStream({
                    async pull(into) {
                        await new Promise((done) => setTimeout(done));
                        into.enqueue(code.slice((part * code.length) / 4, ((part + 1) * code.length) / 4));
                        part += 1;
                        if (part === 4) into.close();
                    },
                });
                return new Response(parts);
            };
        },
    });
    const stages = await lab.page.evaluate(() => globalThis.stages);
    const loading = stages.filter(([, text]) => /^Loading: .* of .* MB$/.test(text));
    const bytes = fs.statSync(path.join(PAGE, 'jointplay_bg.wasm')).size;
    const expected = [1, 2, 3, 4].map((part) => `Loading: ${((Math.floor((part * bytes) / 4)) / 1e6).toFixed(1)} of ${(bytes / 1e6).toFixed(1)} MB`);
    assert.deepEqual(loading.map(([, text]) => text), expected);
    assert.equal(loading.at(-1)[0], 1, 'the bar ends full');
    assert.ok(await lab.page.locator('#notice').isHidden());
    const { shown_s: before } = await lab.state();
    await lab.until(async () => (await lab.state()).shown_s > before, 'time does not pass');
    await lab.close();
});

test('a hidden tab pauses, and does not catch up', async () => {
    const lab = await open('scene=spcmm', { backend: 'webgl' });
    await lab.until(async () => (await lab.state()).time_s > 0, 'time does not pass');
    const hide = (hidden) =>
        lab.page.evaluate((hidden) => {
            Object.defineProperty(document, 'hidden', { configurable: true, get: () => hidden });
            Object.defineProperty(document, 'visibilityState', { configurable: true, get: () => (hidden ? 'hidden' : 'visible') });
            document.dispatchEvent(new Event('visibilitychange'));
        }, hidden);
    await hide(true);
    const before = await lab.state();
    // Ten minutes. A hidden page has no frames; eframe drives it by timers of 10 ms, which fire in between.
    await lab.page.evaluate(async () => {
        for (let k = 0; k < 20; k += 1) {
            globalThis.drivenTime.now += 30_000;
            await new Promise((done) => setTimeout(done, 10));
        }
    });
    assert.equal((await lab.state()).state_hash, before.state_hash, 'time passes in a hidden tab');
    await hide(false);
    await lab.frame(5);
    const passed = (await lab.state()).shown_s - before.shown_s;
    // The time scale is 1:50; the first frame after the pause counts for at most a quarter of a second.
    assert.ok(passed > 0.003 && passed < 0.02 * (0.25 + 5 * 0.05), `${passed} s`);
    await lab.close();
});

/** Withholds the renderers named in the tab's `withheld`; by default, the device of a WebGPU adapter that claims hardware. */
function withhold() {
    const withheld = sessionStorage.getItem('withheld');
    if (!withheld) {
        Object.defineProperty(GPUAdapterInfo.prototype, 'isFallbackAdapter', { get: () => false });
        GPUAdapter.prototype.requestDevice = () => {
            globalThis.refused = true;
            return Promise.reject(new DOMException('no device', 'OperationError'));
        };
        return;
    }
    Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined });
    if (withheld === 'webgpu') return;
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
        return kind === 'webgl2' ? null : getContext.call(this, kind, ...rest);
    };
}

test('WebGL2 draws where WebGPU fails or is missing; without both, a message explains it', async () => {
    const lab = await open('scene=pendulum&c=0.5mm&play=0', { before: withhold });
    assert.equal(await lab.page.evaluate(() => globalThis.refused), true, 'no device was requested');
    assert.match((await lab.state()).renderer, /^gl /);
    const trouble = () => lab.page.locator('#trouble');
    const withheld = (what) => lab.page.evaluate((what) => sessionStorage.setItem('withheld', what), what);

    // A link in the address bar that requests another renderer reloads the page.
    await withheld('webgpu');
    await lab.page.evaluate(() => (location.hash = '#scene=pendulum&c=0.2mm&play=0&renderer=webgpu'));
    await lab.until(() => lab.evaluate(() => Boolean(globalThis.jointplay?.trouble)), 'the page does not reload');
    assert.match(await trouble().innerText(), /asks for WebGPU, which this browser does not offer/);
    await Promise.all([lab.page.waitForEvent('load'), lab.page.locator('#plainer').click()]);
    await lab.started();
    const state = await lab.state();
    assert.match(state.renderer, /^gl /);
    assert.equal(state.changed_parameters['contact.clearance'], '0.2mm');
    assert.match(await lab.page.evaluate(() => location.search), /renderer=webgl/);

    await withheld('both');
    await lab.page.goto(await serve());
    await lab.started();
    const text = await trouble().innerText();
    assert.match(text, /Something is missing/);
    assert.match(text, /WebGPU or WebGL2/);
    assert.ok(await lab.page.locator('canvas').isHidden());
    await lab.close();
});

test('a failed download is explained, and so is a page opened as a file', async () => {
    const lab = await blank();
    await lab.page.route('**/*.wasm*', (route) => route.fulfill({ status: 503 }));
    await lab.page.goto(await serve());
    await lab.started();
    const text = await lab.page.locator('#trouble').innerText();
    assert.match(text, /could not be loaded/);
    assert.match(text, /503/);
    // The user can try again; this time even the script is missing.
    const stuck = lab.page.locator('#stuck');
    assert.ok(await stuck.isHidden());
    await lab.page.route('**/main.js*', (route) => route.abort());
    await lab.page.locator('#reload').click();
    await stuck.waitFor();
    await lab.page.goto(pathToFileURL(path.join(PAGE, 'index.html')).href);
    await stuck.waitFor();
    assert.match(await stuck.innerText(), /has to be served/);
    await lab.close({ errors: true });
});

test('the policy of the page blocks everything foreign', async () => {
    // Every test checks that the page itself complies, with worker, clipboard and downloads: a violation is an error on the console.
    const lab = await open('', { before: [() => sessionStorage.setItem('withheld', 'both'), withhold], expectTrouble: true });
    assert.deepEqual(lab.errors, []);
    const outcome = await lab.page.evaluate(async () => {
        const refused = new Set();
        const all = new Promise((done) => {
            addEventListener('securitypolicyviolation', ({ effectiveDirective }) => refused.add(effectiveDirective).size === 5 && done());
            setTimeout(done, 10_000);
        });
        const inline = document.createElement('script');
        inline.textContent = 'globalThis.foreign = true';
        const foreign = document.createElement('script');
        foreign.src = 'https://example.org/script.js';
        const button = document.createElement('button');
        button.setAttribute('onclick', 'globalThis.foreign = true');
        button.setAttribute('style', 'color: red');
        const picture = document.createElement('img');
        picture.src = 'data:,';
        document.body.append(inline, foreign, button, picture);
        button.click();
        const failed = await fetch('https://example.org/').then(() => false, () => true);
        await all;
        return { refused: [...refused].sort(), ran: globalThis.foreign === true, failed };
    });
    assert.deepEqual(outcome, {
        refused: ['connect-src', 'img-src', 'script-src-attr', 'script-src-elem', 'style-src-attr'],
        ran: false,
        failed: true,
    });
    assert.ok(lab.errors.length >= 5, 'the console does not report it');
    // The mark-up contains nothing that a stricter host would block.
    const page = fs.readFileSync(path.join(PAGE, 'index.html'), 'utf8');
    assert.doesNotMatch(page, /\son[a-z]+\s*=|\sstyle\s*=|data:|<script(?![^>]*\ssrc=)|<style/i);
    await lab.close({ errors: true });
});

test('a crash leaves a report that names version, scene and renderer', async () => {
    const lab = await open('scene=pendulum&c=0.5mm&play=0', { backend: 'webgl' });
    // Another size of the picture needs new buffers, whose creation fails.
    await lab.page.evaluate(() => (WebGL2RenderingContext.prototype.createRenderbuffer = () => null));
    await lab.page.setViewportSize({ width: SIZE.width, height: SIZE.height + 40 });
    await lab.until(() => lab.page.locator('#trouble').isVisible(), 'no message');
    const report = await lab.page.locator('#report').inputValue();
    for (const part of [/^internal error in jointplay \d+\.\d+\.\d+: .*renderbuffer/m, /^at \S+\.rs:\d+$/m, /^scene: pendulum$/m, /^changed: contact\.clearance = 0\.5/m, /^renderer: gl /m, /^browser: /m, /^address: http/m]) {
        assert.match(report, part);
    }
    assert.ok(await lab.page.locator('#copy').isVisible());
    assert.ok(await lab.page.locator('#reload').isVisible());
    // WebGL2 was already in use; no other renderer is offered.
    assert.ok(await lab.page.locator('#plainer').isHidden());
    assert.ok(await lab.page.locator('canvas').isHidden());
    await lab.close({ errors: true });
});
