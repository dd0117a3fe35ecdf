// Compare: two or more results of the folder, and what differs between them.

import { useState } from "preact/hooks";
import { api, problemOf } from "./api";
import { date, plural, shown } from "./format";
import { useShared } from "./store";
import type { Comparison, Problem } from "./types";
import { Busy, Command, Empty, Findings, More, Options, Page, Part, Table, Trouble, written } from "./ui";

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

type Row = Comparison["numbers"][number];

/** Options that are shown before the rest is folded. */
const FEW = 8;

/** What differs first: numbers with bounds, then options; what is the same is folded. */
function Found({ found }: { found: Comparison }) {
  const names = found.runs.map((run) => run.name), others = names.slice(1);
  const differ = found.numbers.filter((row) => !row.same && !row.finer), finer = found.numbers.filter((row) => row.finer);
  const main = differ.filter((row) => row.shown.bounds.some(Boolean) && !row.detail);
  const rest = differ.filter((row) => !main.includes(row)), same = found.numbers.filter((row) => row.same);
  const findings = found.findings_of_runs.filter((one) => one.differs);
  const inputs = found.inputs.filter((row) => !row.same);
  // Runs of one log share what is wrong with it.
  const logs = found.inputs.filter((row) => ["log", "record"].includes(row.role.split(": ").pop()!));
  const ofOneLog = others.filter((_, i) => logs.some((row) => ["same", "renamed"].includes(row.status[i + 1] ?? "")));
  const options = (some: Comparison["options"]) => <Table stack head={["Option", ...names]} rows={some.map((row) => [<code>{row.key}</code>, ...row.values.map((one) => one === null ? "none" : written(one))])} />;
  const numbers = (some: Row[]) => [...new Set(some.map((row) => row.group))].map((group) => <Table stack key={group} caption={group || "Result"}
    head={["Quantity", ...names, ...others.map((name) => others.length > 1 ? `Difference of ${name}` : "Difference")]} numeric={[...names, ...others].map((_, i) => i + 1)}
    rows={some.filter((row) => row.group === group).map((row) => [
      row.shown.unit ? <>{row.quantity}, <span class="bare">{row.shown.unit}</span></> : row.quantity,
      ...row.shown.values.map((value, i) => [value, row.shown.bounds[i], row.shown.bounds[i] && row.shown.bound_unit !== row.shown.unit ? row.shown.bound_unit : ""].filter(Boolean).join("\u00a0")),
      ...others.map((_, i) => <Difference row={row} i={i + 1} />),
    ])} />);
  return <>
    <p class="lead" role="status">{found.summary}</p>
    <Findings findings={found.findings} />
    <Part title="Numbers that differ">
      {!differ.length && <Empty>No number differs{finer.length ? " by as much as is shown" : ""}.</Empty>}
      {main.length > 0 && <p class="help">With 95 % bounds. A difference is a result minus {names[0]}. {boundWords(ofOneLog, others)}</p>}
      {numbers(main)}
      {rest.length > 0 && <More title={main.length ? plural(rest.length, "further number", "further numbers") : plural(rest.length, "number")} open={!main.length}>{numbers(rest)}</More>}
      {finer.length > 0 && <More title={`${plural(finer.length, "number")} that ${finer.length === 1 ? "differs" : "differ"} by less than is shown`}>{numbers(finer)}</More>}
      {same.length > 0 && <More title={`${plural(same.length, "number")} that ${same.length === 1 ? "is" : "are"} the same`}>{numbers(same)}</More>}
    </Part>
    <Part title="Options that differ">
      {found.options.length ? options(found.options.slice(0, FEW)) : <Empty>No option differs.</Empty>}
      {found.options.length > FEW && <More title={plural(found.options.length - FEW, "further option")}>{options(found.options.slice(FEW))}</More>}
      {found.equal_options > 0 && <More title={plural(found.equal_options, "option is the same", "options are the same")}><Options options={found.same_options} folded /></More>}
    </Part>
    <Part title="Inputs">
      {inputs.length ? <Table stack head={["Used as", ...names]} rows={inputs.map((row) => [row.role, ...row.files.map((file, i) => file ? `${file.name} (${STATUS[row.status[i] ?? ""] ?? row.status[i] ?? ""})` : "none")])} /> : <Empty>All inputs are the same, to the byte.</Empty>}
      {found.conditions.some((c) => new Set(c.values).size > 1) && <Table stack head={["Software", ...names]} rows={found.conditions.filter((c) => new Set(c.values).size > 1).map((c) => [c.name, ...c.values.map(shown)])} />}
    </Part>
    {findings.length > 0 && <Part title="Findings that differ">
      <Table stack head={["Finding", ...names.map((name) => `In ${name}`)]} numeric={names.map((_, i) => i + 1)} rows={findings.map((one) => [one.sentence, ...one.counts.map((n) => n === 0 ? "no" : n === 1 ? "yes" : `${n} times`)])} />
    </Part>}
    {found.page && <Part title="The page" aside={<a href={found.page} target="_blank" rel="noopener noreferrer">Open in a tab of its own</a>}>
      <iframe class="report" title="The comparison as a page" sandbox="allow-scripts" referrerpolicy="no-referrer" src={found.page} /></Part>}
    {found.command_line && <Part title="The same from a terminal"><Command text={found.command_line} /></Part>}
  </>;
}

/** What the bound of a difference says; `ofOneLog`: results that are of the log of the first. */
function boundWords(ofOneLog: string[], others: string[]): string {
  const independent = "Its bound is that of two independent errors.";
  if (!ofOneLog.length) return independent;
  const which = ofOneLog.length < others.length ? `${independent} ${ofOneLog.join(" and ")} and the first are of one log` : "The results are of one log";
  return `${which}: they share its errors, so a bound as of independent errors is too wide. A difference beyond it says that one of the two bounds does not hold; one within it confirms neither.`;
}

/** How a file stands to that of the first result. */
const STATUS: Record<string, string> = { first: "as the first has it", same: "the same", renamed: "the same under another name", changed: "another content", missing: "not there" };

/** A difference with its bound, marked where it is beyond. */
function Difference({ row, i }: { row: Row; i: number }) {
  const { differences, combined, unit, bound_unit } = row.shown;
  if (!differences[i]) return <>–</>;
  return <>{differences[i]}{differences[i] !== "same" && <> {combined[i]} {bound_unit !== unit && bound_unit}</>}{row.within[i] === false && <span class="apart"> beyond its bound</span>}</>;
}
