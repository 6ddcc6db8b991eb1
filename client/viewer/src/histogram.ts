// Numbers of elements in bins, as bars that select.

import { cssColour, rampColour } from "./colours.js";
import { rangeOf, type Measure } from "./measures.js";

export const BINS = 36;

/** The scale by which numbers become colours and bins. */
export class Scale {
  readonly low: number;
  readonly high: number;
  readonly isLogarithmic: boolean;

  constructor(measure: Measure) {
    const range = rangeOf(measure.ofVertices ?? measure.values) ?? { low: 0, high: 1 };
    this.low = measure.id === "angle" ? 0 : range.low;
    this.high = range.high > this.low ? range.high : this.low + (Math.abs(this.low) || 1);
    this.isLogarithmic = measure.logarithmic && this.low > 0 && this.high > 20 * this.low;
  }

  /** In [0, 1] for a number in the range; NaN for one that is none. */
  at(value: number): number {
    return this.isLogarithmic
      ? Math.log(value / this.low) / Math.log(this.high / this.low)
      : // Halves, since a difference may be too large a number.
        (value / 2 - this.low / 2) / (this.high / 2 - this.low / 2);
  }

  value(t: number): number {
    return this.isLogarithmic ? this.low * (this.high / this.low) ** t : this.low * (1 - t) + this.high * t;
  }

  bin(value: number): number {
    const t = this.at(value);
    return Number.isNaN(t) ? -1 : Math.min(BINS - 1, Math.max(0, Math.floor(t * BINS)));
  }

  colourAt(value: number): number {
    const t = this.at(value);
    return Number.isNaN(t) ? -1 : Math.min(1, Math.max(0, t));
  }
}

export function formatNumber(value: number, unit = ""): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "none" : value > 0 ? "∞" : "−∞";
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(2) : `${Number(value.toPrecision(4))}`;
  return text.replace(/-/g, "−") + unit;
}

export const formatCount = (count: number): string => count.toLocaleString("en-GB").replace(/,/g, "\u202f");

/** A group of toggles, one a bin; drag, Shift and the arrows select several. */
export class Histogram {
  private readonly bars: HTMLButtonElement[] = [];
  private anchor = -1;
  private current = 0;
  private dragging = false;
  private first = 0;
  private last = BINS - 1;

  constructor(
    group: HTMLElement,
    private readonly select: (bins: { first: number; last: number } | null) => void,
  ) {
    for (let i = 0; i < BINS; ++i) {
      const bar = document.createElement("button");
      bar.type = "button";
      bar.className = "bar";
      bar.tabIndex = i === 0 ? 0 : -1;
      bar.append(document.createElement("span"));
      bar.addEventListener("pointerdown", (event) => {
        this.dragging = true;
        bar.releasePointerCapture(event.pointerId);
        this.press(i, event.shiftKey);
      });
      bar.addEventListener("pointerenter", () => {
        if (this.dragging) this.extend(i);
      });
      bar.addEventListener("click", (event) => {
        if (event.detail === 0) this.press(i, event.shiftKey); // From the keyboard.
      });
      bar.addEventListener("keydown", (event) => this.move(event));
      this.bars.push(bar);
      group.append(bar);
    }
    window.addEventListener("pointerup", () => (this.dragging = false));
  }

  /** Shows the counts of the elements that `counts` says. */
  show(scale: Scale, unit: string, counts: Uint32Array): void {
    const most = Math.max(1, ...counts);
    this.bars.forEach((bar, i) => {
      const low = formatNumber(scale.value(i / BINS), unit);
      const high = formatNumber(scale.value((i + 1) / BINS), unit);
      const text = `${low} to ${high}: ${formatCount(counts[i])} elements`;
      bar.setAttribute("aria-label", text);
      bar.title = text;
      const fill = bar.firstElementChild as HTMLElement;
      fill.style.height = counts[i] === 0 ? "0" : `${Math.max(3, (100 * counts[i]) / most)}%`;
      fill.style.background = cssColour(rampColour((i + 0.5) / BINS));
    });
    this.mark(0, BINS - 1);
  }

  clear(): void {
    this.anchor = -1;
    this.mark(0, BINS - 1);
  }

  private press(i: number, extends_: boolean): void {
    if (extends_ && this.anchor >= 0) {
      this.extend(i);
    } else if (this.anchor === i && this.first === i && this.last === i) {
      this.clear();
      this.select(null);
    } else {
      this.anchor = i;
      this.extend(i);
    }
    this.focus(i);
  }

  private extend(i: number): void {
    this.mark(Math.min(this.anchor, i), Math.max(this.anchor, i));
    this.select({ first: this.first, last: this.last });
  }

  private mark(first: number, last: number): void {
    this.first = first;
    this.last = last;
    const all = first === 0 && last === BINS - 1;
    this.bars.forEach((bar, i) => {
      const inside = i >= first && i <= last;
      bar.setAttribute("aria-pressed", `${inside && !all}`);
      bar.classList.toggle("out", !inside);
    });
  }

  private focus(i: number): void {
    this.bars[this.current].tabIndex = -1;
    this.current = i;
    this.bars[i].tabIndex = 0;
    this.bars[i].focus();
  }

  private move(event: KeyboardEvent): void {
    const steps: { [key: string]: number } = { ArrowRight: 1, ArrowLeft: -1, Home: -BINS, End: BINS };
    const step = steps[event.key];
    if (step === undefined) return;
    event.preventDefault();
    const next = Math.min(BINS - 1, Math.max(0, this.current + step));
    if (event.shiftKey && this.anchor >= 0) this.extend(next);
    this.focus(next);
  }
}
