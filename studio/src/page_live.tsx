// Live: listen to a phone or a sensor, show its address as a code to scan, and draw attitude and
// position as they come. Every byte is kept; the session becomes a log like any other.

import { useEffect, useMemo, useState } from "preact/hooks";
import { encode } from "uqr";
import { api, problemOf } from "./api";
import { Attitude, fromEuler, type North, type Quaternion } from "./attitude";
import { duration, stamp } from "./format";
import { Plan, type Line } from "./plan";
import { CAME, history, newWork, putJob, useShared } from "./store";
import { Traces, type Panel } from "./traces";
import type { Job, Problem, Series, Span } from "./types";
import { Busy, Command, Control, Empty, More, Page, Part, sentence, Table, Trouble, useRequest } from "./ui";
import { STATES } from "./page_run";

export function LivePage({ id }: { id: string }) {
  const { state } = useShared();
  const jobs = state?.jobs.filter((job) => job.kind === "live") ?? [];
  const job = jobs.find((one) => one.id === id) ?? jobs.find((one) => one.state === "running" || one.state === "waiting");
  return <Page title="Live" lead="A phone or a sensor sends, this computer listens and keeps every byte. Attitude and position appear as they come.">
    {job && <Session job={job} key={job.id} />}
    {(!job || (job.state !== "running" && job.state !== "waiting")) && <Begin />}
    {jobs.filter((one) => one !== job).length > 0 && <Part title="Earlier sessions">
      <ul class="list">{jobs.filter((one) => one !== job).map((one) => <li class="item" key={one.id}><a class="name" href={`#/live/${encodeURIComponent(one.id)}`}>{one.name}</a><span class="soft">{STATES[one.state]}</span></li>)}</ul>
    </Part>}
  </Page>;
}

function Begin() {
  const { state } = useShared();
  const info = useRequest(() => api.live(), [(state?.files ?? []).map((file) => file.name).filter((one) => one.toLowerCase().endsWith(".toml")).join("|")]);
  const [protocol, setProtocol] = useState("");
  const [name, setName] = useState(() => {
    let i = 1;
    while (state?.files.some((file) => file.name === `live-${i}`) || state?.jobs.some((job) => job.name === `live-${i}`)) i++;
    return `live-${i}`;
  });
  const [options, setOptions] = useState<Record<string, unknown>>({});
  const [run, setRun] = useState("");
  const configurations = info.value?.configurations ?? [];
  const [problem, setProblem] = useState<Problem | null>(null);
  const chosen = info.value?.protocols.find((one) => one.name === protocol) ?? info.value?.protocols[0];
  const places = chosen?.fields.find((one) => one.key === "listen")?.places ?? [];
  const at = chosen?.fields.find((one) => one.key === "listen" || one.key === "udp");
  const address = at ? String(options[at.key] ?? at.default ?? "") : "";
  const taken = state?.runs.some((run) => run.name === name) || state?.files.some((file) => file.name === name) || state?.jobs.some((job) => job.name === name && (job.state === "running" || job.state === "waiting"));
  const begin = async () => {
    if (!chosen) return;
    setProblem(null);
    try {
      const job = await api.begin({ kind: "live", name, protocol: chosen.name, options: run ? { ...options, run } : options });
      putJob(job);
      location.hash = `#/live/${encodeURIComponent(job.id)}`;
    } catch (error) {
      setProblem(problemOf(error));
    }
  };
  return <Part title="Start listening">
    {info.busy && <Busy>One moment…</Busy>}
    {info.problem?.code === "studio.no-such-page" ? <><Empty>This studio does not listen itself. From a terminal it goes so, and the session is a log that the studio opens:</Empty><Command text="strapdown live --listen 0.0.0.0:8437 --out session" /></>
      : <Trouble problem={info.problem} retry={info.again} />}
    <Trouble problem={problem} />
    {info.value && !info.value.protocols.length && <Empty>This installation has nothing that can listen.</Empty>}
    {chosen && <>
      <fieldset class="list"><legend>What sends</legend>
        {info.value!.protocols.map((one) => <label class="item" key={one.name}>
          <input type="radio" name="protocol" checked={one === chosen} onChange={() => { setProtocol(one.name); setOptions({}); }} />
          <span class="name">{one.title}</span><span class="soft">{one.help}</span></label>)}
      </fieldset>
      <div class="fields wide runfile"><div class="field">
        <label for="liverun">What is computed</label>
        <select id="liverun" aria-describedby="liverunhelp" value={run} onChange={(e) => setRun(e.currentTarget.value)}>
          <option value="">Attitude, by an orientation filter</option>
          {configurations.map((one) => <option key={one} value={one}>Navigation by {one}</option>)}
        </select>
        <p class="help" id="liverunhelp">{configurations.length ? "A configuration of a navigation gives position and velocity, too; its sensor, start and aiding are used, its log is not." : "For position and velocity, too, bring the configuration of a navigation (.toml) into the folder, or set one up from a log of this sensor."}</p>
      </div></div>
      {places.length > 0 && <fieldset class="list"><legend>Who can reach it</legend>
        {places.map(([place, words]) => <label class="item" key={place}>
          <input type="radio" name="place" checked={address === place} onChange={() => setOptions({ ...options, listen: place })} />
          <span class="name">{words}</span><span class="soft">{place}</span></label>)}
      </fieldset>}
      <div class="fields">{chosen.fields.map((field) => <Control key={`${chosen.name}.${field.key}`} field={field} value={options[field.key]}
        onChange={(value) => { const rest = { ...options }; if (value === null) delete rest[field.key]; else rest[field.key] = value; setOptions(rest); }} />)}</div>
      {address && LOCAL.test(address) && <p class="notice warn" role="status">A phone cannot reach {address}: only programs on this computer can.{places.length > 0 && " For a phone in the same network choose 0.0.0.0 above."}</p>}
      {info.value!.warning && address && !LOCAL.test(address) && <p class="notice warn" role="status">{sentence(info.value!.warning)}</p>}
      <div class="next startrun">
        <label class="inline">Name of the session <input type="text" value={name} onInput={(e) => { setName(e.currentTarget.value); setProblem(null); }} /></label>
        <button type="button" class="main" disabled={!name.trim() || taken} onClick={() => void begin()}>Listen</button>
        {taken && <span class="soft">There is one of this name.</span>}
      </div>
    </>}
  </Part>;
}

const num = (line: Record<string, unknown>, ...keys: string[]): number | null => {
  for (const key of keys) if (typeof line[key] === "number") return line[key] as number;
  return null;
};

function attitudeOf(line: Record<string, unknown>): Quaternion | null {
  if (Array.isArray(line["q"]) && line["q"].length === 4) return line["q"] as Quaternion;
  const [roll, pitch, heading] = [num(line, "roll"), num(line, "pitch"), num(line, "heading")];
  return roll === null || pitch === null ? null : fromEuler(roll, pitch, heading ?? 0);
}

/** Silent after so many of the periods in which states come, and not before so many ms. */
const PERIODS = 4, LEAST = 2000;

/** The longest silence of the sender as it sent, ms: what comes together is of one message. */
function periodOf(lines: Record<string, unknown>[]): number {
  const came = lines.slice(-100).map((line) => num(line, CAME)!);
  const pauses = came.map((at, i) => at - (came[i - 1] ?? at)).filter((ms) => ms > 50).sort((a, b) => a - b);
  return pauses[pauses.length >> 1] ?? LEAST / PERIODS;
}

/** States with an empty one in each pause, so that curves break there and do not join over it. */
function withPauses(lines: Record<string, unknown>[]): Record<string, unknown>[] {
  const steps = lines.slice(1).map((line, i) => num(line, "time")! - num(lines[i]!, "time")!);
  return lines.flatMap((line, i) => {
    const step = steps[i];
    // Against the steps beside it: the page has states of a long session at wider steps.
    const near = [...steps.slice(Math.max(0, i - 2), i), ...steps.slice(i + 1, i + 3)].sort((a, b) => a - b);
    const usual = near[near.length >> 1];
    const pause = step !== undefined && usual !== undefined && step > Math.max(LEAST / 1000, PERIODS * usual);
    return pause ? [line, { time: num(line, "time")! + step / 2 }] : [line];
  });
}

function Session({ job }: { job: Job }) {
  const { lines: all, state } = useShared();
  const [problem, setProblem] = useState<Problem | null>(null);
  const [device, setDevice] = useState<string | null>(null);
  const states = (all[job.id] ?? []).filter((line) => num(line, "time") !== null);
  const devices = [...new Set(states.map((line) => String(line["session"] ?? "")))];
  const shown = device ?? devices[0] ?? "";
  const lines = states.filter((line) => String(line["session"] ?? "") === shown);
  const going = job.state === "running" || job.state === "waiting";
  const [now, setNow] = useState(Date.now());
  useEffect(() => { history(job.id).catch((error: unknown) => setProblem(problemOf(error))); }, [job.id]);
  useEffect(() => {
    if (!going) return;
    const timer = setInterval(() => setNow(Date.now()), 500);
    return () => clearInterval(timer);
  }, [going]);
  const last = lines[lines.length - 1];
  const age = last ? Math.max(0, Math.max(now, Date.now() - 500) - num(last, CAME)!) : 0;
  const silent = going && last !== undefined && age > Math.max(LEAST, PERIODS * periodOf(lines));
  const old = silent ? duration(Math.floor(age / 1000)) : "";
  const end = async () => {
    try {
      putJob(await api.cancel(job.id));
    } catch (error) {
      setProblem(problemOf(error));
    }
  };
  // Each session is a log of the folder like any other.
  const logs = going ? [] : (state?.files ?? []).filter((file) => file.name.startsWith(`${job.name}/`));
  const open = (name: string) => { newWork([name]); location.hash = "#/look"; };
  return <Part title={job.name} aside={<span class="soft" role="status">{going ? job.live ? silent ? `Silent for ${old}` : lines.length ? "Receiving" : "Waiting for the first sample" : "Starting" : STATES[job.state]}</span>}>
    <Trouble problem={problem} />
    {job.state === "failed" && <Trouble problem={job.error} />}
    {going && job.live && <div class="pairing">
      {job.live.qr && !LOOPBACK.test(job.live.address) && <Qr text={job.live.qr} />}
      <div>
        <p>{LOOPBACK.test(job.live.address) ? "Only programs on this computer reach this address. For a phone, stop and listen at 0.0.0.0 instead." : "Let the phone send to this address, or scan the code:"}</p>
        <Command text={job.live.address} />
        {job.live.token && <p>Word to pair with: <code>{job.live.token}</code></p>}
        {job.live.warning && <p class="notice warn">{sentence(job.live.warning)}</p>}
      </div>
    </div>}
    {devices.length > 1 && <label class="inline">Device <select value={shown} onChange={(e) => setDevice(e.currentTarget.value)}>{devices.map((one) => <option key={one} value={one}>{one}</option>)}</select></label>}
    {silent && <p class="notice warn">Nothing has come for {old}: what is shown is of {stamp(num(last, "time")!, 10)} s, the last that came.</p>}
    {lines.length > 0 && <LiveState lines={lines} session={shown} old={old} />}
    <div class="next">
      {going && <button type="button" onClick={() => void end()}>Stop listening</button>}
      {!going && job.run && <a class="button main" href={`#/result/${encodeURIComponent(job.run)}`}>See the result</a>}
      {logs.map(({ name }) => <button type="button" class="main" key={name} onClick={() => open(name)}>Look into {name.slice(job.name.length + 1)}</button>)}
    </div>
    <More title="What it prints"><pre class="tail" tabIndex={0}>{job.tail.filter((line) => !line.startsWith("{")).join("\n") || "Nothing yet."}</pre></More>
    <More title="The same from a terminal"><Command text={job.command} /></More>
  </Part>;
}

/** Addresses that no other machine reaches, of a page and as they are written. */
const LOOPBACK = /^https?:\/\/(127\.|localhost|\[::1\])/;
const LOCAL = /^(127\.|localhost|\[::1\])/;

const CURVES: [string, string, string[]][] = [["Roll and pitch", "deg", ["roll", "pitch"]], ["Heading", "deg", ["heading"]], ["Velocity", "m/s", ["VN", "VE", "VD"]]];

/** What a heading is from, by the words of a state. */
const NORTHS: Record<string, North> = { "magnetic north": "magnetic", "the start": "start" };

function LiveState({ lines, session, old }: { lines: Record<string, unknown>[]; session: string; old: string }) {
  const last = lines[lines.length - 1]!, time = num(last, "time")!;
  const [cursor, setCursor] = useState<number | null>(null);
  const track = useMemo<Line | null>(() => {
    const seen = withPauses(lines.filter((line) => num(line, "lat") !== null && num(line, "lon") !== null));
    return seen.length ? { t: seen.map((line) => num(line, "time")!), lat: seen.map((line) => num(line, "lat") ?? NaN), lon: seen.map((line) => num(line, "lon") ?? NaN) } : null;
  }, [lines.length, time]);
  const panels = useMemo<Panel[]>(() => CURVES.filter(([, , names]) => names.some((name) => num(last, name) !== null))
    .map(([title, unit, names]) => ({ title, unit, columns: names.map((name) => ({ name, label: name })) })), [session, Object.keys(last).join()]);
  // The curves are drawn twice a second, the attitude with every state.
  const beat = Math.floor(Date.now() / 500);
  const whole = useMemo<Span>(() => [num(lines[0]!, "time")!, Math.max(time, num(lines[0]!, "time")! + 1)], [beat, session]);
  const held = withPauses(lines.filter((line) => num(line, "time")! <= whole[1]));
  const ask = async (columns: string[], view: Span): Promise<Series> => {
    const seen = held.filter((line) => { const t = num(line, "time")!; return t >= view[0] && t <= view[1]; });
    const of = (name: string) => seen.map((line) => num(line, name));
    return { t: seen.map((line) => num(line, "time")!), columns: Object.fromEntries(columns.map((name) => [name, { unit: null, low: of(name), high: of(name) }])) };
  };
  // The server writes them as the reports do.
  const rows = (last["shown"] ?? []) as { name: string; value: string; bound: string }[];
  return <>
    <div class="motion">
      <Attitude q={attitudeOf(last)} north={NORTHS[String(last["heading_from"])] ?? "true"} bounds={rows} at={`${stamp(time, 10)} s${old && `, ${old} ago`}:`} />
      {track && <Plan track={track} fixes={null} cursor={cursor ?? time} onCursor={setCursor} />}
    </div>
    {panels.length > 0 && <Traces panels={panels} whole={whole} askKey={session} ask={ask} cursor={cursor} onCursor={setCursor} />}
    {rows.length > 0 && <More title="Numbers"><Table head={["", "Value", "95 % bound"]} numeric={[1, 2]} rows={rows.map((row) => [row.name, row.value, row.bound || "not stated"])} /></More>}
  </>;
}

function Qr({ text }: { text: string }) {
  const path = useMemo(() => {
    const { data, size } = encode(text, { ecc: "M", border: 4 });
    return { size, d: data.flatMap((row, y) => row.map((dark, x) => dark ? `M${x} ${y}h1v1h-1z` : "")).join("") };
  }, [text]);
  // Dark on light in the dark, too: cameras expect it, with four modules of margin.
  return <svg class="qr" viewBox={`0 0 ${path.size} ${path.size}`} role="img" aria-label={`Code to scan with the address ${text}`} shape-rendering="crispEdges">
    <rect width={path.size} height={path.size} fill="#fff" /><path d={path.d} fill="#000" /></svg>;
}
