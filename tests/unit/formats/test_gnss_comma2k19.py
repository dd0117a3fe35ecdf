"""Fixes of a comma2k19 segment: a made one in the layout of its README, and the recorded one.

The layout: https://github.com/commaai/comma2k19, README, "Log Format". Made here, so synthetic:
no receiver has seen these places.
"""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown import frames
from strapdown.errors import DataError
from strapdown.formats import files_of
from strapdown.formats.comma2k19 import RECEIVERS
from strapdown.formats.gnss_files import GnssOptions, read_gnss

BOOT, UTC = 46_408.0, 1_533_226_488.0
SPEED, BEARING = 20.0, 30.0
OPTIONS = GnssOptions(position_sd=2.0, velocity_sd=0.3)


def fixes(count=40, step=0.1):
    """Stamps and values: fixes each tenth of a second, written 20 to 60 ms after they were made."""
    made = step * np.arange(count)
    late = 0.02 + 0.04 * np.random.default_rng(3).random(count)
    late[7] = 0.02
    value = np.column_stack(
        [
            37.7 + 1e-6 * np.arange(count),
            -122.4 + 1e-6 * np.arange(count),
            np.full(count, SPEED),
            1e3 * (UTC + made),
            np.full(count, 12.0),
            np.full(count, BEARING),
        ]
    )
    return made, BOOT + made + late, value


def written(folder, t, value, receiver=RECEIVERS[0], flat=False):
    folder.mkdir(exist_ok=True)
    if flat:
        np.save(folder / f"GNSS__{receiver}__t.npy", t)
        np.save(folder / f"GNSS__{receiver}__value.npy", value)
        return folder
    own = folder / "processed_log" / "GNSS" / receiver
    own.mkdir(parents=True)
    for name, array in (("t", t), ("value", value)):
        with (own / name).open("wb") as stream:
            np.save(stream, array)
    return folder


@pytest.mark.parametrize("flat", [True, False])
def test_fixes_are_dated_by_utc_on_the_clock_of_the_device(tmp_path, flat):
    made, t, value = fixes()
    folder = written(tmp_path / "10", t, value, flat=flat)
    table = read_gnss(folder, OPTIONS)
    # The soonest is 20 ms late, and so are all then; UTC in ms has 2^-12 ms, the sum 2^-22 s.
    np.testing.assert_allclose(table.index, BOOT + made + 0.02, atol=1e-6, rtol=0)
    assert np.array_equal(table[["lat", "lon", "alt"]], value[:, [0, 1, 4]])
    # cos 30° = √3/2; down is not measured, and weighs nothing.
    np.testing.assert_allclose(table["VN"], SPEED * np.sqrt(0.75), rtol=1e-15)
    np.testing.assert_allclose(table["VE"], SPEED / 2.0, rtol=1e-15)
    assert (table["VD_sd"] == np.inf).all()
    assert (table[["VN_sd", "VE_sd"]] == 0.3).all(axis=None)
    assert "dated by its UTC" in str(table.attrs["findings"][0])
    assert [f.name.split("__")[-1].removesuffix(".npy") for f in files_of(folder)] == [
        "t",
        "value",
    ]


def test_utc_in_seconds_as_the_readme_has_it_gives_the_same(tmp_path):
    _, t, value = fixes()
    in_ms = read_gnss(written(tmp_path / "ms", t, value), OPTIONS)
    value[:, 3] *= 1e-3
    in_s = read_gnss(written(tmp_path / "s", t, value), OPTIONS)
    # Seconds since 1970 in a float64 are known to 2.4e-7 s.
    np.testing.assert_allclose(in_s.index, in_ms.index, atol=1e-6, rtol=0)


def test_without_utc_the_stamps_stay(tmp_path):
    _, t, value = fixes()
    value[5, 3] = np.nan
    table = read_gnss(written(tmp_path / "10", t, value), OPTIONS)
    assert np.array_equal(table.index, t)
    assert "their time of writing" in str(table.attrs["findings"][0])


def test_of_two_receivers_the_faster_is_taken_and_the_other_by_its_folder(tmp_path):
    _, t, value = fixes()
    folder = written(tmp_path / "10", t, value)
    written(folder, t[::20], value[::20], receiver=RECEIVERS[1])
    assert len(read_gnss(folder, OPTIONS)) == 40
    assert len(read_gnss(folder / "processed_log" / "GNSS" / RECEIVERS[1], OPTIONS)) == 2


def test_one_array_alone_names_the_folder(tmp_path):
    _, t, value = fixes()
    folder = written(tmp_path / "10", t, value, flat=True)
    with pytest.raises(DataError, check=coded("io.fixes-comma-k-segment-two")) as told:
        read_gnss(folder / "GNSS__live_gnss_ublox__value.npy", OPTIONS)
    assert str(folder) in str(told.value)


@pytest.mark.parametrize(
    ("value", "what"),
    [
        (np.zeros((40, 5)), "shape"),
        (np.zeros((39, 6)), "shape"),
        (np.zeros((40, 6), dtype="U3"), "shape"),
        (np.array([{"run": "me"}] * 40, dtype=object), "could run code"),
    ],
)
def test_arrays_of_another_shape_are_refused(tmp_path, value, what):
    _, t, _ = fixes()
    with pytest.raises(DataError, match=what):
        read_gnss(written(tmp_path / "10", t, value), OPTIONS)


def test_a_folder_without_fixes_is_told(tmp_path):
    with pytest.raises(DataError, check=coded("io.folder-no-known-recording-holds")):
        read_gnss(tmp_path, OPTIONS)


def test_the_recorded_segment_lies_on_its_pose(recordings):
    """Read as the README says, places, heights and velocities are those of the pose beside them.

    The pose is that of the camera, by an optimiser of its authors; the antenna is within a metre
    or two of it, the receiver's places within some metres of the truth.
    """
    folder = recordings("phone_comma2k19")
    table = read_gnss(folder, OPTIONS)
    time, places, velocities = (
        np.load(folder / f"global_pose__frame_{what}.npy")
        for what in ("times", "positions", "velocities")
    )
    within = table[(table.index > time[0]) & (table.index < time[-1])]
    at = np.column_stack([np.interp(within.index, time, places[:, k]) for k in range(3)])
    lat, lon, alt = frames.geodetic_from_ecef(at).T
    north = np.radians(within["lat"] - lat) * 6.37e6
    east = np.radians(within["lon"] - lon) * 6.37e6 * np.cos(np.radians(lat))
    assert np.hypot(north, east).max() < 5.0
    # Of heights over the sea the geoid, 32 m below the ellipsoid there, would be in it.
    assert np.abs(within["alt"] - alt).max() < 5.0
    v = np.column_stack([np.interp(within.index, time, velocities[:, k]) for k in range(3)])
    v_n = np.einsum("nij,nj->ni", frames.C_ne(lat, lon), v)
    assert np.abs(v_n[:, 0] - within["VN"]).mean() < 0.3
    assert np.abs(v_n[:, 1] - within["VE"]).mean() < 0.3
