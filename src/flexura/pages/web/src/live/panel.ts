import { h, unique } from "../viewer/dom";
import type { Values } from "./history";
import type { Slider } from "./protocol";
import { POSITIONS, positionOf, readNumber, valueAt, written } from "./scale";

const MANY = 12;

/** A slider was moved to a number; `resting` says that the hand has let go. */
export type Moved = (name: string, value: number | null, resting: boolean) => void;

/** A parameter: slider, number with its unit, reset, and what is wrong with it. */
class Row {
  readonly element: HTMLElement;
  private readonly range = h("input", { type: "range", min: 0, max: POSITIONS, step: 1, id: unique("slider") });
  private readonly number: HTMLInputElement;
  private readonly reset: HTMLButtonElement;
  private readonly ends = h("span", { class: "live-ends" });
  private readonly problem = h("p", { class: "live-wrong", role: "alert", hidden: true });
  private own: Slider;
  private value: number;

  constructor(slider: Slider, moved: Moved) {
    const { name, unit } = slider;
    this.own = { ...slider };
    this.value = slider.value;
    this.number = h("input", { type: "text", inputmode: "decimal", autocomplete: "off", spellcheck: "false", "aria-label": `${name}${unit ? `, ${unit}` : ""}` });
    const was = `${written(slider.value)} ${unit}`.trim();
    this.reset = h("button", { type: "button", title: `reset to ${was}`, "aria-label": `reset ${name} to ${was}`, click: () => moved(name, null, true) }, "↺");
    const source = slider.source || "no source given";
    this.element = h(
      "div",
      { class: "live-row", title: source, "data-name": name },
      h("label", { for: this.range.id }, name),
      h("span", { class: "live-number" }, this.number, h("span", { class: "live-unit" }, unit)),
      this.reset,
      this.range,
      this.ends,
      this.problem,
    );
    this.range.setAttribute("aria-description", source);
    this.range.addEventListener("input", () => moved(name, valueAt(this.own, Number(this.range.value)), false));
    this.range.addEventListener("change", () => moved(name, this.value, true));
    this.number.addEventListener("change", () => this.typed(moved));
    this.show(null);
  }

  /** Show a number, or that of the file. */
  show(value: number | null): void {
    this.value = value ?? this.own.value;
    const { unit } = this.own;
    const text = written(this.value);
    this.widen();
    this.range.value = String(positionOf(this.own, this.value));
    this.range.setAttribute("aria-valuetext", `${text} ${unit}`.trim());
    this.number.value = text;
    this.reset.disabled = value === null;
    this.element.classList.toggle("live-moved", value !== null);
  }

  bounded(low: number, high: number): void {
    if (low === this.own.low && high === this.own.high) return;
    this.own = { ...this.own, low, high };
    this.range.value = String(positionOf(this.own, this.value));
    this.tellEnds();
  }

  wrong(texts: string[]): void {
    this.problem.hidden = texts.length === 0;
    this.problem.textContent = texts.join("; ");
    this.range.setAttribute("aria-invalid", String(texts.length > 0));
  }

  matches(text: string): boolean {
    return `${this.own.name} ${this.own.source}`.toLowerCase().includes(text.toLowerCase());
  }

  private typed(moved: Moved): void {
    const value = readNumber(this.number.value, this.own.unit);
    if (Number.isNaN(value)) {
      this.wrong([`a number${this.own.unit ? ` in ${this.own.unit}` : ""} is expected, not “${this.number.value.slice(0, 40)}”`]);
      return;
    }
    this.wrong([]);
    moved(this.own.name, value, true);
  }

  /** Ends that are assumed move out of the way of a number that is typed. */
  private widen(): void {
    const { minimum, maximum } = this.own;
    if (!minimum && this.value < this.own.low) this.own.low = this.value;
    if (!maximum && this.value > this.own.high) this.own.high = this.value;
    this.tellEnds();
  }

  private tellEnds(): void {
    const { low, high, unit, minimum, maximum, is_log } = this.own;
    const assumed = minimum && maximum ? "" : minimum ? ", upper end assumed" : maximum ? ", lower end assumed" : ", ends assumed";
    this.ends.textContent = `${written(low)} to ${written(high)} ${unit}`.trim() + (is_log ? ", log" : "") + assumed;
  }
}

/** A parameter that follows from others. */
class Follower {
  readonly element: HTMLElement;
  private readonly output = h("output", {});
  private readonly problem = h("p", { class: "live-wrong", role: "alert", hidden: true });

  constructor(private readonly own: Slider) {
    this.element = h(
      "div",
      { class: "live-follower", title: own.source || "no source given", "data-name": own.name },
      h("span", {}, own.name),
      this.output,
      h("span", { class: "live-ends" }, `= ${own.expression}`),
      this.problem,
    );
    this.follow(own.value);
  }

  follow(value: number): void {
    this.output.textContent = `${written(value)} ${this.own.unit}`.trim();
  }

  wrong(texts: string[]): void {
    this.problem.hidden = texts.length === 0;
    this.problem.textContent = texts.join("; ");
  }
}

/** All parameters, in groups by the first word of their names, with a search where they are many. */
export class Panel {
  private rows = new Map<string, Row>();
  private followers = new Map<string, Follower>();

  constructor(
    private readonly host: HTMLElement,
    private readonly moved: Moved,
  ) {}

  build(sliders: Slider[]): void {
    const open = new Map([...this.host.querySelectorAll("details")].map((own) => [own.dataset.group, own.open]));
    const free = sliders.filter((own) => own.expression === "");
    this.rows = new Map(free.map((own) => [own.name, new Row(own, this.moved)]));
    const dependent = sliders.filter((own) => own.expression !== "");
    this.followers = new Map(dependent.map((own) => [own.name, new Follower(own)]));
    const groups = [...grouped(free.map((own) => own.name))].map(([title, names]) =>
      group(title, names.map((name) => this.rows.get(name)?.element), open.get(title)),
    );
    if (dependent.length) groups.push(group("follow from others", [...this.followers.values()].map((own) => own.element), open.get("follow from others")));
    const search = h("input", { type: "search", class: "live-search", placeholder: "search parameters", "aria-label": "search parameters", input: () => this.search(search.value) });
    const none = sliders.length ? null : h("p", { class: "soft" }, "The file has no parameters: nothing can be moved.");
    this.host.replaceChildren(h("h2", {}, "Parameters"), ...(sliders.length > MANY ? [search] : []), ...(none ? [none] : []), ...groups);
  }

  show(values: Values): void {
    for (const [name, row] of this.rows) row.show(values[name] ?? null);
  }

  follow(derived: Record<string, number>, bounds: Record<string, [number, number]>): void {
    for (const [name, value] of Object.entries(derived)) this.followers.get(name)?.follow(value);
    for (const [name, [low, high]] of Object.entries(bounds)) this.rows.get(name)?.bounded(low, high);
  }

  /** Say what is wrong at the sliders that it is wrong with. */
  wrong(problems: { text: string; sliders: string[] }[]): void {
    for (const [name, row] of [...this.rows, ...this.followers]) {
      row.wrong([...new Set(problems.filter((own) => own.sliders.includes(name)).map((own) => own.text))]);
    }
  }

  private search(text: string): void {
    for (const row of this.rows.values()) row.element.hidden = !row.matches(text);
    for (const own of this.host.querySelectorAll<HTMLDetailsElement>("details")) {
      own.hidden = text !== "" && !own.querySelector(".live-row:not([hidden])");
      if (text !== "") own.open = true;
    }
  }
}

function group(title: string, elements: (HTMLElement | undefined)[], open = true): HTMLElement {
  return h("details", { class: "live-group", "data-group": title, open }, h("summary", {}, title), ...elements);
}

/** Names by their first word, those alone in theirs together. */
function grouped(names: string[]): Map<string, string[]> {
  const found = new Map<string, string[]>();
  const first = (name: string) => name.split(/[_.]/)[0];
  const count = new Map<string, number>();
  for (const name of names) count.set(first(name), (count.get(first(name)) ?? 0) + 1);
  for (const name of names) {
    const title = names.length > MANY / 2 && (count.get(first(name)) ?? 0) > 1 ? first(name) : names.length > MANY / 2 ? "others" : "all";
    found.set(title, [...(found.get(title) ?? []), name]);
  }
  return found;
}
