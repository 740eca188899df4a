// The tabs of the panel, each with its pane.
import { byId, make } from './dom.js';
import { change, state, watch } from './state.js';

const TABS = [['models', 'Models'], ['surface', 'Surface'], ['edit', 'Edit'], ['sculpt', 'Sculpt'], ['animation', 'Rotation'], ['scripts', 'Scripts']];

/** The panes by the names of their tabs. */
export const panes = Object.fromEntries(TABS.map(([name]) => [name,
  make('div', { role: 'tabpanel', id: `panel-${name}`, 'aria-labelledby': `tab-${name}`, className: 'pane' })]));

const tabs = TABS.map(([name, text]) => make('button', { role: 'tab', id: `tab-${name}`, 'aria-controls': `panel-${name}`, 'data-name': name,
  onclick: () => change({ tab: name }) }, text));

function show() {
  for (const tab of tabs) {
    const isChosen = tab.dataset.name === state('tab');
    tab.setAttribute('aria-selected', isChosen);
    tab.tabIndex = isChosen ? 0 : -1;
    panes[tab.dataset.name].hidden = !isChosen;
  }
}

byId('tabs').append(...tabs);
byId('tabs').addEventListener('keydown', (event) => {
  const at = tabs.indexOf(document.activeElement);
  const next = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: -1 }[event.key];
  if (next === undefined || at < 0) return;
  event.preventDefault();
  const tab = tabs.at(next % tabs.length);
  tab.focus();
  change({ tab: tab.dataset.name });
});
byId('panel').append(...Object.values(panes));
watch((names) => names.has('tab') && show());
show();
