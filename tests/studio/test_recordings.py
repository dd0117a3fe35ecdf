"""Every recording through the studio, as a new user takes it: look, answer, set up, run.

Each step answers, or refuses with a code and with what to do: no recording ends in a fault of the
studio's own, and what `look` calls fit can be set up and run. What the results are worth is for
other tests.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest
from tests.recorded import DATA, without

pytestmark = pytest.mark.slow

#: Folders of recordings, and those of `zoo`, of strangers: one that is missing is a failure.
RECORDINGS = (
    "broad",
    "car_rtk",
    "crash_nhtsa_10146",
    "foot",
    "mpu6050_turns",
    "phone_comma2k19",
    "rlg_static",
)
ZOO = (
    "apdm",
    "ardupilot",
    "bennyhui",
    "betaflight",
    "dji",
    "garmin_fit",
    "gnss_ins_sim",
    "gnsslogger",
    "gnsslogger_raw",
    "gopro",
    "gpx",
    "gsdc",
    "gtsam",
    "matlab_mobile",
    "nmea",
    "novatel_span",
    "openimu",
    "px4_ulg",
    "pyins",
    "rosbag1_loc",
    "rtklib_pos",
    "sbet",
    "sbf",
    "sensorlogger_dr",
    "smartloc",
    "ubx",
    "xio",
    "xsens_mtw",
)
#: Files of a folder that are no recordings.
WORDS = (".md", ".txt", "")
#: Longest part that is run, s, more than a rest at its start; seconds that a request may take.
PART, WAIT = 60.0, 400.0
#: Uses of `doctor` by the kinds that are run, and answers by which they are said to be possible.
USES = {"navigate": "navigation", "attitude": "attitude", "crash": "crash"}
POSSIBLE = ("yes", "with limits")
#: What a person answers, by the end of a key; other numbers are one, other texts a word.
ANSWERS: dict[str, Any] = {"lat_deg": 48.0, "lon_deg": 11.0, "alt_m": 500.0, "mass_kg": 1500.0}
ANSWERS |= {"speed_km_per_h": 50.0, "speed_sd_km_per_h": 2.0, "sensor": "mpu-6050"}
#: Code of a reference that cannot be compared with, and those by which a run that was fit, as far
#: as a log tells, may say what it lacks.
UNUSED = "studio.reference-not-used"
LACKS = ("alignment.", "attitude.", "navigation.", "crash.", "io.", "sensors.")


def copied(name: str, studio: Any) -> Path:
    """A recording in the folder of a studio."""
    if not (DATA / name).is_dir():
        without(name)
    return Path(shutil.copytree(DATA / name, studio.folder / Path(name).name))


def chosen(place: Path, studio: Any) -> Iterator[list[str]]:
    """What a person ticks of a folder: itself, or where it is no log each file of it."""
    if studio.ask("POST", "api/look", {"files": [place.name]}, wait=WAIT).status == 200:
        yield [place.name]
        return
    inside = [p for p in sorted(place.iterdir()) if p.is_dir() or p.suffix not in WORDS]
    inside = inside or [p for p in sorted(place.iterdir()) if p.name.lower() not in ("license",)]
    for path in inside:
        yield [f"{place.name}/{path.name}"]
    if 1 < len(inside) <= 4:
        yield [f"{place.name}/{path.name}" for path in inside]


def refused(answer: Any) -> str:
    """Code of a refusal, which says what is wrong and is no fault of the studio's own."""
    error = answer.json["error"]
    assert answer.status in (400, 404, 409, 422), error
    assert error["text"] and not error["code"].startswith(("studio.failed", "studio.reading"))
    return str(error["code"])


def looked(studio: Any, files: list[str]) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Look, and answer what is asked by the first choice; None: it is refused."""
    log: dict[str, Any] = {}
    for _ in range(8):
        answer = studio.ask("POST", "api/look", {"files": files, "log": log}, wait=WAIT)
        if answer.status != 200:
            assert refused(answer)
            return None
        asked = [q for q in answer.json["questions"] if not q.get("optional")]
        if not asked:
            return answer.json, log
        first = asked[0]
        stated = first["choices"][0]["set"] if first["choices"] else {first["key"]: 100.0}
        assert any(log.get(key) != value for key, value in stated.items()), ("again", first)
        log |= stated
    raise AssertionError(f"{files}: the questions do not end")


def drawn(studio: Any, found: dict[str, Any], log: dict[str, Any]) -> None:
    """Every stream that is listed has its curves."""
    for one in found["streams"]:
        query = {"file": one["file"], "stream": one["name"], "width": 40, "log": json.dumps(log)}
        series = studio.ask("GET", f"api/series?{urlencode(query)}", wait=WAIT)
        assert series.status == 200, (one["file"], one["name"], series.body[:300])
        assert set(series.json["columns"]) == {column["name"] for column in one["columns"]}
        assert len(series.json["t"]) <= 40 and (series.json["t"] or not one["rows"])


def filled(studio: Any, kind: str, made: dict[str, Any]) -> str:
    """The configuration with every question answered."""
    asked = {q["key"]: q for q in made["questions"]}
    checked = studio.ask("POST", "api/check", {"kind": kind, "toml": made["toml"]}).json
    stated: dict[str, Any] = {}
    for key, value in checked["values"].items():
        is_open = value == "?" or (isinstance(value, list) and "?" in value)
        assert is_open == (key in asked), (key, value)
        if not is_open:
            continue
        own = ANSWERS.get(key.rsplit(".", 1)[-1], 1.0 if asked[key]["unit"] else "as stated")
        stated[key] = [0.5 if v == "?" else v for v in value] if isinstance(value, list) else own
    checked = studio.ask("POST", "api/check", {"kind": kind, "toml": made["toml"], "set": stated})
    assert not checked.json["errors"], (kind, checked.json["errors"])
    return str(checked.json["toml"])


def proposed(studio: Any, kind: str, files: list[str], found: Any, log: Any) -> Any:
    """A proposal for the first part of a log; questions about the files have their first answer."""
    asked = {"kind": kind, "files": files, "log": log}
    imu = next((one for one in found["streams"] if one["name"] == "imu"), None)
    if imu is not None and kind != "crash":
        asked |= {"from_s": imu["from_s"], "to_s": min(imu["to_s"], imu["from_s"] + PART)}
    answer = studio.ask("POST", "api/propose", asked, wait=WAIT)
    for _ in range(3):
        if answer.status != 200 or not answer.json["choose"]:
            break
        assert not answer.json["toml"]
        asked["log"] = {**asked["log"], **answer.json["choose"][0]["choices"][0]["set"]}
        answer = studio.ask("POST", "api/propose", asked, wait=WAIT)
    return answer


#: Every recording, by its folder.
EVERY = (*RECORDINGS, *(f"zoo/{name}" for name in ZOO))


@pytest.mark.parametrize("name", EVERY)
def test_a_recording_goes_through_or_is_told_why_not(fresh: Any, name: str) -> None:
    place = copied(name, fresh)
    seen = runs = 0
    for files in chosen(place, fresh):
        found = looked(fresh, files)
        if found is None:
            continue
        seen += 1
        drawn(fresh, *found)
        for kind, use in USES.items():
            fits = {log["fit"][use]["answer"] for log in found[0]["logs"]}
            if not fits & set(POSSIBLE):
                continue
            answer = proposed(fresh, kind, files, *found)
            if answer.status != 200:
                assert refused(answer).startswith(LACKS), (files, kind)
                continue
            title = f"{kind}-{runs}"
            asked = {"kind": kind, "name": title, "toml": filled(fresh, kind, answer.json)}
            job = fresh.ask("POST", "api/jobs", {**asked, "options": ["--no-report"]})
            assert job.status == 201, (files, kind, job.body)
            done = fresh.finished(job.json, 600.0)
            runs += 1
            if done["state"] != "done":
                assert done["state"] == "failed" and done["error"]["code"].startswith(LACKS), done
                continue
            result = fresh.ask("GET", f"api/runs/{title}")
            assert result.status == 200 and result.json["numbers"], (files, kind)
            if result.json["has"]["series"]:
                assert fresh.ask("GET", f"api/runs/{title}/series?width=20").status == 200
            # A log that has a reference is compared with it, or it is said that it is not.
            streams = {one["name"] for one in found[0]["streams"]}
            codes = {one["code"] for one in answer.json["findings"]}
            if kind == "attitude" and "reference" in streams and UNUSED not in codes:
                groups = {one["group"] for one in result.json["numbers"]}
                assert "Errors against truth" in groups, (files, groups)
    assert seen or name.startswith("zoo/")
