// What Python says of a mechanism to be looked at. SI units; all text is plain text.

/** Numbers in deflated base64 (`data`), or in a binary message (`offset`, `bytes`); their value is `scale` times what is stored. */
export interface Buffer {
  dtype: "f32" | "u32" | "i16" | "u8";
  shape: number[];
  scale?: number;
  data?: string;
  offset?: number;
  bytes?: number;
}

export type Triple = [number, number, number];
export type Fact = [string, string];
export type Range = [number, number]; // first, count

export interface Kind {
  key: string;
  label: string;
  colour: string;
  opacity: number;
  group: string;
}

export interface Part {
  name: string;
  kind: string;
  facts: Fact[];
  triangles?: Range;
  lines?: Range;
  dots?: Range;
  choices?: Fact[]; // texts that choose it in a file, and what else each chooses
}

/** Units in which a quantity is written, the largest first: the name of each, its size in SI, and from which value on. */
export type Scales = [name: string, size: number, least: number][];

export interface Quantity {
  key: string;
  label: string;
  unit: string;
  scales: Scales;
  largest: number | null;
  values: Buffer | null; // shares of the largest; null: the size of the displacement
}

export interface Axis {
  at: Triple;
  direction: Triple;
  pitch: number | null;
  label: string;
}

export interface Arrow {
  at: Triple;
  direction: Triple;
  label: string;
}

export interface Motion {
  id: string;
  group: string;
  title: string;
  subtitle: string;
  flag: string;
  displacement: Buffer;
  nature: "vibration" | "displacement";
  factor: number;
  largest: number | null;
  colours: Quantity[];
  axes: Axis[];
  arrows: Arrow[];
  facts: Fact[];
  by_part?: { label: string; values: string[] }[]; // a number of each part, as text; empty where there is none
  warnings: string[];
}

export interface Sequence {
  id: string;
  title: string;
  motions: string[];
  label: string;
  values: number[];
  unit: string;
}

export interface Mark {
  at: Triple;
  text: string;
  label?: string; // what of the text stands at its place
  severity: "doubt" | "warning";
  part?: string;
}

export interface SceneData {
  name: string;
  size: number;
  bounds: [Triple, Triple];
  up: string;
  kinds: Kind[];
  parts: Part[];
  points: Buffer;
  triangles: Buffer;
  lines: Buffer;
  dots: Buffer;
  motions: Motion[];
  sequences: Sequence[];
  marks: Mark[];
  picture: string | null;
  notes: string[];
}
