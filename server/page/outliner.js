// What a model consists of: its tree of nodes, meshes and materials, with counts.
import { html, nothing, render } from 'lit-html';

import { count, make, plural } from './dom.js';
import { change, state, watch } from './state.js';

const NODES_MOST = 500; // that are listed

export class Outliner {
  constructor(panel) {
    this.content = make('div');
    panel.append(this.content);
    watch((names) => names.has('node') && this.show());
  }

  /** materials: of the shown surface, [{name, colour, isTextured}]. */
  open(model, materials) {
    Object.assign(this, { model, materials });
    this.show();
  }

  show() {
    const { model, materials } = this;
    if (!model) return render(nothing, this.content);
    const { nodes, meshes, skins, clips } = model;
    const children = Map.groupBy(nodes.slice(0, NODES_MOST), ({ parent }) => parent);
    const meshText = (index) => `${meshes[index].name ?? `mesh ${index}`}, ${plural(meshes[index].faces, 'face')}`;
    const branch = (node) => {
      const below = children.get(node.name) ?? [];
      const own = html`<button type="button" class="node" aria-pressed=${node.name === state('node')} @click=${() => change({ node: node.name })}>${node.name}
        <span class="dim">${node.mesh === null ? '' : meshText(node.mesh)}</span></button>`;
      return html`<li>${own}${below.length > 0 ? html`<ul>${below.map(branch)}</ul>` : nothing}</li>`;
    };
    const facts = [plural(nodes.length, 'node'), plural(meshes.length, 'mesh', 'meshes'), plural(materials.length, 'material'),
      skins.length > 0 && plural(skins.length, 'skin'), clips.length > 0 && plural(clips.length, 'clip')].filter(Boolean).join(', ');
    return render(html`<details class="group outliner"><summary>Parts: ${facts}</summary>
      <ul class="tree">${(children.get(null) ?? []).map(branch)}</ul>
      ${nodes.length > NODES_MOST ? html`<p class="dim">and ${count(nodes.length - NODES_MOST)} more</p>` : nothing}
      ${materials.length > 0 ? html`<ul class="materials">${materials.map(({ name, colour, isTextured }) => html`<li><i .style=${`background-color:${colour}`}></i>${name || 'unnamed'}<span class="dim">${isTextured ? 'textured' : ''}</span></li>`)}</ul>` : nothing}
    </details>`, this.content);
  }
}
