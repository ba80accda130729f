// Canvas helpers: its size in device pixels (eframe reads it from a `ResizeObserver`, and lays the interface out by
// `devicePixelRatio`), and cheaper shaders for software rendering.

/**
 * A `ResizeObserver` that also fires when only `devicePixelRatio` changes, as when a window moves from a laptop's screen to a
 * projector, and whose sizes agree with `devicePixelRatio` where the browser's own do not.
 */
export class CanvasObserver extends ResizeObserver {
    /** Observed elements and their options. */
    #targets = new Map();
    #ratio = null;

    constructor(callback) {
        super((entries) => callback(entries.map(consistentEntry)));
        this.#watchRatio();
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
        this.#ratio?.removeEventListener('change', this.#ratioChanged);
        super.disconnect();
    }

    #watchRatio() {
        this.#ratio = matchMedia(`(resolution: ${devicePixelRatio}dppx)`);
        this.#ratio.addEventListener('change', this.#ratioChanged, { once: true });
    }

    #ratioChanged = () => {
        this.#watchRatio();
        for (const [target, options] of this.#targets) {
            // Observing an element again reports its size immediately.
            super.unobserve(target);
            super.observe(target, options);
        }
    };
}

/** `entry` without its size in device pixels if that is not `devicePixelRatio` times the CSS size, as on an emulated screen. */
function consistentEntry(entry) {
    const devicePixels = entry.devicePixelContentBoxSize?.[0];
    const size = entry.contentBoxSize[0];
    if (!devicePixels || !size || Math.abs(devicePixels.inlineSize - size.inlineSize * devicePixelRatio) < 2) return entry;
    return new Proxy(entry, {
        has: (target, key) => key !== 'devicePixelContentBoxSize' && key in target,
        get: (target, key) => target[key],
    });
}

/** Renderer names of software rasterisers. */
const SOFTWARE_RENDERER = /swiftshader|llvmpipe|softpipe|software|basic render/i;
/** A uniform that egui's shader reads for every pixel: whether the shader filters textures itself, as egui's snapshot tests need. */
const FILTER_SWITCH = /\b\w+\.predictable_texture_filtering\b/g;

/**
 * Makes software WebGL contexts of `canvas` compile egui's shader with that switch off. A software rasteriser executes both sides
 * of the branch, which takes a third of each frame.
 */
export function simplifyShaders(canvas) {
    canvas.getContext = (...request) => {
        const context = HTMLCanvasElement.prototype.getContext.apply(canvas, request);
        const info = context?.getExtension?.('WEBGL_debug_renderer_info');
        if (info && SOFTWARE_RENDERER.test(context.getParameter(info.UNMASKED_RENDERER_WEBGL))) {
            const { shaderSource } = WebGL2RenderingContext.prototype;
            context.shaderSource = (shader, text) => shaderSource.call(context, shader, text.replaceAll(FILTER_SWITCH, '0u'));
        }
        return context;
    };
}
