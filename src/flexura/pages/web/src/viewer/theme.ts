import { Color } from "three";

/** Colours of the picture: RGB or RGBA, 0 to 1. */
export interface Theme {
  background: string;
  ink: string;
  edge: number[];
  edgeThrough: number[]; // where the background shines through
  ghost: number[];
  accent: number[];
  unknown: number[];
  cut: number[];
  axis: number[];
  arrow: number[];
}

function rgb(colour: string, alpha?: number): number[] {
  const parts = new Color(colour).convertLinearToSRGB().toArray();
  return alpha === undefined ? parts : [...parts, alpha];
}

const LIGHT: Theme = {
  background: "#f4f6f8",
  ink: "#1c2126",
  edge: rgb("#14181d", 0.62),
  edgeThrough: rgb("#14181d", 0.62),
  ghost: rgb("#5c6773", 0.55),
  accent: rgb("#e0007a", 1),
  unknown: rgb("#a6a9ad"),
  cut: rgb("#8a2f1d"),
  axis: rgb("#8a1fb8", 1),
  arrow: rgb("#0b6b57", 1),
};

const DARK: Theme = {
  background: "#15191e",
  ink: "#e6eaee",
  edge: rgb("#05070a", 0.75),
  edgeThrough: rgb("#aeb8c4", 0.5),
  ghost: rgb("#9aa7b4", 0.5),
  accent: rgb("#ff5fb0", 1),
  unknown: rgb("#7d8186"),
  cut: rgb("#d0644c"),
  axis: rgb("#d08bf0", 1),
  arrow: rgb("#4fd0b0", 1),
};

export function theme(dark: boolean): Theme {
  return dark ? DARK : LIGHT;
}

/** Whether the page around an element is dark: what the page says of itself, else what the system prefers. */
export function isDark(element: Element): boolean {
  const said = element.closest<HTMLElement>("[data-theme]:not(.fx-viewer)")?.dataset.theme ?? document.documentElement.dataset.theme;
  if (said === "dark" || said === "light") return said === "dark";
  const body = document.body;
  if (body.dataset.jpThemeLight !== undefined) return body.dataset.jpThemeLight === "false";
  if (body.dataset.vscodeThemeKind !== undefined) return /dark|high-contrast$/.test(body.dataset.vscodeThemeKind);
  if (body.classList.contains("dark") || document.documentElement.classList.contains("dark")) return true;
  return matchMedia("(prefers-color-scheme: dark)").matches;
}

/** Say so whenever the page may have become dark or light; returns how to stop. */
export function watchTheme(changed: () => void): () => void {
  const query = matchMedia("(prefers-color-scheme: dark)");
  query.addEventListener("change", changed);
  const observer = new MutationObserver(changed);
  for (const element of [document.documentElement, document.body])
    observer.observe(element, { attributes: true, attributeFilter: ["data-theme", "class", "data-jp-theme-light", "data-vscode-theme-kind"] });
  return () => {
    query.removeEventListener("change", changed);
    observer.disconnect();
  };
}
