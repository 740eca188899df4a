// Plays a clip in the viewport: from poses on the page's clock, blended with those of another where one is chosen, or from
// the daemon's live stream.
import { tweend, withKey } from './client.js';
import { blendWeights, mixed, optionsOf, partOf } from './clips.js';
import { fail } from './notices.js';
import { note, state, watch } from './state.js';

const FPS = 60;
const PATIENCE = 1000; // ms until a stream that was asked for is said not to come
const POSES_SIZE = 32e6; // bytes of poses that are loaded at once; longer clips get fewer poses a second

/** A node's transform where a player puts it, to be blended. */
const slot = () => ({ position: [0, 0, 0], quaternion: [0, 0, 0, 1], scale: [1, 1, 1] });

/** The normalised sum of two quaternions on one hemisphere, as the daemon blends layers. */
function mixedTurn(a, b, part) {
  const sign = a.reduce((dot, value, i) => dot + value * b[i], 0) < 0 ? -1 : 1;
  const sum = a.map((value, i) => value * (1 - part) + sign * b[i] * part);
  const length = Math.hypot(...sum) || 1;
  return sum.map((value) => value / length);
}

/** A path of glTF, the member that an object has of it, and how two are blended. */
const PATHS = [['translation', 'position', mixed], ['rotation', 'quaternion', mixedTurn], ['scale', 'scale', mixed]];

/** The names of the nodes that a clip moves, by path. */
async function movedBy(model, which, signal) {
  const { tracks, other_tracks: others } = await withKey(() => tweend.tracks(model, optionsOf(which), { signal }));
  return Object.fromEntries(PATHS.map(([path]) => [path, new Set([...tracks, ...others].filter((track) => track.path === path).map(({ node }) => node))]));
}

export class Animation {
  /** onTime(seconds) is called after each pose. */
  constructor(viewport, onTime) {
    this.viewport = viewport;
    this.onTime = onTime;
    this.playing = false;
    this.isWanted = false; // whether it is to play when the poses are there
    this.live = false;
    watch((names) => {
      if (this.player && (names.has('speed') || names.has('weight'))) this.#setSpeed();
      if (this.player && names.has('loop')) this.player.loop = state('loop');
      if (this.player && names.has('t') && !this.live) this.seek(Number(state('t')));
      if (this.live && (names.has('speed') || names.has('loop'))) this.follow();
      if (names.has('weight') && this.other) this.pose();
    });
  }

  /** Whether the stream that is followed comes; it waits and tries again while it does not. */
  get isConnected() {
    return this.player?.connected ?? !this.isLate;
  }

  /** The part of the second clip. */
  get weight() {
    return this.other ? Number(state('weight')) : 0;
  }

  /** Seconds that the first clip takes alone. */
  get #first() {
    return this.player?.duration || this.clip?.duration || 0;
  }

  /** Seconds. Blended clips play in one phase, which rises by the weighted mean of theirs. */
  get duration() {
    const first = this.#first;
    const second = this.other?.duration || first;
    return first > 0 ? 1 / ((1 - this.weight) / first + this.weight / second) : 0;
  }

  /** The seconds of the first clip for a second of the whole. */
  get #pace() {
    return this.duration > 0 ? this.#first / this.duration : 1;
  }

  /** The shown time as one of the first clip, seconds. */
  get clipTime() {
    return (this.time ?? 0) * (this.live ? 1 : this.#pace);
  }

  /** Goes to a time of the first clip. */
  seekInClip(time) {
    this.seek(time / this.#pace);
  }

  /** Seconds; while poses are loaded, where the clip will be then. */
  get time() {
    return this.shown ?? (this.clip ? Number(state('t')) : undefined);
  }

  #setSpeed() {
    this.player.speed = Number(state('speed')) * (this.live ? 1 : this.#pace);
  }

  /** Setters for a node's transform, which act on its objects in the surface and in the cage. */
  #target(name) {
    const part = (member) => ({ set: (...values) => this.viewport.objectsOf(name).forEach((object) => object[member].set(...values)) });
    return { position: part('position'), quaternion: part('quaternion'), scale: part('scale') };
  }

  /** Loads the poses of a clip of a model, and of one to blend it with. clip: null for none. */
  async open(model, clip, other = null) {
    this.close();
    this.clip = clip;
    this.model = model;
    if (!clip) return;
    const { signal } = (this.controller = new AbortController());
    const load = (which, objects) => {
      const fps = Math.max(2, Math.min(FPS, POSES_SIZE / 40 / model.nodes.length / Math.max(which.duration ?? 10, 0.1)));
      return withKey(() => tweend.play(model, objects, { ...optionsOf(which), fps, signal, playing: false, speed: Number(state('speed')), loop: state('loop') }));
    };
    try {
      const slots = new Map(other ? model.nodes.map(({ name }) => [name, [slot(), slot()]]) : []);
      const objects = (k) => (name) => (other ? slots.get(name)?.[k] : this.#target(name));
      const clips = [clip, other].filter(Boolean);
      const [loaded, moved] = await Promise.all([Promise.all(clips.map((which, k) => load(which, objects(k)))),
        other && Promise.all(clips.map((which) => movedBy(model, which, signal)))]);
      if (signal.aborted) return;
      const stream = this.player; // that a person follows by now
      [this.player, this.other = null] = loaded;
      this.slots = [...slots].map(([name, pair]) => [this.#target(name), pair, PATHS.map(([path]) => moved.map((nodes) => nodes[path].has(name)))]);
      this.#setSpeed();
      this.player.time = Number(state('t')) * this.#pace;
      if (this.live) [this.own, this.player] = [this.player, stream];
      else if (this.isWanted) this.play();
      else this.pose();
    } catch (error) {
      if (!signal.aborted) fail('The clip cannot be played', error);
    }
  }

  /** isKept: whether the address keeps the time, as it does but for another model. */
  close(isKept = true) {
    this.controller?.abort();
    this.pause(isKept);
    this.unfollow();
    this.player = this.other = this.clip = this.model = null;
    this.shown = undefined;
  }

  /** Puts the blended pose into the viewport. */
  #blend() {
    const { other, weight } = this;
    other.time = this.player.duration > 0 ? (this.player.time / this.player.duration) * other.duration : 0;
    other.update();
    for (const [target, [a, b], moved] of this.slots)
      PATHS.forEach(([, member, blend], k) => target[member].set(...blend(a[member], b[member], partOf(...moved[k], weight))));
  }

  /** Puts the morph weights into the viewport. */
  #morph() {
    const { weights = {} } = this.player;
    this.viewport.morph(this.other && !this.live ? blendWeights(weights, this.other.weights ?? {}, this.weight) : weights);
  }

  /** Applies the present pose to the viewport. */
  pose() {
    if (!this.player) return;
    const time = this.player.update();
    if (time === undefined) return;
    if (this.other && !this.live) this.#blend();
    this.shown = this.live ? time : time / this.#pace;
    this.#morph();
    this.viewport.invalidate();
    this.onTime(this.shown);
  }

  #run() {
    if (this.isRunning) return;
    this.isRunning = true;
    const step = () => {
      this.isRunning = this.playing || this.live;
      if (!this.isRunning) return;
      this.pose();
      const ends = this.playing && state('loop') === 'clamp' && this.shown >= this.duration && Number(state('speed')) > 0;
      if (ends) this.pause();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  /** Plays the clip; at once, or when the poses are there. */
  play() {
    this.isWanted = true;
    if (!this.player || this.live) return;
    if (state('loop') === 'clamp' && this.player.time >= this.player.duration * (1 - 1e-6)) this.player.time = 0;
    this.player.update(); // skip the time of the pause
    this.player.playing = this.playing = true;
    this.pose();
    this.#run();
  }

  pause(isKept = true) {
    this.isWanted = false;
    if (!this.playing) return;
    this.player.playing = this.playing = false;
    this.onTime(this.shown);
    if (isKept) note('t', Math.round(this.shown * 1000) / 1000);
  }

  /** Goes to a time; at once, or when the poses are there. */
  seek(time) {
    if (!this.clip || this.live || !(this.duration > 0)) return;
    // Stay just before the end, which a repeating player takes for the beginning.
    const within = Math.min(Math.max(time, 0), this.duration * (1 - 1e-6));
    if (this.player) {
      this.player.time = within * this.#pace;
      this.pose();
    }
    if (!this.playing) note('t', Math.round((this.player ? this.shown : within) * 1000) / 1000);
    if (!this.player) this.onTime(this.time);
  }

  /** Shows the daemon's live stream, which all viewers see alike. */
  async follow() {
    this.pause();
    if (!this.live) this.own = this.player; // null while poses are loaded
    this.live = true;
    this.following?.abort();
    const { signal } = (this.following = new AbortController()); // aborting it closes the stream
    this.isLate = false;
    const timer = setTimeout(() => {
      this.isLate = true;
      this.onTime(this.time ?? 0);
    }, PATIENCE);
    try {
      const stream = await withKey(() => tweend.live(this.model, (name) => this.#target(name),
        { ...optionsOf(this.clip), loop: state('loop'), speed: Number(state('speed')), fps: 30, signal }));
      if (signal.aborted) return;
      this.player = stream;
      this.#run();
    } catch (error) {
      if (signal.aborted) return;
      this.unfollow();
      fail('The live stream cannot be followed', error);
    } finally {
      clearTimeout(timer);
    }
  }

  unfollow() {
    if (!this.live) return;
    this.live = false;
    this.following.abort();
    this.player = this.own;
    this.own = null;
    if (!this.player) return;
    this.#setSpeed(); // which may have changed meanwhile
    this.pose();
  }
}
