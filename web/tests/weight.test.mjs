// Size of the page, compressed as it is shipped.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { test } from 'node:test';

import { PAGE } from './harness.mjs';

const LICENCES = 'licences.txt';

test('the page weighs at most 4 MB as a browser downloads it', (t) => {
    const LIMIT = 4_000_000;
    // The preview is loaded only by other sites.
    const files = fs.readdirSync(PAGE).filter((file) => !/\.(br|gz)$/.test(file) && file !== 'preview.png');
    assert.ok(files.includes('jointplay_bg.wasm'));
    const size = (file) => fs.statSync(path.join(PAGE, `${file}.br`)).size;
    // The licences are loaded on request, and once the page runs, for offline use.
    const [licences, limit] = [size(LICENCES), 20_000];
    t.diagnostic(`${LICENCES}: ${licences} bytes of ${limit}`);
    assert.ok(licences <= limit, `${LICENCES}: ${licences} bytes`);
    const sizes = files.filter((file) => file !== LICENCES).map((file) => [file, size(file)]);
    for (const [file, size] of sizes) t.diagnostic(`${file}: ${size} bytes with brotli`);
    const sum = sizes.reduce((sum, [, size]) => sum + size, 0);
    t.diagnostic(`together: ${sum} bytes of ${LIMIT}`);
    assert.ok(sum <= LIMIT, `${sum} bytes`);
});
