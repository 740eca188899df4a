// What a clip is like, in sentences: does it loop, how far does it go, which feet slide, what leaps.
import { fixed, plural } from './dom.js';

const SEAMLESS = 2;    // degrees between the first and the last pose that nobody sees
const NOISY = 0.15;    // degrees of jitter that are seen
const RETURNS = 0.01;  // metres between the first and the last place that are no way
const MOST = 5;        // entries of a list that are shown
const SLIDES = 0.01;   // of a contact's figure: less is no slide

const degrees = (value) => `${fixed(value, Math.abs(value) < 10 ? 1 : 0)}°`;
const length = (value) => (Math.abs(value) < 0.1 ? `${fixed(100 * value, 1)} cm` : `${fixed(value, 2)} m`);

/** Sentences about a clip: [{mark: good, fair or bad; text; time: to seek, if any}]. report: of /tracks; isFigure: it has
 *  feet, whatever they are called. */
export function sentencesOf({ loop, root, still, feet, contacts, noise, pops }, nodes, isFigure) {
  const list = [];
  const say = (mark, text, time) => list.push({ mark, text, time });
  if (loop.angle <= SEAMLESS && loop.distance < 0.01) say('good', 'Loops without a seam.');
  else say(loop.angle < 15 ? 'fair' : 'bad', `Does not loop: between its end and its start ${loop.node ?? 'it'} leaps by ${degrees(loop.angle)}${loop.distance >= 0.01 ? ` and ${length(loop.distance)}` : ''}.`, 0);
  const turns = Math.abs(root.turn) >= 5 ? ` and turns by ${degrees(root.turn)}` : '';
  if (root.node && root.speed > 0.01 && root.distance < RETURNS) say('', `${root.node} moves at ${fixed(root.speed, 2)} m/s and ends where it began${turns}.`);
  else if (root.node && root.speed > 0.01) say('', `${root.node} goes ${length(root.distance)} at ${fixed(root.speed, 2)} m/s${turns}.`);
  else say('', 'Stays in its place.');
  const worst = [...contacts].sort((a, b) => b.slide - a.slide)[0];
  if (worst) say(worst.slide < SLIDES ? 'good' : 'bad', `Feet touch the ground ${plural(contacts.length, 'time')}; ${worst.slide < SLIDES ? 'none slides' : `${worst.node} slides by ${length(worst.slide)}`}.`, worst.from);
  if (feet.length === 0 && isFigure) say('', 'Contacts with the ground are not judged: no foot is known by its name.');
  const jitter = noise.filter(({ path, rms }) => path === 'rotation' && rms > NOISY).sort((a, b) => b.rms - a.rms);
  if (jitter.length > 0) say('bad', `Jitters: ${jitter.slice(0, 3).map(({ node, rms }) => `${node} by ${degrees(rms)}`).join(', ')}.`);
  for (const { node, time, angle } of [...pops].sort((a, b) => b.angle - a.angle).slice(0, MOST)) say('bad', `One key of ${node} leaps by ${degrees(angle)}.`, time);
  if (still.length > 0 && still.length < nodes) say('', `${plural(still.length, 'node never moves', 'nodes never move')}: ${still.slice(0, 3).join(', ')}${still.length > 3 ? ' …' : '.'}`);
  return list;
}

/** How a borrowed clip was carried over, in sentences. */
export function carriedOver({ bones, scale, without_target: lost, without_source: resting }) {
  const list = [`${plural(bones.length, 'bone follows', 'bones follow')}, ways are ${fixed(scale, 2)} times as long.`];
  if (lost.length > 0) list.push(`Nothing here follows ${lost.slice(0, 3).join(', ')}${lost.length > 3 ? ` and ${lost.length - 3} more` : ''}.`);
  if (resting.length > 0) list.push(`${plural(resting.length, 'bone keeps', 'bones keep')} the rest pose.`);
  return list;
}
