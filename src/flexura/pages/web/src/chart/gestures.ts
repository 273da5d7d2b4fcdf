/** Pointers, wheel and keys of a chart as moves of its view. */

export interface Moves {
  /** Zoom by a factor about a pixel. */
  zoom(factor: number, pixel: number): void;
  pan(pixels: number): void;
  /** Zoom to what is between two pixels. */
  select(from: number, to: number): void;
  reset(): void;
  /** Put the crosshair at a pixel, or away. */
  read(pixel: number | null): void;
  /** Choose what is at a place; without one, what is at the crosshair. */
  choose(x: number, y: number): void;
  /** Move the crosshair by so many points. */
  step(points: number): void;
  /** Show the range that is being selected, or none. */
  brush(from: number, to: number | null): void;
}

const CLICK = 5;
const KEYS: Record<string, (moves: Moves, large: boolean) => void> = {
  ArrowLeft: (m, large) => m.step(large ? -10 : -1),
  ArrowRight: (m, large) => m.step(large ? 10 : 1),
  "+": (m) => m.zoom(1 / 1.5, NaN),
  "=": (m) => m.zoom(1 / 1.5, NaN),
  "-": (m) => m.zoom(1.5, NaN),
  "0": (m) => m.reset(),
  Home: (m) => m.reset(),
  Enter: (m) => m.choose(NaN, NaN),
  Escape: (m) => m.read(null),
};

/** Listen on an element; the function that is returned ends it. Pixels are from its left. */
export function gestures(element: HTMLElement, moves: Moves): () => void {
  const ends = new AbortController();
  const { signal } = ends;
  const held = new Map<number, number>();
  let from = NaN;
  const place = (event: MouseEvent) => event.clientX - element.getBoundingClientRect().left;
  const on = <K extends keyof HTMLElementEventMap>(name: K, act: (event: HTMLElementEventMap[K]) => void, passive = true) =>
    element.addEventListener(name, act, { signal, passive });

  on("pointerdown", (event) => {
    if (event.button) {
      return;
    }
    held.set(event.pointerId, place(event));
    from = held.size === 1 ? place(event) : NaN;
    element.focus({ preventScroll: true });
    element.setPointerCapture(event.pointerId);
  });
  on("pointermove", (event) => {
    const [now, before] = [place(event), held.get(event.pointerId)];
    if (before === undefined) {
      moves.read(now);
      return;
    }
    if (held.size === 2) {
      const other = [...held].find(([id]) => id !== event.pointerId)![1];
      const [apart, was] = [Math.abs(now - other), Math.abs(before - other)];
      if (apart > 4 && was > 4) {
        moves.zoom(was / apart, (now + other) / 2);
      }
    } else if (event.pointerType === "touch" || event.shiftKey) {
      moves.pan(now - before);
    } else {
      moves.brush(from, now);
    }
    held.set(event.pointerId, now);
  });
  const released = (event: PointerEvent) => {
    const drawn = held.delete(event.pointerId) && event.type === "pointerup" && Number.isFinite(from);
    moves.brush(0, null);
    if (drawn && event.pointerType !== "touch" && !event.shiftKey && Math.abs(place(event) - from) > CLICK) {
      moves.select(from, place(event));
    } else if (drawn) {
      moves.read(place(event));
      moves.choose(place(event), event.clientY - element.getBoundingClientRect().top);
    }
    from = NaN;
  };
  on("pointerup", released);
  on("pointercancel", released);
  on("pointerleave", (event) => {
    if (event.pointerType === "mouse" && !held.size) {
      moves.read(null);
    }
  });
  on("dblclick", () => moves.reset());
  on(
    "wheel",
    (event) => {
      if (!(event.ctrlKey || event.metaKey || document.activeElement === element)) {
        return;
      }
      event.preventDefault();
      if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
        moves.pan(-event.deltaX);
      } else {
        moves.zoom(Math.exp(Math.max(-1, Math.min(1, event.deltaY / 300))), place(event));
      }
    },
    false,
  );
  on(
    "keydown",
    (event) => {
      const act = event.ctrlKey || event.metaKey || event.altKey ? undefined : KEYS[event.key];
      if (act) {
        event.preventDefault();
        act(moves, event.shiftKey);
      }
    },
    false,
  );
  return () => ends.abort();
}
