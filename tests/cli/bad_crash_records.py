"""Bad crash records: the files, what is called, and what is said about it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from strapdown.errors import StrapdownError
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_triad import triad_of_channels

CHANNEL = """\
Channel code                :10VEHC0000CGACXC
Unit                        :g
Reference channel           :implicit
Time of first sample        :-0.01
Sampling interval           :0.0001
Number of samples           :4
-0.5
-1.5
-2.5
-3.5
"""
MME = "Title                       :a test\nNumber of test objects      :1\n"
LOG = "t [ms],ax [g],ay [g]\n0,-0.1,0.0\n1,-0.2,0.1\n2,-4.2,0.1\n3,-9.1,0.0\n"
EDR = "Time (msec),Longitudinal Delta-V (MPH)\n0,0\n10,-1.5\n20,-4\n"


@dataclass(frozen=True)
class RecordCall:
    """Files of a record, the channels that are asked of it, and what a case states of them."""

    title: str
    files: dict[str, str]
    channels: dict[str, str]
    quantity: str = "acceleration"
    stated: tuple[tuple[str, object], ...] = ()

    @property
    def source(self) -> str:
        """The call, in words."""
        said = "".join(f", {key}={value!r}" for key, value in self.stated)
        call = f"triad_of_channels(record, {self.channels}, quantity={self.quantity!r}{said})"
        # As the project writes Python.
        return call.replace("'", '"')

    @property
    def call(self) -> Callable[[], object]:
        """Read the record and take the triad out."""

        def read() -> object:
            with tempfile.TemporaryDirectory() as folder:
                for name, text in self.files.items():
                    path = Path(folder) / name
                    path.parent.mkdir(parents=True, exist_ok=True)
                    path.write_text(text, encoding="utf-8")
                first = next(iter(self.files))
                record = read_crash_record(Path(folder) / first)
                table = triad_of_channels(
                    record, self.channels, quantity=self.quantity, **dict(self.stated)
                )
                return (*record.findings, *table.attrs["findings"])

        return read

    @property
    def said(self) -> str:
        """The error, or what was found."""
        try:
            found = self.call()
        except StrapdownError as error:
            return f"{type(error).__name__}: {error}"
        return "\n".join(f"note: {finding}" for finding in found)


def test_of(channel: str) -> dict[str, str]:
    """A test in ISO MME of one channel."""
    index = "Number of channels :1\nName of channel 001 :10VEHC0000CGACXC / vehicle\n"
    return {"T1.mme": MME, "Channel/T1.chn": index, "Channel/T1.001": channel}


X = {"x": "ax [g]"}
CAR = {"x": "10VEHC0000CGACXC"}
RECORD_CALLS = (
    RecordCall("An empty record", {"log.csv": ""}, X),
    RecordCall("A channel that is not there", {"log.csv": LOG}, {"x": "a_x [g]"}),
    RecordCall("A gyro asked of an accelerometer", {"log.csv": LOG}, X, "rate"),
    RecordCall("A unit against that of the file", {"log.csv": LOG}, X, stated=(("unit", "m/s2"),)),
    RecordCall("A unit of another quantity", {"log.csv": LOG}, X, stated=(("unit", "deg/s"),)),
    RecordCall("No unit", {"log.csv": LOG.replace(" [g]", "")}, {"x": "ax"}),
    RecordCall("A channel named twice", {"log.csv": LOG}, {"x": "ax [g]", "y": "-ax [g]"}),
    RecordCall("The other sign", {"log.csv": LOG}, {"x": "-ax [g]"}),
    RecordCall("NaN in a channel", {"log.csv": LOG.replace("-4.2", "NaN")}, X),
    RecordCall("A value of no sensor", {"log.csv": LOG.replace("-4.2", "-4.2e24")}, X),
    RecordCall("Text in a channel", {"log.csv": LOG.replace("-4.2", "off")}, X),
    RecordCall("A record's time that goes back", {"log.csv": LOG.replace("\n3,", "\n1,")}, X),
    RecordCall("Stamps that repeat", {"log.csv": LOG.replace("\n3,", "\n2,")}, X),
    RecordCall("A unit of time against that of the file", {"log.csv": LOG}, X,
               stated=(("time_unit", "s"),)),
    RecordCall("A rate against the stamps", {"log.csv": LOG}, X, stated=(("rate_hz", 100.0),)),
    RecordCall("No stamps", {"log.csv": "0.1\n0.4\n0.2\n"}, {"x": "column 1"},
               stated=(("unit", "g"),)),
    RecordCall("A table of an event data recorder", {"edr.csv": EDR},
               {"x": "Longitudinal Delta-V (MPH)"}),
    RecordCall("ISO MME: a channel that was cut", test_of(CHANNEL[:-10]), CAR),
    RecordCall("ISO MME: a line that is no number",
               test_of(CHANNEL.replace("-2.5", "-2.5.1")), CAR),
    RecordCall("ISO MME: no interval", test_of(CHANNEL.replace(":0.0001", ":NOVALUE")), CAR),
    RecordCall("ISO MME: stamps of a channel that is not there",
               test_of(CHANNEL.replace("implicit", "explicit")), CAR),
    RecordCall("ISO MME: no channels", {"T1.mme": MME}, CAR),
    RecordCall("ISO MME: a channel that failed",
               test_of("Data status :channel failed\n" + CHANNEL), CAR),
    RecordCall("A JSON that was cut", {"a.json": '{"format":"strapdown crash record","version":1'},
               X),
)  # fmt: skip
