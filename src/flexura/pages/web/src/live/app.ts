import { number } from "../numbers";
import type { SceneData } from "../scene";
import { h } from "../viewer/dom";
import { History, type Values } from "./history";
import { ModeTable, type Pin } from "./modes";
import { Panel } from "./panel";
import { Pins } from "./pins";
import { type FileState, type Numbers, type Opened, type Picture, type Received, type Refused, numbers } from "./protocol";
import { RequirementsPanel } from "./requirements";
import { ResponsePanel } from "./response";
import { toldOfLink } from "./link";
import { Saving } from "./saving";
import { Stage } from "./stage";
import { StressPanel } from "./stress";
import { element, watchTools } from "./tools";

/** Measures of the browser's clock from a moved slider to the frame that shows it, and to its numbers. */
const MEASURE = "flexura slider to picture";
const TO_NUMBERS = "flexura slider to numbers";

/** Milliseconds from the hand to the picture from which it is said that it is slow. */
const SLOW = 300;

/** A design: its numbers, and its picture once it is there. */
interface Design {
  numbers: Numbers;
  picture?: { message: Picture; bytes?: ArrayBuffer };
}

/** The page: what the hand does goes out, what comes back is shown. */
export class App {
  private readonly history = new History();
  private readonly panel: Panel;
  private readonly requirements = new RequirementsPanel(element("live-requirements"));
  private readonly modes: ModeTable;
  private readonly response: ResponsePanel;
  private readonly stress: StressPanel;
  private readonly saving: Saving;
  private readonly stage = new Stage(element("live-viewer"));
  private readonly pins: Pins;
  private readonly refresh: () => void;
  private opened: Opened | null = null;
  private file: FileState | null = null;
  private refused: Refused | null = null;
  private connected = "";
  private serial = 0;
  private shown: number | null = null;
  private held: Design | null = null;
  private recent: Design | null = null;
  private written: Numbers | null = null;
  private readonly begun = new Map<number, number>();

  constructor(private readonly send: (message: object) => void) {
    this.panel = new Panel(element("live-sliders"), (name, value, resting) => this.moved(name, value, resting));
    const results = element("live-results");
    const sections = [0, 1, 2].map(() => h("section", {}));
    results.append(...sections);
    this.modes = new ModeTable(sections[0], (mode) => this.choose(mode));
    this.response = new ResponsePanel(sections[1], () => this.ask());
    this.stress = new StressPanel(sections[2], () => this.ask());
    this.pins = new Pins(element("live-pins"), (values) => this.go(values), () => this.compared());
    this.saving = new Saving(element<HTMLFormElement>("live-saving"), (file, overwrite) =>
      this.send({ type: "save", file, values: this.history.values, overwrite }),
    );
    const tools = {
      undo: () => this.back(() => this.history.undo()),
      redo: () => this.back(() => this.history.redo()),
      reset: () => this.go({}),
      pin: () => this.pin(),
      save: () => this.saving.open(`${(this.opened?.file ?? "").replace(/\.ya?ml$/, "")}-variant.yaml`),
    };
    this.refresh = watchTools(this.history, tools, () => this.opened !== null && !this.pins.isFull, () => this.stage.help());
  }

  /** What became of the connection. */
  linked(state: "open" | "cut" | "refused", seconds: number): void {
    this.connected = toldOfLink(state, seconds);
    this.begun.clear();
    this.told();
  }

  private scene(scene: SceneData, bytes?: ArrayBuffer): void {
    void this.stage.show(scene, bytes).then(() => this.draw(this.recent?.picture));
  }

  take(own: Received): void {
    const { message, bytes } = own;
    if ("serial" in message && message.serial > this.serial) return;
    switch (message.type) {
      case "scene":
        return this.scene(message.scene, bytes);
      case "opened":
        return this.open(message);
      case "numbers":
        return this.numbers(message);
      case "picture":
        return this.picture({ message, bytes });
      case "holds":
        return this.holds(message.serial);
      case "facts":
        return this.stage.tell(message.facts);
      case "settled":
        return this.busy(message.serial < this.serial);
      case "motions":
        return this.modes.tell(message.texts);
      case "model errors":
        return this.modes.doubt(message);
      case "requirements":
        return this.requirements.update(message);
      case "stress":
        return this.stress.update(message);
      case "response":
        if (bytes) this.response.update(message, numbers(bytes, message.buffers.curves));
        return;
      case "no response":
        return this.response.refuse(message.error);
      case "refused":
        return this.refuse(message);
      case "file":
        this.file = message;
        return this.told();
      case "exists":
        return this.saving.exists(message.file);
      case "saved":
        return this.saving.saved(message.file);
      case "not saved":
        return this.saving.failed(message.text);
    }
  }

  private open(own: Opened): void {
    this.opened = own;
    this.file = this.refused = null;
    element("live-file").textContent = own.file;
    element("live-title").textContent = own.name;
    document.title = `${own.name}: live`;
    const lost = this.history.keep(new Set(own.sliders.map((slider) => slider.name)));
    const gone = lost.length ? [`The file no longer has ${lost.join(", ")}.`] : [];
    element("live-notes").textContent = [...own.notes, ...gone].join("; ");
    this.panel.build(own.sliders);
    this.panel.show(this.history.values);
    this.response.open(own);
    this.stress.open(own);
    this.refresh();
    this.told();
    this.ask(false);
  }

  private moved(name: string, value: number | null, resting: boolean): void {
    const values: Record<string, number> = { ...this.history.values };
    const file = this.opened?.sliders.find((own) => own.name === name)?.value;
    if (value === null || value === file) delete values[name];
    else values[name] = value;
    const before = this.history.values;
    this.history.change(values, resting ? "" : name);
    if (resting) this.history.rest();
    if (before !== this.history.values) this.changed(resting);
  }

  private go(values: Values): void {
    this.history.change(values);
    this.changed(true);
  }

  private back(step: () => void): void {
    step();
    this.changed(true);
  }

  private changed(rebuilt: boolean): void {
    this.panel.show(this.history.values);
    if (rebuilt) this.history.rest();
    this.refresh();
    this.ask();
  }

  private ask(moved = true): void {
    this.serial += 1;
    this.requirements.wait();
    if (moved) this.begun.set(this.serial, performance.now());
    const own = { type: "design", serial: this.serial, values: this.history.values, modes: this.opened?.modes ?? 6 };
    this.busy(true);
    this.send({ ...own, shown: this.shown, response: this.response.asked, load: this.stress.load });
  }

  /** Whether results of the latest design are still on their way. */
  private busy(own: boolean): void {
    element("live-results").setAttribute("aria-busy", String(own));
  }

  private choose(mode: number): void {
    this.shown = mode;
    this.ask();
  }

  private numbers(own: Numbers): void {
    const start = this.begun.get(own.serial);
    if (start !== undefined) performance.measure(TO_NUMBERS, { start, detail: { serial: own.serial, server: own.timing } });
    if (this.refused !== null && own.serial > this.refused.serial) {
      this.refused = null;
      this.told();
    }
    this.recent = { numbers: own };
    this.shown ??= own.shown;
    this.write(own);
  }

  private picture(own: NonNullable<Design["picture"]>): void {
    if (this.recent?.numbers.serial === own.message.serial) this.recent.picture = own;
    this.draw(own);
  }

  /** Show the numbers of a design. */
  private write(own: Numbers): void {
    this.written = own;
    this.panel.follow(own.derived, own.bounds);
    this.response.mark(own.rows);
    this.modes.update(own, this.compare(own));
  }

  /** Show a picture in the next frame. */
  private draw(own: Design["picture"]): void {
    if (own === undefined) return;
    const arrived = performance.now();
    void this.stage.move(own.bytes, own.message).then(() => this.measure(own.message, arrived));
  }

  /** Time from the hand to the end of the frame that shows the picture. */
  private measure(message: Picture, arrived: number): void {
    const start = this.begun.get(message.serial);
    for (const serial of this.begun.keys()) if (serial <= message.serial) this.begun.delete(serial);
    if (start === undefined) return;
    const moved = performance.now();
    requestAnimationFrame(() => {
      const channel = new MessageChannel();
      channel.port1.onmessage = () => {
        const end = performance.now();
        const detail = { serial: message.serial, arrived: arrived - start, moved: moved - start, server: message.timing };
        performance.measure(MEASURE, { start, end, detail });
        element("live-time").textContent = this.pace(end - start, Object.values(message.timing).reduce((a, b) => a + b, 0));
      };
      channel.port2.postMessage(null);
    });
  }

  /** How fast the picture followed, ms, of which the design took some to be worked out. */
  private pace(took: number, worked: number): string {
    if (took < SLOW) return `${Math.round(took)} ms`;
    const why = worked > took / 2 ? `${this.opened?.members ?? 0} members` : "mostly to draw or wait";
    return `follows slowly: ${number(took / 1000, 2)} s a move, ${why}`;
  }

  private holds(serial: number): void {
    if (this.recent?.numbers.serial === serial) this.held = this.recent;
  }

  private refuse(own: Refused): void {
    if (own.serial < this.serial && this.refused === null) return;
    this.refused = own;
    this.busy(own.serial < this.serial);
    if (this.held !== null && this.held !== this.recent) {
      this.write(this.held.numbers);
      this.draw(this.held.picture);
    }
    this.told();
  }

  private pin(): void {
    const hz = new Map((this.written?.rows ?? []).map((row) => [row.mode, row.hz]));
    this.pins.add(this.history.values, hz, this.response.curves);
  }

  private compared(): void {
    if (this.written) this.modes.update(this.written, this.compare(this.written));
    this.response.compare(this.pins.list);
    this.refresh();
  }

  /** What frequencies are compared with: the file, once something differs from it, and the pins. */
  private compare(own: Numbers): Pin[] {
    const hz = new Map(Object.entries(own.file).map(([mode, value]) => [Number(mode), value]));
    const file = Object.keys(this.history.values).length ? [{ label: "file", hz }] : [];
    return [...file, ...this.pins.list];
  }

  /** Say in one line how things are, and below it what is wrong. */
  private told(): void {
    const broken = this.file;
    const words = this.connected || (broken ? (broken.gone ? "The file is gone: the last that was read is shown." : "The file cannot be read: the last that could is shown.") : this.refused ? "This design cannot be: the last that can is shown, greyed." : "Follows the file and the hand.");
    element("live-status").textContent = words;
    element("live-status").className = this.connected || broken || this.refused ? "bad" : "soft";
    document.body.classList.toggle("live-stale", Boolean(this.connected || this.refused));
    this.panel.wrong(this.refused?.problems ?? []);
    const lines = [
      ...(broken?.problems ?? []).map((own) => [own.where, own.text, own.hint && `hint: ${own.hint}`].filter(Boolean).join(": ")),
      ...(this.refused?.problems ?? []).map((own) => own.text),
    ];
    const box = element("live-problems");
    box.hidden = lines.length === 0;
    box.replaceChildren(h("ul", {}, ...lines.map((text) => h("li", {}, text))));
  }
}
