// The vertices of a mesh over time: a curve, and how many come in a second.

import { count } from "./elements.js";

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 300;
const HEIGHT = 40;
/** Of a curve. When there are more, every other one goes. */
const MOST_PLACES = 400;
/** Seconds of a phase before which a mean says little. */
const LEAST_TIME = 0.5;

interface Place {
  readonly seconds: number;
  readonly vertices: number;
}

export class Growth {
  readonly element = document.createElementNS(SVG, "svg");
  private readonly line = document.createElementNS(SVG, "polyline");
  private places: Place[] = [];
  private work = "";
  private phase = "";
  private first: Place = { seconds: 0, vertices: 0 };

  constructor() {
    this.element.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT}`);
    this.element.setAttribute("preserveAspectRatio", "none");
    this.element.setAttribute("role", "img");
    this.element.classList.add("growth");
    this.element.append(this.line);
    this.draw();
  }

  /** Takes note of the vertices that `work` has in a phase at a time. A curve ends where other work begins. */
  add(work: string, phase: string, vertices: number, seconds: number): void {
    if (work !== this.work) this.places = [];
    if (work !== this.work || phase !== this.phase) this.first = { seconds, vertices };
    this.work = work;
    this.phase = phase;
    this.places.push({ seconds, vertices });
    if (this.places.length > MOST_PLACES) this.places = this.places.filter((_, i) => i % 2 === 0);
    this.draw();
  }

  /** The mean number of vertices that came in a second of this phase; null: it cannot be told. */
  get rate(): number | null {
    const last = this.places.at(-1);
    if (last === undefined) return null;
    const seconds = last.seconds - this.first.seconds;
    const vertices = last.vertices - this.first.vertices;
    return seconds >= LEAST_TIME && vertices > 0 ? vertices / seconds : null;
  }

  private draw(): void {
    const first = this.places[0];
    const last = this.places.at(-1);
    const most = Math.max(0, ...this.places.map((place) => place.vertices));
    const grows = first !== undefined && last !== undefined && last.seconds > first.seconds && most > 0;
    this.element.toggleAttribute("hidden", !grows);
    if (!grows) return;
    const x = ({ seconds }: Place): number => ((seconds - first.seconds) / (last.seconds - first.seconds)) * WIDTH;
    const y = ({ vertices }: Place): number => HEIGHT - 1 - (vertices / most) * (HEIGHT - 2);
    const points = this.places.map((place) => `${x(place).toFixed(1)},${y(place).toFixed(1)}`);
    this.line.setAttribute("points", points.join(" "));
    const seconds = Math.round(last.seconds - first.seconds);
    this.element.setAttribute("aria-label", `Vertices over ${seconds} s, up to ${count(most)}`);
  }
}
