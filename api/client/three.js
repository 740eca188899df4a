// A Loader of three.js for all that tweend reads: files, which the daemon does not store, and stored models.
import { FileLoader, Loader } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

import { Tweend } from './tweend.js';

const ID = /^[0-9a-f]{32}$/;

export class TweendLoader extends Loader {
  #abort = new AbortController();
  #client;
  #surface = {};

  constructor(manager) {
    super(manager);
    this.files = new FileLoader(manager).setResponseType('arraybuffer');
    this.gltf = new GLTFLoader(manager);
  }

  setClient(tweend) {
    this.#client = tweend;
    return this;
  }

  setSurface(options) {
    this.#surface = options;
    return this;
  }

  abort() {
    this.files.abort?.(); // since release 179 of three.js
    this.#abort.abort();
    this.#abort = new AbortController();
    return this;
  }

  /** The daemon's GLB of a stored model, or of the bytes of a file. */
  async #glb(model, bytes) {
    const client = (this.#client ??= new Tweend());
    const own = this.#abort.signal;
    const others = this.manager.abortController?.signal;
    const init = { signal: others && AbortSignal.any ? AbortSignal.any([own, others]) : own };
    const answer = await (model ? client.surface(model, this.#surface, 'glb', init) : client.surfaceOf(bytes, this.#surface, 'glb', init));
    return answer.arrayBuffer();
  }

  async #read(url, onProgress) {
    if (ID.test(url)) return this.#glb(url);
    const { path, requestHeader, withCredentials } = this;
    this.files.setPath(path).setRequestHeader(requestHeader).setWithCredentials(withCredentials);
    return this.#glb(undefined, await this.files.loadAsync(url, onProgress));
  }

  load(url, onLoad, onProgress, onError = console.error) {
    const { manager } = this;
    manager.itemStart(url);
    this.#read(url, onProgress)
      .then((glb) => this.gltf.parseAsync(glb, ''))
      .then((gltf) => {
        onLoad(gltf);
        manager.itemEnd(url);
      })
      .catch((error) => {
        onError(error);
        manager.itemError(url);
        manager.itemEnd(url);
      });
  }

  async modelAsync(model) {
    return this.gltf.parseAsync(await this.#glb(model), '');
  }

  async parseAsync(bytes) {
    return this.gltf.parseAsync(await this.#glb(undefined, bytes), '');
  }

  parse(bytes, path, onLoad, onError = console.error) {
    this.parseAsync(bytes).then(onLoad).catch(onError);
  }
}
