// A crash while its parameters move: delta-V, the direction of force on a clock face, the path.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { aborted, api, problemOf } from "./api";
import { number } from "./format";
import { round } from "./plan";
import type { CrashQuick, Problem } from "./types";
import { Busy, Empty, Findings, Part, Trouble } from "./ui";

/** `value`: as written; `origin`: as it was before it was set by hand, which the slider meets. */
interface Slider { id: string; key: string; at: number | null; label: string; unit: string; value: number; origin: number; reach: number; step: number }

/** Decimals of a number, at most nine. */
const decimals = (value: number) => { const [digits, power = "0"] = String(value).split("e"); return Math.min(9, Math.max(0, (digits!.split(".")[1] ?? "").length - Number(power))); };

/** The value so many steps from the origin: exactly the origin at none. */
function stepped({ origin, step }: Slider, steps: number): number {
  return steps ? Number((origin + steps * step).toFixed(Math.max(decimals(origin), decimals(step)))) : origin;
}

/** Steps to each side of the origin; a value that was written stays within reach. */
const stepsOf = ({ origin, value, reach, step }: Slider) => Math.ceil(Math.max(reach, Math.abs(value - origin)) / step - 1e-9);

/** What is worth a slider: how fast it was, and where and how the recorder sits. */
function slidersOf(values: Record<string, unknown>, was: Record<string, unknown>, unit: number): Slider[] {
  const sliders: Slider[] = [];
  const speed = ["entry.speed_km_per_h", "entry.speed_m_per_s"].find((key) => typeof values[key] === "number");
  if (speed) {
    const value = values[speed] as number, origin = typeof was[speed] === "number" ? was[speed] : value;
    sliders.push({ id: speed, key: speed, at: null, label: "Speed at the entry", unit: speed.endsWith("km_per_h") ? "km/h" : "m/s", value, origin, reach: Math.max(5, 0.3 * Math.abs(origin)), step: 0.1 });
  }
  const list = (key: string, labels: string[], measure: string, reach: number, step: number) => {
    const all = values[key];
    if (!Array.isArray(all) || all.some((v) => typeof v !== "number")) return;
    const before = was[key], origins = Array.isArray(before) && before.length === all.length && before.every((v) => typeof v === "number") ? before as number[] : all as number[];
    labels.forEach((label, i) => sliders.push({ id: `${key}.${i}`, key, at: i, label, unit: measure, value: all[i] as number, origin: origins[i]!, reach, step }));
  };
  const at = `units.${unit}`;
  list(`${at}.position_m`, ["Recorder forward", "Recorder right", "Recorder down"], "m", 1, 0.01);
  list(`${at}.angles_deg`, ["Mounting roll", "Mounting pitch", "Mounting heading"], "deg", 15, 0.1);
  list(`${at}.levelling_deg`, ["Road bank (roll)", "Road grade (pitch)"], "deg", 8, 0.1);
  return sliders;
}

/** The values of the case with those of sliders in their place. */
function written(sliders: Slider[], values: Record<string, unknown>, of: (slider: Slider) => number | undefined): Record<string, unknown> {
  const set: Record<string, unknown> = {};
  for (const slider of sliders) {
    const value = of(slider);
    if (value === undefined || value === slider.value) continue;
    if (slider.at === null) { set[slider.key] = value; continue; }
    // Two numbers of one list: each in its place.
    const list = [...((set[slider.key] ?? values[slider.key]) as unknown[])];
    list[slider.at] = value;
    set[slider.key] = list;
  }
  return set;
}

export function CrashPreview({ toml, values, was, ready, wrong, onKeep }: {
  toml: string; values: Record<string, unknown>; was: Record<string, unknown>; ready: boolean; wrong: boolean; onKeep: (set: Record<string, unknown>) => void;
}) {
  const [moved, setMoved] = useState<Record<string, number>>({});
  const [unit, setUnit] = useState(0);
  const [quick, setQuick] = useState<CrashQuick | null>(null);
  const [first, setFirst] = useState<CrashQuick | null>(null);
  const [problem, setProblem] = useState<Problem | null>(null);
  // What was written here without a remark on what it was is remembered as long as the page is.
  const kept = useRef<Record<string, unknown>>({});
  const sliders = useMemo(() => slidersOf(values, { ...kept.current, ...was }, unit), [values, was, unit]);
  const set = useMemo(() => written(sliders, values, (slider) => moved[slider.id]), [sliders, moved]);
  const back = useMemo(() => written(sliders, values, (slider) => slider.origin), [sliders]);
  const keep = () => {
    for (const key of Object.keys(set)) kept.current = { [key]: values[key], ...kept.current };
    onKeep(set);
  };
  const restore = () => { setMoved({}); if (Object.keys(back).length) onKeep(back); };
  useEffect(() => setMoved({}), [toml, unit]);
  useEffect(() => {
    if (!ready) return;
    const control = new AbortController();
    const timer = setTimeout(() => {
      api.quick(toml, set, unit, control.signal).then(
        (answer) => { setQuick(answer); if (!Object.keys(set).length) setFirst(answer); setProblem(null); },
        (error: unknown) => { if (!aborted(error)) setProblem(problemOf(error)); });
    }, 40);
    return () => { clearTimeout(timer); control.abort(); };
  }, [toml, ready, unit, JSON.stringify(set)]);
  const changed = Object.keys(set).length > 0;
  const before = changed ? first : null;
  return <Part title="What follows from it" aside={quick && quick.recorders.length > 1 ? <label class="inline">By <select value={String(unit)} onChange={(e) => setUnit(Number(e.currentTarget.value))}>
    {quick.recorders.map((name, i) => <option key={i} value={String(i)}>{name || `recorder ${i + 1}`}</option>)}</select></label> : undefined}>
    {!ready && !quick && <Empty>As soon as nothing is open: delta-V, direction of force and path, while you move what is uncertain.</Empty>}
    {ready && !quick && !problem && <Busy>Computing delta-V, direction of force and path…</Busy>}
    <Trouble problem={problem} />
    {wrong && quick && <p class="notice warn" role="status">This is of the case before: what is written now cannot be computed until it is corrected or answered.</p>}
    {quick && <div class="crash">
      <div>
        <dl class="keys" aria-live="polite">
          <div><dt>Change of velocity (delta-V)</dt>{quick.delta_v ? <dd>{quick.delta_v.shown}</dd> : <dd><small>no impact in this record</small></dd>}</div>
          <div><dt>Direction of force</dt>{quick.pdof ? <dd>{quick.pdof.clock} o'clock <small>{number(quick.pdof.deg, 3)}°{quick.pdof.low !== null && quick.pdof.high !== null ? ` (${number(quick.pdof.low, 3)}° to ${number(quick.pdof.high, 3)}°)` : ", without a bound"}</small></dd> : <dd><small>–</small></dd>}</div>
        </dl>
        <p class="help">95 % bounds of one recorder, linear and fast. The run computes them in full.</p>
        {quick.pdof && <ClockFace deg={quick.pdof.deg} low={quick.pdof.low} high={quick.pdof.high} before={before?.pdof?.deg ?? null} />}
      </div>
      <PathView quick={quick} before={before} />
      <div class="sliders">
        <h3>What if…</h3>
        <p class="follows" aria-hidden="true"><b>{wrong && "before: "}{quick.delta_v?.shown ?? "no impact"}</b>{quick.pdof && <span>force from {quick.pdof.clock} o'clock, {number(quick.pdof.deg, 3)}°</span>}</p>
        {sliders.map((p) => <label key={p.id}>{p.label}
          <input type="range" min={stepped(p, -stepsOf(p))} max={stepped(p, stepsOf(p))} step={p.step} value={moved[p.id] ?? p.value} aria-valuetext={`${number(moved[p.id] ?? p.value)} ${p.unit}`}
            onInput={(e) => setMoved({ ...moved, [p.id]: stepped(p, Math.round((e.currentTarget.valueAsNumber - p.origin) / p.step)) })} />
          <output>{number(moved[p.id] ?? p.value)} {p.unit}</output></label>)}
        <div class="row">
          <button type="button" disabled={!changed && !Object.keys(back).length} onClick={restore}>As it was</button>
          <button type="button" disabled={!changed} onClick={keep}>Write into the case</button>
        </div>
      </div>
    </div>}
    {quick && <Findings findings={quick.findings} />}
  </Part>;
}

/** The clock face around the vehicle: 12 is ahead, 3 the right side; the arrow is the force. */
export function ClockFace({ deg, low, high, before }: { deg: number; low: number | null; high: number | null; before: number | null }) {
  const at = (angle: number, radius: number) => [radius * Math.sin((angle * Math.PI) / 180), -radius * Math.cos((angle * Math.PI) / 180)] as const;
  const known = low !== null && high !== null && high - low < 358;
  const [ax, ay] = at(low ?? 0, 92), [bx, by] = at(high ?? 0, 92);
  const hour = Math.round((((deg % 360) + 360) % 360) / 30) || 12;
  return <svg class="clock" viewBox="-120 -120 240 240" role="img" aria-label={`Direction of force: ${number(deg, 3)} degrees${known ? `, from ${number(low, 3)} to ${number(high, 3)}` : ", without a bound"}, near ${hour} o'clock; 12 is the front.`}>
    <circle r={100} class="face" />
    {known ? <path d={`M0 0 L${ax} ${ay} A92 92 0 ${high - low > 180 ? 1 : 0} 1 ${bx} ${by} Z`} class="sector" /> : <circle r={92} class="sector" />}
    {Array.from({ length: 12 }, (_, i) => {
      const [x, y] = at((i + 1) * 30, 110);
      const [fx, fy] = at((i + 1) * 30, 96), [tx, ty] = at((i + 1) * 30, 100);
      return <g key={i}><line x1={fx} y1={fy} x2={tx} y2={ty} class="tick" /><text x={x} y={y + 4} text-anchor="middle">{i + 1}</text></g>;
    })}
    <rect x={-18} y={-42} width={36} height={84} rx={9} class="body" />
    <path d="M-13 -14 L-11 -24 L11 -24 L13 -14 Z" class="glass" />
    {before !== null && <Arrow angle={before} look="before" />}
    <Arrow angle={deg} look="force" />
  </svg>;
}

function Arrow({ angle, look }: { angle: number; look: string }) {
  // From outside toward the vehicle, as the force pushes.
  return <g class={look} transform={`rotate(${angle})`}><line x1={0} y1={-92} x2={0} y2={-48} /><path d="M0 -40 L-7 -54 L7 -54 Z" /></g>;
}

/** Names of the two axes of a path: without a known heading they are those of the vehicle at the entry. */
export const axesOf = (overGround: boolean): [string, string] => overGround ? ["north", "east"] : ["forward", "right"];

function PathView({ quick, before }: { quick: CrashQuick; before: CrashQuick | null }) {
  const { path, vehicle } = quick;
  const last = path.north.length - 1;
  const outline = (p: CrashQuick["path"], i: number) => {
    const turn = ((p.heading[i] ?? 0) * Math.PI) / 180;
    return vehicle.outline.map(([f, r]) => [p.north[i]! + f * Math.cos(turn) - r * Math.sin(turn), p.east[i]! + f * Math.sin(turn) + r * Math.cos(turn)] as const);
  };
  const box = useMemo(() => {
    const corners = [...outline(path, 0), ...outline(path, last), ...(before ? outline(before.path, before.path.north.length - 1) : [])];
    const pad = 0.4 + Math.max(0, path.bound[last] ?? 0);
    const [west, east] = [Math.min(...corners.map((c) => c[1])) - pad, Math.max(...corners.map((c) => c[1])) + pad];
    const [south, north] = [Math.min(...corners.map((c) => c[0])) - pad, Math.max(...corners.map((c) => c[0])) + pad];
    const size = Math.max(east - west, north - south);
    return { west: (west + east - size) / 2, north: (north + south + size) / 2, size };
  }, [quick, before]);
  const at = (north: number, east: number) => `${(east - box.west).toFixed(3)} ${(box.north - north).toFixed(3)}`;
  const line = (p: CrashQuick["path"]) => p.north.map((n, i) => `${i ? "L" : "M"}${at(n, p.east[i]!)}`).join(" ");
  const body = (p: CrashQuick["path"], i: number) => outline(p, i).map(([n, e], k) => `${k ? "L" : "M"}${at(n, e)}`).join(" ") + " Z";
  const mesh = round(box.size / 4);
  const [ahead, aside] = axesOf(quick.over_ground);
  return <figure class="path">
    <svg viewBox={`0 0 ${box.size} ${box.size}`} role="img" aria-label={`Path of the vehicle, ${number(Math.hypot(path.north[last]! - path.north[0]!, path.east[last]! - path.east[0]!), 3)} m from its beginning to its end, plus or minus ${number(path.bound[last] ?? 0, 2)} m. It ends ${number(path.north[last]!, 3)} m ${ahead} and ${number(path.east[last]!, 3)} m ${aside} of its position at the entry.`}>
      {Array.from({ length: Math.floor(box.size / mesh) }, (_, i) => <path key={i} class="mesh" vector-effect="non-scaling-stroke" d={`M${(i + 1) * mesh} 0 V${box.size} M0 ${(i + 1) * mesh} H${box.size}`} />)}
      <path class="outline start" vector-effect="non-scaling-stroke" d={body(path, 0)} />
      <path class="outline" vector-effect="non-scaling-stroke" d={body(path, last)} />
      {path.bound.map((b, i) => (i % Math.max(1, Math.floor(path.bound.length / 12)) === 0 || i === last) && b > 0
        ? <circle key={i} class="sector" cx={path.east[i]! - box.west} cy={box.north - path.north[i]!} r={b} /> : null)}
      {before && <path class="before" vector-effect="non-scaling-stroke" d={body(before.path, before.path.north.length - 1)} />}
      <path class="track" vector-effect="non-scaling-stroke" d={line(path)} />
      <circle class="end" cx={path.east[last]! - box.west} cy={box.north - path.north[last]!} r={box.size / 90} />
    </svg>
    <figcaption>Path, {quick.over_ground ? "north up" : "up is forward of the vehicle at the entry, to the right its right"}; squares of {number(mesh)} m; circles are 95 % bounds.{before ? " Dashed: as it was." : ""}</figcaption>
  </figure>;
}
