// The page in Firefox: what it does there as in Chromium.

import assert from 'node:assert/strict';
import { after, test } from 'node:test';

import { colours, open, quit } from './harness.mjs';

after(quit);

const firefox = true;

test('Firefox: a link from Chromium reproduces its state; a slider changes the run, and the link back agrees', async () => {
    const there = await open('scene=spcmm&cf=0.2&play=0', { backend: 'webgl' });
    await there.runTo(0.009);
    const { state_hash: hash } = await there.state();
    const link = await there.page.evaluate(() => globalThis.jointplay.page.link());
    await there.close();

    const lab = await open('', { firefox, fragment: link });
    assert.equal(await lab.page.evaluate(() => globalThis.jointplay.backend), 'webgl');
    await lab.says(`State reproduced: hash ${hash} agrees`);
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
    await again.says(`State reproduced: hash ${here.state_hash} agrees`);
    await again.close();
});

test('Firefox: lost graphics come back, and the simulation goes on as it was', async () => {
    const lab = await open('c=0.5mm&play=0', { firefox });
    await lab.runTo(0.00785);
    const before = await lab.state();
    await lab.page.evaluate(() => {
        document.getElementById('laboratory').getContext('webgl2').getExtension('WEBGL_lose_context').loseContext();
    });
    await lab.until(() => lab.page.evaluate(() => globalThis.jointplay.losses.length === 1), 'the loss is not seen');
    await lab.started();
    assert.equal(await lab.page.evaluate(() => globalThis.jointplay.trouble), null);
    assert.equal((await lab.state()).state_hash, before.state_hash);
    assert.ok(colours(await lab.pixels()) > 200, 'the picture is empty');
    await lab.key(' ');
    await lab.until(async () => (await lab.state()).time_s > before.time_s, 'it does not go on');
    await lab.close();
});
