// Draws a picture that takes long, as large models do without a graphics card, while the page goes on. A page waits for what
// it has drawn on a canvas; so this draws beside it, asks now and then whether that is done, and copies it onto the canvas.
import { Mesh, OrthographicCamera, PlaneGeometry, Scene, ShaderMaterial, SRGBColorSpace, Vector2, WebGLRenderTarget } from 'three';

const ASK_MS = 8;

export class BackgroundPicture {
  constructor(renderer) {
    this.renderer = renderer;
    this.gl = renderer.getContext();
    const material = new ShaderMaterial({
      uniforms: { map: { value: null } },
      vertexShader: 'varying vec2 place;\nvoid main() { place = uv; gl_Position = vec4(2.0 * uv - 1.0, 0.0, 1.0); }',
      fragmentShader: 'uniform sampler2D map;\nvarying vec2 place;\nvoid main() { gl_FragColor = texture2D(map, place);\n#include <colorspace_fragment>\n}',
      depthTest: false, depthWrite: false,
    });
    this.copy = new Scene().add(Object.assign(new Mesh(new PlaneGeometry(1, 1), material), { frustumCulled: false }));
    this.camera = new OrthographicCamera();
    this.targets = {}; // by fineness
  }

  /** part: of the canvas' width that the picture has in pixels; samples: of each. */
  #target(part, samples) {
    const { x, y } = this.renderer.getDrawingBufferSize(new Vector2());
    const target = (this.targets[part] ??= new WebGLRenderTarget(1, 1, { samples, colorSpace: SRGBColorSpace }));
    target.setSize(Math.ceil(x * part), Math.ceil(y * part));
    return target;
  }

  /** Draws by draw(target), and resolves when the canvas has the picture. isFine: in all pixels, with smooth edges. */
  async show(draw, isFine) {
    const { gl, renderer } = this;
    const target = this.#target(isFine ? 1 : 0.5, isFine ? gl.getParameter(gl.SAMPLES) : 0);
    draw(target);
    renderer.setRenderTarget(null);
    const end = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0); // null when the context is lost
    gl.flush();
    while (end && gl.getSyncParameter(end, gl.SYNC_STATUS) === gl.UNSIGNALED) await new Promise((resolve) => setTimeout(resolve, ASK_MS));
    gl.deleteSync(end);
    this.copy.children[0].material.uniforms.map.value = target.texture;
    renderer.setScissor(0, 0, ...renderer.getSize(new Vector2())); // the canvas may have another size since it was last drawn on
    renderer.render(this.copy, this.camera);
  }
}

/** Resolves when the page has taken over what stands on its canvases: what is drawn before would be waited for, too. */
export const takenOver = () => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
