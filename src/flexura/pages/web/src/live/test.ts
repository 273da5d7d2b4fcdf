import { type Chart, type ChartData, type Curve, mountChart } from "../chart";
import type { SceneData } from "../scene";
import { type Viewer, mountViewer } from "../viewer";
import { h } from "../viewer/dom";
import { toldOfLink } from "./link";
import { type Place, type Received, numbers } from "./protocol";
import { Saving } from "./saving";
import { element, watchThemeButton } from "./tools";

/** A frequency, Hz, and the model order whose pole nearest to it is picked; without an order the mode that is there. */
type Pick = [hz: number, order: number | null];

interface Diagram {
  type: "diagram";
  poles: { hz: number[]; order: number[]; damping: number[]; stable: number[] };
  indicator: { hz: number[]; values: number[] };
  setups: string[];
  setup: number;
  outputs: string[];
  inputs: string[];
}

interface Modes {
  type: "modes";
  serial: number;
  columns: Record<string, (string | number)[]>;
  hz: number[]; // of the setup that is shown
  misfit: string;
  notes: string[];
  pair: [number, number];
  curves: Place; // lines, then magnitude and phase as measured and as given back
  scene: SceneData | null;
  shapes: string; // why there is none
  command: string;
}

type Told =
  | { type: "opened"; name: string; file: string; notes: string[] }
  | Diagram
  | Modes
  | { type: "no modes"; serial: number; text: string }
  | { type: "file"; gone: boolean; problems: { text: string }[] }
  | { type: "exists" | "saved"; file: string }
  | { type: "not saved"; file: string; text: string };

/** Bits of a pole that is stable in frequency and damping, and in its shape, too. */
const [BOTH, ALL] = [3, 7];

/** The page of a test: poles that are picked go out, modes come back. */
export class TestApp {
  private picks: Pick[] | null = null;
  private serial = 0;
  private file = "";
  private diagram: Diagram | null = null;
  private modes: Modes | null = null;
  private shown = 0; // row of the mode whose shape is shown
  private pair: [number, number] | null = null;
  private classes: Record<string, number[]> = {};
  private poles: Chart | null = null;
  private synthesis: Chart | null = null;
  private viewer: Viewer | null = null;
  private busy: Promise<void> = Promise.resolve();
  private readonly saving: Saving;
  private readonly low = field("from, Hz");
  private readonly high = field("to, Hz");
  private readonly order = field("largest order");
  private readonly refine = h("input", { type: "checkbox", checked: true });
  private readonly together = h("input", { type: "checkbox" });
  private readonly setup = h("select", { "aria-label": "setup" });
  private readonly output = h("select", { "aria-label": "output" });
  private readonly input = h("select", { "aria-label": "input" });
  private readonly text = h("input", { type: "text", spellcheck: "false", placeholder: "chosen by themselves; click poles, or type 12.5@24, 40", "aria-label": "picks as frequency@order, Hz" });
  private readonly begin = h("button", { type: "button", click: () => this.take_over() }, "Begin with these modes");
  private readonly clear = h("button", { type: "button", click: () => this.pick(null) }, "Clear");
  private readonly severals = h("span", { class: "live-fields", hidden: true }, labelled("setup", this.setup), labelled("all setups as one", this.together));

  constructor(private readonly send: (message: object) => void) {
    const asks = [this.low, this.high, this.order, this.refine, this.together, this.setup];
    for (const own of asks) own.addEventListener("change", () => this.ask());
    for (const own of [this.output, this.input]) {
      own.addEventListener("change", () => {
        this.pair = [Number(this.output.value), Number(this.input.value)];
        this.ask();
      });
    }
    const options = element<HTMLFormElement>("test-options");
    options.append(labelled("from, Hz", this.low), labelled("to, Hz", this.high), labelled("largest order", this.order), labelled("fit to the responses", this.refine), this.severals);
    const picks = element<HTMLFormElement>("test-picks");
    picks.append(labelled("picks, as frequency@order in Hz", this.text), this.begin, this.clear);
    for (const form of [options, picks]) form.addEventListener("submit", (event) => event.preventDefault());
    this.text.addEventListener("change", () => this.typed());
    element("test-pair").append(labelled("output", this.output), labelled("input", this.input));
    this.saving = new Saving(element<HTMLFormElement>("live-saving"), (file, overwrite) => this.send({ type: "save", file, serial: this.serial, overwrite }));
    element("live-save").addEventListener("click", () => this.saving.open(`${this.file.replace(/\.[^.]*$/, "")}-modes.json`));
    watchThemeButton();
  }

  linked(state: "open" | "cut" | "refused", seconds: number): void {
    const told = toldOfLink(state, seconds);
    this.say(told || "Working.", told !== "");
  }

  take(own: Received): void {
    const message = own.message as unknown as Told;
    switch (message.type) {
      case "opened":
        this.file = message.file;
        return this.ask();
      case "diagram":
        this.diagram = message;
        return this.drawPoles();
      case "modes":
        if (message.serial === this.serial && own.bytes) this.show(message, own.bytes);
        return;
      case "no modes":
        if (message.serial === this.serial) this.refuse(message.text);
        return;
      case "file":
        return this.say(`The file cannot be read; what was read before is shown. ${message.problems.map((own) => own.text).join("; ")}`, true);
      case "exists":
        return this.saving.exists(message.file);
      case "saved":
        return this.saving.saved(message.file);
      case "not saved":
        return this.saving.failed(message.text);
    }
  }

  private ask(): void {
    this.serial += 1;
    const band = this.low.value || this.high.value ? [Number(this.low.value), Number(this.high.value)] : null;
    const order = this.order.value.trim() ? Number(this.order.value) : null;
    if ((band && !(band[0] >= 0 && band[1] > band[0])) || (order !== null && !Number.isInteger(order))) return this.refuse("a band goes from a frequency to a higher one, in Hz, and an order is a whole number");
    const options = { band, order, setups: this.together.checked ? "together" : "each" };
    this.say("Working.");
    element<HTMLButtonElement>("live-save").disabled = true;
    this.send({ type: "choose", serial: this.serial, options, picks: this.picks, refine: this.refine.checked, setup: Number(this.setup.value || 0), pair: this.pair });
  }

  private pick(picks: Pick[] | null): void {
    this.picks = picks?.length ? picks : null;
    this.text.value = (this.picks ?? []).map(([hz, order]) => `${Number(hz.toPrecision(9))}${order === null ? "" : `@${order}`}`).join(", ");
    this.drawPoles();
    this.ask();
  }

  private typed(): void {
    const found = this.text.value.split(",").filter((own) => own.trim());
    const picks = found.map((own) => own.replace(/hz\s*$/i, "").split("@").map(Number)).map(([hz, order]): Pick => [hz, order ?? null]);
    if (picks.some(([hz, order]) => !(hz > 0) || !(order === null || Number.isInteger(order)))) return this.refuse("picks are frequencies in Hz, each with a model order behind @ or alone, such as 12.5@24, 40");
    this.pick(picks);
  }

  /** Pick a pole, or let it go. */
  private toggle(index: number): void {
    const { hz, order } = (this.diagram as Diagram).poles;
    const picks = this.picks ?? [];
    const rest = picks.filter(([f, n]) => !(n === order[index] && Math.abs(f / hz[index] - 1) < 1e-8));
    this.pick(rest.length < picks.length ? rest : [...picks, [hz[index], order[index]]]);
  }

  /** Make picks of the modes that are shown. */
  private take_over(): void {
    if (this.modes) this.pick(this.modes.hz.map((hz): Pick => [Number(hz.toPrecision(9)), null]));
  }

  private drawPoles(): void {
    const own = this.diagram;
    if (own === null) return;
    const { hz, order, stable } = own.poles;
    const all = hz.map((_, k) => k);
    this.classes = {
      "pole": all.filter((k) => (stable[k] & BOTH) !== BOTH),
      "frequency and damping stable": all.filter((k) => (stable[k] & ALL) === BOTH),
      "shape stable too": all.filter((k) => (stable[k] & ALL) === ALL),
    };
    const styles = ["dot", "cross", "ring"] as const;
    const curves = Object.entries(this.classes).map(([name, at], k): Curve => ({ name, style: styles[k], x: at.map((i) => hz[i]), values: at.map((i) => order[i]) }));
    const picked = (this.picks ?? []).filter(([, n]) => n !== null).sort((a, b) => a[0] - b[0]);
    curves.push({ name: "picked", style: "disc", x: picked.map(([f]) => f), values: picked.map(([, n]) => n) });
    const data: ChartData = {
      id: "poles",
      title: "stabilisation diagram",
      description: "Poles over frequency and model order; a click, or Enter at the crosshair, picks one.",
      x: { label: "frequency", unit: "Hz", log: false, values: own.indicator.hz },
      panels: [{ label: "model order; behind it the mode indicator function", unit: "", log: false, curves, weight: 1.7, behind: { name: "indicator", values: own.indicator.values }, marks: this.modes?.hz.map((x) => ({ x, label: `${x.toPrecision(5)}` })) ?? [] }],
    };
    if (this.poles === null) this.poles = mountChart(element("test-diagram"), data, (curve, index) => this.clicked(curve, index));
    else this.poles.update(data);
    this.severals.hidden = own.setups.length < 2 && !this.together.checked;
    fill(this.setup, own.setups, own.setup);
    fill(this.output, own.outputs, this.modes?.pair[0] ?? 0);
    fill(this.input, own.inputs, this.modes?.pair[1] ?? 0);
  }

  private clicked(curve: string, index: number): void {
    if (curve !== "picked") return this.toggle(this.classes[curve][index]);
    const picked = (this.picks ?? []).filter(([, n]) => n !== null).sort((a, b) => a[0] - b[0])[index];
    this.pick((this.picks ?? []).filter((own) => own !== picked));
  }

  private show(own: Modes, bytes: ArrayBuffer): void {
    this.modes = own;
    const count = own.columns.mode.length;
    this.shown = Math.min(this.shown, count - 1);
    this.say(`${count} ${count === 1 ? "mode" : "modes"}, ${this.picks ? "picked" : "chosen by themselves"}; error of the fit ${own.misfit}.`);
    element<HTMLButtonElement>("live-save").disabled = false;
    this.drawPoles();
    this.drawTable(own);
    this.drawSynthesis(own, numbers(bytes, own.curves));
    element("test-shapes").textContent = own.shapes;
    element("live-viewer").hidden = own.scene === null;
    if (own.scene !== null) this.drawShapes(own.scene, bytes);
  }

  private drawTable(own: Modes): void {
    const names = Object.keys(own.columns);
    const rows = own.columns.mode.map((_, k) => {
      const show = () => this.choose(k);
      return h("tr", { "aria-selected": String(k === this.shown), click: show }, ...names.map((name, c) => h("td", {}, c ? String(own.columns[name][k]) : h("button", { type: "button", title: "show its shape", click: show }, String(k + 1)))));
    });
    const head = h("thead", {}, h("tr", {}, ...names.map((name) => h("th", { scope: "col" }, name))));
    const notes = own.notes.map((text) => h("li", {}, text));
    const same = h("p", { class: "soft" }, "The same in the shell: ", h("code", {}, own.command));
    element("test-modes").replaceChildren(h("div", { class: "scroll" }, h("table", {}, head, h("tbody", {}, ...rows))), h("ul", { class: "soft" }, ...notes), same);
  }

  private choose(mode: number): void {
    this.shown = mode;
    this.viewer?.show(`mode-${mode + 1}`);
    for (const [k, row] of document.querySelectorAll("#test-modes tbody tr").entries()) row.setAttribute("aria-selected", String(k === mode));
  }

  private drawSynthesis(own: Modes, values: Float32Array): void {
    const n = own.curves.shape[1];
    const row = (k: number) => values.subarray(k * n, (k + 1) * n);
    const curves = (k: number): Curve[] => [{ name: "measured", values: row(k) }, { name: "modes", values: row(k + 2), style: "pinned" }];
    const marks = own.hz.map((x, k) => ({ x, label: `${k + 1}` }));
    const data: ChartData = {
      id: "synthesis",
      title: "measured, and given back by the modes",
      x: { label: "frequency", unit: "Hz", log: false, values: row(0) },
      panels: [
        { label: "magnitude, SI", unit: "", log: true, curves: curves(1), marks },
        { label: "phase", unit: "deg", log: false, curves: curves(2) },
      ],
    };
    if (this.synthesis === null) this.synthesis = mountChart(element("test-synthesis"), data);
    else this.synthesis.update(data);
  }

  private drawShapes(scene: SceneData, binary: ArrayBuffer): void {
    const motion = `mode-${this.shown + 1}`;
    this.busy = this.busy.then(async () => {
      if (this.viewer === null) this.viewer = await mountViewer(element("live-viewer"), scene, { motion, binary });
      else {
        await this.viewer.update(scene, binary);
        this.viewer.show(motion);
      }
    });
  }

  private refuse(text: string): void {
    this.say("These are refused; the modes before are shown, greyed.", true, text);
  }

  private say(text: string, bad = false, problem = ""): void {
    element("live-status").textContent = text;
    element("live-status").className = bad ? "bad" : "soft";
    document.body.classList.toggle("live-stale", bad);
    element("live-problems").hidden = problem === "";
    element("live-problems").textContent = problem;
  }
}

function field(label: string): HTMLInputElement {
  return h("input", { type: "text", inputmode: "decimal", size: 7, "aria-label": label });
}

function labelled(text: string, control: HTMLElement): HTMLElement {
  return h("label", {}, h("span", {}, text), control);
}

function fill(select: HTMLSelectElement, names: string[], chosen: number): void {
  select.replaceChildren(...names.map((name, k) => h("option", { value: k, selected: k === chosen }, name)));
}
