// Run: how far it is, what it prints, and the way to the result; nothing is lost by a reload.

import { useEffect, useState } from "preact/hooks";
import { api, problemOf } from "./api";
import { duration, seconds } from "./format";
import { putJob, refresh, useShared } from "./store";
import type { Job, Problem } from "./types";
import { Busy, Command, Empty, Page, Part, Trouble } from "./ui";

export const STATES: Record<Job["state"], string> = {
  waiting: "Waits for its turn", running: "Running", done: "Done", failed: "Failed", cancelled: "Canceled", lost: "Lost",
};

export function JobPage({ id }: { id: string }) {
  const { state, connected } = useShared();
  const [asked, setAsked] = useState(false);
  const [problem, setProblem] = useState<Problem | null>(null);
  const [, tick] = useState(0);
  const job = state?.jobs.find((one) => one.id === id);
  const going = job?.state === "running" || job?.state === "waiting";
  const [whole, setWhole] = useState<string[]>([]);
  const take = (one: Job) => { putJob(one); setWhole(one.output ?? []); };
  // Its events bring the last lines alone.
  useEffect(() => {
    api.job(id).then(take, (error: unknown) => setProblem(problemOf(error))).finally(() => setAsked(true));
  }, [id, job?.state, job?.tail.join("\n")]);
  useEffect(() => {
    if (!going) return;
    const timer = setInterval(() => {
      tick((n) => n + 1);
      // Without events the job is asked for.
      if (connected === false) api.job(id).then(take, () => undefined);
    }, 1000);
    return () => clearInterval(timer);
  }, [going, connected]);
  if (!job) {
    if (!asked) return <Busy>Asking for the run…</Busy>;
    return <Page title="No such run"><Trouble problem={problem} /><Empty><a href="#/files">To files and results</a></Empty></Page>;
  }
  const printed = whole.length >= job.tail.length ? whole : job.tail;
  const begun = seconds(job.begun), ended = seconds(job.ended);
  const lasted = begun === null ? null : (ended ?? Date.now() / 1000) - begun;
  const cancel = async () => {
    try {
      putJob(await api.cancel(job.id));
      await refresh();
    } catch (error) {
      setProblem(problemOf(error));
    }
  };
  return <Page title={job.name}>
    <Trouble problem={problem} />
    <div class={`progress ${job.state}`}>
      <p class="state" role="status"><b>{STATES[job.state]}</b>{job.state === "running" && job.stage ? `: ${job.stage}` : ""}{lasted !== null && lasted >= 0 ? <span class="soft"> {lasted < 120 ? `${Math.round(lasted)} s` : duration(lasted)}</span> : null}</p>
      {going && <progress {...(job.share === null ? {} : { value: job.share })} max={1} aria-label="Share of the run that is done" />}
      {job.state === "failed" && job.error && <Trouble problem={job.error} />}
      {job.state === "lost" && <p>The studio was stopped while this ran, and the run ended unseen. Run it again.</p>}
      <div class="row">
        {going && <button type="button" onClick={() => void cancel()}>Cancel</button>}
        {job.state === "done" && job.run && <a class="button main" href={`#/result/${encodeURIComponent(job.run)}`}>See the result</a>}
        {!going && job.state !== "done" && <a class="button" href="#/configure">Back to the configuration</a>}
      </div>
      {going && <p class="help">You may close this page: the run goes on, and its result will be in the folder.</p>}
    </div>
    <Part title="What it prints">
      {printed.length ? <pre class="tail" tabIndex={0} aria-label="The output">{printed.join("\n")}</pre> : <Empty>Nothing yet.</Empty>}
    </Part>
    <Part title="The same from a terminal"><Command text={job.again ?? job.command} /></Part>
  </Page>;
}
