// What opening a model asks of the daemon, and in which order. It draws nothing, so that it can be tested without a browser.

const SMALL = 100000; // edges of the largest level that is loaded without asking for its size first: some megabytes
const FIRST_MOST = 200000; // faces of the level that a model opens with

export const edgesOf = ({ meshes }) => meshes.reduce((sum, mesh) => sum + mesh.edges, 0);

/** A level, or the highest below it that a browser draws at once. */
export function firstLevel(model, level) {
  while (level > 0 && 2 * edgesOf(model) * 4 ** (level - 1) > FIRST_MOST) level--; // as many quads as corners, then four of each
  return level;
}

export class Opening {
  /** count(model, options, {signal}), load(model, options, {signal, onProgress}) and parse(bytes) are for a surface as GLB;
   *  confirm(bytes, level) asks whether so much is wanted. */
  constructor({ count, load, parse, confirm }) {
    Object.assign(this, { count, load, parse, confirm });
  }

  /** A level of the surface: {counts, answer, parsed}. onLoaded() is called before it is parsed. */
  async surface(model, options, { signal, onProgress, onLoaded = () => {} }) {
    const counted = options.encoding === 'meshopt' ? { ...options, encoding: 'float' } : options; // no compressing for a size
    const isSmall = edgesOf(model) * 4 ** options.level < SMALL;
    const load = () => this.load(model, options, { signal, onProgress });
    const [counts, early] = await Promise.all([this.count(model, counted, { signal }), isSmall ? load() : null]);
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
    return this.parse(await blob.arrayBuffer());
  }
}
