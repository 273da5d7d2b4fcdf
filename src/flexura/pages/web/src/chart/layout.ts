/** Where things are: panels, margins, and labels of marks that do not collide. */

import type { ChartData, Mark } from "./data";
import type { Scale, Span, Tick } from "./scale";
import { ticks, toPixel } from "./scale";

export const TEXT = 11;
/** Width of a character over the size of the text, on average. */
export const CHARACTER = 0.56;
export const LINE = 15;
const [TALL, LOW] = [210, 120];
const RIGHT = 14;
const BOTTOM = 40;
/** Rows of labels above the first panel. */
export const ROWS = 3;

export interface PanelBox {
  top: number;
  bottom: number;
  y: Scale;
  ticks: Tick[];
}

export interface Placed {
  x: number;
  /** Left end and baseline of the label; null where there is no room for it. */
  label: { text: string; left: number; y: number } | null;
}

export interface Layout {
  width: number;
  height: number;
  left: number;
  right: number;
  x: Scale;
  xTicks: Tick[];
  panels: PanelBox[];
  marks: Placed[];
}

export function textWidth(text: string): number {
  return text.length * TEXT * CHARACTER;
}

/** The layout for a width in pixels, with the ends of all axes. */
export function layout(data: ChartData, width: number, x: Span, ys: Span[], marks: Mark[]): Layout {
  const heights = data.panels.map((panel, k) => (k ? LOW : TALL) * (panel.weight ?? 1));
  const yTicks = data.panels.map((panel, k) => ticks(ys[k]!.low, ys[k]!.high, panel.log, heights[k]! / 26, panel.unit));
  const widest = Math.max(...yTicks.flat().map((tick) => textWidth(tick.text)), 20);
  const [left, right] = [Math.ceil(widest) + 12, width - RIGHT];
  const scale: Scale = { ...x, log: data.x.log, from: left, to: right };
  const strip = marks.length ? ROWS * LINE + 4 : 0;
  const panels: PanelBox[] = [];
  let y = 0;
  data.panels.forEach((panel, k) => {
    const top = y + LINE + 5 + (k ? 0 : strip);
    const bottom = top + heights[k]!;
    panels.push({ top, bottom, y: { ...ys[k]!, log: panel.log, from: bottom, to: top }, ticks: yTicks[k]! });
    y = bottom + 6;
  });
  const shown = marks.filter((mark) => mark.x >= x.low && mark.x <= x.high);
  const placed = placedMarks(shown, scale, panels[0]?.top ?? 0);
  const xTicks = ticks(x.low, x.high, data.x.log, (right - left) / 60, data.x.unit);
  return { width, height: y - 6 + BOTTOM, left, right, x: scale, xTicks, panels, marks: placed };
}

/** Marks with their labels, all short where this lets more of them be there. */
function placedMarks(marks: Mark[], scale: Scale, bottom: number): Placed[] {
  const long = inRows(marks, (mark) => [mark.label, mark.short ?? ""], scale, bottom);
  const short = long.every((own) => own.label) ? long : inRows(marks, (mark) => [mark.short ?? mark.label], scale, bottom);
  return labels(short) > labels(long) ? short : long;
}

function labels(placed: Placed[]): number {
  return placed.filter((own) => own.label).length;
}

/** Labels in rows above the plot, from the right: each in the lowest row that has room, none over a line to another. */
function inRows(marks: Mark[], textsOf: (mark: Mark) => string[], scale: Scale, bottom: number): Placed[] {
  const starts = new Array<number>(ROWS).fill(scale.to + RIGHT);
  const found = [...marks].reverse().map((mark): Placed => {
    const x = toPixel(scale, mark.x);
    for (const text of textsOf(mark)) {
      const wide = textWidth(text) + 6;
      const row = starts.findIndex((start, k) => x + wide <= start && starts.slice(0, k).every((below) => below >= x));
      if (text && row >= 0) {
        starts.fill(x, 0, row + 1);
        return { x, label: { text, left: x + 2, y: bottom - 5 - row * LINE } };
      }
    }
    return { x, label: null };
  });
  return found.reverse();
}
