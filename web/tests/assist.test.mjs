// The page for those who do not see the canvas: what a screen reader finds on it and does to it.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import { createRequire } from 'node:module';
import { test } from 'node:test';

import { open } from './harness.mjs';

const axe = fs.readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

/** An element by what a screen reader says of it; the laboratory is asked for what it shows now. */
async function element(lab, role, name) {
    await lab.frame(2);
    await lab.page.evaluate(() => globalThis.jointplay.mirror.follow());
    return lab.page.getByRole(role, { name, exact: true }).first();
}

/** What activating an element does without pointer or keyboard. */
async function activate(lab, role, name) {
    const found = await element(lab, role, name);
    await found.evaluate((element) => element.click());
    await lab.frame(2);
}

/** What adjusting a field does without pointer or keyboard: its value becomes `value`, or goes `steps` steps on. */
async function adjust(lab, role, name, { value, steps }) {
    const found = await element(lab, role, name);
    await found.evaluate((element, [value, steps]) => {
        if (steps) element.stepUp(steps);
        else element.value = value;
        element.dispatchEvent(new Event('input', { bubbles: true }));
    }, [value, steps]);
    await lab.frame(2);
}

const reads = async (lab, role, name) => (await element(lab, role, name)).evaluate((element) => element.value);

test('the most important actions work without the canvas', async () => {
    const lab = await open('play=0', { backend: 'webgl' });
    await activate(lab, 'button', 'Play');
    assert.equal((await lab.state()).playing, true);
    await activate(lab, 'button', 'Pause');
    assert.equal((await lab.state()).playing, false);

    await activate(lab, 'button', 'Reset');
    await activate(lab, 'button', 'Step');
    assert.equal((await lab.state()).steps, 1);

    await activate(lab, 'button', 'Next impact');
    await lab.still();
    const impact = (await lab.state()).shown_s;
    assert.ok(impact > 5e-3, `${impact}`);
    // One step of the timeline and back, then straight to an instant.
    await adjust(lab, 'slider', 'Timeline, s', { steps: -1 });
    const before = (await lab.state()).shown_s;
    assert.ok(before > 0 && before < impact, `${before} after ${impact}`);
    await adjust(lab, 'slider', 'Timeline, s', { value: 0 });
    assert.equal((await lab.state()).shown_s, 0);

    await adjust(lab, 'slider', 'Friction coefficient', { value: 0.5 });
    assert.ok(Math.abs((await lab.state()).changed_parameters['contact.friction'] - 0.5) < 5e-3);
    assert.equal(await reads(lab, 'textbox', 'Friction coefficient'), '0.5');
    // A logarithmic slider takes a step of its own, not a hundredth of its range.
    const clearance = Number((await lab.widgets()).find(({ role, label }) => role === 'Slider' && label === 'Clearance').value);
    await adjust(lab, 'slider', 'Clearance', { steps: 1 });
    const wider = Number((await lab.widgets()).find(({ role, label }) => role === 'Slider' && label === 'Clearance').value);
    assert.ok(wider > clearance && wider < 1.2 * clearance, `${clearance} mm to ${wider} mm`);

    await activate(lab, 'button', 'Scene: spcmm');
    await activate(lab, 'button', 'pendulum');
    await lab.until(async () => (await lab.state()).scene === 'pendulum', 'the scene does not change');
    await lab.close();
});

test('the focus is the same on the canvas and for a screen reader', async () => {
    const lab = await open('play=0', { backend: 'webgl' });
    const focused = () => lab.page.evaluate(() => {
        const canvas = document.getElementById('laboratory');
        const element = document.getElementById(canvas.getAttribute('aria-activedescendant') ?? '');
        return document.activeElement === canvas ? element?.getAttribute('aria-label') : document.activeElement.outerHTML;
    });
    // From the page to the laboratory: the canvas keeps the keyboard.
    await (await element(lab, 'button', 'Step')).evaluate((element) => element.focus());
    await element(lab, 'button', 'Step');
    assert.equal(await focused(), 'Step');
    await lab.key('Space');
    assert.equal((await lab.state()).steps, 1);
    // And back.
    await lab.key('Tab');
    const widgets = await lab.widgets();
    const { label } = widgets.find((widget) => widget.focused);
    assert.notEqual(label, 'Step');
    await element(lab, 'button', 'Step');
    assert.ok((await focused()).startsWith(label), `${await focused()} and ${label}`);
    // Typed text goes to a field of eframe's, which has the name of the control.
    await (await element(lab, 'textbox', 'Clearance')).evaluate((element) => element.focus());
    await element(lab, 'textbox', 'Clearance');
    const name = await lab.page.evaluate(() => document.activeElement.getAttribute('aria-label'));
    assert.equal(name, 'Clearance');
    await lab.close();
});

test('elements lie where their controls are, have names, and axe finds nothing serious', async () => {
    for (const size of [{ width: 1280, height: 720 }, { width: 390, height: 780 }]) {
        const lab = await open('play=0', { backend: 'webgl', size });
        await element(lab, 'button', 'Play');
        const places = await lab.page.evaluate(() => Array.from(document.querySelectorAll('#mirror > [data-id]'), (element) => {
            const { left, top, right, bottom } = element.getBoundingClientRect();
            return [element.dataset.id, element.getAttribute('aria-label'), [left, top, right, bottom]];
        }));
        const widgets = new Map((await lab.widgets()).map((widget) => [widget.id, widget]));
        assert.ok(places.length > 20, `${places.length} elements`);
        const nameless = [...widgets.values()].filter(({ label }) => !label.trim());
        assert.deepEqual(nameless.map(({ role, rect }) => `${role} at ${rect}`), []);
        for (const [id, name, rect] of places) {
            const widget = widgets.get(id);
            rect.forEach((x, side) => assert.ok(Math.abs(x - widget.rect[side]) < 1, `${name}: ${rect} and ${widget.rect}`));
        }
        // As a script of the page would be kept out by its policy.
        await lab.page.evaluate(`(() => { ${axe} })()`);
        const found = await lab.page.evaluate(() => globalThis.axe.run());
        const serious = found.violations.filter(({ impact }) => ['serious', 'critical'].includes(impact));
        assert.deepEqual(serious.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(' ')}`), []);
        await lab.close();
    }
});
