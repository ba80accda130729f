// The page's compiled code without a browser: nothing in `Run` (src/web/run.rs) needs one.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';

import { native } from './harness.mjs';

/** Loads the code of the page in `folder`. */
export async function load(folder) {
    // Node takes a file for a module by its ending or by package.json, which the page's folder has not.
    const source = fs.readFileSync(path.join(folder, 'jointplay.js'));
    const bindings = await import(`data:text/javascript;base64,${source.toString('base64')}`);
    bindings.initSync({ module: fs.readFileSync(path.join(folder, 'jointplay_bg.wasm')) });
    return bindings;
}

/** State hash of `scene` after `seconds` with `changes`, which the page's code and the native program agree on. */
export async function sameBits(wasm, scene, seconds, changes) {
    // Started first, so that both sides compute at the same time.
    const set = changes.flatMap((change) => ['--set', change]);
    const other = native('run', scene, ...set, '--duration', `${seconds}s`, '--summary', 'json', '--quiet');
    const run = new wasm.Run(scene, changes);
    run.advanceTo(seconds);
    assert.equal(run.time(), seconds);
    const hash = run.stateHash();
    run.free();
    const summary = JSON.parse(await other);
    assert.equal(summary.status, 'done');
    assert.equal(hash, summary.state_hash, `${scene}, ${changes}`);
    return hash;
}

/** Scenes whose many loose joints take their time. */
export const isMachine = (scene) => ['hexapod', 'delta', 'four-bar', 'suspension', 'press'].includes(scene);
/** A fixed step that light rods on tight balls bear. */
export const FINE = 'solver.step=1us';
