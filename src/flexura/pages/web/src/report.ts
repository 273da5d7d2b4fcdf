/** A report: figures move once they are seen, colours can be turned, and what is essential is printed unfolded. */

import { mountChart } from "./chart";
import { type PageData, pageData } from "./figures";
import { type Viewer, mountViewer } from "./viewer";
import { isDark } from "./viewer/theme";

export function startReport(): void {
  const data = pageData();
  for (const figure of document.querySelectorAll<HTMLElement>("figure[data-chart]")) {
    const own = data.chart?.[figure.dataset.chart ?? ""];
    if (own) {
      mountChart(figure, own);
    }
  }
  const viewers = new Viewers(data);
  for (const figure of document.querySelectorAll<HTMLElement>("figure[data-viewer]")) {
    viewers.onceSeen(figure);
  }
  for (const row of document.querySelectorAll<HTMLTableRowElement>("tr[data-motion]")) {
    viewers.button(row);
  }
  themeButton();
  window.addEventListener("beforeprint", unfold);
}

/** The viewers of the page, each started when it is first needed. */
class Viewers {
  private readonly started = new Map<HTMLElement, Promise<Viewer>>();
  private readonly seen = new IntersectionObserver(
    (entries) => entries.filter((own) => own.isIntersecting).forEach((own) => void this.of(own.target as HTMLElement)),
    { rootMargin: "200px" },
  );

  constructor(private readonly data: PageData) {}

  onceSeen(figure: HTMLElement): void {
    this.seen.observe(figure);
  }

  of(figure: HTMLElement): Promise<Viewer> | undefined {
    this.seen.unobserve(figure);
    const scene = this.data.viewer?.[figure.dataset.viewer ?? ""];
    if (scene && !this.started.has(figure)) {
      this.started.set(figure, mountViewer(figure, scene));
    }
    return this.started.get(figure);
  }

  /** A button in the first cell of a row that shows its motion. */
  button(row: HTMLTableRowElement): void {
    const [figure, cell] = [document.querySelector<HTMLElement>("figure[data-viewer]"), row.cells[0]];
    if (!figure || !cell) {
      return;
    }
    const button = document.createElement("button");
    button.type = "button";
    button.className = "show";
    button.textContent = "▶";
    button.setAttribute("aria-label", `show ${row.dataset.motion} in 3-D`);
    button.addEventListener("click", async () => {
      (await this.of(figure))?.show(row.dataset.motion ?? null);
      figure.scrollIntoView({ block: "nearest" });
    });
    cell.append(" ", button);
  }
}

function themeButton(): void {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "theme";
  const say = () => (button.textContent = isDark(document.body) ? "light" : "dark");
  button.addEventListener("click", () => {
    document.documentElement.dataset.theme = isDark(document.body) ? "light" : "dark";
    say();
  });
  say();
  button.title = "colours of this page";
  document.querySelector("header")?.append(button);
}

/** Browsers that cannot print closed details print these open. */
function unfold(): void {
  document.querySelectorAll<HTMLDetailsElement>("details.essential").forEach((own) => (own.open = true));
}
