// The studio: its address, its pages, and the frame around them.

import "uplot/dist/uPlot.min.css";
import "./style.css";
import { render } from "preact";
import { useEffect, useState } from "preact/hooks";
import { ComparePage } from "./page_compare";
import { ConfigurePage } from "./page_configure";
import { FilesPage } from "./page_files";
import { ChoosePage, LookPage } from "./page_look";
import { LivePage } from "./page_live";
import { ResultPage } from "./page_result";
import { JobPage } from "./page_run";
import { listen, refresh, useShared } from "./store";
import { Trouble } from "./ui";

export interface Route { page: string; rest: string; query: URLSearchParams }

function route(): Route {
  const [path = "", query = ""] = location.hash.replace(/^#\/?/, "").split("?");
  const [page = "", ...rest] = path.split("/");
  let name = rest.join("/");
  try {
    name = decodeURIComponent(name);
  } catch {
    // A broken address names nothing that exists; the page says so.
  }
  return { page: page || "files", rest: name, query: new URLSearchParams(query) };
}

const STEPS = [
  ["files", "Files"], ["look", "Look"], ["choose", "Choose"], ["configure", "Set up"], ["job", "Run"], ["result", "Result"],
] as const;

function App() {
  const [at, setAt] = useState(route());
  const { state, problem, connected, work } = useShared();
  useEffect(() => {
    const moved = () => { setAt(route()); scrollTo(0, 0); };
    addEventListener("hashchange", moved);
    return () => removeEventListener("hashchange", moved);
  }, []);
  const running = state?.jobs.filter((job) => job.state === "running" || job.state === "waiting") ?? [];
  const step = STEPS.findIndex(([page]) => page === at.page);
  const open = (page: string) => page === "files" || (page === "look" && work.files.length > 0)
    || (page === "choose" && work.files.length > 0) || (page === "configure" && work.kind !== null);
  return <>
    <a class="skip" href="#main" onClick={(e) => { e.preventDefault(); document.getElementById("main")?.focus(); }}>To the content</a>
    <header class="top">
      <a class="brand" href="#/files">Strapdown <span>Studio</span></a>
      <nav aria-label="Steps">
        <ol class="steps">
          {STEPS.map(([page, title], i) => <li key={page} class={i === step ? "here" : i < step ? "past" : ""}>
            {i === step ? <a href={location.hash || "#/files"} aria-current="step">{title}</a>
              : open(page) ? <a href={`#/${page}`}>{title}</a> : <span>{title}</span>}
          </li>)}
        </ol>
      </nav>
      <nav aria-label="Others" class="others">
        <a href="#/compare" aria-current={at.page === "compare" ? "page" : undefined}>Compare</a>
        <a href="#/live" aria-current={at.page === "live" ? "page" : undefined}>Live</a>
      </nav>
    </header>
    {connected === false && <p class="offline" role="status">The connection to the studio's server is lost. Trying again; running jobs go on by themselves.</p>}
    {running.length > 0 && at.page !== "job" && <p class="atwork" role="status">
      {running.map((job) => <a key={job.id} href={`#/${job.kind === "live" ? "live" : "job"}/${encodeURIComponent(job.id)}`}>{job.name}: {job.state === "waiting" ? "waits for its turn" : job.kind === "live" ? "listening" : `running${job.share !== null ? `, ${Math.round(job.share * 100)} %` : ""}`}</a>)}
    </p>}
    <main id="main" tabIndex={-1}>
      {problem && <Trouble problem={problem} retry={() => void refresh()} />}
      {state && <CurrentPage key={at.page + at.rest} at={at} />}
      {!state && !problem && <p class="busy" role="status"><span class="spin" aria-hidden="true" />Reading the folder…</p>}
    </main>
    <footer>
      {state && <>Strapdown {state.version}. Folder: <span class="path">{state.folder}</span>. Everything stays on this computer.</>}
    </footer>
  </>;
}

function CurrentPage({ at }: { at: Route }) {
  switch (at.page) {
    case "files": return <FilesPage />;
    case "look": return <LookPage />;
    case "choose": return <ChoosePage />;
    case "configure": return <ConfigurePage />;
    case "job": return <JobPage id={at.rest} />;
    case "result": return <ResultPage name={at.rest} />;
    case "compare": return <ComparePage chosen={at.query.getAll("run")} />;
    case "live": return <LivePage id={at.rest} />;
    default: return <FilesPage />;
  }
}

void refresh();
listen();
render(<App />, document.getElementById("app")!);
