import { NearestFilter, type Object3D, Vector2, WebGLRenderTarget } from "three";
import type { Stage } from "./stage";
import type { Uniforms } from "./batches";

const REACH = 9; // pixels: what is at most half of it away is found

/** Which part is seen at a place: parts are drawn there in the colour of their number, as they stand now. */
export class Picker {
  private readonly target = new WebGLRenderTarget(REACH, REACH, { magFilter: NearestFilter, minFilter: NearestFilter });
  private readonly window = new Vector2(REACH, REACH);
  private readonly read = new Uint8Array(4 * REACH * REACH);

  constructor(
    private readonly stage: Stage,
    private readonly uniforms: Uniforms,
    private readonly over: Object3D,
  ) {}

  /** Number of the part next to a place of the canvas, in CSS pixels; -1 where there is none. */
  at(x: number, y: number): number {
    const { stage } = this;
    const ratio = stage.renderer.getPixelRatio();
    const half = (REACH - 1) / 2;
    this.draw(Math.round(x * ratio) - half, Math.round(y * ratio) - half);
    let [best, nearest] = [-1, Infinity];
    for (let k = 0; k < REACH * REACH; k++) {
      const number = this.read[4 * k] + 256 * this.read[4 * k + 1] + 65536 * this.read[4 * k + 2] - 1;
      const distance = Math.hypot((k % REACH) - half, Math.floor(k / REACH) - half);
      if (number >= 0 && distance < nearest) [best, nearest] = [number, distance];
    }
    return best;
  }

  dispose(): void {
    this.target.dispose();
  }

  private draw(left: number, top: number): void {
    const { renderer, scene, view, pixels } = this.stage;
    const clear = renderer.getClearColor(this.stage.scratchColour);
    view.setViewOffset(pixels.x, pixels.y, left, top, REACH, REACH);
    this.over.visible = false;
    this.uniforms.pixels.value = this.window;
    this.uniforms.picking.value = true;
    renderer.setClearColor(0x000000, 0);
    renderer.setRenderTarget(this.target);
    renderer.clear();
    renderer.render(scene, view);
    renderer.readRenderTargetPixels(this.target, 0, 0, REACH, REACH, this.read);
    renderer.setRenderTarget(null);
    renderer.setClearColor(clear, 1);
    this.uniforms.picking.value = false;
    this.uniforms.pixels.value = pixels;
    this.over.visible = true;
    view.clearViewOffset();
  }
}
