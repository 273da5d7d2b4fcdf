import { App } from "./app";
import { Link } from "./link";
import type { Received } from "./protocol";
import css from "./style.css";
import { TestApp } from "./test";

interface Page {
  take(own: Received): void;
  linked(state: "open" | "cut" | "refused", seconds: number): void;
}

/** Start the live page of a mechanism. */
export function startLive(): void {
  start((send) => new App(send));
}

/** Start that of a test. */
export function startTest(): void {
  start((send) => new TestApp(send));
}

function start(make: (send: (message: object) => void) => Page): void {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(css);
  document.adoptedStyleSheets = [...document.adoptedStyleSheets, sheet];
  const app = make((message) => link.send(message));
  const link: Link = new Link(
    (own) => app.take(own),
    (state, seconds) => app.linked(state, seconds),
  );
}
