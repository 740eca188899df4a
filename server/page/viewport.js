// The viewport: camera, lights, the model's surface and its overlays. Draws only when something has changed.
import {
  AmbientLight, BoxGeometry, Box3, Color, DirectionalLight, DoubleSide, Group, HemisphereLight, Mesh, MeshBasicMaterial, BackSide,
  MeshLambertMaterial, PerspectiveCamera, PMREMGenerator, Raycaster, Scene, Vector2, Vector3, Vector4, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

import { BackgroundPicture, takenOver } from './background_picture.js';
import { Floor } from './floor.js';
import { checkered, meshesOf, Normals, Skeleton, Wireframe } from './overlays.js';

const THEMES = {
  light: { background: 0xeef0f3, surface: 0xb9c0ca, sky: 0xffffff, ground: 0xa9a49c },
  dark: { background: 0x15181d, surface: 0x8d96a3, sky: 0xdfe6f2, ground: 0x2c2a28 },
};

/** Lights to choose from: the strength of the sky and its ground's colour, the sun's colour, strength and place, and the
 *  strength of the light from behind. The sky's colour is the theme's where none stands here. */
const LIGHTS = {
  studio: { sky: 1.6, sun: [0xffffff, 2.2, [-1, 2, 1.5]], rim: 0.5 },
  sun: { sky: 0.9, colour: 0xbcd8ff, ground: 0x8a7a5c, sun: [0xfff1d6, 3.6, [1.5, 2, 1]], rim: 0.2 },
  overcast: { sky: 2.8, colour: 0xf2f5fa, ground: 0x9a9a98, sun: [0xffffff, 0.5, [0, 2, 0.3]], rim: 0.2 },
  evening: { sky: 0.7, colour: 0x7f8fc9, ground: 0x40303a, sun: [0xffa35c, 3.4, [-2, 0.6, 1]], rim: 1.2 },
  rim: { sky: 0.25, sun: [0xffffff, 0.5, [-1, 2, 1.5]], rim: 5 },
};
const TURN_SPEED = 1.5; // of OrbitControls: a round in 40 s

const PLACES_MOST = 600; // points of a mesh that framing considers: it is done before the first picture
const MARGIN = 0.78; // part of the picture that a framed model fills
const SLOW_FROM = 100000; // triangles from which on a picture is drawn in the background where there is no graphics card
const REST_MS = 250; // without another picture, after which the picture is drawn fine
const STILL = 5; // pixels that the pointer may move during a click

/** Whether the pointer has hardly moved between two events. */
export const isStill = (from, to) => Math.hypot(to.clientX - from.clientX, to.clientY - from.clientY) <= STILL;

const DULL = 0.5; // the most that a material is a metal where there are no surroundings to reflect: it would be black

function dispose(root) {
  root.traverse((object) => {
    object.geometry?.dispose();
    object.skeleton?.dispose(); // frees its texture of matrices
    for (const material of [object.material].flat().filter(Boolean)) {
      for (const value of Object.values(material)) if (value?.isTexture) value.dispose();
      material.dispose();
    }
  });
}

/** The joint that moves the hit point of a skinned mesh most. */
function jointOf({ object, face }) {
  if (!object.isSkinnedMesh) return null;
  const { skinIndex, skinWeight } = object.geometry.attributes;
  const strongest = [0, 1, 2, 3].reduce((best, k) => (skinWeight.getComponent(face.a, k) > skinWeight.getComponent(face.a, best) ? k : best), 0);
  return object.skeleton.bones[skinIndex.getComponent(face.a, strongest)] ?? null;
}

export class Viewport {
  constructor(canvas) {
    this.canvas = canvas;
    const { width, height, ratio } = this.#size();
    Object.assign(canvas, { width: Math.floor(width * ratio), height: Math.floor(height * ratio) }); // changing the size later would clear the canvas
    this.renderer = this.#makeRenderer();
    this.isSoftware = this.#findSoftware();
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(35, 1, 0.01, 100);
    this.camera.position.set(1, 0.6, 1.4);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.#drawSoon(true));
    this.controls.addEventListener('end', () => this.onView());
    this.hemisphere = new HemisphereLight(0xffffff, 0x888888, 1.6);
    this.sun = new DirectionalLight(0xffffff, 2.2);
    this.sun.position.set(-1, 2, 1.5);
    this.rim = new DirectionalLight(0xffffff, 0.5);
    this.rim.position.set(2, 1, -2);
    this.ambient = new AmbientLight(0xffffff, 0.15);
    this.light = 'studio';
    this.exposure = 1;
    this.floor = new Floor();
    this.scene.add(this.hemisphere, this.ambient, this.sun, this.rim, this.floor.object);
    this.model = null;
    this.cage = null;
    this.beside = null;
    this.split = 0.5; // where the other model ends and this one begins, as a part of the picture's width
    this.own = new Group();
    this.other = new Group();
    this.ghosts = new Group();
    this.own.add(this.ghosts);
    this.scene.add(this.own, this.other);
    this.shown = new Set();
    this.offset = new Vector3(); // how far the camera has followed the model
    this.onFrame = [];
    this.afterFrame = []; // called once, with the canvas as it was just drawn, fine
    this.onDrawn = []; // called once, when a frame was drawn, be it coarse
    this.onView = () => {}; // called when the user has moved the camera
    this.onCarrier = () => {}; // called when the camera has another node to follow
    canvas.addEventListener('keydown', (event) => this.key(event));
    canvas.addEventListener('webglcontextrestored', () => {
      if (!this.scene.environment) return this.invalidate();
      this.scene.environment = null; // it was drawn by the context that was lost
      this.surroundings();
    });
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  /** The renderer; null where the browser has no WebGL 2: all but the picture goes on. */
  #makeRenderer() {
    try {
      const renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true });
      renderer.debug.checkShaderErrors = false; // checking would wait for the shader compiler
      renderer.setScissorTest(true);
      return renderer;
    } catch {
      return null;
    }
  }

  /** Whether pictures are computed without a graphics card. */
  #findSoftware() {
    const context = this.renderer?.getContext();
    const names = context?.getExtension('WEBGL_debug_renderer_info');
    return Boolean(names) && /swiftshader|llvmpipe|software/i.test(context.getParameter(names.UNMASKED_RENDERER_WEBGL));
  }

  #size() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    return { width, height, ratio: Math.min(devicePixelRatio, 2) };
  }

  resize() {
    const { width, height, ratio } = this.#size();
    if (!width || !height) return;
    const { renderer } = this;
    const isSame = renderer?.getPixelRatio() === ratio && renderer.getSize(new Vector2()).equals(new Vector2(width, height));
    if (!isSame) renderer?.setDrawingBufferSize(width, height, ratio); // the same size, too, would clear the canvas
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  /** Says that something else is to be seen. */
  invalidate() {
    this.isShadowOld = true;
    if (!this.held) this.#drawSoon();
  }

  #showAll() {
    this.isFirst = false;
    this.show(this.shown);
  }

  /** Until a promise is settled, draws only what a person moves; then all that has changed, at once. Whoever made the promise
   *  tells of its error. */
  async hold(until) {
    this.held = until;
    await until.catch(() => {});
    if (this.held !== until) return;
    this.held = null;
    this.#drawSoon();
  }

  /** Resolves when a frame was drawn, be it coarse. */
  drawn() {
    return new Promise((resolve) => {
      this.onDrawn.push(resolve);
      this.#drawSoon();
    });
  }

  /** isMoved: a person moves the camera, or it turns. */
  #drawSoon(isMoved = false) {
    this.isMoved ||= isMoved;
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      if (this.inBackground) this.isLate = true;
      else this.#draw();
    });
  }

  #draw() {
    clearTimeout(this.refinement);
    if (!this.model && !this.cage && !this.canvas.dataset.frames) return; // an empty stage has the background's colour
    for (const update of this.onFrame) update();
    this.scene.updateMatrixWorld();
    this.#follow();
    this.skeleton?.update();
    if (this.model && this.isShadowOld && this.floor.draw(this.#solids)) this.isShadowOld = false; // the camera moves no shadow
    if (this.isSlow) {
      const isStill = !this.isMoved && !this.isFirst && performance.now() - this.ended > REST_MS; // of a model that is not there yet, a coarse picture is sooner
      this.#drawInBackground(isStill || this.afterFrame.length > 0);
      return;
    }
    delete this.canvas.dataset.unfinished; // a coarse picture may have come before
    if (this.renderer) this.#render();
    this.#endFrame(this.#waiting());
  }

  /** Takes those that wait for a frame off their lists. */
  #waiting() {
    return [...this.afterFrame.splice(0), ...this.onDrawn.splice(0)];
  }

  /** uses: what waited when the drawing began. */
  #endFrame(uses) {
    this.isSlow = this.#isSlowAt(this.triangles);
    this.isMoved = false;
    this.ended = performance.now();
    for (const use of uses) use(this.canvas);
    this.canvas.dataset.frames = Number(this.canvas.dataset.frames ?? 0) + 1;
    if (this.model && this.isFirst) setTimeout(() => this.#showAll()); // after those who wait for this frame
  }

  /** Draws a picture; a coarse one is followed by a fine one when nothing has changed for a while. */
  async #drawInBackground(isFine) {
    this.inBackground = true;
    this.canvas.dataset.unfinished = '';
    this.background ??= new BackgroundPicture(this.renderer);
    const uses = this.#waiting();
    await this.background.show((target) => this.#render(target), isFine);
    this.#endFrame(uses);
    await takenOver();
    this.inBackground = false;
    if (this.isLate || this.afterFrame.length > 0) this.#drawSoon();
    else if (!isFine) this.refinement = setTimeout(() => this.#drawInBackground(true), REST_MS);
    else delete this.canvas.dataset.unfinished;
    this.isLate = false;
  }

  /** Resolves with what the next frame shows, as a data URL; in a given size, with background beside it. */
  picture({ width, height, type = 'image/png' } = {}) {
    return new Promise((resolve) => {
      this.afterFrame.push((canvas) => {
        const drawn = Object.assign(document.createElement('canvas'), { width: width ?? canvas.width, height: height ?? canvas.height });
        const scale = Math.min(drawn.width / canvas.width, drawn.height / canvas.height);
        const [w, h] = [canvas.width * scale, canvas.height * scale];
        const context = drawn.getContext('2d', { willReadFrequently: true });
        context.fillStyle = this.scene.background.getStyle();
        context.fillRect(0, 0, drawn.width, drawn.height);
        context.drawImage(canvas, (drawn.width - w) / 2, (drawn.height - h) / 2, w, h);
        resolve(drawn.toDataURL(type, 0.8));
      });
      this.invalidate();
    });
  }

  /** Pixels from the left at which this model begins. */
  get #line() {
    return this.beside ? Math.round(this.#size().width * this.split) : 0;
  }

  /** Whether the other model is shown at a place of the window. */
  isBeside(clientX) {
    return clientX - this.canvas.getBoundingClientRect().left < this.#line;
  }

  /** A raycaster through a place of the window. */
  rayAt({ clientX, clientY }) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2(((clientX - left) / width) * 2 - 1, 1 - ((clientY - top) / height) * 2), this.camera);
    return caster;
  }

  /** Where the picture has a place of the world: {x, y: pixels, z: above 1 beyond what is drawn}. Changes the place. */
  seen(place) {
    const { width, height } = this.canvas.getBoundingClientRect();
    const { x, y, z } = place.project(this.camera);
    return { x: ((x + 1) / 2) * width, y: ((1 - y) / 2) * height, z };
  }

  /** use(event) is called for clicks and taps on this model's side of the picture. */
  onClick(use) {
    let from = null;
    this.canvas.addEventListener('pointerdown', (event) => (from = event));
    this.canvas.addEventListener('pointerup', (event) => {
      const isClick = event.button === 0 && from && isStill(from, event) && !this.isBeside(from.clientX);
      from = null;
      if (isClick) use(event);
    });
  }

  /** target: where to draw; the canvas, without one. */
  #render(target) {
    const { width, height } = this.#size();
    const scale = target ? target.width / width : 1;
    this.triangles = 0;
    for (const [group, start, end] of [[this.other, 0, this.#line], [this.own, this.#line, width]]) {
      if (start >= end) continue;
      this.own.visible = group === this.own;
      this.other.visible = group === this.other;
      if (target) Object.assign(target, { scissorTest: true, scissor: new Vector4(start * scale, 0, (end - start) * scale, target.height) });
      if (target) this.renderer.setRenderTarget(target);
      else this.renderer.setScissor(start, 0, end - start, height);
      this.renderer.render(this.scene, this.camera);
      this.triangles += this.renderer.info.render.triangles;
    }
  }

  /** How far the pose has moved the model from its place in the file: the node that carries it, else the first. */
  #moved() {
    const node = this.model && (this.model.nodes.get(this.carrier) ?? this.model.scene.children[0]);
    return node ? new Vector3().setFromMatrixPosition(node.matrixWorld).sub(this.model.rests.get(node)) : new Vector3();
  }

  /** Says which node a clip moves the whole model by. It may be below others that never move, as hips in an armature. */
  setCarrier(name) {
    if (name === this.carrier) return;
    this.carrier = name;
    this.onCarrier(); // a view is relative to it
  }

  /** Moves the floor and the camera along with the model, which a clip may move out of the picture. */
  #follow() {
    const offset = this.#moved();
    this.floor.follow(offset);
    if (!this.shown.has('follow')) return;
    const step = offset.clone().sub(this.offset);
    this.offset = offset;
    this.camera.position.add(step);
    this.controls.target.add(step);
    this.camera.updateMatrixWorld();
  }

  setTheme(name) {
    const theme = THEMES[name];
    this.theme = theme;
    this.themeName = name;
    this.scene.background = new Color(theme.background);
    this.floor.setTheme(name);
    this.setLight(this.light, this.exposure);
    for (const { plain, wireframe } of this.#models) {
      plain.color.set(theme.surface);
      wireframe.setTheme(name);
    }
    for (const cage of this.#cages) cage.setTheme(name);
    this.invalidate();
  }

  /** name: of LIGHTS; exposure: a factor of all light. */
  setLight(name, exposure) {
    Object.assign(this, { light: name, exposure });
    const { sky, colour, ground, sun: [sun, strength, place], rim } = LIGHTS[name];
    this.hemisphere.color.set(colour ?? this.theme?.sky ?? 0xffffff);
    this.hemisphere.groundColor.set(ground ?? this.theme?.ground ?? 0x888888);
    this.sun.color.set(sun);
    this.sun.position.set(...place);
    for (const [light, intensity] of [[this.hemisphere, sky], [this.sun, strength], [this.rim, rim], [this.ambient, 0.15]]) light.intensity = intensity * exposure;
    this.scene.environmentIntensity = 0.6 * exposure * (sky / LIGHTS.studio.sky);
    this.invalidate();
  }

  /** Turns the camera round the model, until it is called with false. */
  turn(isTurning) {
    if (this.controls.autoRotate === isTurning) return;
    Object.assign(this.controls, { autoRotate: isTurning, autoRotateSpeed: TURN_SPEED });
    let last = performance.now();
    const step = (now) => {
      if (!this.controls.autoRotate) return;
      this.controls.update((now - last) / 1000);
      last = now;
      this.#drawSoon(true);
      requestAnimationFrame(step);
    };
    if (isTurning) requestAnimationFrame(step);
  }

  /** What throws a shadow. */
  get #solids() {
    return meshesOf(this.model.scene).filter(({ userData }) => userData.own);
  }

  get #models() {
    return [this.model, this.beside].filter(Boolean);
  }

  get #cages() {
    return [this.cage, this.beside?.cage].filter(Boolean);
  }

  /** Sets the materials of a parsed GLB's objects, and adds lines over them. */
  #dress({ scene, nodes, morphs }, { level, scheme }) {
    const plain = new MeshLambertMaterial({ color: this.theme.surface, side: DoubleSide });
    let metal = false;
    scene.traverse((object) => {
      if (!object.isMesh) return;
      if (object.userData.isPlain) {
        const { vertexColors, flatShading } = object.material;
        object.material = vertexColors || flatShading ? Object.assign(plain.clone(), { vertexColors, flatShading }) : plain;
        if (vertexColors) object.material.color.set(0xffffff);
      } else if (object.material.metalness > 0) metal = true;
      Object.assign(object.material, { polygonOffsetFactor: 1, polygonOffsetUnits: 1 }); // so that lines are drawn in front
      object.userData.own = object.material;
    });
    if (metal && this.isSoftware) scene.traverse(({ material }) => material?.metalness > DULL && (material.metalness = DULL));
    else if (metal) this.surroundings();
    const rests = new Map([...scene.children, ...nodes.values()].map((object) => [object, new Vector3().setFromMatrixPosition(object.matrixWorld)])); // in the world
    const wireframe = new Wireframe(scene, { quads: level > 0 && scheme !== 'loop' });
    wireframe.setTheme(this.themeName);
    return { scene, nodes, morphs, plain, wireframe, rests };
  }

  #undress({ scene, wireframe }) {
    scene.traverse((object) => (object.material = object.userData.own ?? object.material));
    wireframe.dispose();
    scene.removeFromParent();
    dispose(scene);
  }

  /** Shows a parsed GLB. Does not move the camera. The first picture of it is without the floor: the shadow and its program
   *  take as long as the surface, without a graphics card. */
  setModel(parsed, options) {
    this.isFirst = !this.model;
    this.clearModel();
    const { scene, nodes } = parsed;
    this.model = this.#dress(parsed, options);
    this.normals = new Normals(scene);
    this.skeleton = new Skeleton(nodes);
    this.isBare = parsed.bearers.length === 0; // only a clip: nothing but its joints can be shown
    this.own.add(scene, this.skeleton.object);
    const triangles = this.#solids.reduce((sum, { geometry }) => sum + (geometry.index ?? geometry.attributes.position).count / 3, 0);
    this.isSlow ||= this.#isSlowAt(triangles); // the first picture of a large one would hold the page for seconds
    this.show(this.shown);
  }

  #isSlowAt(triangles) {
    return this.isSoftware && triangles > SLOW_FROM;
  }

  clearModel() {
    this.floor.object.visible = false;
    if (!this.model) return;
    this.normals.dispose();
    this.skeleton.object.removeFromParent();
    dispose(this.skeleton.object);
    this.#undress(this.model);
    this.model = this.skeleton = this.normals = null;
    this.invalidate();
  }

  setCage(cage) {
    this.cage?.dispose();
    this.cage = cage;
    this.#hang(cage, this.own);
    this.show(this.shown);
  }

  #hang(cage, group) {
    if (!cage) return;
    group.add(cage.object);
    cage.setTheme(this.themeName);
  }

  /** Shows another parsed GLB and its cage left of the line; null: none. */
  setBeside(parsed, options, cage) {
    if (this.beside) {
      this.beside.cage?.dispose();
      this.#undress(this.beside);
    }
    this.beside = parsed && { ...this.#dress(parsed, options), cage };
    if (parsed) {
      this.other.add(parsed.scene);
      this.#hang(cage, this.other);
    }
    this.show(this.shown);
  }

  setSplit(part) {
    this.split = part;
    this.invalidate();
  }

  /** An environment of light from all sides, for metals. Made once, when the first metal is shown; on a graphics card
   *  alone, since software takes up to half a minute. */
  surroundings() {
    if (this.scene.environment || !this.renderer) return;
    const room = new Scene();
    const box = new BoxGeometry(10, 10, 10);
    const side = (color) => new MeshBasicMaterial({ color, side: BackSide });
    room.add(new Mesh(box, [side(0x909aa8), side(0x909aa8), side(0xffffff), side(0x55524e), side(0xb4bcc8), side(0x7e8794)]));
    const generator = new PMREMGenerator(this.renderer);
    this.scene.environment = generator.fromScene(room, 0.04).texture;
    generator.dispose();
  }

  /** names: a set out of surface, cage, points, wireframe, normals, skeleton, uv. */
  show(names) {
    if (names.has('follow') !== this.shown.has('follow')) this.offset = names.has('follow') ? this.#moved() : new Vector3(); // without a jump
    this.shown = names;
    for (const { scene, wireframe } of this.#models) {
      scene.traverse((object) => {
        if (!object.isMesh || !object.userData.own) return;
        object.material = names.has('uv') && object.geometry.attributes.uv ? checkered() : object.userData.own;
        object.material.visible = names.has('surface');
        object.material.polygonOffset = names.has('cage') || names.has('wireframe'); // steep triangles sink behind what is behind them: dots along folds
      });
      wireframe.show(names.has('wireframe'));
    }
    this.floor.object.visible = names.has('floor') && names.has('surface') && Boolean(this.model) && !this.isBare && !this.isFirst;
    this.floor.drawn = 0;
    this.normals?.show(names.has('normals'));
    if (this.skeleton) this.skeleton.object.visible = names.has('skeleton') || this.isBare;
    for (const cage of this.#cages) cage.show(names.has('cage'), names.has('points'));
    this.invalidate();
  }

  /** World positions of the model: some thousands of its points, and its joints where they are seen. */
  #places() {
    const places = [];
    const roots = [...this.#models.map(({ scene }) => scene), ...this.#cages.map(({ object }) => object)];
    for (const root of roots) {
      root.updateMatrixWorld(true);
      root.traverse((object) => {
        if (!object.isMesh || object.isLineSegments2) return;
        const { position } = object.geometry.attributes;
        for (let i = 0; i < position.count; i += Math.ceil(position.count / PLACES_MOST)) {
          const at = new Vector3().fromBufferAttribute(position, i);
          if (object.isSkinnedMesh) object.applyBoneTransform(i, at);
          places.push(at.applyMatrix4(object.matrixWorld));
        }
      });
    }
    if (this.skeleton?.bones.length > 0 && (this.isBare || this.shown.has('skeleton')))
      for (const { matrixWorld } of this.skeleton.joints) places.push(new Vector3().setFromMatrixPosition(matrixWorld));
    return places.length > 0 ? places : [new Vector3(-1, -1, -1), new Vector3(1, 1, 1)];
  }

  /** Frames the whole model, keeping the direction of the camera. */
  frame() {
    const places = this.#places();
    const box = new Box3().setFromPoints(places);
    this.floor.place(box, this.#moved());
    const centre = box.getCenter(new Vector3());
    const radius = Math.max(box.getSize(new Vector3()).length() / 2, 1e-6);
    const direction = this.camera.position.clone().sub(this.controls.target).normalize();
    this.camera.position.copy(centre).add(direction);
    this.camera.lookAt(centre);
    const back = this.camera.quaternion.clone().invert();
    const high = Math.tan((this.camera.fov * Math.PI) / 360) * MARGIN;
    const wide = high * this.camera.aspect;
    let distance = radius / 10;
    for (const place of places) {
      const { x, y, z } = place.sub(centre).applyQuaternion(back);
      distance = Math.max(distance, z + Math.abs(y) / high, z + Math.abs(x) / wide);
    }
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(direction, distance);
    if (this.shown.has('follow')) this.offset = this.#moved();
    this.camera.near = distance / 500;
    this.camera.far = distance * 50;
    this.controls.minDistance = radius / 50;
    this.controls.maxDistance = distance * 20;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.invalidate();
  }

  /** Arrows orbit, with Shift they pan; + and - zoom; F frames. */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { controls } = this;
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (way && event.shiftKey) controls.pan(...way.map((part) => (-part * this.canvas.clientHeight) / 12));
    else if (way) {
      controls.rotateLeft(-0.12 * way[0]);
      controls.rotateUp(-0.12 * way[1]);
    } else if (event.key === '+' || event.key === '=') controls.dollyIn(1 / 1.12);
    else if (event.key === '-') controls.dollyOut(1 / 1.12);
    else return;
    event.preventDefault();
    this.onView();
  }

  /** The camera's position and target, as six numbers; where it follows the model, as if that were at rest. */
  get view() {
    const places = [this.camera.position, this.controls.target].flatMap((place) => [...place.clone().sub(this.offset)]);
    return places.map((number) => Number(number.toPrecision(4))).join();
  }

  set view(text) {
    const numbers = text.split(',').map(Number);
    this.camera.position.set(...numbers.slice(0, 3)).add(this.offset);
    this.controls.target.set(...numbers.slice(3)).add(this.offset);
    this.controls.update();
    this.invalidate();
  }

  /** Sets the weights of morph targets, by the names of nodes; those of other nodes to what they are at rest. */
  morph(weights) {
    for (const { morphs } of [...this.#models, ...this.#cages])
      for (const { names, object, rest } of morphs) {
        const values = weights[names.find((name) => Object.hasOwn(weights, name))] ?? rest;
        const lines = object.children.filter((child) => !child.isMesh && child.morphTargetInfluences); // of a cage
        for (const { morphTargetInfluences: influences } of [object, ...lines]) influences.forEach((_, i) => (influences[i] = values[i] ?? 0));
      }
  }

  /** The names of the nodes at a place of the window, from the innermost outwards; of a skin, those of the strongest joint. */
  nodesAt(event) {
    const hit = this.model && this.rayAt(event).intersectObject(this.model.scene).find(({ object }) => object.isMesh && object.userData.own);
    if (!hit) return [];
    const names = new Map([...this.model.nodes].map(([name, object]) => [object, name]));
    const found = [];
    for (let object = jointOf(hit) ?? hit.object; object; object = object.parent) if (names.has(object)) found.push(names.get(object));
    return found;
  }

  /** The objects that have a node's transform, in surfaces and cages. */
  objectsOf(name) {
    return [...this.#models, ...this.#cages].map(({ nodes }) => nodes.get(name)).filter(Boolean);
  }
}
