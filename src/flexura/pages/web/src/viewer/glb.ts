import type { Model } from "./model";
import type { Motion, Part } from "../scene";

// glTF 2.0, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html: metres, y upward, colours linear.

const FLOAT = 5126;
const UNSIGNED = 5125;
const VERTICES = 34962;
const INDICES = 34963;
const PERIOD = 2; // s
const KEYS = 25; // of a cycle

/** Grows the binary part of a file, and the tables of views and accessors of it. */
class Chunk {
  readonly views: object[] = [];
  readonly accessors: object[] = [];
  private readonly pieces: ArrayBufferView<ArrayBuffer>[] = [];
  length = 0;

  add(data: Float32Array<ArrayBuffer> | Uint32Array<ArrayBuffer>, type: "SCALAR" | "VEC3", more: object = {}): number {
    const each = type === "VEC3" ? 3 : 1;
    const target = type === "VEC3" ? { target: VERTICES } : data instanceof Uint32Array ? { target: INDICES } : {};
    this.views.push({ buffer: 0, byteOffset: this.length, byteLength: data.byteLength, ...target });
    const componentType = data instanceof Float32Array ? FLOAT : UNSIGNED;
    this.accessors.push({ bufferView: this.views.length - 1, componentType, count: data.length / each, type, ...more });
    this.pieces.push(data);
    this.length += data.byteLength;
    return this.accessors.length - 1;
  }

  places(data: Float32Array<ArrayBuffer>): number {
    const min = [Infinity, Infinity, Infinity];
    const max = [-Infinity, -Infinity, -Infinity];
    data.forEach((value, k) => {
      min[k % 3] = Math.min(min[k % 3], value);
      max[k % 3] = Math.max(max[k % 3], value);
    });
    return this.add(data, "VEC3", { min, max });
  }

  blobs(): ArrayBufferView<ArrayBuffer>[] {
    return this.pieces;
  }
}

/** What moves: displacements of all vertices, m, as drawn at its largest, with names. */
export interface Shape {
  name: string;
  displacement: Float32Array;
}

/** Keyframes of the weights of the shapes: times, s, and for each time a weight of each shape. */
export function keyframes(motions: Motion[]): { times: number[]; weights: number[][] } {
  if (motions.length > 1) {
    const times = motions.map((_, k) => (k * PERIOD) / 4);
    return { times, weights: motions.map((_, k) => motions.map((__, j) => (j === k ? 1 : 0))) };
  }
  const turn = (k: number) => (2 * Math.PI * k) / (KEYS - 1);
  const weight = (k: number) => (motions[0]?.nature === "vibration" ? Math.sin(turn(k)) : 0.5 - 0.5 * Math.cos(turn(k)));
  const all = Array.from({ length: KEYS }, (_, k) => k);
  return { times: all.map((k) => (k * PERIOD) / (KEYS - 1)), weights: all.map((k) => [weight(k)]) };
}

/** The parts as a GLB: a named node for each, a material for each kind, morph targets and an animation of the shapes. */
export function glb(model: Model, parts: number[], shapes: Shape[], motions: Motion[], title: string): Blob {
  const chunk = new Chunk();
  const kinds = [...model.kinds.keys()];
  const nodes: object[] = [];
  const meshes: object[] = [];
  for (const number of parts) {
    const part = model.scene.parts[number];
    const primitives = primitivesOf(model, part, shapes, chunk, kinds.indexOf(part.kind));
    if (primitives.length === 0) continue;
    const targets = shapes.length ? { weights: shapes.map(() => 0), extras: { targetNames: shapes.map((own) => own.name) } } : {};
    meshes.push({ name: part.name, primitives, ...targets });
    nodes.push({ name: part.name, mesh: meshes.length - 1 });
  }
  const root = { name: model.scene.name, rotation: [-Math.SQRT1_2, 0, 0, Math.SQRT1_2], children: nodes.map((_, k) => k) };
  const animations = shapes.length ? [animation(nodes.length, motions, title, chunk)] : [];
  const json: Record<string, unknown> = {
    asset: { version: "2.0", generator: "flexura" },
    scene: 0,
    scenes: [{ name: model.scene.name, nodes: [nodes.length] }],
    nodes: [...nodes, root],
    meshes,
    materials: kinds.map((key) => materialOf(model, key)),
    accessors: chunk.accessors,
    bufferViews: chunk.views,
    buffers: [{ byteLength: chunk.length }],
  };
  if (animations.length) json.animations = animations;
  return container(json, chunk);
}

function materialOf(model: Model, key: string): object {
  const kind = model.kinds.get(key)!;
  const linear = [1, 3, 5].map((k) => {
    const s = parseInt(kind.colour.slice(k, k + 2), 16) / 255;
    return s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4;
  });
  const clear = kind.opacity < 1 ? { alphaMode: "BLEND" } : {};
  return {
    name: kind.label,
    doubleSided: true,
    ...clear,
    pbrMetallicRoughness: { baseColorFactor: [...linear, kind.opacity], metallicFactor: 0.1, roughnessFactor: 0.65 },
  };
}

function primitivesOf(model: Model, part: Part, shapes: Shape[], chunk: Chunk, material: number): object[] {
  const own = [...model.vertices(part)].sort((a, b) => a - b);
  if (own.length === 0) return [];
  const renumbered = new Map(own.map((v, k) => [v, k]));
  const { frame } = model;
  const gathered = (value: (v: number, i: number) => number) => Float32Array.from({ length: 3 * own.length }, (_, k) => value(own[Math.floor(k / 3)], k % 3));
  const attributes = { POSITION: chunk.places(gathered((v, i) => model.points[3 * v + i] * frame.size + frame.middle[i])) };
  const targets = shapes.map((shape) => ({ POSITION: chunk.places(gathered((v, i) => shape.displacement[3 * v + i])) }));
  const cells: [Uint32Array, [number, number] | undefined, number, number][] = [
    [model.triangles, part.triangles, 3, 4],
    [model.lines, part.lines, 2, 1],
    [model.dots, part.dots, 1, 0],
  ];
  const primitives: object[] = [];
  for (const [all, range, corners, mode] of cells) {
    if (!range || range[1] === 0) continue;
    const numbers = Uint32Array.from(all.subarray(corners * range[0], corners * (range[0] + range[1])), (v) => renumbered.get(v)!);
    primitives.push({ attributes, indices: chunk.add(numbers, "SCALAR"), material, mode, ...(targets.length ? { targets } : {}) });
  }
  return primitives;
}

function animation(count: number, motions: Motion[], title: string, chunk: Chunk): object {
  const { times, weights } = keyframes(motions);
  const input = chunk.add(Float32Array.from(times), "SCALAR", { min: [times[0]], max: [times[times.length - 1]] });
  const output = chunk.add(Float32Array.from(weights.flat()), "SCALAR");
  return {
    name: title,
    samplers: [{ input, output, interpolation: "LINEAR" }],
    channels: Array.from({ length: count }, (_, node) => ({ sampler: 0, target: { node, path: "weights" } })),
  };
}

function container(json: object, chunk: Chunk): Blob {
  const text = new TextEncoder().encode(JSON.stringify(json));
  const padded = new Uint8Array(4 * Math.ceil(text.length / 4)).fill(0x20);
  padded.set(text);
  const header = Uint32Array.from([0x46546c67, 2, 12 + 8 + padded.length + 8 + chunk.length, padded.length, 0x4e4f534a]);
  return new Blob([header, padded, Uint32Array.from([chunk.length, 0x004e4942]), ...chunk.blobs()], { type: "model/gltf-binary" });
}
