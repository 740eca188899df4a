// The player's bar under the viewport: play, scrub, keys, clip, speed, loop, live.
import { tweend, withKey } from './client.js';
import { optionsOf, titleOf } from './clips.js';
import { byId, draw, icon, make, seconds, select } from './dom.js';
import { fail } from './notices.js';
import { change, state, watch } from './state.js';

const KEYS_MOST = 2000;
const SEAM = 2; // degrees between the last pose and the first from which on a seam is seen
const ICONS = { play: 'M4 2.5v11l9.5-5.5z', pause: 'M4 2.5h3v11H4zM9 2.5h3v11H9z' };
const iconOf = (name) => icon(ICONS[name], { isFilled: true });

export class Timeline {
  constructor(animation) {
    this.animation = animation;
    this.onReport = () => {}; // called with what the daemon reports of the opened clip, undefined where it does not
    this.play = make('button', { className: 'play', 'aria-label': 'Play', onclick: () => this.toggle() }, iconOf('play'));
    this.range = make('input', { type: 'range', min: 0, step: 'any', 'aria-label': 'Time' });
    this.range.addEventListener('input', () => animation.seek(Number(this.range.value)));
    this.range.addEventListener('keydown', (event) => {
      const steps = { ArrowLeft: -1, ArrowRight: 1, PageUp: 10, PageDown: -10 };
      if (!(event.key in steps)) return;
      event.preventDefault();
      animation.seek((animation.time ?? 0) + steps[event.key] / 30);
    });
    this.ticks = draw('svg', { class: 'ticks', preserveAspectRatio: 'none', viewBox: '0 0 1000 20', 'aria-hidden': 'true' });
    this.clock = make('output', { className: 'clock' });
    this.clips = make('select', { 'aria-label': 'Clip', onchange: () => change({ clip: this.clips.value, blend: '', t: 0 }) });
    const list = (label, options, name) => select(options, state(name), (value) => change({ [name]: value }), { 'aria-label': label });
    this.speed = list('Speed', [['0.25', '¼ ×'], ['0.5', '½ ×'], ['1', '1 ×'], ['2', '2 ×'], ['4', '4 ×']], 'speed');
    this.loop = list('At the end', [['repeat', 'Repeat'], ['pingpong', 'Ping-pong'], ['clamp', 'Stop']], 'loop');
    this.live = make('button', { className: 'chip', 'aria-pressed': 'false', onclick: () => this.follow() }, 'Live');
    this.live.title = 'Follow the stream of the daemon';
    byId('timeline').append(this.play, make('div', { className: 'track' }, this.ticks, this.range), this.clock,
      make('div', { className: 'settings' }, this.clips, this.speed, this.loop, this.live));
    this.showSpeed();
    watch((names) => {
      if (names.has('node')) this.mark();
      if (names.has('speed')) this.showSpeed();
      if (names.has('loop')) this.loop.value = state('loop');
    });
  }

  /** Also one that only the address has. */
  showSpeed() {
    const speed = state('speed');
    if (![...this.speed.options].some(({ value }) => value === speed)) this.speed.append(new Option(`${Number(speed)} ×`, speed));
    this.speed.value = speed;
  }

  toggle() {
    if (this.animation.playing) this.animation.pause();
    else this.animation.play();
  }

  async follow() {
    const following = this.animation.live ? this.animation.unfollow() : this.animation.follow();
    this.show();
    await following;
    this.show();
  }

  /** Takes away what the bar tells of a clip. Its place stays, so that the picture keeps its size until the next one. */
  empty() {
    byId('timeline').setAttribute('aria-busy', true);
  }

  /** Keeps a place for the bar where a clip will be opened. */
  expect(isWanted) {
    byId('timeline').hidden = !isWanted;
  }

  /** Shows the clips that a model can play; the bar is hidden where there are none. */
  open(model, clip, clips) {
    this.expect(Boolean(clip));
    byId('timeline').setAttribute('aria-busy', false);
    this.tracks = this.report = null;
    this.mark();
    if (!clip) return;
    this.clips.replaceChildren(...clips.map((entry) => make('option', { value: entry.value, selected: entry.value === clip.value }, titleOf(entry))));
    this.show();
    this.fetchTracks(model, clip);
  }

  async fetchTracks(model, clip) {
    this.tracksOf = withKey(() => tweend.tracks(model, optionsOf(clip))).catch((error) => {
      fail('The keys of the clip cannot be read', error);
      return { tracks: [], other_tracks: [] };
    });
    const { tracks, other_tracks: others, report } = await this.tracksOf;
    if (this.animation.clip !== clip) return;
    this.tracks = [...tracks, ...others];
    this.report = report;
    this.onReport(report);
    this.mark();
  }

  /** Draws the keys, with those of the selected node highlighted; below them when feet touch the ground, a row for each
   *  foot; and at both ends a mark where the clip does not loop. */
  mark() {
    const duration = this.animation.clip?.duration ?? this.animation.duration;
    const x = (time) => (duration > 0 ? (time / duration) * 1000 : 0);
    const line = (time, own) => draw('line', { x1: x(time), x2: x(time), y1: own ? 0 : 5, y2: own ? 20 : 15, class: own ? 'own' : '' });
    const times = (tracks) => [...new Set(tracks.flatMap((track) => track.times))].slice(0, KEYS_MOST);
    const tracks = this.tracks ?? [];
    const { contacts = [], loop } = this.report ?? {};
    const feet = [...new Set(contacts.map(({ node }) => node))];
    const touch = ({ node, from, to }) => draw('rect', { x: x(from), y: 19 + 3 * feet.indexOf(node), width: Math.max(x(to) - x(from), 2), height: 2, class: `contact c${feet.indexOf(node) % 4}` });
    const seam = loop && loop.angle > SEAM ? [0, 997].map((at) => draw('rect', { x: at, y: 0, width: 3, height: 20, class: 'seam' })) : [];
    this.range.title = [seam.length > 0 ? `At the ends the pose leaps by ${Math.round(loop.angle)}°` : '', feet.length > 0 ? `Bars: ${feet.join(', ')} on the ground` : ''].filter(Boolean).join('. ');
    this.ticks.replaceChildren(...seam, ...contacts.map(touch), ...times(tracks).map((time) => line(time, false)),
      ...times(tracks.filter(({ node }) => node === state('node'))).map((time) => line(time, true)));
  }

  show(time = this.animation.time ?? 0) {
    const { playing, live, duration } = this.animation;
    this.range.max = duration;
    this.range.value = time;
    this.range.setAttribute('aria-valuetext', `${time.toFixed(2)} of ${seconds(duration)}`);
    this.clock.textContent = `${time.toFixed(2)} / ${seconds(duration)}`;
    this.range.disabled = this.play.disabled = live;
    if (this.live.getAttribute('aria-pressed') !== String(live)) this.live.setAttribute('aria-pressed', live);
    const says = live && !this.animation.isConnected ? 'Live: no answer' : 'Live';
    if (this.live.textContent !== says) this.live.textContent = says;
    if (this.shownPlaying === playing) return;
    this.shownPlaying = playing;
    this.play.setAttribute('aria-label', playing ? 'Pause' : 'Play');
    this.play.replaceChildren(iconOf(playing ? 'pause' : 'play'));
  }
}
