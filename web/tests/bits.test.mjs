// Every built-in scene with every method gives the same bits in the page's code and in the native program: after 1 s, and after the
// first impacts of those whose many joints take their time.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { native, PAGE } from './harness.mjs';
import { load } from './wasm.mjs';

/** Simulated, s. */
const isMachine = (scene) => ['hexapod', 'delta', 'four-bar', 'suspension', 'press'].includes(scene);
const duration = (scene) => (isMachine(scene) ? 0.02 : 1);
/** A fixed step that light rods on tight balls bear. */
const FINE = 'solver.step=1us';

const wasm = await load(PAGE);
const scenes = wasm.scenes();
const methods = wasm.choices('solver.method');

function inWasm(scene, changes) {
    const run = new wasm.Run(scene, changes);
    run.advanceTo(duration(scene));
    assert.equal(run.time(), duration(scene));
    const hash = run.stateHash();
    run.free();
    return hash;
}

async function natively(scene, changes) {
    const set = changes.flatMap((change) => ['--set', change]);
    const summary = JSON.parse(await native('run', scene, ...set, '--duration', `${duration(scene)}s`, '--summary', 'json', '--quiet'));
    assert.equal(summary.status, 'done');
    return summary.state_hash;
}

test('the page is of the version of the native program', async () => {
    assert.match(await native('--version'), new RegExp(`\\b${wasm.version().replaceAll('.', '\\.')}\\b`));
    assert.equal(scenes.length, 10);
    assert.equal(methods.length, 7);
});

for (const scene of scenes) {
    test(`${scene}: same bits after ${duration(scene)} s with every method`, async () => {
        const hashes = new Set();
        for (const method of methods) {
            const changes = [`solver.method=${method}`, ...(isMachine(scene) ? [FINE] : [])];
            // Started first, so that both sides compute at the same time.
            const other = natively(scene, changes);
            const hash = inWasm(scene, changes);
            assert.equal(hash, await other, method);
            hashes.add(hash);
        }
        // Different methods end in different states: the hash does see the state.
        assert.ok(hashes.size >= methods.length - 1, `${[...hashes]}`);
    });
}

test('the other formulation with changed contacts gives the same bits too', async () => {
    for (const scene of scenes) {
        const step = isMachine(scene) ? FINE : 'solver.step=20us';
        const changes = ['formulation=lagrange', 'contact.clearance=0.4mm', 'contact.friction_velocity=surface', step, 'solver.method=semi-implicit-euler'];
        const other = natively(scene, changes);
        assert.equal(inWasm(scene, changes), await other, scene);
    }
});
