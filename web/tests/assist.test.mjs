// The page for users who do not see the canvas: the elements that a screen reader finds, and its actions on them.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import { createRequire } from 'node:module';
import { after, test } from 'node:test';

import { open, quit } from './harness.mjs';

after(quit);

const axe = fs.readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

const valueOf = async (lab, role, name) => (await lab.element(role, name)).evaluate((element) => element.value);

test('the most important actions work without pointer and canvas, and the canvas and a screen reader agree on the focus', async () => {
    const lab = await open('play=0', { backend: 'webgl' });
    // Play is among the first stops of Tab.
    await lab.page.evaluate(() => document.activeElement.blur());
    const stops = [];
    while (!stops.includes('Play')) {
        assert.ok(stops.length < 10, `Play is not among the first ten stops: ${stops}`);
        await lab.key('Tab');
        stops.push((await lab.widgets()).find(({ focused }) => focused)?.label);
    }
    await lab.key('Space');
    assert.equal((await lab.state()).playing, true);
    await lab.key('Space');
    await lab.activate('button', 'Restart');

    await lab.activate('button', 'Play');
    assert.equal((await lab.state()).playing, true);
    await lab.activate('button', 'Pause');
    assert.equal((await lab.state()).playing, false);
    await lab.activate('button', 'Restart');
    await lab.activate('button', 'Step');
    assert.equal((await lab.state()).steps, 1);

    await lab.activate('button', 'Next impact');
    await lab.settle();
    const impact = (await lab.state()).shown_s;
    assert.ok(impact > 5e-3, `${impact}`);
    // Back by one step of the timeline, then directly to an instant.
    await lab.adjust('slider', 'Timeline, s', { steps: -1 });
    const before = (await lab.state()).shown_s;
    assert.ok(before > 0 && before < impact, `${before} after ${impact}`);
    await lab.runTo(0.0435);
    const spokenValue = async (name) => (await lab.element('slider', name)).getAttribute('aria-valuetext');
    assert.equal(await spokenValue('Timeline, s'), '43.5 milliseconds');
    assert.equal(await spokenValue('Clearance'), '0.3 millimetres');
    assert.equal(await spokenValue('Friction coefficient'), '0.15');
    assert.equal(await spokenValue('Time scale'), '1 to 20');
    assert.match(await spokenValue('Height of the plots'), /^\d+ percent$/);
    await lab.adjust('slider', 'Timeline, s', { value: 0 });
    assert.equal((await lab.state()).shown_s, 0);

    // A plot is a sentence; with the focus on it, the arrow keys read out its values.
    const plot = lab.page.getByRole('img', { name: /^Plot of Normal force: 0 to [\d.]+ milliseconds, from 0 to [\d.]+ newtons, largest in S\d at [\d.]+ milliseconds$/ });
    await plot.evaluate((element) => element.focus());
    await lab.key('ArrowRight');
    await lab.key('ArrowRight');
    const values = /^S1 [\d. to]+ newtons, S2 [\d. to]+ newtons, S3 [\d. to]+ newtons at [\d.]+ milliseconds$/;
    const aloud = lab.page.locator('#report-aloud');
    await lab.until(async () => {
        await lab.page.evaluate(() => globalThis.jointplay.mirror.follow());
        return values.test(await aloud.textContent());
    }, 'the values of a plot are not read out');

    await lab.adjust('slider', 'Friction coefficient', { value: 0.5 });
    assert.ok(Math.abs((await lab.state()).changed_parameters['contact.friction'] - 0.5) < 5e-3);
    assert.equal(await valueOf(lab, 'textbox', 'Friction coefficient'), '0.5');
    // A logarithmic slider has its own step, not a hundredth of its range.
    const clearance = async () => Number((await lab.find('Slider', 'Clearance')).value);
    const narrow = await clearance();
    await lab.adjust('slider', 'Clearance', { steps: 1 });
    const wider = await clearance();
    assert.ok(wider > narrow && wider < 1.2 * narrow, `${narrow} mm to ${wider} mm`);

    await lab.activate('button', 'Restart');
    const focused = () => lab.page.evaluate(() => {
        const canvas = document.getElementById('laboratory');
        const element = document.getElementById(canvas.getAttribute('aria-activedescendant') ?? '');
        return document.activeElement === canvas ? element?.getAttribute('aria-label') : document.activeElement.outerHTML;
    });
    // A focused element passes the focus to its control; the keyboard focus stays on the canvas.
    await (await lab.element('button', 'Step')).evaluate((element) => element.focus());
    await lab.element('button', 'Step');
    assert.equal(await focused(), 'Step');
    await lab.key('Space');
    assert.equal((await lab.state()).steps, 1);
    // And in the other direction.
    await lab.key('Tab');
    const { label } = (await lab.widgets()).find((widget) => widget.focused);
    assert.notEqual(label, 'Step');
    await lab.element('button', 'Step');
    assert.ok((await focused()).startsWith(label), `${await focused()} and ${label}`);
    // Typed text goes to eframe's hidden field, which gets the name of the control.
    await (await lab.element('textbox', 'Clearance')).evaluate((element) => element.focus());
    await lab.element('textbox', 'Clearance');
    const name = await lab.page.evaluate(() => document.activeElement.getAttribute('aria-label'));
    assert.equal(name, 'Clearance');
    await lab.close();
});

test('a screen reader hears events; elements have names and the places of their controls; axe finds no violations', async () => {
    const [wide, phone] = [{ width: 1280, height: 720 }, { width: 390, height: 780 }];
    const lab = await open('scene=pendulum', { backend: 'webgl', size: phone });
    await lab.until(async () => /Running at time scale 1:5[,. ]/.test(await lab.summary()), 'no summary');
    const first = await lab.summary();
    await lab.until(async () => (await lab.summary()) !== first, 'the summary never changes');
    await lab.key('Space');
    await lab.until(async () => /Paused at .*S1 /.test(await lab.summary()), 'the summary does not say that it is paused');
    const aloud = lab.page.locator('[aria-live=polite]');
    await lab.until(async () => (await aloud.textContent()) === (await lab.summary()), 'what happens is not read out');
    // Outside the canvas, and visible to a screen reader. Elements follow the picture, within some frames.
    const outline = () => lab.page.locator('body').ariaSnapshot();
    await lab.until(async () => (await outline()).includes('region "The machine"'), 'the machine has no region');
    const tree = await outline();
    for (const part of ['What the mechanism is doing', 'Scene and files', 'Transport', 'The machine']) {
        assert.ok(tree.includes(`region "${part}"`), `${part} is not in ${tree}`);
    }
    assert.match(tree, /Paused at/);

    // Evaluated, because the page's policy would block an added script.
    await lab.page.evaluate(`(() => { ${axe} })()`);
    const clean = async (state) => {
        await lab.frame(2);
        await lab.page.evaluate(() => globalThis.jointplay.mirror.follow());
        const wordless = await lab.page.locator('#mirror [type=range]:not([aria-valuetext])').evaluateAll((all) => all.map(({ outerHTML }) => outerHTML));
        assert.deepEqual(wordless, [], `no words for a value ${state}`);
        const { violations } = await lab.page.evaluate(() => globalThis.axe.run());
        assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(' ')}`), [], state);
    };
    for (const size of [phone, wide]) {
        await lab.page.setViewportSize(size);
        await lab.frame(3);
        // The elements are updated a moment after the controls.
        let misplaced;
        await lab.until(async () => {
            const places = await lab.page.evaluate(() => Array.from(document.querySelectorAll('#mirror [data-id]:not(section)'), (element) => {
                const { left, top, right, bottom } = element.getBoundingClientRect();
                return [element.dataset.id, element.getAttribute('aria-label'), [left, top, right, bottom]];
            }));
            const widgets = new Map((await lab.widgets()).map((widget) => [widget.id, widget.rect]));
            misplaced = places.filter(([id, , rect]) => !rect.every((x, side) => Math.abs(x - widgets.get(id)?.[side]) < 1));
            return places.length > 20 && misplaced.length === 0;
        }, () => `misplaced elements: ${JSON.stringify(misplaced)}`);
        const nameless = (await lab.widgets()).filter(({ label }) => !label.trim());
        assert.deepEqual(nameless.map(({ role, rect }) => `${role} at ${rect}`), []);
        await clean(`as opened, ${size.width} pixels wide`);
    }
    await lab.key('KeyB');
    await lab.element('heading', 'Order or chaos');
    await clean('with the bench');
    await lab.key('F1');
    await lab.element('dialog', 'Keyboard shortcuts');
    await clean('with a dialog');
    await lab.key('Escape');
    await lab.key('F5');
    await lab.element('button', 'Leave');
    await clean('as a presentation');
    await lab.key('F5');
    await lab.activate('button', 'Lessons');
    await lab.activate('button', 'Why the first impact comes when it does');
    await lab.element('region', 'Lesson');
    await clean('with a lesson');
    await lab.close();
});

test('dialogs take the focus and Esc gives it back, and a lesson is read out with its answer and its next step', async () => {
    const lab = await open('lesson=first-impact&step=2', { backend: 'webgl', size: { width: 1000, height: 620 } });
    const focused = async () => (await lab.widgets()).find((widget) => widget.focused)?.label;
    await lab.until(async () => /Step 2 of 7: Nothing holds the platform\./.test(await lab.summary()), 'the step is not read out');
    await lab.activate('button', 'Keyboard shortcuts');
    await lab.until(async () => (await focused()) === 'Close', 'the dialog does not take the focus');
    await lab.key('Escape');
    await lab.until(async () => (await focused()) === 'Keyboard shortcuts', 'Esc does not give the focus back');
    await lab.activate('radio', 'It falls freely');
    await lab.activate('button', 'Play');
    const answered = /As predicted: It falls freely\. .* Next step: Half g t squared\./;
    const aloud = lab.page.locator('[aria-live=polite]');
    await lab.until(async () => answered.test(await aloud.textContent()), 'the answer is not read out');
    await lab.close();
});

test('what is scrolled out of sight has no place where something else is', async () => {
    const lab = await open('scene=spcmm&play=0', { backend: 'webgl', size: { width: 390, height: 600 } });
    await lab.element('slider', 'Restitution');
    const play = (await lab.find('Button', 'Play')).rect;
    const timeline = (await lab.find('Slider', 'Timeline, s')).rect;
    const overlaps = ([a0, a1, a2, a3], [b0, b1, b2, b3]) => Math.min(a2, b2) - Math.max(a0, b0) > 1 && Math.min(a3, b3) - Math.max(a1, b1) > 1;
    const inside = (await lab.widgets()).filter(({ role }) => ['Slider', 'TextInput', 'Button', 'DisclosureTriangle', 'ComboBox'].includes(role));
    const others = inside.filter(({ label, role }) => !(label === 'Play' || (role === 'Slider' && label === 'Timeline, s')));
    const covering = others.filter(({ rect }) => overlaps(rect, play) || overlaps(rect, timeline));
    assert.deepEqual(covering.map(({ role, label }) => `${role} ${label}`), []);
    await lab.close();
});
