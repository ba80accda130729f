// Keeps the page for when there is no network: all files of one build, or none.

const BUILD = '{{build}}';
/** Every file of this build, and what it must hold: one of another build is refused. */
const FILES = {
{{files}}
};
/** How long a start waits for the network before it takes what is kept, ms. */
const PATIENCE = 4000;

/** Names of what is kept for pages of this folder, whatever their build. */
const OURS = `jointplay ${registration.scope} `;
const KEPT = OURS + BUILD;
/** What the page asks for: `index.html` by its folder, all else with the build. */
const address = (name) => (name === 'index.html' ? './' : `${name}?${BUILD}`);

async function keep() {
    const kept = await caches.open(KEPT);
    const all = Object.entries(FILES).map(async ([name, integrity]) => {
        const response = await fetch(address(name), { integrity });
        if (!response.ok) throw new Error(`${name}: ${response.status}`);
        await kept.put(address(name), response);
    });
    try {
        await Promise.all(all);
    } catch (error) {
        await caches.delete(KEPT);
        throw error;
    }
}

/** Comes to pass when no page of an older build is open any more. */
async function replace() {
    for (const name of await caches.keys()) {
        if (name.startsWith(OURS) && name !== KEPT) await caches.delete(name);
    }
    await clients.claim();
}

/** A page starts with the newest build that can be had, and goes on with the files of the build that it started with. */
async function answer(request) {
    if (request.mode !== 'navigate') return (await caches.match(request)) ?? fetch(request);
    const patience = new AbortController();
    const timer = setTimeout(() => patience.abort(), PATIENCE);
    try {
        const response = await fetch(request, { signal: patience.signal });
        if (response.status < 500) return response;
    } catch {
        // No network.
    } finally {
        // What has begun to arrive may take its time.
        clearTimeout(timer);
    }
    const kept = await caches.open(KEPT);
    return (await kept.match('./')) ?? Response.error();
}

addEventListener('install', (event) => event.waitUntil(keep()));
addEventListener('activate', (event) => event.waitUntil(replace()));
addEventListener('fetch', (event) => {
    const { method, url } = event.request;
    if (method === 'GET' && url.startsWith(registration.scope)) event.respondWith(answer(event.request));
});
