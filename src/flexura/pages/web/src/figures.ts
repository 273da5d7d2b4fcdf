import { type ChartData, mountChart } from "./chart";
import type { SceneData } from "./scene";
import { type Viewer, mountViewer } from "./viewer";

/** What the figures of a page show, from its script element of data. */
export interface PageData {
  viewer?: Record<string, SceneData>;
  chart?: Record<string, ChartData>;
}

/** Data of the page; empty where it has none. */
export function pageData(): PageData {
  const text = document.getElementById("flexura-data")?.textContent;
  return text ? (JSON.parse(text) as PageData) : {};
}

/** Let every figure move that the page has data for; the viewers by their names. */
export async function upgradeFigures(data: PageData): Promise<Map<string, Viewer>> {
  for (const figure of document.querySelectorAll<HTMLElement>("figure[data-chart]")) {
    const own = data.chart?.[figure.dataset.chart ?? ""];
    if (own) mountChart(figure, own);
  }
  const viewers = new Map<string, Viewer>();
  for (const figure of document.querySelectorAll<HTMLElement>("figure[data-viewer]")) {
    const own = data.viewer?.[figure.dataset.viewer ?? ""];
    if (own) viewers.set(figure.dataset.viewer ?? "", await mountViewer(figure, own, { motion: figure.dataset.motion }));
  }
  return viewers;
}
