// What the server of the studio answers: one interface for each table of its address book.

export interface StoredFile { name: string; bytes: number; modified: number | string; folder?: boolean; /** Files of a folder, each of which may be the log. */ inside?: string[]; /** False of what is no recording, such as a configuration. */ recording?: boolean }

export interface Run {
  name: string; command: string; title: string; made: number | string; digest: string;
  verdict: string | null;
  /** Whether it holds a simulated crash with its case, which can be run. */
  case?: boolean;
}

export type JobState = "waiting" | "running" | "done" | "failed" | "cancelled" | "lost";

export interface Problem { code: string; text: string; remedy?: string | null; file?: string; row?: number }

export interface Job {
  id: string; kind: string; name: string; state: JobState; stage: string | null; share: number | null;
  begun: number | string | null; ended: number | string | null; command: string; run: string | null;
  /** The command with another folder, where that of the result is there. */
  again?: string | null;
  error: Problem | null; tail: string[];
  /** All lines of what it prints, where it is asked for alone; `tail` are the last. */
  output?: string[];
  live?: { address: string; qr?: string; token?: string | null; warning?: string | null } | null;
}

export interface Sample { name: string; title: string; text: string }

export interface State {
  version: string; folder: string; files: StoredFile[]; runs: Run[]; jobs: Job[]; samples?: Sample[];
}

export interface Choice { label: string; set: Record<string, unknown>; likely?: boolean }

export interface Question {
  code: string; text: string; key: string | null; choices: Choice[];
  free: "number" | "text" | null; unit: string | null; line?: number; optional?: boolean; file?: string;
  remedy?: string | null;
  /** Numbers of a list: 3 of a position. */
  count?: number;
  /** An answer that could be. */
  example?: string;
  /** The value as it is while it is open. */
  open?: unknown;
}

export interface Finding {
  code: string; severity: string; text?: string; sentence?: string; remedy?: string | null;
  file?: string;
}

export interface Column {
  name: string; unit: string | null;
  /** Of a channel of a crash: what it shares a panel with, and its name in it. */
  title?: string; label?: string;
}

export interface Stream {
  file?: string; name: string; rows: number; rate_hz?: number | null; from_s: number; to_s: number;
  columns: Column[];
  /** Of the samples of its file, on its clock; steady: at rest, or moving evenly. */
  rests?: Span[]; steady?: Span[]; gaps?: Span[];
}

export type Span = [number, number];

export interface Fit { answer: string; reasons: Finding[] }

export interface LogFound {
  /** From the folder of the studio. */ name: string; format: { name: string; title: string } | null;
  streams: { name: string; rows: number; rate_hz: number | null; from_s: number; to_s: number; gaps: number; lost_s: number; columns: string[]; clock?: string; clock_origin_s?: number }[];
  read_as: { source: string; quantity: string; unit: string | null; why: string }[];
  stationary: { from_s: number; to_s: number; grade: string }[];
  gravity: { included: boolean; median_m_per_s2: number; at_rest_m_per_s2: number | null } | null;
  impact: { delta_v_m_per_s: number; at_s: number; largest_m_per_s2: number } | null;
  fit: Record<string, Fit>;
  faults: Finding[]; notes: Finding[];
}

export interface Look {
  logs: LogFound[]; between: Finding[]; questions: Question[]; streams: Stream[];
  rests: Span[]; gaps: Span[];
}

export interface Series {
  t: number[];
  columns: Record<string, { unit: string | null; low: (number | null)[]; high: (number | null)[] }>;
}

export interface Field {
  /** Full dotted name; `*` stands for a number or a name of one's own. */
  key: string; path?: string; label: string; unit: string | null; type: "number" | "text" | "choice" | "flag" | "list";
  choices?: (string | number)[] | null; default?: unknown; help?: string | null;
}

export interface Section { key?: string; title?: string; help?: string | null; fields: Field[] }

export interface Kind {
  kind: string; title: string; what: string; needs: string; schema: Section[]; options?: string[];
}

export interface Proposal {
  toml: string; questions: Question[]; findings: Finding[]; to_check?: Question[]; /** Further values that nothing was found of. */ assumed?: Question[]; found?: string[];
  others?: { toml: string; name: string }[];
  /** Questions about the files, without whose answers there is no text. */
  choose?: Question[];
  /** Configurations in the folder that read these files. */
  ready?: { name: string; title: string; what: string; toml: string }[];
  /** The file of the folder that is used in place of the proposal; nothing was then found or asked. */
  from?: string;
  /** Whether tables apply that are comments of the text. */
  offers?: Question[];
  /** Questions whose answers are keys of [log], for another proposal. */
  again?: Question[];
}

export interface Fault {
  line: number | null; key: string | null; path?: string | null; code?: string; text: string; remedy?: string | null;
}

export interface Checked {
  toml: string; values: Record<string, unknown>; errors: Fault[];
  /** What is wrong with the name of the result. */
  name?: Problem | null;
  /** What was found before a value was set by hand, by key path. */
  was?: Record<string, unknown>;
  questions?: Question[];
  findings?: Finding[];
}

/** A number as the reports show it: value and 95 % bound as texts, the bound empty without one. */
export interface KeyNumber {
  group: string; label: string; value: string; bound: string; unit: string;
  /** Of a latitude or a longitude the bound is along the ground. */
  bound_unit: string;
  /** What the bound leaves out or rests on, or how the value was judged. */
  note?: string;
}

/** An option of a result; `usual`: it is as by default. */
export interface Option {
  key: string; label: string | null; value: unknown; unit: string; default: unknown; usual: boolean; help: string;
}

export interface Input { role: string; name: string; kept: string | null; sha256: string | null; bytes: number | null }

export interface RunDetail extends Run {
  /** False where the path of a crash is along the axes of the vehicle at its entry. */
  over_ground?: boolean;
  /** What repeats and compares; and what makes it again beside it, null where it was made with options. */
  verifying: string; command_line: string | null; answer?: string | null; job?: string | null;
  numbers: KeyNumber[]; options: Option[]; inputs: Input[]; findings: Finding[];
  /** What the heading integrity says, where the heading was not trusted throughout. */
  heading?: string | null;
  /** What an attitude begins with, and why the answer is what it is; how its beginning was found. */
  premises?: string[]; begins?: string | null;
  /** Reasons against the result, those of its verdict. */
  against?: Finding[];
  from_s?: number; to_s?: number;
  panels?: { title: string; unit: string; columns: { name: string; label: string }[] }[];
  /** Drawings of the report of a crash. */
  figures?: { title: string; address: string; alt: string; width: number; height: number }[];
  report: string | null; has: { track?: boolean; attitude?: boolean; series?: boolean; pdf?: boolean; toml?: boolean };
}

export interface Track {
  t: number[]; lat: number[]; lon: number[]; alt: number[];
  q: [number, number, number, number][] | null;
  fixes: { t: number[]; lat: number[]; lon: number[] } | null;
  reference: { t: number[]; lat: number[]; lon: number[] } | null;
  /** Standard deviations of roll, pitch, heading, deg. */
  sd?: [number, number, number][] | null;
  /** The algorithm whose attitude it is, where a result has several. */
  by?: string | undefined;
}

export interface MapInfo { tiles: string | null; min: number; max: number; attribution: string | null }

export interface CrashQuick {
  delta_v: { value: number; bound: number | null; shown: string; at_least?: boolean; unit: string; forward: number; right: number } | null;
  pdof: { deg: number; low: number | null; high: number | null; clock: number } | null;
  path: { t: number[]; north: number[]; east: number[]; heading: number[]; bound: number[] };
  /** The outline: corners forward, right of the origin of positions. */
  vehicle: { length: number; width: number; outline: [number, number][] };
  /** Whether a heading is known; else "north" is forward of the vehicle at the entry, "east" its right. */
  over_ground: boolean;
  recorder: string; recorders: string[]; findings: Finding[]; ms: number;
}

export interface LiveInfo {
  protocols: { name: string; title: string; help: string; fields: (Field & { /** Addresses to choose from, and who reaches them. */ places?: [string, string][] })[] }[];
  /** Files of the folder by which a live run can navigate. */
  configurations?: string[];
  warning: string | null;
}

/** What `strapdown compare` gives as JSON; lists of values are in the order of the runs. */
export interface Comparison {
  summary: string; runs: { name: string; command: string }[];
  options: { key: string; values: unknown[] }[]; equal_options: number;
  inputs: { role: string; same: boolean; status: string[]; files: ({ name: string } | null)[] }[];
  conditions: { name: string; values: (string | null)[] }[];
  numbers: {
    group: string; quantity: string; same: boolean; detail: boolean; /** It differs, by less than is shown. */ finer: boolean; within: (boolean | null)[];
    /** As the reports show them; differences from the first run, with the bound of each. */
    shown: { unit: string; bound_unit: string; values: string[]; bounds: string[]; differences: string[]; combined: string[] };
  }[];
  same_options: Option[];
  findings_of_runs: { code: string; sentence: string; differs: boolean; counts: number[] }[];
  findings: Finding[]; page?: string | null; command_line?: string;
}
