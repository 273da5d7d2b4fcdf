/** Numbers of sliders that differ from the file, in their units. */
export type Values = Readonly<Record<string, number>>;

const MOST = 500;

/** The designs of this page, with the way back and forth; a gesture, such as one drag, is one step. */
export class History {
  private past: Values[] = [];
  private future: Values[] = [];
  private gesture = "";
  private own: Values = {};

  get values(): Values {
    return this.own;
  }

  get canUndo(): boolean {
    return this.past.length > 0;
  }

  get canRedo(): boolean {
    return this.future.length > 0;
  }

  /** Go to other values; those of the gesture that goes on replace one another. */
  change(values: Values, gesture = ""): void {
    if (same(values, this.own)) return;
    if (gesture === "" || gesture !== this.gesture) this.past.push(this.own);
    if (this.past.length > MOST) this.past.shift();
    this.gesture = gesture;
    this.future = [];
    this.own = values;
  }

  /** The next change is a step of its own. */
  rest(): void {
    this.gesture = "";
  }

  undo(): void {
    this.go(this.past, this.future);
  }

  redo(): void {
    this.go(this.future, this.past);
  }

  /** Forget parameters that the file no longer has; their names. */
  keep(known: Set<string>): string[] {
    const lost = new Set<string>();
    const kept = (values: Values): Values => {
      const found: Record<string, number> = {};
      for (const [name, value] of Object.entries(values)) {
        if (known.has(name)) found[name] = value;
        else lost.add(name);
      }
      return found;
    };
    this.own = kept(this.own);
    this.past = this.past.map(kept);
    this.future = this.future.map(kept);
    return [...lost];
  }

  private go(from: Values[], to: Values[]): void {
    const found = from.pop();
    if (found === undefined) return;
    to.push(this.own);
    this.own = found;
    this.gesture = "";
  }
}

function same(a: Values, b: Values): boolean {
  const names = Object.keys(a);
  return names.length === Object.keys(b).length && names.every((name) => a[name] === b[name]);
}
