// Loads the laboratory, shows the progress, and explains why it cannot run.

const script = document.getElementById('program');
const build = new URL(import.meta.url).search;
const query = new URLSearchParams(location.search);
/** Latest fragment that was opened or typed. `Start over` returns to it, because the recorded state may lead to the same failure. */
let openedFragment = location.hash;
const $ = (id) => document.getElementById(id);

/** The page restarts lost graphics unless they were lost more than `MAX_LOSSES` times within `LOSS_WINDOW`, ms. */
const MAX_LOSSES = 3;
const LOSS_WINDOW = 60_000;
/** Delays before the attempts to restart them, ms: after a crash the browser needs a moment. */
const RESTART_DELAYS = [0, 500, 3000];
/** `sessionStorage` key of a state that no address can hold: a large scene of the user's own, files that it names, many changes. */
const SESSION_KEY = `jointplay ${location.pathname}`;
/** `sessionStorage` key of the state at a reload, which is newer than the address: that is updated only once a second. */
const RELOAD_KEY = `${SESSION_KEY} left`;
const { focus } = HTMLElement.prototype;

/** Shared with the other scripts and the tests: `page` (src/web/page.rs), its mirror, the compiled code and its memory, the outcome of the starts. */
const laboratory = {
    page: null,
    mirror: null,
    code: null,
    memory: null,
    /** Size of that memory, which never shrinks, from which on the next scene gets a new one, bytes. */
    largeMemory: 256 << 20,
    backend: null,
    ready: false,
    trouble: null,
    starts: 0,
    losses: [],
};
globalThis.jointplay = laboratory;

/** Messages about missing features of the browser. */
const MISSING = {
    graphics:
        'The laboratory draws with WebGPU or WebGL2, and this browser offers neither. They may be switched off in its ' +
        'settings, or the graphics driver is not supported. A current Firefox, Chrome, Edge or Safari has at least WebGL2.',
    webgpu: 'The address asks for WebGPU, which this browser does not offer.',
    webgl: 'The address asks for WebGL2, which this browser does not offer.',
};

/** The renderer that the address requests, if any. */
const requestedRenderer = () => new URLSearchParams(location.hash.slice(1)).get('renderer') ?? query.get('renderer');

/** Keys of an address that concern this browser; links of the laboratory do not contain them. */
const BROWSER_KEYS = ['renderer', 'theme'];
/** The query with only these keys: the fragment holds the others. */
function browserQuery() {
    const pairs = BROWSER_KEYS.filter((key) => query.has(key)).map((key) => `${key}=${encodeURIComponent(query.get(key))}`);
    return pairs.length ? `?${pairs.join('&')}` : '';
}
laboratory.browserQuery = browserQuery;

/** The link to open: the address from its `?` on, or the state that this tab has stored for it. */
function linkToOpen() {
    const fragment = new URLSearchParams(location.hash.slice(1));
    // Once the page has written its state into the fragment, it removes the pairs of the link from the query: any left were typed.
    const written = window === window.top && (fragment.has('hash') || fragment.has('kept'));
    const typed = [...new URLSearchParams(location.search).keys()].some((key) => !BROWSER_KEYS.includes(key));
    if (written && typed) return location.search;
    if (fragment.has('kept')) {
        try {
            const stored = sessionStorage.getItem(SESSION_KEY);
            if (stored) return stored;
        } catch {
            // The laboratory reports that the state is missing.
        }
    }
    return location.search + location.hash;
}

/** The state of this page before a reload or a return to it, for `Page.start`; null if there is none. */
function takeReloadState() {
    if (window !== window.top) return null;
    try {
        const { address, session, unsaved } = JSON.parse(sessionStorage.getItem(RELOAD_KEY)) ?? {};
        sessionStorage.removeItem(RELOAD_KEY);
        // An opened link takes precedence.
        if (address !== location.href || performance.getEntriesByType('navigation')[0]?.type === 'navigate') return null;
        history.replaceState({ unsaved }, '', address);
        return session;
    } catch {
        return null;
    }
}
const reloadState = takeReloadState();

/** The fragment for a state from `Page.session`; null if no address can hold it and the browser does not store it. */
function fragmentOf(session) {
    if (!session?.startsWith('kept:')) return session;
    try {
        sessionStorage.setItem(SESSION_KEY, session);
        return 'kept=1';
    } catch {
        return null;
    }
}

/** Replaces the laboratory by a message; the user can copy `report`, and reload into `session`. */
function showTrouble(title, text, report, session) {
    // The first failure causes any others.
    if (laboratory.trouble) return;
    const link = fragmentOf(session);
    laboratory.trouble = { title, text, report, link };
    $('trouble-title').textContent = title;
    $('trouble-text').textContent = text;
    $('loading').hidden = true;
    $('trouble').hidden = false;
    $('report').hidden = $('copy').hidden = !report;
    if (report) $('report').value = report;
    $('again').hidden = !link;
    // The graphics driver may be at fault; WebGL2 avoids most of it.
    $('plainer').hidden = laboratory.backend !== 'webgpu';
    $('laboratory').hidden = true;
    $('notice').hidden = false;
    $('reload').textContent = link ? 'Start over' : 'Reload';
    if (window === window.top) (link ? $('again') : $('reload')).focus();
    document.title = `${title} - Jointplay`;
}

/** Called by the panic hook, src/web/crash.rs. */
function crashed(message, link) {
    const report = `${message}\naddress: ${location.href}\nbrowser: ${navigator.userAgent}`;
    showTrouble(
        'The laboratory has stopped',
        'This is a bug in the program. Please report the text below, and what you did just before.',
        report,
        link,
    );
}
globalThis.jointplayCrashed = crashed;

/** Reloads the page with this query and fragment. */
function reload(search, fragment) {
    history.replaceState(history.state, '', location.pathname + search + (fragment ? `#${fragment}` : ''));
    location.reload();
}
$('reload').addEventListener('click', () => reload(location.search, laboratory.trouble.link ? '' : openedFragment.slice(1)));
$('again').addEventListener('click', () => reload(location.search, laboratory.trouble.link));
$('plainer').addEventListener('click', () => {
    query.set('renderer', 'webgl');
    const fragment = new URLSearchParams(laboratory.trouble.link ?? location.hash.slice(1));
    fragment.delete('renderer');
    reload(`?${query}`, String(fragment));
});
$('copy').addEventListener('click', async () => {
    const report = $('report');
    report.select();
    try {
        await navigator.clipboard.writeText(report.value);
        $('copy').textContent = 'Copied';
    } catch {
        $('copy').textContent = 'Selected: press Ctrl+C';
    }
});
// A file dropped beside the canvas, or before it exists, must not replace the page.
for (const kind of ['dragover', 'drop']) addEventListener(kind, (event) => event.preventDefault());
// Errors that the panic hook does not see: traps in the compiled code, and failures before the laboratory has started.
function uncaught(error) {
    // After a trap, or an overflow of the stack, the laboratory has no state.
    const fatal = !laboratory.ready || error instanceof WebAssembly.RuntimeError || !laboratory.page.state();
    if (fatal && error) crashed(error.stack ?? String(error), null);
}
addEventListener('error', (event) => uncaught(event.error));
addEventListener('unhandledrejection', (event) => uncaught(event.reason));

function showProgress(text, part) {
    $('stage').textContent = text;
    if (part === undefined) $('progress').removeAttribute('value');
    else $('progress').value = part;
}

/** Downloads and compiles the program, and shows the progress. */
async function download(address, bytes) {
    const response = await fetch(address);
    if (!response.ok) {
        const reason = `${address}: ${response.status} ${response.statusText}`;
        if (response.status === 503) throw new Error(`${reason}. The server of this page is busy: reload in a minute`);
        throw new Error(`${reason}. Files of this page are missing on its server: please report this line to its operator`);
    }
    const megabytes = (n) => (n / 1e6).toFixed(1);
    // The browser delivers decompressed data, but reports the compressed length.
    const transferred = response.headers.get('content-encoding') ? Number(response.headers.get('content-length')) : bytes;
    let received = 0;
    const counted = response.body.pipeThrough(
        new TransformStream({
            transform(chunk, out) {
                received += chunk.byteLength;
                const part = Math.min(received / bytes, 1);
                const text = transferred ? `Loading: ${megabytes(part * transferred)} of ${megabytes(transferred)} MB` : 'Loading';
                showProgress(text, part);
                out.enqueue(chunk);
            },
        }),
    );
    // The browser compiles during the download only for this type.
    return WebAssembly.compileStreaming(new Response(counted, { headers: { 'Content-Type': 'application/wasm' } }));
}

/** Backends to try, best first. */
async function backends() {
    const requested = requestedRenderer();
    const webgl = releaseContext(document.createElement('canvas').getContext('webgl2'));
    let webgpu = false;
    if (requested !== 'webgl') {
        try {
            const adapter = await navigator.gpu?.requestAdapter();
            // Software rendering is faster with WebGL2.
            webgpu = Boolean(adapter) && !(adapter.info?.isFallbackAdapter && webgl && requested !== 'webgpu');
        } catch {
            // The browser has the API, but no adapter for this page.
        }
    }
    const available = [];
    if (webgpu) available.push('webgpu');
    if (webgl && requested !== 'webgpu') available.push('webgl');
    return available;
}

/** `simplifyShaders` of canvas.js, once loaded. */
let simplifyShaders;

/** Replaces the canvas. A canvas keeps the type of its first context, so each attempt needs a new one. */
function freshCanvas() {
    const old = $('laboratory');
    const canvas = old.cloneNode(false);
    simplifyShaders(canvas);
    canvas.hidden = false;
    old.replaceWith(canvas);
    const start = laboratory.starts;
    canvas.addEventListener('webglcontextlost', () => graphicsLost(start, 'the WebGL2 context was lost'));
    return canvas;
}

/** Preferences of the user's system, as `Page.start` expects them. */
function preferences() {
    const matches = (feature) => matchMedia(`(${feature})`).matches;
    const calm = matches('prefers-reduced-motion: reduce') ? 'calm ' : '';
    return calm + (matches('prefers-contrast: more') || matches('forced-colors: active') ? 'contrast' : '');
}

/** Starts on the first backend that works, and logs why others failed. Returns the failures if none works. */
async function start(candidates) {
    const { page } = laboratory;
    const failures = [];
    for (const backend of candidates) {
        laboratory.backend = backend;
        laboratory.starts += 1;
        try {
            // eframe takes the focus, which in a frame belongs to the embedding page.
            if (window !== window.top) HTMLElement.prototype.focus = () => {};
            await page.start(freshCanvas(), backend, laboratory.starts, reloadState ?? linkToOpen(), preferences());
            // Tab skips eframe's hidden field for typed text.
            for (const field of document.querySelectorAll('main > input')) field.tabIndex = -1;
            return null;
        } catch (error) {
            failures.push(`${backend}: ${error?.message ?? error}`);
            console.warn('start failed:', failures.at(-1));
        } finally {
            HTMLElement.prototype.focus = focus;
        }
    }
    return failures.join('\n') || 'neither WebGPU nor WebGL2 is available';
}

/** Shows the canvas once it has a picture. */
async function showFirstPicture() {
    const { page, starts } = laboratory;
    const aborted = () => laboratory.trouble || laboratory.starts !== starts;
    const frame = () => new Promise((done) => requestAnimationFrame(done));
    const before = page.frames();
    // A frame is on the screen when the next one begins.
    while (page.frames() < before + 2 && !aborted()) await frame();
    await frame();
    if (aborted()) return;
    $('notice').hidden = true;
    // What the notice says from now on concerns the user's own machine.
    $('poster')?.remove();
    if (window === window.top) $('laboratory').focus();
    laboratory.ready = true;
    performance.mark('first picture');
}

/** Restarts the graphics after those of start number `start` were lost. */
async function graphicsLost(start, why) {
    if (laboratory.trouble || start !== laboratory.starts) return;
    restarting = true;
    try {
        await restartGraphics(why);
    } finally {
        restarting = false;
    }
}

/** Whether lost graphics are being restarted. */
let restarting = false;

async function restartGraphics(why) {
    const { page, losses } = laboratory;
    console.warn('graphics lost:', why);
    laboratory.ready = false;
    // Later events of the old graphics are ignored.
    laboratory.starts += 1;
    page.suspend();
    $('loading').hidden = $('notice').hidden = false;
    showProgress('The graphics were lost: restarting them');
    const now = performance.now();
    losses.push(now);
    let failure = `${why}, ${losses.length} times since the page was opened`;
    if (losses.filter((time) => now - time < LOSS_WINDOW).length <= MAX_LOSSES) {
        for (const delay of RESTART_DELAYS) {
            await new Promise((done) => setTimeout(done, delay));
            failure = await start(await backends());
            if (!failure) return showFirstPicture();
        }
    }
    showTrouble(
        'The graphics were lost',
        `The browser withdrew its graphics and does not provide them again (${failure}). The simulation is not lost: ` +
            'reload to continue from the same state.',
        null,
        page.session(),
    );
}

/** Latest change of visibility: the changes are processed one after the other. */
let latestChange = Promise.resolve();
/** Releases the graphics while the page is out of sight; the simulation waits. */
function visibilityChanged(visible) {
    latestChange = latestChange.then(async () => {
        if (laboratory.trouble || restarting || visible === laboratory.ready) return undefined;
        if (visible) {
            const failure = await start(await backends());
            return failure ? showTrouble('The graphics were lost', failure, null, laboratory.page.session()) : showFirstPicture();
        }
        laboratory.ready = false;
        // Later events of these graphics are ignored.
        laboratory.starts += 1;
        laboratory.page.suspend();
        releaseContext($('laboratory').getContext('webgl2'));
        return undefined;
    });
}

/** Releases a context at once: a browser has few of them, and collects an unused one late. Returns whether there was one. */
function releaseContext(context) {
    context?.getExtension('WEBGL_lose_context')?.loseContext();
    return Boolean(context);
}

/** Starts to load the compiled code and the scripts around it, in parallel. */
function load() {
    const code = download(`jointplay_bg.wasm${build}`, Number(script.dataset.wasmBytes));
    const parts = Promise.all(['host', 'canvas', 'mirror', 'jointplay'].map((name) => import(`./${name}.js${build}`)));
    // A failure before the `await` is reported there.
    for (const part of [code, parts]) part.catch(() => {});
    return [code, parts];
}

async function main() {
    // The page says so (stuck.js).
    if (globalThis.jointplayMissing.length) return;
    $('loading').hidden = false;
    showProgress('Loading', 0);
    const { firstVisible, isFramed, Messages, yieldInput } = await import(`./guest.js${build}`);
    const messages = isFramed && new Messages(laboratory);
    let started;
    latestChange = new Promise((done) => (started = done));
    if (isFramed) await firstVisible(visibilityChanged);
    const [code, parts] = load();
    const available = await backends();
    if (available.length === 0) {
        showTrouble('Something is missing', MISSING[requestedRenderer()] ?? MISSING.graphics);
        // WebGL2 may be available.
        $('plainer').hidden = requestedRenderer() !== 'webgpu';
        return;
    }
    let bindings;
    let Mirror;
    try {
        const [{ makeHost }, canvas, mirror, glue] = await parts;
        ({ Mirror } = mirror);
        ({ simplifyShaders } = canvas);
        bindings = glue;
        globalThis.ResizeObserver = canvas.CanvasObserver;
        globalThis.jointplayHost = makeHost(laboratory, graphicsLost);
        laboratory.code = await code;
        ({ memory: laboratory.memory } = await bindings.default({ module_or_path: laboratory.code }));
    } catch (error) {
        return showTrouble('The laboratory could not be loaded', `${error?.message ?? error}`);
    }
    showProgress('Starting');
    laboratory.page = new bindings.Page();
    laboratory.mirror = new Mirror(laboratory.page, $('mirror'));
    const failure = await start(available);
    if (failure) return showTrouble('The laboratory could not start', failure);
    // The user has edited the address of the open page.
    addEventListener('hashchange', ({ newURL }) => {
        // The address of the state may have overwritten the link before this event.
        if (location.href !== newURL) history.replaceState(null, '', newURL);
        openedFragment = location.hash;
        // The initial query has been read.
        if (!isFramed && location.search !== browserQuery()) {
            history.replaceState(history.state, '', location.pathname + browserQuery() + openedFragment);
        }
        // Another renderer needs a reload.
        if (['webgl', 'webgpu'].includes(requestedRenderer()) && requestedRenderer() !== laboratory.backend) {
            graceEnd = Infinity;
            location.reload();
        } else graceEnd = laboratory.page.openLink(linkToOpen()) ? Date.now() + LINK_GRACE : 0;
    });
    if (isFramed) yieldInput(laboratory.page);
    await showFirstPicture();
    started();
    if (isFramed) {
        messages.start();
    } else {
        enableOffline();
        recordSession();
        askBeforeLeaving();
    }
}

/** Least interval between updates of the address, ms. */
const SESSION_INTERVAL = 1000;
/** How long a link that failed to open stays in the address, so that the user can correct it, ms; the end of that time. */
const LINK_GRACE = 60_000;
let graceEnd = 0;
/** Least interval between updates, as a multiple of the time that one takes: packing a large scene is slow. */
const IDLE_FACTOR = 20;

/** Stores the state in the address or in the tab, so that the page continues from it after a reload or a return. */
function recordSession() {
    let warned = false;
    // A link that was refused at the start also stays in the address, until the user does something else.
    const isAddressFree = () => Date.now() >= graceEnd && !laboratory.page.refused();
    const currentSession = () => (laboratory.trouble || !isAddressFree() ? null : laboratory.page.session());
    function withBrowserKeys(fragment) {
        const sources = [new URLSearchParams(location.hash.slice(1)), query];
        const pairs = BROWSER_KEYS.map((key) => [key, sources.map((source) => source.get(key)).find(Boolean)]);
        const rest = pairs.filter(([, value]) => value).map(([key, value]) => `&${key}=${encodeURIComponent(value)}`);
        return `#${fragment}${rest.join('')}`;
    }
    function record() {
        const session = laboratory.ready && currentSession();
        if (!session) return;
        const fragment = fragmentOf(session);
        if (!fragment) {
            if (!warned) laboratory.page.notify('This scene is too large for this browser to store: a reload loses it');
            warned = true;
            return;
        }
        const unsaved = isUnsaved();
        const address = location.pathname + browserQuery() + withBrowserKeys(fragment);
        if (address === location.pathname + location.search + location.hash && unsaved === wasUnsaved()) return;
        history.replaceState({ unsaved }, '', address);
    }
    let largeScene = null;
    /** Once a scene has made the memory of the program large, reloads the page into the next one. */
    function releaseMemory(scene) {
        if (laboratory.memory.buffer.byteLength < laboratory.largeMemory) return;
        largeScene ??= scene;
        // A change that is in no file would raise the browser's question.
        if (scene !== largeScene && !isUnsaved() && currentSession()) location.reload();
    }
    function update() {
        const startTime = Date.now();
        record();
        const state = laboratory.ready && laboratory.page.state();
        if (state) {
            const { scene } = JSON.parse(state);
            document.title = `${scene} - Jointplay`;
            releaseMemory(scene);
        }
        setTimeout(update, Math.max(SESSION_INTERVAL, IDLE_FACTOR * (Date.now() - startTime)));
    }
    setTimeout(update, SESSION_INTERVAL);
    addEventListener('pagehide', () => {
        const current = currentSession();
        if (!current) return;
        const session = current.startsWith('kept:') ? current : withBrowserKeys(current);
        try {
            sessionStorage.setItem(RELOAD_KEY, JSON.stringify({ address: location.href, session, unsaved: isUnsaved() }));
        } catch {
            // Only the last second is lost.
        }
    });
}

/** Whether the page was loaded with changes that are in no file; the laboratory reports only later ones. */
const wasUnsaved = () => Boolean(history.state?.unsaved);
const isUnsaved = () => laboratory.page.unsaved() ?? wasUnsaved();

/** Asks only about the user's own scene: its changes may be in the address, but not in a file. */
function askBeforeLeaving() {
    addEventListener('beforeunload', (event) => {
        if (!laboratory.trouble && isUnsaved()) event.preventDefault();
    });
}

/** Stores the page for offline use where the browser allows it: over TLS, or on this machine. */
function enableOffline() {
    if (!navigator.serviceWorker) return;
    navigator.serviceWorker.register('offline.js').catch((error) => console.warn('not stored for offline use:', error));
}

main();
