// The page on a phone: fingers, and a screen that is narrow or low.

import assert from 'node:assert/strict';
import { after, test } from 'node:test';

import { colours, crop, difference, middle, open, quit } from './harness.mjs';

after(quit);

const backend = 'webgl';
const PHONE = { width: 390, height: 844 };
/** Least size of what a finger is to hit, CSS pixels. */
const FINGER = 36;

test('one finger orbits, two pan and pinch', async () => {
    const lab = await open('play=0', { backend, size: PHONE, context: { hasTouch: true } });
    const camera = async () => (await lab.state()).camera;
    // Until somebody turns it, the camera keeps everything in sight and is nobody's choice.
    assert.equal(await camera(), null);
    const gesture = async (...paths) => {
        const before = await camera();
        await lab.fingers(...paths);
        const now = await camera();
        assert.notDeepEqual(now, before, 'the fingers move nothing');
        return now;
    };
    const start = await gesture([[200, 200], [190, 200], [180, 200]]);
    const turned = await gesture([[200, 200], [230, 200], [260, 220]]);
    assert.ok(Math.abs(turned.yaw_rad - start.yaw_rad) > 0.05 && Math.abs(turned.pitch_rad - start.pitch_rad) > 0.01, JSON.stringify([start, turned]));
    assert.equal(turned.distance_m, start.distance_m);
    assert.deepEqual(turned.target_m, start.target_m);

    // Above the platform: there it is the whole machine that comes nearer, wherever its parts stand in the picture.
    const apart = (d) => [[200 - d, 140], [200 + d, 140]];
    const pinch = [30, 50, 80].map(apart);
    const near = await gesture(pinch.map(([left]) => left), pinch.map(([, right]) => right));
    assert.ok(near.distance_m < 0.7 * turned.distance_m, `${turned.distance_m} m to ${near.distance_m} m`);
    assert.ok(Math.abs(near.yaw_rad - turned.yaw_rad) < 0.02, 'a pinch does not orbit');

    const moved = await gesture([[150, 180], [170, 200], [190, 230]], [[250, 180], [270, 200], [290, 230]]);
    const way = Math.hypot(...moved.target_m.map((x, k) => x - near.target_m[k]));
    assert.ok(way > 0.02 * near.distance_m, `the target moved ${way} m`);
    assert.ok(Math.abs(moved.distance_m / near.distance_m - 1) < 0.05);
    assert.ok(Math.abs(moved.yaw_rad - near.yaw_rad) < 0.02, 'two fingers do not orbit');
    await lab.close();
});

test('a finger that stays on a body pulls on it, and one that goes on at once turns the view', async () => {
    const lab = await open('play=0', { backend, size: PHONE, context: { hasTouch: true } });
    const { rect: [x0, y0, x1, y1] } = await lab.find('Image', '3D view');
    // The middle of the platform, in the view that the page starts with.
    const at = [x0 + 0.54 * (x1 - x0), y0 + 0.675 * (y1 - y0)];
    // No finger is quite still, and a page without news draws nothing.
    const stays = Array.from({ length: 24 }, (_, k) => [at[0] + (k % 2), at[1]]);
    const away = [10, 20, 30, 40].map((way) => [at[0] + way, at[1]]);
    let pull = null;
    await lab.fingers([...stays, ...away], async () => {
        pull = (await lab.state()).pull_N;
    });
    assert.ok(pull > 0.1, `${pull} N`);
    assert.equal((await lab.state()).camera, null, 'the view stays');
    assert.equal((await lab.state()).pull_N, null, 'lets go');
    await lab.fingers([at, ...away], async () => {
        pull = (await lab.state()).pull_N;
    });
    assert.equal(pull, null);
    assert.notEqual((await lab.state()).camera, null);
    await lab.close();
});

test('on a screen with finer pixels the canvas has them all, and a finger hits what it shows', async () => {
    const size = { width: 390, height: 600 };
    const lab = await open('play=0&theme=light', { backend, size, context: { hasTouch: true, isMobile: true, deviceScaleFactor: 2 } });
    const canvas = await lab.page.evaluate(() => [document.getElementById('laboratory').width, document.getElementById('laboratory').height]);
    assert.deepEqual(canvas, [2 * size.width, 2 * size.height]);
    const shown = await lab.pixels();
    assert.deepEqual([shown.width, shown.height], canvas);
    for (const label of ['Menu', 'Step']) {
        const { rect: [, , x1, y1] } = await lab.find('Button', label);
        assert.ok(x1 > 0.3 * size.width && x1 <= size.width && y1 <= size.height, `${label} ends at ${x1}, ${y1}`);
    }
    await lab.tap('Button', 'Step');
    await lab.until(async () => (await lab.state()).steps === 1, 'the finger misses');
    await lab.close();
});

test('a finger on a slider scrolls up and down, and moves it sideways', async () => {
    const lab = await open('play=0', { backend, size: PHONE, context: { hasTouch: true } });
    const slider = async () => (await lab.find('Slider', 'Clearance')).rect;
    const changed = async () => (await lab.state()).changed_parameters['contact.clearance'];
    const [x0, y0, x1, y1] = await slider();
    const y = (y0 + y1) / 2;
    const from = x0 + 0.3 * (x1 - x0);
    await lab.fingers([0, 30, 60, 90].map((way) => [from + way, y]));
    const value = await changed();
    assert.match(value, /mm$/);
    await lab.fingers([0, 15, 30, 45, 60].map((up) => [from, y - up]));
    await lab.until(async () => y0 - (await slider())[1] > 40, 'the panel does not scroll');
    assert.equal(await changed(), value);
    await lab.close();
});

test('a menu that is longer than the screen scrolls under a finger', async () => {
    const size = { width: 844, height: 390 };
    const lab = await open('play=0', { backend, size, context: { hasTouch: true } });
    await lab.tap('Button', 'Menu');
    const [x, y] = middle(await lab.find('Button', 'Picture…'));
    for (let swipe = 0; swipe < 6; swipe += 1) {
        await lab.fingers([0, 30, 60, 90, 120].map((up) => [x, y - up]));
    }
    const reached = async () => (await lab.find('Button', 'About')).rect[3] <= size.height;
    await lab.until(reached, 'the end of the menu stays outside');
    await lab.still();
    await lab.tap('Button', 'About');
    await lab.says('State hash');
    await lab.close();
});

for (const [name, size] of [['upright', PHONE], ['lying', { width: 844, height: 390 }]]) {
    test(`a phone held ${name}: the panel folds, the controls are there for fingers, the mechanism is in sight`, async () => {
        const lab = await open('theme=light&play=0', { backend, size, context: { hasTouch: true } });
        await lab.find('Slider', 'Clearance');
        const open_ = await lab.pixels();
        await lab.tap('Button', 'Controls');
        await lab.until(async () => !(await lab.has('Slider', 'Clearance')), 'the panel does not fold');
        await lab.still();
        const folded = await lab.pixels();
        // The picture has taken the place of the panel, and there is a mechanism in it.
        const view = name === 'upright' ? { x: 0, y: 100, width: 390, height: 560 } : { x: 0, y: 60, width: 844, height: 250 };
        assert.ok(colours(crop(folded, view)) > 400, `${colours(crop(folded, view))} colours`);
        assert.ok(difference(open_, folded) > 0.05);
        await lab.runTo(0.3);
        await lab.still();
        assert.ok(difference(crop(folded, view), crop(await lab.pixels(), view)) > 0.002, 'the mechanism is out of sight');

        const buttons = (await lab.widgets()).filter(({ role, label }) => role === 'Button' && ['Play', 'Step', 'Reset', 'Controls', 'Plots', 'Menu'].includes(label));
        assert.ok(buttons.length >= 5, buttons.map(({ label }) => label).join(', '));
        for (const { label, rect: [x0, y0, x1, y1] } of buttons) {
            assert.ok(x0 >= 0 && y0 >= 0 && x1 <= size.width && y1 <= size.height, `${label} is outside`);
            assert.ok(y1 - y0 >= FINGER && x1 - x0 >= FINGER, `${label} is ${x1 - x0} x ${y1 - y0}`);
        }
        await lab.tap('Button', 'Play');
        await lab.until(async () => (await lab.state()).playing, 'a finger does not start it');
        await lab.tap('Button', 'Controls');
        await lab.find('Slider', 'Clearance');
        await lab.close();
    });
}
