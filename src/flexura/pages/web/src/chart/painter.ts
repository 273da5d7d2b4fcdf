/** Draws the layout of a chart into one SVG element, and redraws it in place. */

import type { ChartData, Curve } from "./data";
import { marksOf, namesOf } from "./data";
import type { Layout } from "./layout";
import { layout, LINE } from "./layout";
import { extent, pathOf } from "./paths";
import type { Span } from "./scale";
import { roomy, toPixel } from "./scale";
import { Pool, set, svg } from "./svg";

export const COLOURS = 8;

/** The class of a curve: its colour, the same in all panels and in the legend. */
export function curveClass(data: ChartData, curve: Curve): string {
  const number = namesOf(data).indexOf(curve.name) % COLOURS;
  const style = curve.style === "bound" && curve.upper ? "band" : (curve.style ?? "line");
  return `chart-curve chart-c${number} chart-${style}`;
}

export function axisTitle(axis: { label: string; unit: string }): string {
  return axis.unit ? `${axis.label}, ${axis.unit}` : axis.label;
}

let charts = 0;

export class Painter {
  readonly element = svg("svg", { class: "chart-plot", "aria-hidden": "true", focusable: "false" });
  private readonly id = `chart-clip-${(charts += 1)}`;
  private readonly clips = new Pool(this.element.appendChild(svg("defs")), "clipPath");
  private readonly grid = this.element.appendChild(svg("path", { class: "chart-grid" }));
  private readonly marks = this.element.appendChild(svg("path", { class: "chart-mark" }));
  private readonly curves = new Pool(this.element.appendChild(svg("g")), "path");
  private readonly frame = this.element.appendChild(svg("path", { class: "chart-frame" }));
  private readonly texts = new Pool(this.element.appendChild(svg("g")), "text");
  readonly over = this.element.appendChild(svg("g"));

  /** Draw what is in view; y axes follow it. */
  paint(data: ChartData, width: number, view: Span, hidden: Set<string>): Layout {
    const shown = data.panels.map((panel) => panel.curves.filter((curve) => !hidden.has(curve.name)));
    const ys = data.panels.map((panel, k) => {
      const spans = shown[k]!.map((curve) => extent(curve, data.x.values, view, panel.log));
      return roomy(Math.min(...spans.map((s) => s.low)), Math.max(...spans.map((s) => s.high)), panel.log, panel.unit);
    });
    const found = layout(data, width, view, ys, marksOf(data));
    set(this.element, { viewBox: `0 0 ${width} ${found.height}`, width, height: found.height });
    this.lines(found);
    this.draw(data, found, shown);
    this.words(data, found);
    return found;
  }

  private lines({ panels, left, right, x, xTicks, marks }: Layout): void {
    const horizontal = panels.flatMap((p) => p.ticks.map((tick) => `M${left},${px(toPixel(p.y, tick.value))}H${right}`));
    const vertical = xTicks.flatMap((tick) => panels.map((p) => `M${px(toPixel(x, tick.value))},${p.top}V${p.bottom}`));
    set(this.grid, { d: [...horizontal, ...vertical].join("") });
    set(this.frame, { d: panels.map((p) => `M${left},${p.top}V${p.bottom}H${right}`).join("") });
    const first = panels[0]?.top ?? 0;
    const placed = marks.map(
      (own) =>
        panels.map((p) => `M${px(own.x)},${p.top}V${p.bottom}`).join("") +
        (own.label ? `M${px(own.x)},${first}V${own.label.y + 2}` : ""),
    );
    set(this.marks, { d: placed.join("") });
  }

  private draw(data: ChartData, { panels, left, right, x }: Layout, shown: Curve[][]): void {
    this.clips.begin();
    this.curves.begin();
    panels.forEach((panel, k) => {
      const clip = this.clips.next({ id: `${this.id}-${k}` });
      const inside = { x: left, y: panel.top - 1, width: Math.max(0, right - left), height: panel.bottom - panel.top + 2 };
      set(clip.firstElementChild ?? clip.appendChild(svg("rect")), inside);
      const behind = data.panels[k]!.behind;
      if (behind) {
        const span = roomyOf(behind, data, x);
        const d = pathOf(behind, data.x.values, x, { ...span, log: true, from: panel.bottom, to: panel.top });
        this.curves.next({ d, class: "chart-curve chart-behind", "clip-path": `url(#${this.id}-${k})` });
      }
      for (const curve of shown[k]!) {
        const d = pathOf(curve, data.x.values, x, panel.y);
        this.curves.next({ d, class: curveClass(data, curve), "clip-path": `url(#${this.id}-${k})` });
      }
    });
    this.curves.end();
    this.clips.end();
  }

  private words(data: ChartData, { panels, left, right, x, xTicks, marks, height }: Layout): void {
    const { texts } = this;
    texts.begin();
    data.panels.forEach((own, k) => {
      const panel = panels[k]!;
      const above = k ? panel.top - 6 : LINE - 4;
      texts.next({ x: left, y: above, class: "chart-axis", "text-anchor": "start" }, axisTitle(own));
      for (const tick of panel.ticks) {
        const y = px(toPixel(panel.y, tick.value) + 4);
        texts.next({ x: left - 6, y, class: "chart-tick", "text-anchor": "end" }, tick.text);
      }
    });
    const under = (panels.at(-1)?.bottom ?? 0) + LINE;
    for (const tick of xTicks) {
      texts.next({ x: px(toPixel(x, tick.value)), y: under, class: "chart-tick", "text-anchor": "middle" }, tick.text);
    }
    texts.next({ x: (left + right) / 2, y: height - 6, class: "chart-axis", "text-anchor": "middle" }, axisTitle(data.x));
    for (const { label } of marks) {
      if (label) {
        texts.next({ x: px(label.left), y: label.y, class: "chart-label", "text-anchor": "start" }, label.text);
      }
    }
    texts.end();
  }
}

/** Ends of the scale of what is behind. */
function roomyOf(curve: Curve, data: ChartData, view: Span): Span {
  const { low, high } = extent(curve, data.x.values, view, true);
  return roomy(low, high, true);
}

function px(value: number): number {
  return Math.round(value * 10) / 10;
}
