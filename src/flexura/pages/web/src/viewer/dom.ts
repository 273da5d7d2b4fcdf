type Child = Node | string | null | undefined | false;
type Attributes = Record<string, string | number | boolean | null | ((event: never) => void)>;

/** An element with attributes (functions: listeners; false and null: left out) and children; text is never markup. */
export function h<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value as EventListener);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null) element.setAttribute(name, String(value));
  }
  element.append(...children.filter((child): child is Node | string => child !== null && child !== undefined && child !== false));
  return element;
}

const SVG = "http://www.w3.org/2000/svg";

/** A drawing of 24 x 24 in lines, by paths. */
export function icon(...paths: string[]): SVGSVGElement {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  for (const d of paths) {
    const path = document.createElementNS(SVG, "path");
    path.setAttribute("d", d);
    svg.append(path);
  }
  return svg;
}

let counted = 0;

/** A name for an element that no other element of the page has. */
export function unique(stem: string): string {
  counted += 1;
  return `fx-${stem}-${counted}`;
}

/** A place in a mechanism of a size, m, told to a thousandth of the size. */
export function placeText(at: number, size: number): string {
  const [factor, unit] = size >= 10 ? [1, "m"] : size >= 1e-3 ? [1e-3, "mm"] : size >= 1e-6 ? [1e-6, "µm"] : [1e-9, "nm"];
  const decimals = Math.min(Math.max(-Math.floor(Math.log10((size || 1) / factor / 100)) - 1, 0), 6);
  return `${(at / factor).toFixed(decimals)} ${unit}`;
}
