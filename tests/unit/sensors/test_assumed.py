"""What is assumed of axes that are not there: its statement, its shape in time, its place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.crash_unit import (
    Assumed,
    CrashUnit,
    Mounting,
    RecordedTriad,
    assumed_findings,
    assumed_shapes,
    axis_names,
    turning_shapes,
    unmeasured_axes,
    unmeasured_turns,
    with_filled_axes,
    with_gyro,
)
from strapdown.sensors.synchronise import synchronise
from strapdown.sensors.uncertainty import TriadUncertainty

TOLD = TriadUncertainty(
    noise_density=0.01, bias=1.0, scale=0.01, misalignment=0.02, full_scale=500.0, quantization=0.1
)
BOTH = Assumed(turn_sd_deg=5.0, delta_v_sd=1.0)


def triad(axes, kind="accel", name="part", rate=100.0):
    time = np.arange(-10, 30) / rate
    values = np.outer(np.sin(time), np.ones(len(axes)))
    table = pd.DataFrame(values, index=time, columns=[f"{kind}_{a}" for a in axes])
    table.index.name = "time"
    table.attrs = {"sampling": "mean"}
    return RecordedTriad(table, TOLD, name)


def unit(axes="xz", assumed=BOTH, **options):
    return CrashUnit("EDR", (triad(axes),), trigger=0.0, assumed=assumed, **options)


class TestStatement:
    def test_one_number_is_three(self):
        assert BOTH.turn_sd_deg == (5.0, 5.0, 5.0)
        assert Assumed(delta_v_sd=(0.0, 1.0, 2.0)).sd_of("delta_v_sd") == (0.0, 1.0, 2.0)
        assert Assumed(delta_v_sd=1.0).sd_of("turn_sd_deg") == (0.0, 0.0, 0.0)

    @pytest.mark.parametrize(
        ("given", "quantity"),
        [
            ({}, "assumed"),
            ({"turn_sd_deg": -1.0}, "assumed, turn_sd_deg"),
            ({"turn_sd_deg": 90.0}, "assumed, turn_sd_deg"),
            ({"turn_sd_deg": "5"}, "assumed, turn_sd_deg"),
            ({"turn_sd_deg": (1.0, 2.0)}, "assumed, turn_sd_deg"),
            ({"delta_v_sd": float("nan")}, "assumed, delta_v_sd"),
            ({"delta_v_sd": 1.0, "over": (0.15, 0.0)}, "assumed, over"),
            ({"delta_v_sd": 1.0, "over": (0.0, 150.0)}, "assumed, over"),
            ({"delta_v_sd": 1.0, "over": 0.15}, "assumed, over"),
            ({"delta_v_sd": 1.0, "because": None}, "assumed, because"),
        ],
    )
    def test_what_is_no_statement(self, given, quantity):
        with pytest.raises(ConfigError) as error:
            Assumed(**given)
        assert error.value.finding.quantity == quantity
        assert error.value.finding.remedy

    def test_a_unit_takes_no_other_kind(self):
        with pytest.raises(ConfigError, match="assumed"):
            unit(assumed=5.0)


class TestShapes:
    @pytest.mark.parametrize("sampling", ["mean", "instantaneous"])
    @pytest.mark.parametrize("rate", [10.0, 100.0, 1000.0])
    def test_one_ends_at_one_and_one_comes_back(self, sampling, rate):
        time = np.arange(-round(rate), round(rate)) / rate
        shapes = assumed_shapes(time, (0.0, 0.15), sampling)
        # Means over the steps: exact at every rate, to rounding.
        assert shapes.sum(axis=1) / rate == pytest.approx([1.0, 0.0], abs=1e-12)

    def test_half_way_a_random_walk_that_is_known_at_its_end_is_known_to_half(self):
        time = np.arange(-100, 1000) / 1000.0
        grown = np.cumsum(assumed_shapes(time, (0.0, 0.2), "mean"), axis=1) / 1000.0
        middle = int(np.searchsorted(time, 0.1 - 1e-9))
        assert grown[:, middle] == pytest.approx([0.5, 0.5], abs=1e-9)
        # Of both together that of a random walk half way: 1/√2.
        assert np.hypot(*grown[:, middle]) == pytest.approx(np.sqrt(0.5), abs=1e-9)
        assert (grown[:, time < 0.0] == 0.0).all()

    @pytest.mark.parametrize("sampling", ["mean", "instantaneous"])
    @pytest.mark.parametrize("rate", [100.0, 1000.0])
    def test_a_turn_has_its_stated_size_at_the_end_and_its_rate_follows_the_force(
        self, sampling, rate
    ):
        time = np.arange(-round(rate), round(rate)) / rate
        # A pulse of 12 m/s between 0.03 and 0.09 s, in means or at the stamps.
        u = np.clip((time - (0.5 / rate if sampling == "mean" else 0.0) - 0.03) / 0.06, 0.0, 1.0)
        pushed = 12.0 * 2.0 * np.sin(np.pi * u) ** 2 / 0.06
        over = (0.0, 0.15 if sampling == "mean" else 0.15 + 0.5 / rate)
        rates = turning_shapes(time, over, sampling, pushed)
        turned = np.cumsum(rates, axis=1) / rate
        end, before = (int(np.searchsorted(time, t - 1e-9)) for t in (0.15, 0.03))
        # Sums of the rates are exact, to rounding.
        assert np.linalg.norm(turned[:, end]) == pytest.approx(1.0, abs=1e-9)
        size = np.linalg.norm(rates, axis=0)
        # The impulse of the tires is 1.18 m/s of 13.2 by 0.15 s: 2 % until the pulse begins.
        assert size[before] < 0.1 * size[end]
        # From the middle of the pulse on it turns by one, at one rate: 1 / 0.09 s.
        assert size[end] == pytest.approx(1.0 / 0.09, rel=0.08)
        if rate == 1000.0:
            half = int(np.searchsorted(time, 0.06 - 1e-9))
            # Half way: of one rate that grows with the impulse 0.5, of a random walk √0.5.
            assert 0.5 < size[half] / size[end] < np.sqrt(0.5)
        assert (rates[:, time > 0.24] == 0.0).all() and (rates[:, time < 0.0] == 0.0).all()

    def test_a_record_that_does_not_cover_the_stretch_leaves_the_rest_to_the_tires(self):
        rates = turning_shapes(np.arange(5, 10) / 100.0, (0.0, 0.2), "mean", np.zeros(5))
        # A rate that grows evenly: 2 t / 0.2² of the share beside the random walk's.
        grows = rates[0] / (np.arange(5, 10) / 100.0 - 0.005)
        assert grows == pytest.approx(np.full(5, grows[0]))


class TestFilling:
    def test_a_missing_axis_has_a_column_and_no_error_of_its_own(self):
        (made,) = with_filled_axes(unit()).accelerometers
        assert made.absent == (1,)
        assert list(made.table.columns) == ["accel_x", "accel_y", "accel_z"]
        assert (made.table["accel_y"] == 0.0).all()
        assert made.table.attrs == {"sampling": "mean"}
        for name in ("noise_density", "bias", "scale", "misalignment", "quantization"):
            given = TOLD.axis(name)[0]
            assert made.uncertainty.axis(name) == (given, 0.0, given)
        assert made.uncertainty.axis("full_scale") == (500.0, np.inf, 500.0)

    def test_it_is_done_once(self):
        once = with_filled_axes(unit())
        (first,), (again,) = once.accelerometers, with_filled_axes(once).accelerometers
        assert again.absent == (1,)
        assert again.table.equals(first.table)

    def test_rows_that_another_axis_does_not_have(self):
        given = unit()
        given.accelerometers[0].table.iloc[::2] = np.nan
        (made,) = with_filled_axes(given).accelerometers
        assert made.table["accel_y"].isna().equals(made.table["accel_x"].isna())

    def test_nothing_is_filled_where_nothing_is_assumed(self):
        assert with_filled_axes(unit(assumed=None)).accelerometers[0].absent == ()
        only_turn = unit(assumed=Assumed(turn_sd_deg=1.0))
        assert "accel_y" not in with_filled_axes(only_turn).accelerometers[0].table
        with pytest.raises(DataError, check=coded("sensors.axes-missing")):
            synchronise([only_turn], rate=100.0)

    def test_ranges_must_lack_the_same_axes(self):
        low, high = triad("xyz", name="low"), triad("xz", name="high")
        with pytest.raises(DataError) as error:
            with_filled_axes(CrashUnit("A", (low, high), assumed=BOTH))
        assert error.value.finding.file == "A, high"
        assert error.value.finding.quantity == "accel_y"

    def test_a_table_without_any_of_its_columns_is_refused(self):
        wrong = replace(unit(), accelerometers=(triad("xyz", "gyro"),))
        with pytest.raises(DataError, match="accel_x"):
            synchronise([wrong], rate=100.0)

    def test_a_gyro_that_does_not_turn(self):
        made = with_gyro(unit())
        assert made.gyro.absent == (0, 1, 2)
        assert (made.gyro.table == 0.0).all(axis=None)
        assert with_gyro(unit(assumed=Assumed(delta_v_sd=1.0))).gyro is None
        assert with_gyro(unit(gyro_from="IMU1")).gyro is None

    def test_synchronising_keeps_what_was_recorded_and_what_was_not(self):
        given = unit()
        found = synchronise([given], rate=100.0, sampling="mean").units[0]
        (made,) = found.unit.accelerometers
        assert found.gyro is None
        assert made.absent == (1,)
        assert found.unit.gyro.absent == (0, 1, 2)
        x = given.accelerometers[0].table["accel_x"]
        assert made.table["accel_x"].to_numpy() == pytest.approx(x.to_numpy(), abs=0.0)


class TestDirections:
    def test_projections_and_names(self):
        made = with_gyro(with_filled_axes(unit()))
        assert unmeasured_axes(made) == pytest.approx(np.diag([0.0, 1.0, 0.0]))
        assert unmeasured_turns(made) == pytest.approx(np.eye(3))
        names = axis_names(unmeasured_axes(made), unmeasured_turns(made))
        assert names == ("right", "roll", "pitch", "heading")

    def test_they_are_the_vehicles_in_a_turned_unit(self):
        # Heading 90 deg: the sensor's y points backward along the vehicle's forward axis.
        turned = replace(unit("xz"), mounting=Mounting(angles_deg=(0.0, 0.0, 90.0)))
        made = with_filled_axes(turned)
        assert unmeasured_axes(made) == pytest.approx(np.diag([1.0, 0.0, 0.0]), abs=1e-15)
        C = rotation.dcm_from_euler([0.0, 0.0, 90.0])
        assert np.abs(C[:, 1]) == pytest.approx([1.0, 0.0, 0.0], abs=1e-15)

    def test_of_a_gyro_of_the_heading_alone(self):
        made = with_filled_axes(unit(gyro=triad("z", "gyro", "yaw")))
        assert made.gyro.absent == (0, 1)
        assert axis_names(unmeasured_axes(made), unmeasured_turns(made)) == (
            "right",
            "roll",
            "pitch",
        )


class TestWords:
    def test_what_is_assumed_is_told(self):
        stated = Assumed(turn_sd_deg=(2.0, 2.0, 5.0), delta_v_sd=1.5, because="both marks agree")
        turn, axis = assumed_findings(with_gyro(with_filled_axes(unit(assumed=stated))))
        # It may have rolled over, and nothing shows it.
        assert turn.code == "sensors.roll-assumed"
        assert turn.data["missing"] == ("gyro",) and turn.data["sd"] == (2.0, 2.0, 5.0)
        assert turn.data["axes"] == ("roll", "pitch", "heading")
        assert axis.code == "sensors.velocity-change-assumed"
        assert axis.data["missing"] == ("accel_y",) and axis.data["sd"] == (1.5,)
        assert axis.data["axes"] == ("right",)
        for found in (turn, axis):
            assert (found.data["begin"], found.data["end"]) == (0.0, 0.15)
            assert "because both marks agree" in found.sentence()
            assert found.advice()
        assert (turn.file, turn.quantity, axis.quantity) == ("EDR", "gyro", "accel_y")

    def test_a_whole_unit_has_nothing_to_tell(self):
        whole = unit("xyz", gyro=triad("xyz", "gyro"))
        assert assumed_findings(with_gyro(with_filled_axes(whole))) == []
