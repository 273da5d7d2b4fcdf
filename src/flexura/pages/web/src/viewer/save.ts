import type { Camera } from "three";
import { MAP } from "./colourmap";
import { h } from "./dom";
import { paintTriad } from "./triad";

/** What stands on a saved picture beside the model. */
export interface Caption {
  title: string;
  lines: string[];
  labels: { text: string; x: number; y: number; kind: string }[];
  bar: { title: string; ticks: string[] } | null;
  camera: Camera;
  background: string;
  ink: string;
}

const FOOT = 64; // CSS pixels under the picture
const FONT = "system-ui, sans-serif";

/** The drawn canvas as a picture with its caption, in the pixels of the canvas. */
export function pictureOf(canvas: HTMLCanvasElement, width: number, caption: Caption): HTMLCanvasElement {
  const ratio = canvas.width / width;
  const height = canvas.height / ratio;
  const out = h("canvas", { width: canvas.width, height: Math.round((height + FOOT) * ratio) });
  const context = out.getContext("2d");
  if (!context) throw new Error("no canvas to draw the picture on");
  context.fillStyle = caption.background;
  context.fillRect(0, 0, out.width, out.height);
  context.drawImage(canvas, 0, 0);
  context.scale(ratio, ratio);
  paintTriad(context, caption.camera, 48, height - 48);
  context.textAlign = "left";
  context.textBaseline = "middle";
  for (const label of caption.labels) paintLabel(context, caption, label.text, label.x, label.y);
  if (caption.bar) paintBar(context, caption, caption.bar, width - 150, 24);
  context.fillStyle = caption.ink;
  context.font = `600 16px ${FONT}`;
  context.fillText(caption.title, 16, height + 20);
  context.font = `13px ${FONT}`;
  context.fillText(caption.lines.join("  ·  "), 16, height + 43, width - 32);
  return out;
}

function paintLabel(context: CanvasRenderingContext2D, caption: Caption, text: string, x: number, y: number): void {
  context.font = `12px ${FONT}`;
  const wide = context.measureText(text).width + 12;
  context.fillStyle = caption.background;
  context.fillRect(x, y, wide, 21);
  context.strokeStyle = context.fillStyle = caption.ink;
  context.lineWidth = 1;
  context.strokeRect(x, y, wide, 21);
  context.fillText(text, x + 6, y + 11);
}

function paintBar(context: CanvasRenderingContext2D, caption: Caption, bar: NonNullable<Caption["bar"]>, x: number, y: number): void {
  const [wide, tall] = [14, 160];
  for (let k = 0; k < tall; k++) {
    const stop = 4 * Math.round((255 * (tall - 1 - k)) / (tall - 1));
    context.fillStyle = `rgb(${MAP[stop]} ${MAP[stop + 1]} ${MAP[stop + 2]})`;
    context.fillRect(x, y + 20 + k, wide, 1.5);
  }
  context.fillStyle = caption.ink;
  context.font = `600 12px ${FONT}`;
  context.fillText(bar.title, x, y + 6);
  context.font = `12px ${FONT}`;
  bar.ticks.forEach((text, k) => context.fillText(text, x + wide + 6, y + 20 + (tall * k) / (bar.ticks.length - 1)));
}

/** Hand a file to the reader of the page. */
export function download(blob: Blob, name: string): void {
  const address = URL.createObjectURL(blob);
  h("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

/** A name for a file, of letters, digits, - and _ alone. */
export function fileName(...parts: string[]): string {
  return parts.map((part) => part.normalize("NFKD").replace(/[^\w.-]+/g, "-").replace(/^[-.]+|[-.]+$/g, "")).filter(Boolean).join("-").slice(0, 100) || "mechanism";
}
