// The page in a frame of a course page or slides. It takes no focus, wheel or Tab unasked, holds no graphics while it is out of
// sight, and answers messages from the embedding page (docs/embedding.md).

/** Whether another page embeds this one. */
export const isFramed = window !== window.top;

/** Version of the message protocol. */
const VERSION = 1;
/** Interval between reports to the embedding page, ms. */
const REPORT_INTERVAL = 100;

/** Most characters of a text in a message: more than any link has. */
const MAX_TEXT = 100_000;

const canvas = () => document.getElementById('laboratory');

/** Resolves when the page becomes visible for the first time; later changes call `changed(visible)`. */
export function firstVisible(changed) {
    return new Promise((done) => {
        let first = true;
        const observer = new IntersectionObserver((entries) => {
            const visible = entries.at(-1).isIntersecting;
            if (!first) return changed(visible);
            if (visible) {
                first = false;
                done();
            }
        });
        observer.observe(document.documentElement);
    });
}

/** Leaves the wheel to the embedding page until this one is clicked, and Tab once the last control is reached. */
export function yieldInput(page) {
    let active = false;
    const capture = { capture: true, passive: true };
    addEventListener('pointerdown', () => (active = true), capture);
    addEventListener('wheel', (event) => active || event.stopImmediatePropagation(), capture);
    addEventListener('blur', () => {
        active = false;
        page.release();
    });
    addEventListener('keydown', (event) => {
        if (event.key === 'Escape') active = false;
        if (event.key === 'Tab' && isLast(page, event.shiftKey)) {
            // The browser moves on to the embedding page, unless eframe sees the key.
            event.stopImmediatePropagation();
            page.release();
        }
    }, capture);
}

/** Whether no control follows the focused one. */
function isLast(page, backwards) {
    const controls = JSON.parse(page.widgets() || '[]').filter(({ focusable, disabled }) => focusable && !disabled);
    const at = controls.findIndex(({ focused }) => focused);
    if (controls.length === 0) return true;
    return backwards ? at <= 0 : at === controls.length - 1;
}

/** Why a message cannot be processed. */
class Refusal extends Error {}

/** The field `name` of a message as a text. Any page may send any object, also one that JavaScript cannot turn into a text. */
function textOf(message, name) {
    const value = message[name];
    if (value === undefined) throw new Refusal(`\`${name}\` is missing`);
    if (!['string', 'number', 'boolean'].includes(typeof value)) throw new Refusal(`\`${name}\` must be a text`);
    const text = String(value);
    if (text.length > MAX_TEXT) throw new Refusal(`\`${name}\` has ${text.length} characters; allowed at most ${MAX_TEXT}`);
    return text;
}

/** Answers the embedding page; `laboratory` is that of web/main.js. */
export class Messages {
    /** Messages that arrived before the first picture. */
    #queue = [];
    #isStarted = false;
    #reported = { time: null, impact: 0 };

    constructor(laboratory) {
        this.laboratory = laboratory;
        const receive = ({ source, data }) => {
            if (source !== window.parent || data?.jointplay !== VERSION) return;
            if (this.#isStarted) this.#handle(data);
            else this.#queue.push(data);
        };
        // The listener in stuck.js remains and pushes later messages.
        globalThis.jointplayMail.forEach(receive);
        globalThis.jointplayMail = { push: receive };
    }

    /** Call once the first picture is shown. */
    start() {
        const { scene, version } = JSON.parse(this.laboratory.page.state());
        this.#post('ready', { scene, version });
        // A key without a function here may be one of the embedding page, such as the next slide.
        addEventListener('keydown', (event) => {
            const { key, code, shiftKey: shift, ctrlKey: control, altKey: alt, metaKey: meta } = event;
            if (!this.laboratory.page.uses(key, control || meta, alt)) this.#post('key', { key, code, shift, control, alt, meta });
        }, { capture: true });
        setInterval(() => this.#report(), REPORT_INTERVAL);
        this.#isStarted = true;
        for (const message of this.#queue) this.#handle(message);
    }

    #post(event, values) {
        const report = { jointplay: VERSION, event, ...values };
        // Any page may embed this one and receives this; nothing in it is secret.
        const send = () => window.parent.postMessage(report, '*');
        try {
            send();
        } catch {
            // The message in it holds something that cannot be copied back, such as a port.
            delete report.message;
            send();
        }
    }

    /** Performs the request of a message, or answers why not. */
    #handle(message) {
        try {
            const problem = this.#perform(message);
            if (problem) this.#post('problem', { text: problem, message });
        } catch (error) {
            const text = this.laboratory.trouble?.title ?? error?.message ?? String(error);
            this.#post('problem', { text, message });
            // An error of the program is reported as any other; later messages are answered nevertheless.
            if (!(error instanceof Refusal)) setTimeout(() => { throw error; });
        }
    }

    /** Returns the reason if the request cannot be performed. */
    #perform(message) {
        const { page, trouble } = this.laboratory;
        if (trouble) return trouble.title;
        const actions = {
            open: () => page.openLink(`#${textOf(message, 'link').replace(/^[?#]/, '')}`),
            set: () => page.set(textOf(message, 'key'), textOf(message, 'value')),
            play: () => page.play(true),
            pause: () => page.play(false),
            reset: () => page.reset(),
            state: () => this.#post('state', { state: JSON.parse(page.state()), link: page.link() }),
        };
        const isKnown = typeof message.do === 'string' && Object.hasOwn(actions, message.do);
        return isKnown ? actions[message.do]() : `allowed: ${Object.keys(actions).join(', ')}`;
    }

    /** Reports what has changed since the last call. */
    #report() {
        const { page, ready, trouble } = this.laboratory;
        if (!ready || trouble) return;
        const { shown_s: time, playing } = JSON.parse(page.state());
        const reported = this.#reported;
        // After a jump back in time, repeated impacts are reported again.
        reported.impact = Math.min(reported.impact, time);
        for (const impact of JSON.parse(page.impacts(reported.impact))) {
            this.#post('impact', impact);
            reported.impact = impact.end_s;
        }
        const now = `${time} ${playing}`;
        if (reported.time !== now) this.#post('time', { time_s: time, playing });
        reported.time = now;
    }
}
