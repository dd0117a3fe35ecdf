// Set up: the configuration as a form and as TOML side by side, kept in step by the server; open
// questions first; for a crash, what follows from it while its parameters move.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { aborted, api, problemOf } from "./api";
import { CrashPreview } from "./crash";
import { number, plural, shown, stamp } from "./format";
import { saidOf } from "./page_look";
import { putJob, setWork, useShared, type Point, type Work } from "./store";
import type { Checked, Fault, Field, Finding, Problem, Question, Section } from "./types";
import { Ask, Busy, Control, Copy, Empty, Findings, More, Page, Part, sentence, Trouble, useRequest, withUnit } from "./ui";
import { Vehicle } from "./vehicle";

/** What a proposal depends on: another one is offered when it changes. */
export const basis = (work: Work) => JSON.stringify([work.kind, work.files, work.log, work.axes, work.trim, work.places]);

export function ConfigurePage() {
  const { work, state } = useShared();
  const kinds = useRequest(() => api.kinds(), []);
  const kind = kinds.value?.find((one) => one.kind === work.kind);
  const [proposing, setProposing] = useState(false);
  const [problem, setProblem] = useState<Problem | null>(null);
  const [choose, setChoose] = useState<Question[]>([]);

  const propose = async (log = work.log) => {
    if (!work.kind) return;
    setProposing(true);
    setProblem(null);
    setChoose([]);
    try {
      const made = await api.propose({
        kind: work.kind, files: work.files, log: { ...log, ...(work.axes ? { axes: work.axes } : {}) },
        ...(work.trim ? { from_s: work.trim[0], to_s: work.trim[1] } : {}), answers: {},
      });
      if (made.choose?.length) {
        setChoose(made.choose);
        setProposing(false);
        return;
      }
      let toml = made.toml;
      if (work.places) toml = await withPlaces(work.kind, toml, work.places);
      const { toml: _, ...proposal } = made;
      setWork({ log, toml, proposal, proposedFor: basis({ ...work, log }), name: work.name || freeName(work, state?.runs.map((r) => r.name) ?? []) });
    } catch (error) {
      setProblem(problemOf(error));
    }
    setProposing(false);
  };
  useEffect(() => { if (work.kind && work.files.length && !work.toml) void propose(); }, [work.kind]);

  if (!work.kind || !work.files.length) {
    return <Page title="Nothing to set up yet"><Empty><a href={work.files.length ? "#/choose" : "#/files"}>{work.files.length ? "Choose what to find out" : "Choose a file"}</a> first.</Empty></Page>;
  }
  return <Page title={kind?.title ?? "Set up"} lead={work.proposal?.from ? `This is ${work.proposal.from} of the folder. Correct what is wrong, and run it.`
    : `${work.proposal ? "This was proposed from your log. " : ""}Answer what is open, correct what is wrong, and run it.`}>
    {proposing && <Busy>Proposing a configuration from the log…</Busy>}
    <Trouble problem={problem} retry={() => void propose()} take={work.toml !== ""} />
    {problem && <p><a href="#/files">Choose other files</a>, <a href="#/look">look at how they are read</a>, or <a href="#/choose">find out something else</a>.</p>}
    <Trouble problem={kinds.problem} retry={kinds.again} />
    <Basis work={work} />
    {work.proposal?.from && !proposing && <p class="row"><button type="button" onClick={() => void propose()}>Propose one from the log instead</button> <span class="soft">What is written here is replaced.</span></p>}
    {choose.length > 0 && <Part title={`${plural(choose.length, "question")} about the files`}>
      {choose.map((q, i) => <Ask key={q.key} take={i === 0} of={q.file} question={q} onAnswer={(set) => {
        const log = { ...work.log, ...set };
        setWork({ log });
        void propose(log);
      }} />)}
    </Part>}
    {work.toml && work.proposedFor !== basis(work) && !proposing && <div class="notice warn" role="status">
      <p>How the log is read, or the part to use, was changed after this configuration was proposed.</p>
      <p class="row"><button type="button" onClick={() => void propose()}>Propose it anew</button> <span class="soft">What you wrote here is replaced.</span></p>
    </div>}
    {work.toml && !proposing && (work.proposal?.again?.length ?? 0) > 0 && <Part title="Is this right?">
      {work.proposal!.again!.map((q) => <Ask key={q.code} question={q} onAnswer={(set) => {
        const log = { ...work.log };
        for (const [key, value] of Object.entries(set)) if (value === null) delete log[key]; else log[key] = value;
        void propose(log);
      }} />)}
    </Part>}
    {work.toml && !proposing && <Editor schema={kind?.schema ?? []} flags={kind?.options ?? []} />}
  </Page>;
}

/** What the configuration is made from: nothing that was chosen before is in it unseen. */
function Basis({ work }: { work: Work }) {
  const read = saidOf(work);
  return <dl class="facts basis">
    <dt>Files</dt><dd>{work.files.join(", ")} <a href="#/files">Change</a></dd>
    {work.trim && <><dt>Part to use</dt><dd>{stamp(work.trim[0], work.trim[1] - work.trim[0])} to {stamp(work.trim[1], work.trim[1] - work.trim[0])} s <a href="#/look">Change</a></dd></>}
    {read.length > 0 && <><dt>Read with</dt><dd>{read.map((one) => one.words).join("; ")} <a href="#/look">Change</a></dd></>}
    {work.places && <><dt>Places</dt><dd>of the sensor{work.places.antenna.some((v) => v !== 0) ? " and the antenna" : ""}, as drawn <a href="#/look">Change</a></dd></>}
  </dl>;
}

async function withPlaces(kind: string, toml: string, places: NonNullable<Work["places"]>): Promise<string> {
  const { values } = await api.check({ kind, toml });
  const set: Record<string, unknown> = {};
  const round = (point: number[]) => point.map((v) => Math.round(v * 1000) / 1000);
  for (const key of Object.keys(values)) {
    if (/^aiding\.[^.]+\.kind$/.test(key) && values[key] === "gnss") {
      set[key.replace(/kind$/, "lever_arm_m")] = round(places.antenna.map((v, i) => v - places.sensor[i]!));
    }
    if (key === "units.0.position_m") set[key] = round(places.sensor);
  }
  return Object.keys(set).length ? (await api.check({ kind, toml, set })).toml : toml;
}

function freeName(work: Work, taken: string[]): string {
  const base = `${(work.files[0] ?? "run").replace(/\.[^.]*$/, "").replace(/[^A-Za-z0-9_-]+/g, "_").slice(0, 40)}-${work.kind}`;
  let name = base;
  for (let i = 2; taken.includes(name); i++) name = `${base}-${i}`;
  return name;
}

/** A flag that is a key of the configuration, too: there it stays with it. */
const SMOOTH = "--smooth";
/** Flags that a person may want, of those that the command takes. */
const FLAGS: Record<string, string> = {
  "--smooth": "Smooth: every instant by all measurements, the later ones too", "--no-report": "Without the report: numbers only",
  "--png": "Figures as PNG, too", "--timing": "Measure the times of the algorithms, too",
};

const NOTHING: Record<string, unknown> = {};

function Editor({ schema, flags }: { schema: Section[]; flags: string[] }) {
  const { work, state } = useShared();
  const [checked, setChecked] = useState<Checked | null>(null);
  const named = useRef("");
  const [checking, setChecking] = useState(true);
  const [problem, setProblem] = useState<Problem | null>(null);
  // What the run button answers, beside it.
  const [refused, setRefused] = useState<Problem | null>(null);
  const [starting, setStarting] = useState(false);
  const [force, setForce] = useState("");
  const serial = useRef(0);
  const kind = work.kind!;

  const check = async (toml: string, set?: Record<string, unknown>) => {
    const own = ++serial.current;
    setChecking(true);
    try {
      const answer = await api.check({ kind, toml, name: work.name, ...(set ? { set } : {}) });
      // An answer to what was written since replaced is old.
      if (own !== serial.current) return;
      setChecked(answer);
      named.current = work.name;
      setProblem(null);
      if (set) setWork({ toml: answer.toml });
    } catch (error) {
      if (own === serial.current && !aborted(error)) setProblem(problemOf(error));
    }
    if (own === serial.current) setChecking(false);
  };
  useEffect(() => {
    if (checked?.toml === work.toml && named.current === work.name) return;
    const timer = setTimeout(() => void check(work.toml), checked ? 350 : 0);
    return () => clearTimeout(timer);
  }, [work.toml, work.name]);
  const set = (change: Record<string, unknown>) => void check(work.toml, change);
  /** Take an answer to a question; one that cannot be is not taken, and it is said why. */
  const answer = async (change: Record<string, unknown>): Promise<string | void> => {
    try {
      const { errors } = await api.check({ kind, toml: work.toml, name: work.name, set: change });
      const wrong = errors.find((e) => e.code !== OPEN && Object.keys(change).some((key) => isOf(e, key)));
      if (wrong) return [wrong.text, wrong.remedy].filter(Boolean).map((text) => sentence(text!)).join(" ");
    } catch {
      // It is then said where the text is checked.
    }
    await check(work.toml, change);
  };

  const run = async () => {
    setRefused(null);
    if (reason) return setRefused({ code: "studio.not-ready", text: `It cannot run yet: ${reason}`, remedy: first || taken ? null : checked?.name?.remedy ?? "Write it above." });
    if (checking) return setRefused({ code: "studio.not-ready", text: "It cannot run yet: the configuration is being checked", remedy: "Press again in a moment." });
    setStarting(true);
    try {
      const job = await api.begin({ kind, name: work.name, toml: work.toml, options: [...work.options, ...(taken && force === work.name ? ["--force"] : [])] });
      putJob(job);
      location.hash = `#/job/${encodeURIComponent(job.id)}`;
    } catch (error) {
      setRefused(problemOf(error));
    }
    setStarting(false);
  };
  const values = checked?.values ?? {};
  const proposal = work.proposal;
  // An open value is a question, not a mistake.
  const errors = checked?.errors.filter((e) => e.code !== OPEN) ?? [];
  const questions = openQuestions(checked, proposal?.questions ?? []);
  const written = (q: Question) => Boolean(q.key) && Object.keys(values).some((key) => key === q.key || key.startsWith(`${q.key}.`));
  const assumed = (proposal?.to_check ?? []).filter(written), others = (proposal?.assumed ?? []).filter(written);
  const answered = (proposal?.questions ?? []).filter((q) => q.key && q.open !== undefined && q.open !== null && values[q.key] !== undefined && !isOpen(values[q.key]));
  const offers = (proposal?.offers ?? []).filter((q) => values[q.key!] === undefined || isOpen(values[q.key!]));
  /** What is assumed, to correct: a value, or those of a table in the form alone. */
  const confirm = (q: Question) => {
    const field = fieldOf(schema, q.key!), inside = Object.keys(values).filter((key) => key.startsWith(`${q.key}.`));
    const own = field?.label ?? words(q.key!.replace(/^.*\./, "")), owner = ownerOf(q.key!, values);
    const label = !owner || owner.startsWith(own) ? own : `${owner}: ${own}`;
    if (inside.length) return <div class="field" key={q.key}><b>{label}</b><p class="help">{sentence(q.text)} {inside.map((key) => `${words(key.slice(q.key!.length + 1))}: ${shown(values[key])}`).join("; ")}. Change it in the form.</p></div>;
    return <Control key={q.key} field={{ ...field, key: q.key!, label, unit: field?.unit ?? q.unit, type: field?.type ?? (Array.isArray(values[q.key!]) ? "list" : q.free ?? "text"), help: q.text }}
      value={values[q.key!]} fault={faultOf(errors, q.key!)} onChange={(value) => set({ [q.key!]: value })} />;
  };
  const taken = state?.runs.some((one) => one.name === work.name) ?? false;
  const reason = errors.length ? `${plural(errors.length, "error")} to correct first` : questions.length ? `${plural(questions.length, "question")} to answer first`
    : !work.name.trim() ? "the result needs a name" : checked?.name ? checked.name.text : taken && force !== work.name ? `there is a result named ${work.name}: tick to overwrite it, or write another name` : "";
  /** Where the first thing is that is to be done: its control, for the focus. */
  const first = errors.length ? ".toml .findings button, .toml textarea" : questions.length ? ".ask button, .ask input" : "";
  useEffect(() => setRefused(null), [work.toml, work.name, force, questions.length, errors.length]);
  return <>
    {proposal?.ready?.filter((one) => one.toml !== work.toml).map((one) => <div class="notice ready" key={one.name}>
      <p><b>{one.name}</b> in the folder is a configuration for these files{one.title ? <>: {sentence(one.title)}</> : "."} {one.what}</p>
      <p class="row"><button type="button" onClick={() => setWork({ toml: one.toml, proposal: { questions: [], findings: [], ready: proposal.ready!, from: one.name } })}>Use {one.name}</button> <span class="soft">Nothing is open in it. What is proposed here is replaced.</span></p>
    </div>)}
    <Questions questions={questions} values={values} onAnswer={answer} />
    {answered.length > 0 && <More title={`${plural(answered.length, "question")} answered`}><ul class="list">{answered.map((q) => <li class="item" key={q.key}>
      <span class="name">{sentence(q.text)}</span><span>{withUnit(values[q.key!], q.unit ?? "")}</span><button type="button" aria-label={`Ask again: ${q.text}`} onClick={() => set({ [q.key!]: q.open })}>Ask again</button>
    </li>)}</ul></More>}
    {offers.length > 0 && <Part title="Offered: add what is true">{offers.map((q) => <Ask key={q.key} question={q} onAnswer={set} />)}</Part>}
    {assumed.length + others.length > 0 && <Part title="Assumed: correct it if it is wrong">
      {assumed.length > 0 && <div class="fields wide">{assumed.map(confirm)}</div>}
      {others.length > 0 && <More open={!assumed.length} title={`${assumed.length ? "Further values" : plural(others.length, "value")} of which nothing was found`}><div class="fields wide">{others.map(confirm)}</div></More>}
    </Part>}
    {proposal && <Findings findings={proposal.findings.filter(isOpenly)} />}
    {proposal && (proposal.found?.length ?? 0) + proposal.findings.filter((one) => !isOpenly(one)).length > 0 && <More title="What was found while proposing it">
      <ul class="plain">{proposal.found?.map((text) => <li key={text}>{sentence(text)}</li>)}</ul>
      <Findings findings={proposal.findings.filter((one) => !isOpenly(one))} />
    </More>}
    {proposal?.others?.map((other) => <div class="notice" key={other.name}><p>The record holds another vehicle: {other.name}.</p>
      <button type="button" onClick={() => setWork({ toml: other.toml, name: `${work.name}-${other.name}`.replace(/[^A-Za-z0-9_-]+/g, "_") })}>Use its case instead</button></div>)}
    <Trouble problem={problem} />
    <div class="sidebyside">
      <section aria-label="The configuration as a form" class="formside">
        <h2>As a form</h2>
        <Form schema={schema} values={values} errors={errors} onSet={set} />
      </section>
      <section aria-label="The configuration as text" class="textside">
        <div class="parthead"><h2>As text</h2><span class="soft" role="status">{checking ? "checking…" : errors.length ? plural(errors.length, "error") : "in step with the form"}</span><Copy text={work.toml} /></div>
        <TomlText toml={work.toml} errors={errors} onChange={(toml) => setWork({ toml })} />
      </section>
    </div>
    <Positions values={values} onSet={set} />
    {kind === "crash" && <CrashPreview toml={work.toml} values={values} was={checked?.was ?? NOTHING} ready={!checking && errors.length === 0 && questions.length === 0} wrong={errors.length + questions.length > 0} onKeep={set} />}
    {flags.some((flag) => flag in FLAGS) && <fieldset class="row flags"><legend>Options</legend>
      {flags.filter((flag) => flag in FLAGS).map((flag) => <label class="inline" key={flag}><input type="checkbox" checked={flag === SMOOTH ? values["smoother.kind"] === "rts" : work.options.includes(flag)}
        onChange={(e) => flag === SMOOTH ? set({ "smoother.kind": e.currentTarget.checked ? "rts" : "none" }) : setWork({ options: e.currentTarget.checked ? [...work.options, flag] : work.options.filter((o) => o !== flag) })} />{FLAGS[flag]}</label>)}
    </fieldset>}
    <div class="next startrun">
      <label class="inline">Name of the result <input type="text" value={work.name} onInput={(e) => setWork({ name: e.currentTarget.value })} aria-invalid={Boolean(checked?.name)} aria-describedby="taken reason" /></label>
      {taken && <label class="inline" id="taken"><input type="checkbox" checked={force === work.name} onChange={(e) => setForce(e.currentTarget.checked ? work.name : "")} /> Overwrite the result of this name</label>}
      <button type="button" class={reason ? "main notready" : "main"} disabled={starting} aria-describedby="reason" onClick={() => void run()}>Run it</button>
      <span id="reason" class={(taken || checked?.name) && reason ? "fault" : "soft"}>{starting ? "Starting…" : reason && sentence(reason)}</span>
    </div>
    <Trouble problem={refused} take />
    {refused && first && <p class="row"><button type="button" onClick={() => { const to = document.querySelector<HTMLElement>(first); to?.scrollIntoView({ block: "center" }); to?.focus(); }}>Go to the first</button></p>}
  </>;
}

const isOpen = (value: unknown) => value === "?" || (Array.isArray(value) && value.includes("?"));

const OPEN = "config.open-value";

/** What a proposal says without a click: warnings, and that a reference of the files is left unused. */
const isOpenly = (one: Finding) => one.severity !== "note" || one.code === "studio.reference-not-used";

/** What still has a "?": asked in the words of the proposal, and what it is for in those of the check. */
function openQuestions(checked: Checked | null, asked: Question[]): Question[] {
  if (!checked) return asked;
  const faults = checked.errors.filter((e) => e.code === OPEN);
  return Object.keys(checked.values).filter((key) => isOpen(checked.values[key])).map((key, i) => {
    const said = asked.find((q) => q.key === key), fault = faults.find((e) => e.path === key) ?? faults[i];
    // Two recorders are asked the same: by whose name.
    const name = checked.values[`${key.split(".").slice(0, 2).join(".")}.name`];
    const text = said?.text ?? fault?.text ?? key;
    return {
      code: OPEN, choices: [], free: "number", unit: null, ...said, key, text: typeof name === "string" && name && !text.includes(name) ? `${name}: ${text}` : text,
      line: fault?.line ?? undefined, remedy: [said && fault?.text ? sentence(fault.text) : "", PLACE.test(key) ? "Or drag its dot, an empty circle until then, on the drawing of the vehicle below." : ""].filter(Boolean).join(" ") || null,
    };
  });
}

function Questions({ questions, values, onAnswer }: { questions: Question[]; values: Record<string, unknown>; onAnswer: (set: Record<string, unknown>) => Promise<string | void> }) {
  if (!questions.length) return null;
  return <Part title={`${plural(questions.length, "question")} only you can answer`}>
    {questions.map((q) => {
      const value = q.key === null ? null : values[q.key];
      // Of a list, such as [0, 0, "?"], what is open is asked alone.
      const open = Array.isArray(value) ? value.filter((one) => one === "?").length : 1;
      const fill = (set: Record<string, unknown>) => open === 1 && Array.isArray(value)
        ? Object.fromEntries(Object.entries(set).map(([key, answer]) => [key, key === q.key ? value.map((one) => one === "?" ? answer : one) : answer])) : set;
      return <Ask key={q.key} question={{ ...q, count: open }} list={open > 1} onAnswer={(set) => onAnswer(fill(set))} />;
    })}
  </Part>;
}

/** What a key is of: a recorder by its name and which of its accelerometers, an aid, or a table. */
function ownerOf(key: string, values: Record<string, unknown>): string {
  const [, unit, inner, number] = /^(units\.\d+)\.(?:(accelerometers|gyro)\.(?:(\d+)\.)?)?/.exec(key) ?? [];
  if (!unit) return /^aiding\.([^.]+)\./.exec(key)?.[1] ?? words(key.slice(0, Math.max(0, key.indexOf("."))));
  return [String(values[`${unit}.name`] ?? words(unit)), inner && `${inner === "gyro" ? inner : "accelerometers"}${number ? ` ${Number(number) + 1}` : ""}`].filter(Boolean).join(", ");
}

/** The field of the form that a full name belongs to. */
const fieldOf = (schema: Section[], key: string) => schema.flatMap((s) => s.fields).find((f) => pattern(f.key).test(key));

/** Whether a fault is of a key, or of what is in it. */
function isOf(fault: Fault, key: string): boolean {
  const at = fault.path ?? fault.key?.replaceAll(", ", ".") ?? "";
  return at === key || at.startsWith(`${key}.`);
}

const faultOf = (errors: Fault[], key: string) => errors.find((e) => isOf(e, key))?.text;

const escape = (text: string) => text.replace(/[.+?^${}()|[\]\\]/g, "\\$&");
const pattern = (key: string) => new RegExp(`^${escape(key).replaceAll("*", "([^.]+)")}$`);

interface Shown { at: string; title: string; help: string | null; set: Field[]; others: Field[] }

/** The sections of the form, one for each table that the configuration has. */
export function sectionsOf(schema: Section[], values: Record<string, unknown>): Shown[] {
  const keys = Object.keys(values);
  const seen = new Set<string>();
  const shown: Shown[] = [];
  for (const section of schema) {
    const stars = (section.key?.match(/\*/g) ?? []).length;
    for (const names of stars === 0 ? [[]] : instancesOf(section, keys, stars)) {
      const fill = (text: string) => names.reduce((rest, name) => rest.replace("*", name), text);
      const fields = section.fields.map((f) => ({ ...f, key: fill(f.key) })).filter((f) => !f.key.includes("*"));
      fields.forEach((f) => seen.add(f.key));
      const at = fill(section.key ?? "");
      shown.push({ at, title: titleOf(section, names, values), help: section.help ?? null, set: fields.filter((f) => f.key in values), others: fields.filter((f) => !(f.key in values)) });
    }
  }
  // A key without a field of its own, such as a speed in another unit: with the table that it is in.
  for (const key of keys.filter((one) => !seen.has(one))) {
    const home = shown.filter((s) => s.at !== "" && key.startsWith(`${s.at}.`)).sort((a, b) => b.at.length - a.at.length)[0] ?? shown.find((s) => s.at === "");
    const value = values[key];
    const field: Field = { key, label: words(home?.at ? key.slice(home.at.length + 1) : key), unit: null, type: typeof value === "number" ? "number" : typeof value === "boolean" ? "flag" : Array.isArray(value) ? "list" : "text" };
    if (home) home.set.push(field); else shown.push({ at: "", title: "General", help: null, set: [field], others: [] });
  }
  return shown.filter((s) => s.set.length || s.others.length).sort((a, b) => Number(b.set.length > 0) - Number(a.set.length > 0));
}

const words = (key: string) => key.replaceAll(".", ": ").replaceAll("_", " ").replace(/^./, (c) => c.toUpperCase());

/** "Units 1 (LEFT REAR SEAT)", "Aiding gnss: Update rule": the table, which one, and what of it. */
function titleOf(section: Section, names: string[], values: Record<string, unknown>): string {
  const own = section.title || section.key || "General";
  if (!names.length) return section.key?.includes(".") ? `${words(section.key.split(".")[0]!)}: ${own}` : own;
  const table = section.key!.split(".")[0]!;
  const name = values[`${table}.${names[0]}.name`];
  const which = /^\d+$/.test(names[0]!) ? `${Number(names[0]) + 1}${typeof name === "string" && name ? ` (${name})` : ""}` : names[0]!;
  const inner = section.key!.split(".").length > 2 ? `: ${own}${names.length > 1 ? ` ${Number(names[1]) + 1}` : ""}` : "";
  return `${words(table)} ${which}${inner}`;
}

/** Names and numbers that the values put in place of the stars of a section. */
function instancesOf(section: Section, keys: string[], stars: number): string[][] {
  const table = new RegExp(`^${escape(section.key!).replaceAll("*", "([^.]+)")}\\.`);
  const found = new Map<string, string[]>();
  for (const key of keys) {
    const match = table.exec(key);
    if (match) found.set(match.slice(1, stars + 1).join("\n"), match.slice(1, stars + 1));
  }
  return [...found.values()];
}

function Form({ schema, values, errors, onSet }: { schema: Section[]; values: Record<string, unknown>; errors: Fault[]; onSet: (set: Record<string, unknown>) => void }) {
  const [wanted, setWanted] = useState("");
  const shown = useMemo(() => sectionsOf(schema, values), [schema, values]);
  const fits = (f: Field) => !wanted || `${f.key} ${f.label} ${f.help ?? ""}`.toLowerCase().includes(wanted.toLowerCase());
  const fault = (key: string) => faultOf(errors, key);
  const control = (f: Field) => <Control key={f.key} field={f} value={values[f.key]} fault={fault(f.key)} onChange={(value) => onSet({ [f.key]: value })} />;
  const used = shown.filter((s) => wanted || s.set.length), unused = shown.filter((s) => !wanted && !s.set.length);
  return <>
    <input type="search" class="wide" aria-label="Find a setting" placeholder="Find a setting" value={wanted} onInput={(e) => setWanted(e.currentTarget.value)} />
    {used.map((section) => {
      const set = section.set.filter(fits), others = section.others.filter(fits);
      if (!set.length && !(wanted ? others.length : section.others.length)) return null;
      const wrong = section.set.some((f) => fault(f.key));
      return <More key={section.title} open={wanted !== "" || wrong} title={<>{section.title} <span class="soft">{set.length ? `${set.length} set` : "as by default"}</span></>}>
        {section.help && <p class="help">{section.help}</p>}
        <div class="fields">{set.map(control)}</div>
        {others.length > 0 && (wanted ? <div class="fields">{others.map(control)}</div>
          : <More title={plural(others.length, "setting that is not set", "settings that are not set")}><div class="fields">{others.map(control)}</div></More>)}
      </More>;
    })}
    {unused.length > 0 && <More title={<>Tables that are not there <span class="soft">{plural(unused.length, "table")}, as by default</span></>}>
      {unused.map((section) => <More key={section.title} title={section.title}>
        {section.help && <p class="help">{section.help}</p>}<div class="fields">{section.others.map(control)}</div>
      </More>)}
    </More>}
    {!shown.length && <Empty>The form appears as soon as the text can be read.</Empty>}
  </>;
}

function TomlText({ toml, errors, onChange }: { toml: string; errors: Fault[]; onChange: (toml: string) => void }) {
  const area = useRef<HTMLTextAreaElement>(null);
  const gutter = useRef<HTMLDivElement>(null);
  const lines = useMemo(() => toml.split("\n"), [toml]);
  const wrong = new Set(errors.map((e) => e.line));
  const show = (line: number) => {
    const own = area.current;
    if (!own) return;
    const from = lines.slice(0, line - 1).reduce((sum, text) => sum + text.length + 1, 0);
    own.focus();
    own.setSelectionRange(from, from + (lines[line - 1]?.length ?? 0));
    own.scrollTop = Math.max(0, (line - 6) * 20);
  };
  return <div class="toml">
    <div class="tomlbox">
      <div class="gutter" ref={gutter} aria-hidden="true">{lines.map((_, i) => <span class={wrong.has(i + 1) ? "wrong" : ""} key={i}>{i + 1}</span>)}</div>
      <textarea ref={area} aria-label="The configuration in TOML" spellcheck={false} autocomplete="off" autocapitalize="off" wrap="off" value={toml} aria-invalid={errors.length > 0} aria-describedby="tomlerrors"
        onInput={(e) => onChange(e.currentTarget.value)} onScroll={(e) => { if (gutter.current) gutter.current.scrollTop = e.currentTarget.scrollTop; }} />
    </div>
    <ul class="findings" id="tomlerrors" aria-live="polite">
      {errors.map((e) => <li class="bad" key={`${e.line} ${e.key} ${e.text}`}>
        {e.line ? <button type="button" onClick={() => show(e.line!)}>Line {e.line}</button> : <span class="tag">Error</span>}
        <div><p>{e.key && <code>{e.key}</code>} {sentence(e.text)}</p>{e.remedy && <p class="remedy">What to do: {e.remedy}</p>}</div>
      </li>)}
    </ul>
  </div>;
}

const PLACE = /(^|\.)(position_m|lever_arm_m|antenna_m)$/;

/** Every position of the configuration, on a drawing of the vehicle. */
function Positions({ values, onSet }: { values: Record<string, unknown>; onSet: (set: Record<string, unknown>) => void }) {
  const dots = Object.entries(values).filter(([key, value]) => PLACE.test(key) && Array.isArray(value) && value.length === 3 && !key.startsWith("site"))
    .map(([key, value]) => ({ key, label: placeName(key, values), value: (value as unknown[]).every((v) => typeof v === "number") ? value as Point : null }));
  const [moved, setMoved] = useState<{ key: string; value: Point } | null>(null);
  useEffect(() => {
    if (!moved) return;
    // A drag is written when the hand rests.
    const timer = setTimeout(() => { onSet({ [moved.key]: moved.value }); setMoved(null); }, 400);
    return () => clearTimeout(timer);
  }, [moved]);
  if (!dots.length) return null;
  const size = (key: string) => typeof values[key] === "number" ? values[key] as number : undefined;
  return <Part title="Positions on the vehicle">
    <p class="soft">{dots.map((d) => `${d.label}: ${d.value ? d.value.map((v) => number(v, 3)).join(", ") + " m" : "not yet stated"}`).join(" · ")}</p>
    <Vehicle dots={dots.map((d) => d.key === moved?.key ? { ...d, value: moved.value } : d)} length={size("vehicle.length_m")} width={size("vehicle.width_m")}
      onMove={(key, value) => setMoved({ key, value })} />
  </Part>;
}

function placeName(key: string, values: Record<string, unknown>): string {
  const parent = key.replace(/\.[^.]+$/, "");
  if (key === "point.position_m") return String(values["point.name"] || "Reference point");
  if (key.endsWith("antenna_m") || values[`${parent}.kind`] === "gnss") return "Antenna";
  const name = values[`${parent}.name`];
  return typeof name === "string" && name ? name : parent.replace(/\.\d+/g, (n) => ` ${Number(n.slice(1)) + 1}`).replace(/^aiding\./, "");
}
