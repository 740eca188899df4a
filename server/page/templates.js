// What several panels draw with lit-html.
import { html } from 'lit-html';

import { change, state } from './state.js';

/** A select with a label above it, for a name of the state: options as [value, text]. */
export const choice = (label, name, options, value = state(name)) => html`<label class="field"><span>${label}</span>
  <select @change=${({ target }) => change({ [name]: target.value })}>
    ${options.map(([key, text]) => html`<option value=${key} .selected=${key === value}>${text}</option>`)}</select></label>`;

/** A box to check, for a name of the state. */
export const flag = (label, name) => html`<label class="check"><input type="checkbox" .checked=${state(name) === 'true'}
  @change=${({ target }) => change({ [name]: target.checked })}><span>${label}</span></label>`;

/** A slider for a name of the state; said: its value in words. */
export const amount = (label, name, [min, max, step], said) => html`<div class="slider"><span>${label}</span>
  <input type="range" min=${min} max=${max} step=${step} aria-label=${label} .value=${state(name)} @input=${({ target }) => change({ [name]: target.value })}>
  <output class="value">${said}</output></div>`;

async function copy({ target }, text) {
  const isCopied = await navigator.clipboard?.writeText(text).then(() => true, () => false);
  target.textContent = isCopied ? 'Copied' : 'Not allowed';
  setTimeout(() => (target.textContent = 'Copy'), 1500);
}

/** Code with a button that copies it. */
export const codeLine = (label, text) => html`<div class="code"><span>${label}</span>
  <button type="button" class="small" aria-label="Copy: ${label}" @click=${(event) => copy(event, text)}>Copy</button><pre tabindex="0" aria-label=${label}>${text}</pre></div>`;
