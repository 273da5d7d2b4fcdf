/** Curves as SVG paths. */

import type { Curve, Marker, Values } from "./data";
import { at } from "./data";
import type { Scale, Span } from "./scale";
import { toPixel } from "./scale";

/** First index and one past the last of those in a span, with one neighbour on each side. */
export function visible(x: Values, span: Span): [number, number] {
  const last = x.length;
  let first = lowest(x, span.low);
  let end = lowest(x, span.high);
  first = Math.max(0, first - 1);
  end = Math.min(last, end + 2);
  return [first, end];
}

/** First index with a value of at least `value`; values ascend. */
function lowest(x: Values, value: number): number {
  let [low, high] = [0, x.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (at(x, middle) < value) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

/** Index of the value nearest to `value` on the scale. */
export function nearest(x: Values, value: number, log: boolean): number {
  const k = lowest(x, value);
  if (k === 0 || k === x.length) {
    return Math.min(k, x.length - 1);
  }
  const [below, above] = [at(x, k - 1), at(x, k)];
  const lower = log ? value / below <= above / value : value - below <= above - value;
  return lower ? k - 1 : k;
}

/** Least and largest value in view. */
export function extent(curve: Curve, x: Values, span: Span, log: boolean): Span {
  const [first, end] = visible(curve.x ?? x, span);
  let [low, high] = [Infinity, -Infinity];
  for (const values of curve.upper ? [curve.values, curve.upper] : [curve.values]) {
    for (let k = first; k < end; k += 1) {
      const value = at(values, k);
      if (Number.isFinite(value) && (!log || value > 0)) {
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    }
  }
  return { low, high };
}

/** The path of a curve, or of the outline of a band. */
export function pathOf(curve: Curve, values: Values, x: Scale, y: Scale): string {
  const own = curve.x ?? values;
  const marker = markerOf(curve);
  if (marker) {
    return placesOf(curve, values, x, y).map(([px, py]) => `M${short(px)},${short(py)}${marker}`).join("");
  }
  const path = line(own, curve.values, x, y);
  if (curve.style !== "bound" || !curve.upper) {
    return path;
  }
  return band(own, curve.values, curve.upper, x, y);
}

const MARKERS: Record<Marker, string> = {
  dot: "m-1,0h2",
  cross: "m-3,-3l6,6m0,-6l-6,6",
  ring: "m-3.5,0a3.5,3.5 0 1 0 7,0a3.5,3.5 0 1 0 -7,0",
  disc: "m-5,0a5,5 0 1 0 10,0a5,5 0 1 0 -10,0",
};

/** The shape of the points of a curve, if it is one of points. */
export function markerOf(curve: Curve): string | undefined {
  return MARKERS[curve.style as Marker];
}

/** Pixels of the points in view, each with its index. */
export function placesOf(curve: Curve, values: Values, x: Scale, y: Scale): [number, number, number][] {
  const xs = curve.x ?? values;
  const [first, end] = visible(xs, x);
  const found: [number, number, number][] = [];
  for (let k = first; k < end; k += 1) {
    found.push([toPixel(x, at(xs, k)), toPixel(y, at(curve.values, k)), k]);
  }
  return found;
}

function line(xs: Values, values: Values, x: Scale, y: Scale): string {
  const [first, end] = visible(xs, x);
  let [text, open] = ["", false];
  let [column, low, high, last] = [NaN, 0, 0, 0];
  const many = end - first > 3 * Math.abs(x.to - x.from);
  const [top, bottom] = [Math.min(y.from, y.to) - 1e4, Math.max(y.from, y.to) + 1e4];
  for (let k = first; k < end; k += 1) {
    const value = at(values, k);
    const py = Math.min(bottom, Math.max(top, toPixel(y, value)));
    const px = toPixel(x, at(xs, k));
    if (!(Number.isFinite(px) && Number.isFinite(py))) {
      open = false;
      continue;
    }
    if (many && open && Math.round(px) === column) {
      low = Math.min(low, py);
      high = Math.max(high, py);
      last = py;
      continue;
    }
    if (many && open && high > low) {
      text += `V${short(low)}V${short(high)}V${short(last)}`;
    }
    text += `${open ? "L" : "M"}${short(px)},${short(py)}`;
    [open, column, low, high, last] = [true, Math.round(px), py, py, py];
  }
  return high > low ? `${text}V${short(low)}V${short(high)}V${short(last)}` : text;
}

function band(xs: Values, lower: Values, upper: Values, x: Scale, y: Scale): string {
  const [first, end] = visible(xs, x);
  let [there, back] = ["", ""];
  const floor = Math.max(y.from, y.to);
  for (let k = first; k < end; k += 1) {
    const px = short(toPixel(x, at(xs, k)));
    const [a, b] = [toPixel(y, at(lower, k)), toPixel(y, at(upper, k))];
    if (Number.isFinite(b)) {
      there += `${there ? "L" : "M"}${px},${short(b)}`;
      back = `L${px},${short(Number.isFinite(a) ? a : floor)}${back}`;
    }
  }
  return there ? `${there}${back}Z` : "";
}

function short(pixel: number): string {
  return String(Math.round(pixel * 10) / 10);
}
