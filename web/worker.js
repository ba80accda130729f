// A long computation beside the page: the same code, without a picture.

const build = new URL(import.meta.url).search;

globalThis.jointplayWork = { tell: (message) => postMessage(message) };

/** `code`: the compiled module, which the page has already; `job`: JSON, src/analysis/task.rs. */
addEventListener('message', async ({ data: { code, job } }) => {
    const bindings = await import(`./jointplay.js${build}`);
    await bindings.default({ module_or_path: code });
    bindings.perform(job);
});
// An error that nobody catches is seen by the page only if it is thrown outside of a promise.
addEventListener('unhandledrejection', ({ reason }) => {
    throw reason;
});
