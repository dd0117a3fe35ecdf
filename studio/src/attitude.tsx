// The attitude as a box with its axes, seen from behind and above, and as words beside it.

import { useEffect, useRef, useState } from "preact/hooks";
import { color, useDark, useWidth } from "./ui";

export type Quaternion = [number, number, number, number];
type Vector = [number, number, number];

/** Body to north-east-down, of the rotation that the quaternion (w, x, y, z) states. */
export function rotate([w, x, y, z]: Quaternion, [a, b, c]: Vector): Vector {
  return [
    (w * w + x * x - y * y - z * z) * a + 2 * (x * y - w * z) * b + 2 * (x * z + w * y) * c,
    2 * (x * y + w * z) * a + (w * w - x * x + y * y - z * z) * b + 2 * (y * z - w * x) * c,
    2 * (x * z - w * y) * a + 2 * (y * z + w * x) * b + (w * w - x * x - y * y + z * z) * c,
  ];
}

/** Roll, pitch, heading in degrees. */
export function euler([w, x, y, z]: Quaternion): Vector {
  const deg = 180 / Math.PI;
  const roll = Math.atan2(2 * (w * x + y * z), w * w - x * x - y * y + z * z) * deg;
  const pitch = Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - x * z)))) * deg;
  const heading = Math.atan2(2 * (x * y + w * z), w * w + x * x - y * y - z * z) * deg;
  return [roll, pitch, (heading + 360) % 360];
}

export function fromEuler(roll: number, pitch: number, heading: number): Quaternion {
  const [r, p, h] = [roll, pitch, heading].map((a) => (a * Math.PI) / 360) as Vector;
  const [cr, sr, cp, sp, ch, sh] = [Math.cos(r), Math.sin(r), Math.cos(p), Math.sin(p), Math.cos(h), Math.sin(h)];
  return [cr * cp * ch + sr * sp * sh, sr * cp * ch - cr * sp * sh, cr * sp * ch + sr * cp * sh, cr * cp * sh - sr * sp * ch];
}

/** What headings are from: north, north by a magnetometer, or the heading at the entry or the start. */
export type North = "true" | "magnetic" | "entry" | "start";

/** A bound as the server writes it, by the name of its quantity. */
export interface Bound { name: string; bound: string }

export function inWords(q: Quaternion, north: North = "true", bounds: Bound[] = []): string {
  const [roll, pitch, heading] = euler(q);
  const within = (name: string) => { const bound = bounds.find((one) => one.name === name)?.bound; return bound ? ` (${bound.replace(/\s*deg$/, "°")})` : ""; };
  const side = (Math.abs(roll) < 0.05 ? "level across" : `${Math.abs(roll).toFixed(1)}° down on the ${roll > 0 ? "right" : "left"}`) + within("Roll");
  const nose = (Math.abs(pitch) < 0.05 ? "nose level" : `nose ${Math.abs(pitch).toFixed(1)}° ${pitch > 0 ? "up" : "down"}`) + within("Pitch");
  const signed = heading > 180 ? heading - 360 : heading;
  const facing = (north === "true" ? `Heading ${heading.toFixed(1)}°` : north === "magnetic" ? `Heading ${heading.toFixed(1)}° from magnetic north`
    : Math.abs(signed) < 0.05 ? `Facing as at the ${north}` : `Facing ${Math.abs(signed).toFixed(1)}° to the ${signed > 0 ? "right" : "left"} of the direction at the ${north}`) + within("Heading");
  return `${facing}, ${nose}, ${side}.`;
}

// Half the length, width and height of the box, along forward, right, down.
const SIZE: Vector = [1.0, 0.5, 0.28];
const HEIGHT = 260;

export function Attitude({ q, at, north = "true", bounds = [], given = "" }: { q: Quaternion | null; at?: string; north?: North; bounds?: Bound[]; /** What it rests on, before its words. */ given?: string }) {
  const [element, width] = useWidth<HTMLDivElement>();
  const canvas = useRef<HTMLCanvasElement>(null);
  const [turn, setTurn] = useState<[number, number]>([0.45, 0.45]);
  const dark = useDark();
  const drag = useRef<{ x: number; y: number; turn: [number, number] } | null>(null);

  useEffect(() => {
    const own = canvas.current;
    if (!own || !width) return;
    const dense = devicePixelRatio || 1;
    own.width = width * dense;
    own.height = HEIGHT * dense;
    const ctx = own.getContext("2d")!;
    ctx.scale(dense, dense);
    ctx.clearRect(0, 0, width, HEIGHT);
    const scale = Math.min(width / 3.8, HEIGHT / 2.9);
    // A camera that looks north, turned to the side and down by what was dragged.
    const [side, tilt] = turn;
    const see = ([n, e, d]: Vector): Vector => {
      const across = e * Math.cos(side) - n * Math.sin(side), ahead = n * Math.cos(side) + e * Math.sin(side);
      const up = -d * Math.cos(tilt) + ahead * Math.sin(tilt), depth = ahead * Math.cos(tilt) + d * Math.sin(tilt);
      const near = 6 / (6 + depth);
      return [width / 2 + across * scale * near, HEIGHT * 0.46 - up * scale * near, depth];
    };
    const line = (from: Vector, to: Vector, stroke: string, thick: number) => {
      const a = see(from), b = see(to);
      ctx.strokeStyle = stroke;
      ctx.lineWidth = thick;
      ctx.beginPath();
      ctx.moveTo(a[0], a[1]);
      ctx.lineTo(b[0], b[1]);
      ctx.stroke();
    };
    const faint = color("--line");
    for (let i = -2; i <= 2; i++) {
      line([i * 0.6, -1.2, 0.9], [i * 0.6, 1.2, 0.9], faint, 1);
      line([-1.2, i * 0.6, 0.9], [1.2, i * 0.6, 0.9], faint, 1);
    }
    const label = (place: Vector, text: string, fill: string) => {
      const p = see(place);
      ctx.fillStyle = fill;
      ctx.font = "13px system-ui, sans-serif";
      ctx.fillText(text, p[0] - 5, p[1] + 4);
    };
    const toNorth = north === "true" || north === "magnetic";
    label([1.4, 0, 0.9], !toNorth ? `forward at the ${north}` : north === "magnetic" ? "magnetic N" : "N", color("--soft"));
    if (toNorth) label([0, 1.4, 0.9], "E", color("--soft"));
    if (!q) return;
    const corner = (a: number, b: number, c: number) => rotate(q, [a * SIZE[0], b * SIZE[1], c * SIZE[2]]);
    const faces: { points: Vector[]; fill: string }[] = [];
    const fills = [["--boxfront", "--box"], ["--box", "--box"], ["--box", "--boxtop"]] as const;
    for (const axis of [0, 1, 2]) {
      for (const sign of [1, -1]) {
        const round = [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([u, v]) => {
          const c: Vector = [0, 0, 0];
          c[axis] = sign; c[(axis + 1) % 3] = u!; c[(axis + 2) % 3] = v!;
          return corner(...c);
        });
        faces.push({ points: round, fill: fills[axis]![sign === 1 ? 0 : 1] });
      }
    }
    const depth = (points: Vector[]) => points.reduce((sum, p) => sum + see(p)[2], 0);
    faces.sort((a, b) => depth(b.points) - depth(a.points));
    for (const { points, fill } of faces) {
      ctx.beginPath();
      points.map(see).forEach((p, i) => { if (i) ctx.lineTo(p[0], p[1]); else ctx.moveTo(p[0], p[1]); });
      ctx.closePath();
      ctx.fillStyle = color(fill);
      ctx.fill();
      ctx.strokeStyle = color("--ink");
      ctx.lineWidth = 1;
      ctx.stroke();
    }
    const axes: [Vector, string, string][] = [[[1.5, 0, 0], "forward", "--trace2"], [[0, 1.0, 0], "right", "--trace3"], [[0, 0, 0.8], "down", "--trace1"]];
    for (const [tip, name, stroke] of axes) {
      const end = rotate(q, tip);
      line([0, 0, 0], end, color(stroke), 2.5);
      label(rotate(q, tip.map((v) => v * 1.15) as Vector), name, color(stroke));
    }
  }, [q, turn, width, dark]);

  const words = q ? given + inWords(q, north, bounds) : "No attitude at this instant.";
  const keys = (event: KeyboardEvent) => {
    const by: Record<string, [number, number]> = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    const change = by[event.key];
    if (!change) return;
    event.preventDefault();
    setTurn([turn[0] + change[0], Math.max(-0.2, Math.min(1.5, turn[1] + change[1]))]);
  };
  return <figure class="attitude" ref={element}>
    <canvas ref={canvas} tabIndex={0} role="img" aria-label={`Box in its attitude. ${words} Arrow keys turn the view.`} style={{ width: "100%", height: `${HEIGHT}px` }}
      onKeyDown={keys}
      onPointerDown={(e) => { e.currentTarget.setPointerCapture(e.pointerId); drag.current = { x: e.clientX, y: e.clientY, turn }; }}
      onPointerMove={(e) => {
        if (!drag.current) return;
        setTurn([drag.current.turn[0] + (e.clientX - drag.current.x) / 150, Math.max(-0.2, Math.min(1.5, drag.current.turn[1] + (e.clientY - drag.current.y) / 150))]);
      }}
      onPointerUp={() => { drag.current = null; }} />
    <figcaption>{at && <b>{at} </b>}{words}</figcaption>
  </figure>;
}
