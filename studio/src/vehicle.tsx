// The vehicle from above and from the side: dots that are dragged where sensor, antenna and
// reference point sit. Positions are forward, right, down in m, from the origin of the drawing.

import { useRef, useState } from "preact/hooks";
import { number } from "./format";
import type { Point } from "./store";

export interface Dot { key: string; label: string; value: Point | null }

interface Props { dots: Dot[]; onMove: (key: string, value: Point) => void; length?: number; width?: number }

const NAMES = ["forward", "right", "down"] as const;
// Meters shown: from the origin, with room around a large car.
const REACH = 3.2, SIDE = 1.5, UP = 2.1, BELOW = 1.0;

export function Vehicle({ dots, onMove, length = 4.5, width = 1.8 }: Props) {
  const [chosen, setChosen] = useState(dots[0]?.key ?? "");
  const reach = Math.max(REACH, length / 2 + 0.9), side = Math.max(SIDE, width / 2 + 0.6);
  return <div class="vehicle">
    <div class="views">
      <View title="From above" dots={dots} axes={[0, 1]} box={[-reach, -side, 2 * reach, 2 * side]} onMove={onMove} chosen={chosen} onChoose={setChosen}>
        <rect x={-length / 2} y={-width / 2} width={length} height={width} rx={0.35} class="body" />
        <path d={`M${length * 0.12} ${-width * 0.4} L${length * 0.24} ${-width * 0.36} L${length * 0.24} ${width * 0.36} L${length * 0.12} ${width * 0.4} Z`} class="glass" />
        <path d={`M${-length * 0.3} ${-width * 0.36} L${-length * 0.24} ${-width * 0.38} L${-length * 0.24} ${width * 0.38} L${-length * 0.3} ${width * 0.36} Z`} class="glass" />
        <text x={length / 2 + 0.12} y={0.07} class="words">front</text>
      </View>
      <View title="From the right side" dots={dots} axes={[0, 2]} box={[-reach, -UP, 2 * reach, UP + BELOW]} onMove={onMove} chosen={chosen} onChoose={setChosen}>
        <path d={`M${-length / 2} 0.3 L${-length / 2} -0.25 L${-length * 0.36} -0.4 L${-length * 0.24} -0.95 L${length * 0.1} -0.95 L${length * 0.26} -0.4 L${length * 0.46} -0.25 L${length / 2} 0 L${length / 2} 0.3 Z`} class="body" />
        <circle cx={length * 0.3} cy={0.3} r={0.32} class="wheel" />
        <circle cx={-length * 0.3} cy={0.3} r={0.32} class="wheel" />
        <line x1={-reach} x2={reach} y1={0.62} y2={0.62} class="ground" />
        <text x={length / 2 + 0.12} y={0.07} class="words">front</text>
      </View>
    </div>
    <p class="help">Drag a dot, or use the arrow keys on it (1 cm a step, 10 cm with Shift), or write the numbers. The cross is the origin.</p>
    <div class="places">
      {dots.map((dot) => <fieldset key={dot.key} class={dot.key === chosen ? "chosen" : ""}>
        <legend><i class={`dot p${dots.indexOf(dot) + 1}`} />{dot.label}</legend>
        {NAMES.map((name, axis) => <label key={name}>{name}
          <span class="withunit"><input type="number" step="0.01" value={dot.value === null ? "" : number(dot.value[axis]!)} placeholder="?"
            onFocus={() => setChosen(dot.key)}
            onChange={(e) => {
              const written = e.currentTarget.valueAsNumber;
              if (!Number.isFinite(written)) return;
              const moved: Point = [...(dot.value ?? [0, 0, 0])] as Point;
              moved[axis] = written;
              onMove(dot.key, moved);
            }} /><span class="unit">m</span></span></label>)}
      </fieldset>)}
    </div>
  </div>;
}

function View({ title, dots, axes, box, onMove, chosen, onChoose, children }: {
  title: string; dots: Dot[]; axes: [number, number]; box: [number, number, number, number];
  onMove: (key: string, value: Point) => void; chosen: string; onChoose: (key: string) => void; children: preact.ComponentChildren;
}) {
  const svg = useRef<SVGSVGElement>(null);
  const put = (dot: Dot, across: number, along: number) => {
    const moved: Point = [...(dot.value ?? [0, 0, 0])] as Point;
    // Whole centimeters: nobody measures better on a drawing.
    moved[axes[0]] = Math.round(across * 100) / 100;
    moved[axes[1]] = Math.round(along * 100) / 100;
    onMove(dot.key, moved);
  };
  const drag = (dot: Dot) => (event: PointerEvent) => {
    const handle = event.currentTarget as SVGElement;
    handle.setPointerCapture(event.pointerId);
    onChoose(dot.key);
    const move = (e: PointerEvent) => {
      const at = new DOMPoint(e.clientX, e.clientY).matrixTransform(svg.current!.getScreenCTM()!.inverse());
      put(dot, Math.max(box[0], Math.min(box[0] + box[2], at.x)), Math.max(box[1], Math.min(box[1] + box[3], at.y)));
    };
    const end = () => { handle.removeEventListener("pointermove", move); handle.removeEventListener("pointerup", end); };
    handle.addEventListener("pointermove", move);
    handle.addEventListener("pointerup", end);
  };
  // Those that are not stated stand beside the origin, none under another.
  const unset = (dot: Dot): Point => [0, 0.35 * (1 + dots.filter((one) => one.value === null).indexOf(dot)), 0];
  // Of two the lower has its name below it, so that neither name covers the other.
  const down = (dot: Dot) => (dot.value ?? unset(dot))[axes[1]]!;
  const lower = dots.length === 2 ? [...dots].sort((a, b) => down(a) - down(b))[1] : undefined;
  const keys = (dot: Dot) => (event: KeyboardEvent) => {
    const step = event.shiftKey ? 0.1 : 0.01;
    const by: Record<string, [number, number]> = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    const change = by[event.key];
    if (!change) return;
    event.preventDefault();
    const from = dot.value ?? unset(dot);
    put(dot, from[axes[0]]! + change[0], from[axes[1]]! + change[1]);
  };
  return <figure>
    <svg ref={svg} viewBox={box.join(" ")} role="group" aria-label={`The vehicle ${title.toLowerCase()}`}>
      {children}
      <path d="M-0.14 0 H0.14 M0 -0.14 V0.14" class="origin" />
      {[...dots].sort((a, b) => Number(a.key === chosen) - Number(b.key === chosen)).map((dot) => {
        const at = dot.value ?? unset(dot);
        return <g key={dot.key} class={`place p${dots.indexOf(dot) + 1}${dot.value === null ? " unset" : ""}`} tabIndex={0} role="button"
          aria-label={`${dot.label}: ${NAMES[axes[0] as 0]} ${number(at[axes[0]]!)} m, ${NAMES[axes[1] as 1]} ${number(at[axes[1]]!)} m. Arrow keys move it.`}
          onPointerDown={drag(dot)} onKeyDown={keys(dot)} onFocus={() => onChoose(dot.key)}>
          <circle cx={at[axes[0]]} cy={at[axes[1]]} r={0.28} class="touch" />
          <circle cx={at[axes[0]]} cy={at[axes[1]]} r={0.1} />
          {(dots.length < 3 || dot.key === chosen) && <text x={at[axes[0]]! + 0.14} y={at[axes[1]]! + (dot === lower ? 0.14 : -0.14)} dominant-baseline={dot === lower ? "hanging" : "auto"} class="words">{dot.label}</text>}
        </g>;
      })}
    </svg>
    <figcaption>{title}</figcaption>
  </figure>;
}
