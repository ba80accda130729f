// Speed of the page on this machine: physics in wasm against the native program, and the time to the first picture.
//
//     ./run web --bench

import { spawnSync } from 'node:child_process';
import path from 'node:path';

const [folder, native] = process.argv.slice(2).map((file) => path.resolve(file));
process.env.PAGE = folder;
const { open, quit } = await import('./tests/harness.mjs');
const { load } = await import('./tests/wasm.mjs');

/** Scene, method and simulated seconds: long enough that the start does not count. */
const RUNS = [
    ['spcmm', 'automatic', 60],
    ['spcmm', 'rk4', 1],
    ['spcmm', 'dopri5', 2],
    ['spcmm', 'radau5', 12],
    ['pendulum', 'automatic', 40],
    ['slider-crank', 'automatic', 6],
    ['chain', 'rk4', 0.3],
    ['chain', 'radau5', 0.04],
];
/** Both sides run in turn so often; the median of the ratios counts. */
const REPEATS = 5;
/** Physics in wasm: at least this part of the native speed. */
const LEAST_RATIO = 0.5;
/** First picture after the start of the load, s. */
const LATEST_PICTURE = 5;

// Processor time on both sides: another program on this machine disturbs it least.
function natively(scene, method, seconds) {
    const command = [native, 'run', scene, '--set', `solver.method=${method}`, '--duration', `${seconds}s`, '--summary', 'json', '--quiet'];
    const timed = spawnSync('bash', ['-c', 'TIMEFORMAT=%U; time "$@"', 'bash', ...command], { encoding: 'utf8', env: { ...process.env, LC_ALL: 'C' } });
    if (timed.status !== 0) throw new Error(timed.stderr);
    return [Number(timed.stderr.trim().split('\n').at(-1)), JSON.parse(timed.stdout).state_hash];
}

function inWasm(wasm, scene, method, seconds) {
    const run = new wasm.Run(scene, [`solver.method=${method}`]);
    const start = process.cpuUsage();
    run.advanceTo(seconds);
    const { user } = process.cpuUsage(start);
    const hash = run.stateHash();
    run.free();
    return [user / 1e6, hash];
}

const median = (numbers) => numbers.slice().sort((a, b) => a - b)[numbers.length >> 1];

let good = true;
const wasm = await load(folder);
console.log('physics: processor time in seconds, median of', REPEATS);
console.log('scene            method            simulated     native       wasm   speed of wasm');
const ratios = [];
for (const [scene, method, seconds] of RUNS) {
    // The engine compiles twice: quickly at first, well once a function has run for a while.
    inWasm(wasm, scene, method, seconds);
    const pairs = Array.from({ length: REPEATS }, () => {
        const [own, hash] = natively(scene, method, seconds);
        const [other, same] = inWasm(wasm, scene, method, seconds);
        if (hash !== same) throw new Error(`${scene}, ${method}: different bits`);
        return [own, other];
    });
    const ratio = median(pairs.map(([own, other]) => own / other));
    ratios.push(ratio);
    const figures = [0, 1].map((side) => median(pairs.map((pair) => pair[side])).toFixed(3).padStart(10));
    console.log(scene.padEnd(16), method.padEnd(16), `${seconds} s`.padStart(10), ...figures, `  ${ratio.toFixed(2)} of native`);
}
const mean = Math.exp(ratios.reduce((sum, ratio) => sum + Math.log(ratio), 0) / ratios.length);
console.log(`together: ${mean.toFixed(2)} of native (geometric mean), least ${Math.min(...ratios).toFixed(2)}; wanted: at least ${LEAST_RATIO}`);
good &&= mean >= LEAST_RATIO;

console.log('first picture after the start of the load, software rendering:');
for (const backend of ['webgl', 'webgpu']) {
    for (const size of [{ width: 900, height: 600 }, { width: 1280, height: 720 }]) {
        const lab = await open('', { backend, size, ownTime: true });
        const at = await lab.page.evaluate(() => performance.getEntriesByName('first picture')[0].startTime / 1000);
        await lab.close();
        console.log(`${backend.padEnd(7)} ${size.width}x${size.height}: ${at.toFixed(2)} s; wanted: at most ${LATEST_PICTURE} s`);
        good &&= at <= LATEST_PICTURE;
    }
}
await quit();
if (!good) {
    console.log('not as fast as wanted');
    process.exitCode = 1;
}
