import type { History } from "./history";

type Tool = "undo" | "redo" | "reset" | "pin" | "save";

/** Buttons and keys of the page: Ctrl+Z and Ctrl+Y (or with Shift), and ? for help, but where text is typed. What is returned sets which can be pressed. */
export function watchTools(history: History, act: Record<Tool, () => void>, canPin: () => boolean, help: () => void): () => void {
  const button = (name: string) => document.getElementById(`live-${name}`) as HTMLButtonElement;
  for (const name of Object.keys(act) as Tool[]) button(name).addEventListener("click", () => act[name]());
  watchThemeButton();
  document.addEventListener("keydown", (event) => {
    const typing = event.target instanceof HTMLInputElement && event.target.type !== "range" && event.target.type !== "radio";
    if (typing || event.target instanceof HTMLSelectElement || event.defaultPrevented) return;
    if (event.key === "?") return help();
    if (!(event.ctrlKey || event.metaKey)) return;
    const key = event.key.toLowerCase();
    const name = key === "z" ? (event.shiftKey ? "redo" : "undo") : key === "y" ? "redo" : null;
    if (name === null) return;
    event.preventDefault();
    act[name]();
  });
  const refresh = () => {
    const changed = Object.keys(history.values).length > 0;
    button("undo").disabled = !history.canUndo;
    button("redo").disabled = !history.canRedo;
    button("reset").disabled = !changed;
    button("save").disabled = !changed;
    button("pin").disabled = !canPin();
  };
  return refresh;
}

/** The button that turns the page dark or light. */
export function watchThemeButton(): void {
  element("live-theme").addEventListener("click", () => {
    const root = document.documentElement;
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = dark ? "light" : "dark";
  });
}

export function element<T extends HTMLElement = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found as T;
}
