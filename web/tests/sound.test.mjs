// Sound through Web Audio. tests/interface/sound.rs tests which sounds are made, and when.

import assert from 'node:assert/strict';
import { after, test } from 'node:test';

import { open, quit } from './harness.mjs';

after(quit);

/** Records every scheduled click: its lead time, s, duration, s, and largest sample. */
function recordClicks() {
    const recorded = { clicks: [], contexts: [] };
    globalThis.recorded = recorded;
    globalThis.AudioContext = class extends AudioContext {
        constructor(...rest) {
            super(...rest);
            recorded.contexts.push(this);
        }

        createBufferSource() {
            const source = super.createBufferSource();
            const start = source.start.bind(source);
            source.start = (when) => {
                const { duration } = source.buffer;
                const loudest = source.buffer.getChannelData(0).reduce((most, sample) => Math.max(most, Math.abs(sample)), 0);
                recorded.clicks.push({ ahead: when - this.currentTime, duration, loudest });
                start(when);
            };
            return source;
        }
    };
}

test('with sound on, impacts are clicks of Web Audio; without Web Audio a message says so and the run continues', async () => {
    const lab = await open('scene=pendulum&play=0', { backend: 'webgl', before: recordClicks });
    const contexts = () => lab.page.evaluate(() => globalThis.recorded.contexts.map(({ state }) => state));
    await lab.page.evaluate(() => {
        globalThis.withheld = AudioContext;
        delete globalThis.AudioContext;
    });
    await lab.key('m');
    await lab.until(async () => (await lab.summary()).includes('No sound: this browser cannot make it'), 'no message');
    await lab.page.evaluate(() => (globalThis.AudioContext = globalThis.withheld));
    assert.deepEqual(await contexts(), [], 'no context before sound is switched on');
    await lab.key('m');
    await lab.until(async () => (await contexts())[0] === 'running', 'the browser makes no sound');

    await lab.key('Space');
    await lab.frame(40);
    await lab.key('Space');
    const { shown_s: shown, playing } = await lab.state();
    assert.equal(playing, false);
    const clicks = await lab.page.evaluate(() => globalThis.recorded.clicks);
    const impacts = JSON.parse(await lab.page.evaluate(() => globalThis.jointplay.page.impacts(0)));
    assert.ok(impacts.length > 3, `${impacts.length} impacts until ${shown} s`);
    assert.equal(clicks.length, impacts.length);
    for (const { ahead, duration, loudest } of clicks) {
        // A frame takes 50 ms, and its sound follows a little later.
        assert.ok(ahead >= 0 && ahead <= 0.1, `${ahead} s ahead`);
        assert.ok(duration > 0.005 && duration < 0.5, `${duration} s long`);
        assert.ok(loudest > 0.001 && loudest <= 1, `${loudest} loud`);
    }
    await lab.key('m');
    await lab.until(async () => (await contexts())[0] === 'suspended', 'the sound continues');
    assert.equal((await contexts()).length, 1);
    await lab.close();
});
