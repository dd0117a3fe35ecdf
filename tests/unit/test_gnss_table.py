"""A Gnss table refuses what no receiver means, and says what was meant instead."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown import tables
from strapdown.errors import DataError
from strapdown.frames import geodetic_from_ned
from strapdown.simulation import Origin, car
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.vehicles import Straight, Turn
from strapdown.tables.gnss import check_velocity

DRIVE = car(
    Origin(48.0, 11.0, 500.0),
    [("out", Straight(10.0)), ("bend", Turn(40.0, 80.0)), ("on", Straight(5.0))],
    heading_deg=30.0,
    speed=15.0,
)
FIXES = simulate_gnss(
    DRIVE, GnssReceiver(rate=2.0, position_noise=0.5, velocity_noise=0.1), seed=1, source="a.csv"
)


def made(changed=FIXES):
    """The table once more, from its columns."""
    return tables.gnss_table(
        changed.index.to_numpy(),
        changed[tables.GEODETIC].to_numpy(),
        changed[tables.VELOCITY].to_numpy(),
        changed[tables.POSITION_SD].to_numpy(),
        changed[tables.VELOCITY_SD].to_numpy(),
        changed["quality"].to_numpy(),
        source="a.csv",
    )


def test_a_table_keeps_what_it_was_given():
    np.testing.assert_array_equal(made(), FIXES)
    assert list(FIXES.columns) == tables.GNSS
    assert FIXES.index.name == "time"
    one = tables.gnss_table(
        [0.0, 1.0], [[48, 11, 0]] * 2, np.zeros((2, 3)), (1, 1, 2), (np.inf,) * 3
    )
    assert one["down_sd"].tolist() == [2.0, 2.0]
    assert one["quality"].tolist() == [1.0, 1.0]


@pytest.mark.parametrize(
    ("column", "row", "value", "message"),
    [
        ("alt", 2, np.nan, r"a.csv, row 3, alt: not a finite number"),
        ("VE", 1, np.inf, r"a.csv, row 2, VE: not a finite number"),
        ("lat", 4, 95.0, r"row 5, lat: a latitude of 95 deg is beyond the pole(.|\n)*swapped"),
        ("north_sd", 0, -1.0, "row 1, north_sd: .*a standard deviation of"),
        ("VD_sd", 3, np.nan, "row 4, VD_sd: .*a standard deviation of"),
        ("quality", 1, 12.0, "row 2, quality: .*unknown fix quality"),
    ],
)
def test_a_bad_value_is_named(column, row, value, message):
    changed = FIXES.copy()
    changed.iloc[row, changed.columns.get_loc(column)] = value
    with pytest.raises(DataError, match=message):
        made(changed)


def test_time_and_columns_are_checked():
    back = FIXES.copy()
    back.index = back.index.to_numpy()[::-1]
    with pytest.raises(
        DataError,
        match="row 2, time",
        check=lambda refused: refused.finding.code == "tables.time-does-not-advance-followed",
    ):
        made(back)
    with pytest.raises(DataError, check=coded("tables.missing-columns")):
        tables.check_gnss(FIXES.drop(columns="VD_sd"))


@pytest.mark.parametrize(
    ("change", "remedy"),
    [
        ({"VN": 3.6, "VE": 3.6}, r"m/s\) contradicts the positions, which move at"),
        ({"VN": 1.943844, "VE": 1.943844}, "in kn: multiply by 0.514"),
    ],
)
def test_velocities_in_another_unit_are_told(change, remedy):
    with pytest.raises(DataError, match=remedy):
        made(FIXES.assign(**{c: FIXES[c] * k for c, k in change.items()}))


def test_exchanged_columns_are_told():
    with pytest.raises(DataError, check=coded("tables.velocity-north-east-exchanged")):
        made(FIXES.assign(VN=FIXES["VE"], VE=FIXES["VN"]))
    # Both are below 90 here, so that only the motion tells it.
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "tables.places-swapped"
    ):
        made(FIXES.assign(lat=FIXES["lon"], lon=FIXES["lat"]))


def drawn(seed, speed, white, lasting, hill=0.0, rows=300):
    """A winding way with errors of the positions that last for a minute, and exact velocities."""
    rng = np.random.default_rng(seed)
    t = np.arange(rows, dtype=float)
    course = rng.uniform(0.0, 6.3) + 0.9 * np.sin(t / 11.0) + t / 24.0
    ahead = speed * (1.0 + 0.5 * np.sin(t / 7.0))
    v = np.column_stack(
        [ahead * np.cos(course), ahead * np.sin(course), hill / 30 * np.cos(t / 30)]
    )
    way = np.vstack([np.zeros(3), np.cumsum(0.5 * (v[1:] + v[:-1]), axis=0)])
    errors, keep = rng.normal(size=(rows, 3)), np.exp(-1.0 / 60.0)
    for k in range(1, rows):
        errors[k] = keep * errors[k - 1] + np.sqrt(1.0 - keep**2) * errors[k]
    way += (lasting * errors + white * rng.normal(size=(rows, 3))) * [1.0, 1.0, 2.0]
    place = geodetic_from_ned(way, (48.1, 11.5, 500.0))
    sd = np.hypot(white, lasting)
    return t, place, v + 0.2 * rng.normal(size=(rows, 3)), (sd, sd, 2 * sd), (0.2, 0.2, 0.2)


KINDS = [(0.0, 0.5, 2.0), (0.3, 1.0, 2.0), (1.3, 0.5, 1.0), (15.0, 0.3, 1.0), (15.0, 2.0, 4.0)]


@pytest.mark.parametrize("kind", KINDS)
def test_right_velocities_are_never_refused_nor_called_unlike(kind):
    """A stand, a crawl, a walk and drives; stated deviations are wrong by a factor of two, too."""
    for seed in range(40):
        t, place, v, sd, v_sd = drawn(seed, *kind)
        for wrong in (0.5, 1.0, 2.0):
            table = tables.gnss_table(t, place, v, wrong * np.array(sd), v_sd)
            fit = check_velocity(table)
            assert fit is None or fit.name


@pytest.mark.parametrize(
    ("change", "code", "data"),
    [
        (lambda v: v * [-1, -1, 1], "tables.velocity-turned", {"north": "-VN", "east": "-VE"}),
        (lambda v: v * [-1, 1, 1], "tables.velocity-turned", {"north": "-VN", "east": "VE"}),
        (lambda v: v[:, [1, 0, 2]] * [1, -1, 1], "tables.velocity-turned", {"north": "-VE"}),
        (lambda v: v[:, [1, 0, 2]], "tables.velocity-north-east-exchanged", {}),
        (lambda v: v / 0.44704, "tables.velocity-in-other-unit", {"unit": "mph"}),
        (lambda v: v * 100, "tables.velocity-in-other-unit", {"unit": "cm/s"}),
        (lambda v: v * [1, 1, -1], "tables.velocity-up", {}),
    ],
)
@pytest.mark.parametrize("kind", KINDS[2:4])
def test_another_direction_or_unit_is_told_of_a_walk_and_of_a_drive(change, code, data, kind):
    for seed in range(5):
        t, place, v, sd, v_sd = drawn(seed, *kind, hill=40.0)
        with pytest.raises(DataError) as refused:
            tables.gnss_table(t, place, change(v), sd, v_sd)
        assert refused.value.finding.code == code
        assert data.items() <= refused.value.finding.data.items()


def flown(seed, alt_unit=1.0, down_unit=1.0, white=2.0):
    """Six minutes of a flight that climbs and descends, its heights with the scatter of code."""
    rng = np.random.default_rng(seed)
    t = np.arange(360.0)
    up = 2.5 * np.sin(t / 23.0) + np.where((t > 60) & (t < 120), 2.0, 0.0)
    way = np.column_stack([20.0 * t, 0.0 * t, -np.r_[0.0, np.cumsum(0.5 * (up[1:] + up[:-1]))]])
    place = geodetic_from_ned(way, (48.1, 11.5, 500.0))
    place[:, 2] = (place[:, 2] + white * rng.normal(size=t.size)) / alt_unit
    v = np.column_stack([20.0 + 0.0 * t, 0.0 * t, -up + 0.2 * rng.normal(size=t.size)])
    v[:, 2] /= down_unit
    # As is assumed of fixes that state none: too much for a step of the heights to be clear.
    return tables.gnss_table(t, place, v, (30.0,) * 3, (0.3,) * 3)


@pytest.mark.parametrize(
    ("alt", "down", "stated"),
    [
        (0.3048, 1.0, "alt=ft"),
        (1.0, -1.0, "VD=-m/s"),
        (0.3048, -1.0, "alt=ft,VD=-m/s"),
        (0.3048, 0.3048 / 60.0, "alt=ft,VD=ft/min"),
        (1.0, -0.3048 / 60.0, "VD=-ft/min"),
        (1.0, 1.0 / 3.6, "VD=km/h"),
    ],
)
def test_heights_and_climbs_of_another_unit_are_told_by_each_other(alt, down, stated):
    for seed in range(5):
        flags = f"--gnss-units {stated}"
        with pytest.raises(DataError, check=coded("tables.heights-unlike-climb", flags=flags)):
            flown(seed, alt, down)


def test_right_heights_are_not_refused():
    for seed in range(40):
        flown(seed)
        flown(seed, white=20.0)


def test_velocities_of_nothing_are_called_unlike():
    """As in body axes: forward, and nothing to the right."""
    t, place, v, sd, v_sd = drawn(3, 15.0, 0.3, 1.0)
    body = np.column_stack([np.hypot(v[:, 0], v[:, 1]), np.zeros(len(v)), v[:, 2]])
    fit = check_velocity(tables.gnss_table(t, place, body, sd, v_sd))
    assert fit is not None and not fit.name


def test_places_in_radians_move_too_slowly():
    t, place, v, sd, v_sd = drawn(2, 15.0, 0.3, 1.0)
    with pytest.raises(DataError, check=coded("tables.places-in-radians")):
        tables.gnss_table(t, place * [np.radians(1.0), np.radians(1.0), 1.0], v, sd, v_sd)


def test_false_fixes_a_stand_and_unmeasured_velocities_are_no_wrong_units():
    wild = FIXES.copy()
    wild.iloc[-8:, :6] += np.random.default_rng(1).standard_normal((8, 6)) * [
        1e-3,
        1e-3,
        99,
        50,
        50,
        9,
    ]
    made(wild)
    still = FIXES.assign(lat=48.0, lon=11.0, VN=0.1, VE=0.1)
    made(still)
    made(FIXES.assign(VN=0.0, VE=0.0, VN_sd=np.inf, VE_sd=np.inf, VD_sd=np.inf))
