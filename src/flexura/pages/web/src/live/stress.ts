import { number } from "../numbers";
import { h } from "../viewer/dom";
import type { Load, LoadKind, Opened, Stress } from "./protocol";
import { readNumber } from "./scale";

const WORDS: Record<LoadKind, string> = {
  described: "loads and gravity of the file",
  actuators: "every actuator at its limit",
  move: "a stroke",
};

/** Stress margins: under which loads, how far from yield, and what yields first. */
export class StressPanel {
  private readonly kind = h("select", { "aria-label": "loads" });
  private readonly dof = h("input", { list: "live-outputs", size: 14, "aria-label": "what is moved" });
  private readonly amplitude = h("input", { type: "text", inputmode: "decimal", size: 7, "aria-label": "how far" });
  private readonly unit = h("span", { class: "live-unit" });
  private readonly stroke = h("span", { class: "live-fields" }, this.dof, h("span", {}, "by"), this.amplitude, this.unit);
  private readonly said = h("p", { class: "live-margin" });
  private readonly table = h("table", {});
  private readonly note = h("p", { class: "soft" });
  private opened = false;
  private assumed = false;

  constructor(host: HTMLElement, asks: () => void) {
    for (const field of [this.kind, this.dof, this.amplitude]) {
      field.addEventListener("change", () => {
        if (field !== this.kind) this.assumed = false;
        this.lay();
        asks();
      });
    }
    const scroll = h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "stress margins" }, this.table);
    host.append(h("h2", {}, "Stress margin"), h("div", { class: "live-fields" }, this.kind, this.stroke), this.said, scroll, this.note);
  }

  open(own: Opened): void {
    const chosen = this.opened ? this.kind.value : own.loads[0];
    this.kind.replaceChildren(...own.loads.map((value) => h("option", { value, selected: value === chosen }, WORDS[value])));
    if (!this.opened) {
      this.dof.value = own.stroke.dof;
      this.assumed = own.stroke.assumed;
      this.amplitude.value = number(own.stroke.amplitude / this.factor(), this.assumed ? 2 : 6);
    }
    this.opened = true;
    this.lay();
  }

  /** What is asked for; null where there is nothing to ask. */
  get load(): Load | null {
    const kind = this.kind.value as LoadKind;
    if (kind !== "move") return kind ? { kind } : null;
    const amplitude = readNumber(this.amplitude.value, this.unit.textContent ?? "") * this.factor();
    return Number.isNaN(amplitude) || amplitude === 0 ? null : { kind, dof: this.dof.value.trim(), amplitude };
  }

  update(own: Stress): void {
    const rows = own.rows ?? [];
    const first = rows[0];
    const factor = (value: number | null) => (value === null ? "no stress" : number(value, 3));
    this.said.textContent = own.error ?? (first ? `Factor to yield ${factor(first.factor)}: ${first.member} first, ${first.when || own.when}.` : "No member has a known yield stress.");
    this.said.className = own.error || (first && first.factor !== null && first.factor < 1) ? "live-margin bad" : "live-margin";
    const cell = (text: string) => h("td", { class: "number" }, text);
    const megapascals = (pascals: number) => number(pascals / 1e6, 3);
    this.table.replaceChildren(
      h("thead", {}, h("tr", {}, ...["member", "MPa", "yield MPa", "factor"].map((text) => h("th", { scope: "col" }, text)))),
      h("tbody", {}, ...rows.map((row) => h("tr", {}, h("td", {}, row.member), cell(megapascals(row.stress)), cell(megapascals(row.yield)), cell(factor(row.factor))))),
    );
    this.table.hidden = rows.length === 0;
    const assumed = this.assumed && this.kind.value === "move" ? ["the stroke is assumed, one hundredth of the size: the file has none"] : [];
    this.note.textContent = [...(own.warnings ?? []), ...assumed, ...(own.notes ?? [])].join("; ");
    this.note.className = own.warnings?.length ? "warning" : "soft";
  }

  private get turns(): boolean {
    return /\.r[xyz]$/.test(this.dof.value.trim());
  }

  private factor(): number {
    return this.turns ? Math.PI / 180 : 1e-3;
  }

  private lay(): void {
    this.stroke.hidden = this.kind.value !== "move";
    this.unit.textContent = this.turns ? "deg" : "mm";
    if (this.load === null) {
      this.said.textContent = this.kind.value === "move" ? "Say how far it moves to see what yields first." : "";
      this.table.hidden = true;
      this.note.textContent = "";
    }
  }
}
