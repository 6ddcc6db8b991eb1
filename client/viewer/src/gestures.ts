// Mouse, fingers and keys on the canvas.

import type { View } from "./view.js";

const STILL = 4; // pixels that a click may move
const TURN = 0.008; // radians a pixel

/** Sends gestures on the canvas to the camera. `click` gets a place, from −1 to 1; `hover` one or null. */
export function listen(
  canvas: HTMLCanvasElement,
  view: View,
  click: (x: number, y: number) => void,
  hover: (place: { x: number; y: number } | null) => void,
): void {
  const { camera } = view;
  const pointers = new Map<number, { x: number; y: number }>();
  let moved = 0;

  const middle = (): { x: number; y: number; spread: number } => {
    const [a, b] = [...pointers.values()];
    return b
      ? { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, spread: Math.hypot(a.x - b.x, a.y - b.y) }
      : { ...a, spread: 0 };
  };
  /** Pixels from the middle of the canvas. */
  const fromMiddle = (x: number, y: number): [number, number] => {
    const box = canvas.getBoundingClientRect();
    return [x - box.left - box.width / 2, y - box.top - box.height / 2];
  };
  const relative = (event: PointerEvent): { x: number; y: number } => {
    const box = canvas.getBoundingClientRect();
    const [x, y] = fromMiddle(event.clientX, event.clientY);
    return { x: (2 * x) / box.width, y: (-2 * y) / box.height };
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (pointers.size === 1) moved = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!pointers.has(event.pointerId)) {
      hover(relative(event));
      return;
    }
    const before = middle();
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const after = middle();
    const [dx, dy] = [after.x - before.x, after.y - before.y];
    moved += Math.abs(dx) + Math.abs(dy);
    if (pointers.size > 1) {
      camera.pan(dx, dy);
      if (before.spread > 0 && after.spread > 0) {
        camera.zoom(before.spread / after.spread, ...fromMiddle(after.x, after.y));
      }
    } else if (camera.isMap || event.shiftKey || event.buttons > 1) {
      camera.pan(dx, dy);
    } else {
      camera.turn(dx * TURN, dy * TURN);
    }
    view.change("camera");
  });
  const release = (event: PointerEvent): void => {
    const was = pointers.delete(event.pointerId);
    if (was && pointers.size === 0 && moved < STILL && event.type === "pointerup") {
      const { x, y } = relative(event);
      click(x, y);
    }
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("pointerleave", () => hover(null));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => view.fit());
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 24 : 1;
      const steps = Math.min(200, Math.max(-200, event.deltaY * lines));
      camera.zoom(1.0018 ** steps, ...fromMiddle(event.clientX, event.clientY));
      view.change("camera");
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrows: { [key: string]: [number, number] } = {
      ArrowLeft: [-1, 0],
      ArrowRight: [1, 0],
      ArrowUp: [0, -1],
      ArrowDown: [0, 1],
    };
    const arrow = arrows[event.key];
    if (arrow && (camera.isMap || event.shiftKey)) camera.pan(-40 * arrow[0], -40 * arrow[1]);
    else if (arrow) camera.turn(0.12 * arrow[0], 0.12 * arrow[1]);
    else if (event.key === "+" || event.key === "=") camera.zoom(0.8);
    else if (event.key === "-") camera.zoom(1.25);
    else if (event.key === "Home") view.fit();
    else return;
    event.preventDefault();
    view.change("camera");
  });
}
