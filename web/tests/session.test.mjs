// What a user of the page meets beside the picture: links, files, saving, the keyboard, what a screen reader reads, and lost
// graphics.

import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
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
    // Which follows what is shown, and then names the renderer that the query asks for.
    const bar = await lab.page.evaluate(() => location.hash);
    assert.equal(bar.replace(/&renderer=webgl$/, ''), hash, 'the address bar has it, too');
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
    // The address of the state may be written between a link and the event that tells of it.
    await other.page.evaluate(() => {
        const { href } = location;
        location.hash = '#scene=slider-crank&play=0';
        history.replaceState(null, '', href);
    });
    await other.until(async () => (await other.state()).scene === 'slider-crank', 'a link is lost to the address of the state');
    await other.page.evaluate(() => (location.hash = '#scene=pendulun'));
    await other.says('did you mean `pendulum`');
    assert.equal((await other.state()).scene, 'slider-crank');
    await other.close();
});

test('the address follows what is shown, and loading the page anew goes on from there', async () => {
    const lab = await open('scene=spcmm&c=0.5mm&theme=dark', { backend });
    await lab.until(async () => (await lab.state()).time_s > 2e-3, 'time does not pass');
    await lab.slide('Friction coefficient', 0.5);
    await lab.until(async () => (await lab.state()).time_s > 4e-3, 'time does not pass');
    const { state_hash: hash, changed_parameters: changed } = await pause(lab);
    assert.ok(changed['contact.friction']);
    await lab.until(() => lab.page.evaluate((hash) => location.hash.includes(`hash=${hash}`) && location.hash.includes('play=0'), hash), 'the address does not follow');
    const entries = await lab.page.evaluate(() => history.length);
    await lab.page.reload();
    await lab.started();
    await lab.says(`State reproduced: hash ${hash} agrees`);
    const now = await lab.state();
    assert.deepEqual([now.state_hash, now.playing, now.changed_parameters], [hash, false, changed]);
    assert.equal(await lab.page.evaluate(() => history.length), entries, 'every state is an entry of its own');
    await lab.until(() => lab.page.evaluate(() => /theme=dark/.test(location.hash) && /renderer=webgl/.test(location.hash)), 'renderer and theme are lost');
    await lab.close();
});

/** A scene of the user's own by the name `name`; `more` characters of noise, which does not pack, make it large. */
function own(name, more = 0) {
    const text = fs.readFileSync(path.join(ROOT, 'assets/scenes/pendulum.toml'), 'utf8').replace(/^name = .*$/m, `name = "${name}"`);
    const noise = Array.from({ length: Math.ceil(more / 44) }, (_, k) => createHash('sha256').update(String(k)).digest('base64'));
    return `${text}\n${noise.map((line) => `# ${line}\n`).join('')}`;
}

/** A scene with a file beside it. */
const LIFTED = `name = "lifted"\n[[body]]\nname = "a"\nmass = "1 kg"\ninertia = "1 1 1 kg m^2"\n[[joint]]\nname = "a"\nkind = "prismatic"
child = "a"\naxis = [0, 0, 1]\ndrive = { law = "table", file = "lift.csv" }\n`;
const LIFT = 'time_s,position_mm\n0,0\n1,3\n';

test('what no address holds is kept in the tab: a large scene and its changes, and a scene with the files that it names', async () => {
    const lab = await open('scene=pendulum&play=0', { backend });
    lab.page.on('dialog', (dialog) => dialog.accept());
    const hash = () => lab.page.evaluate(() => location.hash);
    const again = async (state) => {
        await lab.page.reload();
        await lab.started();
        await lab.says(`State reproduced: hash ${state.state_hash} agrees`);
        const now = await lab.state();
        for (const key of ['scene', 'state_hash', 'shown_s', 'changed_parameters']) assert.deepEqual(now[key], state[key], key);
    };
    const small = own('small');
    await lab.drop('small.toml', small);
    await lab.until(async () => (await lab.state()).scene === 'small', 'the file does not open');
    await lab.slide('Clearance', 0.7);
    await lab.runTo(0.02);
    const first = await lab.state();
    assert.ok(first.changed_parameters['contact.clearance']);
    await lab.until(async () => (await hash()).includes(`hash=${first.state_hash}`), 'the address does not follow');
    await again(first);

    await lab.drop('large.toml', own('large', 60_000));
    await lab.until(async () => (await lab.state()).scene === 'large', 'the file does not open');
    await lab.slide('Clearance', 0.8);
    await lab.runTo(0.03);
    await lab.until(async () => /^#kept=1(&|$)/.test(await hash()), 'the address keeps what it cannot hold');
    const second = await lab.state();
    assert.ok(second.changed_parameters['contact.clearance']);
    await again(second);
    const address = await hash();

    const chosen = lab.page.waitForEvent('filechooser');
    await lab.click('Button', 'Open…');
    await (await chosen).setFiles([['lifted.toml', LIFTED], ['lift.csv', LIFT]].map(([name, text]) => ({ name, mimeType: 'text/plain', buffer: Buffer.from(text) })));
    await lab.until(async () => (await lab.state()).scene === 'lifted', 'the files do not open');
    await lab.runTo(0.04);
    await again(await lab.state());

    // Back in the address where it fits.
    await lab.page.evaluate(() => (location.hash = '#scene=pendulum&play=0'));
    await lab.until(async () => /^#scene=pendulum&.*hash=/.test(await hash()), 'the address stays behind');
    await lab.close();
    // In another tab there is nothing of it, and the page says so.
    const other = await open('', { backend, fragment: address.slice(1) });
    await other.says('kept in the tab');
    await other.close();
});

test('leaving asks where changes of an own scene are in no file, and nowhere else', async () => {
    const lab = await open('scene=pendulum&play=0', { backend });
    let asked = [];
    let answer = 'dismiss';
    lab.page.on('dialog', (dialog) => {
        asked.push(dialog.type());
        return dialog[answer]();
    });
    /** What is asked on the way out, and whether the page is another afterwards. */
    const leave = async () => {
        asked = [];
        await lab.page.evaluate(() => (globalThis.stayed = true));
        await lab.page.reload({ waitUntil: 'commit', timeout: 10_000 }).catch(() => {});
        await lab.started();
        return [asked, await lab.page.evaluate(() => !globalThis.stayed)];
    };
    await lab.slide('Clearance', 0.7);
    assert.deepEqual(await leave(), [[], true], 'a built-in scene');
    await lab.drop('mine.toml', own('mine'));
    // At once: the address has not followed.
    await lab.until(async () => (await lab.state()).scene === 'mine', 'the file does not open');
    await lab.clickAt(450, 200);
    await lab.page.evaluate(() => history.replaceState(null, '', '#scene=pendulum&play=0'));
    assert.deepEqual(await leave(), [[], true], 'as it was opened');
    await lab.until(async () => (await lab.state()).scene === 'mine' && (await lab.state()).replaying === null, 'it is not back');
    await lab.slide('Clearance', 0.6);
    assert.deepEqual(await leave(), [['beforeunload'], false], 'changed');
    answer = 'accept';
    assert.deepEqual(await leave(), [['beforeunload'], true], 'changed');
    // The next tab over has forgotten nothing.
    await lab.until(async () => (await lab.state()).replaying === null, 'it is not back');
    await lab.clickAt(450, 200);
    assert.deepEqual(await leave(), [['beforeunload'], true], 'changed before it was loaded anew');
    await lab.until(async () => (await lab.state()).replaying === null, 'it is not back');
    const saved = lab.page.waitForEvent('download');
    await lab.click('Button', 'Save');
    await lab.click('Button', 'Scene…');
    await saved;
    assert.deepEqual(await leave(), [[], true], 'saved');
    await lab.close();
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
    // A scene and the file that it names, at once.
    const again = lab.page.waitForEvent('filechooser');
    await lab.click('Button', 'Open…');
    await (await again).setFiles([
        { name: 'lifted.toml', mimeType: 'application/toml', buffer: Buffer.from(LIFTED) },
        { name: 'lift.csv', mimeType: 'text/csv', buffer: Buffer.from(LIFT) },
    ]);
    await lab.until(async () => (await lab.state()).scene === 'lifted', 'the files do not open');
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

test('a sweep runs in workers and draws its points as they come; a click on one runs the scene to it', async () => {
    const lab = await open('spcmm.frequency=5Hz&play=0&theme=light', { backend, size: { width: 1100, height: 900 }, before: holdWorkers });
    await lab.key('b');
    // Out of the way, so that the diagram is in sight.
    await lab.click('DisclosureTriangle', 'Portrait and section');
    await lab.click('DisclosureTriangle', 'Neighbouring motion');
    await lab.click('Button', 'Start sweep');
    for (let point = 0; point < 3; point += 1) await lab.hear('Point');
    await lab.until(async () => (await lab.widgets()).some(({ label }) => /^3 of \d+ values/.test(label)), 'no points are shown');
    // One core is left for the picture.
    const cores = await lab.page.evaluate(() => navigator.hardwareConcurrency);
    assert.equal(lab.page.workers().length, Math.max(cores - 1, 1));
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
