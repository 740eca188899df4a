// <tweend-viewer>: a custom element that shows a model's surface and plays its clips, drawn by three.js. The daemon serves it
// at /viewer.js with all that it needs.
import {
  AnimationMixer, Box3, DataTexture, DirectionalLight, EquirectangularReflectionMapping, FloatType, HemisphereLight, PerspectiveCamera, PMREMGenerator, Scene,
  Sphere, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

import { TweendLoader } from './three.js';
import { Tweend } from './tweend.js';

const STYLE = `
  :host { display: block; position: relative; min-height: 150px; aspect-ratio: 4 / 3; overflow: hidden }
  :host([hidden]) { display: none }
  canvas { display: block; position: absolute; inset: 0; width: 100%; height: 100%; touch-action: none }
  p { position: absolute; inset: 0; display: grid; place-content: center; margin: 1em; font: 1em system-ui; text-align: center; pointer-events: none }
`;

/** What is shown anew when it changes. */
const SHOWN = ['model', 'src', 'base', 'level', 'clip', 'options'];
const STEP = 0.15; // radians that an arrow key turns

const DULL = 0.5; // the most that a material is a metal where there is no sky to reflect: it would be black

/** Whether pictures are computed without a graphics card. */
function isSoftware(renderer) {
  const context = renderer.getContext();
  const names = context.getExtension('WEBGL_debug_renderer_info');
  return names !== null && /swiftshader|llvmpipe|software/i.test(context.getParameter(names.UNMASKED_RENDERER_WEBGL));
}

/** Lights the scene by a sky; in software, which would filter it for seconds, by a lamp. */
function light(scene, renderer) {
  if (isSoftware(renderer)) return scene.add(new HemisphereLight(0xffffff, 0x77726d, 1.5));
  const [sky, generator] = [makeSky(), new PMREMGenerator(renderer)];
  scene.environment = generator.fromEquirectangular(sky).texture;
  sky.dispose();
  generator.dispose();
}

/** A small sky, bright on one side, which metals reflect. */
function makeSky() {
  const [width, height] = [64, 32];
  const pixels = new Float32Array(4 * width * height);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const up = (2 * y) / (height - 1) - 1;
      const side = Math.cos((2 * Math.PI * (x - 40)) / width);
      const light = up < 0 ? 0.3 + 0.2 * up : 0.45 + 0.25 * up + 2 * Math.exp(-12 * ((up - 0.55) ** 2 + (1 - side) ** 2));
      pixels.set([light, light, light * (up < 0 ? 0.96 : 1.03), 1], 4 * (y * width + x));
    }
  }
  const sky = new DataTexture(pixels, width, height, undefined, FloatType);
  sky.mapping = EquirectangularReflectionMapping;
  sky.needsUpdate = true;
  return sky;
}

function dispose(root) {
  root.traverse(({ geometry, material, skeleton }) => {
    geometry?.dispose();
    skeleton?.dispose();
    for (const one of [material].flat().filter(Boolean)) {
      for (const value of Object.values(one)) if (value?.isTexture) value.dispose();
      one.dispose();
    }
  });
}

// Servers that render pages have no elements.
export class TweendViewer extends (globalThis.HTMLElement ?? Object) {
  #client;
  #loader;
  #loading; // what was asked for last
  #stage; // {renderer, scene, camera, controls, observers} while it is in a page
  #gltf;
  #mixer;
  #words;
  #last; // ms, of the frame before

  static observedAttributes = [...SHOWN, 'alt', 'speed', 'auto-rotate'];

  constructor() {
    super();
    const shadow = this.attachShadow({ mode: 'open' });
    const style = new CSSStyleSheet();
    style.replaceSync(STYLE);
    shadow.adoptedStyleSheets = [style];
    this.#words = document.createElement('p');
    this.#words.setAttribute('role', 'status');
  }

  /** The client that asks the daemon. */
  get client() {
    return (this.#client ??= new Tweend(this.getAttribute('base') ?? undefined));
  }

  set client(tweend) {
    this.#client = tweend;
    this.#ask();
  }

  get gltf() {
    return this.#gltf;
  }

  connectedCallback() {
    this.tabIndex = this.tabIndex < 0 ? 0 : this.tabIndex;
    this.setAttribute('role', 'img');
    this.#describe();
    try {
      this.#begin();
    } catch {
      return this.#fail(new Error('this browser draws no WebGL'));
    }
    this.#ask();
  }

  disconnectedCallback() {
    this.#loader?.abort();
    this.#loading = undefined;
    this.#clear();
    if (!this.#stage) return;
    const { renderer, scene, controls, observers } = this.#stage;
    for (const observer of observers) observer.disconnect();
    renderer.setAnimationLoop(null);
    controls.dispose();
    scene.environment?.dispose();
    renderer.dispose();
    renderer.forceContextLoss(); // a page has few of them
    renderer.domElement.remove();
    this.#stage = undefined;
  }

  attributeChangedCallback(name) {
    if (name === 'base') this.#client = undefined;
    if (name === 'alt') this.#describe();
    if (SHOWN.includes(name)) this.#ask();
    else this.#run();
  }

  #describe() {
    this.setAttribute('aria-label', this.getAttribute('alt') ?? 'A model in three dimensions; arrow keys turn it, plus and minus bring it nearer and farther');
  }

  // ---- drawing ----

  #begin() {
    const renderer = new WebGLRenderer({ antialias: true, alpha: true });
    this.shadowRoot.replaceChildren(renderer.domElement, this.#words);
    const scene = new Scene();
    light(scene, renderer);
    const camera = new PerspectiveCamera(35);
    camera.position.set(0.45, 0.3, 0.84);
    const sun = new DirectionalLight(0xffffff, 1.2);
    sun.position.set(-0.5, 1, 0.8);
    camera.add(sun);
    scene.add(camera);
    const controls = new OrbitControls(camera, renderer.domElement);
    controls.addEventListener('change', () => this.#draw());
    renderer.domElement.addEventListener('webglcontextrestored', () => this.#draw());
    this.addEventListener('keydown', this.#key);
    const size = new ResizeObserver(() => this.#resize());
    const sight = new IntersectionObserver(([{ isIntersecting }]) => {
      this.#stage.isSeen = isIntersecting;
      this.#run();
    });
    this.#stage = { renderer, scene, camera, controls, observers: [size, sight], isSeen: false };
    for (const observer of this.#stage.observers) observer.observe(this);
  }

  #resize() {
    const { renderer, camera } = this.#stage;
    const { clientWidth: width, clientHeight: height } = this;
    if (!width || !height) return;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    this.#draw();
  }

  #draw() {
    this.#stage?.renderer.render(this.#stage.scene, this.#stage.camera);
  }

  /** Whether it turns by itself, which some people ask their systems to keep from. */
  get #turns() {
    return this.hasAttribute('auto-rotate') && !matchMedia('(prefers-reduced-motion: reduce)').matches;
  }

  /** Draws without end while something moves that is seen, else once. */
  #run() {
    if (!this.#stage) return;
    const { renderer, controls, isSeen } = this.#stage;
    controls.autoRotate = this.#turns;
    const moves = isSeen && (this.#mixer || controls.autoRotate);
    this.#last = undefined;
    renderer.setAnimationLoop(moves ? (now) => this.#frame(now) : null);
    this.#draw();
  }

  #frame(now) {
    const passed = this.#last === undefined ? 0 : Math.min((now - this.#last) / 1000, 0.25);
    this.#last = now;
    this.#mixer?.update(passed * Number(this.getAttribute('speed') ?? 1));
    this.#stage.controls.update(passed);
    this.#draw();
  }

  #key = (event) => {
    const turns = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, -STEP], ArrowDown: [0, STEP] }[event.key];
    const zoom = { '+': 1 / 1.1, '=': 1 / 1.1, '-': 1.1 }[event.key];
    if (!(turns ?? zoom) || !this.#stage || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const { camera, controls } = this.#stage;
    const { position } = camera;
    position.sub(controls.target);
    const distance = position.length() * (zoom ?? 1);
    const [turn, tilt] = turns ?? [0, 0];
    const angle = Math.atan2(position.x, position.z) + turn;
    const polar = Math.min(Math.max(Math.acos(position.y / position.length()) + tilt, 0.01), Math.PI - 0.01);
    position.setFromSphericalCoords(distance, polar, angle).add(controls.target);
    controls.update();
    this.#draw();
  };

  // ---- the model ----

  /** Loads what the attributes ask for, once they have all been set. */
  #ask() {
    if (!this.#stage) return;
    const asked = (this.#loading = {});
    queueMicrotask(() => asked === this.#loading && this.#load(asked));
  }

  async #load(asked) {
    this.#loader?.abort();
    const [model, src, level, clip, options] = ['model', 'src', 'level', 'clip', 'options'].map((name) => this.getAttribute(name) ?? undefined);
    if (!(model ?? src)) return this.#clear();
    try {
      const surface = { encoding: 'quantized', level, clip, ...Object.fromEntries(new URLSearchParams(options)) };
      this.#loader = new TweendLoader().setClient(this.client).setSurface(surface);
      const gltf = await (model ? this.#loader.modelAsync(model) : this.#loader.loadAsync(src));
      if (asked !== this.#loading) return dispose(gltf.scene);
      this.#show(gltf);
      this.dispatchEvent(new Event('load'));
    } catch (error) {
      if (asked === this.#loading) this.#fail(error);
    }
  }

  #clear() {
    this.#words.textContent = '';
    this.#mixer = undefined;
    if (this.#gltf) {
      this.#gltf.scene.removeFromParent();
      dispose(this.#gltf.scene);
    }
    this.#gltf = undefined;
    this.#run();
  }

  #fail(error) {
    this.#clear();
    this.#words.textContent = error.message;
    if (!this.#words.isConnected) this.shadowRoot.append(this.#words);
    this.dispatchEvent(new ErrorEvent('error', { error, message: error.message }));
  }

  #show(gltf) {
    const isFirst = !this.#stage.isPlaced;
    this.#clear();
    this.#gltf = gltf;
    gltf.scene.traverse((object) => {
      if (object.isLight) object.visible = false; // in candela, they would outshine the sky
      if (object.isSkinnedMesh) object.frustumCulled = false; // its bounds are those of the rest pose
      if (object.material && !this.#stage.scene.environment) object.material.metalness = Math.min(object.material.metalness ?? 0, DULL);
    });
    this.#stage.scene.add(gltf.scene);
    if (this.hasAttribute('clip') && gltf.animations.length > 0) {
      this.#mixer = new AnimationMixer(gltf.scene);
      for (const animation of gltf.animations) this.#mixer.clipAction(animation).play();
      this.#mixer.update(0);
    }
    this.#place(isFirst);
    this.#run();
  }

  /** Puts the model into the middle; the first one also into the distance from which all of it is seen. */
  #place(isFirst) {
    const { center, radius } = new Box3().setFromObject(this.#gltf.scene, true).getBoundingSphere(new Sphere());
    if (!(radius > 0)) return;
    const { camera, controls } = this.#stage;
    const toCamera = camera.position.clone().sub(controls.target);
    if (isFirst) toCamera.setLength(radius / Math.sin((Math.PI / 360) * camera.fov * Math.min(1, camera.aspect)));
    this.#stage.isPlaced = true;
    controls.target.copy(center);
    camera.position.copy(center).add(toCamera);
    camera.near = radius / 100;
    camera.far = radius * 100;
    camera.updateProjectionMatrix();
    controls.update();
  }
}

export function defineViewer(name = 'tweend-viewer') {
  if (!customElements.get(name)) customElements.define(name, name === 'tweend-viewer' ? TweendViewer : class extends TweendViewer {});
}
