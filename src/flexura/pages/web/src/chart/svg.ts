/** SVG elements that are made once and used again. */

const SVG = "http://www.w3.org/2000/svg";

export type Attributes = Record<string, string | number>;

export function svg<K extends keyof SVGElementTagNameMap>(tag: K, attributes: Attributes = {}): SVGElementTagNameMap[K] {
  const element = document.createElementNS(SVG, tag);
  set(element, attributes);
  return element;
}

export function set(element: Element, attributes: Attributes): void {
  for (const [name, value] of Object.entries(attributes)) {
    const text = String(value);
    if (element.getAttribute(name) !== text) {
      element.setAttribute(name, text);
    }
  }
}

/** Elements of one kind, of which as many are in the parent as are used. */
export class Pool<K extends keyof SVGElementTagNameMap> {
  private readonly elements: SVGElementTagNameMap[K][] = [];
  private used = 0;

  constructor(
    private readonly parent: Element,
    private readonly tag: K,
  ) {}

  begin(): void {
    this.used = 0;
  }

  next(attributes: Attributes, text?: string): SVGElementTagNameMap[K] {
    const element = this.elements[this.used] ?? svg(this.tag);
    this.elements[this.used] = element;
    if (!element.parentNode) {
      this.parent.append(element);
    }
    this.used += 1;
    set(element, attributes);
    if (text !== undefined && element.textContent !== text) {
      element.textContent = text;
    }
    return element;
  }

  end(): void {
    this.elements.slice(this.used).forEach((element) => element.remove());
  }
}
