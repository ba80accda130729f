// What runs in the page before its scripts do. It takes time and workers into the hand of the test, so that no test depends on
// how fast the machine is.

/**
 * Lets time pass by frames alone: each is `frame` ms after the last, however long it took, and a look at the clock within one
 * costs `look` ms. While `held`, frames come only as `step(count)` asks for them. Where `hasty`, what the page waits for longer than
 * a moment (the address that follows, lost graphics) comes after a twentieth of the time.
 */
export function driveTime() {
    const ask = globalThis.requestAnimationFrame.bind(globalThis);
    const wait = globalThis.setTimeout.bind(globalThis);
    globalThis.setTimeout = (call, delay, ...rest) => wait(call, time.hasty && delay > 100 ? delay / 20 : delay, ...rest);
    const soon = new MessageChannel();
    soon.port2.onmessage = tick;
    const waiting = new Map();
    let steps = [];
    let [last, asked] = [0, false];
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
        if (asked || waiting.size === 0 || (time.held && steps.length === 0)) return;
        asked = true;
        // What nobody sees need not wait for the screen.
        if (time.held && globalThis.drawsNothing) soon.port1.postMessage(null);
        else ask(tick);
    }

    function tick() {
        asked = false;
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

    /** Draws so many frames. A page that wants none, as one that has stopped, is given a moment instead. */
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

/**
 * Has WebGL2 draw nothing, until `drawsNothing` is false: of what a page costs where the processor draws, pixels that nobody looks at
 * are most.
 */
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

/** Keeps what workers say to the page until the test lets it through. */
export function holdWorkers() {
    const post = { waiting: [], pass };
    globalThis.heldPost = post;
    let arrived = () => {};

    /** Lets messages through up to the first of this kind, and gives that one. */
    async function pass(kind) {
        for (;;) {
            while (post.waiting.length > 0) {
                const { data, tell } = post.waiting.shift();
                tell();
                const message = JSON.parse(data);
                if (message === kind || kind in Object(message)) return message;
            }
            await new Promise((done) => (arrived = done));
        }
    }

    const { Worker } = globalThis;
    globalThis.Worker = class extends Worker {
        addEventListener(kind, told, ...rest) {
            if (kind !== 'message') return super.addEventListener(kind, told, ...rest);
            const hold = (event) => {
                post.waiting.push({ from: this, data: event.data, tell: () => told(event) });
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
