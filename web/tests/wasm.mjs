// The page's compiled code without a browser: nothing in `Run` (src/web/run.rs) needs one.

import fs from 'node:fs';
import path from 'node:path';

/** Loads the code of the page in `folder`. */
export async function load(folder) {
    // Node takes a file for a module by its ending or by package.json, which the page's folder has not.
    const source = fs.readFileSync(path.join(folder, 'jointplay.js'));
    const bindings = await import(`data:text/javascript;base64,${source.toString('base64')}`);
    bindings.initSync({ module: fs.readFileSync(path.join(folder, 'jointplay_bg.wasm')) });
    return bindings;
}
