// The parameters of a mesh, as the API describes them.

import type { Field } from "./api.js";
import { make } from "./elements.js";

const labelOf = (field: Field): string => field.name.replace(/[_.]/g, " ");

function controlOf(field: Field): HTMLInputElement | HTMLSelectElement {
  const attributes = { id: `field-${field.name}`, name: field.name, "aria-describedby": `help-${field.name}` };
  if (field.kind === "boolean") return make("input", "", { ...attributes, type: "checkbox" });
  if (field.kind === "choice") {
    const select = make("select", "", attributes);
    select.append(make("option", "default", { value: "" }));
    for (const choice of field.choices ?? []) select.append(make("option", choice, { value: choice }));
    return select;
  }
  return make("input", "", {
    ...attributes,
    type: "number",
    step: field.kind === "integer" ? "1" : "any",
    placeholder: "default",
  });
}

export function fillForm(form: HTMLFormElement, fields: Field[]): void {
  const crossings: Field = {
    name: "crossings",
    kind: "choice",
    choices: ["refuse", "snap", "split"],
    help: "What becomes of segments of a domain that cross: they are refused, which is the default; or split there.",
  };
  form.replaceChildren(
    ...[...fields, crossings].map((field) => {
      const row = make("div", "", { class: "field" });
      row.append(
        make("label", labelOf(field), { for: `field-${field.name}` }),
        controlOf(field),
        make("p", field.help, { id: `help-${field.name}` }),
      );
      return row;
    }),
  );
}

/** Has `given` have a value for a name; of "surface.tolerance" its object `surface`. */
function put(given: Record<string, unknown>, name: string, value: unknown): void {
  const dot = name.indexOf(".");
  if (dot < 0) {
    given[name] = value;
  } else {
    const inner = (given[name.slice(0, dot)] ??= {}) as Record<string, unknown>;
    put(inner, name.slice(dot + 1), value);
  }
}

/** The parameters that were given, as JSON of MeshParameters; and the rule of crossings. */
export function readForm(form: HTMLFormElement): { parameters: string; crossings: string } {
  const given: Record<string, unknown> = {};
  let crossings = "";
  for (const control of form.elements) {
    if (control instanceof HTMLInputElement && control.type === "checkbox") {
      if (control.checked) put(given, control.name, true);
    } else if (control instanceof HTMLInputElement && control.value !== "") {
      put(given, control.name, Number(control.value));
    } else if (control instanceof HTMLSelectElement && control.value !== "") {
      if (control.name === "crossings") crossings = control.value;
      else put(given, control.name, control.value);
    }
  }
  return { parameters: Object.keys(given).length > 0 ? JSON.stringify(given) : "", crossings };
}
