// Links, files, saving, long computations, and lost graphics.

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

/** Pauses, and returns the state. */
async function pause(lab) {
    await lab.key('Space');
    await lab.until(async () => !(await lab.state()).playing, 'it does not pause');
    return lab.state();
}

test('a link reproduces scene, changes, camera and state in another page, and is in the address bar if the clipboard is blocked', async () => {
    const lab = await open('scene=spcmm&cf=0.2', { backend });
    await lab.until(async () => (await lab.state()).time_s > 2e-3, 'time does not pass');
    // Changes during the run are part of the link.
    await lab.slide('Clearance', 0.8);
    await lab.drag([[560, 150], [600, 170], [640, 200]]);
    await lab.until(async () => (await lab.state()).time_s > 9e-3, 'time does not pass');
    const here = await pause(lab);
    assert.ok(here.changed_parameters['contact.clearance'] && here.changed_parameters['contact.friction']);
    await lab.click('Button', 'Copy link');
    const link = await lab.until(() => lab.page.evaluate(() => navigator.clipboard.readText()), 'nothing on the clipboard');
    const { hash, search } = new URL(link);
    assert.equal(search, '');
    // The address is updated during the run, and also names the renderer of the query.
    const inBar = async () => (await lab.page.evaluate(() => location.hash)).replace(/&renderer=webgl$/, '');
    assert.equal(await inBar(), hash, 'the address bar has it, too');
    await lab.page.evaluate(() => {
        Object.defineProperty(navigator, 'clipboard', { value: { writeText: () => Promise.reject(new Error('no')) } });
        document.execCommand = () => false;
        history.replaceState(null, '', '#');
    });
    await lab.click('Button', 'Copy link');
    await lab.until(async () => /^The link is in the address bar/.test(await lab.summary()), 'no message');
    assert.equal(await inBar(), hash);
    await lab.close();

    const other = await open('', { backend, fragment: hash.slice(1) });
    await other.findText(`State reproduced: hash ${here.state_hash} agrees`);
    const there = await other.state();
    for (const key of ['scene', 'steps', 'shown_s', 'state_hash', 'changed_parameters', 'camera']) assert.deepEqual(there[key], here[key], key);
    assert.equal(there.playing, false);
    // An open page accepts another link; a wrong hash is detected.
    const wrong = hash.replace(/hash=./, (found) => `hash=${found.at(-1) === '0' ? '1' : '0'}`);
    await other.page.evaluate((fragment) => (location.hash = fragment), wrong);
    await other.findText('State differs');
    // The page may write its state to the address between the change to a link and the hashchange event.
    await other.page.evaluate(() => {
        const { href } = location;
        location.hash = '#scene=slider-crank&play=0';
        history.replaceState(null, '', href);
    });
    await other.until(async () => (await other.state()).scene === 'slider-crank', 'the address of the state has replaced the link');
    await other.page.evaluate(() => (location.hash = '#scene=pendulun'));
    await other.findText('did you mean `pendulum`');
    assert.equal((await other.state()).scene, 'slider-crank');
    await other.close();
});

/** A scene of the user's own named `name`; `more` characters of incompressible noise make it large. */
function ownScene(name, more = 0) {
    const text = fs.readFileSync(path.join(ROOT, 'assets/scenes/pendulum.toml'), 'utf8').replace(/^name = .*$/m, `name = "${name}"`);
    const noise = Array.from({ length: Math.ceil(more / 44) }, (_, k) => createHash('sha256').update(String(k)).digest('base64'));
    return `${text}\n${noise.map((line) => `# ${line}\n`).join('')}`;
}

/** A scene and a file that it names, for the browser's dialog. */
const LIFTED = [
    ['lifted.toml', `name = "lifted"\n[[body]]\nname = "a"\nmass = "1 kg"\ninertia = "1 1 1 kg m^2"\n[[joint]]\nname = "a"\nkind = "prismatic"
child = "a"\naxis = [0, 0, 1]\ndrive = { law = "table", file = "lift.csv" }\n`],
    ['lift.csv', 'time_s,position_mm\n0,0\n1,3\n'],
].map(([name, text]) => ({ name, mimeType: 'text/plain', buffer: Buffer.from(text) }));

/** Opens files with the button. */
async function choose(lab, files) {
    const chosen = lab.page.waitForEvent('filechooser');
    await lab.click('Button', 'Open');
    await lab.click('Button', 'File…');
    await (await chosen).setFiles(files);
}

test('after a scene that made the memory large, the next one is opened in a new page', async () => {
    const lab = await open('scene=spcmm&play=0', { backend });
    // While it reloads, a page answers nothing.
    const loaded = () => lab.page.evaluate(() => performance.timeOrigin).catch(() => null);
    const first = await loaded();
    await lab.page.evaluate(() => (jointplay.largeMemory = 1));
    await lab.page.waitForTimeout(2500);
    assert.equal(await loaded(), first, 'the scene that needs the memory is not reloaded');
    await lab.page.evaluate(() => (location.hash = '#scene=chain&play=0'));
    await lab.until(async () => ![first, null].includes(await loaded()), 'the page is not reloaded');
    await lab.started();
    assert.equal((await lab.state()).scene, 'chain');
    const second = await loaded();
    await lab.page.waitForTimeout(2500);
    assert.equal(await loaded(), second, 'it is reloaded once');
});

test('a reload continues from the same state, and the tab stores a state that no address can hold', async () => {
    const lab = await open('scene=spcmm&c=0.5mm&theme=dark&play=0', { backend });
    lab.page.on('dialog', (dialog) => dialog.accept());
    const hash = () => lab.page.evaluate(() => location.hash);
    const again = async (state) => {
        await lab.page.reload();
        await lab.started();
        await lab.findText(`State reproduced: hash ${state.state_hash} agrees`);
        const now = await lab.state();
        for (const key of ['scene', 'state_hash', 'shown_s', 'changed_parameters', 'playing']) assert.deepEqual(now[key], state[key], key);
    };
    await lab.slide('Friction coefficient', 0.5);
    await lab.runTo(0.004);
    const first = await lab.state();
    assert.ok(first.changed_parameters['contact.friction']);
    const follows = () => lab.until(async () => (await hash()).includes(`hash=${first.state_hash}`), 'the address does not follow');
    await follows();
    const entries = await lab.page.evaluate(() => history.length);
    await again(first);
    await follows();
    assert.match(await hash(), /play=0.*theme=dark|theme=dark.*play=0/);
    assert.match(await hash(), /renderer=webgl/);
    assert.equal(await lab.page.evaluate(() => history.length), entries, 'each state makes a history entry');
    // The pairs of the link have moved to the fragment; a typed query takes precedence.
    const search = () => lab.page.evaluate(() => location.search);
    assert.match(await search(), /^\?renderer=webgl(&theme=dark)?$/);
    const { origin, pathname, hash: written } = new URL(lab.page.url());
    await lab.page.goto(`${origin}${pathname}?scene=chain&play=0&renderer=webgl${written}`);
    await lab.started();
    assert.equal((await lab.state()).scene, 'chain');
    await lab.until(async () => (await search()) === '?renderer=webgl', 'the pairs stay in the query');
    await lab.page.evaluate(() => (location.hash = '#scene=spcmm&play=0'));
    await lab.until(async () => (await lab.state()).scene === 'spcmm', 'the link is not opened');

    await lab.drop('large.toml', ownScene('large', 60_000));
    await lab.until(async () => (await lab.state()).scene === 'large', 'the file does not open');
    await lab.slide('Clearance', 0.8);
    await lab.runTo(0.03);
    await lab.until(async () => /^#kept=1(&|$)/.test(await hash()), 'the address does not refer to the stored state');
    const second = await lab.state();
    assert.ok(second.changed_parameters['contact.clearance']);
    await again(second);
    const address = await hash();

    await choose(lab, LIFTED);
    await lab.until(async () => (await lab.state()).scene === 'lifted', 'the files do not open');
    await lab.runTo(0.04);
    await again(await lab.state());

    // A small state returns to the address.
    await lab.page.evaluate(() => (location.hash = '#scene=pendulum&play=0'));
    await lab.until(async () => /^#scene=pendulum&.*hash=/.test(await hash()), 'the address is not updated');
    // Another tab does not have the stored state, and says so.
    await lab.page.evaluate((address) => {
        sessionStorage.clear();
        location.hash = address;
    }, address);
    await lab.findText('stored only in the browser tab');
    await lab.close();
});

test('leaving asks for confirmation only with unsaved changes of the user\'s own scene', async () => {
    // With slow timers the address is not updated during the test.
    const lab = await open('scene=pendulum&play=0', { backend, before: () => (globalThis.drivenTime.hasty = false) });
    const dialogs = [];
    let answer = 'dismiss';
    lab.page.on('dialog', (dialog) => {
        dialogs.push(dialog.type());
        return dialog[answer]();
    });
    /** Whether the page would request a confirmation. */
    const asks = () => lab.page.evaluate(() => !dispatchEvent(new Event('beforeunload', { cancelable: true })));
    await lab.slide('Clearance', 0.7);
    assert.equal(await asks(), false, 'a built-in scene');
    await lab.drop('mine.toml', ownScene('mine'));
    await lab.until(async () => (await lab.state()).scene === 'mine', 'the file does not open');
    await lab.frame(2);
    assert.equal(await asks(), false, 'as it was opened');
    await lab.slide('Clearance', 0.6);
    assert.equal(await asks(), true, 'changed');
    // The browser asks, and stays on the page if the user refuses.
    await lab.page.evaluate(() => {
        globalThis.stayed = true;
        location.reload();
    });
    await lab.until(() => dialogs.length === 1, 'no confirmation');
    answer = 'accept';
    assert.equal(await lab.page.evaluate(() => globalThis.stayed), true);
    await lab.page.evaluate(() => history.replaceState(null, '', '#scene=pendulum&play=0'));
    await lab.page.reload();
    await lab.started();
    assert.deepEqual(dialogs, ['beforeunload', 'beforeunload']);
    assert.equal(await lab.page.evaluate(() => globalThis.stayed), undefined);
    await lab.until(async () => (await lab.state()).scene === 'mine' && (await lab.state()).replaying === null, 'it is not back');
    assert.equal(await asks(), true, 'changed before the reload');
    const saved = lab.page.waitForEvent('download');
    await lab.click('Button', 'Save');
    await lab.click('Button', 'Scene…');
    await saved;
    assert.equal(await asks(), false, 'saved');
    await lab.close();
});

test('files open by drop and dialog, a bad one leaves the running scene, and scene, record and picture are downloads', async () => {
    const lab = await open('scene=spcmm&c=0.5mm&play=0&theme=light', { backend });
    await lab.runTo(0.009);
    const { state_hash: hash } = await lab.state();
    for (const [name, text, words] of [
        ['bad.toml', '[contact]\nclearance = 3\n', 'bad.toml:2'],
        ['film.mp4', '#'.repeat(5 << 20), 'film.mp4: too large for a scene file'],
    ]) {
        await lab.drop(name, text);
        await lab.findText(words);
        assert.equal((await lab.state()).state_hash, hash);
    }
    // A file dropped beside the canvas does not replace the page.
    const prevented = await lab.page.evaluate(() => !document.body.dispatchEvent(new DragEvent('drop', { bubbles: true, cancelable: true })));
    assert.ok(prevented, 'the browser would open the file');

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
    const record = await save('Data (CSV)…', 2);
    assert.deepEqual([...record.keys()].sort(), ['spcmm-9.000ms.csv', 'spcmm-9.000ms.csv.meta.json']);
    assert.equal(JSON.parse(record.get('spcmm-9.000ms.csv.meta.json')).state_hash, hash);
    const [header, ...rows] = record.get('spcmm-9.000ms.csv').toString().trimEnd().split('\n');
    assert.match(header, /^t_s,.*S1_normal_N_max/);
    assert.ok(rows.length > 20 && rows.every((row) => row.split(',').length === header.split(',').length));
    await lab.draw();
    const [picture] = (await save('Picture…', 1)).values();
    const { width, height } = PNG.sync.read(picture);
    assert.ok(width > 400 && height > 150, `${width}x${height}`);
    assert.ok(colours(PNG.sync.read(picture)) > 200, 'the picture is empty');

    await lab.drop('mine.toml', scene.replace(/^name = .*$/m, 'name = "mine"'));
    await lab.until(async () => (await lab.state()).scene === 'mine', 'the file does not open');
    assert.ok(!(await lab.widgets()).some((widget) => widget.label.includes('film.mp4')), 'the error is gone');
    await lab.runTo(0.009);
    assert.equal((await lab.state()).state_hash, hash, 'the scene is another one');
    await choose(lab, LIFTED);
    await lab.until(async () => (await lab.state()).scene === 'lifted', 'the files do not open');
    await lab.close();
});

test('computations run in workers: they report progress, the page keeps running, and cancelling ends them', async () => {
    const lab = await open('scene=spcmm&spcmm.frequency=50Hz&play=0', { backend, before: holdWorkers });
    const workers = () => lab.page.workers().length;
    const ended = () => lab.until(() => workers() === 0, 'the worker does not end');
    // A sweep uses all cores except one, which draws the picture.
    await lab.key('b');
    for (const [name, value] of [['Values', 9], ['Periods', 4], ['Discard', 1]]) await lab.adjust('spinbutton', name, { value });
    await lab.activate('button', 'Start sweep');
    for (let point = 0; point < 3; point += 1) await lab.nextMessage('Point');
    await lab.until(async () => (await lab.widgets()).some(({ label }) => /^3 of 9 values/.test(label)), 'no points are shown');
    const cores = await lab.page.evaluate(() => navigator.hardwareConcurrency);
    assert.equal(workers(), Math.max(cores - 1, 1));
    // Later messages are held back, even if the computation is already done.
    await lab.activate('button', 'Play');
    await lab.until(async () => (await lab.state()).time_s > 0, 'the page does not continue during the computation');
    await lab.activate('button', 'Pause');
    await lab.activate('button', 'Cancel sweep');
    await lab.find('Button', 'Start sweep');
    await ended();

    // The tornado fills run by run, and ends when its panel is closed.
    await lab.activate('button', 'What play costs');
    for (const [name, value] of [['Duration', 0.06], ['Observed from', 0.02]]) await lab.adjust('spinbutton', name, { value });
    await lab.activate('button', 'Start runs');
    for (let run = 0; run < 3; run += 1) await lab.nextMessage('Run');
    await lab.until(async () => (await lab.widgets()).some(({ label }) => /; 3 of 7 runs$/.test(label)), 'no runs are shown');
    await lab.activate('button', 'Experiments');
    await ended();
    await lab.close();
});

/** Makes the browser lose the graphics context. */
const loseGraphics = () => document.getElementById('laboratory').getContext('webgl2').getExtension('WEBGL_lose_context').loseContext();

test('lost graphics are restarted and the simulation continues; otherwise a reload restores the same state', async () => {
    const lab = await open('c=0.5mm&theme=dark&play=0', { backend, before: () => {
        const { getContext } = HTMLCanvasElement.prototype;
        HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
            return globalThis.refused && kind === 'webgl2' ? null : getContext.call(this, kind, ...rest);
        };
    } });
    await lab.draw();
    await lab.runTo(0.00785);
    await lab.settle();
    const [before, picture] = [await lab.state(), await lab.pixels()];
    const same = async () => {
        const now = await lab.state();
        for (const key of ['state_hash', 'shown_s', 'camera', 'changed_parameters', 'playing']) assert.deepEqual(now[key], before[key], key);
    };
    await lab.page.evaluate(loseGraphics);
    await lab.until(() => lab.page.evaluate(() => globalThis.jointplay.losses.length === 1), 'the loss is not noticed');
    await lab.started();
    assert.equal(await lab.page.evaluate(() => globalThis.jointplay.trouble), null);
    await lab.settle();
    await same();
    const share = difference(await lab.pixels(), picture, 'after_loss', 0.01);
    assert.ok(share < 0.01, `${share} of the pixels differ after the loss`);

    // In one task, because the page requests new graphics as soon as it is notified.
    await lab.page.evaluate(`(${loseGraphics})(); globalThis.refused = true;`);
    const again = lab.page.locator('#again');
    await again.waitFor();
    assert.match(await lab.page.locator('#trouble').innerText(), /The graphics were lost/);
    assert.ok(await lab.page.locator('canvas').isHidden());
    await Promise.all([lab.page.waitForEvent('load'), again.click()]);
    await lab.started();
    await lab.findText(`hash ${before.state_hash} agrees`);
    await same();
    await lab.key('Space');
    await lab.until(async () => (await lab.state()).time_s > before.time_s, 'it does not continue');
    await lab.close();
});
