"""Damaged and hostile crash records: what is said is a StrapdownError, and never a traceback."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from strapdown.errors import StrapdownError
from strapdown.formats.crash_json import write_crash_json
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_table import write_crash_csv
from strapdown.formats.crash_triad import triad_of_channels
from strapdown.formats.crash_writers import write_mme

TIME = np.arange(12) * 1e-3
RECORD = CrashRecord(
    Path("seed.csv"),
    "csv",
    "a seed",
    {"mass_kg": "1500"},
    tuple(
        CrashChannel(f"a{axis}", "acceleration", axis, "m/s2", lambda k=k: (TIME, TIME * k + 1.5))
        for k, axis in enumerate("xyz")
    ),
    (),
)
TEST = "V5|a title|an aim|03/OCT/2017|MGA|DTNH|BT17|NCA|VTB|CON|DRY|22|OTH|OTH|36|0|0|0|1|none"
END = """\
----- INSTRUMENTATION -----
1|93|AC|NA|FLLR|XG|SEC|G'S|2800|M|D|800|21|36|-2|3|100|AM|P|LEFT REAR CROSSMEMBER
----- END -----
"""


def _seeds() -> dict[str, bytes]:
    """Whole files, by the name under which a reader takes them."""
    with tempfile.TemporaryDirectory() as folder:
        write_crash_csv(Path(folder) / "a.csv", RECORD)
        write_crash_json(Path(folder) / "a.json", RECORD)
        write_mme(Path(folder) / "t", RECORD, name="t")
        lines = [*(f"# {k}" for k in range(2)), "----- EV5 -----", "----- TEST -----", TEST, END]
        ev5 = "\n".join(lines).encode()
        curve = b"".join(b"%.6f\t%.3f\n" % (1e-4 * k, 0.1 * k) for k in range(-2, 4))
        edr = b"Report\nTime (msec),Longitudinal Delta-V (MPH)\n0,0\n10,-1.5\n20,-3\n"
        files = {
            "a.csv": (Path(folder) / "a.csv").read_bytes(),
            "a.json": (Path(folder) / "a.json").read_bytes(),
            "edr.csv": edr,
            "n/v1.EV5": ev5,
            "n/v1.093": curve,
        }
        for path in sorted((Path(folder) / "t").rglob("*.*")):
            files[f"t/{path.relative_to(Path(folder) / 't')}"] = path.read_bytes()
    return files


SEEDS = _seeds()


def use(path: Path) -> None:
    """Read everything that there is to read."""
    try:
        record = read_crash_record(path)
    except StrapdownError as error:
        assert error.finding.remedy
        return
    for channel in record.channels:
        assert channel.name.isprintable()
        for call in (
            channel.load,
            lambda c=channel: triad_of_channels(record, {"x": c.name}, quantity="acceleration"),
            lambda c=channel: triad_of_channels(
                record, {"y": f"-{c.name}"}, quantity="rate", unit="deg/s", rate_hz=1000.0
            ),
        ):
            try:
                call()
            except StrapdownError as error:
                assert error.finding.remedy


def whole(name: str, data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        if "/" in name:
            for other, content in SEEDS.items():
                if other.startswith(name[:2]):
                    (root / other).parent.mkdir(parents=True, exist_ok=True)
                    (root / other).write_bytes(data if other == name else content)
            use(root / name[0])
        else:
            (root / name).write_bytes(data)
            use(root / name)


ENOUGH = settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True
)


@ENOUGH
@given(st.sampled_from(sorted(SEEDS)), st.integers(0, 4000))
def test_a_file_that_was_cut(name, length):
    whole(name, SEEDS[name][:length])


@ENOUGH
@given(
    st.sampled_from(sorted(SEEDS)),
    st.lists(st.tuples(st.integers(0, 4000), st.integers(0, 255)), min_size=1, max_size=6),
)
def test_bytes_that_were_changed(name, changes):
    data = bytearray(SEEDS[name])
    for at, byte in changes:
        data[at % len(data)] = byte
    whole(name, bytes(data))


@ENOUGH
@given(
    st.sampled_from(["a.csv", "a.json", "a.mme", "a.EV5", "a", "a.txt"]), st.binary(max_size=400)
)
def test_anything(name, data):
    whole(name, data)


@pytest.mark.slow
@ENOUGH
@given(st.text(max_size=60), st.text(max_size=30), st.text(max_size=200))
def test_any_text_in_headers(name, unit, value):
    head = f"{name} [{unit}],{value}\n".encode("utf-8", "replace")
    whole("a.csv", head + b"0,1\n1,2\n2,3\n")
    key = f"{name} :{value}\nUnit :{unit}\nChannel code :{name}\n".encode("utf-8", "replace")
    whole("t/Channel/t.001", key + b"1\n2\n")
    whole("t/t.mme", key)
    whole("t/Channel/t.chn", key)


@pytest.mark.parametrize("name", sorted(SEEDS))
def test_the_seeds_are_whole(name):
    whole(name, SEEDS[name])
