"""The part of a record before navigation, of a vehicle that is aligned while it moves."""

from __future__ import annotations

from types import SimpleNamespace

import pandas as pd
import pytest

from strapdown.config.navigation import NavigationSpec
from strapdown.errors import DataError
from strapdown.navigation.record import Span
from strapdown.systems.navigation_run import _begun, run_navigation

TEXT = """
[simulation]
rate_hz = 100.0
seed = 8101

[simulation.motion]
kind = "car"
lat_deg = 55.75
lon_deg = 37.62
alt_m = 150.0
heading_deg = 30.0
speed_km_per_h = 50.0
manoeuvres = [
  { do = "straight", duration_s = 8.0 },
  { do = "accelerate", to_km_per_h = 60.0, duration_s = 4.0 },
  { do = "turn_left", angle_deg = 60.0, radius_m = 40.0 },
  { do = "straight", duration_s = 20.0 },
]

[simulation.gnss.rtk]
rate_hz = 5.0
position_noise_m = 0.05
velocity_noise_m_per_s = 0.05

[sensors]
sensor = "mpu-6050"

[coarse]
kind = "gnss_course"
duration_s = 12.0

[fine]
kind = "none"

[aiding.rtk]
kind = "gnss"
"""


@pytest.mark.slow
def test_seconds_without_navigation_at_the_start_are_reported(tmp_path):
    file = tmp_path / "navigate.toml"
    file.write_text(TEXT)
    result = run_navigation(NavigationSpec.read(file), file)
    begun = float(result.record.trajectory.index[0])
    (lost,) = [f for f in result.findings if f.code == "navigation.start-lost"]
    assert lost.data["seconds"] == pytest.approx(begun - float(result.source.imu.index[0]))
    assert 11.5 < lost.data["seconds"] < 12.5
    # It says what the output lacks; nothing speaks against the rest.
    assert lost.severity == "note"


@pytest.mark.slow
def test_navigation_begins_with_the_first_sample_of_the_window(tmp_path):
    """With the state carried back; the errors there are within their bounds, smoothed as well."""
    file = tmp_path / "navigate.toml"
    file.write_text(
        TEXT.replace('kind = "gnss_course"', 'kind = "gnss_course"\nbacktrack = true')
        + '\n[smoother]\nkind = "rts"\n'
    )
    result = run_navigation(NavigationSpec.read(file), file)
    first = float(result.source.imu.index[0])
    assert not [f for f in result.findings if f.code == "navigation.start-lost"]
    assert [(span.name, span.begin) for span in result.record.modes] == [
        ("coarse", first),
        ("navigation", first),
    ]
    for record in (result.record, result.forward):
        assert float(record.trajectory.index[0]) - first < 0.02
    for differences, record in (
        (result.differences, result.record),
        (result.forward_differences, result.forward),
    ):
        # Errors of the first instants and of the seconds that the alignment used: nine quantities
        # at some sixty instants of one drive, of which not one is beyond 4.5 sd in 99 % of drives.
        sd = record.sd.loc[:12.0]
        error = differences[sd.columns].reindex(sd.index, method="nearest", tolerance=0.06)
        assert (error.abs() <= 4.5 * sd).all(axis=None)
        # The state at the first sample is known: not that of fixes of 5 cm, but to a metre.
        assert sd.iloc[0][["north", "east", "down"]].max() < 0.2
        assert sd.iloc[0][["roll", "pitch", "heading"]].max() < 6.0


@pytest.mark.slow
def test_an_alignment_does_not_end_before_its_least_time(tmp_path):
    file = tmp_path / "navigate.toml"
    ends = "until_heading_sd_deg = 15.0\nleast_s = 21.0"
    file.write_text(TEXT.replace("duration_s = 12.0", ends))
    begun = run_navigation(NavigationSpec.read(file), file).record.trajectory.index[0]
    assert begun == pytest.approx(21.0, abs=0.1)
    file.write_text(TEXT.replace("duration_s = 12.0", ends.splitlines()[0]))
    begun = run_navigation(NavigationSpec.read(file), file).record.trajectory.index[0]
    assert begun < 20.0


@pytest.mark.slow
def test_an_alignment_by_the_whole_record_leaves_it_to_navigation(tmp_path):
    """The next attempt would be after the last sample: a drawn boat was refused by 0.3 s."""
    file = tmp_path / "navigate.toml"
    ends = "until_heading_sd_deg = 15.0\nleast_s = 1000.0"
    text = TEXT.replace("duration_s = 12.0", ends)
    file.write_text(text.replace('"gnss_course"', '"gnss_course"\nbacktrack = true'))
    result = run_navigation(NavigationSpec.read(file), file)
    time = result.record.trajectory.index
    first, last = (float(result.source.imu.index[k]) for k in (0, -1))
    assert time[0] - first < 0.02
    assert time[-1] == pytest.approx(last, abs=0.11)
    assert result.record.innovations["rtk.position"]["weight north, m"].gt(0.0).mean() > 0.9
    assert [span.name for span in result.record.modes] == ["coarse", "navigation"]
    # Without samples that are left, or beyond its limits, it is refused.
    worse = text.replace('"gnss_course"', '"gnss_course"\nbacktrack = true').replace("15.0", "1e-3")
    for refused in (text, worse):
        file.write_text(refused)
        with pytest.raises(DataError) as found:
            run_navigation(NavigationSpec.read(file), file)
        assert found.value.finding.code == "navigation.samples-end-alignment-too-uncertain"


def test_an_outage_test_begins_after_an_alignment_that_used_the_fixes_as_a_whole():
    """Aligned backward, a run begins with the first sample, but has no fix of its own before."""
    backward = [Span("coarse", 0.0, 70.0), Span("fine", 70.0, 90.0), Span("navigation", 0.0, 200.0)]
    again = [Span("coarse", 210.0, 250.0), Span("navigation", 250.0, 300.0)]
    track = pd.DataFrame(index=[0.0, 300.0])
    assert _begun(SimpleNamespace(trajectory=track, modes=(*backward, *again))) == 90.0
    assert _begun(SimpleNamespace(trajectory=track, modes=(*backward[2:], *again))) == 0.0
