interface Place {
  x: number;
  y: number;
}

const STILL = 5; // CSS pixels: less between press and release is a click

/** Say where the pointer rests (null: elsewhere, or turning the view), and where it clicked. */
export function listenToPointer(canvas: HTMLCanvasElement, rests: (at: Place | null) => void, clicked: (at: Place) => void): void {
  let down: Place | null = null;
  const place = (event: PointerEvent) => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  canvas.addEventListener("pointermove", (event) => rests(event.buttons === 0 ? place(event) : null));
  canvas.addEventListener("pointerleave", () => rests(null));
  canvas.addEventListener("pointerdown", (event) => {
    down = event.button === 0 ? place(event) : null;
  });
  canvas.addEventListener("pointerup", (event) => {
    const up = place(event);
    if (down && Math.hypot(up.x - down.x, up.y - down.y) < STILL) clicked(up);
    down = null;
  });
}
