// Mirrors the controls on the canvas as page elements, for screen readers and other assistive software. The elements lie invisibly
// over their controls and ignore the pointer. The keyboard focus stays on the canvas, whose `aria-activedescendant` names the focused
// element. Actions of assistive software on an element are passed to its control.

/** Interval between updates, ms. */
const UPDATE_INTERVAL = 200;
/** Steps in the range of a slider that defines none. */
const STEPS = 100;

/** Element and attributes by AccessKit role; all other roles are text. */
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
/** Roles without an element: parts of a text, and the status, which `#summary` contains. */
const OMITTED = ['TextRun', 'Status'];

/** Sets attributes, and removes those whose value is null, undefined or empty. */
function setAttributes(element, values) {
    for (const [name, value] of Object.entries(values)) {
        if (value === null || value === undefined || value === '') element.removeAttribute(name);
        else element.setAttribute(name, value);
    }
}

/** Updates the elements in `box` from the controls of `page`. */
export class Mirror {
    /** By AccessKit id: the element, and the JSON of its widget. */
    #shown = new Map();
    #frames = -1;
    /** Latest announcement of the focused control. */
    #announced = '';

    constructor(page, box) {
        this.page = page;
        this.box = box;
        box.addEventListener('click', (event) => {
            // The laboratory decides whether a box is checked.
            event.preventDefault();
            this.#request(event.target, 'Click');
        });
        box.addEventListener('focusin', ({ target }) => {
            this.#request(target, 'Focus');
            document.getElementById('laboratory').focus({ preventScroll: true });
        });
        box.addEventListener('input', ({ target }) => this.#changed(target));
        setInterval(() => this.follow(), UPDATE_INTERVAL);
    }

    /** Updates all elements. */
    follow() {
        this.box.hidden = document.getElementById('laboratory').hidden;
        if (this.box.hidden || this.#frames === this.page.frames()) return;
        const text = this.page.widgets();
        // The mirror is enabled from the next frame on.
        if (!text) return;
        this.#frames = this.page.frames();
        const widgets = JSON.parse(text).filter(({ role }) => !OMITTED.includes(role));
        const shown = new Map(widgets.map((widget) => [widget.id, this.#element(widget)]));
        for (const [id, { element }] of this.#shown) {
            if (shown.get(id)?.element !== element) element.remove();
        }
        this.#shown = shown;
        // By part of the window: its next element in document order.
        const next = new Map();
        for (const { element, inside } of shown.values()) {
            const part = shown.get(inside)?.element ?? this.box;
            const following = next.has(part) ? next.get(part) : part.querySelector(':scope > [data-id]');
            // An element in its place is not moved, because a screen reader may be on it.
            if (element !== following) part.insertBefore(element, following);
            next.set(part, element === following ? following.nextElementSibling : following);
        }
        this.#focus(widgets.find(({ focused }) => focused));
    }

    /** The element of a widget, reused if its role and part are unchanged. */
    #element(widget) {
        const text = JSON.stringify(widget);
        const before = this.#shown.get(widget.id);
        if (before?.text === text) return before;
        const [tag, fixed] = KINDS[widget.role] ?? ['span', {}];
        let element = before?.role === widget.role && before.inside === widget.inside ? before.element : null;
        if (!element) {
            element = document.createElement(tag);
            setAttributes(element, { ...fixed, id: `mirror-${widget.id}`, tabindex: tag === 'span' ? null : -1 });
            element.dataset.id = widget.id;
        }
        const [x0, y0, x1, y1] = widget.rect;
        const { style } = element;
        [style.left, style.top, style.width, style.height] = [x0, y0, x1 - x0, y1 - y0].map((length) => `${length}px`);
        describe(element, tag, widget);
        return { element, text, role: widget.role, inside: widget.inside };
    }

    /** Marks the focused element, and announces its changes. */
    #focus(widget) {
        const canvas = document.getElementById('laboratory');
        setAttributes(canvas, { 'aria-activedescendant': widget && `mirror-${widget.id}` });
        // eframe's hidden field for typed text has no name of its own.
        for (const field of document.querySelectorAll('main > input')) {
            setAttributes(field, { 'aria-label': widget?.label ?? 'Typed text' });
        }
        // For example the values at the cursor of a plot.
        const announcement = widget?.live ? widget.label : '';
        if (announcement && announcement !== this.#announced) document.getElementById('report-aloud').textContent = announcement;
        this.#announced = announcement;
    }

    #changed(element) {
        const { step, value, dataset } = element;
        if (!('value' in dataset)) return this.#request(element, 'SetValue', value);
        // A single step is one of the control, which may be logarithmic.
        const steps = Math.round((Number(value) - Number(dataset.value)) / Number(step));
        if (Math.abs(steps) === 1) this.#request(element, steps > 0 ? 'Increment' : 'Decrement');
        else this.#request(element, 'SetValue', Number(value));
    }

    #request(element, action, value) {
        this.page.request(element.dataset.id, action, value);
    }
}

/** Sets the name and state of `element` from its widget. */
function describe(element, tag, { role, label, text, value, min, max, step, on, expanded, disabled }) {
    if (tag === 'span') {
        element.textContent = label;
        return;
    }
    const name = ['ComboBox', 'Image'].includes(role) && text ? `${label}: ${text}` : label;
    setAttributes(element, { 'aria-label': name, 'aria-expanded': expanded });
    if (tag === 'div' || tag === 'section') {
        const number = role === 'ProgressIndicator' ? value : null;
        setAttributes(element, { 'aria-disabled': disabled || null, 'aria-valuenow': number });
        return;
    }
    element.disabled = disabled;
    if (tag === 'button') {
        setAttributes(element, { 'aria-pressed': on });
    } else if (element.type === 'checkbox' || element.type === 'radio') {
        element.checked = on;
    } else if (value === null) {
        element.value = text ?? '';
    } else {
        const defaultStep = min === null || max === null ? 'any' : (max - min) / STEPS;
        setAttributes(element, { min, max, step: step ?? defaultStep, 'aria-valuetext': text });
        element.value = value;
        // As the element has rounded it to its steps.
        element.dataset.value = element.value;
    }
}
