// The plan: the track from above on a grid of meters, or on a map of the folder where there is one.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { api, problemOf } from "./api";
import { number } from "./format";
import type { MapInfo } from "./types";
import { color, useDark, useRequest, useWidth } from "./ui";

export interface Line { t: number[]; lat: number[]; lon: number[] }

export interface PlanProps {
  track: Line | null; fixes: Line | null; reference?: Line | null;
  cursor: number | null; onCursor: (t: number | null) => void;
  /** False where the positions are of no place on the Earth. */
  onMap?: boolean;
  /** What is up, where it is not north. */
  up?: string;
}

/** What `map.js`, loaded only where a map is shown, offers. */
interface MapModule { drawMap: (place: HTMLElement, info: MapInfo, props: PlanProps) => MapHandle }
export interface MapHandle { cursor: (t: number | null) => void; remove: () => void }

const HEIGHT = 360;

export function Plan(props: PlanProps) {
  const onMap = props.onMap !== false;
  const map = useRequest(onMap ? () => api.map() : null, [onMap]);
  const [wanted, setWanted] = useState(true);
  const [failed, setFailed] = useState("");
  const tiles = map.value?.tiles ? map.value : null;
  const shown = tiles && wanted && !failed;
  return <div class="plan">
    {tiles && <div class="row tools">
      <button type="button" aria-pressed={Boolean(shown)} disabled={failed !== ""} onClick={() => setWanted(true)}>Map</button>
      <button type="button" aria-pressed={!shown} onClick={() => setWanted(false)}>Grid</button>
      {failed && <span class="soft">{failed}</span>}
    </div>}
    {shown ? <MapPlan {...props} info={tiles} onFail={setFailed} /> : <GridPlan {...props} />}
    <p class="legend">
      {props.track && <span><i class="line t1" />track</span>}
      {props.fixes && <span><i class="dot t2" />satellite fixes</span>}
      {props.reference && <span><i class="line t3" />reference</span>}
      {onMap && map.value && !tiles && <span class="soft">No map in the folder: put a .mbtiles or .pmtiles file there to see one. Nothing is fetched from the network.</span>}
    </p>
  </div>;
}

function MapPlan(props: PlanProps & { info: MapInfo; onFail: (why: string) => void }) {
  const place = useRef<HTMLDivElement>(null);
  const handle = useRef<MapHandle | null>(null);
  const latest = useRef(props);
  latest.current = props;
  useEffect(() => {
    let gone = false;
    const load = async () => {
      try {
        const sheet = document.querySelector("link[data-map]") ?? document.head.appendChild(Object.assign(document.createElement("link"), { rel: "stylesheet", href: "static/map.css" }));
        sheet.setAttribute("data-map", "");
        // A file of its own beside app.js: esbuild leaves the address as it is.
        const address = new URL("./map.js", import.meta.url).href;
        const module = await import(address) as MapModule;
        if (gone || !place.current) return;
        handle.current = module.drawMap(place.current, props.info, latest.current);
      } catch (error) {
        if (!gone) props.onFail(`The map cannot be shown here (${problemOf(error).text}).`);
      }
    };
    void load();
    return () => { gone = true; handle.current?.remove(); handle.current = null; };
  }, [props.track, props.fixes, props.reference, props.info]);
  useEffect(() => handle.current?.cursor(props.cursor), [props.cursor]);
  return <div ref={place} class="map" role="group" aria-label="Map with the track" style={{ height: `${HEIGHT}px` }} />;
}

interface Flat { t: number[]; north: Float64Array; east: Float64Array }

export const METERS_PER_DEG = 111_320;

function flatten(line: Line | null | undefined, origin: [number, number]): Flat | null {
  if (!line || !line.t.length) return null;
  const north = new Float64Array(line.t.length), east = new Float64Array(line.t.length);
  const narrow = Math.cos((origin[0] * Math.PI) / 180);
  for (let i = 0; i < north.length; i++) {
    north[i] = (line.lat[i]! - origin[0]) * METERS_PER_DEG;
    east[i] = (line.lon[i]! - origin[1]) * METERS_PER_DEG * narrow;
  }
  return { t: line.t, north, east };
}

export function indexOf(t: number[], at: number): number {
  let low = 0, high = t.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t[middle]! < at) low = middle + 1; else high = middle;
  }
  return low;
}

/** A round length of which about `target` fits: 1, 2 or 5 times a power of ten. */
export function round(target: number): number {
  const power = 10 ** Math.floor(Math.log10(target));
  const rest = target / power;
  return (rest >= 5 ? 5 : rest >= 2 ? 2 : 1) * power;
}

function GridPlan(props: PlanProps) {
  const [element, width] = useWidth<HTMLDivElement>();
  const canvas = useRef<HTMLCanvasElement>(null);
  const dark = useDark();
  const flat = useMemo(() => {
    const first = props.track ?? props.fixes ?? props.reference;
    const at = first?.lat.findIndex((v) => Number.isFinite(v)) ?? -1;
    if (!first || at < 0) return null;
    const origin: [number, number] = [first.lat[at]!, first.lon[at]!];
    return { track: flatten(props.track, origin), fixes: flatten(props.fixes, origin), reference: flatten(props.reference, origin), origin };
  }, [props.track, props.fixes, props.reference]);
  const fit = useMemo(() => {
    let least = [Infinity, Infinity], most = [-Infinity, -Infinity];
    for (const line of [flat?.track, flat?.fixes, flat?.reference]) {
      for (let i = 0; line && i < line.north.length; i++) {
        const n = line.north[i]!, e = line.east[i]!;
        if (!Number.isFinite(n) || !Number.isFinite(e)) continue;
        least = [Math.min(least[0]!, n), Math.min(least[1]!, e)];
        most = [Math.max(most[0]!, n), Math.max(most[1]!, e)];
      }
    }
    if (least[0] === Infinity || !width) return null;
    const tall = Math.max(most[0]! - least[0]!, 2), wide = Math.max(most[1]! - least[1]!, 2);
    return { north: (least[0]! + most[0]!) / 2, east: (least[1]! + most[1]!) / 2, scale: Math.min((width - 40) / wide, (HEIGHT - 50) / tall) };
  }, [flat, width]);
  const [moved, setMoved] = useState<typeof fit>(null);
  useEffect(() => setMoved(null), [fit]);
  const view = moved ?? fit;

  useEffect(() => {
    const own = canvas.current;
    if (!own || !view || !flat || !width) return;
    const dense = devicePixelRatio || 1;
    own.width = width * dense;
    own.height = HEIGHT * dense;
    const ctx = own.getContext("2d")!;
    ctx.scale(dense, dense);
    const x = (east: number) => width / 2 + (east - view.east) * view.scale;
    const y = (north: number) => HEIGHT / 2 - (north - view.north) * view.scale;
    drawGrid(ctx, width, view, props.up ?? "N");
    const path = (line: Flat | null, stroke: string, thick: number) => {
      if (!line) return;
      ctx.strokeStyle = stroke;
      ctx.lineWidth = thick;
      ctx.beginPath();
      let pen = false;
      for (let i = 0; i < line.north.length; i++) {
        const n = line.north[i]!, e = line.east[i]!;
        if (!Number.isFinite(n) || !Number.isFinite(e)) { pen = false; continue; }
        if (pen) ctx.lineTo(x(e), y(n)); else ctx.moveTo(x(e), y(n));
        pen = true;
      }
      ctx.stroke();
    };
    if (flat.fixes) {
      ctx.fillStyle = color("--trace2");
      for (let i = 0; i < flat.fixes.north.length; i++) ctx.fillRect(x(flat.fixes.east[i]!) - 1.5, y(flat.fixes.north[i]!) - 1.5, 3, 3);
    }
    path(flat.reference, color("--trace3"), 1.5);
    path(flat.track, color("--trace1"), 2);
    const line = flat.track ?? flat.fixes;
    if (line && line.t.length) {
      const text = (i: number, words: string) => {
        ctx.fillStyle = color("--ink");
        ctx.beginPath();
        ctx.arc(x(line.east[i]!), y(line.north[i]!), 4, 0, 7);
        ctx.fill();
        ctx.font = "12px system-ui, sans-serif";
        ctx.fillText(words, x(line.east[i]!) + 7, y(line.north[i]!) - 5);
      };
      text(0, "start");
      text(line.t.length - 1, "end");
      if (props.cursor !== null) {
        const i = indexOf(line.t, props.cursor);
        ctx.beginPath();
        ctx.arc(x(line.east[i]!), y(line.north[i]!), 7, 0, 7);
        ctx.fillStyle = color("--mark");
        ctx.fill();
        ctx.lineWidth = 2;
        ctx.strokeStyle = color("--paper");
        ctx.stroke();
      }
    }
  }, [flat, view, width, props.cursor, props.up, dark]);

  const zoom = (factor: number) => view && setMoved({ ...view, scale: view.scale * factor });
  const shift = (right: number, up: number) => view && setMoved({ ...view, east: view.east + (right * 60) / view.scale, north: view.north + (up * 60) / view.scale });
  const drag = useRef<{ x: number; y: number; north: number; east: number } | null>(null);
  const point = (event: PointerEvent) => {
    const line = flat?.track ?? flat?.fixes;
    if (!view || !line) return;
    const box = canvas.current!.getBoundingClientRect();
    if (drag.current && event.buttons) {
      setMoved({ ...view, east: drag.current.east - (event.clientX - drag.current.x) / view.scale, north: drag.current.north + (event.clientY - drag.current.y) / view.scale });
      return;
    }
    const east = view.east + (event.clientX - box.left - width / 2) / view.scale;
    const north = view.north - (event.clientY - box.top - HEIGHT / 2) / view.scale;
    let best = Infinity, at = -1;
    for (let i = 0; i < line.t.length; i++) {
      const far = (line.north[i]! - north) ** 2 + (line.east[i]! - east) ** 2;
      if (far < best) { best = far; at = i; }
    }
    if (at >= 0 && Math.sqrt(best) * view.scale < 40) props.onCursor(line.t[at]!);
  };
  const keys = (event: KeyboardEvent) => {
    const act: Record<string, () => unknown> = {
      "+": () => zoom(1.5), "=": () => zoom(1.5), "-": () => zoom(1 / 1.5), "0": () => setMoved(null),
      ArrowLeft: () => shift(-1, 0), ArrowRight: () => shift(1, 0), ArrowUp: () => shift(0, 1), ArrowDown: () => shift(0, -1),
    };
    if (!act[event.key] || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    act[event.key]!();
  };
  return <div ref={element} class="grid">
    <canvas ref={canvas} tabIndex={0} role="img" aria-label={`Plan of the track, ${props.up ? `up is ${props.up}` : "north up"}, on a grid of meters. Arrow keys move it, plus and minus zoom, 0 shows all.`}
      style={{ width: "100%", height: `${HEIGHT}px` }} onKeyDown={keys} onPointerMove={point}
      onPointerDown={(e) => { if (view) drag.current = { x: e.clientX, y: e.clientY, north: view.north, east: view.east }; }}
      onPointerUp={() => { drag.current = null; }} />
    <div class="corner row tools">
      <button type="button" aria-label="Zoom in on the plan" onClick={() => zoom(1.5)}>+</button>
      <button type="button" aria-label="Zoom out of the plan" onClick={() => zoom(1 / 1.5)}>−</button>
      <button type="button" onClick={() => setMoved(null)} disabled={!moved}>All</button>
    </div>
  </div>;
}

function drawGrid(ctx: CanvasRenderingContext2D, width: number, view: { north: number; east: number; scale: number }, up: string) {
  const mesh = round(110 / view.scale);
  ctx.clearRect(0, 0, width, HEIGHT);
  ctx.strokeStyle = color("--faint");
  ctx.lineWidth = 1;
  ctx.beginPath();
  const left = view.east - width / 2 / view.scale, bottom = view.north - HEIGHT / 2 / view.scale;
  for (let e = Math.ceil(left / mesh) * mesh; e < left + width / view.scale; e += mesh) {
    const x = Math.round(width / 2 + (e - view.east) * view.scale) + 0.5;
    ctx.moveTo(x, 0);
    ctx.lineTo(x, HEIGHT);
  }
  for (let n = Math.ceil(bottom / mesh) * mesh; n < bottom + HEIGHT / view.scale; n += mesh) {
    const y = Math.round(HEIGHT / 2 - (n - view.north) * view.scale) + 0.5;
    ctx.moveTo(0, y);
    ctx.lineTo(width, y);
  }
  ctx.stroke();
  const ink = color("--soft");
  ctx.strokeStyle = ctx.fillStyle = ink;
  ctx.lineWidth = 2;
  ctx.font = "12px system-ui, sans-serif";
  ctx.beginPath();
  ctx.moveTo(14, HEIGHT - 14);
  ctx.lineTo(14 + mesh * view.scale, HEIGHT - 14);
  ctx.stroke();
  ctx.fillText(mesh >= 1000 ? `${number(mesh / 1000)} km` : `${number(mesh)} m`, 14, HEIGHT - 20);
  ctx.beginPath();
  ctx.moveTo(20, 34);
  ctx.lineTo(20, 12);
  ctx.lineTo(16, 19);
  ctx.moveTo(20, 12);
  ctx.lineTo(24, 19);
  ctx.stroke();
  ctx.fillText(up, 29, 22);
}
