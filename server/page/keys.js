// The sheet of keys, under "?".
import { byId, make } from './dom.js';

const SHEETS = [
  ['Everywhere', [['F', 'Frame the model'], ['Space', 'Play or pause'], ['Ctrl Z', 'Undo'], ['Ctrl Shift Z', 'Redo'], ['?', 'This sheet']]],
  ['On the picture', [['Arrows', 'Orbit, with Shift pan'], ['+ −', 'Zoom']]],
  ['Select', [['1 2 3', 'Points, edges, faces'], ['Click', 'Select, with Shift more'], ['Alt click', 'Loop of an edge, with Ctrl its ring'], ['B', 'Box'], ['A, Alt A', 'All, none'],
    ['L', 'What is linked'], ['Ctrl + −', 'Grow, shrink'], ['Ctrl I', 'Invert'], ['N P', 'Next, previous']]],
  ['Edit', [['G R S', 'Move, rotate, scale; then X Y Z'], ['E', 'Extrude'], ['I', 'Inset'], ['Ctrl R', 'Loop cut; the wheel adds cuts'], ['Shift E', 'Crease'], ['X', 'Delete'],
    ['Digits', 'Type the amount'], ['Enter, Esc', 'Apply, cancel']]],
  ['Sculpt', [['Ctrl', 'The other way round'], ['Shift', 'Smooth; when grabbing, along the normal'], ['Shift wheel, [ ]', 'Radius'], ['N P', 'Next, previous point']]],
];

export function showKeys() {
  if (byId('keys')) return;
  const sheet = ([title, rows]) => make('section', {}, make('h3', {}, title),
    make('dl', {}, ...rows.flatMap(([keys, text]) => [make('dt', {}, make('kbd', {}, keys)), make('dd', {}, text)])));
  const dialog = make('dialog', { id: 'keys', 'aria-labelledby': 'keys-title', onclose: () => dialog.remove() },
    make('form', { method: 'dialog' }, make('div', { className: 'row' }, make('h2', { id: 'keys-title' }, 'Keys'), make('span', { className: 'space' }),
      make('button', { type: 'submit', className: 'close', 'aria-label': 'Close' }, '×'))),
    make('div', { className: 'sheets', tabIndex: 0, role: 'group', 'aria-label': 'All keys' }, ...SHEETS.map(sheet)));
  document.body.append(dialog);
  dialog.showModal();
}
