// A sequential map of even steps in lightness (0.30 to 0.95 of OKLCH), from deep blue over teal to pale yellow.

import type { Triple } from "../scene";

const STOPS = 256;

function rgbOfOklch(l: number, c: number, h: number): Triple {
  const a = c * Math.cos((h * Math.PI) / 180);
  const b = c * Math.sin((h * Math.PI) / 180);
  const x = (l + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const y = (l - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const z = (l - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const linear = [
    4.0767416621 * x - 3.3077115913 * y + 0.2309699292 * z,
    -1.2684380046 * x + 2.6097574011 * y - 0.3413193965 * z,
    -0.0041960863 * x - 0.7034186147 * y + 1.707614701 * z,
  ];
  const shown = linear.map((s) => (s <= 0.0031308 ? 12.92 * s : 1.055 * s ** (1 / 2.4) - 0.055));
  return shown.map((s) => Math.round(255 * Math.min(Math.max(s, 0), 1))) as Triple;
}

function stop(share: number): Triple {
  const l = 0.3 + 0.65 * share;
  const h = 280 - 175 * share;
  const c = 0.11 - 0.03 * Math.sin(Math.PI * share) + 0.03 * share;
  return rgbOfOklch(l, c, h);
}

/** (256, 4), 0 to 255. */
export const MAP = new Uint8Array(Array.from({ length: STOPS }, (_, k) => [...stop(k / (STOPS - 1)), 255]).flat());

/** The map as a gradient of a style sheet. */
export function gradient(direction: string): string {
  const stops = Array.from({ length: 17 }, (_, k) => `rgb(${stop(k / 16).join(" ")})`);
  return `linear-gradient(${direction}, ${stops.join(", ")})`;
}
