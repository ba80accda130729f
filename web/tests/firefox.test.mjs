// The page in Firefox behaves as in Chromium.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { after, test } from 'node:test';

import { PNG } from 'pngjs';

import { emptyFirefox, quitFirefox } from './firefox.mjs';
import { blank, colours, difference, native, open, quit } from './harness.mjs';
import { play } from './play.mjs';

after(quit);
after(quitFirefox);

const empty = emptyFirefox;

test('Firefox: a link from Chromium reproduces its state, a slider changes the run, and a link back to Chromium agrees', async () => {
    const there = await open('scene=spcmm&cf=0.2&play=0', { backend: 'webgl' });
    await there.runTo(0.009);
    const { state_hash: hash } = await there.state();
    const link = await there.page.evaluate(() => globalThis.jointplay.page.link());
    await there.close();

    const lab = await open('', { empty, picture: true, fragment: link });
    assert.equal(await lab.page.evaluate(() => globalThis.jointplay.backend), 'webgl');
    await lab.findText(`State reproduced: hash ${hash} agrees`);
    assert.ok(colours(await lab.pixels()) > 200, 'the picture is empty');
    await lab.slide('Clearance', 0.8);
    const { changed_parameters: changed } = await lab.state();
    assert.ok(changed['contact.clearance'], 'the slider has no effect');
    await lab.click('Button', 'Play');
    await lab.until(async () => (await lab.state()).time_s > 0.012, 'time does not pass');
    await lab.key(' ');
    const here = await lab.until(async () => {
        const state = await lab.state();
        return !state.playing && state;
    }, 'it does not pause');
    const back = await lab.page.evaluate(() => globalThis.jointplay.page.link());
    await lab.close();

    const again = await open('', { backend: 'webgl', fragment: back });
    await again.findText(`State reproduced: hash ${here.state_hash} agrees`);
    await again.close();
});

test('Firefox: lost graphics are restarted, and the simulation continues', async () => {
    const lab = await open('c=0.5mm&play=0', { empty, picture: true });
    await lab.runTo(0.00785);
    const before = await lab.state();
    await lab.page.evaluate(() => {
        document.getElementById('laboratory').getContext('webgl2').getExtension('WEBGL_lose_context').loseContext();
    });
    await lab.until(() => lab.page.evaluate(() => globalThis.jointplay.losses.length === 1), 'the loss is not noticed');
    await lab.started();
    assert.equal(await lab.page.evaluate(() => globalThis.jointplay.trouble), null);
    assert.equal((await lab.state()).state_hash, before.state_hash);
    assert.ok(colours(await lab.pixels()) > 200, 'the picture is empty');
    await lab.key(' ');
    await lab.until(async () => (await lab.state()).time_s > before.time_s, 'it does not continue');
    await lab.close();
});

test('Chromium and Firefox play a film of the program, with the frames that render draws', async () => {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'jointplay-film-'));
    try {
        const line = ['render', 'spcmm', '--duration', '12ms', '--fps', '10', '--slow', '100', '--size', '640x360', '--quiet'];
        await native(...line, '--out', path.join(folder, 'frames'));
        await native(...line, '--film', path.join(folder, 'film.mp4'));
        const numbers = [0, 5, 12];
        const bytes = fs.readFileSync(path.join(folder, 'film.mp4'));
        for (const [where, options] of Object.entries({ Chromium: {}, Firefox: { empty } })) {
            const lab = await blank({ ...options, ownTime: true });
            // In the middle of the time for which each frame is shown.
            const film = await play(lab, bytes, numbers.map((k) => (k + 0.5) / 10));
            await lab.close();
            assert.deepEqual([film.width, film.height], [640, 360]);
            assert.ok(Math.abs(film.duration - 1.3) < 1e-3, `${where}: ${film.duration} s`);
            for (const [at, k] of numbers.entries()) {
                const name = `frame_${String(k).padStart(5, '0')}.png`;
                const frame = PNG.sync.read(fs.readFileSync(path.join(folder, 'frames', name)));
                const share = difference(film.pictures[at], frame, `film_${where}_${k}`, 0.01);
                assert.ok(share <= 0.01, `${where}, frame ${k}: ${share}`);
            }
        }
    } finally {
        fs.rmSync(folder, { recursive: true });
    }
});
