// Sound, as the browser is asked to make it.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { after, test } from 'node:test';

import { native, open, quit } from './harness.mjs';

after(quit);

const backend = 'webgl';

/** Notes every click that is scheduled: how far ahead, s, how long, s, and its largest sample. */
function listen() {
    const heard = { clicks: [], contexts: [] };
    globalThis.heard = heard;
    globalThis.AudioContext = class extends AudioContext {
        constructor(...rest) {
            super(...rest);
            heard.contexts.push(this);
        }

        createBufferSource() {
            const source = super.createBufferSource();
            const start = source.start.bind(source);
            source.start = (when) => {
                const { duration } = source.buffer;
                const loudest = source.buffer.getChannelData(0).reduce((most, sample) => Math.max(most, Math.abs(sample)), 0);
                heard.clicks.push({ ahead: when - this.currentTime, duration, loudest });
                start(when);
            };
            return source;
        }
    };
}

/** Impacts of the pendulum that have ended by `seconds`, as the program finds them. */
async function impacts(seconds) {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'jointplay-sound-'));
    try {
        const file = path.join(folder, 'impacts.csv');
        await native('run', 'pendulum', '--duration', `${seconds}s`, '--impacts', file, '--quiet');
        const [names, ...rows] = fs.readFileSync(file, 'utf8').trim().split('\n').filter((line) => !line.startsWith('#'));
        const end = names.split(',').indexOf('end_s');
        return rows.filter((row) => Number(row.split(',')[end]) <= seconds).length;
    } finally {
        fs.rmSync(folder, { recursive: true });
    }
}

test('with sound on every impact is a click, and none while it is off, pauses or goes backwards', async () => {
    const lab = await open('scene=pendulum&play=0', { backend, before: [listen] });
    const clicks = () => lab.ask(() => globalThis.heard.clicks);
    const contexts = () => lab.ask(() => globalThis.heard.contexts.map(({ state }) => state));
    assert.deepEqual(await contexts(), [], 'no sound is asked for before it is switched on');
    await lab.key('m');
    await lab.until(async () => (await contexts())[0] === 'running', 'the browser makes no sound');

    await lab.click('Button', 'Play');
    await lab.frame(80);
    await lab.click('Button', 'Pause');
    const { shown_s: shown, playing } = await lab.state();
    assert.equal(playing, false);
    const heard = await clicks();
    assert.ok(heard.length > 3, `${heard.length} clicks until ${shown} s`);
    assert.equal(heard.length, await impacts(shown));
    for (const { ahead, duration, loudest } of heard) {
        // A frame has 50 ms, and its sound comes a little later.
        assert.ok(ahead >= 0 && ahead <= 0.1, `${ahead} s ahead`);
        assert.ok(duration > 0.005 && duration < 0.5, `${duration} s long`);
        assert.ok(loudest > 0.001 && loudest <= 1, `${loudest} loud`);
    }

    await lab.frame(20);
    assert.equal((await clicks()).length, heard.length, 'a pause is silent');
    await lab.key('j');
    await lab.frame(20);
    assert.ok((await lab.state()).shown_s < shown, 'it goes backwards');
    assert.equal((await clicks()).length, heard.length, 'backwards is silent');
    await lab.key('m');
    await lab.until(async () => (await contexts())[0] === 'suspended', 'the sound goes on');
    await lab.key('Home');
    await lab.click('Button', 'Play');
    await lab.frame(40);
    assert.equal((await clicks()).length, heard.length, 'it is off');
    assert.equal((await contexts()).length, 1);
    await lab.close();
});

test('a browser without Web Audio says so, and the run goes on', async () => {
    const lab = await open('scene=pendulum&play=0', { backend, before: [() => delete globalThis.AudioContext] });
    await lab.key('m');
    await lab.until(async () => (await lab.summary()).includes('No sound: this browser cannot make it'), 'nothing is said');
    await lab.click('Button', 'Play');
    await lab.frame(10);
    assert.ok((await lab.state()).shown_s > 0);
    await lab.close();
});
