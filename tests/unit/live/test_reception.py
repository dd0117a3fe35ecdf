"""Lines to a chain: what is in time, late, or of no use, and the numbers of a run at once."""

from __future__ import annotations

import json
import socket
from urllib.parse import urlsplit

import numpy as np
import pytest
from tests.contracts.test_chain_cuts import LENGTH, assert_same, drive
from tests.town_drive import ARM, fixes, motion

from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec
from strapdown.errors import ConfigError
from strapdown.formats.writers import WRITERS
from strapdown.live.replay import MachineClock
from strapdown.live.run import live_spec, receive, result_of, write_received
from strapdown.live.sources import LineSource, open_source
from strapdown.navigation.recorder import FullRecorder
from strapdown.navigation.replay import run_batch
from strapdown.systems.navigation_run import make_chain

FIXES = ["lat", "lon", "alt", "VN", "VE", "VD"]
SD = ["north_sd", "east_sd", "down_sd", "VN_sd", "VE_sd", "VD_sd"]


def table(hold=0.2, **more):
    truth = motion().trajectory([0.0]).iloc[0]
    return {
        "live": {"sampling": "mean", "hold_s": hold},
        "start": {
            "lat_deg": float(truth["lat"]),
            "lon_deg": float(truth["lon"]),
            "alt_m": float(truth["alt"]),
            "v_ned_m_per_s": truth[["VN", "VE", "VD"]].tolist(),
            "roll_deg": 0.0,
            "pitch_deg": 0.0,
            "heading_deg": float(truth["heading"]),
        },
        "sensors": {"sensor": "adis16470"},
        "recorder": {"kind": "full"},
        "aiding": {"gnss": {"kind": "gnss", "lever_arm_m": list(ARM)}},
        **more,
    }


def sample(time, values):
    return "imu," + ",".join(repr(float(v)) for v in (time, *values))


def fix(time, row, columns=(*FIXES, *SD)):
    said = ",".join(f"{c}={float(row[c])!r}" for c in columns)
    return f"gnss,{float(time)!r},{said}"


def lines(late=0.0, length=LENGTH, origin=0.0, columns=(*FIXES, *SD)):
    """The drive as lines; a fix comes so long after the sample of its stamp."""
    imu = drive()
    out = [(t, sample(t + origin, row)) for t, row in zip(imu.index, imu.to_numpy(), strict=True)]
    out += [(t + late + 1e-6, fix(t + origin, row, columns)) for t, row in fixes().iterrows()]
    return [text for t, text in sorted(out) if t <= length + 1e-3]


def received(texts, spec=None, clock=None, **more):
    """What comes of lines, what was written, and what was told."""
    data = iter(["\n".join(texts).encode() + b"\n", b""])
    source = LineSource("test", lambda: next(data), clock or MachineClock(), lambda: None)
    shown, told = [], []
    live = receive(
        spec or NavigationSpec.checked(table()),
        source,
        clock or MachineClock(),
        shown.append,
        told.append,
        **more,
    )
    return live, shown, told[1:]


def at_once(spec):
    chain = make_chain(spec, sensors_of(spec))
    inside = fixes()[fixes().index <= LENGTH]
    inside.attrs = dict(fixes().attrs)
    return run_batch(chain, drive(), {"gnss": inside}, FullRecorder())


@pytest.mark.parametrize("late", [0.0, 0.15])
def test_the_numbers_are_those_of_a_run_at_once(late):
    # A fix that comes 0.15 s late is in time where samples wait for 0.2 s.
    live, _, told = received(lines(late))
    assert (live.error, told, live.got.late) == (None, [], {})
    # The last fix is of 5 s: 0.15 s late it is not among the lines.
    if late == 0.0:
        assert_same(live.run, at_once(live.spec))
    assert live.got.rows["gnss"].count == (10 if late == 0.0 else 9)


@pytest.mark.parametrize("columns", [(*FIXES, *SD), (*FIXES[:3], *SD[:3])])
@pytest.mark.parametrize("origin", [0.0, 1.7e9])
def test_what_was_received_is_read_to_the_same_numbers(tmp_path, origin, columns):
    live, _, told = received(lines(origin=origin, columns=columns))
    assert told == []
    result = result_of(live, tmp_path)
    # The states that were computed while the samples came, and not new ones.
    assert result.record is live.run.record
    imu, fixed = result.source.imu, result.source.tables["gnss"]
    again = run_batch(
        make_chain(result.spec, sensors_of(result.spec)), imu, {"gnss": fixed}, FullRecorder()
    )
    assert_same(live.run, again)


def test_a_fix_that_comes_too_late_is_counted_and_not_used(tmp_path):
    live, _, told = received(lines(0.4))
    assert live.got.late["gnss"] == 9
    assert len(told) == 1
    assert told[0].code == "live.late"
    assert told[0].data["delay"] == pytest.approx(0.4, abs=1e-9)
    assert live.got.rows["gnss"].count == 0
    assert live.run.record.innovations == {}
    # It runs again without any: the aid has states, but no file.
    spec = write_received(live.spec, live.got, tmp_path)
    assert spec.aiding["gnss"].path is None


def test_a_line_that_cannot_be_used_changes_nothing():
    good = lines(length=3.0)
    bad = [
        "imu,1,2,3",
        "imu,5,6",
        "what,1",
        "\ufffd",
        good[20],  # its time has been
        "gnss,1.0,lat=45.0",
        "gnss,1.0,height=3.0",
        "gnss,1.0,lat=95.0,lon=20.0,alt=0,north_sd=1,east_sd=1,down_sd=1",
        "command,sideways",
    ]
    mixed = [*good[:40], *bad, *good[40:]]
    live, _, told = received(mixed)
    clean, _, _ = received(good)
    assert_same(live.run, clean.run)
    assert live.got.unused == {"imu": 2, "word": 2, "time": 1, "gnss": 3, "command": 1}
    # Once a kind, with its line and a remedy.
    assert len(told) == 5
    assert {one.code for one in told} == {"live.line-not-used"}
    assert told[0].line == 41
    assert told[0].data["reason"].code == "live.wrong-number-of-values"
    assert all(one.remedy for one in told)


def test_a_row_that_repeats_its_stamp_is_not_used():
    good = lines(length=2.0)
    place = next(k for k, text in enumerate(good) if text.startswith("gnss"))
    live, _, told = received([*good[: place + 1], good[place], *good[place + 1 :]])
    assert live.got.unused == {"gnss time": 1}
    assert told[0].data["reason"].code == "live.row-not-later"


def test_an_end_that_is_commanded():
    good = lines()
    live, _, _ = received([*good[:150], "command,end", *good[150:]])
    assert live.got.lines == 151
    assert live.error is None
    assert len(live.got.samples) == sum(text.startswith("imu") for text in good[:150])


def test_a_gap_that_is_not_bridged_ends_it_before_the_gap():
    good = [text for text in lines() if not 2.0 < float(text.split(",")[1]) < 3.5]
    live, _, _ = received(good)
    assert "a gap of" in live.error.finding.what
    assert live.got.samples[-1, 0] == 2.0
    assert live.run.record.trajectory.index[-1] == 2.0


def test_before_navigation_began_there_is_no_run():
    live, _, _ = received(lines(length=0.0), NavigationSpec.checked(table()))
    assert live.run is None
    assert live.error is not None


def test_a_commanded_mode_begins_where_it_did_when_it_runs_again(tmp_path):
    more = {
        "start": None,
        "site": {"lat_deg": 45.0, "lon_deg": 20.0, "alt_m": 80.0},
        "coarse": {"kind": "known_heading", "heading_deg": 0.0, "sd_deg": 1.0},
        "fine": {"kind": "none"},
    }
    spec = NavigationSpec.checked({k: v for k, v in table(**more).items() if v is not None})
    good = lines()
    live, _, told = received([*good[:100], "command,navigation", *good[100:]], spec)
    assert told == []
    assert [one.mode for one in live.got.commands] == ["navigation"]
    result = result_of(live, tmp_path)
    again = run_batch(
        make_chain(result.spec, sensors_of(result.spec)),
        result.source.imu,
        result.source.tables,
        FullRecorder(),
    )
    assert_same(live.run, again)


def test_axes_that_are_stated_turn_the_samples(tmp_path):
    # The sensor's x, y, z point right, forward, up.
    imu = drive()
    values = imu.to_numpy()
    own = np.column_stack([values[:, [1, 0]], -values[:, 2], values[:, [4, 3]], -values[:, 5]])
    texts = [sample(t, row) for t, row in zip(imu.index, own, strict=True)]
    spec = NavigationSpec.checked(table(axes={"axes": "right-forward-up"}))
    live, _, _ = received(texts, spec)
    np.testing.assert_array_equal(live.got.samples[:, 1:], values)
    assert write_received(spec, live.got, tmp_path).axes.axes is None


def test_states_as_lines():
    _, shown, _ = received(lines(length=4.0), every=1.0)
    told = [json.loads(text) for text in shown]
    # The first come when 64 samples have told their usual step: at 1.26 s.
    np.testing.assert_allclose([one["time"] for one in told], [1.26, 2.26, 3.26], atol=1e-9)
    truth = motion().trajectory([one["time"] for one in told])
    np.testing.assert_allclose([o["lat"] for o in told], truth["lat"], atol=5e-5)  # 5 m
    assert all(0.0 < one["north_sd"] < 20.0 for one in told)
    assert {one["mode"] for one in told} == {"navigation"}


def test_states_by_commas():
    _, shown, _ = received(lines(length=2.0), form="csv", every=0.0)
    names = shown[0].strip().split(",")
    assert names[:5] == ["time", "mode", "lat", "lon", "alt"]
    rows = [text.strip().split(",") for text in shown[1:]]
    assert {len(row) for row in rows} == {len(names)}
    times = [float(row[0]) for row in rows]
    assert times == sorted(times)


def test_a_form_or_an_interval_that_is_none():
    with pytest.raises(ConfigError, match="--lines"):
        received([], form="xml")
    with pytest.raises(ConfigError, match="--every"):
        received([], every=-1.0)


def test_whoever_read_the_lines_has_gone():
    def gone(text):
        raise BrokenPipeError

    data = iter([("\n".join(lines()) + "\n").encode(), b""])
    source = LineSource("test", lambda: next(data), MachineClock(), lambda: None)
    live = receive(NavigationSpec.checked(table()), source, MachineClock(), gone, lambda text: None)
    assert live.got.lines < len(lines())
    assert live.run is not None


def test_of_a_record_the_same_with_lines(tmp_path):
    WRITERS["csv"].write(tmp_path / "log.csv", {"imu": drive()})
    (tmp_path / "fix.csv").write_text("time_s,lat,lon,alt,sdn,sde,sdd\n")
    whole = table()
    whole["live"] = None
    whole["log"] = {"path": str(tmp_path / "log.csv"), "sampling": "mean"}
    whole["aiding"]["gnss"]["path"] = str(tmp_path / "fix.csv")
    spec = live_spec(NavigationSpec.checked({k: v for k, v in whole.items() if v is not None}))
    assert spec.log is None
    assert spec.aiding["gnss"].path is None
    assert spec.live.sampling == "mean"


def test_datagrams_to_a_commanded_end_are_the_batch_run():
    clock = MachineClock()
    source = open_source("udp://127.0.0.1:0", clock, None, "word-of-this-run")
    texts = [*lines(), "command,end", "command,end,another-word", "command,end,word-of-this-run"]

    def send(note):
        if note.code != "live.listening":
            return
        address = urlsplit(note.data["source"])
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for first in range(0, len(texts), 10):
                data = "\n".join(texts[first : first + 10]).encode()
                sender.sendto(data, (address.hostname, address.port))

    live = receive(NavigationSpec.checked(table()), source, clock, lambda text: None, send)
    assert live.got.lines == len(texts)
    assert live.got.unused == {"command refused": 2}
    assert_same(live.run, at_once(live.spec))
    assert live.latency.samples <= len(drive())
