// The page within another one, as in a course page or in slides. It takes nothing that it was not given: no focus, no wheel, no
// Tab, no graphics while it is out of sight. And it does what the page around it asks for in messages (docs/embedding.md).

/** Whether there is a page around this one. */
export const framed = window !== window.top;

/** Version of the messages. */
const VERSION = 1;
/** How often the page around is told what happens, ms. */
const PACE = 100;

const canvas = () => document.getElementById('laboratory');

/** Comes to pass when the page is in sight for the first time; `told(shown)` hears of every change after that. */
export function inSight(told) {
    return new Promise((done) => {
        let first = true;
        const observer = new IntersectionObserver((entries) => {
            const shown = entries.at(-1).isIntersecting;
            if (!first) return told(shown);
            if (shown) {
                first = false;
                done();
            }
        });
        observer.observe(document.documentElement);
    });
}

/** Leaves wheel and Tab to the page around, but for what a click or tap has given to this one. */
export function stayPolite(page) {
    let active = false;
    const early = { capture: true, passive: true };
    addEventListener('pointerdown', () => (active = true), early);
    addEventListener('wheel', (event) => active || event.stopImmediatePropagation(), early);
    addEventListener('blur', () => {
        active = false;
        page.release();
    });
    addEventListener('keydown', (event) => {
        if (event.key === 'Escape') active = false;
        if (event.key === 'Tab' && isLast(page, event.shiftKey)) {
            // Past the last control comes what follows in the page around: the browser goes there if nobody is in its way.
            event.stopImmediatePropagation();
            page.release();
        }
    }, early);
}

/** Whether no control follows the one that has the focus. */
function isLast(page, backwards) {
    const controls = JSON.parse(page.widgets() || '[]').filter(({ focusable, disabled }) => focusable && !disabled);
    const at = controls.findIndex(({ focused }) => focused);
    if (controls.length === 0) return true;
    return backwards ? at <= 0 : at === controls.length - 1;
}

/** Answers the page around; `laboratory` is what web/main.js knows. */
export class Messages {
    /** What came before there was a picture. */
    #waiting = [];
    #begun = false;
    #told = { time: null, impact: 0 };

    constructor(laboratory) {
        this.laboratory = laboratory;
        const hear = ({ source, data }) => {
            if (source !== window.parent || data?.jointplay !== VERSION) return;
            if (this.#begun) this.#obey(data);
            else this.#waiting.push(data);
        };
        // stuck.js has listened so far, and goes on to.
        globalThis.jointplayMail.forEach(hear);
        globalThis.jointplayMail = { push: hear };
    }

    /** There is a picture. */
    begin() {
        const { scene, version } = JSON.parse(this.laboratory.page.state());
        this.#tell('ready', { scene, version });
        this.#begun = true;
        for (const message of this.#waiting) this.#obey(message);
        // A key that is of no use here may be one for the page around, as when slides go on.
        addEventListener('keydown', (event) => {
            const { key, code, shiftKey: shift, ctrlKey: control, altKey: alt, metaKey: meta } = event;
            if (!this.laboratory.page.uses(key, control || meta, alt)) this.#tell('key', { key, code, shift, control, alt, meta });
        }, { capture: true });
        setInterval(() => this.#watch(), PACE);
    }

    #tell(event, values) {
        // It goes to whoever shows this page: nothing in it is secret.
        window.parent.postMessage({ jointplay: VERSION, event, ...values }, '*');
    }

    #obey(message) {
        const { page, trouble } = this.laboratory;
        if (trouble) return this.#tell('problem', { text: trouble.title, message });
        const obey = {
            open: ({ link }) => page.openLink(`#${String(link).replace(/^[?#]/, '')}`),
            set: ({ key, value }) => page.set(String(key), String(value)),
            play: () => page.play(true),
            pause: () => page.play(false),
            reset: () => page.reset(),
            state: () => this.#tell('state', { state: JSON.parse(page.state()), link: page.link() }),
        };
        const known = Object.hasOwn(obey, message.do);
        const problem = known ? obey[message.do](message) : `allowed: ${Object.keys(obey).join(', ')}`;
        return problem ? this.#tell('problem', { text: problem, message }) : undefined;
    }

    /** Tells what has happened since the last time. */
    #watch() {
        const { page, ready, trouble } = this.laboratory;
        if (!ready || trouble) return;
        const { shown_s: time, playing } = JSON.parse(page.state());
        const told = this.#told;
        // After going back, what comes again is told again.
        told.impact = Math.min(told.impact, time);
        for (const impact of JSON.parse(page.impacts(told.impact))) {
            this.#tell('impact', impact);
            told.impact = impact.end_s;
        }
        const now = `${time} ${playing}`;
        if (told.time !== now) this.#tell('time', { time_s: time, playing });
        told.time = now;
    }
}
