// The requests and answers of the console's API. Paths are relative to the page's own, which holds the secret.

export interface Progress {
  phase: string;
  vertices: number;
  fraction: number;
}

export interface Failure {
  code: string;
  reason: string | null;
  message: string;
}

export interface Operation {
  name: string;
  state: string;
  progress: Progress;
  error: Failure | null;
}

export interface Session {
  name: string;
  state: string;
  parameters: Record<string, unknown>;
  labels: Record<string, string>;
  committed_points: number;
  segment_count: number;
  triangle_count: number;
  vertex_count: number;
  simplex_count: number;
  stored_bytes: number;
}

export interface Entry {
  session: Session;
  operation?: Operation;
  seconds_left?: number | null;
}

/** The formats of meshes of each dimension. */
export type Formats = Record<string, string[]>;

export interface Server {
  server: string | null;
  info: Record<string, unknown>;
  health: string;
  formats: Formats;
}

export interface Field {
  name: string;
  kind: "number" | "integer" | "boolean" | "choice";
  choices?: string[];
  help: string;
}

/** The console could not be reached, or has refused. */
export class ConsoleError extends Error {
  constructor(
    message: string,
    readonly isGone: boolean,
  ) {
    super(message);
  }
}

async function ask(method: string, path: string, body?: Blob): Promise<unknown> {
  let response: Response;
  try {
    response = await fetch(path, { method, body: body ?? null });
  } catch {
    throw new ConsoleError("The console does not answer. Has the program ended?", true);
  }
  const text = await response.text();
  let answer: unknown;
  try {
    answer = JSON.parse(text);
  } catch {
    throw new ConsoleError(text.slice(0, 500) || `HTTP ${response.status}`, false);
  }
  if (!response.ok) {
    throw new ConsoleError((answer as { message?: string }).message ?? `HTTP ${response.status}`, response.status === 503);
  }
  return answer;
}

const query = (values: Record<string, string>): string =>
  Object.entries(values)
    .map(([name, value]) => `${name}=${encodeURIComponent(value)}`)
    .join("&");

export const server = () => ask("GET", "api/server") as Promise<Server>;
export const form = () => ask("GET", "api/form") as Promise<Field[]>;
export const sessions = () => ask("GET", "api/sessions") as Promise<{ sessions: Entry[]; more: boolean }>;
export const statistics = (session: string) =>
  ask("GET", `api/${session}/statistics`) as Promise<Record<string, unknown>>;
export const cancel = (session: string) => ask("POST", `api/${session}/cancel`);
export const remove = (session: string) => ask("DELETE", `api/${session}`);
export const refine = (session: string, parameters: string) =>
  ask("POST", `api/${session}/refine?${query({ parameters })}`);
export const upload = (file: File, parameters: string, crossings: string) =>
  ask("POST", `api/sessions?${query({ name: file.name, parameters, crossings })}`, file) as Promise<{
    operation: Operation;
    notes: string[];
  }>;
export const viewOf = (session: string) => `${session}/view`;
export const fileOf = (session: string, format: string) => `${session}/mesh?${query({ format })}`;
