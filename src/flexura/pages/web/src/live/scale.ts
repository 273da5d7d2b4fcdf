import { number } from "../numbers";
import type { Slider } from "./protocol";

/** Positions of a slider from one end to the other. */
export const POSITIONS = 1000;
const DIGITS = 4;

type Range = Pick<Slider, "low" | "high" | "is_log">;

/** Position of a number between the ends, 0 to POSITIONS. */
export function positionOf(range: Range, value: number): number {
  const { low, high } = range;
  const share = range.is_log && low > 0 && value > 0 ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  return Math.min(POSITIONS, Math.max(0, Number.isFinite(share) ? share * POSITIONS : 0));
}

/** The round number at a position. */
export function valueAt(range: Range, position: number): number {
  const { low, high } = range;
  if (position <= 0) return low;
  if (position >= POSITIONS) return high;
  const share = position / POSITIONS;
  if (range.is_log && low > 0) return Number((low * (high / low) ** share).toPrecision(DIGITS));
  const step = 10 ** Math.floor(Math.log10((high - low) / POSITIONS));
  const rounded = Math.round((low + (high - low) * share) / step) * step;
  return Number(rounded.toPrecision(12));
}

/** A number as it is typed: at most nine digits. */
export function written(value: number): string {
  return number(value, 9);
}

/** The number of a text, with or without the unit behind it; NaN where it is none. */
export function readNumber(text: string, unit: string): number {
  const own = text.trim().replace(/\s+/g, " ");
  const bare = unit && own.endsWith(unit) ? own.slice(0, -unit.length).trim() : own;
  const plain = bare.replace(/^([-+]?\d*),(\d+)$/, "$1.$2");
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
}

/** How much more one number is than another, in words. */
export function difference(now: number, then: number): string {
  if (then === 0 || !Number.isFinite(then)) return now === then ? "0 %" : "";
  const percent = 100 * (now / then - 1);
  if (Math.abs(percent) < 0.005) return "0 %";
  return `${percent > 0 ? "+" : "−"}${number(Math.abs(percent), 3)} %`;
}
