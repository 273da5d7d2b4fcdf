import { type Camera, Vector3 } from "three";
import { h } from "./dom";

export interface Label {
  at: Vector3;
  text: string;
  kind: "axis" | "arrow" | "doubt" | "warning";
}

type Box = [left: number, top: number, width: number, height: number];

interface Placed extends Label {
  element: HTMLElement;
  x: number;
  y: number;
  shown: boolean;
}

/** Text at places of the picture. Where labels would cover one another the later one steps down, or waits. */
export class Labels {
  readonly host = h("div", { class: "fx-labels" });
  private placed: Placed[] = [];

  set(labels: Label[]): void {
    this.placed = labels.map((label) => ({
      ...label,
      element: h("div", { class: `fx-label fx-label-${label.kind}` }, label.text),
      x: 0,
      y: 0,
      shown: false,
    }));
    this.host.replaceChildren(...this.placed.map((label) => label.element));
  }

  /** `over`: boxes that labels keep clear of, in CSS pixels of the picture. */
  place(camera: Camera, width: number, height: number, over: Box[]): void {
    const taken = [...over];
    for (const label of this.placed) {
      const p = label.at.clone().project(camera);
      label.shown = Math.abs(p.z) <= 1 && Math.abs(p.x) < 1.02 && Math.abs(p.y) < 1.02;
      if (label.shown) this.settle(label, ((p.x + 1) / 2) * width, ((1 - p.y) / 2) * height, width, taken);
      label.element.hidden = !label.shown;
      if (label.shown) label.element.style.transform = `translate(${Math.round(label.x)}px, ${Math.round(label.y)}px)`;
    }
  }

  /** What is shown now, in CSS pixels of the picture. */
  get texts(): { text: string; x: number; y: number; kind: string }[] {
    return this.placed.filter((label) => label.shown).map(({ text, x, y, kind }) => ({ text, x, y, kind }));
  }

  private settle(label: Placed, x: number, y: number, width: number, taken: Box[]): void {
    const [w, tall] = [8 + 7 * label.text.length, 22];
    label.x = Math.min(x + 8, Math.max(width - w - 4, 4));
    for (let step = 0; step < 6; step++) {
      label.y = y - 11 + 23 * (step % 2 ? -Math.ceil(step / 2) : Math.ceil(step / 2));
      const clear = taken.every(([tx, ty, tw, th]) => label.x > tx + tw || label.x + w < tx || label.y > ty + th || label.y + tall < ty);
      if (clear) {
        taken.push([label.x, label.y, w, tall]);
        return;
      }
    }
    label.shown = false;
  }
}
