"""Sensors joined as they arrive: the numbers of whole tables, and faults that are counted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from strapdown.formats.join import join
from strapdown.formats.known_formats import force_of, sensor_log
from strapdown.formats.sensor_streams import (
    ACCEL,
    FIX,
    GRAVITY,
    GYRO,
    LINEAR,
    MAG,
    Event,
    Joined,
    SensorStreams,
    is_event,
)

BEGIN = 1_698_501_144_401_773_000


def drawn(rate, seconds, seed, offset=0, jitter=200_000):
    """Stamps of a sensor that are not even, ns, and three values each."""
    rng = np.random.default_rng(seed)
    count = int(rate * seconds)
    stamps = BEGIN + offset + (np.arange(count) * 1e9 / rate).astype(np.int64)
    stamps += rng.integers(-jitter, jitter, count)
    return np.sort(stamps), rng.normal(0.0, 1.0, (count, 3))


def events(*sensors):
    out = [
        Event(kind, int(stamp), tuple(row.tolist()))
        for kind, (stamps, values) in sensors
        for stamp, row in zip(stamps, values, strict=True)
    ]
    return sorted(out, key=lambda one: one.stamp)


def taken(given, hold=0.0):
    streams = SensorStreams(hold)
    rows = [row for event in given for row in streams.take(event)]
    return [*rows, *streams.finish()], streams


def table(stamps, values, triad, unit):
    columns = {"time": stamps, **{a: values[:, k] for k, a in enumerate("xyz")}}
    return sensor_log(triad, Path(triad), columns, triad, unit, time=("time", "ns"))


def arrays(rows):
    return (np.array([getattr(one, name) for one in rows]) for name in ("time", "gyro", "accel"))


@pytest.mark.parametrize("mag", [False, True])
def test_what_arrives_is_joined_to_the_bits_of_whole_tables(mag):
    gyro, accel = drawn(100.0, 30.0, 1), drawn(97.0, 30.0, 2, 1_300_000)
    field = drawn(51.0, 30.0, 3, 2_000_000)
    logs = [table(*gyro, "gyro", "rad/s"), table(*accel, "accel", "m/s2")]
    logs += [table(*field, "mag", "uT")] * mag
    whole = join(logs, "phone")
    rows, streams = taken(events((GYRO, gyro), (ACCEL, accel), *[(MAG, field)] * mag))
    block = np.column_stack([whole.columns[f"accel/{a}"] for a in "xyz"])
    # What no magnetometer covers any more is used without it, at the end alone.
    rows = rows[: len(block)]
    time, rates, forces = arrays(rows)
    stamps = whole.columns["gyro/time"]
    np.testing.assert_array_equal(time, (stamps - streams.epoch * 10**9) * 1e-9)
    np.testing.assert_array_equal(
        rates, np.column_stack([whole.columns[f"gyro/{a}"] for a in "xyz"])
    )
    np.testing.assert_array_equal(forces, block)
    if mag:
        fields = np.array([one.mag for one in rows])
        own = np.column_stack([whole.columns[f"mag/{a}"] for a in "xyz"])
        np.testing.assert_array_equal(fields, own)


def test_linear_acceleration_and_gravity_are_added_as_in_files():
    gyro, linear = drawn(100.0, 10.0, 1), drawn(100.0, 10.0, 2)
    gravity = drawn(100.0, 10.0, 4, 900_000)
    logs = [table(*linear, "accel", "m/s2"), table(*gravity, "accel", "m/s2")]
    whole = join([table(*gyro, "gyro", "rad/s"), force_of(*logs)], "phone")
    rows, _ = taken(events((GYRO, gyro), (LINEAR, linear), (GRAVITY, gravity)))
    _, _, forces = arrays(rows)
    own = np.column_stack([whole.columns[f"accel/{a}"] for a in "xyz"])
    np.testing.assert_array_equal(forces, own)


def test_order_of_the_sensors_and_batches_do_not_change_a_bit():
    gyro, accel = drawn(200.0, 10.0, 1), drawn(200.0, 10.0, 2)
    given = events((GYRO, gyro), (ACCEL, accel))
    one, _ = taken(given)
    # In messages of 40 ms, in each all of one sensor before the other.
    batches: dict[int, list[Event]] = {}
    for event in given:
        batches.setdefault(event.stamp // 40_000_000, []).append(event)
    other, _ = taken(
        [e for b in batches.values() for e in sorted(b, key=lambda e: (-e.kind, e.stamp))]
    )
    assert one == other


def test_repeated_late_and_wild_samples_are_counted_and_change_nothing():
    gyro, accel = drawn(100.0, 10.0, 1), drawn(100.0, 10.0, 2)
    given = events((GYRO, gyro), (ACCEL, accel))
    rows, streams = taken(given)
    usual = streams.unused  # at the ends
    worse = list(given)
    worse.insert(300, given[290])  # repeated
    wild = given[400]._replace(stamp=given[400].stamp + 10**13)
    worse.insert(500, wild)
    late = Event(GYRO, given[700].stamp + 1, (9.0, 9.0, 9.0))
    worse.insert(900, late)
    other, streams = taken(worse)
    assert other == rows
    assert streams.unused - usual == {"repeated": 1, "stamp not confirmed": 1, "late": 1}
    assert not streams.went_back


def test_messages_that_overtake_are_put_in_order_if_it_waits_for_them():
    gyro, accel = drawn(100.0, 10.0, 1), drawn(100.0, 10.0, 2)
    given = events((GYRO, gyro), (ACCEL, accel))
    rows, usual = taken(given)
    batches = [given[k : k + 20] for k in range(0, len(given), 20)]
    batches[10], batches[11] = batches[11], batches[10]
    swapped = [event for batch in batches for event in batch]
    other, streams = taken(swapped, 0.3)
    assert (other, streams.unused) == (rows, usual.unused)
    less, streams = taken(swapped)
    assert streams.unused["late"] == 20
    assert not streams.went_back  # a message that is late is no clock that was set
    # Of a batch of both sensors; and accelerations are interpolated over what is late.
    assert len(rows) - len(less) == sum(e.kind == GYRO for e in batches[11])


def test_a_clock_that_goes_back_ends_the_session_and_one_that_jumps_is_a_gap():
    gyro, accel = drawn(100.0, 10.0, 1), drawn(100.0, 10.0, 2)
    given = events((GYRO, gyro), (ACCEL, accel))
    back = [event._replace(stamp=event.stamp - 3_600 * 10**9) for event in given]
    _, streams = taken([*given, *back[:18]])
    assert not streams.went_back
    _, streams = taken([*given, *back[:40]])
    assert streams.went_back
    ahead = [event._replace(stamp=event.stamp + 3_600 * 10**9) for event in given]
    rows, streams = taken([*given, *ahead])
    assert not streams.went_back
    assert len(rows) > 1990
    assert np.diff([one.time for one in rows]).max() == pytest.approx(3_590.0, abs=0.1)


def test_without_an_accelerometer_samples_are_counted_and_without_a_field_they_are_used():
    gyro, accel = drawn(100.0, 10.0, 1), drawn(100.0, 10.0, 2)
    field = drawn(50.0, 3.0, 3, 2 * 10**9)
    rows, streams = taken(events((GYRO, gyro)))
    assert (rows, streams.unused) == ([], {"without the other sensors": 1000})
    rows, streams = taken(events((GYRO, gyro), (ACCEL, accel), (MAG, field)))
    assert len(rows) >= 998
    with_field = [one.time for one in rows if isinstance(one, Joined) and one.mag is not None]
    assert 290 < len(with_field) < 301


@pytest.mark.parametrize(
    "event",
    [
        (GYRO, BEGIN, (1.0, 2.0)),
        (GYRO, BEGIN, (1.0, 2.0, float("nan"))),
        (GYRO, BEGIN, (1.0, 2.0, 1e5)),
        (ACCEL, BEGIN, (1.0, 2.0, float("inf"))),
        (MAG, 10**19, (1.0, 2.0, 3.0)),
        (FIX, BEGIN, (91.0, 2.0, 3.0, *[0.0] * 5)),
        (FIX, BEGIN, (1.0, 2.0, 3.0, float("inf"), *[0.0] * 4)),
    ],
)
def test_numbers_that_no_sensor_gives_are_no_event(event):
    assert not is_event(*event)


def test_a_fix_may_leave_out_what_it_does_not_know():
    assert is_event(FIX, BEGIN, (1.0, 2.0, 3.0, *[float("nan")] * 5))
