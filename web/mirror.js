// What the canvas shows, as elements of the page: for screen readers and other assistive programs. They lie over the canvas in the
// places of what they stand for, unseen and out of the pointer's way. The keyboard stays with the canvas, which names the element
// that has the focus; what an assistive program does to an element goes to the control that it stands for.

/** How often the elements follow the picture, ms. */
const PACE = 200;
/** Steps in the range of a slider that has no steps of its own. */
const STEPS = 100;

/** Element and attributes by AccessKit's role; what is not here is a text. */
const KINDS = {
    Button: ['button', {}],
    CheckBox: ['input', { type: 'checkbox' }],
    ComboBox: ['button', { 'aria-haspopup': 'listbox' }],
    Dialog: ['section', { role: 'dialog' }],
    DisclosureTriangle: ['button', {}],
    Heading: ['span', { role: 'heading', 'aria-level': 2 }],
    Image: ['div', { role: 'img' }],
    Link: ['div', { role: 'link' }],
    MultilineTextInput: ['textarea', {}],
    ProgressIndicator: ['div', { role: 'progressbar' }],
    RadioButton: ['input', { type: 'radio' }],
    Region: ['section', {}],
    Slider: ['input', { type: 'range' }],
    SpinButton: ['input', { type: 'number' }],
    Splitter: ['input', { type: 'range' }],
    TextInput: ['input', { type: 'text' }],
};
/** Written while drawing; or told elsewhere on the page, when it changes. */
const LEFT_OUT = ['TextRun', 'Status'];

/** Sets attributes; takes away those that are null. */
function attributes(element, values) {
    for (const [name, value] of Object.entries(values)) {
        if (value === null || value === undefined || value === '') element.removeAttribute(name);
        else element.setAttribute(name, value);
    }
}

/** Keeps the elements in the box `mirror` as the laboratory of `page` is. */
export class Mirror {
    /** By AccessKit's number: the element, and the widget that it was made after, as text. */
    #shown = new Map();
    #frames = -1;
    /** What the control that has the focus last said of itself. */
    #said = '';

    constructor(page, box) {
        this.page = page;
        this.box = box;
        box.addEventListener('click', (event) => {
            // Whether it is on is for the laboratory to say.
            event.preventDefault();
            this.#ask(event.target, 'Click');
        });
        box.addEventListener('focusin', ({ target }) => {
            this.#ask(target, 'Focus');
            document.getElementById('laboratory').focus({ preventScroll: true });
        });
        box.addEventListener('input', ({ target }) => this.#changed(target));
        setInterval(() => this.follow(), PACE);
    }

    /** Makes the elements what the laboratory shows now. */
    follow() {
        this.box.hidden = document.getElementById('laboratory').hidden;
        if (this.box.hidden || this.#frames === this.page.frames()) return;
        const text = this.page.widgets();
        // The first picture with this in mind is still to come.
        if (!text) return;
        this.#frames = this.page.frames();
        const widgets = JSON.parse(text).filter(({ role }) => !LEFT_OUT.includes(role));
        const shown = new Map(widgets.map((widget) => [widget.id, this.#element(widget)]));
        for (const [id, { element }] of this.#shown) {
            if (shown.get(id)?.element !== element) element.remove();
        }
        this.#shown = shown;
        // By the part of the window: the element in the next place.
        const next = new Map();
        for (const { element, inside } of shown.values()) {
            const part = shown.get(inside)?.element ?? this.box;
            const there = next.has(part) ? next.get(part) : part.querySelector(':scope > [data-id]');
            // What is in its place stays there: a reader may be at it.
            if (element !== there) part.insertBefore(element, there);
            next.set(part, element === there ? there.nextElementSibling : there);
        }
        this.#focus(widgets.find(({ focused }) => focused));
    }

    /** The element of a widget: the one it had, where that still fits. */
    #element(widget) {
        const text = JSON.stringify(widget);
        const before = this.#shown.get(widget.id);
        if (before?.text === text) return before;
        const [tag, fixed] = KINDS[widget.role] ?? ['span', {}];
        let element = before?.role === widget.role && before.inside === widget.inside ? before.element : null;
        if (!element) {
            element = document.createElement(tag);
            attributes(element, { ...fixed, id: `mirror-${widget.id}`, tabindex: tag === 'span' ? null : -1 });
            element.dataset.id = widget.id;
        }
        const [x0, y0, x1, y1] = widget.rect;
        const { style } = element;
        [style.left, style.top, style.width, style.height] = [x0, y0, x1 - x0, y1 - y0].map((length) => `${length}px`);
        describe(element, tag, widget);
        return { element, text, role: widget.role, inside: widget.inside };
    }

    /** Tells where the keyboard is. */
    #focus(widget) {
        const canvas = document.getElementById('laboratory');
        attributes(canvas, { 'aria-activedescendant': widget && `mirror-${widget.id}` });
        // What eframe takes typed text by has no name of its own.
        for (const field of document.querySelectorAll('main > input')) {
            attributes(field, { 'aria-label': widget?.label ?? 'Typed text' });
        }
        // As when the cursor of a plot moves.
        const said = widget?.live ? widget.label : '';
        if (said && said !== this.#said) document.getElementById('report-aloud').textContent = said;
        this.#said = said;
    }

    #changed(element) {
        const { step, value, dataset } = element;
        if (!('value' in dataset)) return this.#ask(element, 'SetValue', value);
        // One step is one of the control's own, which may be logarithmic.
        const steps = Math.round((Number(value) - Number(dataset.value)) / Number(step));
        if (Math.abs(steps) === 1) this.#ask(element, steps > 0 ? 'Increment' : 'Decrement');
        else this.#ask(element, 'SetValue', Number(value));
    }

    #ask(element, action, value) {
        this.page.ask(element.dataset.id, action, value);
    }
}

/** Gives `element` the state of `widget`. */
function describe(element, tag, { role, label, text, value, min, max, step, on, expanded, disabled }) {
    if (tag === 'span') {
        element.textContent = label;
        return;
    }
    const name = ['ComboBox', 'Image'].includes(role) && text ? `${label}: ${text}` : label;
    attributes(element, { 'aria-label': name, 'aria-expanded': expanded });
    if (tag === 'div' || tag === 'section') {
        const number = role === 'ProgressIndicator' ? value : null;
        attributes(element, { 'aria-disabled': disabled || null, 'aria-valuenow': number });
        return;
    }
    element.disabled = disabled;
    if (tag === 'button') {
        attributes(element, { 'aria-pressed': on });
    } else if (element.type === 'checkbox' || element.type === 'radio') {
        element.checked = on;
    } else if (value === null) {
        element.value = text ?? '';
    } else {
        const own = min === null || max === null ? 'any' : (max - min) / STEPS;
        attributes(element, { min, max, step: step ?? own, 'aria-valuetext': text });
        element.value = value;
        // As the element holds it: a multiple of its step.
        element.dataset.value = element.value;
    }
}
