// The result: key numbers with their bounds, what was noticed, plan and series under one cursor,
// the attitude, the sealed report, exports, and the command that repeats it.

import { useEffect, useMemo, useState } from "preact/hooks";
import { api, part } from "./api";
import { Attitude, fromEuler } from "./attitude";
import { bytes, capital, date, number, plural, stamp, zeroOf } from "./format";
import { indexOf, METERS_PER_DEG, Plan } from "./plan";
import { REFERENCE, Traces, type Panel } from "./traces";
import type { Finding, KeyNumber, RunDetail, Series as SeriesData, Span, Track } from "./types";
import { Busy, Command, Empty, Findings, More, Options, Page, Part, sentence, Table, Trouble, useRequest } from "./ui";

export function ResultPage({ name }: { name: string }) {
  const run = useRequest(() => api.run(name), [name]);
  if (!name) return <Page title="No result chosen"><Empty><a href="#/files">Choose one</a> of the folder.</Empty></Page>;
  const found = run.value;
  return <Page title={found?.title || name} lead={found?.answer ?? undefined}>
    {run.busy && <Busy>Opening the result…</Busy>}
    <Trouble problem={run.problem} retry={run.again} />
    {found && <Result run={found} />}
  </Page>;
}

function Result({ run }: { run: RunDetail }) {
  const [cursor, setCursor] = useState<number | null>(null);
  const track = useRequest(run.has.track ? () => api.track(run.name) : run.has.series ? (signal) => trackOfSeries(run.name, signal) : null, [run.name]);
  const exports: [string, string, boolean][] = [
    ["zip", "The whole result (.zip)", true], ["pdf", "Report (.pdf)", Boolean(run.has.pdf)], ["gpx", "Track (.gpx)", Boolean(run.has.track)], ["toml", "Configuration (.toml)", run.has.toml !== false],
  ];
  return <>
    {run.verdict && VERDICTS[run.verdict] && <p class={`verdict ${VERDICTS[run.verdict]!.look}`}>{VERDICTS[run.verdict]!.words}</p>}
    <Against reasons={run.against ?? []} heading={run.heading ?? null} />
    {(run.premises?.length ?? 0) > 0 && <ul class="plain against" aria-label="What it rests on">{run.premises!.map((one) => <li key={one}>{sentence(one)}</li>)}</ul>}
    <Numbers numbers={run.numbers} />
    {(run.figures?.length ?? 0) > 0 && <div class="drawings">
      {run.figures!.map((one) => <figure key={one.address} class={one.width > 1.5 * one.height ? "broad" : ""}><a href={one.address} target="_blank" rel="noopener noreferrer" aria-label={`${one.title}, alone`}><img src={one.address} alt={one.alt} width={one.width} height={one.height} loading="lazy" /></a><figcaption>{one.title}</figcaption></figure>)}
    </div>}
    <div class="row exports" role="group" aria-label="Take it with you">
      {exports.filter(([, , has]) => has).map(([as, words]) => <a class="button" key={as} href={api.exportOf(run.name, as)} download>{words}</a>)}
      {run.report && !run.has.pdf && <a class="button" href={run.report} target="_blank" rel="noopener noreferrer" title="It opens in a tab of its own, laid out for paper: print it there, or save it as a PDF (Ctrl+P)">Report to print or save as PDF</a>}
      <a class="button" href={`#/compare?run=${part(run.name)}`}>Compare with another</a>
    </div>
    {run.findings.length > 0 && <Part title="What was noticed"><Findings findings={run.findings} /></Part>}
    <Trouble problem={track.problem} retry={track.again} />
    {track.busy && <Busy>Reading the track…</Busy>}
    {track.value && <Motion run={run} track={track.value} cursor={cursor} onCursor={setCursor} />}
    {run.report && <Part title="The report" aside={<a href={run.report} target="_blank" rel="noopener noreferrer">Open in a tab of its own</a>}>
      <iframe class="report" src={run.report} title="The report" sandbox="allow-scripts" referrerpolicy="no-referrer" loading="lazy" />
    </Part>}
    <Part title="Repeat it">
      <p>This repeats the run and compares every file with it, to the last bit:</p>
      <Command text={run.verifying} />
      {run.command_line && <>
        <p>This makes it again, in a folder of its own. The data files are the same to the last bit; the seal is another where the name of the folder is in what it covers: in <code>manifest.json</code> and the report.</p>
        <Command text={run.command_line} />
      </>}
      <p class="soft">Made {date(run.made)}. Seal <code class="digest">{run.digest}</code></p>
      <More title={<>Options <span class="soft">{plural(run.options.filter((one) => !one.usual).length, "option")} set, {run.options.filter((one) => one.usual).length} as by default</span></>}><Options options={run.options} /></More>
      <More title={<>Inputs <span class="soft">{plural(run.inputs.length, "file")}</span></>}>
        {run.inputs.length ? <Table stack head={["File", "Used as", "Size", "SHA-256"]} rows={run.inputs.map((one) => [one.name, one.role, one.bytes === null ? "" : bytes(one.bytes), <code class="digest">{one.sha256 ?? ""}</code>])} /> : <Empty>None: everything is in the options.</Empty>}
      </More>
    </Part>
  </>;
}

/** As the reports put it. */
const VERDICTS: Record<string, { words: string; look: string }> = {
  trusted: { words: "The result can be trusted", look: "good" }, reserve: { words: "Use with caution", look: "warn" }, distrusted: { words: "Do not trust the result", look: "bad" },
};

/** Reasons that stand beside the verdict; the rest is folded. */
const FEW = 3;

/** Why a result is not trusted without reserve. */
function Against({ reasons: found, heading }: { reasons: Finding[]; heading: string | null }) {
  const reasons = [...(heading ? [heading] : []), ...found.map((one) => sentence(one.text ?? one.code))];
  if (!reasons.length) return null;
  const list = (some: string[]) => <ul class="plain">{some.map((one, i) => <li key={i}>{one}</li>)}</ul>;
  return <div class="against" role="group" aria-label="Reasons against it">
    {list(reasons.slice(0, FEW))}
    {reasons.length > FEW && <More title={plural(reasons.length - FEW, "further reason")}>{list(reasons.slice(FEW))}</More>}
  </div>;
}

/** What people ask for first, by the names of `strapdown compare`. */
const MAIN = [
  /: delta-V$/, /: direction of force/, /: clock direction$/, /^Severity: MAIS3\+/, /^Deformation: crush$/, /^At the end: position, horizontal$/, /^At the end: heading$/, /^Errors against the truth: .*horizontal, rms$/, /^Errors against truth: quaternion, rms$/, /: way over ground$/, /: largest 95 % bound, horizontal$/, /^At the end: height$/,
  /^At the end: roll$/, /^At the end: pitch$/, /: algorithm$/, /: lowest rate$/, /: shortest time/,
];

/** "63.1 ± 2.5 km/h": value, bound and unit in one; of a latitude "37.72549° ± 1.2 m". */
function said({ value, bound, unit, bound_unit }: KeyNumber): string {
  const parts = !bound ? [value, unit] : unit === bound_unit ? [value, bound, unit] : [value, unit, bound, bound_unit];
  return parts.filter(Boolean).join("\u00a0");
}

/** What a name alone leaves open. */
const MEANS: [RegExp, string][] = [[/^delta-V$/, "change of velocity in the impact, no speed of travel"], [/direction of force/, "0 is from ahead, clockwise"], [/^MAIS3\+/, "probability of a serious injury, by a published model"], [/^crush$/, "by how much the reference point came nearer to the barrier"]];

/** The name of a number in large: of an injury without the source of its model, which is below. */
const nameOf = ({ group, label }: KeyNumber) => group === "Severity" ? label.split(", ")[0]! : label;

/** The numbers that matter first, large; all in a table. */
function Numbers({ numbers: all }: { numbers: KeyNumber[] }) {
  if (!all.length) return null;
  const main = MAIN.flatMap((pattern) => all.filter((one) => pattern.test(`${one.group}: ${one.label}`)).slice(0, 1)).slice(0, 6);
  const of = (group: string) => all.filter((one) => one.group === group);
  const large = main.length ? main : all.filter((one) => one.value && one.bound).slice(0, 4);
  return <>
    {large.length > 0 && <dl class="keys">
      {large.map((one) => <div key={`${one.group} ${one.label}`}><dt>{[capital(nameOf(one)), one.group.toLowerCase() === "at the end" ? "at the end" : "", one.group.startsWith("Errors against") ? "against the reference" : ""].filter(Boolean).join(" ")}</dt>
        <dd>{one.value ? <>{one.value} <small>{one.bound} {one.bound ? one.bound_unit : one.unit}</small></> : said(one)}</dd>
        {MEANS.filter(([pattern]) => pattern.test(one.label)).map(([, words]) => <dd class="means" key={words}>{words}</dd>)}
        {nameOf(one) !== one.label && <dd class="means">{one.label.slice(nameOf(one).length + 2)}</dd>}
        {one.note && <dd class="means">{one.note}</dd>}</div>)}
    </dl>}
    {large.some((one) => one.bound) && <p class="help">Bounds hold 95 % of the time.</p>}
    <More title={`All ${plural(all.length, "number")}`}>
      <div class="pairs">{[...new Set(all.map((one) => one.group))].map((group) => <Table key={group} caption={group || "Result"} head={["Quantity", of(group).some((one) => one.bound) ? "Value with 95 % bound" : "Value"]} numeric={[1]}
        rows={of(group).map((one) => [one.note ? <>{one.label} <span class="soft said">{one.note}</span></> : one.label, said(one)])} />)}</div>
    </More>
  </>;
}

const GROUPS: [RegExp, string, string?][] = [
  [/^north_m/, "Path", "north"], [/^east_m/, "Path", "east"], [/^down_m/, "Path", "down"],
  [/^VN_m/, "Velocity", "north"], [/^VE_m/, "Velocity", "east"], [/^VD_m/, "Velocity", "down"],
  [/^roll_deg/, "Roll and pitch", "roll"], [/^pitch_deg/, "Roll and pitch", "pitch"], [/^heading_deg/, "Heading", "heading"], [/^alt_m/, "Height", "height"],
  [/^(north|east|down)_sd/, "Position, standard deviation"], [/^V[NED]_sd/, "Velocity, standard deviation"], [/^(roll|pitch|heading)_sd/, "Attitude, standard deviation"],
  [/^(lat|lon)_/, ""],
];

/** Columns of several algorithms, each under its name: "quaternion roll_deg". */
const BY_ALGORITHM = /^(\S.*) (roll|pitch|heading|q_[wxyz])(_deg)?$/;
const QUANTITY: Record<string, string> = { roll: "Roll by algorithm", pitch: "Pitch by algorithm", heading: "Heading by algorithm" };

/** Words of axes along the vehicle at its entry, where no heading is known. */
const ALONG: [RegExp, string][] = [[/^(north|VN)\b/, "forward"], [/^(east|VE)\b/, "right"], [/^VD\b/, "down"]];

/** Panels for the columns of a result: of one quantity in one panel. */
export function panelsOfRun(series: SeriesData, overGround = true): Panel[] {
  const told = (label: string) => overGround ? label : ALONG.reduce((words, [pattern, own]) => words.replace(pattern, own), label);
  const panels = new Map<string, Panel>();
  for (const title of [...GROUPS.map(([, title]) => title), ...Object.values(QUANTITY)]) if (title) panels.set(title, { title, unit: "", columns: [] });
  for (const [name, { unit }] of Object.entries(series.columns)) {
    const [, algorithm, quantity] = BY_ALGORITHM.exec(name) ?? [];
    const [, title, label] = algorithm ? [null, QUANTITY[quantity!] ?? `${quantity} by algorithm`, algorithm] : GROUPS.find(([pattern]) => pattern.test(name)) ?? [null, name];
    if (!title) continue;
    const panel = panels.get(title) ?? { title, unit: unit ?? "", columns: [] };
    panel.unit = unit ?? "";
    panel.columns.push({ name, label: told(label ?? name.replace(/_sd.*$/, "")) });
    panels.set(title, panel);
  }
  if (!overGround) for (const title of ["Path", "Velocity", "Heading"]) panels.get(title)!.title += title === "Heading" ? ", from that at the entry" : ", along the vehicle at the entry";
  return [...panels.values()].filter((panel) => panel.columns.length);
}

/** The middle of a bucket; where an angle goes over its end within it, one of the two. */
const middle = (low: number, high: number, angle: boolean) => angle && high - low > 180 ? low : (low + high) / 2;

const ANGLES = ["Roll", "Pitch", "Heading"];

/** Half the width of an interval of 95 %, in standard deviations. */
const TWO_SIDED_95 = 1.959964;

/** That the attitude of a crash is no measurement. */
const ASSUMED = "sensors.roll-assumed";

/** The motion of a result without positions on the Earth, such as that of a crash, by its series. */
async function trackOfSeries(name: string, signal: AbortSignal): Promise<Track | null> {
  const there = Object.keys((await api.runSeries(name, { columns: [], width: 1 }, signal)).columns);
  const algorithms = [...new Set(there.map((column) => BY_ALGORITHM.exec(column)?.[1]).filter((one) => one !== undefined && one !== REFERENCE))];
  // Of several algorithms the exact one that all peers have; else the last: they go from simple to good.
  const by = algorithms.includes("quaternion") ? "quaternion" : algorithms[algorithms.length - 1];
  const wanted = ["north_m", "east_m", ...["roll_deg", "pitch_deg", "heading_deg"].map((angle) => by ? `${by} ${angle}` : angle)];
  const bounds = ANGLES.map((angle) => `${angle.toLowerCase()}_sd_deg`);
  const { t, columns } = await api.runSeries(name, { columns: [...wanted, ...by ? [] : bounds].filter((one) => there.includes(one)), width: 2000 }, signal);
  if (t.length < 2) return null;
  const [north, east, roll, pitch, heading] = wanted.map((one) => columns[one]?.low.map((low, i) => middle(Number(low), Number(columns[one]!.high[i]), one.endsWith("_deg"))));
  const sd = bounds.map((one) => columns[one]?.high);
  // On a grid a meter is a meter: degrees about the equator stand for it.
  const flat = (meters: number[] | undefined) => meters ? meters.map((m) => m / METERS_PER_DEG) : t.map(() => NaN);
  return {
    t, lat: flat(north), lon: flat(east), alt: [], fixes: null, reference: null, by,
    sd: sd.every((one) => one) ? t.map((_, i) => sd.map((one) => Number(one![i])) as [number, number, number]) : null,
    q: roll && pitch && heading ? t.map((_, i) => fromEuler(roll[i]!, pitch[i]!, heading[i]!)) : null,
  };
}

function Motion({ run, track, cursor, onCursor }: { run: RunDetail; track: Track; cursor: number | null; onCursor: (t: number | null) => void }) {
  const [playing, setPlaying] = useState(false);
  const last = track.t[track.t.length - 1] ?? 0;
  const whole = useMemo<Span>(() => [run.from_s ?? track.t[0] ?? 0, run.to_s ?? last], [run, track]);
  const at = cursor ?? whole[0], zero = zeroOf(whole[0]);
  useEffect(() => {
    if (!playing) return;
    // The whole record in half a minute, or in its own time if it is shorter.
    const speed = Math.max(1, (whole[1] - whole[0]) / 30);
    let t = at >= whole[1] ? whole[0] : at, before = performance.now(), frame = 0;
    const draw = (now: number) => {
      t += ((now - before) / 1000) * speed;
      before = now;
      if (t >= whole[1]) { onCursor(whole[1]); setPlaying(false); return; }
      onCursor(t);
      frame = requestAnimationFrame(draw);
    };
    frame = requestAnimationFrame(draw);
    return () => cancelAnimationFrame(frame);
  }, [playing]);
  const i = track.t.length ? indexOf(track.t, at) : -1;
  const q = i >= 0 ? track.q?.[i] ?? null : null;
  const sd = i >= 0 ? track.sd?.[i] : null;
  const bounds = sd ? ANGLES.map((name, k) => ({ name, bound: `± ${number(TWO_SIDED_95 * sd[k]!, 2)}°` })) : [];
  const assumed = run.findings.some((one) => one.code === ASSUMED);
  const hasPlace = track.lat.some(Number.isFinite);
  return <Part title="The motion">
    <div class="row scrub">
      <button type="button" onClick={() => setPlaying(!playing)}>{playing ? "Pause" : "Play"}</button>
      <input type="range" class="wide" aria-label="Instant" min={whole[0]} max={whole[1]} step={(whole[1] - whole[0]) / 1000 || 1} value={at} aria-valuetext={`${stamp(at - zero, 10)} s`} onInput={(e) => { setPlaying(false); onCursor(e.currentTarget.valueAsNumber); }} />
      <output>{stamp(at - zero, 10)} s</output>
    </div>
    {zero > 0 && <p class="soft">Times are from the beginning, which is {stamp(zero, 1)} s in the file.</p>}
    <div class="motion">
      {hasPlace && <Plan track={track} onMap={Boolean(run.has.track)} {...(run.over_ground === false ? { up: "forward at the entry" } : {})} fixes={track.fixes} reference={track.reference} cursor={at} onCursor={onCursor} />}
      {track.q && <Attitude q={q} north={run.over_ground === false ? "entry" : run.begins === "zero" || run.begins === "level" ? "start" : "true"} bounds={bounds} given={run.begins === "zero" ? "from a beginning that was taken as zero: " : assumed ? "by assumption, as not all rates of turn are measured: " : ""} at={`${track.by ? `By ${track.by}, ` : ""}${stamp(at - zero, 10)} s:`} />}
    </div>
    <Series run={run} whole={whole} cursor={cursor} onCursor={onCursor} />
  </Part>;
}

function Series({ run, whole, cursor, onCursor }: { run: RunDetail; whole: Span; cursor: number | null; onCursor: (t: number | null) => void }) {
  // One bucket: which columns there are.
  const columns = useRequest(run.panels || !run.has.series ? null : (signal) => api.runSeries(run.name, { columns: [], width: 1 }, signal), [run.name]);
  const all = useMemo(() => run.panels ?? (columns.value ? panelsOfRun(columns.value, run.over_ground !== false) : []), [run, columns.value]);
  const [picked, setPicked] = useState<string[] | null>(null);
  const chosen = picked ?? all.slice(0, 3).map((p) => p.title);
  const panels = useMemo(() => all.filter((p) => chosen.includes(p.title)), [all, chosen.join("|")]);
  if (columns.problem) return <Trouble problem={columns.problem} retry={columns.again} />;
  if (!all.length) return null;
  return <>
    <fieldset class="row pick"><legend>Show</legend>
      {all.map((p) => <label class="inline" key={p.title}><input type="checkbox" checked={chosen.includes(p.title)} onChange={(e) => setPicked(e.currentTarget.checked ? [...chosen, p.title] : chosen.filter((t) => t !== p.title))} />{p.title}</label>)}
    </fieldset>
    {panels.length > 0 && <Traces panels={panels} whole={whole} zero={zeroOf(whole[0])} askKey={run.name} cursor={cursor} onCursor={onCursor}
      ask={(columns, view, width, signal) => api.runSeries(run.name, { columns, from: view[0], to: view[1], width }, signal)} />}
  </>;
}
