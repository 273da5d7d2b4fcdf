/** Numbers for readers, as Python writes them (flexura/tables.py): one function for all of a page but ticks of axes. */

import type { Scales } from "./scene";

/** From here on numbers have a power of ten; below one it begins at a ten thousandth. */
const LONG = 1e7;

/** A number in few digits, with a power of ten only far from one; empty where it is not known. */
export function number(value: number, digits = 5): string {
  if (Number.isNaN(value)) return "";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "-∞";
  const [factor, power] = (value || 0).toExponential(digits - 1).split("e") as [string, string];
  const exponent = Number(power);
  if (exponent >= -4 && (exponent < digits || Math.abs(value) < LONG)) return String(Number(`${factor}e${power}`));
  return `${Number(factor)}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
}

/** SI values in the unit that suits the first, the largest; `unknown` where one is not known. */
export function quantities(values: number[], scales: Scales, digits = 3): string[] {
  const [unit, size] = scales.find(([, own, least]) => (values[0] ? Math.abs(values[0]) >= least : own === 1)) ?? ["", 1];
  return values.map((value) => (Number.isFinite(value) ? `${number(value / size, digits)} ${unit}`.trim() : "unknown"));
}
