import { quantities } from "../numbers";
import type { Motion, Quantity } from "../scene";
import { gradient } from "./colourmap";
import { h } from "./dom";

/** The colour bar: what the colours of a quantity mean. */
export class ColourBar {
  readonly element: HTMLElement;
  private readonly title = h("div", { class: "fx-colours-title" });
  private readonly ticks = h("div", { class: "fx-colours-ticks" });
  private readonly unknown = h("div", { class: "fx-colours-unknown" }, h("span", { class: "fx-swatch" }), "unknown");
  private readonly ramp = h("div", { class: "fx-colours-ramp" });

  constructor() {
    this.ramp.style.background = gradient("to top");
    this.element = h("div", { class: "fx-colours", hidden: true }, this.title, h("div", { class: "fx-colours-body" }, this.ramp, this.ticks), this.unknown);
  }

  show(own: Quantity | null, unknown: boolean): void {
    this.element.hidden = own === null;
    if (!own) return;
    this.title.textContent = barTitle(own);
    this.ticks.replaceChildren(...barTicks(own).map((text) => h("span", {}, text)));
    this.unknown.hidden = !unknown;
  }
}

export function barTitle(own: Quantity): string {
  return own.largest === null ? `${own.label}, of largest` : own.label;
}

/** Texts along a colour bar, the largest first. */
export function barTicks(own: Quantity): string[] {
  const shares = [1, 0.75, 0.5, 0.25, 0];
  const { largest } = own;
  return largest === null ? shares.map((share) => `${100 * share} %`) : quantities(shares.map((share) => share * largest), own.scales);
}

/** A share of the largest value of a quantity in its unit; of the largest where that is not known. */
export function valueText(own: Quantity, share: number): string {
  if (own.largest === null) return `${Math.round(100 * share)} % of largest`;
  return quantities([share * own.largest], own.scales)[0];
}

/** What is under the pointer. */
export class Tip {
  readonly element = h("div", { class: "fx-tip", role: "status", hidden: true });

  show(name: string, kind: string, facts: [string, string][], x: number, y: number, width: number, height: number): void {
    const rows = facts.map(([key, value]) => h("div", {}, h("span", {}, key), h("b", {}, value)));
    this.element.replaceChildren(h("strong", {}, name), h("em", {}, kind), ...rows);
    this.element.hidden = false;
    const { offsetWidth, offsetHeight } = this.element;
    const left = x + 16 + offsetWidth > width ? x - offsetWidth - 12 : x + 16;
    const top = Math.min(y + 14, height - offsetHeight - 6);
    this.element.style.transform = `translate(${Math.max(4, left)}px, ${Math.max(4, top)}px)`;
  }

  hide(): void {
    this.element.hidden = true;
  }
}

/** Title of what is shown, over the picture. */
export class Title {
  readonly element = h("div", { class: "fx-title" });

  show(name: string, motions: Motion[], title: string, subtitle: string): void {
    const flag = motions.find((own) => own.flag)?.flag;
    this.element.replaceChildren(
      h("strong", {}, name),
      h("span", {}, title, flag ? h("span", { class: "fx-flag" }, flag) : null),
      subtitle ? h("small", {}, subtitle) : "",
    );
  }
}

const KEYS: [string, string][] = [
  ["Space", "play or pause"], [", .", "step back, on"], ["l", "loop"], ["[ ]", "motion before, after"], ["c", "next colours"],
  ["arrows", "turn"], ["Shift + arrows", "move"], ["+ −", "zoom"], ["f", "show all"], ["0 … 6", "isometric, front, back, left, right, top, bottom"],
  ["o", "parallel projection"], ["g", "undeformed outline"], ["t", "see through bodies"], ["x y z", "section across"], ["n p", "part after, before"],
  ["Esc", "nothing selected"], ["Shift + f", "full screen"], ["?", "this list"],
];

/** The list of keys. */
export function helpPanel(close: () => void): HTMLDialogElement {
  const rows = KEYS.flatMap(([keys, text]) => [h("dt", {}, h("kbd", {}, keys)), h("dd", {}, text)]);
  const mouse = "Drag to turn, right button or two fingers to move, wheel or pinch to zoom; point at a part to read it, click to select it.";
  return h(
    "dialog",
    { class: "fx-help", "aria-label": "keys" },
    h("div", { class: "fx-heading" }, "Keys"),
    h("dl", {}, ...rows),
    h("p", {}, mouse),
    h("button", { type: "button", class: "fx-button fx-text", click: close }, "close"),
  );
}
