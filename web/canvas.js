// How many pixels the canvas has: eframe asks a `ResizeObserver`, and lays the interface out by `devicePixelRatio`.

/**
 * A `ResizeObserver` that also tells when the pixels of the screen change and nothing else does, as on the way from a laptop's
 * screen to a projector's, and whose numbers agree with `devicePixelRatio` where the browser's own do not.
 */
export class CanvasObserver extends ResizeObserver {
    /** What is observed, and how. */
    #targets = new Map();
    #ratio = null;

    constructor(told) {
        super((entries) => told(entries.map(agreeing)));
        this.#follow();
    }

    observe(target, options) {
        this.#targets.set(target, options);
        super.observe(target, options);
    }

    unobserve(target) {
        this.#targets.delete(target);
        super.unobserve(target);
    }

    disconnect() {
        this.#targets.clear();
        this.#ratio?.removeEventListener('change', this.#changed);
        super.disconnect();
    }

    #follow() {
        this.#ratio = matchMedia(`(resolution: ${devicePixelRatio}dppx)`);
        this.#ratio.addEventListener('change', this.#changed, { once: true });
    }

    #changed = () => {
        this.#follow();
        for (const [target, options] of this.#targets) {
            // What is observed anew is told at once.
            super.unobserve(target);
            super.observe(target, options);
        }
    };
}

/** `entry`, without its number of device pixels where that is not `devicePixelRatio` times the size: on an emulated screen. */
function agreeing(entry) {
    const own = entry.devicePixelContentBoxSize?.[0];
    const size = entry.contentBoxSize[0];
    if (!own || !size || Math.abs(own.inlineSize - size.inlineSize * devicePixelRatio) < 2) return entry;
    return new Proxy(entry, {
        has: (target, key) => key !== 'devicePixelContentBoxSize' && key in target,
        get: (target, key) => target[key],
    });
}
