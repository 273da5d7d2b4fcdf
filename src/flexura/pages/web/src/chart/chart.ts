/** A chart that zooms and reads out: SVG above, its legend with values below. */

import css from "./chart.css";
import type { Chart, ChartData } from "./data";
import { at } from "./data";
import { gestures, type Moves } from "./gestures";
import type { Layout } from "./layout";
import { Legend } from "./legend";
import { Painter } from "./painter";
import { markerOf, nearest, placesOf } from "./paths";
import { along, share, type Span, toPixel, toValue } from "./scale";
import { set, svg } from "./svg";

/** Told which point of a curve of points was chosen. */
export type Chosen = (curve: string, index: number) => void;

/** Pixels from a point at which it is chosen. */
const NEAR = 9;

/** Least part of the whole axis that a view holds. */
const CLOSEST = 1e-4;
const HINT = "drag to zoom, double-click to reset; arrow keys read values, + and - zoom, 0 resets";

/** Put a chart into an element; `chart-live` is a class of it then, for a page to hide what it shows without scripts. */
export function mountChart(host: HTMLElement, data: ChartData, chosen?: Chosen): Chart {
  const root = host.getRootNode();
  const styled = root instanceof ShadowRoot ? root : document.head;
  if (!styled.querySelector("style[data-chart]")) {
    const style = document.createElement("style");
    style.dataset.chart = "";
    style.textContent = css;
    styled.append(style);
  }
  return new Plot(host, data, chosen);
}

class Plot implements Chart, Moves {
  private readonly root = document.createElement("div");
  private readonly plot = document.createElement("div");
  private readonly said = document.createElement("p");
  private readonly painter = new Painter();
  private readonly legend = new Legend((name) => this.toggle(name));
  private readonly hair = svg("path", { class: "chart-hair", d: "" });
  private readonly swept = svg("rect", { class: "chart-brush", visibility: "hidden" });
  private readonly reset_ = button("reset", "reset: show the whole axis", () => this.reset());
  private readonly hidden = new Set<string>();
  private readonly sizes = new ResizeObserver(() => this.resized());
  private readonly listening: () => void;
  private laid!: Layout;
  private width = 0;
  /** Of the axis in shares of its whole, so that it stays where other data come. */
  private view: Span = { low: 0, high: 1 };
  private hairAt: number | null = null;

  constructor(
    private readonly host: HTMLElement,
    private data: ChartData,
    private readonly chosen?: Chosen,
  ) {
    this.root.className = "chart";
    this.plot.className = "chart-area";
    set(this.plot, { tabindex: 0, role: "group", "aria-roledescription": "chart" });
    this.painter.over.append(this.swept, this.hair);
    this.plot.append(this.painter.element);
    this.said.className = "chart-said";
    set(this.said, { role: "status" });
    const tools = document.createElement("div");
    tools.className = "chart-tools";
    const hint = document.createElement("span");
    hint.className = "chart-hint";
    hint.textContent = HINT;
    tools.append(
      button("+", "zoom in", () => this.zoom(1 / 1.5, NaN)),
      button("−", "zoom out", () => this.zoom(1.5, NaN)),
      this.reset_,
      hint,
    );
    this.root.append(this.plot, tools, this.legend.element, this.said);
    host.append(this.root);
    host.classList.add("chart-live");
    this.listening = gestures(this.plot, this);
    this.sizes.observe(this.plot);
    this.width = this.plot.clientWidth;
    this.update(data);
  }

  update(data: ChartData): void {
    this.data = data;
    set(this.plot, { "aria-label": [data.title, data.description, HINT].filter(Boolean).join(". ") });
    this.legend.show(data, this.hidden);
    this.paint();
  }

  dispose(): void {
    this.listening();
    this.sizes.disconnect();
    this.host.classList.remove("chart-live");
    this.root.remove();
  }

  zoom(factor: number, pixel: number): void {
    const { low, high } = this.view;
    const middle = this.hairAt === null ? (low + high) / 2 : this.shareOf(this.hairAt);
    const about = Number.isFinite(pixel) ? this.shareOf(toValue(this.laid.x, pixel)) : middle;
    this.see(about + (low - about) * factor, about + (high - about) * factor);
  }

  pan(pixels: number): void {
    const { low, high } = this.view;
    const by = (-pixels * (high - low)) / (this.laid.right - this.laid.left);
    const kept = Math.max(-low, Math.min(1 - high, by));
    this.see(low + kept, high + kept);
  }

  select(from: number, to: number): void {
    const [a, b] = [from, to].map((pixel) => this.shareOf(toValue(this.laid.x, pixel))) as [number, number];
    this.see(Math.min(a, b), Math.max(a, b));
  }

  reset(): void {
    this.see(0, 1);
  }

  read(pixel: number | null): void {
    if (pixel === null || !this.data.x.values.length) {
      this.hairAt = null;
    } else {
      const inside = Math.max(this.laid.left, Math.min(this.laid.right, pixel));
      this.hairAt = at(this.data.x.values, nearest(this.data.x.values, toValue(this.laid.x, inside), this.data.x.log));
    }
    this.hairDrawn();
  }

  step(points: number): void {
    const { values, log } = this.data.x;
    if (!values.length) {
      return;
    }
    const { low, high } = this.laid.x;
    const start = this.hairAt ?? along({ low, high, log }, 0.5);
    const k = nearest(values, start, log) + (this.hairAt === null ? 0 : points);
    this.hairAt = at(values, Math.max(0, Math.min(values.length - 1, k)));
    const place = this.shareOf(this.hairAt);
    if (place < this.view.low || place > this.view.high) {
      const half = (this.view.high - this.view.low) / 2;
      this.see(place - half, place + half);
    }
    this.said.textContent = this.hairDrawn();
  }

  choose(x: number, y: number): void {
    if (!this.chosen) {
      return;
    }
    const atHair = Number.isNaN(x);
    const own = atHair ? (this.hairAt === null ? NaN : toPixel(this.laid.x, this.hairAt)) : x;
    let [best, found]: [number, [string, number] | null] = [NEAR, null];
    this.data.panels.forEach((panel, k) => {
      for (const curve of panel.curves.filter((each) => markerOf(each) && !this.hidden.has(each.name))) {
        for (const [px, py, index] of placesOf(curve, this.data.x.values, this.laid.x, this.laid.panels[k]!.y)) {
          const away = Math.hypot(px - own, atHair ? py / 1e4 : py - y); // at the crosshair the highest of those near it
          if (away <= best) {
            [best, found] = [away, [curve.name, index]];
          }
        }
      }
    });
    if (found) {
      this.chosen(...(found as [string, number]));
    }
  }

  brush(from: number, to: number | null): void {
    if (to === null) {
      set(this.swept, { visibility: "hidden" });
      return;
    }
    const [a, b] = [Math.max(this.laid.left, Math.min(from, to)), Math.min(this.laid.right, Math.max(from, to))];
    const top = this.laid.panels[0]?.top ?? 0;
    const height = (this.laid.panels.at(-1)?.bottom ?? 0) - top;
    set(this.swept, { x: a, y: top, width: Math.max(0, b - a), height, visibility: "visible" });
  }

  private toggle(name: string): void {
    if (!this.hidden.delete(name)) {
      this.hidden.add(name);
    }
    this.update(this.data);
  }

  private resized(): void {
    if (this.plot.clientWidth && this.plot.clientWidth !== this.width) {
      this.width = this.plot.clientWidth;
      this.paint();
    }
  }

  /** See a part of the axis, in shares of its whole. */
  private see(low: number, high: number): void {
    let [a, b] = [Math.max(0, low), Math.min(1, high)];
    if (b - a < CLOSEST) {
      const middle = Math.min(1 - CLOSEST / 2, Math.max(CLOSEST / 2, (a + b) / 2));
      [a, b] = [middle - CLOSEST / 2, middle + CLOSEST / 2];
    }
    this.view = { low: a, high: b };
    this.paint();
  }

  private whole(): Span & { log: boolean } {
    const { values, log } = this.data.x;
    const [low, high] = values.length ? [at(values, 0), at(values, values.length - 1)] : log ? [1, 10] : [0, 1];
    return low < high ? { low, high, log } : { low: low - (log ? low / 2 : 0.5), high: low + 0.5, log };
  }

  private shareOf(value: number): number {
    return share(this.whole(), value);
  }

  private paint(): void {
    const whole = this.whole();
    const view = { low: along(whole, this.view.low), high: along(whole, this.view.high) };
    this.laid = this.painter.paint(this.data, Math.max(240, this.width), view, this.hidden);
    this.reset_.disabled = this.view.low <= 0 && this.view.high >= 1;
    this.hairDrawn();
  }

  private hairDrawn(): string {
    const x = this.hairAt;
    const inView = x !== null && x >= this.laid.x.low && x <= this.laid.x.high;
    const pixel = x === null ? 0 : toPixel(this.laid.x, x);
    set(this.hair, { d: inView ? this.laid.panels.map((p) => `M${pixel},${p.top}V${p.bottom}`).join("") : "" });
    return this.legend.read(this.data, x);
  }
}

function button(text: string, label: string, act: () => void): HTMLButtonElement {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  set(made, { "aria-label": label, title: label });
  made.addEventListener("click", act);
  return made;
}
