import type { Fact, SceneData } from "../scene";
import { type Viewer, mountViewer } from "../viewer";
import { type Facts, type Picture, numbers } from "./protocol";

/** The motion of the scene that follows the mode that is shown. */
const MOTION = "mode";

/** The 3-D view, fed by pictures; while one is drawn the latest of the others waits. */
export class Stage {
  private viewer: Viewer | null = null;
  private busy: Promise<void> = Promise.resolve();
  private vertices = 0;
  private facts: Fact[][] = [];

  constructor(private readonly host: HTMLElement) {}

  /** Show a scene; camera and legend stay. */
  show(scene: SceneData, binary?: ArrayBuffer): Promise<void> {
    this.busy = this.busy.then(async () => {
      this.vertices = scene.points.shape[0];
      this.facts = scene.parts.map((part) => part.facts);
      if (this.viewer === null) this.viewer = await mountViewer(this.host, scene, { motion: MOTION, binary });
      else await this.viewer.update(scene, binary);
    });
    return this.busy;
  }

  /** Open the list of keys, or close it. */
  help(): void {
    this.viewer?.toggleHelp?.();
  }

  /** Tell what is new of the parts. */
  tell(facts: Facts): void {
    this.busy = this.busy.then(() => {
      for (const [part, own] of Object.entries(facts)) this.facts[Number(part)] = own;
      this.viewer?.tell(this.facts);
    });
  }

  /** Move to a picture, of whose parts nothing is known before it is told; false where it does not fit the scene, of which another is on its way. */
  move(bytes: ArrayBuffer | undefined, picture: Picture): Promise<boolean> {
    const done = this.busy.then(async () => {
      const { points, displacement } = picture.buffers;
      const { mode, rigid, text, proof, flag } = picture.row;
      const title = `mode ${mode}: ${rigid ? "rigid motion" : `${text} Hz`}`;
      if (!this.viewer || !bytes || points.shape[0] !== this.vertices) return false;
      this.viewer.tell([]);
      await this.viewer.move({
        points: numbers(bytes, points),
        displacements: { [MOTION]: numbers(bytes, displacement) },
        motions: [{ id: MOTION, title, subtitle: rigid ? "" : proof, flag, factor: picture.factor }],
      });
      return true;
    });
    this.busy = done.then(() => undefined);
    return done;
  }
}
