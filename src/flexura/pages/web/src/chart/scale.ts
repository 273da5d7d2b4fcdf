/** Axes: values to pixels and back, ticks, and numbers as text. */

export interface Span {
  low: number;
  high: number;
}

export interface Scale extends Span {
  log: boolean;
  /** Pixels of `low` and `high`. */
  from: number;
  to: number;
}

export function toPixel(scale: Scale, value: number): number {
  return scale.from + share(scale, value) * (scale.to - scale.from);
}

export function toValue(scale: Scale, pixel: number): number {
  return along(scale, (pixel - scale.from) / (scale.to - scale.from));
}

/** Where a value is between the ends, 0 to 1. */
export function share({ low, high, log }: { low: number; high: number; log: boolean }, value: number): number {
  return log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
}

/** The value at a share of the way. */
export function along({ low, high, log }: { low: number; high: number; log: boolean }, part: number): number {
  return log ? low * Math.pow(high / low, part) : low + part * (high - low);
}

export interface Tick {
  value: number;
  text: string;
}

const PHASES = [1, 2, 5, 10, 15, 30, 45, 90, 180, 360];

/** Ticks between the ends, at most `most`, with their text. */
export function ticks(low: number, high: number, log: boolean, most: number, unit = ""): Tick[] {
  if (log && high / low >= 4) {
    return logarithmic(low, high, Math.max(2, most));
  }
  const step = niceStep(high - low, Math.max(2, most), unit);
  const found: Tick[] = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) {
    found.push({ value: k * step, text: tickText(k * step, step) });
  }
  return found;
}

/** A step of 1, 2 or 5 times a power of ten, or of usual angles. */
export function niceStep(span: number, most: number, unit = ""): number {
  if (unit === "deg" && span > 10) {
    return PHASES.find((step) => span / step <= most) ?? 360 * Math.ceil(span / 360 / most);
  }
  const ten = Math.pow(10, Math.floor(Math.log10(span / most)));
  return ten * ([1, 2, 5, 10].find((factor) => span / (factor * ten) <= most) ?? 10);
}

function logarithmic(low: number, high: number, most: number): Tick[] {
  const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const decades = Math.log10(high / low);
  const within = 3 * decades <= most ? [1, 2, 5] : [1];
  const every = Math.max(1, Math.ceil(decades / most));
  const found: Tick[] = [];
  for (let power = first; power <= last; power += 1) {
    for (const factor of power % every ? [] : within) {
      const value = factor * Math.pow(10, power);
      if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) {
        found.push({ value, text: plain(value, 6, PLAIN * (1 + 1e-9)) });
      }
    }
  }
  return found;
}

/** Up to here numbers of logarithmic axes are plain; as on paper (chart.py of reports). */
const PLAIN = 1e4;
/** Up to here others are. */
const LONG = 1e6;

function tickText(value: number, step: number): string {
  if (value === 0) {
    return "0";
  }
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return digits > 4 || Math.abs(value) >= LONG ? plain(value) : value.toFixed(digits);
}

/** A plain number, or one with a power of ten where it would be long. */
export function plain(value: number, digits = 6, most = LONG): string {
  if (!Number.isFinite(value)) {
    return "";
  }
  const rounded = Number(value.toPrecision(digits));
  const size = Math.abs(rounded);
  return size === 0 || (size >= 1e-3 && size < most) ? String(rounded) : raised(rounded);
}

/** A number with a power of ten. */
function raised(value: number): string {
  const [factor, power] = Number(value.toPrecision(12)).toExponential().split("e");
  const digits = [...String(Number(power))].map((c) => SUPERSCRIPTS[c] ?? c).join("");
  return factor === "1" ? `10${digits}` : `${factor}·10${digits}`;
}

const SUPERSCRIPTS: Record<string, string> = Object.fromEntries([..."-0123456789"].map((c, k) => [c, "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"[k]!]));

/** Ends that hold all values, with a little room, on round numbers. */
export function roomy(low: number, high: number, log: boolean, unit = ""): Span {
  if (!(low <= high)) {
    return log ? { low: 0.1, high: 10 } : { low: -1, high: 1 };
  }
  if (log) {
    const [a, b] = high / low < 10 ? [low / Math.sqrt(10 / (high / low)), high * Math.sqrt(10 / (high / low))] : [low, high];
    return { low: below(a / 1.05), high: above(b * 1.05) };
  }
  const flat = Math.max(Math.abs(low), Math.abs(high)) || 1;
  const spread = high - low > 1e-9 * flat ? high - low : 0.2 * flat;
  const middle = (low + high) / 2;
  const step = niceStep(1.1 * spread, 5, unit);
  return { low: step * Math.floor((middle - 0.52 * spread) / step), high: step * Math.ceil((middle + 0.52 * spread) / step) };
}

function below(value: number): number {
  const ten = Math.pow(10, Math.floor(Math.log10(value)));
  return ten * (value / ten >= 5 ? 5 : value / ten >= 2 ? 2 : 1);
}

function above(value: number): number {
  const ten = Math.pow(10, Math.floor(Math.log10(value)));
  return ten * (value / ten <= 1 ? 1 : value / ten <= 2 ? 2 : value / ten <= 5 ? 5 : 10);
}
