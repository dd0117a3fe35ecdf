"""Models of injury risk: the registry, the probability and its bound, files of users."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown.crash.severity import (
    SEVERITY_MODELS,
    SeverityModel,
    Term,
    find_severity_model,
    injury_risk,
    load_severity_model,
)
from strapdown.errors import ConfigError, DataError

MPH = 0.44704

# Coefficients with no meaning: what is tested is the form.
FILE = """
title = "A made-up table"
author = "Nobody"
year = 2004
table = "Table 3"
outcome = "MAIS3+"
intercept = -5.0

[[terms]]
input = "delta_v"
unit = "mph"
coefficient = 0.15

[[terms]]
input = "age"
unit = "years"
coefficient = 0.02

[[terms]]
input = "crash_type"
equals = "side"
coefficient = 0.5

[validity]
delta_v = [5.0, 50.0]

[applies]
crash_type = ["front", "side"]
"""


@pytest.fixture
def write(tmp_path):
    def make(text):
        path = tmp_path / "own.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return make


class TestRegistry:
    def test_every_model_names_its_source_and_range(self):
        for name, model in SEVERITY_MODELS.items():
            assert model.name == name
            assert all((model.author, model.title, model.table, model.note))
            assert model.year > 1950
            assert model.table.startswith("Table")
            assert set(model.validity) <= set(model.inputs)

    def test_wang_by_hand(self):
        # 40 mph in front: -6.9774 + 0.1620*40 = -0.4974.
        risk = injury_risk(
            find_severity_model("wang_2022_front_mais3"),
            {"delta_v": 40.0 * MPH, "crash_type": "front"},
        )
        assert risk.logit == pytest.approx(-0.4974, abs=1e-12)
        assert risk.probability == pytest.approx(1 / (1 + math.exp(0.4974)), rel=1e-14)
        assert risk.findings == ()

    @pytest.mark.parametrize("crash", ["all", "front"])
    def test_graver_injuries_are_less_likely_within_the_range_and_not_far_beyond(self, crash):
        family = [m for n, m in SEVERITY_MODELS.items() if n.startswith(f"wang_2022_{crash}_")]
        assert len(family) == 6
        low, high = family[0].validity["delta_v"]

        def ordered(mph):
            inputs = {"delta_v": mph * MPH, "crash_type": crash}
            p = [injury_risk(m, inputs, outside="tell").probability for m in family]
            return bool(np.all(np.diff(p) < 0))

        assert all(ordered(mph) for mph in np.linspace(low, high, 100))
        assert not ordered(high + 1.0)

    def test_unknown_names_get_the_nearest(self):
        with pytest.raises(ConfigError, match="did you mean 'wang_2022_all_mais3'"):
            find_severity_model("wang_2022_all_mais_3")


class TestBound:
    MODEL = SeverityModel(
        "m", "t", "a", 2000, "Table 1", "MAIS3+", -4.0, (Term("delta_v", 0.25, "m/s"),)
    )

    def test_is_the_logit_carried_through(self):
        risk = injury_risk(self.MODEL, {"delta_v": 12.0}, {"delta_v": 2.0})
        # 1.959964 is the 97.5 % point of the normal distribution.
        for end, sign in ((risk.low, -1.0), (risk.high, 1.0)):
            expected = 1 / (1 + math.exp(1.0 - sign * 1.959964 * 0.5))
            assert end == pytest.approx(expected, rel=1e-6)
        assert risk.logit_sd == pytest.approx(0.5)

    def test_covers_what_it_says(self):
        # The share of 20000 draws within a 90 % bound has an sd of 0.0021.
        rng = np.random.default_rng(1)
        risk = injury_risk(self.MODEL, {"delta_v": 12.0}, {"delta_v": 2.0}, coverage=0.9)
        p = 1 / (1 + np.exp(4.0 - 0.25 * rng.normal(12.0, 2.0, 20000)))
        inside = np.mean((p >= risk.low) & (p <= risk.high))
        assert inside == pytest.approx(0.9, abs=4 * 0.0021)

    def test_units_scale_the_sd_too(self):
        kmh = SeverityModel(
            "m", "t", "a", 2000, "T", "o", -4.0, (Term("delta_v", 0.25 / 3.6, "km/h"),)
        )
        one = injury_risk(self.MODEL, {"delta_v": 9.0}, {"delta_v": 1.0})
        two = injury_risk(kmh, {"delta_v": 9.0}, {"delta_v": 1.0})
        assert (two.probability, two.low, two.high) == pytest.approx(
            (one.probability, one.low, one.high)
        )

    @pytest.mark.parametrize(
        ("transform", "made", "slope"), [("log", math.log(9.0), 1 / 9.0), ("square", 81.0, 18.0)]
    )
    def test_transforms(self, transform, made, slope):
        model = SeverityModel(
            "m", "t", "a", 2000, "T", "o", 0.0, (Term("delta_v", 0.1, "m/s", transform),)
        )
        risk = injury_risk(model, {"delta_v": 9.0}, {"delta_v": 0.5})
        assert risk.logit == pytest.approx(0.1 * made)
        assert risk.logit_sd == pytest.approx(0.1 * slope * 0.5)
        if transform == "log":
            with pytest.raises(DataError, match="logarithm"):
                injury_risk(model, {"delta_v": 0.0})

    def test_terms_of_one_input_add_before_they_are_squared(self):
        terms = (Term("delta_v", 0.1, "m/s"), Term("delta_v", 0.02, "m/s", "square"))
        model = SeverityModel("m", "t", "a", 2000, "T", "o", 0.0, terms)
        risk = injury_risk(model, {"delta_v": 5.0}, {"delta_v": 1.0})
        assert risk.logit_sd == pytest.approx(0.1 + 0.2)


class TestValidity:
    def test_outside_is_refused_or_told(self):
        model = find_severity_model("wang_2022_front_mais3")
        fast = {"delta_v": 30.0, "crash_type": "front"}
        with pytest.raises(DataError, match=r"67\.11 mph: .* valid from 0 to 60 mph"):
            injury_risk(model, fast)
        risk = injury_risk(model, fast, outside="tell")
        assert "not extrapolated" in risk.findings[0].remedy

    def test_another_kind_of_crash_is_refused_or_told(self):
        model = find_severity_model("wang_2022_front_mais3")
        with pytest.raises(
            DataError, match="crash_type: wang_2022_front_mais3 applies to front, and this is side"
        ):
            injury_risk(model, {"delta_v": 5.0, "crash_type": "side"})
        assert injury_risk(model, {"delta_v": 5.0, "crash_type": "side"}, outside="tell").findings
        (finding,) = injury_risk(model, {"delta_v": 5.0}).findings
        assert "not stated" in finding.what

    def test_a_bound_that_leaves_the_range_is_told(self):
        model = find_severity_model("wang_2022_all_mais3")
        risk = injury_risk(model, {"delta_v": 24.5}, {"delta_v": 1.0})
        assert "the bound exceeds the validity range" in risk.findings[0].what

    def test_bad_input(self):
        model = find_severity_model("wang_2022_all_mais3")
        for inputs, words in (({}, "needs delta_v"), ({"delta_v": math.nan}, "a finite number")):
            with pytest.raises(DataError, match=words):
                injury_risk(model, inputs)
        good = {"delta_v": 10.0}
        with pytest.raises(ConfigError, check=coded("crash.standard-deviation-negative")):
            injury_risk(model, good, {"delta_v": -1.0})
        with pytest.raises(ConfigError, match="coverage"):
            injury_risk(model, good, coverage=95)
        with pytest.raises(
            ConfigError, check=coded("crash.outside-option-unknown", quantity="outside")
        ):
            injury_risk(model, good, outside="ignore")


class TestFile:
    def test_is_read(self, write):
        model = load_severity_model(write(FILE))
        assert model.name == "own"
        assert model.source == "Nobody (2004): A made-up table, Table 3"
        inputs = {"delta_v": 20.0 * MPH, "age": 50.0, "crash_type": "side"}
        # -5 + 0.15*20 + 0.02*50 + 0.5
        assert injury_risk(model, inputs).logit == pytest.approx(-0.5)
        assert injury_risk(model, inputs | {"crash_type": "front"}).logit == pytest.approx(-1.0)
        with pytest.raises(DataError, check=coded("crash.model-needs-number", quantity="age")):
            injury_risk(model, {"delta_v": 9.0, "crash_type": "front"})
        with pytest.raises(DataError, match="valid from 5 to 50 mph"):
            injury_risk(model, inputs | {"delta_v": 1.0})

    @pytest.mark.parametrize(
        ("old", "new", "key", "words"),
        [
            ('table = "Table 3"', "", "table", "missing"),
            ('author = "Nobody"', 'author = " "', "author", "missing"),
            ("year = 2004", 'year = "2004"', "year", "'2004'"),
            ("intercept = -5.0", "intercept = nan", "intercept", "nan"),
            ("intercept = -5.0", "intersept = -5.0", "intersept", "unknown key"),
            ("coefficient = 0.15", "coefficient = true", "terms 1.coefficient", "True"),
            ('unit = "mph"', "", "terms 1.unit", "missing"),
            ('unit = "years"', 'unit = "years"\nequals = "x"', "terms 2.unit", "unknown key"),
            ('unit = "years"', 'unit = "years"\ntransform = "ln"', "terms 2.transform", "'ln'"),
            ('input = "age"', 'input = "delta_v"', "terms 2", "is in years here and in mph"),
            ('input = "crash_type"', 'input = "age"', "terms 3", "and a category"),
            (
                "[5.0, 50.0]",
                "[50.0, 5.0]",
                "validity.delta_v",
                r"own\.toml, line \d+, validity\.delta_v: from 50 to 5 is not a range",
            ),
            ("[5.0, 50.0]", "5.0", "validity.delta_v", "5.0"),
            ("delta_v = [5", "speed = [5", "validity.speed", "no term"),
            ('["front", "side"]', '"front"', "applies.crash_type", "'front'"),
        ],
    )
    def test_what_does_not_fit_is_named(self, write, old, new, key, words):
        assert old in FILE
        with pytest.raises(ConfigError, match=words) as error:
            load_severity_model(write(FILE.replace(old, new)))
        assert error.value.finding.quantity == key
        assert error.value.finding.file == "own.toml"
        assert error.value.finding.remedy

    def test_no_terms_no_toml_no_file(self, write, tmp_path):
        with pytest.raises(
            ConfigError, check=coded("crash.terms-missing", quantity="terms", file="own.toml")
        ):
            load_severity_model(write(FILE[: FILE.index("[[terms]]")]))
        with pytest.raises(ConfigError, check=coded("config.not-toml")):
            load_severity_model(write("= 1"))
        with pytest.raises(ConfigError, check=coded("config.no-such-file")):
            load_severity_model(tmp_path / "none.toml")


COVARIANCE = (
    "covariance = [[0.04, -0.001, 0, 0], [-0.001, 4e-5, 0, 0], [0, 0, 1e-4, 0], [0, 0, 0, 0.01]]"
)


SIDE = {"delta_v": 20.0 * MPH, "age": 50.0, "crash_type": "side"}


class TestModelUncertainty:
    def test_covariance_of_the_coefficients_is_in_the_bound(self, write):
        model = load_severity_model(write(f"{COVARIANCE}\n{FILE}"))
        risk = injury_risk(model, SIDE, {"delta_v": 2.0 * MPH})
        # x = (1, 20, 50, 1): 0.04 - 2·20·0.001 + 400·4e-5 + 2500e-4 + 0.01.
        own = 0.04 - 0.04 + 0.016 + 0.25 + 0.01
        assert risk.model_sd == pytest.approx(own**0.5)
        assert risk.logit_sd == pytest.approx((own + (0.15 * 2.0) ** 2) ** 0.5)

    def test_standard_errors_are_independent(self, write):
        text = "intercept_standard_error = 0.2\n" + FILE.replace(
            "coefficient = 0.15", "coefficient = 0.15\nstandard_error = 0.01"
        ).replace("coefficient = 0.02", "coefficient = 0.02\nstandard_error = 0.001").replace(
            "coefficient = 0.5", "coefficient = 0.5\nstandard_error = 0.1"
        )
        risk = injury_risk(load_severity_model(write(text)), SIDE)
        assert risk.model_sd == pytest.approx((0.04 + 0.04 + 0.0025 + 0.01) ** 0.5)

    def test_a_published_table_without_them_says_so(self):
        model = find_severity_model("wang_2022_front_mais3")
        assert injury_risk(model, {"delta_v": 10.0, "crash_type": "front"}).model_sd is None

    def test_a_file_is_found_by_its_path(self, write):
        assert find_severity_model(str(write(FILE))).name == "own"

    @pytest.mark.parametrize(
        ("text", "code", "quantity"),
        [
            ("covariance = [[1.0]]", "covariance-not-square", "covariance"),
            (COVARIANCE.replace("-0.001, 0", "0.9, 0", 1), "covariance-not-valid", "covariance"),
            (COVARIANCE.replace("0.04", "-0.04"), "covariance-not-valid", "covariance"),
            (
                f"{COVARIANCE}\nintercept_standard_error = 0.1",
                "covariance-and-standard-errors",
                "intercept_standard_error",
            ),
            (
                "intercept_standard_error = 0.1",
                "standard-error-missing",
                "terms 1.standard_error",
            ),
        ],
    )
    def test_what_is_no_covariance_is_refused(self, write, text, code, quantity):
        check = coded(f"crash.{code}", quantity=quantity, file="own.toml")
        with pytest.raises(ConfigError, check=check) as error:
            load_severity_model(write(f"{text}\n{FILE}"))
        assert error.value.finding.line is not None
