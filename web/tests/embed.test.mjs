// The page in a frame: its contents, the input that it leaves to the embedding page, and their messages.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { after, test } from 'node:test';
import { deflateRawSync } from 'node:zlib';

import { blank, colours, open, quit, ROOT, serve } from './harness.mjs';

after(quit);

/** Frames on one page. */
const COUNT = 8;

/** Loads an embedding page into `lab`; in its `body`, `{page}` stands for the address of the laboratory. */
async function embed(lab, body) {
    const address = await serve();
    const html = `<!doctype html><title>Course</title><style>body { margin: 0 } p { height: 120px } iframe { border: 0; display: block }</style>${body.replaceAll('{page}', address)}`;
    await lab.page.route('**/course.html', (route) => route.fulfill({ contentType: 'text/html', body: html }));
    await lab.page.goto(`${address}course.html`);
}

/** Whether the laboratory of a frame is running. */
const isReady = (frame) => frame.evaluate(() => Boolean(globalThis.jointplay?.ready));

/** The frames of a page, once `count` of them are running. */
async function runningFrames(lab, count = 1) {
    const frames = lab.page.frames().slice(1);
    await lab.until(async () => (await Promise.all(frames.map(isReady))).filter(Boolean).length >= count, 'the frames do not start');
    return frames;
}

test('the copied line shows the same state in another page, which keeps focus, wheel and Tab', async () => {
    const lab = await open('scene=pendulum&c=0.5mm&play=0', { backend: 'webgl', ownTime: true });
    await lab.runTo(0.01);
    const { state_hash: hash } = await lab.state();
    await lab.click('Button', 'Save');
    await lab.click('Button', 'Embed');
    const line = await lab.until(() => lab.page.evaluate(() => navigator.clipboard.readText()), 'nothing on the clipboard');
    await embed(lab, `<p><a id="before" href="#">before</a></p>${line.replace(/width="\d+" height="\d+"/, 'width="640" height="360"')}
        <p><a id="after" href="#">after</a></p><p style="height: 2000px">more</p>`);
    const [frame] = await runningFrames(lab);
    await lab.until(async () => (await frame.evaluate(() => JSON.parse(globalThis.jointplay.page.state()).state_hash)) === hash, 'another state');
    assert.equal(await frame.evaluate(() => document.querySelector('canvas').hidden), false);
    const { page } = lab;
    const parentState = () => page.evaluate(() => [document.activeElement.tagName, document.activeElement.id, scrollY]);
    assert.deepEqual(await parentState(), ['BODY', '', 0]);

    // Tab enters the frame, passes its controls, and leaves it.
    await page.focus('#before');
    let tabs = 0;
    const visited = new Set();
    while ((await parentState())[1] !== 'after') {
        tabs += 1;
        const widgets = await frame.evaluate(() => JSON.parse(globalThis.jointplay.page.widgets() || '[]'));
        const focused = widgets.find((widget) => widget.focused && widget.focusable);
        if (focused) visited.add(focused.label);
        assert.ok(tabs < 60, `Tab stays within: ${[...visited]}`);
        await page.keyboard.press('Tab');
        await lab.frame(3);
    }
    assert.ok(visited.has('Clearance') && visited.has('Play'), `${[...visited]}`);
    await page.evaluate(() => scrollTo(0, 0));

    // The wheel scrolls the embedding page until the laboratory is clicked, and again after Escape.
    const scrolls = async () => {
        const [, , before] = await parentState();
        await page.mouse.move(450, 250);
        await page.mouse.wheel(0, 100);
        for (let k = 0; k < 10; k += 1) await lab.frame(2);
        const [, , now] = await parentState();
        await page.evaluate((before) => scrollTo(0, before), before);
        return now !== before;
    };
    assert.ok(await scrolls(), 'the frame takes the wheel');
    await page.mouse.click(450, 250);
    assert.ok(!(await scrolls()), 'the frame does not take the wheel');
    await page.keyboard.press('Escape');
    assert.ok(await scrolls(), 'the frame keeps the wheel');
    await lab.close();
});

test('the documented example works, keys without a function reach the embedding page, and a bad link is explained', async () => {
    const lab = await blank({ size: { width: 820, height: 520 }, ownTime: true });
    const text = fs.readFileSync(path.join(ROOT, 'docs/embedding.md'), 'utf8');
    const [html, js] = ['html', 'js'].map((language) => text.split(`\`\`\`${language}\n`)[1].split('```')[0]);
    await embed(lab, `${html.replace('https://example.org/lab/', '{page}')}<script>${js}</script>`);
    const [frame] = await runningFrames(lab);
    const state = (frame) => frame.evaluate(() => JSON.parse(globalThis.jointplay.page.state()));
    await lab.until(async () => {
        const { playing, changed_parameters: changed } = await state(frame);
        return playing && changed['contact.clearance'] === '0.5 mm';
    }, 'the messages of the example are lost');
    await lab.page.evaluate(() => {
        globalThis.keys = [];
        addEventListener('message', ({ data }) => data.event === 'key' && globalThis.keys.push(data.code));
    });
    await lab.page.mouse.click(500, 150);
    for (const key of ['PageDown', 'Space', 'b', 'Control+Alt+k', 'PageUp']) await lab.page.keyboard.press(key);
    await lab.until(async () => (await lab.page.evaluate(() => globalThis.keys)).includes('PageUp'), 'no key is reported');
    const keys = await lab.page.evaluate(() => globalThis.keys);
    assert.deepEqual(keys.filter((code) => !/^(Control|Alt)/.test(code)), ['PageDown', 'KeyK', 'PageUp']);

    await embed(lab, '<iframe src="{page}?embed=controls&scene=pendulun&renderer=webgl" width="320" height="240"></iframe>');
    const [bad] = await runningFrames(lab);
    const { playing, time_s: time } = await state(bad);
    assert.deepEqual([playing, time], [false, 0]);
    assert.ok(await bad.evaluate(() => globalThis.jointplay.page.refused()));
    const labels = () => bad.evaluate(() => JSON.parse(globalThis.jointplay.page.widgets() || '[]').map(({ label }) => label));
    await lab.until(async () => (await labels()).some((label) => label.includes('did you mean `pendulum`')), 'no explanation');
    assert.ok((await labels()).includes('Clearance'), 'the panels of the link are not there');
    assert.match(bad.url(), /\?embed=controls&scene=pendulun&renderer=webgl$/);

    assert.deepEqual(lab.errors, []);
    // A frame without an origin gets no module from a server that does not allow it.
    await lab.page.route('**/main.js*', (route) => route.abort());
    await embed(lab, '<iframe sandbox="allow-scripts" src="{page}?embed" width="320" height="240"></iframe>');
    const sealed = () => lab.page.frameLocator('iframe').locator('#sealed');
    await lab.until(async () => (await sealed().count()) > 0 && (await sealed().isVisible()), 'no explanation');
    assert.match(await sealed().textContent(), /allow-same-origin/);
    await lab.close({ errors: true });
});

test('the embedding page opens, sets, plays and pauses by messages, and receives events', async () => {
    const lab = await blank({ size: { width: 340, height: 240 }, ownTime: true });
    await embed(lab, '<iframe src="{page}?embed&scene=pendulum&play=0&renderer=webgl" width="320" height="200"></iframe>');
    await lab.page.evaluate(() => {
        globalThis.received = [];
        addEventListener('message', ({ data }) => data.jointplay === 1 && received.push(data));
        globalThis.send = (message) => frames[0].postMessage({ jointplay: 1, ...message }, '*');
    });
    const [frame] = await runningFrames(lab);
    const received = (event) => lab.page.evaluate((event) => globalThis.received.filter((message) => message.event === event), event);
    const send = (message) => lab.page.evaluate((message) => globalThis.send(message), message);
    const state = async () => {
        const before = (await received('state')).length;
        await send({ do: 'state' });
        return (await lab.until(async () => (await received('state'))[before], 'no state')).state;
    };
    await send({ do: 'set', key: 'contact.clearance', value: '0.5 mm' });
    await send({ do: 'set', key: 'contact.clearence', value: '0.5 mm' });
    const [problem] = await lab.until(async () => ((await received('problem')).length ? received('problem') : null), 'no problem');
    assert.match(problem.text, /contact\.clearance/);
    await send({ do: 'set' });
    const missing = await lab.until(async () => (await received('problem'))[1], 'a message without a key is accepted');
    assert.equal(missing.text, '`key` is missing');
    await send({ do: 'jump' });
    await send({ do: 'open', link: 'scene=pendulun' });
    await lab.until(async () => (await received('problem')).length === 4, 'an unknown message or a bad link is accepted');
    assert.match((await received('problem'))[2].text, /open, set, play, pause, reset, state/);
    assert.match((await received('problem'))[3].text, /did you mean `pendulum`/);

    await send({ do: 'open', link: 'scene=spcmm&scale=0.02&play=0' });
    await lab.until(async () => (await state()).scene === 'spcmm', 'the link is not opened');
    await send({ do: 'play' });
    await lab.until(async () => (await received('impact')).length > 0, 'no impact');
    await send({ do: 'pause' });
    await lab.until(async () => !(await state()).playing, 'it does not pause');
    const { shown_s: shown } = await state();
    await lab.until(async () => (await received('time')).some(({ time_s: time, playing }) => time === shown && !playing), 'the last instant is not reported');
    const own = await frame.evaluate(() => JSON.parse(globalThis.jointplay.page.impacts(0)));
    await lab.until(async () => (await received('impact')).length === own.length, 'other impacts');
    for (const [at, { joint, end_s: end, peak_N: peak }] of (await received('impact')).entries()) {
        assert.deepEqual([joint, end, peak], [own[at].joint, own[at].end_s, own[at].peak_N]);
    }
    await send({ do: 'reset' });
    await lab.until(async () => (await state()).shown_s === 0, 'no reset');

    // The embedding page is responsible for changes of the user's own scene: leaving asks nothing.
    const mine = fs.readFileSync(path.join(ROOT, 'assets/scenes/pendulum.toml'), 'utf8').replace(/^name = .*$/m, 'name = "mine"');
    await send({ do: 'open', link: `file=mine.toml&text=${deflateRawSync(mine).toString('base64url')}&play=0` });
    await lab.until(async () => (await state()).scene === 'mine', 'the own scene is not opened');
    // Changes count from the first picture on.
    await lab.frame(5);
    await send({ do: 'set', key: 'contact.clearance', value: '0.4 mm' });
    await lab.until(() => frame.evaluate(() => globalThis.jointplay.page.unsaved()), 'the change is not seen');
    assert.ok(await frame.evaluate(() => dispatchEvent(new Event('beforeunload', { cancelable: true }))));
    await lab.close();
});

test('any message whatever leaves the frame answering, before its first picture, later, and out of sight', async () => {
    const lab = await blank({ size: { width: 340, height: 240 }, ownTime: true });
    await embed(lab, `<iframe src="{page}?embed&scene=pendulum&play=0&renderer=webgl" width="320" height="200"></iframe>
        <p style="height: 3000px"></p>`);
    await lab.page.evaluate(() => {
        globalThis.received = [];
        addEventListener('message', ({ data }) => data.jointplay === 1 && received.push(data));
        const send = (message, transfer) => frames[0].postMessage(message, '*', transfer);
        const circle = { jointplay: 1, do: 'circle' };
        circle.circle = circle;
        const refused = () => [
            { do: 'open', link: { toString: 1, valueOf: 1 } },
            { do: 'open', link: [{ toString: 1, valueOf: 1 }] },
            { do: 'open', link: 'x'.repeat(1e6) },
            { do: 'open' },
            { do: 'open', link: 10n },
            { do: 'set', key: { toString: 1, valueOf: 1 }, value: '1' },
            { do: 'set', key: 'contact.clearance', value: { toString: 1, valueOf: 1 } },
            { do: 'set', key: '__proto__', value: null },
            { do: { toString: 1, valueOf: 1 } },
            { do: 'constructor' },
            { do: null },
            {},
        ];
        globalThis.disturb = () => {
            // Ignored.
            for (const message of [null, 'text', [], new Map(), { jointplay: { valueOf: 1 } }]) send(message);
            for (const message of refused()) send({ jointplay: 1, ...message });
            const { port1: port } = new MessageChannel();
            send({ jointplay: 1, do: 'port', port }, [port]);
            send(circle);
            send(Object.assign([], { jointplay: 1, do: 'list' }));
            send({ jointplay: 1, do: 'state' });
            return refused().length + 3;
        };
    });
    const received = (event) => lab.page.evaluate((event) => globalThis.received.filter((message) => message.event === event).length, event);
    let [problems, states] = [0, 0];
    const survives = async () => {
        problems += await lab.page.evaluate(() => globalThis.disturb());
        states += 1;
        await lab.until(async () => (await received('state')) === states, 'the frame is silent');
        assert.equal(await received('problem'), problems);
    };
    await survives();
    await runningFrames(lab);
    await survives();
    await lab.page.evaluate(() => scrollTo(0, document.body.scrollHeight));
    await lab.until(() => lab.page.frames()[1].evaluate(() => !globalThis.jointplay.ready), 'it keeps its graphics out of sight');
    await survives();
    await lab.close();
});

test('frames out of sight hold no graphics, and continue from the same state when they are visible again', async () => {
    const frame = '<iframe src="{page}?embed&scene=pendulum&t=10ms&renderer=webgl" width="300" height="200"></iframe>';
    const lab = await blank({ size: { width: 320, height: 300 }, ownTime: true });
    await embed(lab, frame.repeat(COUNT));
    const frames = await runningFrames(lab, 2);
    assert.equal(frames.length, COUNT);
    const holding = () => Promise.all(frames.map((frame) => frame.evaluate(() => {
        // One that was never visible has no context, and getContext would create it.
        if (!globalThis.jointplay?.starts) return false;
        return !document.getElementById('laboratory').getContext('webgl2').isContextLost();
    })));
    const count = async () => (await holding()).filter(Boolean).length;
    await lab.until(async () => (await count()) === 2, 'not only the two visible frames hold graphics');
    const state = () => frames[0].evaluate(() => JSON.parse(globalThis.jointplay.page.state()));
    await lab.until(async () => (await state()).shown_s === 0.01, 'the instant is not reached');
    const before = await state();
    await lab.page.evaluate(() => scrollTo(0, document.body.scrollHeight));
    await lab.until(async () => {
        const now = await holding();
        return now[COUNT - 1] && !now[0] && !now[1] && now.filter(Boolean).length <= 3;
    }, 'those out of sight keep their graphics');
    await lab.until(() => isReady(frames[COUNT - 1]), 'the last does not draw');
    for (const frame of [lab.page, frames[0]]) await frame.evaluate(() => (globalThis.drawsNothing = false));
    await lab.page.evaluate(() => scrollTo(0, 0));
    await lab.until(() => isReady(frames[0]), 'the first does not come back');
    await lab.until(async () => colours(await lab.pixels({ x: 0, y: 0, width: 300, height: 200 })) > 200, 'it shows nothing');
    assert.ok((await holding())[0]);
    const { shown_s: shown, state_hash: hash } = await state();
    assert.deepEqual([shown, hash], [before.shown_s, before.state_hash]);
    await lab.close();
});
