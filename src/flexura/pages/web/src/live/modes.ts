import { h } from "../viewer/dom";
import type { ModelErrors, Numbers, Row } from "./protocol";
import { difference } from "./scale";

/** A design that others are compared with. */
export interface Pin {
  label: string;
  hz: Map<number, number>;
}

const LIKE = 0.7;

/** What the two margins of a frequency are of. */
const MARGINS: Record<string, string> = {
  proven: "numerics: how near the number is to that of the description",
  "model error": "physics: how far the frequency of the part may be from the number; in italics, of the design before",
};

/** Write a text where it is another one. */
function write(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** Two lines of a mode: its numbers, and what moves in it. */
class Lines {
  readonly body: HTMLElement;
  private readonly radio: HTMLInputElement;
  private readonly place = h("span", { class: "soft" });
  private readonly hz = h("td", { class: "number live-hz" });
  private readonly proof = h("td", {});
  private readonly error = h("td", { class: "live-error" });
  private readonly line: HTMLElement;
  private readonly moves = h("td", { class: "soft" });
  private differences: HTMLElement[] = [];

  constructor(
    readonly mode: number,
    choose: (mode: number) => void,
  ) {
    this.radio = h("input", { type: "radio", name: "live-mode", value: mode, change: () => choose(mode), "aria-label": `show mode ${mode}` });
    this.line = h("tr", {}, h("td", {}, h("label", {}, this.radio, ` ${mode}`, this.place)), this.hz, this.proof, this.error);
    this.body = h("tbody", { "data-mode": mode }, this.line, h("tr", {}, this.moves));
  }

  /** Say how far the part may be, of this design or of the one before. */
  doubt(error: { text: string; why: string } | undefined, isOwn: boolean): void {
    write(this.error, error?.text ?? "");
    this.error.title = error ? `${isOwn ? "" : "of the design before. "}${error.why}` : "";
    this.error.classList.toggle("live-before", !isOwn);
  }

  show(row: Row, place: number, shown: boolean, pins: Pin[], moves: string): void {
    write(this.place, place === row.mode ? "" : ` now no. ${place}`);
    write(this.hz, row.text);
    write(this.proof, row.proof);
    this.proof.title = row.interval;
    this.proof.className = row.flag ? "warning" : "";
    write(this.moves, moves);
    if (this.radio.checked !== shown) this.radio.checked = shown;
    this.body.classList.toggle("live-shown", shown);
    if (this.differences.length !== pins.length) {
      for (const cell of this.differences) cell.remove();
      this.differences = pins.map(() => h("td", { class: "number" }));
      this.line.append(...this.differences);
    }
    this.moves.colSpan = 4 + pins.length;
    pins.forEach((pin, k) => {
      const then = pin.hz.get(row.mode);
      write(this.differences[k], then === undefined ? "new" : difference(row.hz, then));
    });
  }
}

/** Frequencies with their proof, lines for each mode, which keeps them through crossings; rigid motions are folded. */
export class ModeTable {
  private readonly heads = h("tr", {});
  private readonly fold = h("button", { type: "button", "aria-expanded": "false", click: () => this.unfold() });
  private readonly folded = h("tbody", { class: "live-rigid", hidden: true }, h("tr", {}, h("td", { colspan: 99 }, this.fold)));
  private readonly table = h("table", { class: "live-modes" }, h("thead", {}, this.heads), this.folded);
  private readonly note = h("p", { class: "soft" });
  private lines = new Map<number, Lines>();
  private texts: Record<string, string> = {};
  private errors: ModelErrors = { type: "model errors", serial: -1, errors: {} };
  private serial = 0;
  private rows: Row[] = [];
  private pins: Pin[] = [];
  private shown = 0;
  private isFolded = true;

  constructor(
    host: HTMLElement,
    private readonly choose: (mode: number) => void,
  ) {
    host.append(h("h2", {}, "Natural frequencies"), h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "natural frequencies" }, this.table), this.note);
  }

  update({ rows, shown, serial }: Numbers, pins: Pin[]): void {
    this.rows = rows;
    this.shown = shown;
    this.serial = serial;
    this.pins = pins;
    this.draw();
  }

  tell(texts: Record<string, string>): void {
    this.texts = texts;
    this.draw();
  }

  doubt(errors: ModelErrors): void {
    this.errors = errors;
    this.draw();
  }

  private unfold(): void {
    this.isFolded = !this.isFolded;
    this.draw();
  }

  private draw(): void {
    const heads = ["mode", "Hz", "proven", "model error", ...this.pins.map((pin) => `to ${pin.label}`)];
    if (this.heads.childElementCount !== heads.length) this.heads.replaceChildren(...heads.map(() => h("th", { scope: "col" })));
    heads.forEach((text, k) => {
      const head = this.heads.children[k] as HTMLElement;
      write(head, text);
      head.title = MARGINS[text] ?? "";
    });
    const rigid = this.rows.filter((row) => row.rigid);
    this.folded.hidden = rigid.length < 2;
    write(this.fold, `${this.isFolded ? "▸" : "▾"} ${rigid.length} rigid motions`);
    this.fold.setAttribute("aria-expanded", String(!this.isFolded));
    const ordered = this.rows.map((row, k) => ({ row, place: k + 1 })).sort((a, b) => a.row.mode - b.row.mode);
    this.order(ordered.map(({ row }) => row.mode));
    for (const { row, place } of ordered) {
      const lines = this.lines.get(row.mode) as Lines;
      lines.show(row, place, row.mode === this.shown, this.pins, this.texts[String(row.mode)] ?? "");
      lines.doubt(this.errors.errors[String(row.mode)], this.errors.serial === this.serial);
      lines.body.hidden = row.rigid && rigid.length > 1 && this.isFolded && row.mode !== this.shown;
    }
    this.warn();
  }

  /** Have lines for these modes in this order. */
  private order(modes: number[]): void {
    if (modes.join() === [...this.lines.keys()].join()) return;
    const kept = new Map(modes.map((mode) => [mode, this.lines.get(mode) ?? new Lines(mode, this.choose)]));
    for (const [mode, own] of this.lines) if (!kept.has(mode)) own.body.remove();
    this.lines = kept;
    this.table.append(...[...kept.values()].map((own) => own.body));
  }

  private warn(): void {
    const doubtful = this.rows.filter((row) => !row.rigid && row.like < LIKE).map((row) => row.mode);
    const wide = this.rows.filter((row) => row.flag).map((row) => `mode ${row.mode} is ${row.flag}`);
    const said = [
      wide.length ? `${wide.join("; ")}.` : "",
      doubtful.length ? `Shapes changed so much that ${list(doubtful)} may be another one than before.` : "",
    ];
    const text = said.filter(Boolean).join(" ");
    write(this.note, text.charAt(0).toUpperCase() + text.slice(1));
    this.note.classList.toggle("warning", wide.length + doubtful.length > 0);
  }
}

function list(modes: number[]): string {
  return `mode${modes.length > 1 ? "s" : ""} ${modes.join(", ")}`;
}
