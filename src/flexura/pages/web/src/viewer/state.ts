import { number } from "../numbers";
import type { Kind, Motion, Quantity, SceneData, Sequence } from "../scene";
import type { Section } from "./drawing";

export const KINDS = "kind"; // coloured by the kinds of parts

/** What a viewer shows: all that its controls set. */
export interface State {
  shown: string | null; // id of a motion or a sequence; null: at rest
  colour: string; // KINDS, or key of a quantity
  factor: number; // on the suggested one
  ghost: boolean;
  seeThrough: boolean;
  hidden: Set<string>; // keys of kinds
  selected: number; // number of a part, -1: none
  section: Section | null;
  parallel: boolean;
  marks: boolean;
}

/** What the controls ask of the viewer. */
export interface Commands {
  readonly scene: SceneData;
  readonly state: Readonly<State>;
  readonly pose: number; // of those of a sequence, the nearest to what is shown
  show(id: string | null): void;
  set(change: Partial<State>): void;
  copy(text: string): void;
  toggleKind(key: string): void;
  cut(axis: 0 | 1 | 2 | null): void;
  look(view: string): void;
  fit(): void;
  toggleFull(): void;
  savePicture(): void;
  saveModel(): void;
  toggleHelp(): void;
  togglePanel(): void;
}

export function sequenceOf(scene: SceneData, id: string | null): Sequence | null {
  return scene.sequences.find((own) => own.id === id) ?? null;
}

const SEE_THROUGH = 0.28;

/** Opacity of a kind: bodies are seen through when that is asked for, and only then. */
export function opacityOf(kind: Kind, seeThrough: boolean): number {
  if (kind.group !== "bodies") return kind.opacity;
  return seeThrough ? (kind.opacity < 1 ? kind.opacity : SEE_THROUGH) : 1;
}

/** Motions that can be chosen: sequences stand for theirs. */
export function choices(scene: SceneData): { id: string; group: string; title: string; subtitle: string; flag: string }[] {
  const within = new Set(scene.sequences.flatMap((own) => own.motions));
  const single = scene.motions.filter((own) => !within.has(own.id));
  const several = scene.sequences.map((own) => {
    const first = scene.motions.find((motion) => motion.id === own.motions[0]);
    return { id: own.id, group: first?.group ?? "stroke", title: own.title, subtitle: rangeOf(own), flag: first?.flag ?? "" };
  });
  return [...single, ...several];
}

function rangeOf(sequence: Sequence): string {
  const { values, label, unit } = sequence;
  if (values.length === 0) return label;
  return `${label} ${number(values[0], 4)} to ${number(values[values.length - 1], 4)} ${unit}`;
}

/** The largest value that colours a motion; of displacements the motion's own. */
export function largestOf(motion: Motion, colour: Quantity): number | null {
  return colour.largest ?? (colour.values === null ? motion.largest : null);
}

/** The motions that a choice is made of: one, or the poses of a sequence. */
export function motionsOf(scene: SceneData, id: string | null): Motion[] {
  const ids = sequenceOf(scene, id)?.motions ?? (id === null ? [] : [id]);
  return ids.map((own) => scene.motions.find((motion) => motion.id === own)).filter((own): own is Motion => own !== undefined);
}

export function firstState(scene: SceneData): State {
  return {
    shown: choices(scene)[0]?.id ?? null,
    colour: KINDS,
    factor: 1,
    ghost: false,
    seeThrough: scene.kinds.some((kind) => kind.group === "bodies" && kind.opacity < 1),
    hidden: new Set(),
    selected: -1,
    section: null,
    parallel: false,
    marks: true,
  };
}
