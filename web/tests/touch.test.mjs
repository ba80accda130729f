// The page on a phone: touches and the pixel density reach the canvas. tests/interface/touch.rs tests the gestures themselves.

import assert from 'node:assert/strict';
import { after, test } from 'node:test';

import { open, quit } from './harness.mjs';

after(quit);

test('on a phone fingers tap, turn and pinch, and the canvas has all pixels of its screen, also after a change of screen', async () => {
    const size = { width: 390, height: 600 };
    const lab = await open('play=0', { backend: 'webgl', size, context: { hasTouch: true, isMobile: true, deviceScaleFactor: 2 } });
    const canvas = () => lab.page.evaluate(() => [document.getElementById('laboratory').width, document.getElementById('laboratory').height]);
    assert.deepEqual(await canvas(), [2 * size.width, 2 * size.height]);
    for (const label of ['Menu', 'Step']) {
        const { rect: [, , x1, y1] } = await lab.find('Button', label);
        assert.ok(x1 > 0.3 * size.width && x1 <= size.width && y1 <= size.height, `${label} ends at ${x1}, ${y1}`);
    }
    await lab.tap('Button', 'Step');
    await lab.until(async () => (await lab.state()).steps === 1, 'the tap has no effect');

    const camera = async () => (await lab.state()).camera;
    await lab.fingers([[200, 150], [190, 150], [180, 150]]);
    const start = await camera();
    await lab.fingers([[200, 150], [230, 150], [260, 170]]);
    const turned = await camera();
    assert.ok(Math.abs(turned.yaw_rad - start.yaw_rad) > 0.05 && Math.abs(turned.pitch_rad - start.pitch_rad) > 0.01, JSON.stringify([start, turned]));
    assert.equal(turned.distance_m, start.distance_m);
    const pinch = [30, 50, 80].map((d) => [[200 - d, 140], [200 + d, 140]]);
    await lab.fingers(pinch.map(([left]) => left), pinch.map(([, right]) => right));
    const near = await camera();
    assert.ok(near.distance_m < 0.8 * turned.distance_m, `${turned.distance_m} m to ${near.distance_m} m`);
    assert.ok(Math.abs(near.yaw_rad - turned.yaw_rad) < 0.02, 'a pinch does not orbit');

    const cdp = await lab.context.newCDPSession(lab.page);
    // Not back to 1, for which the emulation fires no event.
    for (const ratio of [1.5, 3]) {
        await cdp.send('Emulation.setDeviceMetricsOverride', { ...size, deviceScaleFactor: ratio, mobile: false });
        await lab.until(async () => {
            // The browser fires the event only with the next visible frame.
            await cdp.send('Page.captureScreenshot');
            const [width, height] = await canvas();
            return width === ratio * size.width && height === ratio * size.height;
        }, `the canvas does not follow to ${ratio}`);
    }
    await lab.close();
});

test('the first gesture of a finger scrolls', async () => {
    const size = { width: 390, height: 600 };
    const lab = await open('scene=spcmm&play=0', { backend: 'webgl', size, context: { hasTouch: true, isMobile: true } });
    const top = async () => (await lab.find('Slider', 'Friction coefficient')).rect[1];
    const before = await top();
    // Beside a name, where nothing but the panel is under the finger.
    await lab.fingers([0, 10, 25, 45, 70, 70, 70].map((by) => [250, before - 6 - by]));
    await lab.until(async () => before - (await top()) > 40, 'the first swipe does not scroll');
    await lab.close();
});
