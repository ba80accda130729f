// The page's compiled code without a browser, which `Run` (src/web/run.rs) does not need.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';

import { native } from './harness.mjs';

/** Loads the code of the page in `folder`. */
export async function load(folder) {
    // Node recognises a module by its extension or by package.json; the page's folder has neither.
    const source = fs.readFileSync(path.join(folder, 'jointplay.js'));
    const bindings = await import(`data:text/javascript;base64,${source.toString('base64')}`);
    bindings.initSync({ module: fs.readFileSync(path.join(folder, 'jointplay_bg.wasm')) });
    return bindings;
}

/** State hash of `scene` after `seconds` with `changes`; asserts that the page's code and the native program agree on it. */
export async function sameBits(wasm, scene, seconds, changes) {
    // Started first, so that both compute at the same time.
    const set = changes.flatMap((change) => ['--set', change]);
    const nativeRun = native('run', scene, ...set, '--duration', `${seconds}s`, '--summary', 'json', '--quiet');
    const run = new wasm.Run(scene, changes);
    run.advanceTo(seconds);
    assert.equal(run.time(), seconds);
    const hash = run.stateHash();
    run.free();
    const summary = JSON.parse(await nativeRun);
    assert.equal(summary.status, 'done');
    assert.equal(hash, summary.state_hash, `${scene}, ${changes}`);
    return hash;
}

/** Scenes with many loose joints, which run slowly. */
export const isSlow = (scene) => ['hexapod', 'delta', 'four-bar', 'suspension', 'press', 'slider-crank-worn', 'excavator'].includes(scene);
/** A fixed step that is stable for light rods on tight balls. */
export const FINE = 'solver.step=1us';
