"""One wrong stamp or value refuses nothing else, and a real gap is used whole."""

from __future__ import annotations

import numpy as np
import pytest
from tests.contracts.test_chain_cuts import assert_same
from tests.unit.live.test_reception import fix, lines, received, sample, table

from strapdown.config.navigation import NavigationSpec
from strapdown.formats.stamp_gate import StampGate
from strapdown.live.lines import BadLineError, Sample, Word, check_token, parse_line
from strapdown.live.reception import CONFIRM, FAMILY, ROWS_WAITING, ValueLimits, value_limits
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty


def passed(stamps, confirm=CONFIRM):
    """Stamps that a gate lets pass, and those that it drops."""
    gate, out, dropped = StampGate(confirm, 3.0), [], []
    for stamp in stamps:
        if stamp > gate.newest:
            out += [time for time, _ in gate.take(stamp, None)]
            dropped += [time for time, _ in gate.dropped]
    out += [time for time, _ in gate.finish()]
    return out, dropped + [time for time, _ in gate.dropped]


def test_even_stamps_all_pass():
    stamps = (0.01 * np.arange(500)).tolist()
    assert passed(stamps) == (stamps, [])
    assert passed(stamps[:3]) == (stamps[:3], [])
    assert passed([]) == ([], [])


@pytest.mark.parametrize("seed", range(20))
def test_wrong_stamps_anywhere_refuse_no_right_one(seed):
    draw = np.random.default_rng(seed)
    right = (1.7e9 * (seed % 2) + 0.01 * np.arange(600)).tolist()
    mixed, wrong = [], set()
    for k, stamp in enumerate(right):
        # Up to three in a row, from a little to very far ahead, or far back.
        for _ in range(int(draw.integers(0, 4)) if draw.random() < 0.1 else 0):
            ahead = float(10.0 ** draw.uniform(-1.2, 9.0)) * (1 if draw.random() < 0.8 else -1)
            # One step back or a few ahead cannot be told from right ones.
            if k < CONFIRM and ahead < 0.0:
                continue
            wrong.add(stamp + ahead)
            mixed.append(stamp + ahead)
        mixed.append(stamp)
    out, dropped = passed(mixed)
    assert out == right
    assert set(dropped) <= wrong


def test_a_real_gap_is_confirmed_and_used_whole():
    stamps = (0.01 * np.arange(500)).tolist()
    for length in (0.05, 1.0, 1e3, 1e9):
        gone = stamps[:200] + [stamp + length for stamp in stamps[200:]]
        assert passed(gone) == (gone, [])
    # With fewer than confirm it, it is none.
    after = [stamp + 100.0 for stamp in stamps[200 : 200 + CONFIRM - 1]]
    assert passed(stamps[:200] + after) == (stamps[:200], after)
    # A wrong stamp in it does not count.
    gone = [stamp + 100.0 for stamp in stamps[200:]]
    assert passed([*stamps[:200], 1e7, *gone]) == (stamps[:200] + gone, [1e7])


def test_a_rate_that_changes_for_good_is_followed():
    stamps = np.concatenate([0.001 * np.arange(300), 0.3 + 0.01 * np.arange(100)]).tolist()
    assert passed(stamps)[0] == stamps


def test_limits_are_eight_times_the_stated_range():
    inf = value_limits(ImuUncertainty(TriadUncertainty(), TriadUncertainty()))
    assert inf == ValueLimits()
    own = value_limits(
        ImuUncertainty(TriadUncertainty(full_scale=35.0), TriadUncertainty(full_scale=(20, 20, 40)))
    )
    assert (own.rate, own.force) == (FAMILY * 35.0, FAMILY * 40.0)
    own.check(Sample(1.0, (279.0, 0.0, 0.0, 319.0, 0.0, -319.0)))
    for values in ((281.0, 0, 0, 0, 0, 0), (0, 0, 0, 0, 0, -321.0), (-321.0, 0, 0)):
        with pytest.raises(BadLineError) as caught:
            own.check(Sample(1.0, values))
        assert caught.value.finding.code == "live.value-beyond-limit"
    with pytest.raises(BadLineError):
        own.check(Sample(1e30, (0.0,) * 6))


WILD = [1e30, -1e30, 1e300, 5e-324, 1e12, -5.0, 1e9]


def wild_lines(good):
    """After each tenth line one with a wild number, in each place of each kind."""
    out, number = [], 0
    head = [f"imu,{1e6!r},0,0,0,0,0,-9.8", "imu,1e30,0,0,0,0,0,0", "imu,-1e9,0,0,0,0,0,0"]
    for k, text in enumerate(good):
        out.append(text)
        if k % 3 or k < 70:
            continue
        stamp, wild = float(text.split(",")[1]), WILD[number % len(WILD)]
        place = number // len(WILD) % 20
        if place < 7:
            row = [stamp + 5e-3, 0.0, 0.0, 0.0, 0.0, 0.0, -9.8]
            row[place] = wild if place == 0 or abs(wild) > 1e6 else 1e7
            out.append(sample(row[0], row[1:]))
        elif place == 7:
            said = "lat=45.0,lon=20,alt=0,north_sd=1,east_sd=1,down_sd=1"
            out.append(f"gnss,{stamp + abs(wild) + 30.0!r},{said}")
        else:
            names = ["lat", "lon", "alt", "north_sd", "east_sd", "down_sd"]
            values = [45.0, 20.0, 80.0, 1.0, 1.0, 1.0]
            values[place % 6] = 1e30 if place < 14 else -1e30
            said = ",".join(f"{n}={v!r}" for n, v in zip(names, values, strict=True))
            out.append(f"gnss,{stamp!r},{said}")
        number += 1
    return head + out


def test_wild_numbers_change_nothing_and_never_end_a_run(tmp_path):
    good = lines()
    clean, _, _ = received(good)
    live, _, told = received(wild_lines(good))
    assert live.error is None
    assert_same(live.run, clean.run)
    np.testing.assert_array_equal(live.got.samples, clean.got.samples)
    assert live.got.rows["gnss"].count == clean.got.rows["gnss"].count
    # Each kind once, with its line and a remedy, and all are counted.
    assert {one.code for one in told} == {"live.line-not-used"}
    assert len(told) == len(live.got.unused)
    assert {"stamp", "value", "gnss value", "gnss ahead"} <= set(live.got.unused)
    assert all(one.line is not None and one.remedy for one in told)
    assert sum(live.got.unused.values()) == len(wild_lines(good)) - len(good)


def test_one_stamp_far_ahead_refused_the_next_599_before():
    good = lines()
    stamp = float(good[120].split(",")[1])
    live, _, told = received([*good[:120], sample(stamp + 600.0, [0.0] * 6), *good[120:]])
    assert live.got.unused == {"stamp": 1}
    assert live.got.count == sum(text.startswith("imu") for text in good)
    assert told[0].data["reason"].code == "live.stamp-not-confirmed"
    assert told[0].line == 121


def test_a_clock_that_goes_back_is_told():
    good = lines()
    live, _, told = received([*good, *lines(length=1.0)])
    assert live.got.unused["clock"] == 1
    assert any(one.data["reason"].code == "live.clock-back" for one in told)


def test_a_gap_that_is_confirmed_is_told():
    more = {"gaps": {"beyond": "bridge"}}
    good = [text for text in lines() if not 2.0 < float(text.split(",")[1]) < 3.5]
    live, _, told = received(good, NavigationSpec.checked(table(**more)))
    assert [one.code for one in told] == ["live.gap"]
    assert (told[0].data["begin"], live.got.gaps) == (2.0, 1)
    assert live.told()["gaps"] == 1


def test_rows_wait_for_the_sample_of_their_stamp_and_not_without_end():
    good = lines(length=3.0)
    row = {"lat": 45.0, "lon": 20.0, "alt": 0.0, "north_sd": 1.0, "east_sd": 1.0, "down_sd": 1.0}
    many = [fix(100.0 + k, row, tuple(row)) for k in range(ROWS_WAITING + 7)]
    # Each is ahead; a later row of the present contradicts them.
    place = next(k for k, text in enumerate(good) if k > 60 and text.startswith("gnss"))
    live, _, _ = received([*good[:place], *many, *good[place:]])
    clean, _, _ = received(good)
    assert live.got.unused == {"gnss ahead": ROWS_WAITING + 7}
    assert_same(live.run, clean.run)


def test_commands_need_the_token_where_others_can_send():
    check_token(Word("end"), None)
    check_token(Word("end", "any"), None)
    check_token(Word("end", "own"), "own")
    for other in ("", "ow", "own ", "öwn"):
        with pytest.raises(BadLineError) as caught:
            check_token(Word("end", other), "own")
        assert caught.value.finding.code == "live.command-refused"
    assert parse_line("command, end , own", ()) == Word("end", "own")
    with pytest.raises(BadLineError):
        parse_line("command,end,own,more", ())


def test_a_first_sample_that_is_wrong_is_no_begin():
    good = lines(length=2.0)
    live, _, told = received([sample(1.7e9, [0.0] * 6), *good])
    clean, _, _ = received(good)
    assert_same(live.run, clean.run)
    assert [one.data["reason"].code for one in told] == ["live.stamp-not-first"]
    live, _, told = received([sample(3e10, [0.0] * 6), *good])
    assert [one.data["reason"].code for one in told] == ["live.stamp-beyond-limit"]


def test_commands_that_wait_are_bounded():
    more = {
        "site": {"lat_deg": 45.0, "lon_deg": 20.0, "alt_m": 80.0},
        "coarse": {"kind": "known_heading", "heading_deg": 0.0, "sd_deg": 1.0},
        "fine": {"kind": "none"},
    }
    spec = NavigationSpec.checked({k: v for k, v in table(**more).items() if k != "start"})
    good = lines(length=3.0)
    live, _, told = received([*good[:100], *["command,navigation"] * 150, *good[100:]], spec)
    assert live.got.unused == {"command": 50}
    assert told[0].data["reason"].code == "live.commands-waiting"
