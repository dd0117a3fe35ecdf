// What the pages share: the state of the server, kept current by its events, and the work in hand,
// kept in the tab so that a reload loses nothing.

import { useEffect, useState } from "preact/hooks";
import { api, problemOf } from "./api";
import type { Job, Problem, Proposal, Span, State } from "./types";

/** Point on the vehicle: forward, right, down, in m. */
export type Point = [number, number, number];

export interface Mark { label: string; t: number }

export interface Work {
  files: string[];
  log: Record<string, unknown>;
  axes: string | null;
  trim: Span | null;
  marks: Mark[];
  /** Sensor and antenna from the origin of the drawing; null until someone moves one. */
  places: { sensor: Point; antenna: Point } | null;
  kind: string | null;
  toml: string;
  name: string;
  /** What was found and asked when the configuration was proposed. */
  proposal: Omit<Proposal, "toml"> | null;
  /** Flags of the command. */
  options: string[];
  /** What the configuration was proposed for: another one is proposed when it changes. */
  proposedFor: string;
}

const NOTHING: Work = {
  files: [], log: {}, axes: null, trim: null, marks: [], places: null, kind: null, toml: "", name: "",
  proposal: null, options: [], proposedFor: "",
};
// Of one studio: another one at the same port has other files.
const KEY = `strapdown.studio.work ${location.pathname}`;

export interface Shared {
  state: State | null;
  problem: Problem | null;
  connected: boolean | null;
  work: Work;
  /** Last state lines of each live session. */
  lines: Record<string, Record<string, unknown>[]>;
}

function stored(): Work {
  try {
    return { ...NOTHING, ...JSON.parse(sessionStorage.getItem(KEY) ?? "{}") as Partial<Work> };
  } catch {
    return NOTHING;
  }
}

let shared: Shared = { state: null, problem: null, connected: null, work: stored(), lines: {} };
const readers = new Set<() => void>();

export const now = () => shared;

function change(part: Partial<Shared>) {
  shared = { ...shared, ...part };
  for (const reader of readers) reader();
}

/** The shared state, and a new drawing whenever it changes. */
export function useShared(): Shared {
  const [, draw] = useState(0);
  useEffect(() => {
    const reader = () => draw((n) => n + 1);
    readers.add(reader);
    return () => { readers.delete(reader); };
  }, []);
  return shared;
}

export function setWork(part: Partial<Work>) {
  change({ work: { ...shared.work, ...part } });
  try {
    sessionStorage.setItem(KEY, JSON.stringify(shared.work));
  } catch {
    // A full or forbidden store: the work lives as long as the page.
  }
}

export const newWork = (files: string[]) => setWork({ ...NOTHING, files });

export async function refresh() {
  try {
    change({ state: await api.state(), problem: null });
  } catch (error) {
    change({ problem: problemOf(error) });
  }
}

export function putJob(job: Job) {
  const state = shared.state;
  if (!state) return;
  const others = state.jobs.filter((one) => one.id !== job.id);
  const before = state.jobs.find((one) => one.id === job.id);
  change({ state: { ...state, jobs: [job, ...others] } });
  if (before?.state !== job.state && job.state !== "waiting" && job.state !== "running") void refresh();
}

const LINES_KEPT = 4000;
/** When a state came, by the clock of this page, ms. */
export const CAME = "came";

const sessionOf = (line: Record<string, unknown>) => String(line["session"] ?? "");

/** Fewer lines from the beginning on: of the older half of each session every other one. */
function thinned(lines: Record<string, unknown>[]) {
  if (lines.length <= LINES_KEPT) return lines;
  const seen: Record<string, number> = {};
  return lines.filter((line, i) => i > lines.length / 2 || (seen[sessionOf(line)] = (seen[sessionOf(line)] ?? 0) + 1) % 2);
}

/** States from the beginning of a live run, which came before this page listened. */
export async function history(id: string) {
  const { states, silent_s } = await api.states(id);
  const newest: Record<string, number> = {};
  for (const line of states) {
    newest[sessionOf(line)] = Number(line["time"]);
    line[CAME] = Date.now() - 1000 * (silent_s[sessionOf(line)] ?? 0);
  }
  const later = (shared.lines[id] ?? []).filter((line) => !(Number(line["time"]) <= newest[sessionOf(line)]!));
  change({ lines: { ...shared.lines, [id]: thinned([...states, ...later]) } });
}

let pendingLines: { id: string; data: Record<string, unknown> }[] = [];

function drawLines() {
  // All lines that came since the last frame are drawn together.
  const lines = { ...shared.lines };
  for (const { id, data } of pendingLines) {
    lines[id] = [...(lines[id] ?? []), data];
  }
  for (const id of new Set(pendingLines.map((one) => one.id))) lines[id] = thinned(lines[id]!);
  pendingLines = [];
  change({ lines });
}

function take(text: string) {
  const event = JSON.parse(text) as {
    jobs?: Job[]; job?: Job; line?: { id: string; data: Record<string, unknown> }; files?: boolean;
  };
  if (event.jobs && shared.state) change({ state: { ...shared.state, jobs: event.jobs } });
  if (event.job) putJob(event.job);
  if (event.files) void refresh();
  if (event.line) {
    event.line.data[CAME] = Date.now();
    pendingLines.push(event.line);
    if (pendingLines.length === 1) setTimeout(drawLines, 100);
  }
}

/** Listen to the server, and come back whenever the connection is lost. */
export function listen() {
  let wait = 500;
  const open = () => {
    const address = new URL("api/events", document.baseURI);
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(address);
    socket.onopen = () => {
      wait = 500;
      change({ connected: true });
      void refresh();
    };
    socket.onmessage = (message) => {
      try {
        take(String(message.data));
      } catch {
        // An event that cannot be read is not worth the page: the state is asked for instead.
        void refresh();
      }
    };
    socket.onclose = () => {
      change({ connected: false });
      setTimeout(open, wait);
      wait = Math.min(8000, wait * 2);
    };
  };
  open();
}
