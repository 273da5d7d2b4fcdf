import { type Chart, type ChartData, type Curve, mountChart } from "../chart";
import { h } from "../viewer/dom";
import type { Asked, Opened, Response, Row } from "./protocol";

/** A frequency response that was received. */
export interface Curves {
  hz: ArrayLike<number>;
  magnitude: ArrayLike<number>;
  phase: ArrayLike<number>;
  of: string;
  unit: string;
}

/** The frequency response: between what, over which band, with which damping; and its chart, with those of pins. */
export class ResponsePanel {
  asked: Asked | null = null;
  curves: Curves | null = null;
  private readonly input = h("input", { list: "live-inputs", "aria-label": "input" });
  private readonly output = h("input", { list: "live-outputs", "aria-label": "output" });
  private readonly low = h("input", { type: "text", inputmode: "decimal", size: 6, "aria-label": "from, Hz" });
  private readonly high = h("input", { type: "text", inputmode: "decimal", size: 6, "aria-label": "to, Hz" });
  private readonly damping = h("input", { type: "text", inputmode: "decimal", size: 6, placeholder: "described", "aria-label": "damping ratio" });
  private readonly inputs = h("datalist", { id: "live-inputs" });
  private readonly outputs = h("datalist", { id: "live-outputs" });
  private readonly figure = h("figure", {});
  private readonly note = h("p", { class: "soft" });
  private chart: Chart | null = null;
  private rows: Row[] = [];
  private pins: { label: string; curves: Curves | null }[] = [];

  constructor(host: HTMLElement, asks: () => void) {
    const fields = [this.input, this.output, this.low, this.high, this.damping];
    for (const field of fields) {
      field.addEventListener("change", () => {
        if (this.read()) asks();
      });
    }
    const named = (text: string, ...own: HTMLElement[]) => h("label", {}, h("span", {}, text), ...own);
    host.append(
      h("h2", {}, "Frequency response"),
      h("div", { class: "live-fields" }, named("input", this.input), named("output", this.output), named("from, Hz", this.low), named("to, Hz", this.high), named("damping", this.damping), this.inputs, this.outputs),
      this.figure,
      this.note,
    );
  }

  open(own: Opened): void {
    const options = (names: string[]) => names.map((value) => h("option", { value }));
    this.inputs.replaceChildren(...options(own.inputs));
    this.outputs.replaceChildren(...options(own.outputs));
    if (this.asked === null) this.asked = own.response;
    this.input.value = this.asked?.input ?? "";
    this.output.value = this.asked?.output ?? "";
    this.low.value = String(this.asked?.low ?? "");
    this.high.value = String(this.asked?.high ?? "");
  }

  update(own: Response, values: Float32Array): void {
    const n = own.buffers.curves.shape[1];
    this.curves = { hz: values.subarray(0, n), magnitude: values.subarray(n, 2 * n), phase: values.subarray(2 * n, 3 * n), of: `${own.input} ${own.output}`, unit: own.unit };
    this.say([...own.warnings, ...own.notes], own.warnings.length > 0);
    this.draw();
  }

  refuse(text: string): void {
    this.say([text], true);
  }

  /** The rows of the modes, whose frequencies are marked. */
  mark(rows: Row[]): void {
    this.rows = rows;
  }

  compare(pins: { label: string; curves: Curves | null }[]): void {
    this.pins = pins;
    this.draw();
  }

  private say(texts: string[], bad: boolean): void {
    this.note.textContent = texts.join("; ");
    this.note.className = bad ? "warning" : "soft";
  }

  private read(): boolean {
    const [low, high] = [Number(this.low.value), Number(this.high.value)];
    const damping = this.damping.value.trim() === "" ? null : Number(this.damping.value);
    const wrong = !(low > 0) || !(high > low) ? "the band goes from a frequency above 0 to a higher one, in Hz" : damping !== null && !(damping >= 0 && damping < 1) ? "a damping ratio lies from 0 to below 1" : "";
    if (wrong) this.refuse(wrong);
    else this.asked = { input: this.input.value.trim(), output: this.output.value.trim(), low, high, damping };
    return wrong === "";
  }

  private draw(): void {
    const own = this.curves;
    if (own === null) return;
    const ghosts = this.pins.filter((pin) => pin.curves?.of === own.of);
    const curves = (pick: (of: Curves) => ArrayLike<number>): Curve[] => [
      ...ghosts.map((pin): Curve => ({ name: pin.label, values: pick(pin.curves as Curves), x: (pin.curves as Curves).hz, style: "pinned" })),
      { name: "now", values: pick(own) },
    ];
    const [low, high] = [own.hz[0], own.hz[own.hz.length - 1]];
    const marks = this.rows.filter((row) => row.hz >= low && row.hz <= high).map((row) => ({ x: row.hz, label: `mode ${row.mode}`, short: String(row.mode) }));
    const data: ChartData = {
      id: "response",
      title: `${this.asked?.output ?? ""} per ${this.asked?.input ?? ""}`,
      x: { label: "frequency", unit: "Hz", log: true, values: own.hz },
      panels: [
        { label: "magnitude", unit: own.unit, log: true, curves: curves((of) => of.magnitude), marks, weight: 2 },
        { label: "phase", unit: "deg", log: false, curves: curves((of) => of.phase) },
      ],
    };
    if (this.chart === null) this.chart = mountChart(this.figure, data);
    else this.chart.update(data);
  }
}
