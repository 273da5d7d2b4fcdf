import type { SceneData } from "../scene";
import { h } from "./dom";

/** The static picture of a scene with a sentence that says why nothing moves. */
export class Still {
  readonly element: HTMLElement;
  private readonly picture = h("img", { class: "fx-still-picture" });

  constructor(scene: SceneData, why: string) {
    this.element = h("div", { class: "fx-still-view" }, this.picture, h("p", { class: "fx-why", role: "status" }, why));
    this.update(scene);
  }

  update(scene: SceneData): void {
    this.picture.hidden = scene.picture === null;
    if (scene.picture !== null) this.picture.src = scene.picture;
    this.picture.alt = `picture of ${scene.name}`;
  }
}
