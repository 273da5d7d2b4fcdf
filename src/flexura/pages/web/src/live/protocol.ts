// What the page and the server tell one another.

import type { Fact, SceneData } from "../scene";

export interface Slider {
  name: string;
  value: number; // in `unit`, as the file has it
  unit: string;
  low: number;
  high: number;
  minimum: boolean; // whether the ends are given; else they are assumed
  maximum: boolean;
  is_log: boolean;
  source: string;
  expression: string; // what the value follows from; then it is no slider
}

export interface Asked {
  input: string;
  output: string;
  low: number;
  high: number;
  damping?: number | null;
}

export type LoadKind = "described" | "actuators" | "move";

export interface Load {
  kind: LoadKind;
  dof?: string;
  amplitude?: number; // m or rad
}

export interface Opened {
  type: "opened";
  revision: number;
  name: string;
  file: string;
  sliders: Slider[];
  modes: number;
  members: number;
  notes: string[];
  inputs: string[];
  outputs: string[];
  response: Asked | null;
  loads: LoadKind[];
  stroke: { dof: string; amplitude: number; assumed: boolean };
}

/** A mode: its identity, from the modes of the file on, and its frequency in numbers and words. */
export interface Row {
  mode: number;
  like: number;
  hz: number;
  text: string;
  proof: string;
  interval: string;
  flag: string; // what is wrong with the frequency; empty where it is proven to 0.1 %
  rigid: boolean;
}

export interface Place {
  dtype: "f32" | "i16";
  shape: number[];
  offset: number;
  bytes: number;
  scale?: number;
}

/** What is told of a design first: its frequencies, and what follows the sliders. */
export interface Numbers {
  type: "numbers";
  serial: number;
  revision: number;
  shown: number;
  rows: Row[];
  derived: Record<string, number>;
  bounds: Record<string, [number, number]>;
  file: Record<string, number>; // frequencies of the file by mode, Hz
  timing: Record<string, number>;
}

/** Its picture, which is left out where the hand has moved on. */
export interface Picture {
  type: "picture";
  serial: number;
  row: Row; // of the mode that is shown
  factor: number; // on the displacements, for a picture
  timing: Record<string, number>;
  buffers: Record<string, Place>;
}

export interface Response {
  type: "response";
  serial: number;
  input: string;
  output: string;
  unit: string;
  notes: string[];
  warnings: string[];
  resonances: number[];
  buffers: Record<string, Place>;
}

export interface Stress {
  type: "stress";
  serial: number;
  rows?: { member: string; stress: number; yield: number; factor: number | null; when: string }[];
  when?: string;
  notes?: string[];
  warnings?: string[];
  error?: string;
}

export interface FileState {
  type: "file";
  gone: boolean;
  problems: { where: string; text: string; hint: string }[];
}

export interface Refused {
  type: "refused";
  serial: number;
  problems: { text: string; sliders: string[] }[];
}

/** How far the part may be from the frequencies of a design, by mode, and why. */
export interface ModelErrors {
  type: "model errors";
  serial: number;
  errors: Record<string, { text: string; why: string }>;
}

/** What is required of a design, each with its number in words, its verdict, and why. */
export interface Requirements {
  type: "requirements";
  serial: number;
  rows: { name: string; text: string; is: string; verdict: "met" | "missed" | "not known"; why: string }[];
  limits: string[]; // what else is beyond its limit where these are asked
  error?: string;
}

/** What is new of the parts of the scene, by number. */
export type Facts = Record<string, Fact[]>;

export type Message =
  | Opened
  | Numbers
  | Picture
  | Response
  | Stress
  | ModelErrors
  | Requirements
  | FileState
  | Refused
  | { type: "scene"; scene: SceneData }
  | { type: "holds" | "settled"; serial: number }
  | { type: "facts"; serial: number; facts: Facts }
  | { type: "motions"; serial: number; texts: Record<string, string> }
  | { type: "no response"; serial: number; error: string }
  | { type: "exists" | "saved"; file: string }
  | { type: "not saved"; file: string; text: string }
  | { type: "misunderstood"; text: string };

/** A message, with the bytes that its arrays are in. */
export interface Received {
  message: Message;
  bytes?: ArrayBuffer;
}

/** Read a message: text, or bytes that begin with the length of their header. */
export function received(data: string | ArrayBuffer): Received {
  if (typeof data === "string") return { message: JSON.parse(data) as Message };
  const length = new DataView(data).getUint32(0, true);
  const text = new TextDecoder().decode(new Uint8Array(data, 4, length));
  return { message: JSON.parse(text) as Message, bytes: data };
}

/** Numbers of an array of a message. */
export function numbers(bytes: ArrayBuffer, place: Place): Float32Array {
  if (place.dtype === "f32") return new Float32Array(bytes, place.offset, place.bytes / 4);
  const stored = new Int16Array(bytes, place.offset, place.bytes / 2);
  const found = new Float32Array(stored.length);
  const step = place.scale ?? 1;
  for (let k = 0; k < stored.length; k++) found[k] = stored[k] * step;
  return found;
}
