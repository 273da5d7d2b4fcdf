"""A widget of anywidget in a page, with the model's interface that a notebook gives it, and its Python side here."""

from __future__ import annotations

import base64
import json
from typing import Any

from playwright.sync_api import Page

from flexura.pages.viewer import bundle

HARNESS = """async ([source, state]) => {
  const {default: widget} = await import(URL.createObjectURL(new Blob([source], {type: "text/javascript"})));
  const listeners = {};
  const tell = (event, ...own) => (listeners[event] ?? []).forEach((listener) => listener(...own));
  const bytes = (text) => new DataView(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  let queue = Promise.resolve();
  const model = {
    get: (name) => state[name],
    set: (name, value) => { state[name] = value; },
    save_changes: () => {},
    on: (event, listener) => { (listeners[event] ??= []).push(listener); },
    off: (event, listener) => { listeners[event] = (listeners[event] ?? []).filter((own) => own !== listener); },
    send: (content) => {
      queue = queue.then(async () => {
        const replies = JSON.parse(await window.kernel(JSON.stringify(content)));
        for (const [own, buffers] of replies) tell("msg:custom", own, buffers.map(bytes));
      });
    },
  };
  window.sync = (name, value) => { state[name] = value; tell(`change:${name}`); };
  const host = document.createElement("div");
  window.end = widget.render({model, el: host});
  document.body.append(host);
}"""


class Notebook:
    """A page that shows a widget."""

    def __init__(self, page: Page, widget: Any) -> None:
        self.page, self.widget = page, widget
        page.set_default_timeout(15_000)
        self.asked: list[dict[str, Any]] = []
        self._replies: list[Any] = []
        self._inside = False
        widget.send = lambda content, buffers=None: self._replies.append(
            [content, [base64.b64encode(own).decode() for own in buffers or []]]
        )
        page.expose_function("kernel", self._answer)
        widget.observe(lambda change: self._sync(change["new"]), "values")
        state = {"described": widget.described, "values": widget.values}
        page.set_content("<!doctype html><html lang=en><title>notebook</title><body></body></html>")
        page.evaluate(HARNESS, [bundle(), state])

    def _answer(self, text: str) -> str:
        content = json.loads(text)
        self.asked.append(content)
        self._replies.clear()
        self._inside = True
        self.widget._handle_custom_msg(content, [])
        self._inside = False
        return json.dumps(self._replies)

    def _sync(self, values: dict[str, float]) -> None:
        # a page cannot be spoken to while it waits for an answer: such news is of what it has asked for itself
        if not self._inside:
            self.page.evaluate("(values) => window.sync('values', values)", values)

    def rows(self) -> list[list[str]]:
        """The cells of the table of frequencies, once it follows what was asked for last."""
        self.settle()
        return self.page.eval_on_selector_all(
            ".live-modes [data-mode]",
            "rows => rows.map(row => [...row.querySelectorAll('td')].map(cell => cell.textContent.trim()))",
        )

    def settle(self) -> None:
        """Wait until all that was asked for is answered."""
        self.page.wait_for_selector(".live-results[aria-busy=false]", state="attached")
