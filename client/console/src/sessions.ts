// The list of sessions: one card for each, kept while it is there, so that focus stays where it is.

import type { Entry, Formats } from "./api.js";
import * as api from "./api.js";
import { button, bytes, count, duration, make, setText } from "./elements.js";
import { Growth } from "./growth.js";

export interface Actions {
  view(entry: Entry): void;
  showStatistics(entry: Entry): void;
  run(what: string, work: () => Promise<unknown>): void;
  parameters(): string;
}

export const nameOf = ({ session }: Entry): string => session.labels["file"] ?? session.name;
export const isBusy = ({ operation }: Entry): boolean =>
  operation !== undefined && (operation.state === "queued" || operation.state === "running");

class Card {
  readonly element = make("li", "", { class: "card" });
  private readonly title = make("h3");
  private readonly facts = make("p", "", { class: "facts" });
  private readonly state = make("p", "", { class: "state" });
  private readonly progress = make("progress", "", { max: "1" });
  private readonly growth = new Growth();
  private readonly viewButton: HTMLButtonElement;
  private readonly statisticsButton: HTMLButtonElement;
  private readonly cancelButton: HTMLButtonElement;
  private readonly refineButton: HTMLButtonElement;
  private readonly format = make("select");
  private readonly download = make("a", "Download", { class: "button" });
  private entry: Entry;

  constructor(entry: Entry, formats: Formats, actions: Actions) {
    this.entry = entry;
    const session = entry.session.name;
    this.viewButton = button("View", () => actions.view(this.entry));
    this.statisticsButton = button("Statistics", () => actions.showStatistics(this.entry));
    this.cancelButton = button("Cancel", () => actions.run("cancel", () => api.cancel(session)));
    this.refineButton = button("Refine", () => actions.run("refine", () => api.refine(session, actions.parameters())));
    const remove = button("Delete", () => actions.run("delete", () => api.remove(session)));
    const known = formats[String(entry.session.parameters["dimension"])] ?? [];
    for (const format of known) this.format.append(make("option", format, { value: format }));
    this.format.addEventListener("change", () => this.showLink());
    const row = make("div", "", { class: "row" });
    row.append(this.viewButton, this.statisticsButton, this.format, this.download, this.refineButton,
      this.cancelButton, remove);
    this.element.append(this.title, this.facts, this.state, this.progress, this.growth.element, row);
    this.progress.setAttribute("aria-label", `Progress of ${nameOf(entry)}`);
    this.format.setAttribute("aria-label", `Format of ${nameOf(entry)}`);
    for (const one of [this.viewButton, this.statisticsButton, this.cancelButton, this.refineButton, remove]) {
      one.setAttribute("aria-label", `${one.textContent} ${nameOf(entry)}`);
    }
    this.download.setAttribute("aria-label", `Download ${nameOf(entry)}`);
    this.download.setAttribute("download", "");
    this.show(entry);
  }

  show(entry: Entry): void {
    this.entry = entry;
    const { session, operation } = entry;
    setText(this.title, nameOf(entry));
    const parts = [`${count(session.committed_points)} points`];
    if (session.segment_count > 0) parts.push(`${count(session.segment_count)} segments`);
    if (session.triangle_count > 0) parts.push(`${count(session.triangle_count)} triangles`);
    if (session.vertex_count > 0) {
      parts.push(`${count(session.vertex_count)} vertices`, `${count(session.simplex_count)} simplices`);
    }
    parts.push(bytes(session.stored_bytes));
    setText(this.facts, parts.join(" · "));
    const busy = isBusy(entry);
    const hasMesh = session.vertex_count > 0;
    this.element.dataset["state"] = operation?.state ?? session.state;
    if (operation?.state === "running") {
      const { phase, vertices } = operation.progress;
      this.growth.add(operation.name, phase, vertices, performance.now() / 1000);
    }
    setText(this.state, this.stateText(entry));
    this.progress.hidden = !busy;
    this.progress.value = operation?.progress.fraction ?? 0;
    this.cancelButton.hidden = !busy;
    this.refineButton.hidden = busy;
    for (const element of [this.viewButton, this.statisticsButton, this.format, this.download]) {
      element.hidden = !hasMesh;
    }
    this.viewButton.disabled = !(session.parameters["dimension"] === 2 || session.parameters["dimension"] === 3);
    this.showLink();
  }

  private stateText({ operation, session, seconds_left }: Entry): string {
    if (operation === undefined) return session.state;
    const { phase, fraction, vertices } = operation.progress;
    if (operation.state === "running") {
      const left = seconds_left == null ? "" : `, ${duration(seconds_left)} left`;
      const { rate } = this.growth;
      const speed = rate === null ? "" : `, ${count(Math.round(rate))}/s`;
      return `${phase}: ${Math.floor(fraction * 100)} %, ${count(vertices)} vertices${speed}${left}`;
    }
    return operation.error === null ? operation.state : `${operation.state}: ${operation.error.message}`;
  }

  private showLink(): void {
    this.download.href = api.fileOf(this.entry.session.name, this.format.value);
  }
}

export class SessionList {
  private readonly cards = new Map<string, Card>();

  constructor(
    private readonly list: HTMLElement,
    private readonly actions: Actions,
    private readonly formats: Formats,
  ) {}

  show(entries: Entry[]): void {
    const names = new Set(entries.map((entry) => entry.session.name));
    for (const [name, card] of this.cards) {
      if (!names.has(name)) {
        card.element.remove();
        this.cards.delete(name);
      }
    }
    for (const entry of entries) {
      const card = this.cards.get(entry.session.name);
      if (card !== undefined) {
        card.show(entry);
      } else {
        const made = new Card(entry, this.formats, this.actions);
        this.cards.set(entry.session.name, made);
        this.list.prepend(made.element);
      }
    }
  }
}
