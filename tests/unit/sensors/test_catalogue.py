"""Every sensor loads, says where each number is from, and draws what its data sheet states."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from tests.coded import coded

from strapdown.constants import STANDARD_GRAVITY as G
from strapdown.errors import ConfigError
from strapdown.sensors import catalogue
from strapdown.sensors.catalogue import GRADES, SENSORS, load_sensor
from strapdown.sensors.triad_errors import TriadErrors

DEG = np.pi / 180.0
GOOD = """
title = "Own part"
class = "phone"
summary = "a part"

[sources]
ds = "Maker, data sheet, revision 1"

[gyro]
noise_density_deg_per_s_per_sqrt_hz = { value = 0.01, source = "ds", place = "Table 1" }
bias_bound_deg_per_s = { value = [1.0, 2.0, 3.0], source = "ds" }
full_scale_deg_per_s = { value = 500.0, assumed = "a guess" }
output_rate_hz = { value = 100.0, source = "ds" }
"""


@pytest.mark.parametrize("name", SENSORS)
def test_every_entry_loads_and_can_be_drawn(name):
    sensor = load_sensor(name)
    assert sensor.name == name
    assert sensor.grade in GRADES
    has_gyro = any(f.key.startswith("gyro.") for f in sensor.sources)
    assert has_gyro or sensor.imu_errors.gyro == TriadErrors()
    for seed in range(20):
        unit = sensor.draw(seed)
        assert unit == sensor.draw(seed)
        assert unit != sensor.draw(seed + 1)


@pytest.mark.parametrize("name", SENSORS)
def test_every_number_has_a_source_or_says_why_it_is_assumed(name):
    for figure in load_sensor(name).sources:
        assert bool(figure.source) != bool(figure.assumed), figure.key
        assert len(figure.source or figure.assumed) > 10, figure.key


REASON = re.compile(r"(as|near|between) ([a-z0-9-]+)(?: and ([a-z0-9-]+))?:")


def sizes(name):
    """Figures of a sensor by triad and quantity: values, and spreads as standard deviations, SI."""
    table = tomllib.loads((catalogue.FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    found = {}
    for triad in {"gyro", "accel"} & set(table):
        for key, figure in table[triad].items():
            meaning = catalogue.KEYS[triad][key]
            uniform = np.sqrt(3.0) if meaning.spread == "bound" else 1.0
            size = np.asarray(figure["value"]) * meaning.factor / uniform
            found[triad, meaning.quantity] = size, figure.get("assumed", "")
    return found


def test_an_assumed_figure_is_that_of_the_sensors_it_names():
    """`as` is equal, `near` within a factor of two, `between` within both."""
    held = 0
    for name in SENSORS:
        for place, (size, reason) in sizes(name).items():
            told = REASON.match(reason)
            if told is None:
                continue
            others = [sizes(other)[place][0] for other in told.groups()[1:] if other]
            room = 2.0 if told[1] == "near" else 1.0
            low, high = np.min(others, axis=0) / room, np.max(others, axis=0) * room
            assert (len(others) == 2) == (told[1] == "between"), (name, place)
            assert (low * (1 - 1e-9) <= size).all(), (name, place, size, low)
            assert (size <= high * (1 + 1e-9)).all(), (name, place, size, high)
            held += 1
    assert held > 60


def test_the_manual_says_how_many_figures_are_assumed():
    """Of named sensors, by class; a grade is assumed throughout."""
    page = Path(__file__).parents[3] / "docs" / "sensors.md"
    told = re.findall(r"^\|`(\w+)`\|(\d+)\|(\d+)\|$", page.read_text(encoding="utf-8"), re.M)
    counted = {}
    for sensor in map(load_sensor, SENSORS):
        if not sensor.name.endswith("-grade"):
            figures, assumed = counted.get(sensor.grade, (0, 0))
            more = sum(bool(f.assumed) for f in sensor.sources)
            counted[sensor.grade] = figures + len(sensor.sources), assumed + more
    assert {grade: (int(n), int(m)) for grade, n, m in told} == counted


@pytest.mark.parametrize("name", SENSORS)
def test_every_document_is_used(name):
    table = tomllib.loads((catalogue.FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    used = {f.get("source") for t in ("gyro", "accel") for f in table.get(t, {}).values()}
    assert set(table.get("sources", {})) <= used


def test_the_classes_are_in_the_order_of_what_they_cost():
    """Noise and bias fall from phone to navigation."""
    noise = {
        grade: [
            s.imu_errors.gyro.noise_density[0]
            for s in map(load_sensor, SENSORS)
            if s.grade == grade
        ]
        for grade in ("phone", "tactical", "navigation")
    }
    assert min(noise["phone"]) > max(noise["tactical"])
    assert min(noise["tactical"]) > max(noise["navigation"])


def test_units_become_si():
    stim = load_sensor("STIM300").imu_errors
    # NavToolkit's own conversions of the same data sheet.
    assert stim.gyro.noise_density[0] == pytest.approx(4.3633e-5, rel=1e-4)
    assert stim.accel.noise_density[0] == pytest.approx(1e-3, rel=1e-12)
    assert stim.gyro.bias_instability[0] * 0.61736 == pytest.approx(2.4241e-6, rel=1e-4)
    mpu = load_sensor("mpu-6050")
    assert mpu.imu_errors.gyro.full_scale[0] == pytest.approx(2000.0 * DEG)
    # 16 bits over ±16 g; 16.4 LSB/(deg/s) is rounded.
    assert mpu.imu_errors.accel.quantization[0] == pytest.approx(32.0 * G / 2**16)
    assert mpu.imu_errors.gyro.quantization[0] == pytest.approx(4000.0 * DEG / 2**16, rel=2e-3)
    assert mpu.rates == {"gyro": 8000.0, "accel": 1000.0}


def test_draws_fill_the_bounds_of_a_data_sheet_and_do_not_leave_them():
    sensor = load_sensor("mpu-6050")
    units = [sensor.draw(seed) for seed in range(400)]
    bias = np.array([u.gyro.bias for u in units]) / DEG
    assert np.abs(bias).max() <= 20.0
    assert np.abs(bias).max() > 19.5
    # Uniform: the mean square is 400/3, with the standard deviation 400 √(4/45/1200).
    assert (bias**2).mean() == pytest.approx(400 / 3, abs=5 * 400 * np.sqrt(4 / 45 / 1200))
    cross = np.array([u.gyro.misalignment for u in units])
    assert not cross[:, range(3), range(3)].any()
    assert np.abs(cross).max() <= 0.02
    curve = np.array([np.add(u.accel.nonlinearity_2, u.accel.nonlinearity_3) for u in units])
    assert 0.004 < np.abs(curve).max() <= 0.005


def test_draws_of_a_standard_deviation_have_it():
    sensor = load_sensor("lsm6dso")
    bias = np.array([sensor.draw(seed).gyro.bias for seed in range(400)]) / DEG
    low, high = chi2.ppf([5e-7, 1 - 5e-7], bias.size) / bias.size
    assert low < (bias**2).mean() < high


def test_a_figure_of_one_quantity_does_not_move_the_draws_of_another(tmp_path):
    more = GOOD + 'scale_sd_ppm = { value = 100.0, source = "ds" }\n'
    first, second = (write(tmp_path, f"{k}.toml", text) for k, text in enumerate((GOOD, more)))
    assert load_sensor(first).draw(3).gyro.bias == load_sensor(second).draw(3).gyro.bias


def write(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_of_ones_own_is_read_in_the_same_form(tmp_path):
    sensor = load_sensor(write(tmp_path, "mine.toml", GOOD))
    assert sensor.name == "mine"
    assert sensor.imu_errors.accel is None
    assert sensor.rates == {"gyro": 100.0}
    assert sensor.sources[0].source == "Maker, data sheet, revision 1, Table 1"
    bound = np.array([1.0, 2.0, 3.0]) * DEG
    assert (np.abs(sensor.draw(1).gyro.bias) <= bound).all()


@pytest.mark.parametrize(
    ("old", "new", "key", "message"),
    [
        ("full_scale_deg_per_s", "full_scale_deg", "gyro.full_scale_deg", "full_scale_deg_per_s"),
        ("noise_density_deg_per_s_per_sqrt_hz", "noise", "gyro.noise", "unknown key"),
        ("[gyro]", "[gyros]", "gyros", "did you mean 'gyro'"),
        ('class = "phone"', 'class = "phones"', "class", "did you mean 'phone'"),
        ('title = "Own part"', "", "title", "missing"),
        ("value = 0.01", "value = -0.01", "gyro.noise_density_deg_per_s_per_sqrt_hz", "-0.01"),
        ("value = 0.01", 'value = "x"', "gyro.noise_density_deg_per_s_per_sqrt_hz", "'x'"),
        ("[1.0, 2.0, 3.0]", "[1.0]", "gyro.bias_bound_deg_per_s", "x, y, z"),
        ('source = "ds", place', 'source = "d", place', None, "did you mean 'ds'"),
        (', source = "ds" }\nfull', " }\nfull", "gyro.bias_bound_deg_per_s", "either a source or"),
        ('assumed = "a guess"', 'assumed = "a", source = "ds"', None, "either a source or"),
        ('{ value = 500.0, assumed = "a guess" }', "500.0", None, "does not state its source"),
        ("place =", "page =", None, "did you mean 'place'"),
        (
            "output_rate_hz",
            "bias_sd_deg_per_h",
            "gyro.bias_sd_deg_per_h",
            "stated twice",
        ),
        ("output_rate_hz", "bias_instability_deg_per_h", "gyro.correlation_time_s", "missing"),
        ("output_rate_hz", "scale_bound_percent", "gyro: scale", "leaves no signal"),
        ("value = 500.0", "value = 0.0", "gyro: full_scale", "not positive"),
        ("[gyro]", "[gyro", None, "not valid TOML"),
    ],
)
def test_a_bad_file_is_refused_by_file_and_key(tmp_path, old, new, key, message):
    assert old in GOOD
    path = write(tmp_path, "mine.toml", GOOD.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        load_sensor(path)
    assert caught.value.finding.file == "mine.toml"
    assert message in str(caught.value)
    if key is not None:
        assert caught.value.finding.quantity == key


def test_a_file_without_a_triad_is_refused(tmp_path):
    with pytest.raises(
        ConfigError,
        check=coded("sensors.sensor-without-triads", quantity="gyro, accel", file="mine.toml"),
    ):
        load_sensor(write(tmp_path, "mine.toml", GOOD.split("[gyro]")[0]))


def test_an_unknown_name_and_a_missing_file_are_told_apart(tmp_path):
    with pytest.raises(ConfigError, match=r"did you mean 'mpu-6050'[\s\S]*path of a \.toml"):
        load_sensor("mpu6050")
    with pytest.raises(ConfigError, check=coded("sensors.no-such-file")):
        load_sensor(tmp_path / "none.toml")


def test_names_are_listed_without_reading_a_number(monkeypatch):
    def never(*_args):
        raise AssertionError("read")

    monkeypatch.setattr(tomllib, "loads", never)
    assert "mpu-6050" in catalogue.SENSORS
    assert 12 <= len(catalogue.SENSORS) == len(list(catalogue.FOLDER.glob("*.toml")))


@pytest.mark.parametrize("source", ['["ds"]', "{a = 1}", "7"])
def test_a_source_that_is_no_text_is_refused_by_file_and_key(tmp_path, source):
    path = tmp_path / "own.toml"
    path.write_text(
        'title = "a"\nclass = "phone"\nsummary = "b"\n[sources]\nds = "c"\n'
        f"[gyro]\nbias_bound_deg_per_s = {{ value = 1, source = {source} }}\n"
    )
    with pytest.raises(ConfigError) as error:
        load_sensor(path)
    finding = error.value.finding
    assert (finding.code, finding.file) == ("sensors.no-source", "own.toml")
    assert finding.quantity == "gyro.bias_bound_deg_per_s"
    assert finding.remedy
