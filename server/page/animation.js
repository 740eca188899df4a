// Plays a clip in the viewport: from poses on the page's clock, or from the daemon's live stream.
import { tweend, withKey } from './client.js';
import { fail } from './notices.js';
import { note, state, watch } from './state.js';

const FPS = 60;
const POSES_SIZE = 32e6; // bytes of poses that are loaded at once; longer clips get fewer poses a second

export class Animation {
  /** onTime(seconds) is called after each pose. */
  constructor(viewport, onTime) {
    this.viewport = viewport;
    this.onTime = onTime;
    this.playing = false;
    this.live = false;
    watch((names) => {
      if (this.player && names.has('speed')) this.player.speed = Number(state('speed'));
      if (this.player && names.has('loop')) this.player.loop = state('loop');
      if (this.player && names.has('t') && !this.live) this.seek(Number(state('t')));
      if (this.live && (names.has('speed') || names.has('loop'))) this.follow();
    });
  }

  /** Whether the stream that is followed comes; it waits and tries again while it does not. */
  get isConnected() {
    return this.player?.connected ?? true;
  }

  get duration() {
    return this.clip?.duration ?? 0;
  }

  /** Setters for a node's transform, which act on its objects in the surface and in the cage. */
  #target(name) {
    const part = (member) => ({ set: (...values) => this.viewport.objectsOf(name).forEach((object) => object[member].set(...values)) });
    return { position: part('position'), quaternion: part('quaternion'), scale: part('scale') };
  }

  /** Loads the poses of a clip of a model. clip: null for none. */
  async open(model, clip) {
    this.close();
    this.clip = clip;
    this.model = model;
    if (!clip) return;
    const { signal } = (this.controller = new AbortController());
    const fps = Math.max(2, Math.min(FPS, POSES_SIZE / 40 / model.nodes.length / Math.max(clip.duration, 0.1)));
    try {
      const player = await withKey(() => tweend.play(model, (name) => this.#target(name), {
        clip: clip.name, fps, signal, playing: false, speed: Number(state('speed')), loop: state('loop'), time: Number(state('t')),
      }));
      if (signal.aborted) return;
      this.player = player;
      this.pose();
    } catch (error) {
      if (!signal.aborted) fail('The clip cannot be played', error);
    }
  }

  close() {
    this.controller?.abort();
    this.pause();
    this.unfollow();
    this.player = this.clip = null;
  }

  /** Applies the present pose to the viewport. */
  pose() {
    if (!this.player) return;
    const time = this.player.update();
    if (time === undefined) return;
    this.time = time;
    this.viewport.morph(this.clip.name, time);
    this.viewport.invalidate();
    this.onTime(time);
  }

  #run() {
    if (this.isRunning) return;
    this.isRunning = true;
    const step = () => {
      this.isRunning = this.playing || this.live;
      if (!this.isRunning) return;
      this.pose();
      const ends = this.playing && state('loop') === 'clamp' && this.time >= this.duration && Number(state('speed')) > 0;
      if (ends) this.pause();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  play() {
    if (!this.player || this.live) return;
    if (state('loop') === 'clamp' && this.player.time >= this.duration * (1 - 1e-6)) this.player.time = 0;
    this.player.update(); // skip the time of the pause
    this.player.playing = this.playing = true;
    this.onTime(this.player.time);
    this.#run();
  }

  pause() {
    if (!this.playing) return;
    this.player.playing = this.playing = false;
    this.onTime(this.player.time);
    note('t', Math.round(this.player.time * 1000) / 1000);
  }

  seek(time) {
    if (!this.player || this.live) return;
    // Stay just before the end, which a repeating player takes for the beginning.
    this.player.time = Math.min(Math.max(time, 0), this.duration * (1 - 1e-6));
    this.pose();
    if (!this.playing) note('t', Math.round(this.player.time * 1000) / 1000);
  }

  /** Shows the daemon's live stream, which all viewers see alike. */
  async follow() {
    this.pause();
    this.own ??= this.player;
    this.live = true;
    this.following?.abort();
    const { signal } = (this.following = new AbortController()); // aborting it closes the stream
    try {
      const stream = await withKey(() => tweend.live(this.model, (name) => this.#target(name),
        { clip: this.clip.name, loop: state('loop'), speed: Number(state('speed')), fps: 30, signal }));
      if (signal.aborted) return;
      this.player = stream;
      this.#run();
    } catch (error) {
      if (signal.aborted) return;
      this.unfollow();
      fail('The live stream cannot be followed', error);
    }
  }

  unfollow() {
    if (!this.live) return;
    this.live = false;
    this.following.abort();
    if (this.own) this.player = this.own;
    this.own = null;
    this.pose();
  }
}
