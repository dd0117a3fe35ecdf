// Requests to the server of this page. All addresses are relative: the token in the address of the
// page stays there, and no request leaves this machine.

import type {
  Checked, Comparison, CrashQuick, Job, Kind, LiveInfo, Look, MapInfo, Problem, Proposal, RunDetail, Sample, Series,
  State, StoredFile, Track,
} from "./types";

/** An answer of the server that says what is wrong and what to do. */
export class ServerError extends Error {
  constructor(readonly problem: Problem, readonly status: number) {
    super(problem.text);
  }
}

const CHANGES = { "X-Strapdown": "1" };

async function answer<T>(response: Response): Promise<T> {
  const text = await response.text();
  let body: unknown = null;
  try {
    body = text ? JSON.parse(text) : null;
  } catch {
    throw new ServerError(unreadable(response.status), response.status);
  }
  if (response.ok) return body as T;
  const problem = (body as { error?: Problem } | null)?.error;
  throw new ServerError(problem ?? unreadable(response.status), response.status);
}

function unreadable(status: number): Problem {
  return {
    code: "studio.no-answer",
    text: `The studio's server answered with status ${status} and no reason.`,
    remedy: "Look at the terminal in which it was started.",
  };
}

async function send<T>(path: string, init?: RequestInit): Promise<T> {
  let response: Response;
  try {
    response = await fetch(path, { ...init, cache: "no-store" });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new ServerError({
      code: "studio.not-reached",
      text: "The studio's server cannot be reached.",
      remedy: "Start it again with strapdown studio and open the address that it prints. Nothing is lost.",
    }, 0);
  }
  return answer<T>(response);
}

const get = <T>(path: string, signal?: AbortSignal) => send<T>(path, { signal });

const post = <T>(path: string, body: unknown, signal?: AbortSignal) => send<T>(path, {
  method: "POST", headers: { ...CHANGES, "Content-Type": "application/json" },
  body: JSON.stringify(body), signal,
});

export const part = encodeURIComponent;

function query(values: Record<string, string | number | null | undefined>): string {
  const set = Object.entries(values).filter(([, v]) => v !== null && v !== undefined && v !== "");
  return set.length ? "?" + set.map(([k, v]) => `${k}=${part(String(v))}`).join("&") : "";
}

export interface Reading { files: string[]; log: Record<string, unknown>; axes?: string | null }

export interface SeriesRequest { columns: string[]; from?: number; to?: number; width: number }

export const api = {
  state: () => get<State>("api/state"),
  look: (reading: Reading, signal?: AbortSignal) => post<Look>("api/look", reading, signal),
  kinds: async () => (await get<Kind[]>("api/kinds")).map(withDottedNames),
  propose: (body: { kind: string; files: string[]; log: Record<string, unknown>; from_s?: number; to_s?: number; answers: Record<string, unknown> }) =>
    post<Proposal>("api/propose", body),
  check: (body: { kind: string; toml: string; name?: string; set?: Record<string, unknown> }, signal?: AbortSignal) =>
    post<Checked>("api/check", body, signal),
  begin: (body: Record<string, unknown>) => post<Job>("api/jobs", body),
  job: (id: string) => get<Job>(`api/jobs/${part(id)}`),
  states: (id: string) => get<{ states: Record<string, unknown>[]; silent_s: Record<string, number> }>(`api/jobs/${part(id)}/states`),
  cancel: (id: string) => send<Job>(`api/jobs/${part(id)}`, { method: "DELETE", headers: CHANGES }),
  /** The case of a simulated crash, as text. */
  caseOf: async (name: string): Promise<string> => {
    const answer = await fetch(`runs/${part(name)}/case.toml`);
    if (!answer.ok) throw new ServerError({ code: "studio.no-case", text: "the case cannot be read", remedy: null }, answer.status);
    return answer.text();
  },
  run: (name: string) => get<RunDetail>(`api/runs/${part(name)}`),
  track: (name: string) => get<Track>(`api/runs/${part(name)}/track?points=2000`),
  compare: (runs: string[]) => post<Comparison>("api/compare", { runs }),
  quick: (toml: string, set: Record<string, unknown>, unit: number, signal?: AbortSignal) =>
    post<CrashQuick>("api/crash/quick", { toml, set, ...(unit ? { unit } : {}) }, signal),
  map: () => get<MapInfo>("api/map"),
  live: () => get<LiveInfo>("api/live"),
  sample: (sample: Sample) => post<{ files: string[] }>(`api/samples/${part(sample.name)}`, {}),
  exportOf: (name: string, as: string) => `api/runs/${part(name)}/export?as=${part(as)}`,

  series(reading: Reading, file: string, stream: string, wanted: SeriesRequest, signal?: AbortSignal) {
    const log = { ...reading.log, ...(reading.axes ? { axes: reading.axes } : {}) };
    return get<Series>("api/series" + query({
      file, stream, columns: wanted.columns.join(","), from: wanted.from, to: wanted.to,
      width: wanted.width, log: Object.keys(log).length ? JSON.stringify(log) : null,
    }), signal);
  },

  runSeries(name: string, wanted: SeriesRequest, signal?: AbortSignal) {
    return get<Series>(`api/runs/${part(name)}/series` + query({
      columns: wanted.columns.join(","), from: wanted.from, to: wanted.to, width: wanted.width,
    }), signal);
  },

  /** Send a file, with its progress from 0 to 1; fetch does not report that of a request. */
  upload(file: File, replace: boolean, progress: (share: number) => void): Promise<StoredFile> {
    return new Promise((resolve, reject) => {
      const request = new XMLHttpRequest();
      request.open("PUT", `api/files/${part(file.name)}${replace ? "?replace=1" : ""}`);
      for (const [name, value] of Object.entries(CHANGES)) request.setRequestHeader(name, value);
      request.upload.onprogress = (event) => {
        if (event.lengthComputable && event.total > 0) progress(event.loaded / event.total);
      };
      request.onerror = () => reject(new ServerError({
        code: "studio.upload-stopped", text: `${file.name}: the transfer stopped.`,
        remedy: "Try it again; if it stops again, copy the file into the folder of the studio.",
      }, 0));
      request.onload = () => {
        answer<StoredFile>(new Response(request.responseText, { status: request.status || 500 }))
          .then(resolve, reject);
      };
      request.send(file);
    });
  },
};

const dotted = (path: string) => path.replaceAll("[]", ".*");

/** Names of fields as those of values, `units.*.name`: the server writes `units[].name`. */
function withDottedNames(kind: Kind): Kind {
  return {
    ...kind,
    schema: kind.schema.map((section) => ({
      ...section, key: dotted(section.key ?? ""), fields: section.fields.map((field) => ({ ...field, key: dotted(field.path ?? field.key) })),
    })),
  };
}

/** The reason and the remedy of anything that was thrown. */
export function problemOf(error: unknown): Problem {
  if (error instanceof ServerError) return error.problem;
  return {
    code: "studio.page-error",
    text: error instanceof Error ? error.message : String(error),
    remedy: "Reload the page: files, runs and results are kept.",
  };
}

export const aborted = (error: unknown) => error instanceof DOMException && error.name === "AbortError";
