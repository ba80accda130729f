// The browser's services for the laboratory: the other half of src/web/host.rs.

const build = new URL(import.meta.url).search;
const $ = (id) => document.getElementById(id);

/** Least time between two reports to a screen reader while nothing happens, ms: it speaks slower than they are made. */
const REPORT_INTERVAL = 10_000;
/** Time that a download needs its data for, ms. */
const KEEP = 60_000;
/** From a frame to its sound, s: longer than it takes to hand it over, so that the clicks of a frame keep their distances. */
const LATENCY = 0.04;

/** `laboratory`: what web/main.js knows; `lost(start, why)`: called when the graphics of that start are gone. */
export function makeHost(laboratory, lost) {
    let reported = -Infinity;
    /** Computations: number to {worker, messages, rest}. */
    const work = new Map();
    let works = 0;

    /** On the clipboard, by whatever way the browser allows. */
    async function copy(text) {
        try {
            await navigator.clipboard.writeText(text);
            return true;
        } catch {
            // Not a secure address, or not allowed: as pages did before.
            const field = document.createElement('textarea');
            field.value = text;
            field.className = 'apart';
            document.body.append(field);
            field.select();
            const done = document.execCommand('copy');
            field.remove();
            $('laboratory').focus();
            return done;
        }
    }

    /** Nothing moves on a page that is out of sight. */
    const restAsTold = ({ worker, rest }) => worker.postMessage({ rest: document.hidden ? 0 : rest });
    document.addEventListener('visibilitychange', () => work.forEach(restAsTold));

    const picker = document.createElement('input');
    picker.type = 'file';
    // A scene, and the files that it names.
    picker.accept = '.toml,.csv,.txt,.stl,.obj,.gltf,.glb,.bin';
    picker.multiple = true;
    picker.id = 'picker';
    picker.hidden = true;
    picker.addEventListener('change', () => {
        if (picker.files.length > 0) laboratory.page.openFiles([...picker.files]);
        // The same files, changed meanwhile, can be chosen again.
        picker.value = '';
        $('laboratory').focus();
    });
    document.body.append(picker);

    // The browser's own key for it is Escape, which it keeps to itself.
    document.addEventListener('fullscreenchange', () => {
        if (!document.fullscreenElement) laboratory.page?.present(false);
    });
    // It would load the page anew. On the way down: the canvas keeps its keys to itself.
    const keep = (event) => {
        if (event.key === 'F5' && !event.ctrlKey && !event.shiftKey) event.preventDefault();
    };
    addEventListener('keydown', keep, { capture: true });
    // A finger's comes before its touchstart, and for that moment eframe takes it for a mouse's; the touchstart tells it all.
    const finger = (event) => event.pointerType === 'touch' && event.stopPropagation();
    addEventListener('pointerdown', finger, { capture: true });

    let audio;
    let heard = false;
    const resume = () => void (heard && audio.state !== 'running' && audio.resume().catch(() => {}));
    // Browsers let sound begin with a gesture alone, some within its event alone.
    for (const gesture of ['pointerup', 'keyup']) addEventListener(gesture, resume, { capture: true });

    /** Between two frames: what the user does meanwhile is seen to after each spell. */
    const { port1: next, port2: turn } = new MessageChannel();
    let goesOn = false;
    function spell() {
        const pause = laboratory.trouble ? undefined : laboratory.page.stepBetween();
        goesOn = pause !== undefined;
        if (pause === 0) next.postMessage(null);
        else if (goesOn) setTimeout(spell, pause);
    }
    turn.onmessage = spell;

    return {
        goOn() {
            if (!goesOn) next.postMessage(null);
            goesOn = true;
        },

        address: () => location.origin + location.pathname,

        shared(link) {
            // The query stays for what is not in the link: which renderer to use.
            history.replaceState(null, '', location.pathname + laboratory.ownQuery() + new URL(link).hash);
            copy(link).then((done) => {
                if (!done) laboratory.page.say('The link is in the address bar: this browser keeps it off the clipboard');
            });
        },

        save(name, mime, bytes) {
            // A copy: the view into the program's memory is gone when this returns.
            const address = URL.createObjectURL(new Blob([bytes.slice()], { type: mime }));
            const link = document.createElement('a');
            link.href = address;
            link.download = name;
            document.body.append(link);
            link.click();
            link.remove();
            setTimeout(() => URL.revokeObjectURL(address), KEEP);
        },

        pick: () => picker.click(),

        /** A browser may refuse, as on a phone: the page then fills what it has. */
        fillScreen(on) {
            if (on) document.documentElement.requestFullscreen?.().catch(() => {});
            else if (document.fullscreenElement) document.exitFullscreen().catch(() => {});
        },

        startWork(job) {
            let worker;
            try {
                worker = new Worker(new URL(`worker.js${build}`, import.meta.url), { type: 'module' });
            } catch {
                // There are none here, or not for a frame without an origin.
                return undefined;
            }
            const messages = [];
            const failed = (reason) => messages.push(JSON.stringify({ Failed: `the computation was aborted: ${reason}` }));
            worker.addEventListener('message', ({ data }) => messages.push(data));
            worker.addEventListener('error', (event) => {
                // Told in the window instead of as a failure of the page.
                event.preventDefault();
                failed(event.message ?? 'the worker could not start');
            });
            try {
                worker.postMessage({ code: laboratory.code, job });
            } catch (error) {
                failed(error);
            }
            works += 1;
            work.set(works, { worker, messages, rest: 0 });
            return works;
        },
        pollWork: (number) => work.get(number)?.messages.shift(),
        restWork(number, rest) {
            if (!work.has(number)) return;
            work.get(number).rest = rest;
            restAsTold(work.get(number));
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
            heard = on;
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

        // Not within the call: the laboratory is busy with a frame.
        graphicsLost: (start, why) => setTimeout(() => lost(start, why)),

        areGraphicsLost: () => laboratory.backend === 'webgl' && Boolean($('laboratory').getContext('webgl2')?.isContextLost()),
    };
}
