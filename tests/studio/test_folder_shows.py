"""What else the folder of a studio has: samples, a map, live runs; and its start from the shell."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
import time

import numpy as np
import pytest
from tests.map_files import mbtiles, pmtiles, png

from strapdown.errors import ConfigError
from strapdown.studio import app as studio_app
from strapdown.studio import server
from strapdown.studio.app import SAMPLES, states_of
from strapdown.studio.folder import Folder
from strapdown.studio.jobs import Jobs
from strapdown.studio.live_jobs import (
    PORT,
    PROTOCOLS,
    live_command,
    live_info,
    shown_state,
)


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_a_sample_is_copied_and_can_be_looked_at(fresh, name):
    listed = fresh.ask("GET", "api/state").json["samples"]
    assert name in {one["name"] for one in listed}
    made = fresh.ask("POST", f"api/samples/{name}")
    assert made.status == 200
    files = made.json["files"]
    assert all((fresh.folder / file).is_file() for file in files)
    assert fresh.ask("POST", f"api/samples/{name}").json == made.json
    # Among the recordings that are there it is in a folder of its own.
    assert [one.name for one in fresh.folder.glob("[!.]*")] == [f"sample-{name}"]
    kind = "crash" if name == "crash" else "navigate"
    proposed = fresh.ask("POST", "api/propose", {"kind": kind, "files": files})
    assert proposed.status == 200 and not proposed.json["choose"]
    assert all(f'"{file}"' in proposed.json["toml"] for file in files)
    if name == "crash":
        # Its case is offered, with the truth, and nothing is open in it.
        (case,) = proposed.json["ready"]
        assert case["name"] == "sample-crash/case.toml" not in files
        assert all(f'"{file}"' in case["toml"] for file in files)
        assert re.match(r"Simulated, .* delta-V of 63\.1 km/h .* of 0\.0°\.$", case["what"])
        checked = fresh.ask("POST", "api/check", {"kind": kind, "toml": case["toml"]}).json
        assert not checked["errors"] and '"?"' not in case["toml"]
    (fresh.folder / files[0]).write_text("mine", encoding="utf-8")
    assert fresh.ask("POST", f"api/samples/{name}").code == "studio.name-taken"
    assert (fresh.folder / files[0]).read_text(encoding="utf-8") == "mine"


def test_a_folder_shows_what_is_in_it_and_one_of_it_is_a_log(fresh):
    folder = fresh.folder / "recordings"
    folder.mkdir()
    for name in ("b.csv", "A.csv", ".hidden"):
        (folder / name).write_text("time_s,gyro_x_rad_s\n0.0,1.0\n", encoding="utf-8")
    (folder / "out").symlink_to(fresh.folder.parent)
    (one,) = fresh.ask("GET", "api/state").json["files"]
    assert one["inside"] == ["recordings/A.csv", "recordings/b.csv"]
    # Each of them can be looked at; that these say too little is another thing.
    found = fresh.ask("POST", "api/look", {"files": ["recordings/A.csv"], "log": {}})
    assert found.status == 200 or found.code.startswith("io.")


def test_a_sample_that_is_none(studio):
    assert studio.ask("POST", "api/samples/nothing").code == "studio.no-such-sample"


def test_tiles_of_a_map_in_the_folder(fresh):
    assert fresh.ask("GET", "api/map").json["tiles"] is None
    (fresh.folder / "broken.mbtiles").write_bytes(b"SQLite format 3\0" + b"x" * 5000)
    assert fresh.ask("GET", "api/map").json["tiles"] is None
    picture = png()
    for write, file in ((mbtiles, "town.mbtiles"), (pmtiles, "a.pmtiles")):
        write(fresh.folder / file, {(3, 4, 2): picture}, attribution="<b>those</b> who drew it")
        told = fresh.ask("GET", "api/map").json
        assert told["tiles"] == "tiles/{z}/{x}/{y}" and told["min"] <= told["max"] <= 24
        assert told["attribution"] == "those who drew it"
        found = fresh.ask("GET", "tiles/3/4/2")
        assert (found.status, found.body) == (200, picture)
        assert found.headers["content-type"] == "image/png"
        for place in ("3/4/3", "3/8/2", "30/0/0", "0/0/0"):
            assert fresh.ask("GET", f"tiles/{place}").status == 204


RUN = """
[live]
[sensors]
sensor = "adis16495-1"
[start]
lat_deg = 45.0
lon_deg = 20.0
alt_m = 81.2
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 90.0
"""


def test_a_live_run_navigates_by_a_configuration_of_the_folder(tmp_path):
    (tmp_path / "run.toml").write_text(RUN, encoding="utf-8")
    words = live_command(tmp_path, "walk", "udp", {"run": "run.toml"})
    assert words[:3] == ["live", "run.toml", "--udp=127.0.0.1:5555"]
    assert live_command(tmp_path, "walk", "udp", {"run": ""})[1].startswith("--udp")
    (tmp_path / "wrong.toml").write_text("[live]\nhold = 3\n", encoding="utf-8")
    outside = tmp_path.parent / "sensor.toml"
    outside.write_text("", encoding="utf-8")
    leads_out = RUN.replace('"adis16495-1"', f'"{outside.as_posix()}"')
    (tmp_path / "out.toml").write_text(leads_out, encoding="utf-8")
    for name in (
        "missing.toml",
        "../sensor.toml",
        "-run.toml",
        "wrong.toml",
        "out.toml",
        "log.csv",
        3,
    ):
        with pytest.raises(ConfigError):
            live_command(tmp_path, "walk", "udp", {"run": name})


def test_only_configurations_of_a_navigation_are_offered(tmp_path):
    found = {
        "run.toml": RUN,
        "case.toml": '[vehicle]\nname = "a car"\n',
        "open.toml": RUN.replace("45.0", '"?"'),
        "none.toml": "= 3",
        "run.csv": RUN,
    }
    for name, text in found.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "inside").mkdir()
    (tmp_path / "inside" / "run.toml").write_text(RUN, encoding="utf-8")
    assert live_info(tmp_path)["configurations"] == ["run.toml"]


def test_an_address_for_phones_is_offered_beside_that_of_this_machine():
    (field,) = [f for f in PROTOCOLS["sensor-logger"].fields if f.flag == "--listen"]
    assert [place for place, _ in field.places] == [f"127.0.0.1:{PORT}", f"0.0.0.0:{PORT}"]
    assert field.default == f"127.0.0.1:{PORT}"


def test_commands_of_live_runs(tmp_path):
    words = live_command(
        tmp_path, "walk", "sensor-logger", {"listen": "0.0.0.0:8437", "every": 0.5}
    )
    assert words == [
        *("live", "--listen=0.0.0.0:8437", "--platform=auto", "--every=0.5"),
        *("--lines=json", "--out", "walk"),
    ]
    for protocol, options, code in (
        ("nothing", {}, "studio.unknown-protocol"),
        ("udp", {"out": "/"}, "studio.unknown-key"),
        ("udp", {"udp": "a\x1bb"}, "studio.wrong-type"),
        ("udp", {"udp": 3}, "studio.wrong-type"),
        ("udp", {"stop-after": "soon"}, "studio.wrong-type"),
        ("phyphox", {}, "studio.wrong-type"),
        ("sensor-logger", {"platform": "--force"}, "studio.unknown-choice"),
    ):
        with pytest.raises(ConfigError) as caught:
            live_command(tmp_path, "walk", protocol, options)
        assert caught.value.finding.code == code, (protocol, options)
    for name, one in PROTOCOLS.items():
        own = {f.flag.removeprefix("--"): f.choices[0] if f.choices else "1" for f in one.fields}
        made = live_command(tmp_path, "walk", name, own)
        assert all(word.startswith(("--", "live", "walk")) for word in made)


def test_without_the_extra_it_says_what_to_install(tmp_path, monkeypatch):
    there = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "uvicorn" else there(name)
    )
    with pytest.raises(ConfigError) as caught:
        server.serve(tmp_path)
    assert caught.value.finding.code == "studio.library-missing"
    assert "strapdown[studio]" in caught.value.finding.advice()


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["--host", "0.0.0.0"], "reached from other machines"),
        (["--host", "192.0.2.1", "--listen"], "cannot be used"),
        (["--map", "missing.pmtiles"], "the map cannot be used"),
        (["nowhere/at/all"], "the folder cannot be used"),
    ],
)
def test_a_start_that_cannot_be(tmp_path, words, code, run_cli, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "page").mkdir()
    (tmp_path / "page" / "index.html").write_text("", encoding="utf-8")
    monkeypatch.setattr(studio_app, "STATIC", tmp_path / "page")
    done = run_cli("studio", "--no-browser", *words)
    assert done.code == 4 and code in done.err


def test_the_progress_of_any_command_is_told_to_a_file(tmp_path):
    told = tmp_path / "progress"
    command = [sys.executable, "-m", "strapdown", "attitude", "alexiev-fig4", "--rate", "20"]
    command += ["--algorithms", "naive", "--no-report", "--quiet", "--out", tmp_path / "out"]
    environment = {**os.environ, "STRAPDOWN_PROGRESS": str(told)}
    assert subprocess.run(command, env=environment, check=False).returncode == 0
    lines = [json.loads(line) for line in told.read_text(encoding="utf-8").splitlines()]
    assert lines and all(0.0 <= line["share"] <= 1.0 and line["stage"] for line in lines)
    told.unlink()
    again = subprocess.run(command, env=environment, capture_output=True, check=False)
    assert again.returncode == 4
    (error,) = [json.loads(x)["error"] for x in told.read_text(encoding="utf-8").splitlines()]
    assert error["code"] == "bundle.folder-exists" and error["remedy"]
    # A file that cannot be written is nobody's matter.
    environment["STRAPDOWN_PROGRESS"] = str(tmp_path / "no" / "folder")
    assert subprocess.run([*command, "--force"], env=environment, check=False).returncode == 0


def test_numbers_of_a_live_state_are_those_of_the_reports():
    line = {
        "time": 12.5,
        "unix": 1.7e9,
        "session": "phone",
        "lat": 37.725491,
        "lon": -122.47213,
        "north_sd": 0.6,
        "east_sd": 1.0,
        "heading": -0.004,
        "heading_sd": 0.2,
        "VN": -3.21987,
        "alt": 1e400,
        "roll": True,
        "steps_taken": 12.0,
        "down_sd": 2.0,
    }
    shown = {one["name"]: (one["value"], one["bound"]) for one in shown_state(line)}
    gap = "\N{NO-BREAK SPACE}"
    # Two digits of 1.96 sd; the second, 0.1 m, is 9e-7 deg of latitude.
    assert shown == {
        "Latitude": ("37.725491°", f"±{gap}1.2{gap}m"),
        "Longitude": ("\N{MINUS SIGN}122.472130°", f"±{gap}2.0{gap}m"),
        "Heading": (f"0.00{gap}deg", f"±{gap}0.39{gap}deg"),
        "Velocity north": (f"\N{MINUS SIGN}3.220{gap}m/s", ""),
        "steps taken": ("12.00", ""),
    }
    # An angle whose bound is half a turn can be any.
    assert shown_state({"heading": 62.0, "heading_sd": 102.0})[0]["bound"] == "unknown"


def live_output(folder, lines):
    """Jobs of a folder with a live run that ended with such an output."""
    state = Folder.open(folder).state / "jobs"
    job = {"id": "a" * 16, "kind": "live", "name": "walk", "words": ["live"], "made": 1.0}
    job |= {"state": "done", "begun": 1.0, "ended": 2.0}
    (state / f"{job['id']}.json").write_text(json.dumps(job), encoding="utf-8")
    (state / f"{job['id']}.log").write_text("".join(lines), encoding="utf-8")
    return Jobs(Folder.open(folder)), job["id"]


def test_states_of_a_live_run_are_given_from_its_beginning(tmp_path):
    """As after a reload: evenly, the last ones whole, each once and in order, of all devices."""
    lines = ["listening at 127.0.0.1:1\n"]
    for k in range(40_000):
        state = {"session": f"phone-{k % 2}", "time": k / 10, "roll": k % 7, "roll_sd": 1.0}
        lines.append(json.dumps(state) + "\n")
    jobs, number = live_output(tmp_path, [*lines, '{"session": "phone-0", "ti'])
    for name, ago in (("phone-0", 0.0), ("phone-1", 90.0)):
        (tmp_path / "walk" / name).mkdir(parents=True)
        (tmp_path / "walk" / name / "journal").write_bytes(b"x")
        at = time.time() - ago
        os.utime(tmp_path / "walk" / name / "journal", (at, at))
    told = states_of(Folder.open(tmp_path), jobs, number)
    stamps = [state["time"] for state in told["states"]]
    assert stamps == sorted(set(stamps)) and stamps[0] == 0.0 and stamps[-1] == 3999.9
    assert len(stamps) < 8000 and max(np.diff(stamps)) < 3 * 4000.0 / 2000
    assert {state["session"] for state in told["states"]} == {"phone-0", "phone-1"}
    assert [state["session"] for state in told["states"] if "shown" in state] == [
        "phone-0",
        "phone-1",
    ]
    assert told["silent_s"]["phone-0"] < 60.0 < told["silent_s"]["phone-1"] < 150.0


def test_states_of_a_short_live_run_are_all_of_them(tmp_path):
    lines = ['{"session": "..", "time": NaN}\n', '{"session": "a", "time": 2.5}\n']
    jobs, number = live_output(tmp_path, lines)
    told = states_of(Folder.open(tmp_path), jobs, number)
    assert [state["time"] for state in told["states"]] == [None, 2.5]
    assert told["silent_s"] == {}
