"""Commands by the studio: their results are those of the command line, and nothing is lost."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest

from strapdown.bundle import MANIFEST, UNSEALED, input_files, sha256, write_bundle, write_json
from strapdown.errors import ConfigError, Finding
from strapdown.studio import runs
from strapdown.studio.folder import Folder


def by_command_line(folder: Path, command: str) -> None:
    """Run a command in a folder, as a person would."""
    program, *words = shlex.split(command)
    assert program == "strapdown"
    done = subprocess.run(
        [sys.executable, "-m", "strapdown", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def same_by_both(studio, tmp_path, kind, name, toml, options=()):
    """Run by the studio and by the command that it shows, elsewhere; return the result's folder."""
    other = tmp_path / "elsewhere"
    shutil.copytree(studio.folder, other, ignore=shutil.ignore_patterns(".*"))
    asked = {"kind": kind, "name": name, "toml": toml, "options": list(options)}
    made = studio.ask("POST", "api/jobs", asked)
    assert made.status == 201, made.body
    job = studio.finished(made.json)
    assert job["state"] == "done" and job["run"] == name, job
    if (studio.folder / f"{name}.toml").is_file():
        shutil.copy(studio.folder / f"{name}.toml", other)
    by_command_line(other, job["command"])
    digest = sha256(studio.folder / name / MANIFEST)
    assert digest == sha256(other / name / MANIFEST)
    (listed,) = [r for r in studio.ask("GET", "api/state").json["runs"] if r["name"] == name]
    assert listed["digest"] == digest and listed["command"] == kind
    found = studio.ask("GET", f"api/runs/{quote(name)}").json
    assert found["job"] == job["id"]
    by_command_line(studio.folder, found["verifying"])
    # As it is shown: into a folder that is not there, with the same data under another name.
    by_command_line(studio.folder, found["command_line"])
    again = studio.folder / f"{name}-again"
    data = [p for p in (studio.folder / name).rglob("*.*") if p.suffix in (".csv", ".json")]
    data = [p for p in data if p.name not in (MANIFEST, *UNSEALED)]
    # An attitude without a report has no name of its folder in it.
    assert data and (digest == sha256(again / MANIFEST)) == (kind == "attitude")
    for path in data:
        same = again / path.relative_to(studio.folder / name)
        assert same.read_bytes() == path.read_bytes(), path.name
    assert studio.ask("GET", f"api/runs/{quote(name)}").json["command_line"].count("-again-2") == 1
    return studio.folder / name


def turning_log(path: Path, seconds: float = 20.0) -> None:
    time_s = np.arange(0.0, seconds, 0.02)
    rate = 20.0 * np.sin(time_s) * (time_s > 5.0)
    rows = np.column_stack([time_s, 0 * rate, 0 * rate, rate, 0 * rate, 0 * rate, 0 * rate - 9.8])
    head = "time_s,gyro_x_deg_s,gyro_y_deg_s,gyro_z_deg_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"
    np.savetxt(path, rows, "%.9g", ",", header=head, comments="")


def test_an_attitude_is_that_of_the_command(fresh, tmp_path):
    turning_log(fresh.folder / "log.csv")
    look = fresh.ask("POST", "api/look", {"files": ["log.csv"], "log": {}})
    assert look.status == 200 and look.json["streams"][0]["rows"] == 1000
    assert look.json["rests"][0][0] == pytest.approx(0.0, abs=0.2)
    series = fresh.ask("GET", "api/series?file=log.csv&columns=gyro_z&width=50").json
    assert max(series["columns"]["gyro_z"]["high"]) == pytest.approx(np.radians(20.0), rel=1e-3)
    proposed = fresh.ask("POST", "api/propose", {"kind": "attitude", "files": ["log.csv"]}).json
    text = proposed["toml"] + 'algorithms = ["quaternion"]\nrates_hz = [25.0]\n'
    result = same_by_both(fresh, tmp_path, "attitude", "turns 1", text, ["--no-report"])
    told = json.loads((result / "attitude.json").read_text(encoding="utf-8"))
    assert [a["algorithm"] for a in told["algorithms"]] == ["quaternion"]
    kept = fresh.ask("GET", "api/runs/turns%201/export?as=toml")
    assert kept.body.decode() == text
    values = fresh.ask("GET", "api/runs/turns%201/series?width=10").json
    assert values["columns"]["quaternion heading_deg"]["unit"] == "deg"
    again = {"kind": "attitude", "name": "turns 1", "toml": text, "options": []}
    assert fresh.ask("POST", "api/jobs", again).code == "studio.run-exists"
    # The command of the run is told so that it can be typed: where its result is, with another one.
    (job,) = fresh.ask("GET", "api/state").json["jobs"]
    by_command_line(fresh.folder, job["again"])


def test_the_reference_of_an_attitude_is_drawn_beside_its_algorithms(fresh):
    """At the instants of the algorithms, from the copies in the result alone."""
    turning_log(fresh.folder / "log.csv")
    time_s = np.arange(2.0, 15.0, 0.1)
    heading = 20.0 * (np.cos(5.0) - np.cos(time_s)) * (time_s > 5.0)
    rows = np.column_stack([time_s, 0 * heading, 0 * heading, heading])
    head = "time_s,roll_deg,pitch_deg,heading_deg"
    np.savetxt(fresh.folder / "truth.csv", rows, "%.9g", ",", header=head, comments="")
    for name, more in (("with", " --reference truth.csv"), ("without", "")):
        line = f"strapdown attitude log.csv --algorithms quaternion --no-report --out {name}{more}"
        by_command_line(fresh.folder, line)
    (fresh.folder / "truth.csv").unlink()
    columns = "reference heading_deg,quaternion heading_deg"
    asked = f"series?columns={quote(columns)}&width=2000"
    told = fresh.ask("GET", f"api/runs/with/{asked}").json
    high = {name: np.array(one["high"], dtype=float) for name, one in told["columns"].items()}
    known, t = high["reference heading_deg"], np.array(told["t"])
    inside = (t > 2.1) & (t < 14.8)
    wanted = np.interp(t[inside], time_s, heading)
    off = (known[inside] - wanted + 180.0) % 360.0 - 180.0
    assert np.abs(off).max() < 0.05 and np.abs(wanted).max() > 10.0
    assert np.isnan(known[t < 1.9]).all() and np.isnan(known[t > 15.1]).all()
    assert (
        "reference heading_deg" not in fresh.ask("GET", "api/runs/without/series").json["columns"]
    )


def test_a_result_of_an_attitude_says_what_it_rests_on(fresh):
    """As the terminal does: a beginning of zero because none was given, and what is judged."""
    turning_log(fresh.folder / "log.csv")
    for name, more in (("zero", " --from 7"), ("level", ""), ("given", " --initial 1,2,3")):
        line = f"strapdown attitude log.csv --algorithms quaternion --no-report --out {name}{more}"
        by_command_line(fresh.folder, line)
        told = fresh.ask("GET", f"api/runs/{name}").json
        assert told["begins"] == name
        start, bias, *why = told["premises"]
        assert start.startswith("Initial attitude: roll ") and bias.startswith("Gyro bias: ")
        assert "zero, because none was given" in start or name != "zero"
        assert "roll 1.000°, pitch 2.000°, heading 3.000°" in start or name != "given"
        answer = json.loads((fresh.folder / name / "attitude.json").read_text(encoding="utf-8"))
        assert why == answer["answer"]["why"] and "and not the sensor" in why[-1]


def test_a_session_of_a_live_run_is_a_log(fresh):
    session = fresh.folder / "walk" / "phone-1"
    session.mkdir(parents=True)
    (fresh.folder / "walk" / "other").mkdir()
    turning_log(session / "journal.csv", 4.0)
    (session / "journal").write_bytes(b"x")
    (session / "run.json").write_text("{}", encoding="utf-8")
    (session / "link").symlink_to(fresh.folder.parent)
    (fresh.folder / "plain").mkdir()
    names = [one["name"] for one in fresh.ask("GET", "api/state").json["files"]]
    assert names == ["plain", "walk/phone-1"]
    for name in ("walk/phone-1/journal.csv", "walk/../plain", "walk//phone-1", "walk/", "/walk"):
        found = fresh.ask("POST", "api/look", {"files": [name], "log": {}})
        assert found.status in (400, 404) and found.code.startswith("studio.")
    # A log that is no journal, under such a name: what is read is the file itself.
    turning_log(fresh.folder / "walk" / "other" / "log.csv")
    look = fresh.ask("POST", "api/look", {"files": ["walk/other"], "log": {}})
    assert look.status == 422 and look.code.startswith("io.")


DRIVE = Path("docs/examples/navigate_drive.toml")


def short_drive() -> str:
    text = DRIVE.read_text(encoding="utf-8")
    for long, short in (("duration_s = 40.0", "duration_s = 12.0"), ("80.0, 110.0", "52.0, 60.0")):
        assert long in text
        text = text.replace(long, short)
    return text


@pytest.mark.slow
def test_a_navigation_is_that_of_the_command(fresh, tmp_path):
    result = same_by_both(fresh, tmp_path, "navigate", "drive", short_drive())
    track = fresh.ask("GET", "api/runs/drive/track?points=50").json
    assert len(track["lat"]) == 50 and len(track["q"][0]) == 4
    assert fresh.ask("GET", "api/runs/drive").json["over_ground"]
    assert fresh.ask("GET", "api/runs/drive").json["verdict"] in (
        "trusted",
        "reserve",
        "distrusted",
    )
    gpx = fresh.ask(
        "GET", "api/runs/drive/export?as=gpx&epoch=2026-05-01T12:00:00%2B00:00&geoid=46"
    )
    assert gpx.status == 200 and gpx.body.count(b"<trkpt") > 100
    assert fresh.ask("GET", "api/runs/drive/export?as=zip").body[:2] == b"PK"
    page = fresh.ask("GET", "runs/drive/report.html").body
    assert page == (result / "report.html").read_bytes()


@pytest.mark.slow
def test_a_crash_is_that_of_the_command_and_the_quick_answer_is_its_own(fresh, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "strapdown", "simulate", "pole", "--out", tmp_path / "pole"],
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0
    for path in (tmp_path / "pole").glob("*.csv"):
        assert fresh.put(path.name, path.read_bytes()).status == 201
    text = (tmp_path / "pole" / "case.toml").read_text(encoding="utf-8")
    quick = fresh.ask("POST", "api/crash/quick", {"toml": text, "set": {}}).json
    text = text.replace("monte_carlo_runs = 2000", "monte_carlo_runs = 0")
    assert "monte_carlo_runs = 0" in text
    result = same_by_both(fresh, tmp_path, "crash", "pole", text)
    told = json.loads((result / "crash.json").read_text(encoding="utf-8"))
    (own,) = [a for a in told["answers"] if a["recorder"] == quick["recorder"]]
    size = own["events"][0]["body"]["event"]["resultant_m_per_s"]
    # By all recorders together, each has a part of the others' ringing in its bound.
    assert quick["delta_v"]["value"] == pytest.approx(size["value"], rel=1e-9)
    assert quick["pdof"]["clock"] == 12 and len(quick["path"]["north"]) == len(
        quick["path"]["bound"]
    )
    end = own["path"]["end"]["north_m"]
    assert quick["path"]["north"][-1] == pytest.approx(end["value"], rel=1e-9)
    # The half axis of an ellipse in the plane is longer than the bound along one axis.
    assert quick["path"]["bound"][-1] > end["high"] - end["value"]
    # No heading is stated: the axes are those of the vehicle at the entry, everywhere.
    assert not quick["over_ground"] and not fresh.ask("GET", "api/runs/pole").json["over_ground"]
    turned = {"toml": text, "set": {"entry.heading_deg": 30.0}}
    assert fresh.ask("POST", "api/crash/quick", turned).json["over_ground"]
    page = (result / "report.html").read_text(encoding="utf-8")
    assert "north up" not in page and "axes forward and right of the vehicle at the entry" in page
    faster = {"toml": text, "set": {"entry.speed_m_per_s": 9.0}}
    moved = fresh.ask("POST", "api/crash/quick", faster).json
    assert moved["path"]["north"][-1] > quick["path"]["north"][-1] + 1.0


@pytest.mark.slow
def test_a_server_that_is_killed_loses_no_job(fresh):
    made = fresh.ask(
        "POST", "api/jobs", {"kind": "navigate", "name": "drive", "toml": short_drive()}
    ).json
    fresh.until(made)
    fresh.kill()
    time.sleep(0.5)
    fresh.start()
    assert fresh.left == 1
    seen = fresh.ask("GET", f"api/jobs/{made['id']}").json
    assert seen["state"] in ("running", "done") and seen["command"] == made["command"]
    done = fresh.finished(seen)
    assert done["state"] == "done" and (fresh.folder / "drive" / MANIFEST).is_file()


@pytest.mark.slow
def test_a_server_that_is_ended_in_order_says_what_goes_on(fresh):
    made = fresh.ask(
        "POST", "api/jobs", {"kind": "navigate", "name": "drive", "toml": short_drive()}
    ).json
    fresh.until(made)
    assert fresh.interrupt() == 0
    fresh.process.stdout.close()
    fresh.start()
    assert fresh.finished(fresh.ask("GET", f"api/jobs/{made['id']}").json)["state"] == "done"


@pytest.mark.slow
def test_a_run_that_is_cancelled_or_killed_leaves_no_result(fresh):
    asked = {"kind": "navigate", "name": "drive", "toml": short_drive()}
    made = fresh.until(fresh.ask("POST", "api/jobs", asked).json)
    assert fresh.ask("DELETE", f"api/jobs/{made['id']}").status == 200
    assert fresh.finished(made)["state"] == "cancelled"
    assert not (fresh.folder / "drive").exists()
    # The same name again: its configuration was the studio's own.
    again = {**asked, "toml": asked["toml"] + "# changed\n"}
    made = fresh.until(fresh.ask("POST", "api/jobs", again).json)
    said = json.loads(
        (fresh.folder / ".strapdown-studio" / "jobs" / f"{made['id']}.json").read_text("utf-8")
    )
    os.killpg(said["process"], signal.SIGKILL)
    lost = fresh.finished(made)
    assert lost["state"] == "lost" and lost["error"]["code"] == "studio.job-lost"
    assert not (fresh.folder / "drive").exists()
    left = [p.name for p in fresh.folder.iterdir() if p.name.startswith(".")]
    assert fresh.ask("GET", "api/state").json["runs"] == [], left


def test_a_configuration_of_the_users_is_not_written_over(fresh):
    (fresh.folder / "drive.toml").write_text("# mine\n", encoding="utf-8")
    asked = {"kind": "navigate", "name": "drive", "toml": short_drive()}
    assert fresh.ask("POST", "api/jobs", asked).code == "studio.file-exists"
    assert (fresh.folder / "drive.toml").read_text(encoding="utf-8") == "# mine\n"
    (fresh.folder / "other").mkdir()
    asked["name"] = "other"
    assert fresh.ask("POST", "api/jobs", asked).code == "studio.run-exists"


def test_a_wrong_configuration_begins_no_job(fresh):
    asked = {"kind": "navigate", "name": "drive", "toml": "[log]\npath = 3\n"}
    assert fresh.ask("POST", "api/jobs", asked).status == 400
    asked = {"kind": "nothing", "name": "drive", "toml": ""}
    assert fresh.ask("POST", "api/jobs", asked).code == "studio.unknown-kind"
    assert fresh.ask("GET", "api/state").json["jobs"] == []


def test_one_studio_in_a_folder(fresh):
    done = subprocess.run(
        [sys.executable, "-m", "strapdown", "studio", fresh.folder, "--no-browser"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env={**os.environ, "STRAPDOWN_STUDIO_STATIC": str(fresh.folder.parent / "page")},
    )
    assert done.returncode == 4 and "a studio runs in this folder" in done.stderr


def sealed_alignment(folder: Path, heading: float, seconds: float) -> None:
    """A sealed alignment as a file may have it, with a finding in the words of a command line."""
    finding = Finding("io.axes-not-stated", file="log.csv").plain("cli")
    assert "--axes" in finding["remedy"]
    spec = {"log": {"repair": False}, "coarse": {"duration_s": seconds}}
    whole = {"name": folder.name, "alignment": spec}
    with write_bundle(folder, command="align", configuration=whole, inputs=(), seals=[]) as staging:
        angles = {"roll_deg": 0.1, "pitch_deg": -1e-10, "heading_deg": heading}
        bounds = {f"{name}_sd_deg": 1.3 for name in ("roll", "pitch", "heading")}
        write_json(staging / "align.json", {"coarse": {**angles, **bounds}, "findings": [finding]})


def test_a_result_is_told_as_people_read_it(tmp_path, monkeypatch):
    """Numbers as the reports show them, options as a table, findings in the studio's words."""
    sealed_alignment(tmp_path / "a", 63.798, 60.0)
    sealed_alignment(tmp_path / "b", 71.5, 90.0)
    found = runs.run(tmp_path, "a")
    (finding,) = found["findings"]
    assert finding["code"] == "io.axes-not-stated" and "--" not in finding["remedy"]
    by_label = {one["label"]: one for one in found["numbers"]}
    assert by_label["heading"]["value"] == "63.8" and by_label["heading"]["unit"] == "deg"
    assert by_label["heading"]["bound"].replace("\u00a0", " ") == "± 2.5"
    assert by_label["pitch"]["value"] == "0.0"
    by_key = {one["key"]: one for one in found["options"]}
    duration = by_key["coarse.duration_s"]
    assert (duration["value"], duration["unit"], duration["default"]) == (60.0, "s", None)
    assert duration["help"] and not duration["usual"]
    assert by_key["log.repair"]["usual"] and by_key["log.repair"]["default"] is False
    monkeypatch.chdir(tmp_path)
    Folder(tmp_path).state.mkdir(exist_ok=True)
    both = runs.compare(tmp_path, ["a", "b"])
    assert [row["key"] for row in both["options"]] == ["coarse.duration_s"]
    assert [one["key"] for one in both["same_options"]] == ["log.repair"]
    (heading,) = [row for row in both["numbers"] if row["quantity"] == "heading"]
    assert heading["shown"]["values"] == ["63.8", "71.5"] and not heading["detail"]
    assert heading["shown"]["differences"][1] == "+7.7" and heading["within"][1] is False


def test_the_reasons_against_a_result_stand_beside_its_verdict(tmp_path):
    """Those of the verdict, in the studio's words, among what was noticed once each."""
    spec = {"log": {"repair": False}, "coarse": {"duration_s": 60.0}}
    whole = {"name": "a", "alignment": spec}
    axes = Finding("io.axes-not-stated", severity="warning").plain()
    unseen = Finding("navigation.nothing-observed", severity="warning").plain()
    for_it = Finding("navigation.outage-test-passed", severity="note").plain()
    trust = {"verdict": "reserve", "for": [for_it], "against": [unseen, axes]}
    place = tmp_path / "a"
    with write_bundle(place, command="align", configuration=whole, inputs=(), seals=[]) as staging:
        write_json(staging / "align.json", {"coarse": {}, "findings": [axes], "trust": trust})
    found = runs.run(tmp_path, "a")
    assert found["verdict"] == "reserve"
    codes = ["navigation.nothing-observed", "io.axes-not-stated"]
    assert [one["code"] for one in found["against"]] == codes
    assert [one["code"] for one in found["findings"]] == codes
    assert "--" not in found["against"][1]["remedy"]


def test_a_finding_about_an_algorithm_names_it_and_one_about_a_file_does_not(tmp_path):
    pole = Finding("attitude.through-vertical-pitch", quantity="euler", time=3.0, apart_deg=0.0)
    axes = Finding("io.axes-not-stated", file="log.csv", quantity="axes")
    place, whole = tmp_path / "a", {"name": "a"}
    with write_bundle(place, command="attitude", configuration=whole, inputs=(), seals=[]) as out:
        write_json(out / "attitude.json", {"findings": [pole.plain(), axes.plain()]})
    texts = [one["text"] for one in runs.run(tmp_path, "a")["findings"]]
    assert texts[0].startswith("euler: passed through") and texts[1] == axes.sentence("studio")


def test_the_status_of_a_heading_stands_beside_its_value_and_the_verdict(tmp_path):
    """As the run says it, from the values of its heading integrity."""
    whole = {"name": "a", "navigation": {}}
    span = {"from_s": 0.0, "to_s": 60.0, "status": "unverified", "reason": "assumed"}
    heading = {"confirmed_by": None, "why_not": [], "at_end": "unverified", "spans": [span]}
    end = {"time_s": 60.0, "heading_deg": 3.1, "heading_sd_deg": 0.6}

    def made(name, trusted):
        share = {"trusted": trusted, "unverified": 1.0 - trusted, "rejected": 0.0}
        with write_bundle(
            tmp_path / name, command="navigate", configuration=whole, inputs=(), seals=[]
        ) as staging:
            write_json(staging / "navigation.json", {"end": end})
            write_json(staging / "verdict.json", {"heading": heading | {"share": share}})
        found = runs.run(tmp_path, name)
        (one,) = [n for n in found["numbers"] if (n["group"], n["label"]) == HEADING_AT_END]
        return found["heading"], one["note"].replace("\u00a0", " ")

    said, note = made("a", 0.0)
    assert said.replace("\u00a0", " ") == (
        "Heading: unverified 100 % of the time; final status: unverified (its own bound is small, "
        "but rests on the start or on one measurement only)."
    )
    assert note == "unverified 100 % of the time; final status: unverified"
    said, note = made("b", 0.25)
    assert "trusted 25.0 %, unverified 75.0 % of the time" in said.replace("\u00a0", " ")
    # A heading that was trusted throughout needs no caution.
    assert made("c", 1.0)[0] is None
    # A result that was written by hand.
    heading["spans"] = [{"status": 3}]
    assert made("d", 0.0)[0] is None


HEADING_AT_END = ("At the end", "heading")


def test_what_the_bounds_of_a_crash_rest_on_is_beside_them(tmp_path):
    force = {"horizontal_deg": 0.0, "low_deg": 357.0, "high_deg": 3.0, "undetermined": False}
    speed = {"value": 17.0, "low": 16.0, "high": 18.0}
    body = {"event": {"resultant_m_per_s": speed, "direction_of_force": force}}
    events = [{"event": k, "body": body} for k in (1, 2)]
    risk = {"model": "own_identifier", "outcome": "MAIS3+", "source": "Author (2001): title, 2-1"}
    risk |= {"of": "R", "probability": 0.4, "low": 0.3, "high": 0.5}
    answer = {
        "main": "R",
        "answers": [{"recorder": "R", "main_event": 2, "events": events}],
        "on_assumption": ["direction of force", "position forward"],
        "severity": [
            risk | {"model_uncertainty_in_bound": False},
            risk | {"outcome": "MAIS2+", "model_uncertainty_in_bound": True},
        ],
    }
    whole = {"command": "crash", "configuration": {}, "inputs": (), "seals": []}
    with write_bundle(tmp_path / "a", **whole) as staging:
        write_json(staging / "crash.json", answer)
    found = {(n["group"], n["label"]): n["note"] for n in runs.run(tmp_path, "a")["numbers"]}
    direction = "direction of force (PDOF)"
    assert found["Impact 2", direction] == "by assumption"
    assert found["Impact 1", direction] == found["Impact 2", "delta-V"] == ""
    of_model = "Author (2001): title, 2-1"
    alone = "the bound is of delta-V alone, not of the model"
    assert found["Severity", f"MAIS3+, {of_model}"] == alone
    assert found["Severity", f"MAIS2+, {of_model}"] == ""
    assert "own_identifier" not in str(found)


def test_the_drawings_of_a_crash_are_those_of_its_report(tmp_path):
    """Each with what it shows in words; one that the seal does not list is none."""
    place = tmp_path / "a crash"
    crush = {"recorder": "R", "depth_m": {"value": 0.5, "low": 0.4, "high": 0.6}, "at_least": True}
    answer = {"main": "R", "deformation": {"crush": [crush]}}
    with write_bundle(place, command="crash", configuration={}, inputs=(), seals=[]) as staging:
        write_json(staging / "crash.json", answer)
        (staging / "figures").mkdir()
        for name in ("pdof", "severity", "units"):
            size = 'width="330" height="434.5" ' if name == "pdof" else ""
            text = f"<svg {size}role='img'><title>{name}: 1 &lt; 2</title></svg>"
            (staging / "figures" / f"{name}.svg").write_text(text, encoding="utf-8")
    (place / "figures" / "path.svg").write_text("<svg></svg>", encoding="utf-8")
    found = runs.run(tmp_path, place.name)
    assert [(one["address"], one["alt"]) for one in found["figures"]] == [
        (f"runs/a%20crash/figures/{name}.svg", f"{name}: 1 < 2") for name in ("pdof", "severity")
    ]
    sizes = [(one["width"], one["height"]) for one in found["figures"]]
    assert sizes == [(330.0, 434.5), (400.0, 300.0)]
    (crush,) = [one for one in found["numbers"] if one["group"] == "Deformation"]
    said = " ".join((crush["label"], crush["value"], crush["bound"], crush["unit"]))
    assert said == "crush 0.50 +∞ \N{MINUS SIGN}0.10 m"


def test_fixes_in_the_folder_of_the_log_are_drawn(tmp_path):
    log = tmp_path / "walk"
    log.mkdir()
    (log / "Location.csv").write_text(
        "time_s,lat_deg,lon_deg,alt_m\n" + "".join(f"{k},48.0,{k}e-5,0\n" for k in range(9))
    )
    (log / "Gyroscope.csv").write_text("time_s,gyro_x_rad_s\n0,0\n")
    aid = {"kind": "gnss", "path": str(log)}
    whole = {"name": "a", "navigation": {"log": {"path": str(log)}, "aiding": {"gnss": aid}}}
    files = tuple(sorted(log.iterdir()))
    inputs = [input_files("log", str(log), files[:1]), input_files("aid-gnss", str(log), files[1:])]
    with write_bundle(
        tmp_path / "a", command="navigate", configuration=whole, inputs=inputs, seals=[]
    ):
        pass
    place, manifest = runs._opened(tmp_path, "a")
    path = manifest["configuration"]["navigation"]["aiding"]["gnss"]["path"]
    assert runs._input(place, path, manifest) == (place / path).resolve()
    for outside in ("..", "inputs/..", "/", "inputs/log/other", "../walk"):
        with pytest.raises(ConfigError):
            runs._input(place, outside, manifest)
    (place / path / "more.csv").symlink_to(tmp_path / "secret.csv")
    with pytest.raises(ConfigError):
        runs._input(place, path, manifest)


def test_a_finding_that_is_not_known_is_in_the_words_of_its_result():
    for code in ("io.of-a-later-version", "../../x.y", "nothing", 3):
        told = runs._finding({"code": code, "data": {}, "sentence": "as it was", "remedy": "do"})
        assert (told["text"], told["remedy"]) == ("as it was", "do")
    # Data of another form.
    wrong = {"code": "io.time-counter-wraps", "data": 3, "sentence": "as it was", "remedy": None}
    assert runs._finding(wrong)["text"] == "as it was"


def test_the_case_of_a_simulated_crash_can_be_run(studio):
    """As the page does it: its text, with the paths from the folder of the studio."""
    by_command_line(studio.folder, "strapdown simulate pole --out hit --quiet")
    (listed,) = [r for r in studio.ask("GET", "api/state").json["runs"] if r["name"] == "hit"]
    assert listed["command"] == "simulate" and listed["case"]
    text = (studio.folder / "hit" / "case.toml").read_text()
    shown = studio.ask("GET", "runs/hit/case.toml")
    assert shown.status == 200 and shown.body.decode() == text
    values = studio.ask("POST", "api/check", {"kind": "crash", "toml": text}).json["values"]
    paths = {key: f"hit/{value}" for key, value in values.items() if key.endswith(".path")}
    assert len(paths) > 6
    asked = {"kind": "crash", "toml": text, "set": paths}
    made = studio.ask("POST", "api/check", asked).json
    assert made["errors"] == []
    asked = {"kind": "crash", "name": "hit-crash", "toml": made["toml"], "options": ["--no-report"]}
    job = studio.finished(studio.ask("POST", "api/jobs", asked).json)
    assert job["state"] == "done", job
    (result,) = [r for r in studio.ask("GET", "api/state").json["runs"] if r["name"] == "hit-crash"]
    assert result["command"] == "crash" and not result["case"]
