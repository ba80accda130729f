// The browser's services for the laboratory; src/web/host.rs declares them.

const build = new URL(import.meta.url).search;
const $ = (id) => document.getElementById(id);

/** Least interval between routine reports to a screen reader, ms, which cannot read them out faster. */
const REPORT_INTERVAL = 10_000;
/** `localStorage` key under which the first visit is remembered. */
const VISIT_KEY = 'jointplay visited';
/** How long the data of a download must exist, ms. */
const DOWNLOAD_TIME = 60_000;
/** Delay from a frame to its sound, s: longer than the transfer takes, so that the clicks of a frame keep their intervals. */
const LATENCY = 0.04;

/** `laboratory` is that of web/main.js; `graphicsLost(start, why)` is called when the graphics of that start are lost. */
export function makeHost(laboratory, graphicsLost) {
    let reported = -Infinity;
    /** Background computations by number: {worker, messages, rest}. */
    const work = new Map();
    let latestWork = 0;

    /** Copies to the clipboard; returns whether the browser allows it. */
    async function copy(text) {
        try {
            await navigator.clipboard.writeText(text);
            return true;
        } catch {
            // The address is not secure, or permission is denied: use the older interface.
            const field = document.createElement('textarea');
            field.value = text;
            field.className = 'visually-hidden';
            document.body.append(field);
            field.select();
            const done = document.execCommand('copy');
            field.remove();
            $('laboratory').focus();
            return done;
        }
    }

    /** Workers need not pause for the frames of a page that is out of sight. */
    const sendRest = ({ worker, rest }) => worker.postMessage({ rest: document.hidden ? 0 : rest });
    document.addEventListener('visibilitychange', () => work.forEach(sendRest));

    const picker = document.createElement('input');
    picker.type = 'file';
    // A scene, and the files that it names.
    picker.accept = '.toml,.csv,.txt,.stl,.obj,.gltf,.glb,.bin';
    picker.multiple = true;
    picker.id = 'picker';
    picker.hidden = true;
    picker.addEventListener('change', () => {
        if (picker.files.length > 0) laboratory.page.openFiles([...picker.files]);
        // Otherwise choosing the same files again would fire no event.
        picker.value = '';
        $('laboratory').focus();
    });
    document.body.append(picker);

    // The browser consumes Escape, which leaves full screen.
    document.addEventListener('fullscreenchange', () => {
        if (!document.fullscreenElement) laboratory.page?.present(false);
    });
    // F5 presents, and must not reload the page. In the capture phase, because the canvas stops the propagation of keys.
    const preventReload = (event) => {
        if (event.key === 'F5' && !event.ctrlKey && !event.shiftKey) event.preventDefault();
    };
    addEventListener('keydown', preventReload, { capture: true });
    // eframe would take the pointerdown of a finger, which precedes its touchstart, for that of a mouse.
    const ignoreTouch = (event) => event.pointerType === 'touch' && event.stopPropagation();
    addEventListener('pointerdown', ignoreTouch, { capture: true });

    let audio;
    let isSoundOn = false;
    const resume = () => void (isSoundOn && audio.state !== 'running' && audio.resume().catch(() => {}));
    // Browsers start sound only on a gesture, some only inside its event handler.
    for (const gesture of ['pointerup', 'keyup']) addEventListener(gesture, resume, { capture: true });

    // Steps between two frames run in short spells; the browser handles input after each.
    const { port1: trigger, port2: spells } = new MessageChannel();
    let isStepping = false;
    function spell() {
        const delay = laboratory.trouble ? undefined : laboratory.page.stepBetween();
        isStepping = delay !== undefined;
        if (delay === 0) trigger.postMessage(null);
        else if (isStepping) setTimeout(spell, delay);
    }
    spells.onmessage = spell;

    return {
        scheduleSteps() {
            if (!isStepping) trigger.postMessage(null);
            isStepping = true;
        },

        address: () => location.origin + location.pathname,

        publishLink(link) {
            // The renderer, which is not part of the link, stays in the query.
            history.replaceState(null, '', location.pathname + laboratory.browserQuery() + new URL(link).hash);
            copy(link).then((done) => {
                if (!done) laboratory.page.notify('The link is in the address bar: this browser does not allow the clipboard');
            });
        },

        save(name, mime, bytes) {
            // A copy, because the view into the program's memory is invalid after this call.
            const address = URL.createObjectURL(new Blob([bytes.slice()], { type: mime }));
            const link = document.createElement('a');
            link.href = address;
            link.download = name;
            document.body.append(link);
            link.click();
            link.remove();
            setTimeout(() => URL.revokeObjectURL(address), DOWNLOAD_TIME);
        },

        pick: () => picker.click(),

        // A browser may withhold its storage; the first visit is then shown again.
        noteVisit() {
            try {
                localStorage.setItem(VISIT_KEY, '1');
            } catch {}
        },

        wasHere() {
            try {
                return localStorage.getItem(VISIT_KEY) !== null;
            } catch {
                return false;
            }
        },

        /** A browser may refuse, as on some phones; the page then fills its viewport. */
        fillScreen(on) {
            if (on) document.documentElement.requestFullscreen?.().catch(() => {});
            else if (document.fullscreenElement) document.exitFullscreen().catch(() => {});
        },

        startWork(job) {
            let worker;
            try {
                worker = new Worker(new URL(`worker.js${build}`, import.meta.url), { type: 'module' });
            } catch {
                // The browser has no workers, or none for a frame without an origin.
                return undefined;
            }
            const messages = [];
            const failed = (reason) => messages.push(JSON.stringify({ Failed: `the computation was aborted: ${reason}` }));
            worker.addEventListener('message', ({ data }) => messages.push(data));
            worker.addEventListener('error', (event) => {
                // The window shows it; it is no failure of the page.
                event.preventDefault();
                failed(event.message ?? 'the worker could not start');
            });
            try {
                worker.postMessage({ code: laboratory.code, job });
            } catch (error) {
                failed(error);
            }
            latestWork += 1;
            work.set(latestWork, { worker, messages, rest: 0 });
            return latestWork;
        },
        pollWork: (number) => work.get(number)?.messages.shift(),
        restWork(number, rest) {
            if (!work.has(number)) return;
            work.get(number).rest = rest;
            sendRest(work.get(number));
        },
        endWork(number) {
            work.get(number)?.worker.terminate();
            work.delete(number);
        },

        sound(on) {
            try {
                audio ??= new AudioContext();
            } catch (error) {
                return typeof AudioContext === 'function' ? String(error) : 'this browser cannot make it';
            }
            isSoundOn = on;
            if (on) resume();
            else audio.suspend().catch(() => {});
            return '';
        },
        soundRate: () => (audio?.state === 'running' ? audio.sampleRate : 0),
        click(samples, after) {
            const buffer = audio.createBuffer(1, samples.length, audio.sampleRate);
            buffer.copyToChannel(samples, 0);
            const source = audio.createBufferSource();
            source.buffer = buffer;
            source.connect(audio.destination);
            source.start(audio.currentTime + LATENCY + after);
        },

        announce(text, event) {
            $('summary').textContent = text;
            if (!event && performance.now() - reported < REPORT_INTERVAL) return;
            reported = performance.now();
            $('report-aloud').textContent = text;
        },

        // Deferred, because the laboratory may be in the middle of a frame.
        graphicsLost: (start, why) => setTimeout(() => graphicsLost(start, why)),

        areGraphicsLost: () => laboratory.backend === 'webgl' && Boolean($('laboratory').getContext('webgl2')?.isContextLost()),
    };
}
