// A long computation beside the page: the same code, without a picture.

const build = new URL(import.meta.url).search;

/** How long it computes before it rests, or looks at least what the page says, ms. */
const SPELL = 40;
/** How long it rests, as a multiple of that. */
let rest = 0;
let began = 0;
/** A way to look that takes no longer than that: a timer waits for 4 ms. */
const { port1: look, port2: seen } = new MessageChannel();

globalThis.jointplayWork = {
    tell: (message) => postMessage(message),
    rest() {
        const computed = performance.now() - began;
        if (computed < SPELL) return undefined;
        return new Promise((done) => {
            const goOn = () => {
                began = performance.now();
                done();
            };
            if (rest > 0) return setTimeout(goOn, rest * computed);
            seen.onmessage = goOn;
            return look.postMessage(null);
        });
    },
};

async function perform({ code, job }) {
    const bindings = await import(`./jointplay.js${build}`);
    await bindings.default({ module_or_path: code });
    began = performance.now();
    await bindings.perform(job);
}

/** `code`: the compiled module, which the page has already; `job`: JSON, crates/analysis/src/task.rs. Later on `rest`. */
addEventListener('message', ({ data }) => {
    if (data.job) return perform(data);
    rest = data.rest;
    return undefined;
});
// An error that nobody catches is seen by the page only if it is thrown outside of a promise.
addEventListener('unhandledrejection', ({ reason }) => {
    throw reason;
});
