// Traces over time: panels with one time axis and one cursor, of which the server sends at most a
// few hundred points for any view. Zoom by drag, wheel, buttons and keys.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import { aborted, problemOf } from "./api";
import { number, stamp } from "./format";
import type { Problem, Series, Span } from "./types";
import { color, useDark, useWidth } from "./ui";

export interface Panel {
  title: string; unit: string; columns: { name: string; label: string }[];
  /** Which stream it is of, where several are shown under one cursor. */
  source?: string;
  /** Stretches of its sensor, on its clock. */
  rests?: Span[]; steady?: Span[]; gaps?: Span[];
}

export type Ask = (columns: string[], view: Span, width: number, signal: AbortSignal, source: string) => Promise<Series>;

/** The series of each source. */
type Sources = Record<string, Series>;

const sourceOf = (panel: Panel) => panel.source ?? "";

/** Colors of traces, of which the later ones are dashed, too. */
const COLORS = ["--trace1", "--trace2", "--trace3", "--trace4", "--trace5", "--trace6", "--trace7", "--trace8"];
const SOLID = 4, DASH = [7, 4], DOTS = [2, 4];
const HEIGHT = 180;

/** The name of a trace that others are held against. */
export const REFERENCE = "reference";

/** How the trace of a panel looks, by its number: no two alike among the first sixteen. */
function looks(label: string, j: number): { ink: string; mark: string; width: number; dash?: number[] } {
  if (label === REFERENCE) return { ink: "--ink", mark: "dot tref", width: 2, dash: DOTS };
  const i = j % COLORS.length, again = j >= COLORS.length;
  return { ink: COLORS[i]!, mark: `dot t${i + 1}${again ? " again" : ""}`, width: again ? 2 : 1, ...(i >= SOLID ? { dash: DASH } : again ? { dash: DOTS } : {}) };
}

/** Values below this are zero to rounding, by unit, and are drawn as zero. */
const NOTHING: Record<string, number> = { deg: 1e-5, m: 1e-6, "m/s": 1e-6 };

/** Numbers of an axis: zero where the step leaves nothing of it, and no zeros without meaning. */
export function axisNumbers(values: number[]): string[] {
  const step = values.length > 1 ? Math.abs(values[1]! - values[0]!) : 0;
  return values.map((v) => Math.abs(v) < step * 1e-6 ? "0" : number(v, 6).replace(/\.?0+(?=e)/, ""));
}

/** Angles of which one end is the other, 0 and 360. */
const TURNING = /(^| )heading(_deg)?$/;
/** Turns beyond which a panel shows each of them apart, deg. */
const MOST_TURNS = 720;

const turning = (panel: Panel) => panel.columns.length > 0 && panel.columns.every(({ name }) => TURNING.test(name));

/** Steps of the numbers of a heading, deg. */
const OF_A_TURN = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 45, 90, 180, 360];

type Values = (number | null)[];

/** Headings, greatest and least by column, that go on over north instead of across the panel. */
function goingOn(pairs: Values[][]): Values[][] {
  let from: number | null = null;
  const made = pairs.map(([high, low]) => {
    let before: number | null = null;
    const out: Values[] = [[], []];
    high!.forEach((h, i) => {
      const l = low![i];
      if (h === null || l === null || l === undefined) { out.forEach((one) => one.push(null)); return; }
      // Both sides of north in one: from a little before it to a little after it.
      const [most, least] = h - l > 180 ? [l, h - 360] : [h, l], middle = (most + least) / 2;
      const turns: number = 360 * Math.round(((before ?? from ?? middle) - middle) / 360);
      before = middle + turns;
      from ??= before;
      out[0]!.push(most + turns);
      out[1]!.push(least + turns);
    });
    return out;
  });
  const all = made.flat(2).filter((v) => v !== null) as number[];
  const reach = all.reduce<Span>(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
  return reach[1] - reach[0] > MOST_TURNS ? pairs : made;
}

interface Props {
  panels: Panel[]; ask: Ask; whole: Span; askKey: string;
  /** The stamp that is shown as zero, s. */
  zero?: number;
  cursor: number | null; onCursor: (t: number | null) => void;
  trim?: Span | null; marks?: { label: string; t: number }[];
  onMark?: (t: number) => void; onTrim?: (trim: Span) => void;
}

/** Panels of traces; `askKey` names what is asked for, so that another log is fetched anew. */
export function Traces(props: Props) {
  const { panels, ask, whole, askKey, cursor, onCursor, trim, zero = 0 } = props;
  const [view, setView] = useState<Span>(whole);
  const [series, setSeries] = useState<Sources | null>(null);
  const [problem, setProblem] = useState<Problem | null>(null);
  const [refused, setRefused] = useState("");
  const [element, width] = useWidth<HTMLDivElement>();
  const columns = useMemo(() => {
    const wanted = new Map<string, string[]>();
    for (const panel of panels) wanted.set(sourceOf(panel), [...(wanted.get(sourceOf(panel)) ?? []), ...panel.columns.map((c) => c.name)]);
    return [...wanted];
  }, [panels]);
  const span = whole[1] - whole[0];

  useEffect(() => setView(whole), [askKey, whole[0], whole[1]]);
  useEffect(() => {
    if (!width || !columns.length) return;
    const control = new AbortController();
    const points = Math.max(200, Math.min(1200, width));
    // A drag of the wheel asks once, when it rests for a moment.
    const timer = setTimeout(() => {
      Promise.all(columns.map(async ([source, names]) => [source, await ask(names, view, points, control.signal, source)] as const)).then(
        (answers) => { setSeries(Object.fromEntries(answers)); setProblem(null); },
        (error: unknown) => { if (!aborted(error)) setProblem(problemOf(error)); });
    }, series ? 60 : 0);
    return () => { clearTimeout(timer); control.abort(); };
  }, [askKey, view[0], view[1], width, JSON.stringify(columns)]);

  const show = (from: number, to: number) => {
    const length = Math.min(span, Math.max(to - from, span * 1e-6, 1e-4));
    const begin = Math.min(Math.max(from, whole[0]), whole[1] - length);
    setView([begin, begin + length]);
  };
  const zoom = (factor: number, about?: number) => {
    const centre = about ?? (cursor !== null && cursor >= view[0] && cursor <= view[1] ? cursor : (view[0] + view[1]) / 2);
    show(centre - (centre - view[0]) * factor, centre + (view[1] - centre) * factor);
  };
  const pan = (share: number) => show(view[0] + share * (view[1] - view[0]), view[1] + share * (view[1] - view[0]));
  const step = (share: number) => {
    const from = cursor ?? (view[0] + view[1]) / 2;
    const t = Math.min(whole[1], Math.max(whole[0], from + share * (view[1] - view[0])));
    if (t < view[0] || t > view[1]) pan(share);
    onCursor(t);
  };
  const keys = (event: KeyboardEvent) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const large = event.shiftKey ? 0.1 : 0.01;
    const act: Record<string, () => void> = {
      ArrowLeft: () => step(-large), ArrowRight: () => step(large), "+": () => zoom(0.5), "=": () => zoom(0.5),
      "-": () => zoom(2), PageUp: () => pan(-0.8), PageDown: () => pan(0.8), "0": () => setView(whole),
      Home: () => onCursor(view[0]), End: () => onCursor(view[1]), Escape: () => setView(whole),
    };
    if (props.onMark && cursor !== null) act["m"] = () => props.onMark!(cursor);
    if (props.onTrim && cursor !== null) {
      const [from, to] = trim ?? whole;
      const put = (fits: boolean, made: Span, why: string) => { setRefused(fits ? "" : why); if (fits) props.onTrim!(made); };
      act["["] = () => put(cursor < to, [cursor, to], `The part cannot begin at the cursor: it ends at ${stamp(to - zero, 1)} s. Put its end later first, with ].`);
      act["]"] = () => put(cursor > from, [from, cursor], `The part cannot end at the cursor: it begins at ${stamp(from - zero, 1)} s. Put its beginning earlier first, with [.`);
    }
    const chosen = act[event.key];
    if (!chosen) return;
    event.preventDefault();
    chosen();
  };
  const zoomed = view[0] > whole[0] || view[1] < whole[1];
  return <div class="traces" ref={element}>
    <div class="row tools" role="toolbar" aria-label="View of the traces">
      <button type="button" onClick={() => zoom(0.5)} aria-label="Zoom in">+</button>
      <button type="button" onClick={() => zoom(2)} disabled={!zoomed} aria-label="Zoom out">−</button>
      <button type="button" onClick={() => pan(-0.5)} disabled={view[0] <= whole[0]} aria-label="Earlier">←</button>
      <button type="button" onClick={() => pan(0.5)} disabled={view[1] >= whole[1]} aria-label="Later">→</button>
      <button type="button" onClick={() => setView(whole)} disabled={!zoomed}>Whole log</button>
      {trim && <button type="button" onClick={() => show(trim[0], trim[1])}>Part to use</button>}
      <span class="soft viewed">{stamp(view[0] - zero, view[1] - view[0])} to {stamp(view[1] - zero, view[1] - view[0])} s</span>
    </div>
    {problem && <div class="notice bad" role="alert"><p>{problem.text}</p>{problem.remedy && <p>{problem.remedy}</p>}</div>}
    <div class="panels" tabIndex={0} role="group" onKeyDown={keys}
      aria-label="Traces over time. Arrow keys move the cursor, plus and minus zoom, page keys move the view, 0 shows all.">
      {width > 0 && series && panels.map((panel) => series[sourceOf(panel)] &&
        <OnePanel key={`${sourceOf(panel)}|${panel.title}`} panel={panel} series={series[sourceOf(panel)]!} view={view} width={width} {...props}
          onZoom={show} onWheel={zoom} onPan={pan} />)}
      {!series && !problem && <p class="busy" role="status"><span class="spin" aria-hidden="true" />Reading the traces…</p>}
    </div>
    {props.onTrim && <p class="fault" role="alert">{refused}</p>}
    <Readout panels={panels} series={series} cursor={cursor} whole={whole} zero={zero} />
    <p class="help">Drag to zoom; double-click for all. After a click on the traces the wheel zooms too, and the keys ← → + − 0 work.{props.onTrim && " [ and ] put the beginning and the end of the part to use at the cursor, m sets a mark."}</p>
  </div>;
}

/** Stamps of the ticks of an axis, at whole steps from the one that is shown as zero. */
function ticksOf(low: number, high: number, step: number, zero: number): number[] {
  const first = Math.ceil((low - zero) / step - 1e-9), count = Math.floor((high - zero) / step + 1e-9) - first + 1;
  return Array.from({ length: Math.max(0, Math.min(count, 1000)) }, (_, i) => zero + (first + i) * step);
}

function indexAt(t: number[], at: number): number {
  let low = 0, high = t.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t[middle]! < at) low = middle + 1; else high = middle;
  }
  return low > 0 && at - t[low - 1]! < t[low]! - at ? low - 1 : low;
}

function Readout({ panels, series, cursor, whole, zero }: { panels: Panel[]; series: Sources | null; cursor: number | null; whole: Span; zero: number }) {
  if (!series || cursor === null || !Object.values(series).some((one) => one.t.length)) return <p class="readout soft">Point at a trace to read its values.</p>;
  return <p class="readout" aria-live="polite">
    <b>{stamp(cursor - zero, 1)} s</b><span class="soft"> {zero ? "from the beginning" : `(${stamp(cursor - whole[0], 1)} s from the beginning)`}</span>
    {panels.map((panel) => <span class="values" key={`${sourceOf(panel)}|${panel.title}`}>
      {panel.columns.map((column, j) => {
        const own = series[sourceOf(panel)];
        // A source that has nothing at the cursor shows nothing.
        if (!own?.t.length || cursor < own.t[0]! || cursor > own.t[own.t.length - 1]!) return null;
        const one = own.columns[column.name], i = indexAt(own.t, cursor);
        const low = one?.low[i], high = one?.high[i];
        if (low === null || low === undefined || high === null || high === undefined) return null;
        return <span key={column.name}><i class={looks(column.label, j).mark} />{column.label} {low === high ? number(low) : `${number(low, 3)} to ${number(high, 3)}`} {panel.unit}</span>;
      })}
    </span>)}
  </p>;
}

function OnePanel(props: Props & {
  panel: Panel; series: Series; view: Span; width: number;
  onZoom: (from: number, to: number) => void; onWheel: (factor: number, about: number) => void; onPan: (share: number) => void;
}) {
  const { panel, series, view, width } = props;
  const place = useRef<HTMLDivElement>(null);
  const chart = useRef<uPlot | null>(null);
  const latest = useRef(props);
  latest.current = props;
  const dark = useDark();

  const data = useMemo(() => {
    const of = (name: string) => series.columns[name];
    const pairs = panel.columns.map(({ name }) => [of(name)?.high ?? [], of(name)?.low ?? []]);
    return [series.t, ...(turning(panel) ? goingOn(pairs) : pairs).flat()] as uPlot.AlignedData;
  }, [series, panel]);

  useEffect(() => {
    if (!place.current) return;
    const lines: uPlot.Series[] = [{}];
    const bands: uPlot.Band[] = [];
    panel.columns.forEach(({ label }, j) => {
      const { ink, mark: _, ...look } = looks(label, j), stroke = () => color(ink);
      lines.push({ label, stroke, ...look, points: { show: false } }, { label: `${label} (least)`, stroke, ...look, points: { show: false } });
      bands.push({ series: [2 * j + 1, 2 * j + 2], fill: () => color(ink) + "55" });
    });
    const axis = { stroke: () => color("--soft"), grid: { stroke: () => color("--faint"), width: 1 }, ticks: { stroke: () => color("--line"), width: 1 }, font: "12px system-ui, sans-serif" };
    const made = new uPlot({
      width, height: HEIGHT, series: lines, bands, legend: { show: false },
      scales: {
        x: { time: false, range: () => latest.current.view as [number, number] },
        y: { range: (_, low, high) => {
          if (low === null || high === null) return [-1, 1];
          const least = NOTHING[panel.unit] ?? 0;
          return Math.max(Math.abs(low), Math.abs(high)) <= least ? [-1, 1] : uPlot.rangeNum(low, high, 0.1, true);
        } },
      },
      axes: [
        { ...axis, size: 30, space: 90, splits: (_, __, low, high, step) => ticksOf(low, high, step, latest.current.zero ?? 0), values: (_, ticks, __, ___, step) => ticks.map((t) => (t - (latest.current.zero ?? 0)).toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)))) },
        { ...axis, size: 58, ...(turning(panel) ? { incrs: OF_A_TURN } : {}), values: (_, values) => turning(panel) ? values.map((v) => number(((v % 360) + 360) % 360, 6)) : axisNumbers(values) },
      ],
      cursor: {
        drag: { x: true, y: false, setScale: false }, points: { show: false },
        sync: { key: "traces", setSeries: false, scales: ["x", null] },
        bind: { dblclick: () => () => { latest.current.onZoom(latest.current.whole[0], latest.current.whole[1]); return null; } },
      },
      hooks: {
        setSelect: [(u) => {
          if (u.select.width > 4) latest.current.onZoom(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
          if (u.select.width > 0) u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
        }],
        setCursor: [(u) => {
          // Only the panel under the pointer speaks; the others follow it.
          if (u.cursor.event && u.cursor.left !== undefined && u.cursor.left >= 0) latest.current.onCursor(u.posToVal(u.cursor.left, "x"));
        }],
        drawClear: [(u) => shade(u, latest.current)],
        draw: [(u) => mark(u, latest.current)],
      },
    }, data, place.current);
    chart.current = made;
    const wheel = (event: WheelEvent) => {
      const inside = place.current?.closest(".panels");
      // The page scrolls on, unless someone has turned to the traces.
      if (!event.ctrlKey && !inside?.contains(document.activeElement)) return;
      event.preventDefault();
      if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) return latest.current.onPan(Math.sign(event.deltaX) * 0.1);
      const left = event.clientX - made.over.getBoundingClientRect().left;
      latest.current.onWheel(event.deltaY > 0 ? 1.25 : 0.8, made.posToVal(left, "x"));
    };
    made.over.addEventListener("wheel", wheel, { passive: false });
    return () => { made.destroy(); chart.current = null; };
  }, [panel, dark]);

  useEffect(() => { chart.current?.setSize({ width, height: HEIGHT }); }, [width]);
  useEffect(() => { chart.current?.setData(data, true); }, [data]);
  useEffect(() => { chart.current?.redraw(false, false); }, [view, props.trim, props.marks]);
  useEffect(() => {
    const u = chart.current;
    if (!u) return;
    const left = props.cursor === null ? -10 : u.valToPos(props.cursor, "x");
    u.setCursor({ left, top: -10 }, false);
  }, [props.cursor, view, width, data]);

  return <div class="panel">
    <div class="paneltitle"><b>{panel.title}</b> <span class="soft">{panel.unit}</span>
      {panel.columns.map(({ label }, j) => <span class="key" key={label}><i class={looks(label, j).mark} />{label}</span>)}</div>
    <div ref={place} class="plot" aria-hidden="true" />
  </div>;
}

function shade(u: uPlot, props: Props & { panel: Panel }) {
  const { ctx, bbox } = u;
  const area = (from: number, to: number, fill: string) => {
    const left = Math.max(bbox.left, u.valToPos(from, "x", true));
    const right = Math.min(bbox.left + bbox.width, u.valToPos(to, "x", true));
    if (right <= left) return;
    ctx.fillStyle = fill;
    ctx.fillRect(left, bbox.top, Math.max(1, right - left), bbox.height);
  };
  ctx.save();
  for (const [from, to] of props.panel.rests ?? []) area(from, to, color("--rest"));
  for (const [from, to] of props.panel.steady ?? []) area(from, to, color("--steady"));
  for (const [from, to] of props.panel.gaps ?? []) area(from, to, color("--gap"));
  if (props.trim) {
    area(props.whole[0], props.trim[0], color("--away"));
    area(props.trim[1], props.whole[1], color("--away"));
  }
  ctx.restore();
}

function mark(u: uPlot, props: Props) {
  const { ctx, bbox } = u;
  ctx.save();
  ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
  for (const { label, t } of props.marks ?? []) {
    const x = u.valToPos(t, "x", true);
    if (x < bbox.left || x > bbox.left + bbox.width) continue;
    ctx.strokeStyle = ctx.fillStyle = color("--mark");
    ctx.lineWidth = devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.fillText(label, x + 4 * devicePixelRatio, bbox.top + 12 * devicePixelRatio);
  }
  ctx.restore();
}

/** The whole log as one bar: rests, gaps, marks, and the part to use between two handles. */
export function TrimBar({ whole, trim, onTrim, rests, gaps, marks, zero = 0 }: {
  whole: Span; trim: Span; onTrim: (trim: Span) => void; rests: Span[]; gaps: Span[]; marks: { label: string; t: number }[]; zero?: number;
}) {
  const bar = useRef<HTMLDivElement>(null);
  const length = whole[1] - whole[0] || 1;
  const share = (t: number) => `${(100 * (t - whole[0])) / length}%`;
  const least = length / 1000;
  const put = (which: 0 | 1, t: number) => onTrim(which === 0
    ? [Math.min(Math.max(t, whole[0]), trim[1] - least), trim[1]]
    : [trim[0], Math.max(Math.min(t, whole[1]), trim[0] + least)]);
  const drag = (which: 0 | 1) => (event: PointerEvent) => {
    const box = bar.current!.getBoundingClientRect();
    const handle = event.currentTarget as HTMLElement;
    handle.setPointerCapture(event.pointerId);
    const move = (e: PointerEvent) => put(which, whole[0] + (length * (e.clientX - box.left)) / box.width);
    const end = () => { handle.removeEventListener("pointermove", move); handle.removeEventListener("pointerup", end); };
    handle.addEventListener("pointermove", move);
    handle.addEventListener("pointerup", end);
  };
  const keys = (which: 0 | 1) => (event: KeyboardEvent) => {
    const step = length * (event.shiftKey ? 0.05 : 0.005);
    const by: Record<string, number> = { ArrowLeft: -step, ArrowDown: -step, ArrowRight: step, ArrowUp: step, Home: -Infinity, End: Infinity };
    const change = by[event.key];
    if (change === undefined) return;
    event.preventDefault();
    put(which, trim[which] + change);
  };
  const handle = (which: 0 | 1, name: string) => <div class="handle" style={{ left: share(trim[which]) }} role="slider" tabIndex={0}
    aria-label={name} aria-valuemin={whole[0]} aria-valuemax={whole[1]} aria-valuenow={trim[which]} aria-valuetext={`${stamp(trim[which] - zero, length)} s`}
    onPointerDown={drag(which)} onKeyDown={keys(which)} />;
  return <div class="trimbar" ref={bar}>
    {rests.map(([from, to]) => <span class="rest" key={from} style={{ left: share(from), width: `${(100 * (to - from)) / length}%` }} />)}
    {gaps.map(([from, to]) => <span class="gap" key={from} style={{ left: share(from), width: `max(2px, ${(100 * (to - from)) / length}%)` }} />)}
    {marks.map(({ t, label }) => <span class="markline" key={label + t} title={label} style={{ left: share(t) }} />)}
    <span class="away" style={{ left: 0, width: share(trim[0]) }} />
    <span class="away" style={{ left: share(trim[1]), right: 0 }} />
    {handle(0, "Beginning of the part to use")}
    {handle(1, "End of the part to use")}
  </div>;
}
