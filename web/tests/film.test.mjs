// Films that the page makes can be played by a browser. tests/interface/film.rs tests their contents.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import { after, test } from 'node:test';

import { blank, colours, open, quit } from './harness.mjs';
import { play } from './play.mjs';

after(quit);

test('the page makes a film of its timeline, which a browser plays, and keeps its own state', async () => {
    const lab = await open('scene=pendulum&play=0', { backend: 'webgl' });
    await lab.runTo(0.02);
    const before = await lab.state();
    const download = lab.page.waitForEvent('download');
    let file;
    download.then((download) => (file = download));
    await lab.click('Button', 'Save');
    await lab.click('Button', 'Film…');
    await lab.click('ComboBox', 'Size of the film');
    await lab.click('Button', '640 × 360');
    await lab.draw();
    await lab.click('Button', 'Make film');
    await lab.until(() => file, 'no film');
    const after = await lab.state();
    for (const key of ['state_hash', 'shown_s', 'playing']) assert.equal(after[key], before[key], key);
    assert.equal(file.suggestedFilename(), 'pendulum.mp4');
    const bytes = fs.readFileSync(await file.path());
    await lab.close();
    // 20 ms at a fifth of real time with 30 frames per second.
    const empty = await blank({ ownTime: true });
    const film = await play(empty, bytes, [0.05]);
    assert.deepEqual([film.width, film.height], [640, 360]);
    assert.ok(Math.abs(film.duration - 4 / 30) < 1e-3, `${film.duration} s`);
    assert.ok(colours(film.pictures[0]) > 200, 'the film is empty');
    await empty.close();
});
