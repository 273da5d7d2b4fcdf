import type { Part } from "../scene";

const CREASE = Math.cos((28 * Math.PI) / 180);
const CELLS = 65535;

/** Pairs of vertices along sharp or open edges of the parts' faces, and where those of each part begin. */
export interface Edges {
  pairs: Uint32Array;
  starts: Uint32Array;
}

/** First vertex at each place of a part: equal places, to 1/65535 of the part, count as one. */
function welded(points: Float32Array, own: Uint32Array): Map<number, number> {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (const v of own)
    for (let i = 0; i < 3; i++) {
      low[i] = Math.min(low[i], points[3 * v + i]);
      high[i] = Math.max(high[i], points[3 * v + i]);
    }
  const step = Math.max(high[0] - low[0], high[1] - low[1], high[2] - low[2], 1e-30) / CELLS;
  const cell = (v: number, i: number) => Math.round((points[3 * v + i] - low[i]) / step);
  const first = new Map<number, number>();
  const merged = new Map<number, number>();
  for (const v of own) {
    const key = (cell(v, 0) * (CELLS + 1) + cell(v, 1)) * (CELLS + 1) + cell(v, 2);
    const known = first.get(key);
    if (known === undefined) first.set(key, v);
    merged.set(v, known ?? v);
  }
  return merged;
}

function normals(points: Float32Array, own: Uint32Array): Float32Array {
  const found = new Float32Array(own.length);
  const p = (k: number, i: number) => points[3 * own[k] + i];
  for (let t = 0; t < own.length; t += 3) {
    const [ax, ay, az] = [0, 1, 2].map((i) => p(t + 1, i) - p(t, i));
    const [bx, by, bz] = [0, 1, 2].map((i) => p(t + 2, i) - p(t, i));
    const n = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
    const length = Math.hypot(n[0], n[1], n[2]) || 1;
    for (let i = 0; i < 3; i++) found[t + i] = n[i] / length;
  }
  return found;
}

function edgesOf(points: Float32Array, own: Uint32Array, pairs: number[]): void {
  const merged = welded(points, own);
  const normal = normals(points, own);
  const open = new Map<number, number>();
  const base = points.length / 3;
  for (let t = 0; t < own.length; t += 3)
    for (let k = 0; k < 3; k++) {
      const a = merged.get(own[t + k])!;
      const b = merged.get(own[t + ((k + 1) % 3)])!;
      if (a === b) continue;
      const key = a < b ? a * base + b : b * base + a;
      const other = open.get(key);
      if (other === undefined) {
        open.set(key, t);
        continue;
      }
      open.delete(key);
      const dot = normal[t] * normal[other] + normal[t + 1] * normal[other + 1] + normal[t + 2] * normal[other + 2];
      if (dot < CREASE) pairs.push(a, b);
    }
  for (const key of open.keys()) pairs.push(Math.floor(key / base), key % base);
}

export function featureEdges(points: Float32Array, triangles: Uint32Array, parts: Part[]): Edges {
  const pairs: number[] = [];
  const starts = new Uint32Array(parts.length + 1);
  parts.forEach((part, k) => {
    if (part.triangles) {
      const [first, count] = part.triangles;
      edgesOf(points, triangles.subarray(3 * first, 3 * (first + count)), pairs);
    }
    starts[k + 1] = pairs.length / 2;
  });
  return { pairs: Uint32Array.from(pairs), starts };
}
