// Creates elements, and formats numbers.

/** Creates an element with properties and children. A name with a dash, `role` and `for` are set as attributes; names
 *  that begin with `on` are listeners. A button submits no form unless its type says so. */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  if (tag === 'button') element.type = 'button';
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (name.includes('-') || name === 'role' || name === 'for') element.setAttribute(name, value);
    else element[name] = value;
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

const SVG = 'http://www.w3.org/2000/svg';

export function draw(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** A picture of 16 x 16 by the lines of a path; isFilled: by its area. */
export const icon = (path, { isFilled = false } = {}) =>
  draw('svg', { viewBox: '0 0 16 16', width: 16, height: 16, 'aria-hidden': 'true' }, draw('path', { d: path, ...(isFilled
    ? { fill: 'currentColor' } : { fill: 'none', stroke: 'currentColor', 'stroke-width': 1.4, 'stroke-linecap': 'round', 'stroke-linejoin': 'round' }) }));

export const byId = (id) => document.getElementById(id);

/** A whole number with its thousands apart. Not by Intl, whose first use takes longer than any other statement at the start. */
export const count = (n) => String(n).replace(/\B(?=(\d{3})+$)/g, ',');

export function bytes(n) {
  if (n === null || n === undefined) return '–';
  const units = ['B', 'kB', 'MB', 'GB', 'TB'];
  let unit = 0;
  while (n >= 1000 && unit < units.length - 1) [n, unit] = [n / 1000, unit + 1];
  return `${unit === 0 || n >= 100 ? Math.round(n) : n.toFixed(1)} ${units[unit]}`;
}

/** A number with so many digits behind the point; never "-0.0". */
export const fixed = (n, digits) => n.toFixed(digits).replace(/^-(0\.?0*)$/, '$1');

export const seconds = (t) => `${t.toFixed(2)} s`;
/** How many there are of something; the words for several where an "s" does not make them. */
export const plural = (n, one, several = `${one}s`) => `${count(n)} ${n === 1 ? one : several}`;

/** A select: options as [value, text]; onchange(value). */
export function select(options, value, onchange, properties = {}) {
  const entries = options.map(([key, text]) => make('option', { value: key, selected: key === value }, text));
  return make('select', { ...properties, onchange: ({ target }) => onchange(target.value) }, ...entries);
}

/** A select with a label above it. */
export const choice = (label, options, value, onchange) =>
  make('label', { className: 'field' }, make('span', {}, label), select(options, value, onchange));

/** A slider between its label and its value. */
export const slider = (label, input, output) => make('div', { className: 'slider' }, make('span', {}, label), input, output);

/** A box to check, before its label. */
export const check = (input, label) => make('label', { className: 'check' }, input, make('span', {}, label));

/** Buttons of which one is pressed: entries as [name, text]; onchoose(name). */
export const chips = (entries, onchoose) => entries.map(([name, text]) =>
  make('button', { className: 'chip', 'data-name': name, onclick: () => onchoose(name) }, text));

export const press = (buttons, isPressed) => {
  for (const button of buttons) button.setAttribute('aria-pressed', isPressed(button.dataset.name));
};

/** Has a button open what floats below it, within the window. onopen() is called then. */
export function floats(button, list, onopen = () => {}) {
  const within = (at, size, most) => `${Math.max(8, Math.min(at, most - size - 8))}px`;
  list.popover = 'auto';
  list.addEventListener('toggle', ({ newState }) => {
    button.setAttribute('aria-expanded', newState === 'open');
    if (newState !== 'open') return;
    const { left, bottom } = button.getBoundingClientRect();
    Object.assign(list.style, { left: within(left, list.offsetWidth, innerWidth), top: within(bottom + 4, list.offsetHeight, innerHeight) });
    onopen();
  });
  for (const [name, value] of [['aria-haspopup', list.getAttribute('role')], ['aria-expanded', 'false']]) button.setAttribute(name, value);
  button.popoverTargetElement = list;
}

/** A button that opens a menu: entries as [text, function]. */
export function menu(button, label, entries) {
  const items = entries.map(([text, act]) => make('button', { role: 'menuitem', tabIndex: -1, onclick: () => {
    list.hidePopover();
    button.focus();
    act();
  } }, text));
  const list = make('div', { className: 'menu', role: 'menu', 'aria-label': label }, ...items);
  list.addEventListener('keydown', (event) => {
    const at = items.indexOf(document.activeElement);
    const next = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: -1 }[event.key];
    if (next === undefined) return;
    event.preventDefault();
    items.at(next % items.length).focus();
  });
  floats(button, list, () => items[0].focus());
  button.after(list);
}

/** Saves what an address leads to as a file. */
export const saveAs = (href, name) => make('a', { href, download: name }).click();

/** Saves bytes as a file. */
export function saveBlob(blob, name) {
  const href = URL.createObjectURL(blob);
  saveAs(href, name);
  setTimeout(() => URL.revokeObjectURL(href), 60000);
}

/** Asks in a dialog; resolves with the result of read() when it is confirmed, else with null. */
export function ask({ title, content, confirm, read = () => true }) {
  return new Promise((resolve) => {
    const id = `dialog-${Math.random().toString(36).slice(2)}`;
    const dialog = make('dialog', { 'aria-labelledby': id, onclose: () => {
      resolve(dialog.returnValue === 'yes' ? read() : null);
      dialog.remove();
    } });
    const form = make('form', { method: 'dialog' }, make('h2', { id }, title), ...content,
      make('div', { className: 'actions' },
        make('button', { type: 'submit', value: 'no', className: 'quiet', formNoValidate: true }, 'Cancel'),
        make('button', { type: 'submit', value: 'yes', className: 'primary' }, confirm)));
    // Enter in a field submits with the first button, which must be the confirming one.
    form.addEventListener('keydown', (event) => {
      if (event.key !== 'Enter' || event.target.tagName !== 'INPUT') return;
      event.preventDefault();
      dialog.close('yes');
    });
    dialog.append(form);
    document.body.append(dialog);
    dialog.showModal();
  });
}
