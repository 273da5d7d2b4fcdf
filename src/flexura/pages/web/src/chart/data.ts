/** What a chart shows: panels one below another over one x axis. */

/** Numbers; NaN (or null, as JSON has it) is a gap. */
export type Values = ArrayLike<number | null>;

export interface Axis {
  label: string;
  /** Unit of the values, empty for plain numbers. */
  unit: string;
  log: boolean;
}

/** Points without a line between them, over ascending x. */
export type Marker = "dot" | "cross" | "ring" | "disc";

/** A curve. A `bound` with `upper` is the band between the two, without it a limit. */
export interface Curve {
  /** Curves of one name in several panels have one colour and one row in the legend. */
  name: string;
  values: Values;
  upper?: Values;
  /** Where it is not over the x values of the chart. */
  x?: Values;
  style?: "line" | "pinned" | "bound" | Marker;
}

/** A vertical line over all panels, such as a resonance; `short` is for where labels have no room. */
export interface Mark {
  x: number;
  label: string;
  short?: string;
}

export interface Panel extends Axis {
  curves: Curve[];
  marks?: Mark[];
  /** A curve on a logarithmic scale of its own, whose shape alone is shown. */
  behind?: Curve;
  /** Height over that of a panel of 1. */
  weight?: number;
}

export interface ChartData {
  id: string;
  title: string;
  /** One or two sentences for those who do not see it. */
  description?: string;
  x: Axis & { values: Values };
  panels: Panel[];
  notes?: string[];
}

export interface Chart {
  /** Show other data; zoom, hidden curves and read-out stay as far as they fit. */
  update(data: ChartData): void;
  dispose(): void;
}

/** A number with NaN for what is missing. */
export function at(values: Values, k: number): number {
  const value = values[k];
  return value === null || value === undefined ? NaN : value;
}

/** Marks of all panels: they stand for the chart as a whole. */
export function marksOf(data: ChartData): Mark[] {
  return data.panels.flatMap((panel) => panel.marks ?? []).sort((a, b) => a.x - b.x);
}

/** Names of the curves in the order of the legend. */
export function namesOf(data: ChartData): string[] {
  return [...new Set(data.panels.flatMap((panel) => panel.curves.map((curve) => curve.name)))];
}
