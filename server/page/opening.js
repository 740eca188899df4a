// What opening a model asks of the daemon, and in which order. It draws nothing, so that it can be tested without a browser.

const SMALL = 100000; // edges of the largest level that is loaded without asking for its size first: some megabytes
const FIRST = 2; // the level that a model opens with where no other is computed
const FIRST_MOST = 200000; // its faces
const UNSEEN = '0.1%'; // of the model's size: an error that the eye does not see
const SOON_MOST = 50000; // faces that are drawn soon without a graphics card, too
const COMPUTED_MOST = 2000; // edges of the largest cage whose errors are computed first: those of larger ones may take seconds

export const edgesOf = ({ meshes }) => meshes.reduce((sum, mesh) => sum + mesh.edges, 0);

/** The usual level, or the highest below it that a browser draws at once. */
export function firstLevel(model) {
  let level = FIRST;
  while (level > 0 && 2 * edgesOf(model) * 4 ** (level - 1) > FIRST_MOST) level--; // as many quads as corners, then four of each
  return level;
}

/** Options by which nothing is compressed for its size. */
const uncompressed = (options) => (options.encoding === 'meshopt' ? { ...options, encoding: 'float' } : options);

export class Opening {
  /** count(model, options, {signal}), load(model, options, {signal, onProgress}) and parse(bytes, {isCage}) are for a surface as GLB;
   *  levels(model, options, {signal}) tells the counts of all, and which are refused; confirm(bytes, level) asks whether so much is
   *  wanted, isMuch(bytes) whether it would. */
  constructor({ count, load, parse, levels, confirm, isMuch }) {
    Object.assign(this, { count, load, parse, levels, confirm, isMuch, counted: null });
  }

  /** The counts of a level; those that choosing it told already are not asked for again. */
  async #countsOf(model, options, init) {
    const { of, options: given, counts } = this.counted ?? {};
    return of === model && JSON.stringify({ ...given, level: counts.level }) === JSON.stringify(options) ? counts : this.count(model, options, init);
  }

  /** The level to open a model with: the least whose error the eye does not see. */
  async level(model, options, init) {
    const edges = edgesOf(model);
    if (edges === 0 || edges > COMPUTED_MOST) return firstLevel(model);
    try {
      const counts = await this.count(model, { ...uncompressed(options), level: 'auto', error: UNSEEN, faces: SOON_MOST }, init);
      this.counted = { of: model, options: uncompressed(options), counts };
      return counts.level;
    } catch (error) {
      if (error.status === undefined) throw error;
      return firstLevel(model); // not all rules tell errors; what is wrong with the surface, its own request says
    }
  }

  /** The highest level that the daemon makes and that is loaded without a question; null where there is none. */
  async highest(model, options, init) {
    const all = await this.levels(model, uncompressed(options), init);
    return all.findLast(({ refused, bytes }) => !refused && !this.isMuch(bytes))?.level ?? null;
  }

  /** A level of the surface: {counts, answer, parsed}. onLoaded() is called before it is parsed. */
  async surface(model, options, { signal, onProgress, onLoaded = () => {} }) {
    const isSmall = edgesOf(model) * 4 ** options.level < SMALL;
    const load = () => this.load(model, options, { signal, onProgress });
    const [counts, early] = await Promise.all([this.#countsOf(model, uncompressed(options), { signal }), isSmall ? load() : null]);
    if (!early && !(await this.confirm(counts.bytes, options.level))) throw new DOMException('It is not wanted', 'AbortError');
    signal.throwIfAborted();
    const answer = early ?? (await load());
    onLoaded();
    const parsed = await this.parse(await answer.blob.arrayBuffer());
    signal.throwIfAborted();
    return { counts, answer, parsed };
  }

  /** The control mesh, parsed: its polygons and creases, without clips. */
  async cage(model, { details, quads, creases }, { signal }) {
    const { blob } = await this.load(model, { level: 0, normals: 'none', polygons: 'ngon', clip: 'none', details, quads, creases }, { signal });
    return this.parse(await blob.arrayBuffer(), { isCage: true });
  }
}
