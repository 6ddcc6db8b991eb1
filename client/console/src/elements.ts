// Elements of the page. Text of others is never markup.

export function byId<Kind extends HTMLElement>(id: string): Kind {
  const element = document.getElementById(id);
  if (element === null) throw new Error(`the page has no element ${id}`);
  return element as Kind;
}

export function make<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  text = "",
  attributes: Record<string, string> = {},
): HTMLElementTagNameMap[Tag] {
  const element = document.createElement(tag);
  if (text !== "") element.textContent = text;
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

/** Sets the text of an element where it differs, so that a screen reader stays quiet otherwise. */
export function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function button(text: string, onClick: () => void): HTMLButtonElement {
  const made = make("button", text, { type: "button" });
  made.addEventListener("click", onClick);
  return made;
}

const whole = new Intl.NumberFormat("en", { useGrouping: true });
export const count = (value: number): string => whole.format(value).replace(/,/g, "\u2009");

/** "37 s", "5 min", "2 h 5 min", rounded up, as the tool says it. */
export function duration(seconds: number): string {
  const all = Math.ceil(seconds);
  const minutes = Math.ceil(all / 60);
  if (all < 60) return `${all} s`;
  return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

export function bytes(value: number): string {
  let unit = 0;
  while (value >= 1000 && unit < 4) {
    value /= 1000;
    ++unit;
  }
  return `${value < 10 && unit > 0 ? value.toFixed(1) : Math.round(value)} ${["B", "kB", "MB", "GB", "TB"][unit]}`;
}

/** Rows of a description list. */
export function describe(list: HTMLElement, rows: [string, string][]): void {
  list.replaceChildren(...rows.flatMap(([name, value]) => [make("dt", name), make("dd", value)]));
}
