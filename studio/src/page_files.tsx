// Start: bring files, see what is in the folder, go on with an earlier result.

import { Fragment } from "preact";
import { useRef, useState } from "preact/hooks";
import { api, problemOf, ServerError } from "./api";
import { bytes, date, plural } from "./format";
import { basis } from "./page_configure";
import { newWork, now, refresh, setWork, useShared } from "./store";
import type { Problem, Sample } from "./types";
import { Empty, More, Page, Part, Trouble } from "./ui";

interface Sending { name: string; share: number; problem: Problem | null; taken: boolean; file: File }

const placeOf = (name: string) => name.slice(0, name.lastIndexOf("/") + 1);

export function FilesPage() {
  const { state, work } = useShared();
  const [chosen, setChosen] = useState<string[]>(work.files);
  const [left, setLeft] = useState<string[]>([]);
  const [sending, setSending] = useState<Sending[]>([]);
  const [over, setOver] = useState(false);
  const [problem, setProblem] = useState<Problem | null>(null);
  const input = useRef<HTMLInputElement>(null);
  // Under the same name there is something else now.
  const replaced = useRef(false);
  const files = (state?.files ?? []).filter((file) => file.recording !== false);
  const here = chosen.filter((name) => files.some((file) => file.name === name || file.inside?.includes(name)));

  const put = (name: string, part: Partial<Sending>) =>
    setSending((all) => all.map((one) => one.name === name ? { ...one, ...part } : one));
  const choose = (name: string) => setChosen((names) => names.includes(name) ? names : [...names, name]);
  const upload = async (file: File, replace: boolean) => {
    put(file.name, { problem: null, taken: false, share: 0 });
    try {
      // The server says under which name it is kept.
      const { name } = await api.upload(file, replace, (share) => put(file.name, { share }));
      setSending((all) => all.filter((one) => one.name !== file.name));
      choose(name);
      replaced.current ||= replace;
    } catch (error) {
      put(file.name, { problem: problemOf(error), taken: error instanceof ServerError && error.status === 409 });
    }
  };
  const bring = async (list: FileList | null) => {
    const brought = [...(list ?? [])];
    if (!brought.length) return;
    // What is brought is what is meant: what was chosen for something else is not.
    setChosen([]);
    setSending((all) => [...all.filter((one) => !brought.some((file) => file.name === one.name)),
      ...brought.map((file) => ({ name: file.name, share: 0, problem: null, taken: false, file }))]);
    // One after the other: the disk is the bottleneck, and each progress means something.
    for (const file of brought) await upload(file, false);
    await refresh();
  };
  const sample = async (one: Sample) => {
    setProblem(null);
    try {
      const { files: names } = await api.sample(one);
      await refresh();
      setChosen(names);
    } catch (error) {
      setProblem(problemOf(error));
    }
  };
  /** Set up the case of a simulated crash; its records are in the folder of the case. */
  const runCase = async (name: string) => {
    setProblem(null);
    try {
      const toml = await api.caseOf(name);
      const { values } = await api.check({ kind: "crash", toml });
      const set: Record<string, unknown> = {};
      for (const [key, value] of Object.entries(values)) {
        if (/(^|\.)path$/.test(key) && typeof value === "string") set[key] = `${name}/${value}`;
      }
      newWork([...new Set(Object.values(set).map(String))]);
      setWork({ kind: "crash", toml: (await api.check({ kind: "crash", toml, set })).toml, name: `${name}-crash` });
      setWork({ proposedFor: basis(now().work), proposal: { questions: [], findings: [], from: `${name}/case.toml` } });
      location.hash = "#/configure";
    } catch (error) {
      setProblem(problemOf(error));
    }
  };
  const leave = (one: Sending) => setSending((all) => all.filter((s) => s.name !== one.name));
  /** Of one recording are files of one folder; a folder is one itself. What else was chosen stays one click away. */
  const toggle = (name: string) => {
    if (here.includes(name)) return setChosen(here.filter((n) => n !== name));
    const place = placeOf(name), folder = files.some((file) => file.folder && file.name === name);
    const kept = folder ? [] : here.filter((n) => placeOf(n) === place && !files.some((file) => file.folder && file.name === n));
    setLeft(here.filter((n) => !kept.includes(n)));
    setChosen([...kept, name]);
  };
  const go = () => {
    if (replaced.current || here.join("\n") !== work.files.join("\n")) newWork(here);
    location.hash = "#/look";
  };

  return <Page title="What did you record?" lead="Bring the log of an inertial sensor, with satellite fixes or a crash record if you have them. Nothing leaves this computer.">
    <div class={`drop${over ? " over" : ""}`} onDragOver={(e) => { e.preventDefault(); setOver(true); }} onDragLeave={() => setOver(false)}
      onDrop={(e) => { e.preventDefault(); setOver(false); void bring(e.dataTransfer?.files ?? null); }}>
      <p><b>Drop files here</b>, or</p>
      <button type="button" class="main" onClick={() => input.current?.click()}>Choose files…</button>
      <input ref={input} type="file" multiple class="hidden" tabIndex={-1} aria-label="Files to bring"
        onChange={(e) => { void bring(e.currentTarget.files); e.currentTarget.value = ""; }} />
      <p class="help">CSV, phone apps, ULog, ROS bags, UBX, MAT, HDF5, EDR and NHTSA records, and many more.</p>
    </div>
    {sending.length > 0 && <ul class="sending">
      {sending.map((one) => <li key={one.name}>
        <span class="name">{one.name}</span>
        {!one.problem && <progress value={one.share} max={1} aria-label={`Transfer of ${one.name}`} />}
        {one.problem && <div class="notice bad" role="alert"><p>{one.problem.text}</p>
          <div class="row">
            {one.taken ? <button type="button" onClick={() => void upload(one.file, true).then(refresh)}>Replace it</button> : one.problem.remedy && <p>{one.problem.remedy}</p>}
            {one.taken && files.some((file) => file.name === one.name) && <button type="button" onClick={() => { leave(one); choose(one.name); }}>Use the one that is there</button>}
            <button type="button" onClick={() => leave(one)}>Leave it</button>
          </div></div>}
      </li>)}
    </ul>}
    <Trouble problem={problem} />
    {state?.samples && state.samples.length > 0 && <div class="samples">
      <p>Nothing at hand? Try one:</p>
      <div class="row">{state.samples.map((one) => <button type="button" key={one.name} onClick={() => void sample(one)} title={one.text}>{one.title}</button>)}</div>
    </div>}
    <Part title="Files in the folder">
      {files.length === 0 ? <Empty>There is no file yet.</Empty> : <>
        <fieldset class="list"><legend>Choose those of one recording</legend>
          {files.map((file) => <Fragment key={file.name}>
            <label class="item">
              <input type="checkbox" checked={here.includes(file.name)} onChange={() => toggle(file.name)} />
              <span class="name">{file.name}</span><span class="soft">{file.folder ? "folder, " : ""}{bytes(file.bytes)}</span><span class="soft when">{date(file.modified)}</span>
            </label>
            {file.inside && file.inside.length > 0 && <More title={<>{plural(file.inside.length, "file")} in {file.name} <span class="soft">where one of them is the log, and not the folder</span></>} open={file.inside.some((name) => here.includes(name))}>
              {file.inside.map((name) => <label class="item" key={name}><input type="checkbox" checked={here.includes(name)} onChange={() => toggle(name)} /><span class="name">{name}</span></label>)}
            </More>}
          </Fragment>)}
        </fieldset>
        {files.length > 1 && <p class="row">
          <button type="button" disabled={files.every((file) => here.includes(file.name))} onClick={() => setChosen(files.map((file) => file.name))}>Choose all</button>
          <button type="button" disabled={!here.length} onClick={() => setChosen([])}>Choose none</button>
        </p>}
        {here.length > 0 && <p class="soft" role="status">Chosen: {here.join(", ")}.</p>}
        {here.length > 0 && left.length > 0 && <p class="row soft">No longer: {left.join(", ")}. <button type="button" onClick={() => { setChosen([...here, ...left]); setLeft([]); }}>Choose this, too</button></p>}
        <div class="next"><button type="button" class="main" disabled={!here.length} onClick={go}>Look into {here.length ? plural(here.length, "file") : "them"}</button></div>
      </>}
    </Part>
    <Part title="Earlier results" aside={(state?.runs.length ?? 0) > 1 ? <a href="#/compare">Compare some</a> : undefined}>
      {!state?.runs.length ? <Empty>There is no result yet. Each run leaves one, sealed, in the folder.</Empty>
        : <ul class="list">{state.runs.map((run) => <li key={run.name} class="item">
          <a class="name" href={`#/result/${encodeURIComponent(run.name)}`}>{run.title || run.name}</a>
          <span class="soft">{run.title && run.title !== run.name ? run.name : ""}</span><span class="soft">{run.command}</span>{run.case && <button type="button" onClick={() => void runCase(run.name)}>Run its case</button>}<span class="soft when">{date(run.made)}</span>
        </li>)}</ul>}
    </Part>
  </Page>;
}
