// Sliders of a mechanism in a notebook, as a widget of anywidget.
import { History, type Values } from "./live/history";
import { ModeTable } from "./live/modes";
import { Panel } from "./live/panel";
import { type Numbers, type Received, type Refused, type Slider, received } from "./live/protocol";
import { Stage } from "./live/stage";
import type { SceneData } from "./scene";
import { h } from "./viewer/dom";
import { isDark, watchTheme } from "./viewer/theme";
import css from "./widget.css";

/** What a notebook gives a widget: state that both sides share, and messages. */
export interface WidgetModel {
  get(name: string): unknown;
  on(event: string, listener: (...own: never[]) => void): void;
  off(event: string, listener?: (...own: never[]) => void): void;
  send(content: unknown): void;
}

interface Described {
  name: string;
  sliders: Slider[];
  notes: string[];
}

/** Answers after which nothing more comes of what was asked. */
const LAST = new Set(["picture", "settled", "refused"]);

/** Time after which a kernel that has not answered is said to be busy, ms. */
const PATIENCE = 1500;

/** A view of the widget: one request at a time is out, the last design that the hand made is never lost. */
class View {
  private readonly id = Math.random().toString(36).slice(2);
  private readonly history = new History();
  private readonly panel: Panel;
  private readonly modes: ModeTable;
  private readonly stage: Stage;
  private readonly status = h("p", { class: "soft", role: "status" }, "The kernel is asked.");
  private readonly undo = h("button", { type: "button", click: () => this.go(() => this.history.undo()) }, "Undo");
  private readonly redo = h("button", { type: "button", click: () => this.go(() => this.history.redo()) }, "Redo");
  private readonly reset = h("button", { type: "button", click: () => this.go(() => this.history.change({})) }, "Reset all");
  // a form of its own keeps the choice of a mode apart from that of other widgets
  private readonly results = h("form", { class: "live-results", "aria-label": "natural frequencies", "aria-busy": "true" });
  private readonly mine = new Set<string>();
  private readonly described: Described;
  private serial = 1;
  private asked = 0;
  private detailed = 0;
  private waiting = false;
  private patience = 0;
  private shown: number | null = null;
  private broken = false;

  constructor(
    private readonly model: WidgetModel,
    root: HTMLElement,
  ) {
    const sliders = h("section", { class: "live-sliders", "aria-label": "parameters" });
    const viewer = h("div", { class: "live-viewer" });
    const table = this.results;
    const tools = h("div", { class: "fx-tools", role: "toolbar", "aria-label": "design" }, this.undo, this.redo, this.reset);
    this.described = model.get("described") as Described;
    const notes = this.described.notes.map((text) => h("p", { class: "soft" }, text));
    root.append(h("div", { class: "fx-side" }, tools, sliders), h("div", { class: "fx-main" }, viewer, this.status, ...notes, table));
    this.stage = new Stage(viewer);
    this.panel = new Panel(sliders, (name, value, resting) => this.moved(name, value, resting));
    this.modes = new ModeTable(table, (mode) => this.choose(mode));
    this.panel.build(this.described.sliders);
    this.history.change(model.get("values") as Values);
    this.history.rest();
    this.refresh();
    this.next();
  }

  /** An answer of the kernel. */
  take(content: { view?: string; message?: string }, buffers: DataView[]): void {
    if (content.view !== this.id) return;
    const bytes = buffers[0];
    const data = bytes ? (bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength) as ArrayBuffer) : (content.message ?? "null");
    this.answered(received(data));
    this.next();
  }

  /** Values that Python, or another view, has set. */
  follow(): void {
    const values = this.model.get("values") as Values;
    if (this.mine.has(key(values)) || key(values) === key(this.history.values)) return;
    this.go(() => this.history.change(values));
  }

  dispose(): void {
    clearTimeout(this.patience);
  }

  private answered(own: Received): void {
    const { message } = own;
    if (LAST.has(message.type)) {
      clearTimeout(this.patience);
      this.waiting = false;
    }
    switch (message.type) {
      case "scene":
        void this.stage.show(message.scene as SceneData, own.bytes);
        return;
      case "numbers":
        return this.numbers(message);
      case "picture":
        void this.stage.move(own.bytes, message);
        return;
      case "motions":
        return this.modes.tell(message.texts);
      case "model errors":
        return this.modes.doubt(message);
      case "facts":
        return this.stage.tell(message.facts);
      case "refused":
        return this.refused(message);
    }
  }

  private numbers(message: Numbers): void {
    this.say("", []);
    this.panel.follow(message.derived, message.bounds);
    this.shown ??= message.shown;
    this.modes.update(message, []);
  }

  private refused(message: Refused): void {
    if (message.serial < this.serial) return;
    this.say("This design cannot be: the last that can is shown.", message.problems);
  }

  private say(text: string, problems: Refused["problems"]): void {
    this.broken = problems.length > 0;
    this.status.textContent = text;
    this.status.className = this.broken ? "bad" : "soft";
    this.panel.wrong(problems);
  }

  private moved(name: string, value: number | null, resting: boolean): void {
    const values: Record<string, number> = { ...this.history.values };
    if (value === null || value === this.described.sliders.find((own) => own.name === name)?.value) delete values[name];
    else values[name] = value;
    this.history.change(values, resting ? "" : name);
    if (resting) this.history.rest();
    this.changed();
  }

  private go(step: () => void): void {
    step();
    this.history.rest();
    this.changed();
  }

  private choose(mode: number): void {
    this.shown = mode;
    this.changed();
  }

  private changed(): void {
    this.refresh();
    this.serial += 1;
    this.next();
  }

  private refresh(): void {
    this.panel.show(this.history.values);
    this.undo.disabled = !this.history.canUndo;
    this.redo.disabled = !this.history.canRedo;
    this.reset.disabled = Object.keys(this.history.values).length === 0;
  }

  /** Ask for what is wanted next: the design of the hand, else what takes longer of it. */
  private next(): void {
    if (this.waiting) return;
    if (this.asked < this.serial) {
      this.asked = this.serial;
      const { values } = this.history;
      this.mine.add(key(values));
      this.send({ type: "design", serial: this.serial, values, shown: this.shown });
    } else if (this.detailed < this.serial && !this.broken) {
      this.detailed = this.serial;
      this.send({ type: "details" });
    }
    this.results.setAttribute("aria-busy", String(this.waiting));
  }

  private send(own: object): void {
    this.waiting = true;
    this.patience = window.setTimeout(() => {
      this.status.textContent = "The kernel does not answer yet: it is busy, or it has been stopped.";
    }, PATIENCE);
    this.model.send({ ...own, view: this.id });
  }
}

function key(values: Values): string {
  return JSON.stringify(Object.entries(values).sort());
}

/** Show the widget in an element, which may not be in the page yet; returns what ends it. */
export function render({ model, el }: { model: WidgetModel; el: HTMLElement }): () => void {
  const root = h("div", { class: "fx-sliders" });
  el.append(h("style", {}, css), root);
  let view: View | null = null;
  const begin = (): void => {
    if (!root.isConnected) {
      frame = requestAnimationFrame(begin);
      return;
    }
    paint();
    view = new View(model, root);
  };
  const paint = (): void => {
    root.dataset.theme = isDark(el) ? "dark" : "light";
  };
  const take = (content: { view?: string }, buffers: DataView[]): void => view?.take(content, buffers);
  const follow = (): void => view?.follow();
  model.on("msg:custom", take);
  model.on("change:values", follow);
  const stop = watchTheme(paint);
  let frame = requestAnimationFrame(begin);
  return () => {
    cancelAnimationFrame(frame);
    stop();
    model.off("msg:custom", take);
    model.off("change:values", follow);
    view?.dispose();
    root.remove();
  };
}
