import type { Fact, Motion, SceneData } from "../scene";

export interface Options {
  autoplay?: boolean; // plays from the start, unless the reader prefers less motion; true unless said
  motion?: string; // shown first
  binary?: ArrayBuffer; // message that the buffers of the scene are in
}

/** New places and displacements, m, of the vertices of the scene shown, and texts of its motions. */
export interface Move {
  points?: ArrayLike<number>;
  displacements?: Record<string, ArrayLike<number>>;
  motions?: (Partial<Motion> & { id: string })[];
}

export interface Viewer {
  readonly scene: SceneData;
  update(scene: SceneData, binary?: ArrayBuffer): Promise<void>;
  move(change: Move): Promise<void>;
  show(id: string | null): void;
  select(part: string | null): void;
  tell(facts: Fact[][]): void;
  toggleHelp?(): void; // where something moves
  dispose(): void;
}
