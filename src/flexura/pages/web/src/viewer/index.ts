import type { Fact, SceneData } from "../scene";
import type { Move, Options, Viewer } from "./api";
import { h } from "./dom";
import { Model } from "./model";
import { Still } from "./still";
import css from "./style.css";
import { LiveViewer } from "./viewer";

export type { Move, Options, Viewer } from "./api";

/** The static picture in place of the viewer. */
class StillViewer implements Viewer {
  private readonly still: Still;

  constructor(
    private readonly host: HTMLElement,
    public scene: SceneData,
    why: string,
  ) {
    const own = host.querySelector("img") ? { ...scene, picture: null } : scene;
    this.still = new Still(own, why);
    host.append(this.still.element);
  }

  async update(scene: SceneData): Promise<void> {
    this.scene = scene;
    this.still.update(scene);
  }

  async move(_change: Move): Promise<void> {}
  show(_id: string | null): void {}
  select(_part: string | null): void {}
  tell(_facts: Fact[][]): void {}

  dispose(): void {
    this.still.element.remove();
    this.host.classList.remove("fx-host");
  }
}

const styled = new WeakSet<Node>();

/** Style what hangs in the document, or the shadow tree, of an element, once. */
export function adoptStyles(element: Element): void {
  const tree = element.getRootNode();
  if (styled.has(tree) || !(tree instanceof Document || tree instanceof ShadowRoot)) return;
  styled.add(tree);
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(css);
  tree.adoptedStyleSheets = [...tree.adoptedStyleSheets, sheet];
}

/** Show a scene in an element. What the element holds is its static picture: hidden while the scene can be seen in 3-D, and on paper again. */
export async function mountViewer(host: HTMLElement, scene: SceneData, options: Options = {}): Promise<Viewer> {
  adoptStyles(host);
  if (!h("canvas").getContext("webgl2")) return new StillViewer(host, scene, "This browser has no WebGL 2, so that nothing moves: this is a still picture.");
  try {
    const model = await Model.of(scene, options.binary);
    const viewer = new LiveViewer(host, model, options);
    host.classList.add("fx-host");
    return viewer;
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    return new StillViewer(host, scene, `The 3-D graphics do not start (${why}): this is a still picture.`);
  }
}
