import { ClampToEdgeWrapping, DataTexture, FloatType, NearestFilter, RGBAFormat, UnsignedByteType } from "three";
import type { Field, Model } from "./model";
import { WIDTH } from "./shaders";

/** A texture of (n, 4) numbers, read by number. */
function table(data: Float32Array<ArrayBuffer> | Uint8Array<ArrayBuffer>, count: number): DataTexture {
  const rows = Math.max(1, Math.ceil(count / WIDTH));
  const type = data instanceof Float32Array ? FloatType : UnsignedByteType;
  const texture = new DataTexture(data, WIDTH, rows, RGBAFormat, type);
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.wrapS = texture.wrapT = ClampToEdgeWrapping;
  texture.needsUpdate = true;
  return texture;
}

function room(count: number): number {
  return 4 * WIDTH * Math.max(1, Math.ceil(count / WIDTH));
}

/** Places of the vertices, with the numbers of their parts. */
export function tableOfPoints(points: Float32Array, partOf: Float32Array): DataTexture {
  const data = new Float32Array(room(partOf.length));
  for (let v = 0; v < partOf.length; v++) {
    data.set([points[3 * v], points[3 * v + 1], points[3 * v + 2], partOf[v]], 4 * v);
  }
  return table(data, partOf.length);
}

export function tableOfField(field: Field, weight = 1): DataTexture {
  const count = field.share.length;
  const data = new Float32Array(room(count));
  for (let v = 0; v < count; v++) {
    data[4 * v] = field.displacement[3 * v];
    data[4 * v + 1] = field.displacement[3 * v + 1];
    data[4 * v + 2] = field.displacement[3 * v + 2];
    data[4 * v + 3] = field.share[v] < 0 ? -1 : weight * field.share[v];
  }
  return table(data, count);
}

export type Look = { colour: [number, number, number]; opacity: number; shown: boolean };

/** Colours and opacities of the parts. */
export function tableOfLooks(looks: Look[]): DataTexture {
  const data = new Uint8Array(room(looks.length));
  looks.forEach((look, k) => data.set([...look.colour, Math.round(255 * look.opacity)], 4 * k));
  return table(data, looks.length);
}

const MOST_BYTES = 96e6;

/** Tables of fields that were shown lately. */
export class Fields {
  private readonly kept = new Map<string, Promise<DataTexture>>();

  constructor(private readonly model: Model) {}

  /** Table of a motion (null: at rest) coloured by the quantity of a key, its shares times `weight`; with its largest displacement. */
  of(motionId: string | null, key: string, weight = 1): Promise<DataTexture> {
    const name = JSON.stringify([motionId, key, weight]);
    const found = this.kept.get(name) ?? this.made(motionId, key, weight);
    this.kept.delete(name);
    this.kept.set(name, found);
    const most = Math.max(4, Math.floor(MOST_BYTES / (16 * this.model.partOf.length + 1)));
    for (const oldest of this.kept.keys()) {
      if (this.kept.size <= most) break;
      void this.kept.get(oldest)?.then((texture) => texture.dispose());
      this.kept.delete(oldest);
    }
    return found;
  }

  /** Forget all. */
  clear(): void {
    for (const texture of this.kept.values()) void texture.then((own) => own.dispose());
    this.kept.clear();
  }

  private async made(motionId: string | null, key: string, weight: number): Promise<DataTexture> {
    const motion = motionId === null ? null : (this.model.motions.get(motionId) ?? null);
    const quantity = motion?.colours.find((own) => own.key === key) ?? null;
    const field = await this.model.field(motion, quantity);
    const texture = tableOfField(field, weight);
    texture.userData.largest = field.largest;
    return texture;
  }
}
