import { h, icon, placeText, unique } from "./dom";
import { MotionList, factList } from "./motions";
import type { Part } from "../scene";
import { type Commands, KINDS, motionsOf } from "./state";
import { VIEWS } from "./views";

/** Everything beside the picture: motions, colours, parts, views, the section, notes. */
export class Panel {
  readonly element: HTMLElement;
  readonly motions: MotionList;
  private readonly colours = h("select", { class: "fx-select", change: () => this.commands.set({ colour: this.colours.value }) });
  private readonly legend = h("div", { class: "fx-legend" });
  private readonly parts = h("select", { class: "fx-select", change: () => this.commands.set({ selected: Number(this.parts.value) }) });
  private readonly part = h("div", { class: "fx-part" });
  private readonly notes = h("div", { class: "fx-section fx-notes" });
  private readonly section: SectionControls;
  private built: unknown = null;

  constructor(
    private readonly commands: Commands,
    values: (part: number) => [string, string][],
  ) {
    this.values = values;
    this.motions = new MotionList(commands);
    this.section = new SectionControls(commands);
    const views = Object.entries(VIEWS).map(([name, view]) =>
      h("button", { type: "button", class: "fx-button fx-text", title: `seen from: ${view.label} (${view.key})`, click: () => commands.look(name) }, name),
    );
    this.element = h(
      "div",
      { class: "fx-panel", role: "region", "aria-label": "controls of the view", tabindex: 0 },
      this.motions.element,
      this.labelled("Colour", this.colours),
      h("div", { class: "fx-section" }, h("div", { class: "fx-heading" }, "Parts"), this.legend, this.toggles()),
      this.labelled("Selected part", this.parts, this.part),
      h("div", { class: "fx-section" }, h("div", { class: "fx-heading" }, "View"), h("div", { class: "fx-views" }, ...views), this.section.element),
      this.notes,
    );
  }

  private readonly values: (part: number) => [string, string][];

  update(): void {
    const { scene, state } = this.commands;
    if (this.built !== scene) this.rebuild();
    this.built = scene;
    this.motions.update();
    this.fillColours();
    for (const box of this.element.querySelectorAll<HTMLInputElement>("input[data-kind]")) box.checked = !state.hidden.has(box.dataset.kind ?? "");
    for (const box of this.element.querySelectorAll<HTMLInputElement>("input[data-state]")) box.checked = Boolean(state[box.dataset.state as "ghost"]);
    this.parts.value = String(state.selected);
    const part = scene.parts[state.selected];
    this.part.replaceChildren(...(part ? [...this.choices(part), factList([...part.facts, ...this.values(state.selected)])] : []));
    this.section.update();
  }

  private labelled(title: string, control: HTMLElement, ...more: HTMLElement[]): HTMLElement {
    control.id = unique("control");
    return h("div", { class: "fx-section" }, h("label", { class: "fx-heading", for: control.id }, title), control, ...more);
  }

  private toggles(): HTMLElement {
    const toggle = (key: "ghost" | "seeThrough" | "marks" | "parallel", label: string) =>
      h("label", { class: "fx-check" }, h("input", { type: "checkbox", "data-state": key, change: () => this.commands.set({ [key]: !this.commands.state[key] }) }), label);
    return h(
      "div",
      { class: "fx-toggles" },
      toggle("seeThrough", "see through bodies"),
      toggle("ghost", "undeformed outline"),
      toggle("marks", "warning marks"),
      toggle("parallel", "parallel projection"),
    );
  }

  /** Texts that choose a part in a file, each to be copied. */
  private choices(part: Part): HTMLElement[] {
    return (part.choices ?? []).map(([text, told]) =>
      h("button", { type: "button", class: "fx-button fx-text fx-choice", title: "copy", click: () => this.commands.copy(text) }, h("code", {}, text), h("span", {}, told)),
    );
  }

  private rebuild(): void {
    const { scene } = this.commands;
    const counts = new Map<string, number>();
    for (const part of scene.parts) counts.set(part.kind, (counts.get(part.kind) ?? 0) + 1);
    this.legend.replaceChildren(
      ...scene.kinds.map((kind) => {
        const swatch = h("span", { class: "fx-swatch" });
        swatch.style.background = kind.colour;
        const box = h("input", { type: "checkbox", "data-kind": kind.key, change: () => this.commands.toggleKind(kind.key) });
        return h("label", { class: "fx-check" }, box, swatch, kind.label, h("span", { class: "fx-count" }, String(counts.get(kind.key) ?? 0)));
      }),
    );
    this.parts.replaceChildren(h("option", { value: -1 }, "none"), ...scene.parts.map((part, k) => h("option", { value: k }, part.name)));
    this.notes.hidden = scene.notes.length === 0;
    this.notes.replaceChildren(h("div", { class: "fx-heading" }, "Notes"), ...scene.notes.map((text) => h("p", {}, text)));
  }

  private fillColours(): void {
    const { scene, state } = this.commands;
    const motion = motionsOf(scene, state.shown)[0];
    const offered = [[KINDS, "kinds of parts"], ...(motion?.colours ?? []).map((own) => [own.key, own.label])];
    const now = offered.map(([key]) => key).join("\n");
    if (this.colours.dataset.offered !== now)
      this.colours.replaceChildren(...offered.map(([key, label]) => h("option", { value: key }, label)));
    this.colours.dataset.offered = now;
    this.colours.value = offered.some(([key]) => key === state.colour) ? state.colour : KINDS;
  }
}

/** Where the model is cut open. */
class SectionControls {
  readonly element: HTMLElement;
  private readonly axis: HTMLSelectElement;
  private readonly share: HTMLInputElement;
  private readonly text = h("output", {});
  private readonly flip: HTMLButtonElement;

  constructor(private readonly commands: Commands) {
    this.axis = h("select", { class: "fx-select", "aria-label": "section across", change: () => this.choose() }, ...["no section", "across x", "across y", "across z"].map((label, k) => h("option", { value: k - 1 }, label)));
    const move = () => commands.state.section && commands.set({ section: { ...commands.state.section, share: Number(this.share.value) } });
    this.share = h("input", { type: "range", min: 0, max: 1, step: 0.002, "aria-label": "place of the section", input: move });
    const turn = () => commands.state.section && commands.set({ section: { ...commands.state.section, flipped: !commands.state.section.flipped } });
    this.flip = h("button", { type: "button", class: "fx-button", "aria-label": "show the other side", title: "show the other side", click: turn }, icon("M7 4l-4 4 4 4M3 8h14M17 12l4 4-4 4M21 16H7"));
    this.element = h("div", { class: "fx-cut" }, this.axis, this.share, this.flip, this.text);
  }

  update(): void {
    const { section } = this.commands.state;
    const { bounds } = this.commands.scene;
    this.axis.value = String(section?.axis ?? -1);
    for (const element of [this.share, this.flip, this.text]) element.hidden = !section;
    if (!section) return;
    this.share.value = String(section.share);
    const at = bounds[0][section.axis] + section.share * (bounds[1][section.axis] - bounds[0][section.axis]);
    this.text.textContent = `${"xyz"[section.axis]} = ${placeText(at, this.commands.scene.size)}`;
    this.share.setAttribute("aria-valuetext", this.text.textContent);
  }

  private choose(): void {
    const axis = Number(this.axis.value);
    this.commands.cut(axis < 0 ? null : (axis as 0 | 1 | 2));
  }
}
