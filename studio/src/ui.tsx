// Parts that every page is made of. All that comes from files and from the server is text here,
// never markup.

import type { ComponentChildren, JSX } from "preact";
import { useEffect, useId, useRef, useState } from "preact/hooks";
import { problemOf } from "./api";
import { capital, number, shown } from "./format";
import type { Choice, Field, Finding, Option, Problem, Question } from "./types";

/** The state of one request: begun again when `keys` change, an old answer never over a new one. */
export function useRequest<T>(ask: ((signal: AbortSignal) => Promise<T>) | null, keys: unknown[]) {
  const [found, setFound] = useState<{ value: T | null; problem: Problem | null; busy: boolean }>(
    { value: null, problem: null, busy: ask !== null });
  const [again, setAgain] = useState(0);
  useEffect(() => {
    if (!ask) {
      setFound({ value: null, problem: null, busy: false });
      return;
    }
    const control = new AbortController();
    setFound((before) => ({ ...before, problem: null, busy: true }));
    ask(control.signal).then(
      (value) => { if (!control.signal.aborted) setFound({ value, problem: null, busy: false }); },
      (error: unknown) => {
        if (!control.signal.aborted) setFound({ value: null, problem: problemOf(error), busy: false });
      });
    return () => control.abort();
  }, [...keys, again]);
  return { ...found, again: () => setAgain((n) => n + 1) };
}

export function Page({ title, lead, children }: { title: string; lead?: ComponentChildren; children: ComponentChildren }) {
  const heading = useRef<HTMLHeadingElement>(null);
  useEffect(() => {
    document.title = `${title} – Strapdown Studio`;
  }, [title]);
  // A new page is announced by its heading; the first one is not: nobody moved there.
  useEffect(() => {
    if (history.length > 1 && document.body.dataset["moved"]) heading.current?.focus({ preventScroll: true });
    document.body.dataset["moved"] = "yes";
  }, []);
  return <>
    <header class="head">
      <h1 ref={heading} tabIndex={-1}>{title}</h1>
      {lead && <p class="lead">{lead}</p>}
    </header>
    {children}
  </>;
}

export function Part({ title, id, children, aside }: { title: string; id?: string; children: ComponentChildren; aside?: ComponentChildren }) {
  const own = useId();
  return <section class="part" aria-labelledby={id ?? own}>
    <div class="parthead"><h2 id={id ?? own}>{title}</h2>{aside}</div>
    {children}
  </section>;
}

export function More({ title, open, children }: { title: ComponentChildren; open?: boolean; children: ComponentChildren }) {
  return <details class="more" open={open}><summary>{title}</summary><div class="moreinside">{children}</div></details>;
}

/** What is wrong, and what to do. `take`: it takes the focus, as the answer to a button beside it. */
export function Trouble({ problem, retry, take }: { problem: Problem | null; retry?: () => void; take?: boolean }) {
  const own = useRef<HTMLDivElement>(null);
  useEffect(() => { if (take && problem) own.current?.focus(); }, [problem, take]);
  if (!problem) return null;
  return <div class="notice bad" role="alert" ref={own} tabIndex={-1}>
    <p>{problem.file && <span class="soft">{problem.file}{problem.row ? `, row ${problem.row}` : ""}: </span>}<strong>{sentence(problem.text)}</strong></p>
    {problem.remedy && <p>{sentence(problem.remedy)}</p>}
    {retry && <p><button type="button" onClick={retry}>Try again</button></p>}
  </div>;
}

export function Busy({ children }: { children: ComponentChildren }) {
  return <p class="busy" role="status"><span class="spin" aria-hidden="true" />{children}</p>;
}

export const Empty = ({ children }: { children: ComponentChildren }) => <p class="empty">{children}</p>;

const SEVERITY: Record<string, { word: string; look: string }> = {
  error: { word: "Error", look: "bad" }, warning: { word: "Warning", look: "warn" }, note: { word: "Note", look: "note" },
};

/** Errors and warnings as a list; notes behind one line, where they are many. */
export function Findings({ findings: all, none }: { findings: Finding[]; none?: string }) {
  // One that several files have names them all.
  const byText = new Map<string, Finding>();
  for (const one of all) {
    const key = `${one.severity} ${one.text ?? one.sentence ?? one.code} ${one.remedy}`, same = byText.get(key);
    byText.set(key, same?.file && one.file && same.file !== one.file ? { ...same, file: `${same.file}, ${one.file}` } : same ?? one);
  }
  const findings = [...byText.values()];
  if (!findings.length) return none ? <Empty>{none}</Empty> : null;
  const of = (...severities: string[]) => findings.filter((one) => severities.includes(one.severity));
  const notes = findings.filter((one) => !["error", "warning"].includes(one.severity));
  const list = (some: Finding[]) => some.length > 0 && <ul class="findings">{some.map((one, i) => <OneFinding finding={one} key={i} />)}</ul>;
  return <>
    {list([...of("error"), ...of("warning"), ...(notes.length <= 3 ? notes : [])])}
    {notes.length > 3 && <More title={`${notes.length} notes`}>{list(notes)}</More>}
  </>;
}

function OneFinding({ finding: one }: { finding: Finding }) {
  const { word, look } = SEVERITY[one.severity] ?? SEVERITY["note"]!;
  return <li class={look}>
    <span class="tag">{word}</span>
    <div>
      <p>{one.file && <span class="soft">{one.file}: </span>}{sentence(one.text ?? one.sentence ?? one.code)}</p>
      {one.remedy && <p class="remedy">What to do: {one.remedy}</p>}
    </div>
  </li>;
}

/** A text as a sentence. */
export const sentence = (text: string) => capital(text) + (/[.?!]$/.test(text) ? "" : ".");

/** Answers above this number are in a list that opens. */
const MANY = 10;

/** An open question: answered by one click, or by a value with its unit; `onAnswer` says what is wrong with it. */
export function Ask({ question, onAnswer, list, take, of }: { question: Question; onAnswer: (set: Record<string, unknown>) => void | Promise<string | void>; list?: boolean; take?: boolean; /** The file that it is about, where there are several. */ of?: string | null | undefined }) {
  const own = useRef<HTMLDivElement>(null);
  useEffect(() => { if (take) own.current?.focus(); }, [take]);
  const [text, setText] = useState("");
  const [fault, setFault] = useState("");
  const id = useId();
  const count = question.count ?? 3;
  // A position is along the axes of the vehicle; of other lists the question says what they are.
  const named = count === 3 && /(^|\.)(position|lever_arm|contact)_m$/.test(question.key ?? "") ? "Forward, right, down: three" : `${count}`;
  const example = list && question.free !== "text" ? `${named} numbers with commas between them, such as ${question.example?.replace(/[[\]]/g, "") || [0.3, 0, -1.2, 0, 0, 0].slice(0, count).join(", ")}.`
    : question.example ? `For example: ${question.example}.` : "";
  const give = async (set: Record<string, unknown>) => { setFault(""); setFault(await onAnswer(set) || ""); };
  const submit = (event: Event) => {
    event.preventDefault();
    if (!question.key || text.trim() === "") return setFault("Write an answer first.");
    const value = question.free === "text" ? text : list ? parseNumbers(text) : oneNumber(text);
    if (list && question.free !== "text" && (!Array.isArray(value) || value.length !== count)) return setFault(example);
    if (value === null || (Array.isArray(value) && !list)) return setFault("This has to be a number, such as 0.25.");
    void give({ [question.key]: value });
  };
  return <div class="ask" role="group" aria-labelledby={id} ref={own} tabIndex={-1}>
    <p id={id}>{of && <span class="of">{of}: </span>}{sentence(question.text)}</p>
    {question.remedy && <p class="help">{sentence(question.remedy)}</p>}
    {question.choices.length > MANY ? <select aria-label="Choose one" onChange={(e) => void give(question.choices[e.currentTarget.selectedIndex - 1]?.set ?? {})}><option>choose one</option>{question.choices.map((choice) => <option key={choice.label}>{choice.label}</option>)}</select> : question.choices.length > 0 && <div class="row">
      {question.choices.map((choice: Choice) => <button type="button" key={choice.label} onClick={() => void give(choice.set)}>{choice.label}{choice.likely ? " (likely)" : ""}</button>)}
    </div>}
    {question.free && example && <p class="help" id={`${id}e`}>{example}</p>}
    {question.free && <form class="row" onSubmit={submit}>
      <span class="withunit">
        <input type="text" aria-label="Your answer" inputMode={question.free === "number" && !list ? "decimal" : "text"} value={text} aria-invalid={fault !== ""} aria-describedby={fault ? `${id}f` : example ? `${id}e` : undefined} onInput={(e) => setText(e.currentTarget.value)} />
        {question.unit && <span class="unit">{question.unit}</span>}
      </span>
      <button type="submit">Answer</button>
      {fault && <span class="fault" id={`${id}f`} role="alert">{fault}</span>}
    </form>}
  </div>;
}

/** A number, or a list of them; null if the text is neither. */
export function parseNumbers(text: string): number | number[] | null {
  const parts = text.replace(/[[\]]/g, "").split(/[,;\s]+/).filter((p) => p !== "");
  if (!parts.length) return null;
  const values = parts.map(Number);
  if (values.some((v) => !Number.isFinite(v))) return null;
  return values.length === 1 ? values[0]! : values;
}

/** One number, with a decimal comma too; null if it is none, and of 1,000, which may be a thousand. */
export function oneNumber(text: string): number | null {
  const written = text.trim();
  const value = /^[-+]?[1-9]\d{0,2},\d{3}$/.test(written) ? NaN : Number(written.replace(/^([-+]?\d*),(\d+)$/, "$1.$2"));
  return written !== "" && Number.isFinite(value) ? value : null;
}

/** A labelled control of a form with its unit, its help and what is wrong with it. */
export function Control({ field, value, fault, onChange }: {
  field: Field; value: unknown; fault?: string | undefined; onChange: (value: unknown) => void;
}) {
  const id = useId();
  const [own, setOwn] = useState("");
  const [text, setText] = useState<string | null>(null);
  const open = value === "?" || (Array.isArray(value) && value.includes("?"));
  const written = value === undefined || value === null ? "" : open ? "" : Array.isArray(value) ? value.map((v) => typeof v === "object" ? JSON.stringify(v) : String(v)).join(", ") : typeof value === "object" ? JSON.stringify(value) : String(value);
  const settled = text ?? written;
  const described = [field.help ? `${id}h` : "", fault || own ? `${id}f` : ""].filter(Boolean).join(" ") || undefined;
  const common = { id, "aria-describedby": described, "aria-invalid": Boolean(fault || own) };
  // What was typed stays until what the server made of it has come back.
  useEffect(() => setText(null), [written]);
  const commit = () => {
    if (text === null) return;
    if (text === written) return setText(null);
    if (text.trim() === "") { setOwn(""); return onChange(null); }
    if (field.type === "text") { setOwn(""); return onChange(text); }
    const numbers = field.type === "number" ? oneNumber(text) : parseNumbers(text);
    if (numbers === null && field.type === "number") return setOwn("This has to be a number, such as 0.25.");
    if (field.type === "list") {
      setOwn("");
      // A list of words, where they are no numbers.
      return onChange(numbers === null ? text.split(",").map((word) => word.trim()).filter(Boolean) : Array.isArray(numbers) ? numbers : [numbers]);
    }
    setOwn("");
    onChange(numbers);
  };
  const byDefault = field.default === undefined || field.default === null || field.default === "" ? "" : shown(field.default);
  const usual = field.type === "flag" ? (field.default === true ? "yes" : field.default === false ? "no" : "") : byDefault && withUnit(field.default, field.unit ?? "");
  let control: JSX.Element;
  if (field.type === "flag") {
    control = <input {...common} type="checkbox" checked={Boolean(value ?? field.default)} onChange={(e) => onChange(e.currentTarget.checked)} />;
  } else if (field.type === "choice" && field.choices?.length) {
    control = <select {...common} value={written} onChange={(e) => {
      const chosen = field.choices!.find((c) => String(c) === e.currentTarget.value);
      onChange(chosen === undefined ? null : chosen);
    }}>
      <option value="">{byDefault ? `not set (${byDefault})` : "not set"}</option>
      {field.choices.map((c) => <option key={String(c)} value={String(c)}>{String(c)}</option>)}
      {written !== "" && !field.choices.some((c) => String(c) === written) && <option value={written}>{written}</option>}
    </select>;
  } else {
    control = <input {...common} type="text" inputMode={field.type === "number" ? "decimal" : "text"} value={settled} placeholder={open ? "to be answered" : byDefault}
      onInput={(e) => setText(e.currentTarget.value)} onBlur={commit} onKeyDown={(e) => { if (e.key === "Enter") commit(); }} />;
  }
  return <div class={`field${open ? " open" : ""}${field.type === "flag" ? " flag" : ""}`}>
    <label for={id}>{field.label}</label>
    <span class="withunit">{control}{field.unit && <span class="unit">{field.unit}</span>}</span>
    {(fault || own) && <p class="fault" id={`${id}f`}>{fault ?? own}</p>}
    {field.help && <p class="help" id={`${id}h`}>{sentence(field.help)}{usual && ` Default: ${usual}.`}</p>}
  </div>;
}

export function Copy({ text, label = "Copy" }: { text: string; label?: string }) {
  const [said, setSaid] = useState("");
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(text);
      setSaid("Copied");
    } catch {
      // Without the permission: a selection that the person copies.
      setSaid("Press Ctrl+C");
    }
    setTimeout(() => setSaid(""), 2500);
  };
  return <button type="button" class="copy" onClick={() => void copy()}><span aria-live="polite">{said || label}</span></button>;
}

export function Command({ text }: { text: string }) {
  return <div class="command"><code tabIndex={0}>{text}</code><Copy text={text} /></div>;
}

/** `stack`: on a narrow page each row is a block, every cell under the words of its column. */
export function Table({ caption, head, rows, numeric = [], stack = false }: { caption?: string; head: string[]; rows: ComponentChildren[][]; numeric?: number[]; stack?: boolean }) {
  return <div class="scroll" tabIndex={0} role="region" aria-label={caption ?? head.filter(Boolean).join(", ")}>
    <table role="table" class={stack ? "stack" : ""}>
      {caption && <caption>{caption}</caption>}
      <thead role="rowgroup"><tr role="row">{head.map((h, i) => <th role="columnheader" scope="col" class={numeric.includes(i) ? "num" : ""} key={i}>{h}</th>)}</tr></thead>
      <tbody role="rowgroup">{rows.map((row, i) => <tr role="row" key={i}>{row.map((cell, j) => j === 0 ? <th role="rowheader" scope="row" key={j}>{cell}</th>
        : <td role="cell" class={numeric.includes(j) ? "num" : ""} data-head={head[j]} key={j}>{cell}</td>)}</tr>)}</tbody>
    </table>
  </div>;
}

/** Options as a table: those that were set first, those as by default folded. */
export function Options({ options, folded = false }: { options: Option[]; folded?: boolean }) {
  const table = (some: Option[]) => <Table stack head={["Option", "Value", "Default"]} rows={some.map((one) => [
    <>{one.label ? <>{one.label} <code class="soft">{one.key}</code></> : <code>{one.key}</code>}{one.help && <span class="help said">{sentence(one.help)}</span>}</>,
    withUnit(one.value, one.unit), one.default === null ? "" : withUnit(one.default, one.unit),
  ])} />;
  const set = options.filter((one) => !one.usual), usual = options.filter((one) => one.usual);
  return <>
    {set.length > 0 && (folded ? <More title={`${set.length} that were set`}>{table(set)}</More> : table(set))}
    {usual.length > 0 && <More title={`${usual.length} as by default`}>{table(usual)}</More>}
  </>;
}

export const withUnit = (value: unknown, unit: string) => written(value) + (unit && /\d/.test(written(value)) ? `\u00a0${unit}` : "");

/** A value of an option, in full. */
export function written(value: unknown): string {
  if (Array.isArray(value)) return value.length ? value.map(written).join(", ") : "none";
  return typeof value === "number" ? number(value, 9) : value === "" ? "none" : shown(value);
}

/** Width of an element, as it is laid out. */
export function useWidth<E extends HTMLElement>() {
  const element = useRef<E>(null);
  const [width, setWidth] = useState(0);
  useEffect(() => {
    const seen = element.current;
    if (!seen) return;
    const watch = new ResizeObserver((entries) => setWidth(Math.floor(entries[0]?.contentRect.width ?? 0)));
    watch.observe(seen);
    return () => watch.disconnect();
  }, []);
  return [element, width] as const;
}

/** A color of the style sheet by its name, as it is now: light or dark. */
export const color = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Draw again when the system turns from light to dark or back. */
export function useDark(): boolean {
  const [dark, setDark] = useState(() => matchMedia("(prefers-color-scheme: dark)").matches);
  useEffect(() => {
    const media = matchMedia("(prefers-color-scheme: dark)");
    const changed = () => setDark(media.matches);
    media.addEventListener("change", changed);
    return () => media.removeEventListener("change", changed);
  }, []);
  return dark;
}
