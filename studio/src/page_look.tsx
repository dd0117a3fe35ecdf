// Look: what is in the log, the evidence, the questions, the traces; then choose what to find out.

import { useEffect, useId, useMemo, useState } from "preact/hooks";
import { api, type Reading } from "./api";
import { capital, duration, number, plural, stamp, zeroOf } from "./format";
import { Plan, type Line } from "./plan";
import { setWork, useShared, type Point, type Work } from "./store";
import { Traces, TrimBar, type Panel } from "./traces";
import type { Finding, Kind, LogFound, Look, Question, Span, Stream } from "./types";
import { Ask, Busy, Control, Empty, Findings, More, Page, Part, Table, Trouble, useRequest } from "./ui";
import { Vehicle } from "./vehicle";

/** How the chosen files are read, as every request names it. */
export function useReading(): Reading {
  const { work } = useShared();
  return { files: work.files, log: work.log, axes: work.axes };
}

/** What doctor found in the chosen files; the server remembers it. */
export function useLook() {
  const reading = useReading();
  return useRequest(reading.files.length ? (signal) => api.look(reading, signal) : null, [JSON.stringify(reading)]);
}

type Keys = Record<string, unknown>;

/** Keys of single files, by the name of each: their own, and the axes. */
export const ofFiles = (log: Keys) => (log["files"] ?? {}) as Record<string, Keys>;

/** A click's answer: keys of [log], or the axes; of all files, or of one alone. */
export function answerLog(set: Keys, log: Keys, file: string | null = null) {
  const merged: Keys = { ...log }, own: Record<string, Keys> = {};
  for (const [name, keys] of Object.entries(ofFiles(log))) own[name] = { ...keys };
  let axes: string | null | undefined;
  for (const [name, value] of Object.entries(set)) {
    const key = name.replace(/^log\./, "");
    const target = file === null ? merged : own[file] ??= {};
    // What is said for all is said of each.
    if (file === null) for (const keys of Object.values(own)) delete keys[key];
    if (file === null && key === "axes") axes = value === null ? null : String(value);
    else if (value === null) delete target[key]; else target[key] = value;
  }
  const left = Object.entries(own).filter(([, keys]) => Object.keys(keys).length);
  if (left.length) merged["files"] = Object.fromEntries(left); else delete merged["files"];
  setWork({ log: merged, ...(axes !== undefined ? { axes } : {}) });
}

/** What was said of the files: of one alone, or of all. */
export function saidOf(work: Work): { file: string | null; key: string; words: string }[] {
  const { files: _, ...common } = { ...work.log, ...(work.axes ? { axes: work.axes } : {}) } as Keys;
  const told = (file: string | null, keys: Keys) => Object.entries(keys).map(([key, value]) => ({ file, key, words: `${file ? `${file} ` : ""}${key.replaceAll("_", " ")}: ${typeof value === "object" ? JSON.stringify(value) : value === "" ? "none" : String(value)}` }));
  return [...told(null, common), ...Object.entries(ofFiles(work.log)).flatMap(([name, keys]) => told(name, keys))];
}

function Answers() {
  const { work } = useShared();
  const said = saidOf(work);
  if (!said.length) return null;
  return <Part title="Your answers"><ul class="list">{said.map(({ file, key, words }) => <li class="item" key={words}>
    <span class="name">{words}</span><button type="button" aria-label={`Take back: ${words}`} onClick={() => answerLog({ [key]: null }, work.log, file)}>Take back</button>
  </li>)}</ul></Part>;
}

export function LookPage() {
  const { work } = useShared();
  const look = useLook();
  const reading = useReading();
  if (!work.files.length) {
    return <Page title="No file chosen"><Empty><a href="#/files">Choose a file</a> first.</Empty></Page>;
  }
  const found = look.value;
  return <Page title={work.files.length === 1 ? work.files[0]! : `${work.files[0]} and ${plural(work.files.length - 1, "more file")}`}
    lead={found ? inOneSentence(found) : undefined}>
    {look.busy && <Busy>{found ? "Looking again…" : "Looking into the log: streams, clock, units, axes, rests…"}</Busy>}
    <Trouble problem={look.problem} retry={look.again} />
    {look.problem && <><Answers /><ReadingForm files={work.files} /></>}
    {found && <Found look={found} reading={reading} />}
  </Page>;
}

function inOneSentence(look: Look): string {
  const records = recordsOf(look);
  const channels = look.streams.filter(ofCrash);
  if (records.length) {
    const [from, to] = spanOf(channels);
    const count = channels.reduce((sum, s) => sum + s.columns.length, 0);
    if (!channels.some(certain)) return `${plural(count, "channel")} of a table that is no log. If it is of a crash, say “Crash” on the next page.`;
    return count ? `${records.length > 1 ? "Records" : "A record"} of a crash: ${plural(count, "channel")} over ${duration(to - from)}.` : "A record of a crash, none of whose channels can be drawn.";
  }
  const imu = look.streams.find((s) => s.name === "imu") ?? look.streams[0];
  if (!imu) return "No stream of samples was found in these files.";
  const what = imu.name === "imu" ? "inertial samples" : wordsOf(imu);
  const others = look.streams.filter((s) => s !== imu).map((s) => WORDS[s.name] ?? s.name);
  return `${duration(imu.to_s - imu.from_s)} of ${what}${rateOf(look, imu) ? ` at ${number(rateOf(look, imu)!, 3)} Hz` : ""}${others.length ? `, with ${[...new Set(others)].join(", ")}` : ""}.`;
}

/** Files that are no logs of inertial samples, fixes or a reference, and can be read as records of a crash. */
const recordsOf = (look: Look) => look.logs.filter((log) => !log.read_as.length && !log.streams.length && (log.fit["crash"]?.answer ?? "no") !== "no");

/** A stream of the channels of a crash. */
const ofCrash = (s: Stream) => s.columns.some((c) => c.title !== undefined);

/** One with an acceleration, a rate or a velocity, and not of quantities that are unknown. */
const certain = (s: Stream) => s.columns.some((c) => c.title !== undefined && c.title !== "As recorded");

const spanOf = (streams: Stream[]): Span => streams.length ? [Math.min(...streams.map((s) => s.from_s)), Math.max(...streams.map((s) => s.to_s))] : [0, 0];

const rateOf = (look: Look, s: Stream) => s.rate_hz ?? look.logs.find((log) => log.name === s.file)?.streams.find((one) => one.name === s.name)?.rate_hz ?? null;

/** The stamp that is shown as zero. */
const zeroOfAll = (look: Look) => zeroOf(Math.min(...look.streams.map((s) => s.from_s)));

/** When the record begins, and from when times are shown; empty where there is nothing to say. */
function saidOfZero(look: Look, zero: number): string {
  const dated = look.logs.flatMap((log) => log.streams).find((s) => s.clock === "unix");
  const when = dated && new Date(1000 * (dated.from_s + (dated.clock_origin_s ?? 0)));
  const date = when && !Number.isNaN(when.getTime()) ? `The record begins at ${when.toISOString().slice(0, 19).replace("T", " ")} UTC. ` : "";
  return date + (zero ? `Times are from its beginning, which is ${stamp(zero, 1)} s in the file.` : "");
}

const WORDS: Record<string, string> = {
  imu: "inertial sensors", gnss: "satellite fixes", magnetometer: "magnetometer", barometer: "barometer",
  wheel: "wheel speeds", reference: "a reference", pressure: "air pressure", crash: "channels of a crash",
};

const wordsOf = (s: Stream) => WORDS[s.name] ?? (ofCrash(s) ? s.name.replace(/^crash-/, "channels of a crash, ") : s.name);

const UNUSED = /^io\.attitude-(not-used|of-other-phone)$/;

function Found({ look, reading }: { look: Look; reading: Reading }) {
  const { work } = useShared();
  const records = recordsOf(look);
  // That a record is no log of inertial samples is no fault of it; what is wrong with a channel is.
  const faults = [...look.logs.flatMap((log) => log.faults.filter((f) => !records.includes(log) || f.severity !== "error").map((f) => ({ ...f, file: f.file ?? log.name }))), ...look.between.filter((f) => f.severity !== "note")];
  const told = [...look.between.filter((f) => f.severity === "note"), ...look.logs.flatMap((log) => log.notes.map((f) => ({ ...f, file: f.file ?? log.name })))];
  // That an attitude of the file is left unused is nothing to find in a closed list.
  const notes = told.filter((f) => !UNUSED.test(f.code));
  faults.push(...told.filter((f) => UNUSED.test(f.code)));
  const streams = look.streams.filter((s) => s.rows > 1 && s.columns.length > 0);
  const imu = streams.find((s) => s.name === "imu") ?? streams[0];
  const several = look.logs.length > 1;
  const [forAll, setForAll] = useState(false);
  const ask = (q: Question) => <Ask key={`${q.file} ${q.code} ${q.text}`} of={several ? q.file : null} question={{ ...q, remedy: q.choices.length && !(q.free && q.key === "datum_height_m") ? null : q.remedy }}
    onAnswer={(set) => answerLog(set, work.log, several && !forAll ? q.file ?? null : null)} />;
  const whose = several && look.questions.some((q) => q.file) && <label class="inline"><input type="checkbox" checked={forAll} onChange={(e) => setForAll(e.currentTarget.checked)} />An answer is for all files, not only for the one that it names</label>;
  const needed = look.questions.filter((q) => !q.optional), optional = look.questions.filter((q) => q.optional);
  return <>
    {needed.length > 0 && <Part title={`${plural(needed.length, "question")} about the log`}>
      <p>Nothing is guessed. One click each; you can change it later.</p>
      {whose}
      {needed.map(ask)}
    </Part>}
    {optional.length > 0 && <Part title="Is this right?">{!needed.length && whose}{optional.map(ask)}</Part>}
    <Answers />
    <Part title="What is in it">
      {records.length > 0 && look.streams.some(certain) && <p>{records.map((log) => log.name).join(", ")}: {records.length > 1 ? "records" : "a record"} of a crash. Choose “Crash” on the next page.</p>}
      <Contents look={look} />
    </Part>
    {imu && <Signals look={look} streams={streams} imu={imu} reading={reading} />}
    {(faults.length > 0 || notes.length > 0) && <Part title="What was noticed">
      <Findings findings={faults} none={needed.length ? "No fault was found. What is asked above is open." : "No fault was found."} />
      {notes.length > 0 && <More title={plural(notes.length, "note")}>{notes.map((note, i) => <Findings key={i} findings={[note]} />)}</More>}
    </Part>}
    <Part title="How it was read">
      <p>Units and axes, with the reason for each. Correct what is wrong: the log is looked at again.</p>
      {look.logs.filter((log) => log.read_as.length > 0).map((log, _, all) => all.length > 1 ? <More key={log.name} title={log.name}><ReadAs log={log} /></More> : <ReadAs key={log.name} log={log} />)}
      <ReadingForm files={look.logs.map((log) => log.name)} />
    </Part>
    {streams.length > 0 && <Places look={look} reading={reading} streams={streams} />}
    <div class="next"><a class="button main" href="#/choose">Choose what to find out</a></div>
  </>;
}

/** Columns that were read in the same way, one after the other, share a row. */
function ReadAs({ log }: { log: LogFound }) {
  const rows: LogFound["read_as"] = [];
  for (const one of log.read_as) {
    const last = rows[rows.length - 1];
    if (last?.why === one.why && last.unit === one.unit) rows[rows.length - 1] = { ...last, quantity: `${last.quantity}, ${one.quantity}`, source: `${last.source}, ${one.source}` };
    else rows.push(one);
  }
  return <Table stack caption={log.name} head={["Quantity", "Column", "Unit", "Why"]} rows={rows.map((r) => [r.quantity, r.source, r.unit ?? "–", r.why])} />;
}

function Contents({ look }: { look: Look }) {
  const zero = zeroOfAll(look);
  return <>
    {!look.streams.length && <Empty>{look.questions.some((q) => !q.optional) ? "Nothing can be shown before the question above is answered." : "No samples and no fixes were found."}</Empty>}
    {look.streams.length > 0 && <Table stack head={["Stream", "File", "Samples", "Rate", "From", "To", "Gaps"]} numeric={[2, 3, 4, 5, 6]}
      rows={look.streams.map((s) => {
        const told = look.logs.find((log) => log.name === s.file)?.streams.find((one) => one.name === s.name);
        return [wordsOf(s), s.file ?? "", s.rows.toLocaleString("en"), rateOf(look, s) ? `${number(rateOf(look, s)!, 4)} Hz` : "–",
          `${stamp(s.from_s - zero, 1)} s`, `${stamp(s.to_s - zero, 1)} s`, told?.gaps ? `${told.gaps}, ${duration(told.lost_s)} lost` : "none"];
      })} />}
    {saidOfZero(look, zero) && <p class="soft">{saidOfZero(look, zero)}</p>}
    <dl class="facts">
      {look.logs.map((log) => <Facts key={log.name} log={log} zero={zero} alone={look.logs.length === 1} />)}
      {look.streams.filter((s) => s.name === "imu").map((s) => <><dt>Rests{look.logs.length > 1 ? ` of ${s.file}` : ""}</dt><dd>{restsOf(s)}</dd></>)}
    </dl>
  </>;
}

/** Rests of a stream in words; what neither turns nor shakes may move evenly. */
function restsOf({ rests = [], steady = [] }: Stream): string {
  const said = (spans: Span[]) => `${plural(spans.length, "stretch", "stretches")}, the longest ${duration(Math.max(...spans.map(([a, b]) => b - a)))}`;
  const moving = steady.length ? `steady, at rest or moving evenly: ${said(steady)}` : "";
  return [rests.length ? said(rests) : "none found", moving || (rests.length ? "" : "it moved all the time")].filter(Boolean).join("; ");
}

function Facts({ log, alone, zero }: { log: LogFound; alone: boolean; zero: number }) {
  const name = alone ? "" : ` of ${log.name}`;
  return <>
    {log.format && <><dt>Format{name}</dt><dd>{log.format.title}</dd></>}
    {log.gravity && <><dt>Gravity{name}</dt><dd>{log.gravity.included ? `included: ${number(log.gravity.median_m_per_s2)} m/s² in the median` : "not included: the log has linear acceleration"}</dd></>}
    {log.impact && log.impact.delta_v_m_per_s > 1 && <><dt>Largest impact{name}</dt><dd>{number(log.impact.delta_v_m_per_s * 3.6, 3)} km/h within 150 ms, at {stamp(log.impact.at_s - zero, 1)} s</dd></>}
  </>;
}

const QUANTITIES: [RegExp, string][] = [
  [/^gyro_/, "Angular rate"], [/^accel_/, "Specific force"], [/^mag_/, "Magnetic field"], [/^(lat|lon)$/, ""],
  [/^(alt|height)$/, "Height"], [/^(VN|VE|VD|v[xyz])$/, "Velocity"], [/^q_/, "Quaternion"], [/^(roll|pitch|heading)$/, "Attitude"],
  [/^(north|east|down)$/, "Position"], [/^(north|east|down|height|alt)_sd$/, "Standard deviation of the position"],
  [/^(VN|VE|VD|v[xyz])_sd$/, "Standard deviation of the velocity"], [/^(roll|pitch|heading)_sd$/, "Standard deviation of the attitude"],
];

/** "speed_sd": "Speed, standard deviation". */
const inWords = (name: string) => capital(name.replace(/_sd$/, ", standard deviation").replaceAll("_", " "));

/** Components of a north-east-down velocity. */
const TOWARDS: Record<string, string> = { VN: "north", VE: "east", VD: "down" };

const labelOf = (name: string) => {
  const own = name.replace(/^(gyro|accel|mag)_/, "").replace(/_sd$/, "");
  return TOWARDS[own] ?? own.replaceAll("_", " ");
};

/** Curves in one panel, at most: as many as there are colors. */
const TOGETHER = 4;

/** Columns of one quantity share a panel, as far as their units are one. */
export function panelsOf(stream: Stream): Panel[] {
  const panels = new Map<string, Panel>();
  for (const { name, unit, title: own, label } of stream.columns) {
    const title = own ?? QUANTITIES.find(([pattern]) => pattern.test(name))?.[1] ?? inWords(name);
    if (title === "") continue;
    let key = `${title}|${unit ?? ""}`, shown = title;
    for (let i = 2; (panels.get(key)?.columns.length ?? 0) >= TOGETHER; i++) { key = `${title}|${unit ?? ""}|${i}`; shown = `${title} (${i})`; }
    const panel = panels.get(key) ?? { title: shown, unit: unit ?? "", columns: [] };
    panel.columns.push({ name, label: label ?? labelOf(name) });
    panels.set(key, panel);
  }
  return [...panels.values()];
}

const keyOf = (s: Stream) => `${s.file ?? ""}|${s.name}`;

/** The entry of the list of streams that shows the channels of all records under one cursor. */
const ALL = "all";
/** Panels that are shown at first, where there are many. */
const SHOWN = 6;

/** Streams that belong together in time: those that overlap the first record. */
function together(streams: Stream[]): Stream[] {
  const first = streams.find(ofCrash);
  return first ? streams.filter((s) => drawnWithCrash(s) && s.from_s < first.to_s && s.to_s > first.from_s) : [];
}

const drawnWithCrash = (s: Stream) => ofCrash(s) || s.name === "imu";

function Signals({ look, streams, imu, reading }: { look: Look; streams: Stream[]; imu: Stream; reading: Reading }) {
  const zero = zeroOfAll(look);
  const { work } = useShared();
  const crash = useMemo(() => together(streams), [streams]);
  const [name, setName] = useState(crash.length ? ALL : keyOf(imu));
  const [cursor, setCursor] = useState<number | null>(null);
  const [label, setLabel] = useState("");
  const [picked, setPicked] = useState<string[] | null>(null);
  const shown = useMemo(() => name === ALL && crash.length ? crash : [streams.find((s) => keyOf(s) === name) ?? imu], [name, streams]);
  const apart = name === ALL && crash.length ? streams.filter((s) => drawnWithCrash(s) && !crash.includes(s)) : [];
  const whole = useMemo<Span>(() => spanOf(shown), [shown]);
  const several = new Set(shown.map((s) => s.file)).size > 1;
  const all = useMemo(() => shown.flatMap((s) => panelsOf(s).map((p) => ({ ...p, source: keyOf(s), rests: s.rests ?? [], steady: s.steady ?? [], gaps: s.gaps ?? [], title: several && s.file ? `${p.title} (${s.file})` : p.title }))), [shown]);
  const chosen = picked ?? all.slice(0, SHOWN).map((p) => p.title);
  const panels = useMemo(() => all.length > SHOWN ? all.filter((p) => chosen.includes(p.title)) : all, [all, chosen.join("|")]);
  const trim: Span = work.trim ?? [imu.from_s, imu.to_s];
  const setTrim = (t: Span) => setWork({ trim: t[0] <= imu.from_s && t[1] >= imu.to_s ? null : t });
  const addMark = (t: number, words?: string) => {
    setWork({ marks: [...work.marks.filter((m) => m.t !== t), { t, label: words || String(work.marks.length + 1) }].sort((a, b) => a.t - b.t) });
    setLabel("");
  };
  const plan = useFixes(streams, reading);
  // A case takes its records whole: a part to use would be no part of it.
  const trims = recordsOf(look).length === 0;
  const ask = (columns: string[], view: Span, width: number, signal: AbortSignal, source: string) => {
    const of = shown.find((s) => keyOf(s) === source) ?? shown[0]!;
    return api.series(reading, of.file ?? reading.files[0]!, of.name, { columns, from: view[0], to: view[1], width }, signal);
  };
  return <Part title="The traces" aside={streams.length > 1 ? <label class="inline">Show <select value={name} onChange={(e) => { setName(e.currentTarget.value); setPicked(null); }}>
    {crash.length > 0 && <option value={ALL}>all channels of the crash</option>}
    {streams.map((s) => <option key={keyOf(s)} value={keyOf(s)}>{wordsOf(s)}{look.logs.length > 1 && s.file ? ` (${s.file})` : ""}</option>)}
  </select></label> : undefined}>
    {all.length > SHOWN && <More title={`${panels.length} of ${plural(all.length, "group")} of channels are shown: choose`}><fieldset class="row pick"><legend>Show</legend>
      {all.map((p) => <label class="inline" key={p.title}><input type="checkbox" checked={chosen.includes(p.title)} onChange={(e) => setPicked(e.currentTarget.checked ? [...chosen, p.title] : chosen.filter((t) => t !== p.title))} />{p.title}</label>)}
    </fieldset></More>}
    {apart.length > 0 && <p class="notice warn" role="note">Not drawn here, because the times on their clocks do not overlap with {crash[0]!.file ?? "the first record"}: {apart.map((s) => `${s.file ?? wordsOf(s)} (${stamp(s.from_s - zero, 10)} to ${stamp(s.to_s - zero, 10)} s)`).join(", ")}. Choose them above to see them alone.</p>}
    {shown.some(ofCrash) && <p class="soft">As the files state them: in SI where the unit is known, at the time of each file, not yet turned into the axes of the vehicle.</p>}
    <Traces panels={panels} whole={whole} zero={zero} askKey={JSON.stringify([reading, name])} cursor={cursor} onCursor={setCursor} ask={ask}
      trim={trims ? work.trim : null} marks={work.marks} {...(trims ? { onTrim: setTrim } : {})} onMark={(t) => addMark(t)} />
    <p class="legend">{shown.some((s) => s.rests?.length) && <span><i class="area rest" />at rest</span>}{shown.some((s) => s.steady?.length) && <span><i class="area steady" />steady: at rest, or moving evenly</span>}<span><i class="area gap" />gap</span>{trims && <span><i class="area away" />not used</span>}</p>
    {trims && <Trim whole={[imu.from_s, imu.to_s]} trim={trim} onTrim={setTrim} imu={imu} zero={zero} />}
    <h3>Reference points</h3>
    <p class="help">Instants to find again: the impact, a stop, a turn. Put the cursor there first.</p>
    <form class="row" onSubmit={(e) => { e.preventDefault(); if (cursor !== null) addMark(cursor, label.trim()); }}>
      <label class="inline">What it is <input type="text" value={label} onInput={(e) => setLabel(e.currentTarget.value)} placeholder="impact" /></label>
      <button type="submit" disabled={cursor === null}>{cursor === null ? "Mark the cursor" : `Mark ${stamp(cursor - zero, 10)} s`}</button>
    </form>
    {work.marks.length > 0 && <ul class="list">{work.marks.map((mark) => <li class="item" key={mark.t}>
      <span class="name">{mark.label}</span><span>{stamp(mark.t - zero, 1)} s</span>
      <span class="row"><button type="button" onClick={() => setCursor(mark.t)}>Show</button>
        {trims && <button type="button" disabled={mark.t >= trim[1]} onClick={() => setTrim([mark.t, trim[1]])}>Begin here</button>}
        {trims && <button type="button" disabled={mark.t <= trim[0]} onClick={() => setTrim([trim[0], mark.t])}>End here</button>}
        <button type="button" aria-label={`Remove the mark ${mark.label}`} onClick={() => setWork({ marks: work.marks.filter((m) => m !== mark) })}>Remove</button></span>
    </li>)}</ul>}
    {plan && <><h3>From above</h3><Plan track={null} fixes={plan} cursor={cursor} onCursor={setCursor} /></>}
  </Part>;
}

/** What becomes of a beginning or an end that was written, and what is said of it. */
export function trimmed(which: 0 | 1, text: string, trim: Span, whole: Span): { trim: Span | null; said: string } {
  const t = Number(text.trim().replace(",", "."));
  const length = Math.min(whole[1] - whole[0], 10), told = (v: number) => `${stamp(v, length)} s`;
  if (text.trim() === "" || !Number.isFinite(t)) return { trim: null, said: `“${text}” is no number of seconds. Write one such as ${stamp(trim[which], length)}.` };
  const other = trim[1 - which]!;
  if (which === 0 ? t >= other : t <= other) {
    return { trim: null, said: which === 0 ? `The part cannot begin at ${told(t)}: it ends at ${told(other)}. Move its end first, or write an earlier time.` : `The part cannot end at ${told(t)}: it begins at ${told(other)}. Move its beginning first, or write a later time.` };
  }
  const kept = Math.min(whole[1], Math.max(whole[0], t));
  return { trim: which === 0 ? [kept, other] : [other, kept], said: kept === t ? "" : which === 0 ? `The log begins at ${told(kept)}: the part begins there.` : `The log ends at ${told(kept)}: the part ends there.` };
}

function Trim({ whole, trim, onTrim, imu, zero }: { whole: Span; trim: Span; onTrim: (trim: Span) => void; imu: Stream; zero: number }) {
  const { work } = useShared();
  const less = ([from, to]: Span, by: number): Span => [from - by, to - by];
  const fromZero = { trim: less(trim, zero), whole: less(whole, zero), onTrim: (t: Span) => onTrim(less(t, -zero)) };
  return <>
    <h3>The part to use</h3>
    <TrimBar whole={whole} trim={trim} onTrim={onTrim} rests={imu.rests ?? []} gaps={imu.gaps ?? []} marks={work.marks} zero={zero} />
    <div class="row">
      <TrimInput label="From" which={0} {...fromZero} />
      <TrimInput label="To" which={1} {...fromZero} />
      <span class="soft">{duration(trim[1] - trim[0])} of {duration(whole[1] - whole[0])}</span>
      <button type="button" disabled={!work.trim} onClick={() => setWork({ trim: null })}>Use all</button>
    </div>
  </>;
}

function TrimInput({ label, which, trim, whole, onTrim }: { label: string; which: 0 | 1; trim: Span; whole: Span; onTrim: (trim: Span) => void }) {
  const written = stamp(trim[which], Math.min(whole[1] - whole[0], 10));
  const [text, setText] = useState<string | null>(null);
  const [said, setSaid] = useState({ text: "", wrong: false });
  const id = useId();
  // A part that was set by other means leaves nothing to say.
  useEffect(() => { setText(null); setSaid((one) => one.wrong ? { text: "", wrong: false } : one); }, [trim[0], trim[1]]);
  const commit = () => {
    if (text === null || text === written) { setText(null); return setSaid({ text: "", wrong: false }); }
    const made = trimmed(which, text, trim, whole);
    setSaid({ text: made.said, wrong: made.trim === null });
    // What is refused stays to be corrected.
    if (made.trim) { setText(null); onTrim(made.trim); }
  };
  return <span class="triminput">
    <label class="inline">{label} <span class="withunit"><input type="text" inputMode="decimal" size={12} value={text ?? written} aria-invalid={said.wrong} aria-describedby={said.text ? id : undefined}
      onInput={(e) => setText(e.currentTarget.value)} onBlur={commit} onKeyDown={(e) => { if (e.key === "Enter") commit(); }} /><span class="unit">s</span></span></label>
    <span id={id} class={said.wrong ? "fault" : "soft"} role="alert">{said.text}</span>
  </span>;
}

/** The fixes of the log, as a line for the plan. */
function useFixes(streams: Stream[], reading: Reading): Line | null {
  const stream = streams.find((s) => s.columns.some((c) => c.name === "lat") && s.columns.some((c) => c.name === "lon"));
  const series = useRequest(stream ? (signal) => api.series(reading, stream.file ?? reading.files[0]!, stream.name, { columns: ["lat", "lon"], width: 1500 }, signal) : null,
    [JSON.stringify(reading), stream?.name, stream?.file]);
  return useMemo(() => {
    const { lat, lon } = series.value?.columns ?? {};
    if (!series.value || !lat || !lon) return null;
    // Within a bucket of the pyramid: the middle of its extremes.
    const middle = (one: typeof lat) => one.low.map((v, i) => v === null || one.high[i] === null ? NaN : (v + one.high[i]!) / 2);
    return { t: series.value.t, lat: middle(lat), lon: middle(lon) };
  }, [series.value]);
}

const AXES = ["forward-right-down", "forward-left-up", "right-forward-up", "left-back-up", "back-right-up", "up-right-forward"];

function ReadingForm({ files }: { files: string[] }) {
  const { work } = useShared();
  const [of, setOf] = useState("");
  const file = files.length > 1 && files.includes(of) ? of : null;
  const own: Keys = file === null ? {} : ofFiles(work.log)[file] ?? {};
  const common = (key: string) => key === "axes" ? work.axes : work.log[key];
  const set = (key: string) => (value: unknown) => answerLog({ [key]: value }, work.log, file);
  const field = (key: string, label: string, help: string, type: "text" | "number" | "choice" | "flag" = "text", choices?: string[], unit: string | null = null) =>
    <Control field={{ key, label, unit, type, choices: choices ?? null, help }} value={own[key] ?? common(key)} onChange={set(key)} />;
  return <More title="Correct how it is read">
    {files.length > 1 && <label class="inline">Of <select value={file ?? ""} onChange={(e) => setOf(e.currentTarget.value)}><option value="">all files</option>{files.map((name) => <option key={name} value={name}>{name}</option>)}</select></label>}
    <div class="fields">
      {field("axes", "Axes", "Where x, y, z of the sensor point on the vehicle", "choice", AXES)}
      {field("gyro_unit", "Unit of angular rates", "rad/s, deg/s, or of raw counts deg/s/131")}
      {field("accel_unit", "Unit of accelerations", "m/s2, g, mg; -g for the other sign (iOS)")}
      {field("time_unit", "Unit of the time", "", "choice", ["s", "ms", "us", "ns"])}
      {field("sampling", "Each row is", "the rate at its stamp, or the mean over the interval that ends there", "choice", ["instantaneous", "mean"])}
      {field("rate_hz", "Sample rate", "for a log without a column of times", "number", undefined, "Hz")}
      {field("repair", "Repair", "drop rows that cannot be used, and unwrap the clock; both are reported", "flag")}
    </div>
  </More>;
}

function Places({ streams }: { look: Look; reading: Reading; streams: Stream[] }) {
  const { work } = useShared();
  const places = work.places ?? { sensor: [0, 0, 0] as Point, antenna: [0, 0, 0] as Point };
  const fixes = streams.some((s) => s.columns.some((c) => c.name === "lat"));
  const arm = places.antenna.map((v, i) => v - places.sensor[i]!);
  return <Part title="Where the sensor sits">
    <p>{fixes ? "The distance between the antenna and the sensor matters: a meter too much shows as a meter in every turn." : "A crash and a wheeled vehicle need it; for an attitude alone it does not matter."}</p>
    <Vehicle dots={[{ key: "sensor", label: "Sensor", value: places.sensor }, ...(fixes ? [{ key: "antenna", label: "Antenna", value: places.antenna }] : [])]}
      onMove={(key, value) => setWork({ places: { ...places, [key]: value } })} />
    {fixes && work.places && <p>The antenna is <b>{arm.map((v) => number(v, 3)).join(", ")} m</b> forward, right, down of the sensor. This goes into the configuration as <code>lever_arm_m = [{arm.map((v) => number(v, 3)).join(", ")}]</code>.</p>}
  </Part>;
}

/** Whether the log suffices for a kind, as doctor says or as its rests show. */
export function suffices(kind: Kind, look: Look): { answer: string; reasons: Finding[] } | null {
  const of = { navigate: "navigation", attitude: "attitude", crash: "crash" }[kind.kind];
  // Of several files the one that has most of it; of none, the log that was read.
  const order = ["yes", "with limits", "no"];
  const read = [...look.logs].sort((a, b) => Number(b.read_as.length > 0) - Number(a.read_as.length > 0));
  const fits = of ? read.flatMap((log) => log.fit[of] ? [log.fit[of]!] : []) : [];
  if (fits.length) return fits.reduce((best, fit) => order.indexOf(fit.answer) < order.indexOf(best.answer) ? fit : best);
  const longest = look.rests.length ? Math.max(...look.rests.map(([a, b]) => b - a)) : 0;
  const say = (answer: string, text: string) => ({ answer, reasons: [{ code: "studio.rests", severity: "note", text }] });
  const rest = longest ? `the longest rest is ${duration(longest)}` : "no rest was found";
  if (kind.kind === "align") return say(longest > 0 ? "with limits" : "no", `${rest}; at rest accelerometers show roll and pitch, and gyros that measure the rotation of the Earth the heading: state it for others, such as those of a phone`);
  // A rest is a pose; which way up it was, and how fast a turn was, a log alone does not say.
  if (kind.kind === "calibrate") {
    const gyro = look.logs.some((log) => log.read_as.some((one) => /^-?gyro/.test(one.quantity)));
    const poses = look.rests.length ? `${look.rests.length === 1 ? "one rest was" : `${look.rests.length} rests were`} found, each a pose at most; whether their attitudes differ enough, and what each was, is not known` : "no rest was found, and each pose of a calibration is one";
    return say(look.rests.length ? "not known" : "no", gyro ? `${poses}; a gyro was read` : `${poses}; no gyro was read, so biases and scales of the accelerometer alone`);
  }
  if (kind.kind === "allan") return say(longest >= 3600 ? "yes" : longest >= 300 ? "with limits" : "no", `${rest}; the white noise takes minutes, the bias instability an hour or more`);
  return null;
}

const ANSWERS: Record<string, { words: string; look: string }> = {
  yes: { words: "This log has it", look: "good" }, "with limits": { words: "Possible, with limits", look: "warn" }, no: { words: "This log does not suffice", look: "bad" },
  "not known": { words: "Not known whether it suffices", look: "" },
};

/** The best answers come first: to the first that any kind has goes the button that stands out. */
const BEST = ["yes", "with limits"];

export function ChoosePage() {
  const { work } = useShared();
  const look = useLook();
  const kinds = useRequest(() => api.kinds(), []);
  const choose = (kind: string) => {
    setWork(kind === work.kind ? {} : { kind, toml: "", proposal: null, proposedFor: "", name: "", options: [] });
    location.hash = "#/configure";
  };
  if (!work.files.length) {
    return <Page title="No file chosen"><Empty><a href="#/files">Choose a file</a> first.</Empty></Page>;
  }
  const fits = new Map((kinds.value ?? []).map((kind) => [kind.kind, look.value ? suffices(kind, look.value) : null]));
  const best = BEST.find((answer) => [...fits.values()].some((fit) => fit?.answer === answer));
  return <Page title="What do you want to find out?">
    <Trouble problem={kinds.problem} retry={kinds.again} />
    <Trouble problem={look.problem} retry={look.again} />
    {(kinds.busy || look.busy) && <Busy>One moment…</Busy>}
    <ul class="kinds">
      {kinds.value?.map((kind) => {
        const fit = fits.get(kind.kind) ?? null;
        const answer = fit ? ANSWERS[fit.answer] : null;
        return <li key={kind.kind}>
          <h2>{kind.title}</h2>
          <p>{kind.what}</p>
          <p class="soft">It needs {kind.needs}</p>
          {answer && <p class={`verdict ${answer.look}`}>{answer.words}</p>}
          {fit && fit.reasons.length > 0 && <More title="Why"><Findings findings={fit.reasons} /></More>}
          <button type="button" class={fit && fit.answer === best ? "main" : ""} onClick={() => choose(kind.kind)}>{kind.title}</button>
        </li>;
      })}
    </ul>
  </Page>;
}
