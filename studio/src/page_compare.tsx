// Compare: two or more results of the folder, and what differs between them.

import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";
import { api, problemOf } from "./api";
import { date, shown } from "./format";
import { useShared } from "./store";
import type { Problem } from "./types";
import { Busy, Empty, Findings, More, Page, Part, Table, Trouble } from "./ui";

export function ComparePage({ chosen: first }: { chosen: string[] }) {
  const { state } = useShared();
  const runs = state?.runs ?? [];
  const [chosen, setChosen] = useState<string[]>(first.filter((name) => runs.some((run) => run.name === name)));
  const [found, setFound] = useState<Record<string, unknown> | null>(null);
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

const PARTS: [string, string][] = [
  ["numbers", "Numbers"], ["options", "Options"], ["inputs", "Inputs"], ["tracks", "Tracks"], ["findings", "Findings"], ["times", "Computing times"],
];

/** The parts of the comparison that people ask for, in order; the rest below. */
function Found({ found }: { found: Record<string, unknown> }) {
  const known = new Set([...PARTS.map(([key]) => key), "page", "runs"]);
  const rest = Object.entries(found).filter(([key]) => !known.has(key));
  return <>
    {Array.isArray(found["runs"]) && <Part title="The results"><Anything value={found["runs"]} /></Part>}
    {PARTS.filter(([key]) => key in found).map(([key, title]) => <Part title={title} key={key}>
      <Anything value={found[key]} />
    </Part>)}
    {rest.length > 0 && <More title="More">{rest.map(([key, value]) => <div key={key}><h3>{words(key)}</h3><Anything value={value} /></div>)}</More>}
    {typeof found["page"] === "string" && <Part title="The page"><iframe class="report" title="The comparison as a page" sandbox="allow-scripts" referrerpolicy="no-referrer" src={found["page"]} /></Part>}
  </>;
}

const words = (key: string) => (key.charAt(0).toUpperCase() + key.slice(1)).replaceAll("_", " ");

/** A value of the comparison as a table where it is rows, as facts where it is an object. */
function Anything({ value }: { value: unknown }): ComponentChildren {
  if (Array.isArray(value)) {
    if (!value.length) return <Empty>No difference.</Empty>;
    if (value.every((one) => one && typeof one === "object" && "severity" in one && "code" in one)) return <Findings findings={value} />;
    if (value.every((one) => one && typeof one === "object" && !Array.isArray(one))) {
      const head = [...new Set(value.flatMap((one) => Object.keys(one as object)))];
      return <Table head={head.map(words)} numeric={head.map((_, i) => i).filter((i) => value.every((one) => typeof (one as Record<string, unknown>)[head[i]!] === "number"))}
        rows={value.map((one) => head.map((key) => shown((one as Record<string, unknown>)[key])))} />;
    }
    return <p>{shown(value)}</p>;
  }
  if (value && typeof value === "object") {
    const entries = Object.entries(value);
    if (!entries.length) return <Empty>No difference.</Empty>;
    return <dl class="facts">{entries.map(([key, one]) => <><dt key={key}>{words(key)}</dt><dd>{one && typeof one === "object" && !(Array.isArray(one) && one.every((v) => typeof v !== "object")) ? <Anything value={one} /> : shown(one)}</dd></>)}</dl>;
  }
  return <p>{shown(value)}</p>;
}
