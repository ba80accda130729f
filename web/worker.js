// A web worker for long computations, with the same compiled code as the page.

const build = new URL(import.meta.url).search;

/** Computing time between two pauses, in which messages of the page are handled, ms. */
const SPELL = 40;
/** Idle time of a pause, as a multiple of the computing time. */
let idleFactor = 0;
let spellStart = 0;
/** Yields to waiting messages without delay; a timer would take at least 4 ms. */
const { port1: trigger, port2: yielded } = new MessageChannel();

globalThis.jointplayWork = {
    post: (message) => postMessage(message),
    rest() {
        const computed = performance.now() - spellStart;
        if (computed < SPELL) return undefined;
        return new Promise((done) => {
            const resume = () => {
                spellStart = performance.now();
                done();
            };
            if (idleFactor > 0) return setTimeout(resume, idleFactor * computed);
            yielded.onmessage = resume;
            return trigger.postMessage(null);
        });
    },
};

async function perform({ code, job }) {
    const bindings = await import(`./jointplay.js${build}`);
    await bindings.default({ module_or_path: code });
    spellStart = performance.now();
    await bindings.perform(job);
}

/** First message: the compiled module `code` and the `job` as JSON (crates/analysis/src/task.rs). Later ones: `rest`. */
addEventListener('message', ({ data }) => {
    if (data.job) return perform(data);
    idleFactor = data.rest;
    return undefined;
});
// The page sees an uncaught error only if it is thrown outside a promise.
addEventListener('unhandledrejection', ({ reason }) => {
    throw reason;
});
