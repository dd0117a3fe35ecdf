// A crash while its parameters move: delta-V, the direction of force on a clock face, the path.

import { useEffect, useMemo, useState } from "preact/hooks";
import { aborted, api, problemOf } from "./api";
import { number } from "./format";
import { round } from "./plan";
import type { CrashQuick, Problem } from "./types";
import { Empty, Part, Trouble } from "./ui";

export function CrashPreview({ toml, ready, onKeep }: { toml: string; ready: boolean; onKeep: (set: Record<string, unknown>) => void }) {
  const [set, setSet] = useState<Record<string, number>>({});
  const [quick, setQuick] = useState<CrashQuick | null>(null);
  const [first, setFirst] = useState<CrashQuick | null>(null);
  const [problem, setProblem] = useState<Problem | null>(null);
  useEffect(() => setSet({}), [toml]);
  useEffect(() => {
    if (!ready) return;
    const control = new AbortController();
    const timer = setTimeout(() => {
      api.quick(toml, set, control.signal).then(
        (answer) => { setQuick(answer); if (!Object.keys(set).length) setFirst(answer); setProblem(null); },
        (error: unknown) => { if (!aborted(error)) setProblem(problemOf(error)); });
    }, 40);
    return () => { clearTimeout(timer); control.abort(); };
  }, [toml, ready, JSON.stringify(set)]);
  const changed = Object.keys(set).length > 0;
  return <Part title="What follows from it">
    {!ready && !quick && <Empty>As soon as nothing is open: delta-V, direction of force and path, while you move what is uncertain.</Empty>}
    <Trouble problem={problem} />
    {quick && <div class="crash">
      <div>
        <dl class="keys" aria-live="polite">
          <div><dt>Change of velocity (delta-V)</dt><dd class="value">{number(quick.delta_v.value, 3)} <small>± {number(quick.delta_v.bound, 2)} {quick.delta_v.unit}</small></dd></div>
          <div><dt>Direction of force</dt><dd class="value">{typeof quick.pdof.clock === "number" ? `${number(quick.pdof.clock, 3)} o'clock` : quick.pdof.clock} <small>{number(quick.pdof.deg, 3)}° ± {number(quick.pdof.bound_deg, 2)}°</small></dd></div>
        </dl>
        <p class="help">95 % bounds, linear and fast; the run computes them in full.</p>
        <ClockFace deg={quick.pdof.deg} bound={quick.pdof.bound_deg} before={changed && first ? first.pdof.deg : null} />
      </div>
      <div>
        <PathView quick={quick} before={changed ? first : null} />
      </div>
      {quick.parameters && quick.parameters.length > 0 && <div class="sliders">
        <h3>What if…</h3>
        {quick.parameters.map((p) => {
          const value = set[p.key] ?? first?.parameters?.find((one) => one.key === p.key)?.value ?? p.value;
          return <label key={p.key}>{p.label}
            <input type="range" min={p.low} max={p.high} step={p.step} value={value} aria-valuetext={`${number(value)} ${p.unit ?? ""}`}
              onInput={(e) => setSet({ ...set, [p.key]: e.currentTarget.valueAsNumber })} />
            <output>{number(value)} {p.unit}</output></label>;
        })}
        <div class="row">
          <button type="button" disabled={!changed} onClick={() => setSet({})}>As it was</button>
          <button type="button" disabled={!changed} onClick={() => onKeep(set)}>Write into the case</button>
        </div>
      </div>}
    </div>}
  </Part>;
}

/** The clock face around the vehicle: 12 is ahead, 3 the right side; the arrow is the force. */
export function ClockFace({ deg, bound, before }: { deg: number; bound: number; before: number | null }) {
  const at = (angle: number, radius: number) => [radius * Math.sin((angle * Math.PI) / 180), -radius * Math.cos((angle * Math.PI) / 180)] as const;
  const wide = Math.min(179, bound);
  const [ax, ay] = at(deg - wide, 92), [bx, by] = at(deg + wide, 92);
  const hour = Math.round((((deg % 360) + 360) % 360) / 30) || 12;
  return <svg class="clock" viewBox="-120 -120 240 240" role="img" aria-label={`Direction of force: ${number(deg, 3)} degrees, plus or minus ${number(bound, 2)}, near ${hour} o'clock; 12 is the front.`}>
    <circle r={100} class="face" />
    <path d={`M0 0 L${ax} ${ay} A92 92 0 ${wide > 90 ? 1 : 0} 1 ${bx} ${by} Z`} class="sector" />
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

function PathView({ quick, before }: { quick: CrashQuick; before: CrashQuick | null }) {
  const { path, vehicle } = quick;
  const box = useMemo(() => {
    const all = [path, ...(before ? [before.path] : [])];
    const pad = vehicle.length / 2 + Math.max(0, ...path.bound.slice(-1));
    const west = Math.min(...all.flatMap((p) => p.east)) - pad, east = Math.max(...all.flatMap((p) => p.east)) + pad;
    const south = Math.min(...all.flatMap((p) => p.north)) - pad, north = Math.max(...all.flatMap((p) => p.north)) + pad;
    const size = Math.max(east - west, north - south, vehicle.length * 2);
    return { west: (west + east - size) / 2, north: (north + south + size) / 2, size };
  }, [quick, before]);
  const line = (p: CrashQuick["path"]) => p.north.map((n, i) => `${i ? "L" : "M"}${(p.east[i]! - box.west).toFixed(3)} ${(box.north - n).toFixed(3)}`).join(" ");
  const last = path.north.length - 1;
  const mesh = round(box.size / 4);
  return <figure class="path">
    <svg viewBox={`0 0 ${box.size} ${box.size}`} role="img" aria-label={`Path of the vehicle, ${number(Math.hypot(path.north[last]! - path.north[0]!, path.east[last]! - path.east[0]!), 3)} m from its beginning to its end, plus or minus ${number(path.bound[last] ?? 0, 2)} m.`}>
      {Array.from({ length: Math.floor(box.size / mesh) }, (_, i) => <path key={i} class="mesh" vector-effect="non-scaling-stroke" d={`M${(i + 1) * mesh} 0 V${box.size} M0 ${(i + 1) * mesh} H${box.size}`} />)}
      {path.bound.map((b, i) => (i % Math.max(1, Math.floor(path.bound.length / 12)) === 0 || i === last) && b > 0
        ? <circle key={i} class="sector" cx={path.east[i]! - box.west} cy={box.north - path.north[i]!} r={b} /> : null)}
      {before && <path class="before" vector-effect="non-scaling-stroke" d={line(before.path)} />}
      <path class="track" vector-effect="non-scaling-stroke" d={line(path)} />
      <circle class="end" cx={path.east[last]! - box.west} cy={box.north - path.north[last]!} r={box.size / 70} />
    </svg>
    <figcaption>Path, north up; squares of {number(mesh)} m; circles are 95 % bounds.</figcaption>
  </figure>;
}
