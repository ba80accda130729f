// The page in a browser: it loads on both backends, shows what the native window shows, and obeys.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { after, test } from 'node:test';
import { pathToFileURL } from 'node:url';

import { colours, crop, difference, nativeWindow, open, PAGE, quit, SIZE } from './harness.mjs';

after(quit);

/** An instant of the first impacts, s: arrows are on show. */
const INSTANT = 0.00785;

/**
 * Largest share of pixels that may differ from the native frame of the same state. Edges and letters lie elsewhere by
 * parts of a pixel on another driver; a missing body or panel is some per cent.
 */
const TOLERANCE = 0.01;

for (const backend of ['webgl', 'webgpu']) {
    test(`${backend}: the page shows the same picture as the native window`, async (t) => {
        const frames = Promise.all([nativeWindow('spcmm', INSTANT), nativeWindow('spcmm', 0.3)]);
        const lab = await open('play=0&theme=light', { backend });
        const { renderer } = await lab.state();
        assert.match(renderer, backend === 'webgl' ? /^gl / : /^webgpu\b/i);
        await lab.runTo(INSTANT);
        await lab.still();
        assert.equal((await lab.state()).shown_s, INSTANT);
        const shown = await lab.pixels();
        assert.ok(colours(shown) > 500, `${colours(shown)} colours: an empty picture?`);
        const [same, later] = await frames;
        const share = difference(shown, same, `window_${backend}`, TOLERANCE);
        t.diagnostic(`${share} of the pixels differ from the native frame`);
        assert.ok(share < TOLERANCE, `${share} of the pixels differ`);
        // The comparison sees a change of the mechanism alone.
        const other = difference(shown, later);
        assert.ok(other > 2 * share, `another instant differs by ${other}, the same by ${share}`);
        await lab.close();
    });

    test(`${backend}: pause, step, reset and the clearance slider`, async () => {
        const lab = await open('', { backend });
        await lab.until(async () => (await lab.state()).time_s > 0, 'time does not pass');
        await lab.click('Button', 'Pause');
        await lab.until(async () => !(await lab.state()).playing, 'it does not pause');
        const paused = await lab.state();
        await lab.frame(10);
        assert.equal((await lab.state()).state_hash, paused.state_hash, 'time stands still');
        await lab.click('Button', 'Step');
        await lab.until(async () => (await lab.state()).steps === paused.steps + 1, 'no step');
        await lab.key('ArrowLeft');
        await lab.until(async () => (await lab.state()).state_hash === paused.state_hash, 'no step back');
        await lab.click('Button', 'Reset');
        await lab.until(async () => (await lab.state()).time_s === 0, 'no reset');
        const start = await lab.state();

        await lab.runTo(0.02);
        const plain = await lab.state();
        await lab.click('Button', 'Reset');
        await lab.until(async () => (await lab.state()).state_hash === start.state_hash, 'a reset is a new start');
        await lab.slide('Clearance', 0.9);
        const changed = (await lab.state()).changed_parameters['contact.clearance'];
        assert.ok(parseFloat(changed) > 0.3, `the slider set ${changed}`);
        await lab.click('Button', 'Reset');
        await lab.runTo(0.02);
        const loose = await lab.state();
        assert.notEqual(loose.state_hash, plain.state_hash);
        // A longer fall through the play: the first impact is harder.
        assert.ok(Math.max(...loose.peak_normal_N) > Math.max(...plain.peak_normal_N));
        await lab.close();
    });
}

test('the timeline goes back to the same bits by key, click and finger', async () => {
    const lab = await open('play=0&theme=light');
    await lab.runTo(0.02);
    const end = await lab.state();
    await lab.key('Home');
    await lab.until(async () => (await lab.state()).shown_s === 0, 'not at the start');
    await lab.key('.');
    await lab.until(async () => (await lab.state()).shown_s > 0.007, 'no impact');
    const impact = await lab.state();
    assert.ok(Math.abs(impact.shown_s - 0.0078) < 1e-4, `the first impact at ${impact.shown_s} s`);
    const place = async (part) => {
        const [x0, y0, x1, y1] = (await lab.find('Slider', 'Timeline, s')).rect;
        return [x0 + part * (x1 - x0), (y0 + y1) / 2];
    };
    const near = (time) => async () => Math.abs((await lab.state()).shown_s - time) <= 1e-4;
    await lab.clickAt(...await place(0.75));
    await lab.until(near(0.015), 'not where the click was');
    // The first touch makes everything larger: where it comes down is another place then.
    await lab.fingers([await place(0.3)]);
    await lab.frame(3);
    await lab.fingers([await place(0.25), await place(0.4), await place(0.5)]);
    await lab.until(near(0.01), 'not where the finger went');
    await lab.key('End');
    await lab.until(async () => (await lab.state()).state_hash === end.state_hash, 'other bits at the end');
    await lab.close();
});

test('a processor that draws runs no branch of the interface that is there for tests', async () => {
    const record = () => {
        globalThis.compiled = [];
        const { shaderSource } = WebGL2RenderingContext.prototype;
        WebGL2RenderingContext.prototype.shaderSource = function (shader, text) {
            globalThis.compiled.push(text);
            return shaderSource.call(this, shader, text);
        };
    };
    const lab = await open('', { backend: 'webgl', before: [record] });
    const texts = await lab.page.evaluate(() => globalThis.compiled);
    // The switch is still called so, and no shader asks for it.
    assert.ok(texts.some((text) => /uint predictable_texture_filtering;/.test(text)), 'another name?');
    assert.ok(!texts.some((text) => /\.predictable_texture_filtering/.test(text)));
    await lab.close();
});

test('what it draws changes while it plays', async () => {
    const lab = await open('theme=light&scale=1:1', { backend: 'webgl' });
    const view = { x: 320, y: 60, width: 460, height: 200 };
    // Two pictures of known phases: a whole period of 2 s apart they would be the same.
    await lab.runTo(0.1);
    const first = crop(await lab.pixels(), view);
    await lab.click('Button', 'Play');
    await lab.until(async () => (await lab.state()).shown_s > 0.5, 'time does not pass');
    await lab.click('Button', 'Pause');
    const { shown_s: shown } = await lab.state();
    assert.ok(shown < 1.8, `paused at ${shown} s`);
    assert.ok(difference(first, crop(await lab.pixels(), view)) > 0.0005);
    await lab.close();
});

test('time passes by the clock on the wall', async () => {
    const lab = await open('', { backend: 'webgl', ownTime: true });
    const { shown_s: before } = await lab.state();
    await lab.until(async () => (await lab.state()).shown_s > before, 'time does not pass');
    await lab.close();
});

test('a hidden tab stands still, and does not catch up', async () => {
    const lab = await open('', { backend: 'webgl' });
    await lab.until(async () => (await lab.state()).time_s > 0, 'time does not pass');
    const hide = (hidden) =>
        lab.page.evaluate((hidden) => {
            Object.defineProperty(document, 'hidden', { configurable: true, get: () => hidden });
            Object.defineProperty(document, 'visibilityState', { configurable: true, get: () => (hidden ? 'hidden' : 'visible') });
            document.dispatchEvent(new Event('visibilitychange'));
        }, hidden);
    await hide(true);
    const before = await lab.state();
    // Ten minutes. A hidden page has no frames: timers of 10 ms drive it, and these come between them.
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
    // At 1:50; of the first frame after the pause a quarter of a second counts at most.
    assert.ok(passed > 0.003 && passed < 0.02 * (0.25 + 5 * 0.05), `${passed} s`);
    await lab.close();
});

test('a frame never steps longer than its share, however far behind the machine is', async () => {
    // A step of 0.1 us: to keep real time, a frame would take half a million. Each costs a twentieth of a millisecond here.
    const lab = await open('solver.method=rk4&solver.step=0.1us', { backend: 'webgl' });
    for (let k = 0; k < 8; k += 1) await lab.key('ArrowUp');
    await lab.page.evaluate(() => (globalThis.drivenTime.look = 0.05));
    const first = await lab.state();
    await lab.frame(20);
    const later = await lab.state();
    assert.equal(later.frames - first.frames, 20, 'it draws all the while');
    // Drawing takes 50 ms here, and stepping gets as long but for the 4.7 ms that a frame of 1/60 s leaves over.
    const steps = (later.steps - first.steps) / 20;
    assert.ok(steps > 890 && steps < 930, `${steps} steps a frame`);
    await lab.find('Button', 'Pause');
    assert.ok((await lab.widgets()).some((widget) => /^reached 1:/.test(widget.label)), 'nothing says how far it keeps up');
    await lab.close();
});

test('an address by hand sets scene and parameters; a bad one says what is wrong beside a running scene', async () => {
    const lab = await open('scene=pendulum&c=0.5mm&play=0', { backend: 'webgl' });
    const state = await lab.state();
    assert.equal(state.scene, 'pendulum');
    assert.equal(state.playing, false);
    assert.deepEqual(Object.keys(state.changed_parameters), ['contact.clearance']);
    await lab.close();
    // What would steer a terminal, or a page, is shown.
    const bad = await open('scene=pendulun%1b', { backend: 'webgl' });
    assert.equal((await bad.state()).scene, 'spcmm');
    await bad.until(async () => (await bad.widgets()).some((w) => w.label.includes('`pendulun\\u001b` (did you mean `pendulum`')), 'no word about it');
    await bad.click('Button', 'Dismiss');
    await bad.until(async () => !(await bad.has('Button', 'Dismiss')), 'it stays');
    await bad.close();
});

test('moved to a screen with other pixels, the picture has those', async () => {
    const [width, height] = [400, 560];
    const lab = await open('play=0', { backend: 'webgl', size: { width, height } });
    const cdp = await lab.context.newCDPSession(lab.page);
    // Not back to 1, which the emulation does without telling the page.
    for (const ratio of [2, 1.5, 3]) {
        await cdp.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: ratio, mobile: false });
        await lab.until(async () => {
            // The browser tells the page with the next frame that somebody sees.
            await cdp.send('Page.captureScreenshot');
            const canvas = await lab.page.evaluate(() => [document.getElementById('laboratory').width, document.getElementById('laboratory').height]);
            return canvas[0] === ratio * width && canvas[1] === ratio * height;
        }, `the canvas does not follow to ${ratio}`);
    }
    await lab.close();
});

test('theme and way to draw are taken from a link in the address bar of the open page, too', async () => {
    const lab = await open('scene=pendulum&play=0&theme=light', { backend: 'webgl' });
    const brightness = async () => {
        const { data } = await lab.pixels({ x: 4, y: 4, width: 4, height: 4 });
        return data[0];
    };
    const light = await brightness();
    await lab.page.evaluate(() => (location.hash = '#scene=pendulum&play=0&theme=dark'));
    await lab.until(async () => (await brightness()) < light / 2, 'the theme has no effect');
    await lab.page.evaluate(() => (location.hash = '#scene=pendulum&c=0.2mm&play=0&renderer=webgpu'));
    await lab.until(() => lab.ask(() => globalThis.jointplay?.backend === 'webgpu'), 'the page does not start anew');
    await lab.started();
    const state = await lab.state();
    assert.match(state.renderer, /^webgpu/i);
    assert.ok(!state.renderer.includes('()'), state.renderer);
    assert.deepEqual(Object.keys(state.changed_parameters), ['contact.clearance']);
    await lab.close();
});

test('where the address asks for WebGPU and there is none, the other way is a click away', async () => {
    const without = () => Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined });
    const lab = await open('renderer=webgpu', { expectTrouble: true, before: without });
    assert.match(await lab.page.locator('#trouble').innerText(), /asks for WebGPU, which this browser does not offer/);
    await Promise.all([lab.page.waitForEvent('load'), lab.page.locator('#plainer').click()]);
    await lab.started();
    assert.match((await lab.state()).renderer, /^gl /);
    await lab.close();
});

test('without WebGPU and WebGL2 a plain page says what is missing', async () => {
    const lab = await open('', {
        expectTrouble: true,
        before: () => {
            Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined });
            const { getContext } = HTMLCanvasElement.prototype;
            HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
                return kind === 'webgl2' ? null : getContext.call(this, kind, ...rest);
            };
        },
    });
    const text = await lab.page.locator('#trouble').innerText();
    assert.match(text, /Something is missing/);
    assert.match(text, /WebGPU or WebGL2/);
    assert.ok(await lab.page.locator('canvas').isHidden());
    await lab.close();
});

test('where WebGPU does not start, WebGL2 takes over', async () => {
    const lab = await open('', {
        before: () => {
            GPUAdapter.prototype.requestDevice = () => Promise.reject(new DOMException('no device', 'OperationError'));
        },
    });
    assert.match((await lab.state()).renderer, /^gl /);
    assert.ok(colours(await lab.pixels()) > 500);
    await lab.close();
});

test('a failed download is told, and can be tried again', async () => {
    const lab = await open('', {
        expectTrouble: true,
        before: () => {
            const { fetch } = globalThis;
            globalThis.fetch = (address, ...rest) => (String(address).includes('.wasm') ? Promise.resolve(new Response('', { status: 503 })) : fetch(address, ...rest));
        },
    });
    const text = await lab.page.locator('#trouble').innerText();
    assert.match(text, /could not be loaded/);
    assert.match(text, /503/);
    assert.ok(await lab.page.locator('#reload').isVisible());
    await lab.close();
});

test('a page whose program does not come at all says so, and why where it was opened as a file', async () => {
    const lab = await open('play=0', { backend: 'webgl' });
    const said = () => lab.page.locator('#stuck').isVisible();
    assert.equal(await said(), false);
    await lab.page.route('**/main.js*', (route) => route.abort());
    await lab.page.reload();
    await lab.until(said, 'nothing is said');
    await lab.page.goto(pathToFileURL(path.join(PAGE, 'index.html')).href);
    await lab.until(said, 'nothing is said');
    assert.match(await lab.page.locator('#stuck').innerText(), /has to be served/);
    await lab.close({ errors: true });
});

test('the policy of the page lets nothing in that is not its own', async () => {
    // That the page itself keeps to it, with worker, clipboard and downloads, each test sees: what is refused is an error on the
    // console.
    const lab = await open('scene=pendulum&play=0', { backend: 'webgl' });
    assert.deepEqual(lab.errors, []);
    const outcome = await lab.page.evaluate(async () => {
        const refused = new Set();
        addEventListener('securitypolicyviolation', ({ effectiveDirective }) => refused.add(effectiveDirective));
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
        await new Promise((done) => setTimeout(done, 50));
        return { refused: [...refused].sort(), ran: globalThis.foreign === true, failed };
    });
    assert.deepEqual(outcome, {
        refused: ['connect-src', 'img-src', 'script-src-attr', 'script-src-elem', 'style-src-attr'],
        ran: false,
        failed: true,
    });
    assert.ok(lab.errors.length >= 5, 'the console says nothing of it');
    // Nor does the mark-up hold anything that a stricter host would refuse.
    const page = fs.readFileSync(path.join(PAGE, 'index.html'), 'utf8');
    assert.doesNotMatch(page, /\son[a-z]+\s*=|\sstyle\s*=|data:|<script(?![^>]*\ssrc=)|<style/i);
    await lab.close({ errors: true });
});

test('loading shows its progress', async () => {
    const lab = await open('play=0', {
        backend: 'webgl',
        before: () => {
            globalThis.stages = [];
            addEventListener('DOMContentLoaded', () => {
                const [bar, stage] = [document.getElementById('progress'), document.getElementById('stage')];
                new MutationObserver(() => globalThis.stages.push([bar.value, stage.textContent])).observe(stage, { childList: true });
            });
            // The program comes in four parts, each when the one before was seen.
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
    const told = [1, 2, 3, 4].map((part) => `Loading: ${((Math.floor((part * bytes) / 4)) / 1e6).toFixed(1)} of ${(bytes / 1e6).toFixed(1)} MB`);
    assert.deepEqual(loading.map(([, text]) => text), told);
    assert.equal(loading.at(-1)[0], 1, 'the bar ends full');
    assert.ok(await lab.page.locator('#notice').isHidden());
    await lab.close();
});

test('a crash leaves a report that names version, scene and renderer', async () => {
    const lab = await open('scene=pendulum&c=0.5mm&play=0', { backend: 'webgl' });
    // A picture of another size needs other buffers, and the graphics give none.
    await lab.page.evaluate(() => (WebGL2RenderingContext.prototype.createRenderbuffer = () => null));
    await lab.page.setViewportSize({ width: SIZE.width, height: SIZE.height + 40 });
    await lab.until(() => lab.page.locator('#trouble').isVisible(), 'nothing is said');
    const report = await lab.page.locator('#report').inputValue();
    for (const part of [/^jointplay \d+\.\d+\.\d+ failed inside: .*renderbuffer/m, /^at \S+\.rs:\d+$/m, /^scene: pendulum$/m, /^changed: contact\.clearance = 0\.5/m, /^renderer: gl /m, /^browser: /m, /^address: http/m]) {
        assert.match(report, part);
    }
    assert.ok(await lab.page.locator('#copy').isVisible());
    assert.ok(await lab.page.locator('#reload').isVisible());
    // This was WebGL2 already: there is nothing plainer to try.
    assert.ok(await lab.page.locator('#plainer').isHidden());
    assert.ok(await lab.page.locator('canvas').isHidden());
    await lab.close({ errors: true });
});

test('the page weighs at most 2.5 MB as a browser downloads it', (t) => {
    const LIMIT = 2_500_000;
    const files = fs.readdirSync(PAGE).filter((file) => !/\.(br|gz)$/.test(file));
    assert.ok(files.includes('jointplay_bg.wasm'));
    const sizes = files.map((file) => [file, fs.statSync(path.join(PAGE, `${file}.br`)).size]);
    for (const [file, size] of sizes) t.diagnostic(`${file}: ${size} bytes with brotli`);
    const sum = sizes.reduce((sum, [, size]) => sum + size, 0);
    t.diagnostic(`together: ${sum} bytes of ${LIMIT}`);
    assert.ok(sum <= LIMIT, `${sum} bytes`);
});
