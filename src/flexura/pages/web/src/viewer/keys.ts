import type { Commands } from "./state";
import type { Stage } from "./stage";
import { VIEWS } from "./views";

/** What keys do that are no command of a button. */
export interface Keyed extends Commands {
  readonly stage: Stage;
  toggle(): void;
  step(by: 1 | -1): void;
  loop(): void;
  nextMotion(by: number): void;
  nextPart(by: number): void;
  nextColour(): void;
}

const TURN = Math.PI / 24;
const MOVE = 0.05;

/** Act on a key; whether it meant anything. */
export function press(viewer: Keyed, event: KeyboardEvent): boolean {
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  const target = event.target as HTMLElement;
  if (target.closest("select, dialog")) return false;
  const onPicture = target.tagName === "CANVAS" || target.classList.contains("fx-viewer");
  if (onPicture && (arrows(viewer.stage, event) || (event.key === " " && acted(() => viewer.toggle())))) return true;
  const view = Object.entries(VIEWS).find(([, own]) => own.key === event.key);
  if (view) return acted(() => viewer.look(view[0]));
  const act = letters(viewer)[event.key];
  return act !== undefined && acted(act);
}

function acted(act: () => void): true {
  act();
  return true;
}

function arrows(stage: Stage, event: KeyboardEvent): boolean {
  const by: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const own = by[event.key];
  if (!own) return false;
  if (event.shiftKey) stage.shift(-MOVE * own[0], -MOVE * own[1]);
  else stage.turn(-TURN * own[0], -TURN * own[1]);
  return true;
}

function letters(viewer: Keyed): Record<string, () => void> {
  const { state, stage } = viewer;
  const cut = (axis: 0 | 1 | 2) => () => viewer.cut(state.section?.axis === axis ? null : axis);
  return {
    ",": () => viewer.step(-1),
    ".": () => viewer.step(1),
    l: () => viewer.loop(),
    "[": () => viewer.nextMotion(-1),
    "]": () => viewer.nextMotion(1),
    c: () => viewer.nextColour(),
    "+": () => stage.zoom(1.2),
    "=": () => stage.zoom(1.2),
    "-": () => stage.zoom(1 / 1.2),
    f: () => viewer.fit(),
    F: () => viewer.toggleFull(),
    o: () => viewer.set({ parallel: !state.parallel }),
    g: () => viewer.set({ ghost: !state.ghost }),
    t: () => viewer.set({ seeThrough: !state.seeThrough }),
    x: cut(0),
    y: cut(1),
    z: cut(2),
    n: () => viewer.nextPart(1),
    p: () => viewer.nextPart(-1),
    Escape: () => viewer.set({ selected: -1 }),
    "?": () => viewer.toggleHelp(),
  };
}
