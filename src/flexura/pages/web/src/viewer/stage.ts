import { Color, OrthographicCamera, PerspectiveCamera, Scene, Vector2, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { VIEWS, alike, alikeDeep, fittingDistance } from "./views";

const SLOW = 36; // ms
const COARSE = 0.5; // pixels for one of CSS while what is shown changes and the processor draws it
const REST = 300; // ms after which nothing changes any more

/** Pixels of the picture for one of CSS. */
function finest(): number {
  return Math.min(window.devicePixelRatio || 1, 3);
}

/** Whether pictures are drawn by the processor, for want of a graphics card. */
function drawsInSoftware(renderer: WebGLRenderer): boolean {
  const gl = renderer.getContext();
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

/** The canvas, the camera and when to draw: only after something changed, and never out of sight. */
export class Stage {
  readonly renderer: WebGLRenderer;
  readonly scene = new Scene();
  readonly controls: OrbitControls;
  readonly pixels = new Vector2(1, 1);
  readonly scratchColour = new Color();
  reach = 0; // how far anything moves out of the box
  onFrame: (now: number) => boolean = () => false; // before drawing; whether another frame is due
  onDraw: () => void = () => {}; // with the camera in place
  onDrawn: () => void = () => {};
  onContext: (lost: boolean) => void = () => {};
  private readonly deep = new PerspectiveCamera(28, 1, 0.01, 100);
  private readonly flat = new OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
  private camera: PerspectiveCamera | OrthographicCamera = this.deep;
  private corners: Vector3[] = [];
  private points: Float32Array = new Float32Array(0);
  private readonly resizer: ResizeObserver;
  private readonly watcher: IntersectionObserver;
  private asked = 0;
  private last = 0; // ms, time of the frame before
  private resting: ReturnType<typeof setTimeout> | undefined; // while what is shown changes
  private readonly software: boolean;
  private pace = 0; // ms, of late, from frame to frame while a motion plays; 0: not known
  private inSight = true;
  private lost = false;
  private released = false;
  private fitted = true; // and nobody turned the view since

  /** Throws where there is no WebGL 2. */
  constructor(readonly host: HTMLElement) {
    this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "high-performance", alpha: false });
    this.renderer.sortObjects = true;
    this.software = drawsInSoftware(this.renderer);
    this.renderer.setPixelRatio(finest());
    this.renderer.domElement.tabIndex = 0;
    host.append(this.renderer.domElement);
    for (const camera of [this.deep, this.flat]) camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.15;
    this.controls.zoomToCursor = true;
    this.controls.minDistance = 1e-3;
    this.controls.maxDistance = 50;
    this.controls.addEventListener("change", this.ask);
    this.controls.addEventListener("start", () => {
      this.fitted = false;
    });
    this.resizer = new ResizeObserver(() => this.resize());
    this.resizer.observe(host);
    this.watcher = new IntersectionObserver((seen) => this.see(seen[seen.length - 1].isIntersecting), { rootMargin: "200px" });
    this.watcher.observe(host);
    document.addEventListener("visibilitychange", this.ask);
    this.canvas.addEventListener("webglcontextlost", this.loseContext);
    this.canvas.addEventListener("webglcontextrestored", this.restoreContext);
    this.resize();
  }

  get canvas(): HTMLCanvasElement {
    return this.renderer.domElement;
  }

  get view(): PerspectiveCamera | OrthographicCamera {
    return this.camera;
  }

  get parallel(): boolean {
    return this.camera === this.flat;
  }

  get visible(): boolean {
    return this.inSight && !this.lost && document.visibilityState !== "hidden";
  }

  /** Draw in the next frame. */
  readonly ask = (): void => {
    if (this.asked === 0 && this.visible) this.asked = requestAnimationFrame(this.frame);
  };

  /** What is shown changes, and may soon again: until it rests the processor draws fewer pixels. */
  hurry(): void {
    if (!this.software) return;
    if (this.resting === undefined) this.rasterise(COARSE);
    clearTimeout(this.resting);
    this.resting = setTimeout(() => {
      this.resting = undefined;
      this.rasterise(finest());
      this.ask();
    }, REST);
  }

  background(colour: string): void {
    this.renderer.setClearColor(new Color(colour), 1);
    this.ask();
  }

  /** What fits into the picture: points (n, 3), and the box around them. */
  around(low: ArrayLike<number>, high: ArrayLike<number>, points: Float32Array): void {
    this.points = points;
    this.corners = [];
    for (let k = 0; k < 8; k++)
      this.corners.push(new Vector3(k & 1 ? low[0] : high[0], k & 2 ? low[1] : high[1], k & 4 ? low[2] : high[2]));
  }

  look(view: keyof typeof VIEWS): void {
    this.fit(new Vector3(...VIEWS[view].from));
  }

  /** Show all, from the direction seen from now unless another is given. */
  fit(direction = this.camera.position.clone().sub(this.controls.target)): void {
    const target = this.controls.target.set(0, 0, 0);
    for (const corner of this.corners) target.addScaledVector(corner, 1 / this.corners.length);
    const distance = fittingDistance(this.deep, direction, this.points, target);
    this.deep.position.copy(target).addScaledVector(direction.clone().normalize(), distance);
    this.deep.lookAt(target);
    alike(this.flat, this.deep, target);
    this.controls.update();
    this.fitted = true;
    this.ask();
  }

  project(parallel: boolean): void {
    if (parallel === this.parallel) return;
    const target = this.controls.target;
    if (parallel) alike(this.flat, this.deep, target);
    else alikeDeep(this.deep, this.flat, target);
    this.camera = parallel ? this.flat : this.deep;
    this.controls.object = this.camera;
    this.controls.update();
    this.ask();
  }

  /** Turn by angles, rad, or move by shares of the picture, or zoom by a factor. */
  turn(right: number, up: number): void {
    const target = this.controls.target;
    const away = this.camera.position.clone().sub(target);
    const radius = away.length();
    const azimuth = Math.atan2(away.y, away.x) + right;
    const height = Math.min(Math.max(Math.asin(away.z / radius) + up, -1.5707), 1.5707);
    away.set(Math.cos(height) * Math.cos(azimuth), Math.cos(height) * Math.sin(azimuth), Math.sin(height));
    this.camera.position.copy(target).addScaledVector(away, radius);
    this.controls.update();
    this.fitted = false;
    this.ask();
  }

  shift(right: number, up: number): void {
    const half = this.parallel ? 1 / this.flat.zoom : this.deep.position.distanceTo(this.controls.target) * Math.tan((this.deep.fov * Math.PI) / 360);
    const [x, y] = [new Vector3(), new Vector3()];
    this.camera.matrixWorld.extractBasis(x, y, new Vector3());
    const by = x.multiplyScalar(2 * half * right).addScaledVector(y, 2 * half * up);
    this.controls.target.add(by);
    this.camera.position.add(by);
    this.fitted = false;
    this.controls.update();
    this.ask();
  }

  zoom(factor: number): void {
    this.fitted = false;
    if (this.parallel) {
      this.flat.zoom *= factor;
      this.flat.updateProjectionMatrix();
    } else {
      const away = this.deep.position.clone().sub(this.controls.target);
      this.deep.position.copy(this.controls.target).addScaledVector(away, 1 / factor);
    }
    this.controls.update();
    this.ask();
  }

  /** Draw now. */
  draw(): void {
    this.clipToContent();
    this.onDraw();
    this.renderer.render(this.scene, this.camera);
  }

  /** Draw with at least two pixels for one of CSS, and hand the canvas on. */
  drawnFine<T>(taken: (canvas: HTMLCanvasElement) => T): T {
    const ratio = this.renderer.getPixelRatio();
    this.rasterise(Math.max(2, ratio));
    this.draw();
    const result = taken(this.canvas);
    this.rasterise(ratio);
    this.draw();
    return result;
  }

  dispose(): void {
    clearTimeout(this.resting);
    cancelAnimationFrame(this.asked);
    this.resizer.disconnect();
    this.watcher.disconnect();
    document.removeEventListener("visibilitychange", this.ask);
    this.canvas.removeEventListener("webglcontextlost", this.loseContext);
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.canvas.remove();
  }

  private readonly frame = (now: number): void => {
    this.asked = 0;
    if (!this.visible) return;
    const more = this.onFrame(now);
    this.keepPace(now, more);
    this.controls.update();
    this.draw();
    this.onDrawn();
    if (more) this.ask();
  };

  /** While a motion plays slowly it is drawn with fewer pixels, down to those of CSS; at rest with all. */
  private keepPace(now: number, playing: boolean): void {
    const ratio = this.renderer.getPixelRatio();
    if (this.resting !== undefined) {
      this.pace = 0;
    } else if (!playing) {
      this.pace = 0;
      if (ratio < finest()) this.rasterise(finest());
    } else {
      const passed = now - this.last;
      this.pace = this.pace === 0 ? 1e-3 : 0.85 * this.pace + 0.15 * passed;
      if (this.pace > SLOW && ratio > 1) {
        this.rasterise(Math.max(1, 0.7 * ratio));
        this.pace = 0;
      }
    }
    this.last = now;
  }

  /** The planes between which is drawn hug what is there, so that depths are told apart. */
  private clipToContent(): void {
    this.camera.updateMatrixWorld();
    const back = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 2);
    const depths = this.corners.map((corner) => -corner.clone().sub(this.camera.position).dot(back));
    const spread = 0.75 + this.reach;
    const [near, far] = [Math.min(...depths) - spread, Math.max(...depths) + spread];
    this.camera.near = this.parallel ? near : Math.max(near, far * 2e-3, 1e-5);
    this.camera.far = Math.max(far, this.camera.near * 1.01);
    this.camera.updateProjectionMatrix();
  }

  private rasterise(ratio: number): void {
    const { clientWidth: width, clientHeight: height } = this.host;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.renderer.getDrawingBufferSize(this.pixels);
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (width === 0 || height === 0) return;
    this.rasterise(this.resting === undefined ? finest() : COARSE);
    this.deep.aspect = width / height;
    this.flat.left = -this.deep.aspect;
    this.flat.right = this.deep.aspect;
    this.deep.updateProjectionMatrix();
    this.flat.updateProjectionMatrix();
    if (this.fitted && this.corners.length > 0) this.fit();
    this.ask();
  }

  /** Browsers keep few WebGL contexts: those of viewers out of sight are given back. */
  private see(inSight: boolean): void {
    this.inSight = inSight;
    if (!inSight && !this.lost) {
      this.released = true;
      this.renderer.forceContextLoss();
    } else if (inSight && this.released && this.lost) {
      this.renderer.forceContextRestore();
    }
    this.ask();
  }

  private readonly loseContext = (event: Event): void => {
    event.preventDefault();
    this.lost = true;
    cancelAnimationFrame(this.asked);
    this.asked = 0;
    if (!this.released) this.onContext(true);
    else if (this.inSight) setTimeout(() => this.renderer.forceContextRestore());
  };

  private readonly restoreContext = (): void => {
    this.lost = this.released = false;
    this.onContext(false);
    this.ask();
    if (!this.inSight) this.see(false);
  };
}
