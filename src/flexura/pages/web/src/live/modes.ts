import { h } from "../viewer/dom";
import type { Row } from "./protocol";
import { difference } from "./scale";

/** A design that others are compared with. */
export interface Pin {
  label: string;
  hz: Map<number, number>;
}

const LIKE = 0.7;

/** Frequencies with their proof, a row for each mode, which keeps it through crossings. */
export class ModeTable {
  private readonly table = h("table", { class: "live-modes" });
  private readonly note = h("p", { class: "soft" });
  private texts: Record<string, string> = {};
  private rows: Row[] = [];
  private pins: Pin[] = [];
  private shown = 0;

  constructor(
    host: HTMLElement,
    private readonly choose: (mode: number) => void,
  ) {
    host.append(h("h2", {}, "Natural frequencies"), h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "natural frequencies" }, this.table), this.note);
  }

  update(rows: Row[], shown: number, pins: Pin[]): void {
    this.rows = rows;
    this.shown = shown;
    this.pins = pins;
    this.draw();
  }

  tell(texts: Record<string, string>): void {
    this.texts = texts;
    this.draw();
  }

  private draw(): void {
    const focused = document.activeElement instanceof HTMLInputElement && this.table.contains(document.activeElement);
    const heads = ["mode", "Hz", "proven", ...this.pins.map((pin) => `to ${pin.label}`)];
    const ordered = this.rows.map((row, k) => ({ row, place: k + 1 })).sort((a, b) => a.row.mode - b.row.mode);
    this.table.replaceChildren(
      h("thead", {}, h("tr", {}, ...heads.map((text) => h("th", { scope: "col" }, text)))),
      ...ordered.map(({ row, place }) => this.group(row, place)),
    );
    if (focused) this.table.querySelector<HTMLInputElement>("input:checked")?.focus();
    const doubtful = this.rows.filter((row) => row.like < LIKE).map((row) => row.mode);
    const wide = this.rows.filter((row) => row.wide).map((row) => row.mode);
    const said = [
      wide.length ? `Not proven to 0.1 %: ${list(wide)}; the intervals say how far they are known.` : "",
      doubtful.length ? `Shapes changed so much that ${list(doubtful)} may be another one than before.` : "",
    ];
    this.note.textContent = said.filter(Boolean).join(" ");
    this.note.classList.toggle("warning", wide.length + doubtful.length > 0);
  }

  /** Two lines of a mode: its numbers, and what moves in it. */
  private group(row: Row, place: number): HTMLElement {
    const radio = h("input", { type: "radio", name: "live-mode", value: row.mode, change: () => this.choose(row.mode), "aria-label": `show mode ${row.mode}` });
    radio.checked = row.mode === this.shown;
    const label = h("label", {}, radio, ` ${row.mode}`, place === row.mode ? null : h("span", { class: "soft" }, ` now no. ${place}`));
    const line = h(
      "tr",
      {},
      h("td", {}, label),
      h("td", { class: "number live-hz" }, row.text),
      h("td", { title: row.interval, class: row.wide ? "warning" : "" }, row.proof),
      ...this.pins.map((pin) => {
        const then = pin.hz.get(row.mode);
        return h("td", { class: "number" }, then === undefined ? "new" : difference(row.hz, then));
      }),
    );
    const moves = h("tr", {}, h("td", { colspan: 3 + this.pins.length, class: "soft" }, this.texts[String(row.mode)] ?? ""));
    return h("tbody", { "data-mode": row.mode, class: radio.checked ? "live-shown" : "" }, line, moves);
  }
}

function list(modes: number[]): string {
  return `mode${modes.length > 1 ? "s" : ""} ${modes.join(", ")}`;
}
