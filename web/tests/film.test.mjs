// Films, as a browser plays them: those of the program, and those that the page makes.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { after, test } from 'node:test';

import { PNG } from 'pngjs';

import { blank, colours, difference, native, open, quit } from './harness.mjs';

after(quit);

/** Loads a film into an empty page of Chromium, or of Firefox: its size and length, and its picture at each of `times`, s. */
async function play(bytes, times, firefox = false) {
    const page = await blank(firefox);
    const film = `data:video/mp4;base64,${bytes.toString('base64')}`;
    const shown = await page.evaluate(async ([film, times]) => {
        const video = document.createElement('video');
        const heard = (event) => new Promise((done, failed) => {
            video.addEventListener(event, done, { once: true });
            video.addEventListener('error', () => failed(new Error(video.error.message)), { once: true });
        });
        const ready = heard('loadeddata');
        Object.assign(video, { muted: true, preload: 'auto', src: film });
        await ready;
        const { videoWidth: width, videoHeight: height, duration } = video;
        const canvas = Object.assign(document.createElement('canvas'), { width, height });
        const context = canvas.getContext('2d', { willReadFrequently: true });
        const pictures = [];
        for (const time of times) {
            const there = heard('seeked');
            video.currentTime = time;
            await there;
            // Some time after the seek the frame is decoded; until then nothing is drawn.
            for (let looks = 0; looks < 200; looks += 1) {
                context.drawImage(video, 0, 0);
                if (context.getImageData(width >> 1, height >> 1, 1, 1).data[3] > 0) break;
                await new Promise((done) => setTimeout(done, 50));
            }
            pictures.push(canvas.toDataURL('image/png'));
        }
        return { width, height, duration, pictures };
    }, [film, times]);
    await page.close();
    const decode = (url) => PNG.sync.read(Buffer.from(url.split(',')[1], 'base64'));
    return { ...shown, pictures: shown.pictures.map(decode) };
}

test('a film of the program plays, and its frames are those that render draws', async () => {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'jointplay-film-'));
    try {
        const line = ['render', 'spcmm', '--duration', '12ms', '--fps', '10', '--slow', '100', '--size', '640x360', '--quiet'];
        await native(...line, '--out', path.join(folder, 'frames'));
        await native(...line, '--film', path.join(folder, 'film.mp4'));
        const numbers = [0, 5, 12];
        // In the middle of the time that each is shown.
        const bytes = fs.readFileSync(path.join(folder, 'film.mp4'));
        for (const firefox of [false, true]) {
            const where = firefox ? 'Firefox' : 'Chromium';
            const film = await play(bytes, numbers.map((k) => (k + 0.5) / 10), firefox);
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

test('the page makes a film of its timeline, and one that is given up leaves nothing', async () => {
    const lab = await open('scene=pendulum&play=0', { backend: 'webgl' });
    await lab.runTo(0.004);
    const before = await lab.state();
    const files = [];
    lab.page.on('download', async (download) => {
        files.push([download.suggestedFilename(), fs.readFileSync(await download.path())]);
    });
    await lab.click('Button', 'Save');
    await lab.click('Button', 'Film…');
    await lab.click('Button', 'Make film');
    await lab.says('Making the film');
    await lab.click('Button', 'Give up');
    await lab.until(async () => (await lab.state()).shown_s === before.shown_s, 'the run does not go back');
    assert.deepEqual(files, []);

    await lab.click('Button', 'Save');
    await lab.click('Button', 'Film…');
    await lab.click('Button', 'Make film');
    await lab.until(() => files.length === 1, 'no film');
    const after = await lab.state();
    assert.deepEqual([after.state_hash, after.shown_s, after.playing], [before.state_hash, before.shown_s, false]);
    await lab.close();
    const [[name, bytes]] = files;
    assert.equal(name, 'pendulum.mp4');
    // 4 ms at a fiftieth of real time, 30 frames a second.
    const film = await play(bytes, [0.1]);
    assert.deepEqual([film.width, film.height], [1280, 720]);
    assert.ok(Math.abs(film.duration - 7 / 30) < 1e-3, `${film.duration} s`);
    assert.ok(colours(film.pictures[0]) > 200, 'the film is empty');
});

test('F5 begins a presentation in place of loading the page anew, and Escape ends it', async () => {
    const lab = await open('scene=pendulum&play=0', { backend: 'webgl' });
    await lab.runTo(0.02);
    const before = await lab.state();
    await lab.page.evaluate(() => {
        addEventListener('keydown', (event) => (globalThis.kept = event.defaultPrevented), { capture: true });
    });
    await lab.key('F5');
    await lab.find('Button', 'Leave');
    assert.ok(!(await lab.widgets()).some(({ label }) => label === 'Save'), 'the panels are still there');
    assert.equal(await lab.page.evaluate(() => globalThis.kept), true, 'the browser loads the page anew');
    await lab.key('Escape');
    await lab.find('Button', 'Save');
    assert.equal((await lab.state()).state_hash, before.state_hash);
    await lab.close();
});
