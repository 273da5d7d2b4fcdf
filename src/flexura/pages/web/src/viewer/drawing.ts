import { ClampToEdgeWrapping, DataTexture, Group, LinearFilter, type LineSegments, type Points, RGBAFormat, UnsignedByteType, Vector3 } from "three";
import type { Part } from "../scene";
import { Faces, type Uniforms, WideLines, arrangeDots, arrangeEdges, dotPoints, edgeLines, shownCells } from "./batches";
import { MAP } from "./colourmap";
import { Decor } from "./decor";
import type { Model } from "./model";
import { Picker } from "./picker";
import type { Stage } from "./stage";
import { Fields, type Look, tableOfLooks, tableOfPoints } from "./tables";
import type { Theme } from "./theme";

const EVERYTHING = [0, 0, 0, 1e9];

export interface Section {
  axis: 0 | 1 | 2;
  share: number; // of the box, 0 to 1
  flipped: boolean;
}

/** What lies on the stage: the parts as batches of faces, edges, lines and dots, and how they look now. */
export class Drawing {
  readonly decor: Decor;
  readonly picker: Picker;
  fields: Fields;
  private readonly uniforms: Uniforms;
  private readonly over = new Group(); // nobody points at these
  private readonly faces: Faces;
  private readonly edges: LineSegments;
  private readonly ghost: LineSegments;
  private readonly lines: WideLines;
  private readonly dots: Points;
  private readonly outline: WideLines;
  private readonly style: Record<string, { value: unknown }>;
  private looks: Look[] = [];

  constructor(
    private readonly stage: Stage,
    private model: Model,
  ) {
    this.fields = new Fields(model);
    this.uniforms = sharedUniforms(stage);
    this.style = {
      edge: { value: [0, 0, 0, 1] }, ghost: { value: [0, 0, 0, 1] }, accent: { value: [1, 1, 0, 1] }, dot: { value: [0, 0, 0, 1] },
      own: { value: [0, 0, 0, 0] }, diameter: { value: 9 },
    };
    const at = (width: number, nearer: number) => ({ width: { value: width }, nearer: { value: nearer } });
    this.faces = new Faces(this.uniforms);
    this.lines = new WideLines(this.uniforms, { ink: this.style.own, ...at(2.6, 4e-5) }, 1);
    this.dots = dotPoints(this.uniforms, { ink: this.style.dot, diameter: this.style.diameter }, 2);
    this.ghost = edgeLines(this.uniforms, { ink: this.style.ghost, scale: { value: 0 } }, 2);
    this.edges = edgeLines(this.uniforms, { ink: this.style.edge }, 5);
    this.outline = new WideLines(this.uniforms, { ink: this.style.accent, byValue: { value: false }, ...at(2.4, 1e-3) }, 6);
    this.decor = new Decor(this.uniforms);
    this.over.add(this.edges, this.ghost, this.outline.mesh, this.decor.group);
    stage.scene.add(this.faces.opaque, this.lines.mesh, this.dots, this.faces.depth, this.faces.translucent, this.over);
    this.picker = new Picker(stage, this.uniforms, this.over);
    this.replace(model);
  }

  /** Take up another scene. */
  replace(model: Model): void {
    if (model !== this.model) {
      this.fields.clear();
      this.fields = new Fields(model);
    }
    this.model = model;
    (this.uniforms.points.value as DataTexture | null)?.dispose();
    this.uniforms.points.value = tableOfPoints(model.points, model.partOf);
    const { low, high } = this.box();
    this.stage.around(low, high, model.points);
  }

  /** Lowest and highest corner of what is drawn at rest. */
  box(): { low: [number, number, number]; high: [number, number, number] } {
    const [low, high] = this.model.scene.bounds.map((corner) => this.model.frame.place(corner));
    return { low, high };
  }

  /** How each part looks, in their order. */
  dress(looks: Look[]): void {
    this.looks = looks;
    const { scene, triangles, lines, dots, edges } = this.model;
    (this.uniforms.looks.value as DataTexture | null)?.dispose();
    this.uniforms.looks.value = tableOfLooks(looks);
    const ranges = (which: "triangles" | "lines" | "dots") => scene.parts.map((part): [number, number] => part[which] ?? [0, 0]);
    this.faces.arrange(triangles, ranges("triangles"), looks);
    this.lines.arrange(shownCells(lines, ranges("lines"), looks, 2));
    arrangeDots(this.dots, dots, ranges("dots"), looks);
    arrangeEdges(this.edges, edges, looks);
    arrangeEdges(this.ghost, edges, looks);
  }

  /** Show two fields with what lies between them. */
  field(a: DataTexture, b: DataTexture): void {
    this.uniforms.fieldA.value = a;
    this.uniforms.fieldB.value = b;
  }

  move(scale: number, mixing: number): void {
    this.uniforms.scale.value = scale;
    this.uniforms.mixing.value = mixing;
  }

  colourBy(values: boolean): void {
    this.uniforms.byValue.value = values;
  }

  showGhost(shown: boolean): void {
    this.ghost.visible = shown;
  }

  cut(section: Section | null): void {
    if (!section) {
      this.uniforms.plane.value = EVERYTHING;
      return;
    }
    const { low, high } = this.box();
    const { axis, share, flipped } = section;
    const at = low[axis] + share * (high[axis] - low[axis]);
    const normal = [0, 0, 0];
    normal[axis] = flipped ? -1 : 1;
    this.uniforms.plane.value = [...normal, flipped ? -at : at];
  }

  hover(part: number): void {
    this.uniforms.hovered.value = part;
  }

  select(number: number): void {
    this.uniforms.selected.value = number;
    const part: Part | undefined = this.model.scene.parts[number];
    if (!part || !this.looks[number]?.shown) {
      this.outline.arrange(new Uint32Array(0));
      return;
    }
    const { pairs, starts } = this.model.edges;
    const [first, count] = part.lines ?? [0, 0];
    this.outline.arrange(Uint32Array.from([...pairs.subarray(2 * starts[number], 2 * starts[number + 1]), ...this.model.lines.subarray(2 * first, 2 * (first + count))]));
  }

  paint(theme: Theme, through: boolean): void {
    this.stage.background(theme.background);
    this.style.edge.value = through ? theme.edgeThrough : theme.edge;
    this.style.ghost.value = theme.ghost;
    this.style.dot.value = theme.edge;
    this.style.accent.value = theme.accent;
    this.uniforms.accent.value = theme.accent.slice(0, 3);
    this.uniforms.unknown.value = theme.unknown;
    this.uniforms.cutColour.value = theme.cut;
    this.decor.colours(theme.axis, theme.arrow);
  }

  /** Before drawing: what depends on the camera and the size of the picture. */
  prepare(): void {
    const ratio = this.stage.renderer.getPixelRatio();
    (this.uniforms.upward.value as Vector3).set(0, 0, 1).transformDirection(this.stage.view.matrixWorldInverse);
    this.uniforms.ratio.value = ratio;
    this.style.diameter.value = 9 * ratio;
  }

  dispose(): void {
    this.fields.clear();
    this.picker.dispose();
    this.decor.dispose();
  }
}

function sharedUniforms(stage: Stage): Uniforms {
  const map = new DataTexture(MAP, 256, 1, RGBAFormat, UnsignedByteType);
  map.minFilter = map.magFilter = LinearFilter;
  map.wrapS = ClampToEdgeWrapping;
  map.needsUpdate = true;
  const first = {
    points: null, fieldA: null, fieldB: null, looks: null, mixing: 0, scale: 0, picking: false, plane: EVERYTHING, hovered: -1,
    selected: -1, accent: [1, 1, 0], byValue: false, map, unknown: [0.6, 0.6, 0.6], upward: new Vector3(0, 0, 1),
    cutColour: [0.8, 0.3, 0.2], pixels: stage.pixels, ratio: 1,
  };
  return Object.fromEntries(Object.entries(first).map(([name, value]) => [name, { value }]));
}
