import { h } from "../viewer/dom";
import type { Requirements } from "./protocol";

const TONES = { met: "good", missed: "bad", "not known": "warning" };

/** What is required of the mechanism: met, missed or not known, with the number. */
export class RequirementsPanel {
  private readonly list = h("ul", { class: "live-requirements" });
  private readonly limits = h("div", {});

  constructor(private readonly host: HTMLElement) {
    host.hidden = true;
    host.append(h("h2", {}, "Requirements"), this.list, this.limits);
  }

  /** A design is worked out: verdicts are still those of the one before. */
  wait(): void {
    this.list.classList.add("soft");
  }

  update(own: Requirements): void {
    this.host.hidden = own.rows.length === 0 && !own.error;
    this.list.classList.remove("soft");
    const rows = own.rows.map(({ name, text, is, verdict, why }) =>
      h("li", { title: why, "data-verdict": verdict }, h("b", { class: TONES[verdict] }, verdict), ` ${name}: ${text}`, h("span", { class: "soft" }, ` ${is}`)),
    );
    const limits = own.limits.map((text) => h("p", { class: "warning" }, text));
    this.list.replaceChildren(...rows, ...(own.error ? [h("li", { class: "bad" }, own.error)] : []));
    this.limits.replaceChildren(...limits);
  }
}
