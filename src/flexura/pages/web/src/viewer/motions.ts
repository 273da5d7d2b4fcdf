import { h, unique } from "./dom";
import { type Commands, choices, motionsOf } from "./state";

/** The list of motions, and what is known of the one shown. */
export class MotionList {
  readonly element = h("div", { class: "fx-section" });
  private readonly about = h("div", { class: "fx-about" });
  private listed = "";
  private inputs: HTMLInputElement[] = [];

  constructor(private readonly commands: Commands) {}

  update(): void {
    const list = choices(this.commands.scene);
    const now = JSON.stringify(list);
    if (now !== this.listed) this.rebuild(list);
    this.listed = now;
    this.element.hidden = list.length === 0;
    const shown = this.commands.state.shown ?? "";
    for (const input of this.inputs) input.checked = input.value === shown;
    this.tell();
  }

  /** The choice `by` places further down, round. */
  next(by: number): void {
    const ids = this.inputs.map((input) => input.value);
    const at = ids.indexOf(this.commands.state.shown ?? "");
    this.commands.show(ids[(at + by + ids.length) % ids.length] || null);
  }

  private rebuild(list: ReturnType<typeof choices>): void {
    const name = unique("motion");
    const item = (id: string, title: string, subtitle: string, flag: string) =>
      h(
        "label",
        { class: "fx-motion" },
        h("input", { type: "radio", name, value: id, change: () => this.commands.show(id || null) }),
        h("span", { class: "fx-motion-title" }, title, flag && h("span", { class: "fx-flag" }, flag)),
        subtitle && h("span", { class: "fx-motion-more" }, subtitle),
      );
    const groups = [...new Set(list.map((own) => own.group))];
    const heading = unique("heading");
    this.element.replaceChildren(
      h("div", { class: "fx-heading", id: heading }, "Motion"),
      h(
        "div",
        { class: "fx-list", role: "radiogroup", "aria-labelledby": heading },
        ...groups.flatMap((group) => [
          groups.length > 1 && h("div", { class: "fx-group" }, group),
          ...list.filter((own) => own.group === group).map((own) => item(own.id, own.title, own.subtitle, own.flag)),
        ]),
        item("", "undeformed", "", ""),
      ),
      this.about,
    );
    this.inputs = [...this.element.querySelectorAll("input")];
  }

  /** Say what is known of what is shown: of a sequence, of the nearest pose. */
  tell(): void {
    const motions = motionsOf(this.commands.scene, this.commands.state.shown);
    const warnings = [...new Set(motions.flatMap((own) => own.warnings))];
    const own = motions[this.commands.pose];
    this.about.replaceChildren(
      ...warnings.map((text) => h("p", { class: "fx-warning" }, text)),
      motions.length > 1 && own ? h("div", { class: "fx-motion-more" }, own.title) : "",
      factList(own?.facts ?? []),
    );
  }
}

export function factList(facts: [string, string][]): HTMLElement {
  return h("dl", { class: "fx-facts", hidden: facts.length === 0 }, ...facts.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)]));
}
