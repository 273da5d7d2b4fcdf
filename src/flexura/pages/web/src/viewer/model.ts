import { decode, floats } from "../buffers";
import type { Kind, Motion, Part, Quantity, Range, SceneData, Triple } from "../scene";
import { type Edges, featureEdges } from "./edges";

/** What is drawn lies around the origin, and its longest side is 1. */
export class Frame {
  constructor(
    readonly middle: Triple,
    readonly size: number,
  ) {}

  static of(scene: SceneData): Frame {
    const [low, high] = scene.bounds;
    const middle = [0, 1, 2].map((i) => (low[i] + high[i]) / 2) as Triple;
    return new Frame(middle, scene.size > 0 ? scene.size : 0.01);
  }

  place(p: ArrayLike<number>): Triple {
    return [0, 1, 2].map((i) => (p[i] - this.middle[i]) / this.size) as Triple;
  }
}

/** Displacement of every vertex in sizes of the frame, and share of the largest value; -1 where unknown. */
export interface Field {
  displacement: Float32Array;
  share: Float32Array;
  largest: number; // displacement, sizes of the frame
}

const NONE: Range = [0, 0];

/** A scene with its buffers decoded. */
export class Model {
  readonly kinds: Map<string, Kind>;
  readonly motions: Map<string, Motion>;
  readonly edges: Edges;
  private readonly displacements = new Map<string, Promise<Float32Array>>();
  private readonly values = new Map<Quantity, Promise<Float32Array>>();

  private constructor(
    readonly scene: SceneData,
    readonly frame: Frame,
    readonly points: Float32Array, // (v, 3), of the frame
    readonly triangles: Uint32Array,
    readonly lines: Uint32Array,
    readonly dots: Uint32Array,
    readonly partOf: Float32Array,
    private readonly binary?: ArrayBuffer,
  ) {
    this.kinds = new Map(scene.kinds.map((kind) => [kind.key, kind]));
    this.motions = new Map(scene.motions.map((motion) => [motion.id, motion]));
    this.edges = featureEdges(points, triangles, scene.parts);
  }

  static async of(scene: SceneData, binary?: ArrayBuffer, frame = Frame.of(scene)): Promise<Model> {
    const [places, triangles, lines, dots] = await Promise.all([
      floats(scene.points, binary),
      decode(scene.triangles, binary),
      decode(scene.lines, binary),
      decode(scene.dots, binary),
    ]);
    const points = new Float32Array(places.length);
    for (let k = 0; k < points.length; k++) points[k] = (places[k] - frame.middle[k % 3]) / frame.size;
    const cells = [triangles, lines, dots] as Uint32Array[];
    return new Model(scene, frame, points, cells[0], cells[1], cells[2], partsOf(scene, cells, points.length / 3), binary);
  }

  /** Numbers of all vertices of a part. */
  vertices(part: Part): Set<number> {
    const own = (cells: Uint32Array, [first, count]: Range, corners: number) =>
      cells.subarray(corners * first, corners * (first + count));
    return new Set([
      ...own(this.triangles, part.triangles ?? NONE, 3),
      ...own(this.lines, part.lines ?? NONE, 2),
      ...own(this.dots, part.dots ?? NONE, 1),
    ]);
  }

  /** Take new places, m, and displacements of motions, m, of the same vertices. */
  move(places: ArrayLike<number> | undefined, displacements: Record<string, ArrayLike<number>>): void {
    const { middle, size } = this.frame;
    if (places) for (let k = 0; k < this.points.length; k++) this.points[k] = (places[k] - middle[k % 3]) / size;
    for (const [id, own] of Object.entries(displacements))
      this.displacements.set(id, Promise.resolve(Float32Array.from(own, (d) => d / size)));
  }

  /** The largest share that a quantity of a motion reaches in a part; null where nothing is known of it. */
  async reached(motion: Motion, quantity: Quantity, part: Part): Promise<number | null> {
    const { share } = await this.field(motion, quantity);
    let most = -1;
    for (const v of this.vertices(part)) most = Math.max(most, share[v]);
    return most < 0 ? null : most;
  }

  /** The field of a motion coloured by one of its quantities; everything at rest without a motion. */
  async field(motion: Motion | null, quantity: Quantity | null): Promise<Field> {
    const count = this.points.length / 3;
    if (!motion) return { displacement: new Float32Array(3 * count), share: new Float32Array(count).fill(-1), largest: 0 };
    const displacement = await this.displacement(motion);
    const sizes = new Float32Array(count);
    let largest = 0;
    for (let v = 0; v < count; v++) {
      sizes[v] = Math.hypot(displacement[3 * v], displacement[3 * v + 1], displacement[3 * v + 2]);
      if (sizes[v] > largest) largest = sizes[v];
    }
    const share = quantity?.values ? await this.shares(quantity) : sizes.map((own) => (largest > 0 ? own / largest : 0));
    return { displacement, share, largest };
  }

  private displacement(motion: Motion): Promise<Float32Array> {
    let found = this.displacements.get(motion.id);
    if (!found) {
      found = floats(motion.displacement, this.binary).then((own) => own.map((d) => d / this.frame.size));
      this.displacements.set(motion.id, found);
    }
    return found;
  }

  private shares(quantity: Quantity): Promise<Float32Array> {
    let found = this.values.get(quantity);
    if (!found) {
      found = decode(quantity.values!, this.binary).then((stored) => shareOf(stored, quantity.values!.scale));
      this.values.set(quantity, found);
    }
    return found;
  }
}

function shareOf(stored: ArrayLike<number>, scale = 1): Float32Array {
  const bytes = stored instanceof Uint8Array;
  return Float32Array.from(stored, (n) => (Number.isNaN(n) || (bytes && n === 255) ? -1 : n * scale));
}

function partsOf(scene: SceneData, cells: Uint32Array[], vertices: number): Float32Array {
  const own = new Float32Array(vertices);
  scene.parts.forEach((part, number) => {
    const ranges = [part.triangles ?? NONE, part.lines ?? NONE, part.dots ?? NONE];
    ranges.forEach(([first, count], k) => {
      const corners = 3 - k;
      for (let c = corners * first; c < corners * (first + count); c++) own[cells[k][c]] = number;
    });
  });
  return own;
}
