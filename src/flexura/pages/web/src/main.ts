// Starts what the page asks for: <body data-page="viewer">, and so on.
import { pageData, upgradeFigures } from "./figures";
import { startReport } from "./report";
import { startLive, startTest } from "./live";
import { render } from "./widget";

/** What starts a kind of page, by the `data-page` of its body. */
const starts: Record<string, () => unknown> = {
  live: startLive,
  test: startTest,
  viewer: () => upgradeFigures(pageData()),
  report: startReport,
};

const page = typeof document === "undefined" ? undefined : document.body?.dataset.page;
if (page !== undefined) {
  void starts[page]?.();
}

/** What anywidget asks of a module. */
export default { render };
