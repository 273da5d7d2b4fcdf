/** The legend: what each curve is, and its values where the crosshair is. */

import type { ChartData, Curve } from "./data";
import { at, namesOf } from "./data";
import { axisTitle, curveClass } from "./painter";
import { markerOf, nearest } from "./paths";
import { plain } from "./scale";
import { set, svg } from "./svg";

export const DIGITS = 5;

export class Legend {
  readonly element = document.createElement("div");
  private readonly table = this.element.appendChild(document.createElement("table"));
  private readonly heading = this.table.createTHead().insertRow();
  private readonly rows: { name: string; button: HTMLButtonElement; cells: HTMLTableCellElement[] }[] = [];
  private signature = "";

  constructor(private readonly toggled: (name: string) => void) {
    this.element.className = "chart-legend";
    this.table.createTBody();
  }

  /** Rows of the curves, made anew only where these are others. */
  show(data: ChartData, hidden: Set<string>): void {
    const styles = data.panels.map((panel) => [axisTitle(panel), ...panel.curves.map((c) => `${c.name}\n${c.style ?? ""}`)]);
    const signature = JSON.stringify([axisTitle(data.x), styles]);
    if (signature !== this.signature) {
      this.signature = signature;
      this.build(data);
    }
    for (const { name, button } of this.rows) {
      set(button, { "aria-pressed": String(!hidden.has(name)) });
    }
  }

  private build(data: ChartData): void {
    const head = ["curve", ...data.panels.map(axisTitle)].map((text) => {
      const cell = document.createElement("th");
      cell.scope = "col";
      cell.textContent = text;
      return cell;
    });
    this.heading.replaceChildren(...head);
    const body = this.table.tBodies[0]!;
    body.replaceChildren();
    this.rows.length = 0;
    for (const name of namesOf(data)) {
      const row = body.insertRow();
      const curve = data.panels.flatMap((panel) => panel.curves).find((own) => own.name === name)!;
      const button = document.createElement("button");
      button.type = "button";
      button.title = "show or hide this curve";
      const swatch = svg("svg", { width: 24, height: 10, viewBox: "0 0 24 10", "aria-hidden": "true" });
      swatch.append(svg("path", { d: markerOf(curve) ? `M12,5${markerOf(curve)}` : curve.upper ? "M1,1H23V9H1Z" : "M1,5H23", class: curveClass(data, curve) }));
      button.append(swatch, name);
      button.addEventListener("click", () => this.toggled(name));
      const first = row.appendChild(document.createElement("th"));
      first.scope = "row";
      first.append(button);
      this.rows.push({ name, button, cells: data.panels.map(() => row.insertCell()) });
    }
  }

  /** Values of all curves nearest to x; none where it is null. Returns them as a sentence. */
  read(data: ChartData, x: number | null): string {
    const said: string[] = [];
    set(this.heading.cells[0]!, { "data-x": x === null ? "" : String(x) });
    const unit = data.x.unit ? ` ${data.x.unit}` : "";
    this.heading.cells[0]!.textContent = x === null ? "curve" : `at ${plain(x, DIGITS + 1)}${unit}`;
    for (const { name, cells } of this.rows) {
      data.panels.forEach((panel, k) => {
        const curve = panel.curves.find((own) => own.name === name);
        const text = x === null || !curve ? "" : this.value(data, curve, x);
        if (cells[k]!.textContent !== text) {
          cells[k]!.textContent = text;
        }
        if (text) {
          said.push(`${name}: ${panel.label} ${text} ${panel.unit}`);
        }
      });
    }
    return x === null ? "" : `${data.x.label} ${plain(x, DIGITS + 1)}${unit}: ${said.join("; ")}`;
  }

  private value(data: ChartData, curve: Curve, x: number): string {
    const own = curve.x ?? data.x.values;
    const k = nearest(own, x, data.x.log);
    const value = plain(at(curve.values, k), DIGITS);
    return curve.upper ? `${value} to ${plain(at(curve.upper, k), DIGITS)}` : value;
  }
}
