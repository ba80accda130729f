// The canvas: how many pixels it has (eframe asks a `ResizeObserver`, and lays the interface out by `devicePixelRatio`), and what
// drawing on it costs a processor.

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

/** What a context says of itself where the processor draws. */
const BY_PROCESSOR = /swiftshader|llvmpipe|softpipe|software|basic render/i;
/** A switch that egui's shader reads for every pixel: whether to filter its textures by itself, as pictures in tests do. */
const FILTER = /\b\w+\.predictable_texture_filtering\b/g;

/**
 * Has the contexts of `canvas` compile egui's shader with that switch off: the processor would run both sides of the branch, which
 * makes a third of a frame.
 */
export function drawLightly(canvas) {
    canvas.getContext = (...asked) => {
        const context = HTMLCanvasElement.prototype.getContext.apply(canvas, asked);
        const about = context?.getExtension?.('WEBGL_debug_renderer_info');
        if (about && BY_PROCESSOR.test(context.getParameter(about.UNMASKED_RENDERER_WEBGL))) {
            const { shaderSource } = WebGL2RenderingContext.prototype;
            context.shaderSource = (shader, text) => shaderSource.call(context, shader, text.replaceAll(FILTER, '0u'));
        }
        return context;
    };
}
