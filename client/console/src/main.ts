// The console's page: it asks again and again how things are, faster while work is under way.

import * as api from "./api.js";
import type { Entry } from "./api.js";
import { byId, bytes, count, describe, make, setText } from "./elements.js";
import { fillForm, readForm } from "./form.js";
import { isBusy, nameOf, SessionList } from "./sessions.js";

const kBusyMilliseconds = 400;
const kIdleMilliseconds = 2500;

const form = byId<HTMLFormElement>("form");
const news = byId("news");
const viewer = byId<HTMLDialogElement>("viewer");
const frame = byId<HTMLIFrameElement>("frame");
const statistics = byId<HTMLDialogElement>("statistics");

function tell(error: unknown): void {
  news.textContent = error instanceof Error ? error.message : String(error);
  news.hidden = false;
}

let timer = 0;
let list: SessionList | undefined;

function showServer({ server, info, health }: api.Server): void {
  const number = (name: string): number => Number(info[name] ?? 0);
  const where = server ?? "in this program";
  setText(byId("server"), `${where}: ${number("running_jobs")} running, ${number("queued_jobs")} queued`);
  const most = number("max_memory_bytes");
  const stored = number("max_stored_bytes_per_tenant");
  describe(byId("figures"), [
    ["Version", String(info["version"] ?? "")],
    ["Health", health],
    ["Jobs that run", `${number("running_jobs")} of ${number("workers")}`],
    ["Jobs that wait", `${number("queued_jobs")} of at most ${count(number("max_queued_jobs"))}`],
    ["Most points", count(number("max_points"))],
    ["Most vertices", count(number("max_vertices"))],
    ["Most memory", most > 0 ? bytes(most) : "no limit"],
    ["Kept", stored > 0 ? `${bytes(number("stored_bytes"))} of ${bytes(stored)}` : bytes(number("stored_bytes"))],
  ]);
}

async function refresh(): Promise<void> {
  window.clearTimeout(timer);
  let wait = kIdleMilliseconds;
  try {
    const server = await api.server();
    list ??= new SessionList(byId("sessions"), actions, server.formats);
    const { sessions, more } = await api.sessions();
    showServer(server);
    list.show(sessions);
    byId("none").hidden = sessions.length > 0;
    byId("more").hidden = !more;
    if (sessions.some(isBusy)) wait = kBusyMilliseconds;
    document.documentElement.dataset["state"] = "ready";
  } catch (error) {
    setText(byId("server"), error instanceof Error ? error.message : String(error));
    document.documentElement.dataset["state"] = "lost";
  }
  window.clearTimeout(timer);
  timer = window.setTimeout(() => void refresh(), wait);
}

async function run(work: () => Promise<unknown>): Promise<void> {
  news.hidden = true;
  try {
    await work();
  } catch (error) {
    tell(error);
  }
  await refresh();
}

const actions = {
  view(entry: Entry): void {
    byId("viewed").textContent = nameOf(entry);
    frame.src = api.viewOf(entry.session.name);
    viewer.showModal();
  },
  showStatistics(entry: Entry): void {
    void run(async () => {
      const figures = await api.statistics(entry.session.name);
      byId("statistics-title").textContent = nameOf(entry);
      describe(byId("statistics-figures"), rowsOf(figures));
      statistics.showModal();
    });
  },
  run: (_what: string, work: () => Promise<unknown>): void => void run(work),
  parameters: (): string => readForm(form).parameters,
};

/** Figures in rows; what is nested has its path. Lists of vertices are no figures. */
function rowsOf(figures: Record<string, unknown>, path = ""): [string, string][] {
  return Object.entries(figures).flatMap(([name, value]): [string, string][] => {
    const label = (path + name).replace(/_/g, " ");
    if (typeof value === "number") return [[label, Number.isInteger(value) ? count(value) : value.toPrecision(6)]];
    if (typeof value === "string") return [[label, value]];
    if (Array.isArray(value)) {
      return value.length > 0 && value.length <= 6 && value.every((one) => typeof one === "number")
        ? [[label, value.join(", ")]]
        : [];
    }
    return value !== null && typeof value === "object" ? rowsOf(value as Record<string, unknown>, `${path}${name}: `) : [];
  });
}

async function take(files: Iterable<File>): Promise<void> {
  const { parameters, crossings } = readForm(form);
  for (const file of files) {
    const line = make("li", `${file.name}: on its way (${bytes(file.size)})`);
    byId("uploads").prepend(line);
    try {
      const { notes } = await api.upload(file, parameters, crossings);
      line.textContent = notes.length > 0 ? `${file.name}: ${notes.join("; ")}` : `${file.name}: taken`;
    } catch (error) {
      line.textContent = `${file.name}: ${error instanceof Error ? error.message : String(error)}`;
      line.className = "failed";
    }
    await refresh();
  }
}

const drop = byId("drop");
const chosen = byId<HTMLInputElement>("file");
chosen.addEventListener("change", () => {
  const files = [...(chosen.files ?? [])];
  chosen.value = "";
  void take(files);
});
// Anywhere on the page: a file that misses the place would replace the page.
document.addEventListener("dragover", (event) => {
  event.preventDefault();
  drop.classList.add("over");
});
document.addEventListener("dragleave", () => drop.classList.remove("over"));
document.addEventListener("drop", (event) => {
  event.preventDefault();
  drop.classList.remove("over");
  void take([...(event.dataTransfer?.files ?? [])]);
});
form.addEventListener("submit", (event) => event.preventDefault());
byId("close").addEventListener("click", () => viewer.close());
viewer.addEventListener("close", () => frame.removeAttribute("src"));
byId("statistics-close").addEventListener("click", () => statistics.close());

void (async () => {
  await refresh();
  try {
    fillForm(form, await api.form());
  } catch (error) {
    tell(error);
  }
})();
