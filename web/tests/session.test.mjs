// What a user of the page meets beside the picture: links, files, saving, the keyboard, what a screen reader reads, and lost
// graphics.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { after, test } from 'node:test';

import { PNG } from 'pngjs';

import { colours, difference, open, quit, ROOT } from './harness.mjs';
import { holdWorkers } from './inside.mjs';

after(quit);

const backend = 'webgl';
const CLIPBOARD = { permissions: ['clipboard-read', 'clipboard-write'] };

/** Pauses, and gives the state in which it stands. */
async function pause(lab) {
    await lab.key('Space');
    await lab.until(async () => !(await lab.state()).playing, 'it does not pause');
    return lab.state();
}

test('a link reproduces scene, changes, camera and state in another page, and says so', async () => {
    const lab = await open('scene=spcmm&cf=0.2', { backend, context: CLIPBOARD });
    await lab.until(async () => (await lab.state()).time_s > 2e-3, 'time does not pass');
    // Changed while it runs: the log travels.
    await lab.slide('Clearance', 0.8);
    await lab.drag([[560, 150], [600, 170], [640, 200]]);
    await lab.until(async () => (await lab.state()).time_s > 9e-3, 'time does not pass');
    const here = await pause(lab);
    assert.ok(here.changed_parameters['contact.clearance'] && here.changed_parameters['contact.friction']);
    await lab.click('Button', 'Copy link');
    const link = await lab.until(() => lab.page.evaluate(() => navigator.clipboard.readText()), 'nothing on the clipboard');
    const { hash, search } = new URL(link);
    assert.equal(search, '');
    assert.equal(hash, await lab.page.evaluate(() => location.hash), 'the address bar has it, too');
    await lab.close();

    const other = await open('', { backend, fragment: hash.slice(1) });
    await other.says(`State reproduced: hash ${here.state_hash} agrees`);
    const there = await other.state();
    assert.equal(there.state_hash, here.state_hash);
    assert.deepEqual([there.scene, there.steps, there.shown_s, there.playing], [here.scene, here.steps, here.shown_s, false]);
    assert.deepEqual(there.changed_parameters, here.changed_parameters);
    assert.deepEqual(there.camera, here.camera);
    // The page that is open already takes another link, too; one that lies about the state is found out.
    const wrong = hash.replace(/hash=./, (found) => `hash=${found.at(-1) === '0' ? '1' : '0'}`);
    await other.page.evaluate((fragment) => (location.hash = fragment), wrong);
    await other.says('State differs');
    await other.page.evaluate(() => (location.hash = '#scene=pendulum&c=0.5mm&play=0'));
    await other.until(async () => (await other.state()).scene === 'pendulum', 'the link in the address bar has no effect');
    await other.page.evaluate(() => (location.hash = '#scene=pendulun'));
    await other.says('did you mean `pendulum`');
    assert.equal((await other.state()).scene, 'pendulum');
    await other.close();
});

test('where the clipboard is closed, the link is in the address bar', async () => {
    const closed = () => {
        Object.defineProperty(navigator, 'clipboard', { value: { writeText: () => Promise.reject(new Error('no')) } });
        document.execCommand = () => false;
    };
    const lab = await open('scene=pendulum&play=0', { backend, before: closed });
    await lab.click('Button', 'Copy link');
    await lab.until(() => lab.page.evaluate(() => location.hash.includes('scene=pendulum')), 'no link in the address bar');
    await lab.until(async () => /^The link is in the address bar/.test(await lab.summary()), 'nothing says so');
    await lab.close();
});

test('a bad scene file that is dropped says what is wrong and leaves the running scene; a good one opens and travels', async () => {
    const lab = await open('scene=pendulum&play=0', { backend });
    await lab.runTo(0.01);
    const before = await lab.state();
    await lab.drop('bad.toml', '[contact]\nclearance = 3\n');
    await lab.says('bad.toml:2');
    assert.equal((await lab.state()).state_hash, before.state_hash);
    await lab.drop('no-text.toml', '\ud800');
    await lab.says('no-text.toml');
    assert.equal((await lab.state()).state_hash, before.state_hash);

    await lab.drop('film.mp4', '#'.repeat(5 << 20));
    await lab.says('film.mp4: too large for a scene file');
    assert.equal((await lab.state()).state_hash, before.state_hash);
    // One that misses the laboratory does not take its place in the browser.
    const kept = await lab.page.evaluate(() => !document.body.dispatchEvent(new DragEvent('drop', { bubbles: true, cancelable: true })));
    assert.ok(kept, 'the browser would open the file');

    const text = fs.readFileSync(path.join(ROOT, 'assets/scenes/pendulum.toml'), 'utf8');
    const mine = text.replace(/^name = .*$/m, 'name = "mine"').replace(/^title = .*$/m, 'title = "My own pendulum"');
    assert.notEqual(mine, text);
    await lab.drop('mine.toml', mine);
    await lab.until(async () => (await lab.state()).scene === 'mine', 'the file does not open');
    assert.ok(!(await lab.widgets()).some((widget) => widget.label.includes('no-text.toml')), 'the error is gone');
    await lab.runTo(0.02);
    const { state_hash: hash } = await lab.state();
    const link = await lab.page.evaluate(() => globalThis.jointplay.page.link());
    // The same file by the button, changed a little.
    const chosen = lab.page.waitForEvent('filechooser');
    await lab.click('Button', 'Open…');
    const other = { name: 'other.toml', mimeType: 'application/toml', buffer: Buffer.from(mine.replace('"mine"', '"other"')) };
    await (await chosen).setFiles([other]);
    await lab.until(async () => (await lab.state()).scene === 'other', 'the chosen file does not open');
    await lab.close();

    const there = await open('', { backend, fragment: link });
    await there.says(`hash ${hash} agrees`);
    assert.equal((await there.state()).scene, 'mine');
    await there.close();
});

test('picture, record and scene are saved as downloads', async () => {
    const lab = await open('scene=spcmm&c=0.5mm&play=0&theme=light', { backend });
    await lab.runTo(0.009);
    const { state_hash: hash } = await lab.state();
    const save = async (what, count) => {
        const files = new Map();
        lab.page.on('download', async (download) => {
            files.set(download.suggestedFilename(), fs.readFileSync(await download.path()));
        });
        await lab.click('Button', 'Save');
        await lab.click('Button', what);
        await lab.until(() => files.size === count, `${what} is not saved`);
        lab.page.removeAllListeners('download');
        return files;
    };
    const scene = (await save('Scene…', 1)).get('spcmm.toml').toString();
    assert.match(scene, /^clearance = .*0\.5 ?mm/m);

    const record = await save('Record…', 2);
    assert.deepEqual([...record.keys()].sort(), ['spcmm-9.000ms.csv', 'spcmm-9.000ms.csv.meta.json']);
    assert.equal(JSON.parse(record.get('spcmm-9.000ms.csv.meta.json')).state_hash, hash);
    const [header, ...rows] = record.get('spcmm-9.000ms.csv').toString().trimEnd().split('\n');
    assert.match(header, /^t_s,.*S1_normal_N_max/);
    assert.ok(rows.length > 20 && rows.every((row) => row.split(',').length === header.split(',').length));

    const [picture] = (await save('Picture…', 1)).values();
    const { width, height } = PNG.sync.read(picture);
    assert.ok(width > 400 && height > 150, `${width}x${height}`);
    assert.ok(colours(PNG.sync.read(picture)) > 200, 'the picture is empty');
    await lab.close();
});

test('the keyboard works before anything is clicked, and a screen reader is told what goes on', async () => {
    const lab = await open('scene=pendulum', { backend });
    await lab.until(async () => /Running at time scale 1:50/.test(await lab.summary()), 'no summary');
    const first = await lab.summary();
    await lab.until(async () => (await lab.summary()) !== first, 'the summary never changes');
    await pause(lab);
    await lab.until(async () => /Paused at .*S1 /.test(await lab.summary()), 'the summary does not say that it is paused');
    const aloud = lab.page.locator('[aria-live=polite]');
    await lab.until(async () => (await aloud.textContent()) === (await lab.summary()), 'what happens is not read out');
    // Outside of the canvas, and not hidden from a screen reader.
    const tree = await lab.page.locator('body').ariaSnapshot();
    assert.match(tree, /region "What the mechanism is doing"/);
    assert.match(tree, /Paused at/);
    await lab.key('ArrowRight');
    const { time_s: time } = await lab.state();
    assert.ok(time > 0);
    await lab.close();
});

test('a preset is measured in a worker: it says how far it is, can be cancelled, and the page goes on meanwhile', async () => {
    const lab = await open('scene=pendulum&c=0.2mm&play=0', { backend, size: { width: 800, height: 1000 }, before: holdWorkers });
    const progress = async () => (await lab.widgets()).find(({ role }) => role === 'ProgressIndicator');
    const workers = () => lab.page.workers().length;
    await lab.click('Button', 'Measure preset');
    // However soon it is done, no more than this is heard of it until further notice.
    while ((await lab.hear('Progress')).Progress === 0);
    await lab.until(async () => (await progress())?.value > 0, 'no progress');
    assert.equal(workers(), 1);
    await lab.click('Button', 'Play');
    await lab.until(async () => (await lab.state()).time_s > 0, 'the page stands still meanwhile');
    await lab.click('Button', 'Pause');
    await lab.click('Button', 'Cancel');
    await lab.find('Button', 'Measure preset');
    await lab.until(() => workers() === 0, 'the worker goes on');

    const error = async () => {
        // What stands on its right.
        const labels = (await lab.widgets()).filter(({ role }) => role === 'Label');
        const name = labels.find(({ label }) => label === 'Peak force error');
        return labels.find(({ rect }) => Math.abs(rect[1] - name.rect[1]) < 4 && rect[0] > name.rect[2])?.label;
    };
    assert.equal(await error(), 'not measured');
    await lab.click('Button', 'Measure preset');
    await lab.hear('Done');
    await lab.until(async () => /^[\d.e-]+ %$/.test(await error()), 'no number');
    await lab.until(() => workers() === 0, 'the worker stays');
    await lab.close();
});

test('a sweep runs in a worker and draws its points as they come; a click on one runs the scene to it', async () => {
    const lab = await open('spcmm.frequency=5Hz&play=0&theme=light', { backend, size: { width: 1100, height: 900 }, before: holdWorkers });
    await lab.key('b');
    // Out of the way, so that the diagram is in sight.
    await lab.click('DisclosureTriangle', 'Portrait and section');
    await lab.click('DisclosureTriangle', 'Neighbouring motion');
    await lab.click('Button', 'Start sweep');
    for (let point = 0; point < 3; point += 1) await lab.hear('Point');
    await lab.until(async () => (await lab.widgets()).some(({ label }) => /^3 of \d+ values/.test(label)), 'no points are shown');
    assert.equal(lab.page.workers().length, 1);
    await lab.click('Button', 'Cancel sweep');
    await lab.find('Button', 'Start sweep');
    await lab.until(() => lab.page.workers().length === 0, 'the worker goes on');

    const { rect: [left, , , title] } = await lab.find('Label', 'x, mm over clearance, mm');
    const picture = await lab.pixels({ x: left, y: title, width: 1090 - left, height: 230 });
    const points = [];
    for (let at = 0; at < picture.data.length; at += 4) {
        const [red, , blue] = picture.data.subarray(at, at + 3);
        if (blue - red > 120) points.push([(at / 4) % picture.width, Math.floor(at / 4 / picture.width)]);
    }
    assert.ok(points.length >= 4, 'no point is drawn');
    const [x, y] = points[Math.floor(points.length / 2)];
    await lab.clickAt(left + x, title + y);
    const loaded = await lab.until(async () => {
        const state = await lab.state();
        return state.changed_parameters['contact.clearance'] && state.playing && state;
    }, 'a click on a point has no effect');
    // After the ten periods of 0.2 s that are left out.
    assert.ok(loaded.time_s >= 2, `${loaded.time_s} s`);
    await lab.close();
});

/** Takes the graphics away, each backend in its way. */
const LOSE = {
    webgl: () => document.getElementById('laboratory').getContext('webgl2').getExtension('WEBGL_lose_context').loseContext(),
    webgpu: () => globalThis.device.destroy(),
};
/** Keeps hold of the device. */
const HOLD = () => {
    const { requestDevice } = GPUAdapter.prototype;
    GPUAdapter.prototype.requestDevice = async function (...rest) {
        globalThis.device = await requestDevice.apply(this, rest);
        return globalThis.device;
    };
};

for (const kind of ['webgl', 'webgpu']) {
    test(`${kind}: lost graphics come back, and the simulation goes on as it was`, async () => {
        const lab = await open('c=0.5mm&theme=dark&play=0', { backend: kind, before: kind === 'webgpu' ? HOLD : [] });
        await lab.runTo(0.00785);
        await lab.still();
        const [before, picture] = [await lab.state(), await lab.pixels()];
        await lab.page.evaluate(LOSE[kind]);
        await lab.until(() => lab.page.evaluate(() => globalThis.jointplay.losses.length === 1), 'the loss is not seen');
        await lab.started();
        assert.equal(await lab.page.evaluate(() => globalThis.jointplay.trouble), null);
        await lab.still();
        const now = await lab.state();
        assert.equal(now.state_hash, before.state_hash);
        assert.deepEqual([now.steps, now.shown_s, now.camera, now.changed_parameters], [before.steps, before.shown_s, before.camera, before.changed_parameters]);
        const share = difference(await lab.pixels(), picture, `after_loss_${kind}`, 0.01);
        assert.ok(share < 0.01, `${share} of the pixels differ after the loss`);
        await lab.key('Space');
        await lab.until(async () => (await lab.state()).time_s > before.time_s, 'it does not go on');
        await lab.close();
    });
}

test('graphics that do not come back: the page offers to reload into the same state', async () => {
    const lab = await open('scene=pendulum&c=0.5mm', { backend, before: () => {
        const { getContext } = HTMLCanvasElement.prototype;
        HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
            return globalThis.refused && kind === 'webgl2' ? null : getContext.call(this, kind, ...rest);
        };
    } });
    await lab.until(async () => (await lab.state()).time_s > 1e-3, 'time does not pass');
    const before = await pause(lab);
    // In one turn: the page asks for new graphics as soon as it is told.
    await lab.page.evaluate(`(${LOSE.webgl})(); globalThis.refused = true;`);
    const again = lab.page.locator('#again');
    await again.waitFor();
    assert.match(await lab.page.locator('#trouble').innerText(), /The graphics were lost/);
    assert.ok(await lab.page.locator('canvas').isHidden());
    await Promise.all([lab.page.waitForEvent('load'), again.click()]);
    await lab.started();
    await lab.says(`hash ${before.state_hash} agrees`);
    const now = await lab.state();
    assert.deepEqual([now.state_hash, now.playing, now.shown_s], [before.state_hash, false, before.shown_s]);
    await lab.close();
});
