import { App } from "./app";
import { Link } from "./link";
import css from "./style.css";

/** Start the live page. */
export function startLive(): void {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(css);
  document.adoptedStyleSheets = [...document.adoptedStyleSheets, sheet];
  const app = new App((message) => link.send(message));
  const link: Link = new Link(
    (own) => app.take(own),
    (state, seconds) => app.linked(state, seconds),
  );
}
