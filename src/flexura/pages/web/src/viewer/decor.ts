import { type DataTexture, Group, Vector3 } from "three";
import type { Arrow, Axis, Mark, Motion } from "../scene";
import { type Uniforms, WideLines } from "./batches";
import type { Label } from "./labels";
import type { Frame, Model } from "./model";
import { tableOfField, tableOfPoints } from "./tables";

const REACH = 0.72; // half of the length of an axis of a screw, sizes of the frame
const ARROW = 0.16;

/** Lines of screws and arrows, and the marks: things said of the motion that are no parts. */
export class Decor {
  readonly group = new Group();
  labels: Label[] = [];
  private readonly axes: Strokes;
  private readonly arrows: Strokes;

  constructor(shared: Uniforms) {
    this.axes = new Strokes(shared, 2.5);
    this.arrows = new Strokes(shared, 3);
    this.group.add(this.axes.lines.mesh, this.arrows.lines.mesh);
  }

  colours(axis: number[], arrow: number[]): void {
    this.axes.ink(axis);
    this.arrows.ink(arrow);
  }

  show(model: Model, motion: Motion | null, marks: boolean): void {
    const { frame } = model;
    const axes = motion?.axes ?? [];
    const arrows = motion?.arrows ?? [];
    this.axes.set(axes.flatMap((axis) => strokesOfAxis(axis, frame)));
    this.arrows.set(arrows.flatMap((arrow) => strokesOfArrow(frame, arrow)));
    this.labels = [
      ...axes.map((axis) => labelOfAxis(axis, frame)),
      ...arrows.map((arrow) => ({ at: tip(frame, arrow), text: arrow.label, kind: "arrow" as const })),
      ...(marks ? model.scene.marks : []).map((mark: Mark) => ({ at: new Vector3(...frame.place(mark.at)), text: mark.label ?? mark.text, kind: mark.severity })),
    ];
  }

  dispose(): void {
    this.axes.dispose();
    this.arrows.dispose();
  }
}

function labelOfAxis(axis: Axis, frame: Frame): Label {
  const at = new Vector3(...frame.place(axis.at)).addScaledVector(new Vector3(...axis.direction).normalize(), REACH * 0.8);
  return { at, text: axis.label, kind: "axis" };
}

function tip(frame: Frame, arrow: Arrow): Vector3 {
  return new Vector3(...frame.place(arrow.at)).addScaledVector(new Vector3(...arrow.direction).normalize(), ARROW);
}

/** Two directions across one, with it a right-handed set. */
function across(direction: Vector3): [Vector3, Vector3] {
  const other = Math.abs(direction.z) < 0.9 ? new Vector3(0, 0, 1) : new Vector3(1, 0, 0);
  const x = direction.clone().cross(other).normalize();
  return [x, direction.clone().cross(x)];
}

/** The axis, and around its middle a ring that turns with an arrow; of a pitch, a helix. */
function strokesOfAxis(axis: Axis, frame: Frame): Vector3[] {
  const middle = new Vector3(...frame.place(axis.at));
  const along = new Vector3(...axis.direction).normalize();
  const [x, y] = across(along);
  const rise = axis.pitch === null ? 0 : Math.max(-0.08, Math.min(0.08, axis.pitch / frame.size));
  const at = (angle: number, radius = 0.07, lift = 0) =>
    middle.clone().addScaledVector(x, radius * Math.cos(angle)).addScaledVector(y, radius * Math.sin(angle)).addScaledVector(along, rise * (angle - 2.6) + lift);
  const strokes = [middle.clone().addScaledVector(along, -REACH), middle.clone().addScaledVector(along, REACH)];
  for (let k = 0; k < 32; k++) strokes.push(at(0.16 * k), at(0.16 * (k + 1)));
  strokes.push(at(5.12), at(4.85, 0.07, 0.025), at(5.12), at(4.85, 0.07, -0.025));
  return strokes;
}

function strokesOfArrow(frame: Frame, arrow: Arrow): Vector3[] {
  const head = tip(frame, arrow);
  const along = new Vector3(...arrow.direction).normalize();
  const strokes = [new Vector3(...frame.place(arrow.at)), head];
  for (const side of across(along))
    for (const sign of [-1, 1]) strokes.push(head, head.clone().addScaledVector(along, -0.035).addScaledVector(side, 0.014 * sign));
  return strokes;
}

/** Lines that belong to no part and stand still. */
class Strokes {
  readonly lines: WideLines;
  private readonly own: Uniforms;

  constructor(shared: Uniforms, width: number) {
    this.own = { points: { value: null }, fieldA: { value: null }, fieldB: { value: null }, ink: { value: [0, 0, 0, 1] }, width: { value: width }, nearer: { value: 2e-3 } };
    this.own.byValue = { value: false };
    this.own.plane = { value: [0, 0, 0, 1e9] };
    this.own.picking = { value: false };
    this.lines = new WideLines(shared, this.own, 6);
  }

  ink(colour: number[]): void {
    this.own.ink.value = colour;
  }

  set(ends: Vector3[]): void {
    this.dispose();
    const points = Float32Array.from(ends.flatMap((p) => p.toArray()));
    const rest = { displacement: new Float32Array(points.length), share: new Float32Array(ends.length), largest: 0 };
    this.own.points.value = tableOfPoints(points, new Float32Array(ends.length));
    this.own.fieldA.value = this.own.fieldB.value = tableOfField(rest);
    this.lines.arrange(Uint32Array.from(ends, (_, k) => k));
  }

  dispose(): void {
    (this.own.points.value as DataTexture | null)?.dispose();
    (this.own.fieldA.value as DataTexture | null)?.dispose();
  }
}
