// Every built-in scene with every method gives the same bits in the code of the shipped page and in the native program: after 1 s,
// and after the first impacts of scenes with many joints.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { PAGE } from './harness.mjs';
import { FINE, isSlow, load, sameBits } from './wasm.mjs';

const wasm = await load(PAGE);
const methods = wasm.choices('solver.method');

for (const scene of wasm.scenes()) {
    const seconds = isSlow(scene) ? 0.02 : 1;
    test(`${scene}: same bits after ${seconds} s with every method`, async () => {
        const hashes = new Set();
        for (const method of methods) {
            const changes = [`solver.method=${method}`, ...(isSlow(scene) ? [FINE] : [])];
            hashes.add(await sameBits(wasm, scene, seconds, changes));
        }
        // Different methods end in different states, so the hash depends on the state.
        assert.ok(hashes.size >= methods.length - 1, `${[...hashes]}`);
    });
}
