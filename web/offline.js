// Service worker: stores the page for offline use, all files of one build or none.

const BUILD = '{{build}}';
/** Every file of this build with its checksum: a file of another build is refused. */
const FILES = {
{{files}}
};
/** How long a start waits for the network before it uses the stored files, ms. */
const NETWORK_TIMEOUT = 4000;

/** Prefix of the caches of this folder, and the cache of this build. */
const CACHE_PREFIX = `jointplay ${registration.scope} `;
const CACHE = CACHE_PREFIX + BUILD;
/** Address as the page requests it: `index.html` by its folder, other files with the build. */
const address = (name) => (name === 'index.html' ? './' : `${name}?${BUILD}`);

/** Stores all files of this build. */
async function store() {
    const cache = await caches.open(CACHE);
    const all = Object.entries(FILES).map(async ([name, integrity]) => {
        const response = await fetch(address(name), { integrity });
        if (!response.ok) throw new Error(`${name}: ${response.status}`);
        await cache.put(address(name), response);
    });
    try {
        await Promise.all(all);
    } catch (error) {
        await caches.delete(CACHE);
        throw error;
    }
}

/** Deletes older builds; called once no page of them is open. */
async function deleteOlder() {
    for (const name of await caches.keys()) {
        if (name.startsWith(CACHE_PREFIX) && name !== CACHE) await caches.delete(name);
    }
    await clients.claim();
}

/**
 * The answer to a request for the file `name` of this page. A page starts with the newest build available, and continues with the
 * files of that build. Other pages of this origin have caches, too; they are not searched.
 */
async function answer(request, name) {
    const cacheName = CACHE_PREFIX + new URL(request.url).search.slice(1);
    if (request.mode !== 'navigate') return (await caches.match(request, { cacheName })) ?? fetch(request);
    const timeout = new AbortController();
    const timer = setTimeout(() => timeout.abort(), NETWORK_TIMEOUT);
    try {
        const response = await fetch(request, { signal: timeout.signal });
        if (response.status < 500) return response;
    } catch {
        // No network.
    } finally {
        // A response that has begun may take longer.
        clearTimeout(timer);
    }
    return (await caches.match(address(name), { cacheName: CACHE })) ?? Response.error();
}

addEventListener('install', (event) => event.waitUntil(store()));
addEventListener('activate', (event) => event.waitUntil(deleteOlder()));
addEventListener('fetch', (event) => {
    const { method, url } = event.request;
    if (method !== 'GET' || !url.startsWith(registration.scope)) return;
    const name = new URL(url).pathname.slice(new URL(registration.scope).pathname.length) || 'index.html';
    // Other pages may be below this one.
    if (Object.hasOwn(FILES, name)) event.respondWith(answer(event.request, name));
});
