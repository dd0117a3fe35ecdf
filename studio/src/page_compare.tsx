// Compare: two or more results of the folder, and what differs between them.

import { useState } from "preact/hooks";
import { api, problemOf } from "./api";
import { date, number, plural, shown } from "./format";
import { useShared } from "./store";
import type { Comparison, Problem } from "./types";
import { Busy, Empty, Findings, More, Page, Part, Table, Trouble } from "./ui";

export function ComparePage({ chosen: first }: { chosen: string[] }) {
  const { state } = useShared();
  const runs = state?.runs ?? [];
  const [chosen, setChosen] = useState<string[]>(first.filter((name) => runs.some((run) => run.name === name)));
  const [found, setFound] = useState<Comparison | null>(null);
  const [problem, setProblem] = useState<Problem | null>(null);
  const [busy, setBusy] = useState(false);
  const compare = async () => {
    setBusy(true);
    setProblem(null);
    try {
      setFound(await api.compare(chosen));
    } catch (error) {
      setProblem(problemOf(error));
    }
    setBusy(false);
  };
  const toggle = (name: string) => { setFound(null); setChosen(chosen.includes(name) ? chosen.filter((n) => n !== name) : [...chosen, name]); };
  return <Page title="Compare results" lead="What differs in options, inputs and numbers. The first that you choose is what the others are held against.">
    {runs.length < 2 ? <Empty>{runs.length ? "There is one result only; compare it with a second one." : "There is no result yet."} <a href="#/files">To files and results</a></Empty> : <>
      <fieldset class="list"><legend>Choose two or more</legend>
        {runs.map((run) => <label key={run.name} class="item">
          <input type="checkbox" checked={chosen.includes(run.name)} onChange={() => toggle(run.name)} />
          <span class="name">{run.title || run.name}</span><span class="soft">{run.name}</span><span class="soft">{run.command}</span><span class="soft when">{date(run.made)}</span>
        </label>)}
      </fieldset>
      <div class="next"><button type="button" class="main" disabled={chosen.length < 2 || busy} onClick={() => void compare()}>Compare {chosen.length >= 2 ? chosen.length : "them"}</button></div>
    </>}
    {busy && <Busy>Comparing…</Busy>}
    <Trouble problem={problem} />
    {found && <Found found={found} />}
  </Page>;
}

/** Values in a row, marked where they differ; the first run is what the others are held against. */
function Found({ found }: { found: Comparison }) {
  const names = found.runs.map((run) => run.name);
  const [all, setAll] = useState(false);
  const numbers = found.numbers.filter((row) => all || !row.same);
  const findings = found.findings_of_runs.filter((one) => one.differs);
  const inputs = found.inputs.filter((row) => !row.same);
  const others = names.slice(1);
  return <>
    <p class="lead" role="status">{found.summary}</p>
    <Findings findings={found.findings} />
    <Part title="Options">
      {found.options.length ? <Table head={["Option", ...names]} rows={found.options.map((row) => [<code>{row.key}</code>, ...row.values.map(shown)])} /> : <Empty>No option differs.</Empty>}
      <p class="soft">{plural(found.equal_options, "option is", "options are")} the same.</p>
    </Part>
    <Part title="Inputs">
      {inputs.length ? <Table head={["Role", ...names]} rows={inputs.map((row) => [row.role, ...row.files.map((file, i) => file ? `${file.name} (${row.status[i] ?? ""})` : "none")])} /> : <Empty>All inputs are the same, to the byte.</Empty>}
      {found.conditions.some((c) => new Set(c.values).size > 1) && <Table head={["Software", ...names]} rows={found.conditions.filter((c) => new Set(c.values).size > 1).map((c) => [c.name, ...c.values.map(shown)])} />}
    </Part>
    <Part title="Numbers" aside={<label class="inline"><input type="checkbox" checked={all} onChange={(e) => setAll(e.currentTarget.checked)} />Those that are the same, too</label>}>
      {!numbers.length && <Empty>No number differs.</Empty>}
      {[...new Set(numbers.map((row) => row.group))].map((group) => <More key={group} title={group} open={!DETAILS.test(group)}>
        <Table head={["Quantity", ...names, ...others.map((name) => `Difference of ${name}`), "Unit"]} numeric={[...names, ...others].map((_, i) => i + 1)}
          rows={numbers.filter((row) => row.group === group).map((row) => [row.quantity,
            ...row.values.map((value, i) => `${value === null ? "" : typeof value === "number" && row.unit === "deg" && row.difference_unit === "m" ? value.toFixed(7) : shown(value)}${bound(row.below_95[i], row.above_95[i], row.difference_unit === row.unit ? "" : row.difference_unit)}` || "–"),
            ...others.map((_, i) => difference(row, i + 1)), row.unit ?? ""])} />
      </More>)}
    </Part>
    {findings.length > 0 && <Part title="Findings that differ">
      <Table head={["Finding", ...names.map((name) => `In ${name}`)]} numeric={names.map((_, i) => i + 1)} rows={findings.map((one) => [one.sentence, ...one.counts.map(String)])} />
    </Part>}
    {found.page && <Part title="The page" aside={<a href={found.page} target="_blank" rel="noopener noreferrer">Open in a tab of its own</a>}>
      <iframe class="report" title="The comparison as a page" sandbox="allow-scripts" referrerpolicy="no-referrer" src={found.page} /></Part>}
  </>;
}

/** What few people ask for: folded at first. */
const DETAILS = /^(Estimated|Measurements|Shares|Errors by|Coarse)/;

function difference(row: Comparison["numbers"][number], i: number): string {
  const value = row.differences[i];
  if (value === null || value === undefined) return "–";
  return `${shown(value)}${row.difference_unit !== row.unit ? ` ${row.difference_unit}` : ""}${row.within[i] === false ? " (beyond both bounds)" : ""}`;
}

function bound(below: number | null | undefined, above: number | null | undefined, unit: string | null): string {
  if (below === null || below === undefined || above === null || above === undefined) return "";
  return (below === above ? ` ± ${number(below, 2)}` : ` −${number(below, 2)}/+${number(above, 2)}`) + (unit ? ` ${unit}` : "");
}
