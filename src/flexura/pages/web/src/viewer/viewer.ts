import type { DataTexture } from "three";
import type { Fact, Part, SceneData } from "../scene";
import type { Move, Options, Viewer } from "./api";
import { h } from "./dom";
import { Drawing } from "./drawing";
import { type Keyed, press } from "./keys";
import { Labels } from "./labels";
import { Frame, Model } from "./model";
import { ColourBar, Tip, Title, helpPanel } from "./overlays";
import { Panel } from "./panel";
import { PlayBar } from "./playbar";
import { Player } from "./player";
import { listenToPointer } from "./pointer";
import { saveModel, savePicture } from "./saving";
import { Shown } from "./shown";
import { Stage } from "./stage";
import { KINDS, type State, firstState, opacityOf, sequenceOf } from "./state";
import { Still } from "./still";
import { isDark, theme, watchTheme } from "./theme";
import { Toolbar } from "./toolbar";
import { Triad } from "./triad";

const POINTED = 250; // ms: as often it is looked up what a motion brings under the pointer
const NARROW = 760; // CSS pixels: the controls fold away

/** A scene in 3-D with its controls. */
export class LiveViewer implements Viewer, Keyed {
  readonly root: HTMLElement;
  readonly stage: Stage;
  readonly state: State;
  private readonly shown: Shown;
  private readonly drawing: Drawing;
  private readonly player = new Player();
  private readonly picture = h("div", { class: "fx-picture" });
  private readonly labels = new Labels();
  private readonly triad = new Triad();
  private readonly tip = new Tip();
  private readonly bar = new ColourBar();
  private readonly title = new Title();
  private readonly said = h("div", { class: "fx-said", role: "status", "aria-live": "polite" });
  private readonly help: HTMLDialogElement;
  private readonly panel: Panel;
  private readonly playbar: PlayBar;
  private readonly toolbar: Toolbar;
  private readonly stopTheme: () => void;
  private readonly narrowing: ResizeObserver;
  private readonly still: Still;
  private tables: DataTexture[] = [];
  private values: [string, string][] = [];
  private pointer: { x: number; y: number } | null = null; // where it rests
  private pointed = 0; // ms, when it was looked up what is there; 0: not since it moved
  private loading = 0;
  private wasPlaying = false;
  private copied = ""; // last text on the clipboard
  private decorated = 0; // pose that axes and arrows are of

  /** Throws where there is no WebGL 2. */
  constructor(
    private readonly host: HTMLElement,
    private model: Model,
    options: Options,
  ) {
    this.state = firstState(model.scene);
    if (options.motion !== undefined) this.state.shown = options.motion;
    this.shown = new Shown(model, this.state, this.player);
    this.root = h("div", { class: "fx-viewer", role: "group", "aria-label": `3-D view of ${model.scene.name}` });
    this.host.append(this.root);
    try {
      this.stage = new Stage(this.picture);
    } catch (error) {
      this.root.remove();
      throw error;
    }
    this.drawing = new Drawing(this.stage, model);
    this.panel = new Panel(this, () => this.values);
    this.playbar = new PlayBar(this, this.player, () => this.changed(), () => this.shown.scale);
    this.toolbar = new Toolbar(this);
    this.help = helpPanel(() => this.toggleHelp());
    this.still = new Still(model.scene, "The browser took its 3-D graphics away; the picture moves again when they are back.");
    this.still.element.hidden = true;
    this.picture.append(this.labels.host, this.triad.canvas, this.title.element, this.bar.element, this.toolbar.element, this.tip.element, this.still.element);
    this.root.append(this.picture, this.playbar.element, this.panel.element, this.said, this.help);
    this.narrowing = new ResizeObserver(() => this.root.classList.toggle("fx-narrow", this.root.clientWidth < NARROW));
    this.narrowing.observe(this.root);
    this.stopTheme = watchTheme(() => this.repaint());
    this.listen();
    this.repaint();
    this.player.playing = options.autoplay !== false && !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.stage.look("iso");
    this.dress();
    this.show(this.state.shown);
  }

  get scene(): SceneData {
    return this.model.scene;
  }

  get pose(): number {
    return this.shown.pose;
  }

  async update(scene: SceneData, binary?: ArrayBuffer): Promise<void> {
    const fresh = Frame.of(scene);
    const { size } = this.model.frame;
    const same = fresh.size < 4 * size && size < 4 * fresh.size;
    const selected = this.scene.parts[this.state.selected]?.name;
    this.model = this.shown.model = await Model.of(scene, binary, same ? this.model.frame : fresh);
    this.drawing.replace(this.model);
    this.still.update(scene);
    this.state.selected = scene.parts.findIndex((part) => part.name === selected);
    if (!same) this.stage.fit();
    if (this.shown.motions.length === 0) this.state.shown = firstState(scene).shown;
    this.dress();
    await this.load();
  }

  async move(change: Move): Promise<void> {
    for (const own of change.motions ?? []) {
      const motion = this.model.motions.get(own.id);
      if (motion) Object.assign(motion, own);
    }
    this.stage.hurry();
    this.model.move(change.points, change.displacements ?? {});
    this.drawing.replace(this.model);
    this.drawing.fields.clear();
    await this.load();
  }

  show(id: string | null): void {
    this.state.shown = id;
    const { motions } = this.shown;
    const sequence = sequenceOf(this.scene, id);
    this.player.start(sequence ? "sequence" : (motions[0]?.nature ?? "displacement"), motions.length);
    if (!motions.some((own) => own.colours.some((colour) => colour.key === this.state.colour))) this.state.colour = KINDS;
    void this.load().then(() => this.say(this.shown.sentence));
  }

  select(part: string | null): void {
    this.set({ selected: this.scene.parts.findIndex((own) => own.name === part) });
  }

  /** Say what there is to know of the parts, by number; nothing of those that are left out. */
  tell(facts: Fact[][]): void {
    this.scene.parts.forEach((part, k) => (part.facts = facts[k] ?? []));
    this.pointed = 0;
    this.changed();
  }

  set(change: Partial<State>): void {
    Object.assign(this.state, change);
    if (change.seeThrough !== undefined || change.hidden !== undefined) this.dress();
    if (change.seeThrough !== undefined) this.repaint();
    if (change.parallel !== undefined) this.stage.project(change.parallel);
    if (change.selected !== undefined) void this.tellSelected();
    if (change.colour !== undefined || change.marks !== undefined) void this.load().then(() => this.say(this.shown.sentence));
    else this.changed();
  }

  /** Put a text on the clipboard; where the browser forbids that it stands in the panel to be copied by hand. */
  copy(text: string): void {
    const told = (done: boolean) => {
      this.copied = done ? text : "";
      this.pointed = 0;
      this.changed();
      this.say(done ? `copied ${text}` : `the clipboard is not to be had: ${text}`);
    };
    const written = navigator.clipboard?.writeText(text) ?? Promise.reject(new Error("no clipboard"));
    written.then(() => told(true), () => told(false));
  }

  toggleKind(key: string): void {
    const hidden = new Set(this.state.hidden);
    if (!hidden.delete(key)) hidden.add(key);
    this.set({ hidden });
    this.say(`${this.model.kinds.get(key)?.label ?? key} ${hidden.has(key) ? "hidden" : "shown"}`);
  }

  /** Cut across an axis, so that the side next to the reader goes. */
  cut(axis: 0 | 1 | 2 | null): void {
    const { view, controls } = this.stage;
    const flipped = axis !== null && view.position.getComponent(axis) < controls.target.getComponent(axis);
    this.set({ section: axis === null ? null : { axis, share: this.state.section?.share ?? 0.5, flipped } });
    this.say(axis === null ? "no section" : `section across ${"xyz"[axis]}`);
  }

  look(view: string): void {
    this.stage.look(view);
    this.say(`seen from: ${view}`);
  }

  fit(): void {
    this.stage.fit();
  }

  toggle(): void {
    this.player.toggle();
    this.changed();
    this.say(this.shown.sentence);
  }

  step(by: 1 | -1): void {
    this.player.step(by);
    this.changed();
  }

  loop(): void {
    this.player.loop = !this.player.loop;
    this.changed();
  }

  nextMotion(by: number): void {
    this.panel.motions.next(by);
  }

  nextPart(by: number): void {
    const count = this.scene.parts.length;
    if (count > 0) this.set({ selected: (Math.max(this.state.selected, by > 0 ? -1 : 0) + by + count) % count });
  }

  nextColour(): void {
    const keys = [KINDS, ...(this.shown.motions[0]?.colours.map((own) => own.key) ?? [])];
    this.set({ colour: keys[(keys.indexOf(this.state.colour) + 1) % keys.length] });
  }

  toggleFull(): void {
    if (document.fullscreenElement) void document.exitFullscreen();
    else void this.root.requestFullscreen?.();
  }

  toggleHelp(): void {
    if (this.help.open) this.help.close();
    else this.help.showModal();
  }

  togglePanel(): void {
    this.root.classList.toggle("fx-open");
  }

  savePicture(): void {
    this.prepareFrame(performance.now());
    savePicture(this.stage, this.shown, this.labels.texts, theme(isDark(this.root)));
  }

  saveModel(): void {
    void saveModel(this.shown, this.state);
  }

  dispose(): void {
    this.stopTheme();
    this.narrowing.disconnect();
    this.drawing.dispose();
    this.stage.dispose();
    this.root.remove();
  }

  private say(text: string): void {
    this.said.textContent = text;
  }

  /** Fetch what the state shows, then show it; what was asked for later wins. */
  private async load(): Promise<void> {
    const turn = ++this.loading;
    const { motions } = this.shown;
    const fields = this.drawing.fields;
    const asked = motions.map((own) => fields.of(own.id, this.state.colour, this.shown.weight(own)));
    if (asked.length === 0) asked.push(fields.of(null, KINDS));
    const tables = await Promise.all(asked);
    if (turn !== this.loading) return;
    this.tables = tables;
    this.shown.reach = Math.max(...tables.map((table) => (table.userData as { largest: number }).largest));
    this.drawing.colourBy(this.shown.quantity !== null);
    this.decorate();
    await this.tellSelected();
    this.changed();
  }

  /** Axes, arrows and labels of the motion, or of the pose of a sequence. */
  private decorate(): void {
    this.decorated = this.pose;
    this.drawing.decor.show(this.model, this.shown.motions[this.pose] ?? null, this.state.marks);
    this.labels.set(this.drawing.decor.labels);
  }

  private dress(): void {
    const looks = this.scene.parts.map((part) => {
      const kind = this.model.kinds.get(part.kind);
      const colour = kind?.colour ?? "#999999";
      return {
        colour: [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16)) as [number, number, number],
        opacity: kind ? opacityOf(kind, this.state.seeThrough) : 1,
        shown: !this.state.hidden.has(part.kind),
      };
    });
    this.drawing.dress(looks);
    this.drawing.select(this.state.selected);
  }

  /** Bring controls and picture in line with the state. */
  private changed(): void {
    const { title, subtitle } = this.shown.heading;
    const motions = this.shown.motions;
    this.drawing.showGhost(this.state.ghost);
    this.drawing.cut(this.state.section);
    this.drawing.select(this.state.selected);
    this.bar.show(this.shown.quantity, this.unknown());
    this.title.show(this.scene.name, motions, title, subtitle);
    this.playbar.update();
    this.panel.update();
    this.toolbar.update();
    this.stage.ask();
  }

  private unknown(): boolean {
    return this.shown.quantity?.values !== null;
  }

  private async tellSelected(): Promise<void> {
    this.values = await this.shown.values(this.state.selected);
    this.changed();
    const part = this.scene.parts[this.state.selected];
    if (part) this.say([`selected ${part.name}`, ...[...part.facts, ...this.values].map(([name, value]) => `${name} ${value}`)].join(", "));
  }

  private prepareFrame(now: number): boolean {
    const more = this.player.tick(now);
    const motions = this.shown.motions;
    const [first, second, share] = this.tables.length > 1 ? this.player.between : [0, 0, 0];
    if (this.tables.length) this.drawing.field(this.tables[first], this.tables[second]);
    const scale = motions.length ? motions[0].factor * this.state.factor : 0;
    this.drawing.move(scale * this.player.amount, share);
    this.stage.reach = scale * this.shown.reach;
    if (this.pose !== this.decorated) {
      this.decorate();
      this.panel.motions.tell();
    }
    this.playbar.follow();
    if (!more && this.wasPlaying) this.playbar.update();
    this.wasPlaying = more;
    return more;
  }

  private repaint(): void {
    const dark = isDark(this.root);
    this.root.dataset.theme = dark ? "dark" : "light";
    this.drawing.paint(theme(dark), this.state.seeThrough);
  }

  private listen(): void {
    const { stage } = this;
    stage.canvas.setAttribute("role", "img");
    stage.canvas.setAttribute("aria-label", `${this.scene.name} in 3-D; press ? for keys`);
    stage.onFrame = (now) => {
      if (this.pointed === 0 || (this.player.playing && now - this.pointed > POINTED)) this.point(now);
      return this.prepareFrame(now);
    };
    stage.onDraw = () => this.drawing.prepare();
    stage.onDrawn = () => {
      this.triad.draw(stage.view);
      const over = [this.bar.element, this.toolbar.element].filter((own) => !own.hidden);
      const boxes = over.map((own): [number, number, number, number] => [own.offsetLeft, own.offsetTop, own.offsetWidth, own.offsetHeight]);
      this.labels.place(stage.view, this.picture.clientWidth, this.picture.clientHeight, boxes);
    };
    stage.onContext = (lost) => {
      this.still.element.hidden = !lost;
      this.say(lost ? "The 3-D graphics are gone: a still picture is shown." : this.shown.sentence);
    };
    this.root.addEventListener("keydown", (event) => {
      if (press(this, event)) event.preventDefault();
    });
    listenToPointer(stage.canvas, (at) => this.pointAt(at), (at) => {
      const selected = this.drawing.picker.at(at.x, at.y);
      this.set({ selected });
      const text = this.scene.parts[selected]?.choices?.[0]?.[0];
      if (text !== undefined) this.copy(text);
      this.pointAt(at);
    });
  }

  /** What a click on a part copies, or has copied. */
  private choice(part: Part): Fact[] {
    const text = part.choices?.[0]?.[0];
    return text === undefined ? [] : [[text === this.copied ? "copied" : "click to copy", text]];
  }

  private pointAt(at: { x: number; y: number } | null): void {
    this.pointer = at;
    this.pointed = 0;
    if (at === null) this.tip.hide();
    if (at === null) this.drawing.hover(-1);
    this.stage.ask();
  }

  private point(now: number): void {
    const at = this.pointer;
    this.pointed = now;
    if (!at) return;
    const number = this.drawing.picker.at(at.x, at.y);
    this.drawing.hover(number);
    const part = this.scene.parts[number];
    if (!part) return this.tip.hide();
    void this.shown.values(number).then((values) => {
      const kind = this.model.kinds.get(part.kind)?.label ?? part.kind;
      const facts = part.facts.filter(([name]) => name !== "kind").slice(0, 7);
      this.tip.show(part.name, part.facts.find(([name]) => name === "kind")?.[1] ?? kind, [...this.choice(part), ...facts, ...values], at.x, at.y, this.picture.clientWidth, this.picture.clientHeight);
    });
  }
}
