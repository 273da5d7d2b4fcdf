import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  GLSL3,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  LineSegments,
  Mesh,
  type Object3D,
  Points,
  RawShaderMaterial,
  type IUniform,
  type ShaderMaterialParameters,
} from "three";
import type { Edges } from "./edges";
import { DOTS, EDGES, FACES, LINES } from "./shaders";
import type { Look } from "./tables";

export type Uniforms = Record<string, IUniform>;

function material(source: { vertex: string; fragment: string }, shared: Uniforms, own: Uniforms, more: ShaderMaterialParameters = {}) {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: source.vertex,
    fragmentShader: source.fragment,
    uniforms: { ...shared, ...own },
    ...more,
  });
}

function drawn<T extends Object3D>(object: T, order: number): T {
  object.frustumCulled = false;
  object.matrixAutoUpdate = false;
  object.renderOrder = order;
  return object;
}

/** Faces of opaque parts; of translucent parts first their depth, so that only the nearest is mixed in, then their colour. */
export class Faces {
  readonly opaque: Mesh;
  readonly depth: Mesh;
  readonly translucent: Mesh;

  constructor(shared: Uniforms) {
    const solid = { side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    const through = { ...solid, transparent: true };
    this.opaque = drawn(new Mesh(new BufferGeometry(), material(FACES, shared, {}, solid)), 0);
    this.depth = drawn(new Mesh(new BufferGeometry(), material(FACES, shared, {}, { ...through, colorWrite: false })), 3);
    this.translucent = drawn(new Mesh(this.depth.geometry, material(FACES, shared, {}, { ...through, depthWrite: false })), 4);
  }

  /** Draw these parts alone; `ranges` and `looks` go with the parts. */
  arrange(triangles: Uint32Array, ranges: [number, number][], looks: Look[]): void {
    const chosen = (wanted: (look: Look) => boolean) => {
      const own = ranges.filter((_, k) => looks[k].shown && wanted(looks[k]));
      return joined(own.map(([first, count]) => triangles.subarray(3 * first, 3 * (first + count))));
    };
    replaceIndex(this.opaque.geometry, chosen((look) => look.opacity >= 1));
    replaceIndex(this.depth.geometry, chosen((look) => look.opacity < 1));
    this.depth.visible = this.translucent.visible = (this.depth.geometry.index?.count ?? 0) > 0;
  }
}

export function edgeLines(shared: Uniforms, own: Uniforms, order: number): LineSegments {
  return drawn(new LineSegments(new BufferGeometry(), material(EDGES, shared, own, { transparent: true, depthWrite: false })), order);
}

export function arrangeEdges(lines: LineSegments, edges: Edges, looks: Look[]): void {
  const own = looks.map((look, k) => (look.shown ? edges.pairs.subarray(2 * edges.starts[k], 2 * edges.starts[k + 1]) : edges.pairs.subarray(0, 0)));
  replaceIndex(lines.geometry, joined(own));
}

/** Lines of a width in pixels between pairs of vertices. */
export class WideLines {
  readonly mesh: Mesh;
  private readonly geometry = new InstancedBufferGeometry();

  constructor(shared: Uniforms, own: Uniforms, order: number, more: ShaderMaterialParameters = {}) {
    const corners = Float32Array.from([0, -1, 1, -1, 1, 1, 0, 1]);
    this.geometry.setAttribute("corner", new BufferAttribute(corners, 2));
    this.geometry.setIndex([0, 1, 2, 0, 2, 3]);
    this.mesh = drawn(new Mesh(this.geometry, material(LINES, shared, own, { side: DoubleSide, transparent: true, ...more })), order);
    this.arrange(new Uint32Array(0));
  }

  arrange(pairs: Uint32Array): void {
    this.geometry.setAttribute("ends", new InstancedBufferAttribute(Float32Array.from(pairs), 2));
    this.geometry.instanceCount = pairs.length / 2;
    this.mesh.visible = pairs.length > 0;
  }
}

export function dotPoints(shared: Uniforms, own: Uniforms, order: number): Points {
  return drawn(new Points(new BufferGeometry(), material(DOTS, shared, own, {})), order);
}

export function arrangeDots(points: Points, dots: Uint32Array, ranges: [number, number][], looks: Look[]): void {
  replaceIndex(points.geometry, shownCells(dots, ranges, looks, 1));
}

/** Cells of `corners` numbers of the parts that are shown. */
export function shownCells(cells: Uint32Array, ranges: [number, number][], looks: Look[], corners: number): Uint32Array {
  const own = ranges.filter((_, k) => looks[k].shown);
  return joined(own.map(([first, count]) => cells.subarray(corners * first, corners * (first + count))));
}

function joined(pieces: Uint32Array[]): Uint32Array {
  const all = new Uint32Array(pieces.reduce((sum, piece) => sum + piece.length, 0));
  let at = 0;
  for (const piece of pieces) {
    all.set(piece, at);
    at += piece.length;
  }
  return all;
}

function replaceIndex(geometry: BufferGeometry, numbers: Uint32Array): void {
  geometry.dispose();
  geometry.setIndex(new BufferAttribute(numbers, 1));
}
