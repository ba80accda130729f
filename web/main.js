// Loads the laboratory, shows how far that is, and says what is wrong where it cannot run.

const script = document.getElementById('program');
const build = new URL(import.meta.url).search;
const query = new URLSearchParams(location.search);
/** With what the page was opened, and what the user has put there since: it leads to a start, the state may lead to what stopped it. */
let opened = location.hash;
const $ = (id) => document.getElementById(id);

/** Losses of the graphics within `LOSS_SPAN`, ms, after which the page does not start them again by itself. */
const MOST_LOSSES = 3;
const LOSS_SPAN = 60_000;
/** Where the tab keeps what no address holds: a large scene of the user's own, files that it names, very many changes. */
const KEPT = `jointplay ${location.pathname}`;
/** Where it keeps, for loading it anew, what was on the page that was left: the address follows once a second only. */
const LEFT = `${KEPT} left`;
/** What gives an element the focus. */
const { focus } = HTMLElement.prototype;
/** Pauses before the attempts to start them again, ms: after a crash the browser needs a moment. */
const PAUSES = [0, 500, 3000];

/** What the tests and the rest of the page hold on to: `page` (src/web/page.rs), its mirror, the compiled code, how the starts went. */
const laboratory = { page: null, mirror: null, code: null, backend: null, ready: false, trouble: null, starts: 0, losses: [] };
globalThis.jointplay = laboratory;

const LEFT_OUT = {
    wasm:
        'This browser cannot run WebAssembly with vectors, which the laboratory is compiled to. Firefox from 89, Chrome and Edge ' +
        'from 91 and Safari from 16.4 can.',
    graphics:
        'The laboratory draws with WebGPU or WebGL2, and this browser offers neither. They may be switched off in its ' +
        'settings, or the graphics driver is not supported. A current Firefox, Chrome, Edge or Safari has at least WebGL2.',
    webgpu: 'The address asks for WebGPU, which this browser does not offer.',
    webgl: 'The address asks for WebGL2, which this browser does not offer.',
};

/** The smallest module with an instruction on vectors. */
const WITH_VECTORS = Uint8Array.of(
    ...[0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11],
);

/** The way to draw that the address asks for, if any. */
const asked = () => new URLSearchParams(location.hash.slice(1)).get('renderer') ?? query.get('renderer');

/** Words of an address that belong to the browser and are in no link that the laboratory makes. */
const OWN_WORDS = ['renderer', 'theme'];
/** The query without the words of a link: once the fragment holds those, they would say the same twice. */
function ownQuery() {
    const own = OWN_WORDS.filter((word) => query.has(word)).map((word) => `${word}=${encodeURIComponent(query.get(word))}`);
    return own.length ? `?${own.join('&')}` : '';
}
laboratory.ownQuery = ownQuery;

/** What the page is to open: the address from its `?` on, or what this tab has kept in its place. */
function wanted() {
    const fragment = new URLSearchParams(location.hash.slice(1));
    // The page has written its state behind the `#` and taken the words of the link from the query: what is there now was typed.
    const written = window === window.top && (fragment.has('hash') || fragment.has('kept'));
    const typed = [...new URLSearchParams(location.search).keys()].some((word) => !OWN_WORDS.includes(word));
    if (written && typed) return location.search;
    if (fragment.has('kept')) {
        try {
            const kept = sessionStorage.getItem(KEPT);
            if (kept) return kept;
        } catch {
            // The laboratory says that it is not here.
        }
    }
    return location.search + location.hash;
}

/** What was here when the page at this address was left, if it is loaded anew or come back to: for `Page.start`. */
function takeLeft() {
    if (window !== window.top) return null;
    try {
        const { address, session, unsaved } = JSON.parse(sessionStorage.getItem(LEFT)) ?? {};
        sessionStorage.removeItem(LEFT);
        // A link that is opened says itself what it leads to.
        if (address !== location.href || performance.getEntriesByType('navigation')[0]?.type === 'navigate') return null;
        history.replaceState({ unsaved }, '', address);
        return session;
    } catch {
        return null;
    }
}
const left = takeLeft();

/** The fragment for a state as src/web/page.rs gives it; none where it does not fit and the browser does not keep it. */
function fragmentOf(session) {
    if (!session?.startsWith('kept:')) return session;
    try {
        sessionStorage.setItem(KEPT, session);
        return 'kept=1';
    } catch {
        return null;
    }
}

/**
 * Replaces whatever is on the page by a message; `report` is a text that the user can copy, `session` what leads back to where
 * the laboratory was.
 */
function showTrouble(title, text, report, session) {
    // What went wrong first is the cause of the rest.
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
    // A graphics driver may be at fault; the other way to draw avoids most of it.
    $('plainer').hidden = laboratory.backend !== 'webgpu';
    $('laboratory').hidden = true;
    $('notice').hidden = false;
    $('reload').textContent = link ? 'Start anew' : 'Reload';
    if (window === window.top) (link ? $('again') : $('reload')).focus();
    document.title = `${title} - Jointplay`;
}

/** Called by the panic hook, src/web/crash.rs. */
function crashed(message, link) {
    const report = `${message}\naddress: ${location.href}\nbrowser: ${navigator.userAgent}`;
    showTrouble(
        'The laboratory has stopped',
        'This is a mistake in the program. Please report the text below with what you did just before.',
        report,
        link,
    );
}
globalThis.jointplayCrashed = crashed;

/** Loads the page anew, with another query or fragment. */
function reload(search, fragment) {
    history.replaceState(history.state, '', location.pathname + search + (fragment ? `#${fragment}` : ''));
    location.reload();
}
$('reload').addEventListener('click', () => reload(location.search, laboratory.trouble.link ? '' : opened.slice(1)));
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
// A file that misses the laboratory, or comes before it is there, must not take its place in the browser.
for (const kind of ['dragover', 'drop']) addEventListener(kind, (event) => event.preventDefault());
// What no panic hook sees: a trap in the compiled code, and anything that keeps the laboratory from starting.
function uncaught(error) {
    const fatal = !laboratory.ready || error instanceof WebAssembly.RuntimeError;
    if (fatal && error) crashed(error.stack ?? String(error), null);
}
addEventListener('error', (event) => uncaught(event.error));
addEventListener('unhandledrejection', (event) => uncaught(event.reason));

function stage(text, part) {
    $('stage').textContent = text;
    if (part === undefined) $('progress').removeAttribute('value');
    else $('progress').value = part;
}

/** The compiled code; the progress of its download is on the page. */
async function download(address, bytes) {
    const response = await fetch(address);
    if (!response.ok) {
        const reason = `${address}: ${response.status} ${response.statusText}`;
        throw new Error(`${reason}. Files of this page are missing on its server: please tell whoever runs it, with this line`);
    }
    const megabytes = (n) => (n / 1e6).toFixed(1);
    // The browser hands out what it has unpacked, and tells the length of what comes over the line.
    const packed = response.headers.get('content-encoding') ? Number(response.headers.get('content-length')) : bytes;
    let got = 0;
    const counted = response.body.pipeThrough(
        new TransformStream({
            transform(chunk, out) {
                got += chunk.byteLength;
                const part = Math.min(got / bytes, 1);
                stage(packed ? `Loading: ${megabytes(part * packed)} of ${megabytes(packed)} MB` : 'Loading', part);
                out.enqueue(chunk);
            },
        }),
    );
    // Compiled while it arrives, which a browser does only for this type.
    return WebAssembly.compileStreaming(new Response(counted, { headers: { 'Content-Type': 'application/wasm' } }));
}

/** Backends to try, best first. */
async function backends() {
    const wanted = asked();
    const webgl = letGo(document.createElement('canvas').getContext('webgl2'));
    let webgpu = false;
    if (wanted !== 'webgl') {
        try {
            const adapter = await navigator.gpu?.requestAdapter();
            // Where the processor draws, it does so faster with WebGL2.
            webgpu = Boolean(adapter) && !(adapter.info?.isFallbackAdapter && webgl && wanted !== 'webgpu');
        } catch {
            // A browser that has the object but no adapter for this page.
        }
    }
    const found = [];
    if (webgpu) found.push('webgpu');
    if (webgl && wanted !== 'webgpu') found.push('webgl');
    return found;
}

/** `drawLightly` of canvas.js, once it is there. */
let lighten;

/** A canvas keeps the kind of its first context: each attempt gets a fresh one. */
function freshCanvas() {
    const old = $('laboratory');
    const canvas = old.cloneNode(false);
    lighten(canvas);
    canvas.hidden = false;
    old.replaceWith(canvas);
    const start = laboratory.starts;
    canvas.addEventListener('webglcontextlost', () => lost(start, 'the WebGL2 context was lost'));
    return canvas;
}

/** What the user's system asks of all pages, in the words of `Page.start`. */
function wishes() {
    const asks = (what) => matchMedia(`(${what})`).matches;
    const calm = asks('prefers-reduced-motion: reduce') ? 'calm ' : '';
    return calm + (asks('prefers-contrast: more') || asks('forced-colors: active') ? 'contrast' : '');
}

/** Starts on the first backend that works; what the others said goes to the console. */
async function begin(found) {
    const { page } = laboratory;
    const failures = [];
    for (const backend of found) {
        laboratory.backend = backend;
        laboratory.starts += 1;
        try {
            // A laboratory that starts takes the focus, which in a frame is another's.
            if (window !== window.top) HTMLElement.prototype.focus = () => {};
            await page.start(freshCanvas(), backend, laboratory.starts, left ?? wanted(), wishes());
            // What eframe takes typed text by is no stop of its own on the way of Tab.
            for (const field of document.querySelectorAll('main > input')) field.tabIndex = -1;
            return null;
        } catch (error) {
            failures.push(`${backend}: ${error?.message ?? error}`);
            console.warn('no start with', failures.at(-1));
        } finally {
            HTMLElement.prototype.focus = focus;
        }
    }
    return failures.join('\n') || 'neither WebGPU nor WebGL2 is there';
}

/** Shows the canvas once it holds a picture. */
async function firstPicture() {
    const { page, starts } = laboratory;
    const gone = () => laboratory.trouble || laboratory.starts !== starts;
    const frame = () => new Promise((done) => requestAnimationFrame(done));
    const before = page.frames();
    // The frame that is drawn is on the screen when the next begins.
    while (page.frames() < before + 2 && !gone()) await frame();
    await frame();
    if (gone()) return;
    $('notice').hidden = true;
    if (window === window.top) $('laboratory').focus();
    laboratory.ready = true;
    performance.mark('first picture');
}

/** The graphics of start number `start` are gone: the laboratory goes on with others. */
async function lost(start, why) {
    if (laboratory.trouble || start !== laboratory.starts) return;
    restarting = true;
    try {
        await restart(why);
    } finally {
        restarting = false;
    }
}

/** Whether lost graphics are being started again. */
let restarting = false;

async function restart(why) {
    const { page, losses } = laboratory;
    console.warn('graphics lost:', why);
    laboratory.ready = false;
    // What still comes from the old ones is no news.
    laboratory.starts += 1;
    page.suspend();
    $('loading').hidden = $('notice').hidden = false;
    stage('The graphics of this browser were lost: starting them again');
    const now = performance.now();
    losses.push(now);
    let failure = `${why}, ${losses.length} times since the page was opened`;
    if (losses.filter((time) => now - time < LOSS_SPAN).length <= MOST_LOSSES) {
        for (const pause of PAUSES) {
            await new Promise((done) => setTimeout(done, pause));
            failure = await begin(await backends());
            if (!failure) return firstPicture();
        }
    }
    showTrouble(
        'The graphics were lost',
        `This browser took its graphics back and does not give them again (${failure}). The simulation is still there: ` +
            'reload to go on from the same state.',
        null,
        page.session(),
    );
}

/** Without graphics while nobody sees it; the simulation waits. One after the other, however fast it comes and goes. */
let change = Promise.resolve();
function showOrHide(shown) {
    change = change.then(async () => {
        if (laboratory.trouble || restarting || shown === laboratory.ready) return undefined;
        if (shown) {
            const failure = await begin(await backends());
            return failure ? showTrouble('The graphics were lost', failure, null, laboratory.page.session()) : firstPicture();
        }
        laboratory.ready = false;
        // What still comes from these graphics is no news.
        laboratory.starts += 1;
        laboratory.page.suspend();
        letGo($('laboratory').getContext('webgl2'));
        return undefined;
    });
}

/** A browser has only so many contexts, and takes one back long after it is forgotten. */
function letGo(context) {
    context?.getExtension('WEBGL_lose_context')?.loseContext();
    return Boolean(context);
}

/** Begins to load the compiled code and the scripts around it, all at once. */
function load() {
    const code = download(`jointplay_bg.wasm${build}`, Number(script.dataset.wasmBytes));
    const parts = Promise.all(['host', 'canvas', 'mirror', 'jointplay'].map((name) => import(`./${name}.js${build}`)));
    // Should one fail before it is waited for: it is reported where it is.
    for (const part of [code, parts]) part.catch(() => {});
    return [code, parts];
}

async function main() {
    if (typeof WebAssembly !== 'object' || !WebAssembly.validate(WITH_VECTORS)) return showTrouble('Something is missing', LEFT_OUT.wasm);
    $('loading').hidden = false;
    stage('Loading', 0);
    const { framed, inSight, Messages, stayPolite } = await import(`./guest.js${build}`);
    const messages = framed && new Messages(laboratory);
    let started;
    change = new Promise((done) => (started = done));
    if (framed) await inSight(showOrHide);
    const [code, parts] = load();
    const found = await backends();
    if (found.length === 0) {
        showTrouble('Something is missing', LEFT_OUT[asked()] ?? LEFT_OUT.graphics);
        // There may be the other way to draw.
        $('plainer').hidden = asked() !== 'webgpu';
        return;
    }
    let bindings;
    let Mirror;
    try {
        const [{ makeHost }, { CanvasObserver, drawLightly }, mirror, glue] = await parts;
        ({ Mirror } = mirror);
        lighten = drawLightly;
        bindings = glue;
        globalThis.ResizeObserver = CanvasObserver;
        globalThis.jointplayHost = makeHost(laboratory, lost);
        laboratory.code = await code;
        await bindings.default({ module_or_path: laboratory.code });
    } catch (error) {
        return showTrouble('The laboratory could not be loaded', `${error?.message ?? error}`);
    }
    stage('Starting');
    laboratory.page = new bindings.Page();
    laboratory.mirror = new Mirror(laboratory.page, $('mirror'));
    const failure = await begin(found);
    if (failure) return showTrouble('The laboratory could not start', failure);
    // Another link pasted into the address bar of the open page.
    addEventListener('hashchange', ({ newURL }) => {
        // The address of the state may have been written over the link before this event came.
        if (location.href !== newURL) history.replaceState(null, '', newURL);
        opened = location.hash;
        // What came with the page has been read.
        if (!framed && location.search !== ownQuery()) history.replaceState(history.state, '', location.pathname + ownQuery() + opened);
        // Another way to draw needs another start.
        if (['webgl', 'webgpu'].includes(asked()) && asked() !== laboratory.backend) {
            mendable = Infinity;
            location.reload();
        } else mendable = laboratory.page.openLink(wanted()) ? Date.now() + MENDABLE : 0;
    });
    if (framed) stayPolite(laboratory.page);
    await firstPicture();
    started();
    if (framed) {
        messages.begin();
    } else {
        keepForOffline();
        keepSession();
        askBeforeLeaving();
    }
}

/** How often the address follows what is shown, ms. */
const SESSION_PACE = 1000;
/** How long a link that could not be opened stays in the address, to be mended there, ms; until when it does. */
const MENDABLE = 60_000;
let mendable = 0;
/** Pauses between two looks are so many times as long as one takes: a large scene takes a while to pack. */
const SPARING = 20;

/** Keeps the state in the address, or in the tab, so that loading the page anew, or coming back to it, goes on from there. */
function keepSession() {
    let told = false;
    // A link that could not be opened stays in the address as well, until something else is done.
    const mended = () => Date.now() >= mendable && !laboratory.page.refused();
    const present = () => (laboratory.trouble || !mended() ? null : laboratory.page.session());
    function withOwnWords(fragment) {
        const words = [new URLSearchParams(location.hash.slice(1)), query];
        const own = OWN_WORDS.map((word) => [word, words.map((from) => from.get(word)).find(Boolean)]);
        const rest = own.filter(([, value]) => value).map(([word, value]) => `&${word}=${encodeURIComponent(value)}`);
        return `#${fragment}${rest.join('')}`;
    }
    function keep() {
        const session = laboratory.ready && present();
        if (!session) return;
        const fragment = fragmentOf(session);
        if (!fragment) {
            if (!told) laboratory.page.say('This scene is too large for this browser to keep: loading the page anew loses it');
            told = true;
            return;
        }
        const address = withOwnWords(fragment);
        const unsaved = isUnsaved();
        const place = location.pathname + ownQuery() + address;
        if (place === location.pathname + location.search + location.hash && unsaved === wasUnsaved()) return;
        history.replaceState({ unsaved }, '', place);
    }
    function follow() {
        const began = Date.now();
        keep();
        const state = laboratory.ready && laboratory.page.state();
        if (state) document.title = `${JSON.parse(state).scene} - Jointplay`;
        setTimeout(follow, Math.max(SESSION_PACE, SPARING * (Date.now() - began)));
    }
    setTimeout(follow, SESSION_PACE);
    addEventListener('pagehide', () => {
        const now = present();
        if (!now) return;
        const session = now.startsWith('kept:') ? now : withOwnWords(now);
        try {
            sessionStorage.setItem(LEFT, JSON.stringify({ address: location.href, session, unsaved: isUnsaved() }));
        } catch {
            // What the last second brought is lost.
        }
    });
}

/** Whether the page was loaded with changes that were in no file; they still are until the laboratory knows better. */
const wasUnsaved = () => Boolean(history.state?.unsaved);
const isUnsaved = () => laboratory.page.unsaved() ?? wasUnsaved();

/** Only a scene of the user's own can be lost; its changes may be in the address, which nobody takes for a file. */
function askBeforeLeaving() {
    addEventListener('beforeunload', (event) => {
        if (!laboratory.trouble && isUnsaved()) event.preventDefault();
    });
}

/** Where the browser offers it: over TLS, or on this machine. */
function keepForOffline() {
    if (!navigator.serviceWorker) return;
    navigator.serviceWorker.register('offline.js').catch((error) => console.warn('not kept for offline:', error));
}

main();
