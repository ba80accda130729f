// Scripts that run in the page before its own. They give the test control over time and workers, so that no test depends on the
// speed of the machine.

/**
 * Time advances only with frames: each comes `frame` ms after the previous one, however long it took, and each reading of the clock
 * adds `look` ms. While `held`, frames come only when `step(count)` requests them. With `hasty`, long timers of the page (updates of
 * the address, restarts of lost graphics) take a twentieth of their time.
 */
export function driveTime() {
    const requestFrame = globalThis.requestAnimationFrame.bind(globalThis);
    const wait = globalThis.setTimeout.bind(globalThis);
    globalThis.setTimeout = (call, delay, ...rest) => wait(call, time.hasty && delay > 100 ? delay / 20 : delay, ...rest);
    const soon = new MessageChannel();
    soon.port2.onmessage = tick;
    const waiting = new Map();
    let steps = [];
    let [last, isArmed] = [0, false];
    const time = { now: 0, frame: 50, look: 1e-3, held: false, hasty: true, step, free };
    globalThis.drivenTime = time;
    Performance.prototype.now = () => (time.now += time.look);
    globalThis.requestAnimationFrame = (call) => {
        last += 1;
        waiting.set(last, call);
        arm();
        return last;
    };
    globalThis.cancelAnimationFrame = (id) => void waiting.delete(id);

    function arm() {
        if (isArmed || waiting.size === 0 || (time.held && steps.length === 0)) return;
        isArmed = true;
        // Without drawing there is no need to wait for the screen.
        if (time.held && globalThis.drawsNothing) soon.port1.postMessage(null);
        else requestFrame(tick);
    }

    function tick() {
        isArmed = false;
        if (time.held && steps.length === 0) return;
        time.now += time.frame;
        for (const id of [...waiting.keys()]) {
            const call = waiting.get(id);
            waiting.delete(id);
            try {
                call?.(time.now);
            } catch (error) {
                reportError(error);
            }
        }
        for (const step of steps) step.left -= 1;
        steps.filter(({ left }) => left === 0).forEach(({ done }) => done());
        steps = steps.filter(({ left }) => left > 0);
        arm();
    }

    /** Draws `count` frames. A page that requests none, such as one that has stopped, gets a short pause instead. */
    function step(count) {
        if (waiting.size === 0) return new Promise((done) => wait(done, 10));
        return new Promise((done) => {
            steps.push({ left: count, done });
            arm();
        });
    }

    function free() {
        time.held = false;
        arm();
    }
}

/** Makes WebGL2 draw nothing until `drawsNothing` is false: with software rendering, unseen pixels take most of the time. */
export function drawNothing() {
    globalThis.drawsNothing = true;
    const { prototype } = WebGL2RenderingContext;
    for (const name of ['blitFramebuffer', 'clear', 'drawArrays', 'drawArraysInstanced', 'drawElements', 'drawElementsInstanced']) {
        const draw = prototype[name];
        prototype[name] = function (...rest) {
            if (!globalThis.drawsNothing) draw.apply(this, rest);
        };
    }
}

/** Holds back messages of workers until the test delivers them. */
export function holdWorkers() {
    const post = { waiting: [], deliver };
    globalThis.heldPost = post;
    let arrived = () => {};

    /** Delivers messages up to the first of this kind, and returns that one. */
    async function deliver(kind) {
        for (;;) {
            while (post.waiting.length > 0) {
                const { data, send } = post.waiting.shift();
                send();
                const message = JSON.parse(data);
                if (message === kind || kind in Object(message)) return message;
            }
            await new Promise((done) => (arrived = done));
        }
    }

    const { Worker } = globalThis;
    globalThis.Worker = class extends Worker {
        addEventListener(kind, listener, ...rest) {
            if (kind !== 'message') return super.addEventListener(kind, listener, ...rest);
            const hold = (event) => {
                post.waiting.push({ from: this, data: event.data, send: () => listener(event) });
                arrived();
            };
            return super.addEventListener(kind, hold, ...rest);
        }

        terminate() {
            post.waiting = post.waiting.filter(({ from }) => from !== this);
            super.terminate();
        }
    };
}
