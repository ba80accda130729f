// The page's code and the native program give the same bits, for every built-in scene, with methods and formulations in turn.
// every-bit.test.mjs combines every scene with every method.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { native, PAGE } from './harness.mjs';
import { FINE, isSlow, load, sameBits } from './wasm.mjs';

test('every scene, method and formulation gives the same bits as in the native program of this version', async () => {
    const wasm = await load(PAGE);
    assert.match(await native('--version'), new RegExp(`\\b${wasm.version().replaceAll('.', '\\.')}\\b`));
    const [scenes, methods] = [wasm.scenes(), wasm.choices('solver.method')];
    assert.equal(scenes.length, 13);
    assert.equal(methods.length, 5);
    const hashes = new Set();
    for (const [at, scene] of scenes.entries()) {
        const lagrange = ['formulation=lagrange', 'contact.clearance=0.4mm', 'contact.friction_velocity=surface'];
        const changes = [`solver.method=${methods[at % methods.length]}`, ...(at % 2 ? lagrange : []), ...(isSlow(scene) ? [FINE] : [])];
        hashes.add(await sameBits(wasm, scene, isSlow(scene) ? 0.01 : 0.5, changes));
    }
    // The hash depends on the state.
    assert.equal(hashes.size, scenes.length);
});
