// Lessons on the page, walked by the keys of a presenter's remote.

import assert from 'node:assert/strict';
import { after, test } from 'node:test';

import { native, open, quit } from './harness.mjs';

after(quit);

/** Names of the built-in lessons. */
async function names() {
    return (await native('lessons')).trim().split('\n').map((line) => line.split(/\s/)[0]);
}

/** What the panel says of where it is: [step, of how many]. */
async function place(lab) {
    const found = await lab.until(async () => {
        const texts = (await lab.widgets()).flatMap(({ label, text }) => [label, text]);
        return texts.map((text) => /^Step (\d+) of (\d+)$/.exec(text ?? '')).find(Boolean);
    }, 'no panel of a lesson');
    return found.slice(1).map(Number);
}

/** Whether some text on show contains `words`. */
const shows = async (lab, words) => (await lab.widgets())
    .some(({ label, text }) => label?.includes(words) || text?.includes(words));

test('all ten lessons are walked to their ends by Page Down and the space bar', async () => {
    const lessons = await names();
    assert.equal(lessons.length, 10);
    // The least that has its panels side by side; in software each frame takes its time by the pixel.
    const lab = await open(`lesson=${lessons[0]}`, { backend: 'webgl', size: { width: 760, height: 480 } });
    for (const name of lessons) {
        if (name !== lessons[0]) await lab.page.evaluate((name) => (location.hash = `#lesson=${name}`), name);
        await lab.until(async () => (await place(lab))[0] === 1, `${name} does not begin`);
        const [, steps] = await place(lab);
        let answers = 0;
        for (let step = 1; step <= steps; step += 1) {
            await lab.until(async () => (await place(lab))[0] === step, `${name}: no step ${step}`);
            // Until the machine is set for it.
            await lab.until(async () => (await lab.state()).replaying === null, `${name}, step ${step}: never set`);
            await lab.frame(3);
            assert.ok(!(await shows(lab, 'It is: ')), `${name}, step ${step}: the answer shows too early`);
            const asks = await shows(lab, 'Predict, then Play');
            if (asks || await shows(lab, 'Play (space)')) {
                const before = (await lab.state()).shown_s;
                await lab.key('Space');
                // As fast as a presenter can make it, and by the longest frames that the machine is moved on by.
                for (let faster = 0; faster < 4; faster += 1) await lab.key('+');
                await lab.pace(250);
                await lab.until(async () => !(await lab.state()).playing, `${name}, step ${step}: never at its end`);
                await lab.pace();
                assert.ok((await lab.state()).shown_s >= before);
                if (asks) {
                    await lab.says('It is: ');
                    answers += 1;
                }
            }
            await lab.key('PageDown');
        }
        assert.deepEqual(await place(lab), [steps, steps], `${name}: something follows the last step`);
        assert.ok(answers >= 2, `${name}: ${answers} answers`);
        await lab.click('Button', 'Leave the lesson');
        assert.ok(!(await shows(lab, `Step ${steps} of`)));
    }
    await lab.close();
});

test('the menu begins a lesson, its buttons turn the pages, and a link keeps the step', async () => {
    const lab = await open('scene=pendulum&play=0', { backend: 'webgl', size: { width: 1000, height: 620 } });
    await lab.click('Button', 'Lessons');
    await lab.click('Button', 'The ball rattles in its gap');
    assert.deepEqual((await place(lab))[0], 1);
    assert.equal((await lab.state()).scene, 'spcmm');
    await lab.click('Button', 'Next');
    assert.deepEqual((await place(lab))[0], 2);
    await lab.key('PageUp');
    assert.deepEqual((await place(lab))[0], 1);
    await lab.key('PageDown');
    const link = await lab.page.evaluate(() => globalThis.jointplay.page.link());
    await lab.close();
    const copy = await open('', { backend: 'webgl', fragment: link });
    await copy.until(async () => (await copy.state()).replaying === null, 'never there');
    assert.deepEqual((await place(copy))[0], 2);
    await copy.close();
});
