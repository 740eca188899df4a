// The hand of a test that models: it looks from one place, clicks places of the world, and waits for what that makes.
import { PerspectiveCamera, Vector3 } from 'three';

import { drop } from './page_driver.mjs';

export const VIEW = [4, 3, 6, 0, 0, 0]; // where the camera stands, what it looks at

/** The camera of that view in a picture of so many pixels. */
export function cameraOf({ width, height }) {
  const camera = new PerspectiveCamera(35, width / height, 0.01, 100);
  camera.position.set(...VIEW.slice(0, 3));
  camera.lookAt(...VIEW.slice(3));
  camera.updateMatrixWorld();
  return camera;
}

/** Where a picture of so many pixels has a place of the world. */
export function seenAt({ width, height }, place) {
  const { x, y } = new Vector3(...place).project(cameraOf({ width, height }));
  return { x: ((x + 1) / 2) * width, y: ((1 - y) / 2) * height };
}

export class Modeller {
  constructor(visit) {
    this.visit = visit;
    this.page = visit.page;
  }

  get id() {
    return this.visit.model();
  }

  get edits() {
    return this.page.getByRole('textbox', { name: 'Edits' }).inputValue().then(JSON.parse);
  }

  get selection() {
    return this.page.getByLabel('Selection').inputValue().then(JSON.parse);
  }

  /** Does something, and waits for the model that it opens. */
  async opens(action) {
    const before = await this.id;
    await action();
    await this.visit.wait((id) => !location.hash.includes(`model=${id}`) && document.getElementById('facts').textContent.startsWith('Level'), before);
    await this.ready();
    await this.visit.drawn();
  }

  /** Until the viewport takes clicks. */
  ready() {
    return this.visit.wait(() => ['pickable', 'sculpts'].some((name) => name in document.querySelector('canvas').dataset));
  }

  press(name) {
    return this.opens(() => this.page.getByRole('button', { name, exact: true }).click());
  }

  async look() {
    await this.page.evaluate((view) => {
      const given = new URLSearchParams(location.hash.slice(1));
      given.set('view', view);
      location.hash = given;
    }, VIEW);
    await this.visit.drawn();
  }

  /** Where the picture has a place of the world, in pixels. */
  async at(place) {
    return seenAt(await this.page.locator('#view').boundingBox(), place);
  }

  async click(place, modifiers = [], act = 'click') {
    const position = await this.at(place);
    await this.page.locator('#view')[act]({ position, modifiers });
    await this.visit.drawn();
  }

  /** Drops a file, and turns to a tab. */
  async drop(name, text, tab = 'Edit') {
    await drop(this.visit, { [name]: text });
    await this.visit.wait((wanted) => document.getElementById('subject').textContent === wanted, name);
    await this.visit.tab(tab);
    await this.look();
    await this.ready();
  }

  /** Makes a shape by the menu. */
  shape(name) {
    return this.opens(async () => {
      await this.page.getByRole('button', { name: 'New shape' }).click();
      await this.page.getByRole('menuitem', { name, exact: true }).click();
    });
  }

  async box(size) {
    await this.shape('Box');
    await this.page.getByLabel('Box: size').fill(size);
    await this.opens(() => this.page.getByLabel('Box: size').press('Enter'));
    await this.look();
  }
}
