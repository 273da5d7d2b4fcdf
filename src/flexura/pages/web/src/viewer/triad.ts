import type { Camera } from "three";
import { Vector3 } from "three";

const AXES: [string, Vector3, string][] = [
  ["x", new Vector3(1, 0, 0), "#d64545"],
  ["y", new Vector3(0, 1, 0), "#2f9e52"],
  ["z", new Vector3(0, 0, 1), "#3b74d9"],
];
const SIZE = 84;

/** Which way the axes point, drawn small. */
export class Triad {
  readonly canvas = document.createElement("canvas");

  constructor() {
    this.canvas.className = "fx-triad";
    this.canvas.setAttribute("aria-hidden", "true");
  }

  draw(camera: Camera): void {
    const ratio = Math.min(window.devicePixelRatio || 1, 3);
    if (this.canvas.width !== Math.round(SIZE * ratio)) this.canvas.width = this.canvas.height = Math.round(SIZE * ratio);
    const context = this.canvas.getContext("2d");
    if (!context) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, SIZE, SIZE);
    paintTriad(context, camera, SIZE / 2, SIZE / 2);
  }
}

export function paintTriad(context: CanvasRenderingContext2D, camera: Camera, x: number, y: number): void {
  const seen = AXES.map(([name, axis, colour]) => ({ name, colour, at: axis.clone().transformDirection(camera.matrixWorldInverse) }));
  seen.sort((a, b) => a.at.z - b.at.z);
  context.lineWidth = 2;
  context.lineCap = "round";
  context.font = "600 12px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  for (const { name, colour, at } of seen) {
    context.strokeStyle = context.fillStyle = colour;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + 26 * at.x, y - 26 * at.y);
    context.stroke();
    context.fillText(name, x + 34 * at.x, y - 34 * at.y);
  }
}
