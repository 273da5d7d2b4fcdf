import { h } from "../viewer/dom";
import type { Values } from "./history";
import type { Pin } from "./modes";
import type { Curves } from "./response";

const MOST = 4;

/** A design that was pinned: its values, frequencies and response. */
export interface Pinned extends Pin {
  values: Values;
  curves: Curves | null;
}

/** Designs to compare with. */
export class Pins {
  list: Pinned[] = [];
  private count = 0;

  constructor(
    private readonly host: HTMLElement,
    private readonly go: (values: Values) => void,
    private readonly changed: () => void,
  ) {}

  get isFull(): boolean {
    return this.list.length >= MOST;
  }

  add(values: Values, hz: Map<number, number>, curves: Curves | null): void {
    if (this.isFull) return;
    this.list.push({ label: String.fromCharCode(65 + (this.count++ % 26)), values, hz, curves });
    this.draw();
  }

  private draw(): void {
    this.host.replaceChildren(
      ...this.list.map((pin) => {
        const texts = Object.entries(pin.values).map(([name, value]) => `${name} = ${value}`);
        const title = texts.join(", ") || "as the file has it";
        return h(
          "span",
          { class: "live-pin", title },
          h("button", { type: "button", "aria-label": `go to ${pin.label}: ${title}`, click: () => this.go(pin.values) }, pin.label),
          h("button", { type: "button", "aria-label": `remove ${pin.label}`, click: () => this.remove(pin) }, "×"),
        );
      }),
    );
    this.changed();
  }

  private remove(pin: Pinned): void {
    this.list = this.list.filter((own) => own !== pin);
    this.draw();
  }
}
