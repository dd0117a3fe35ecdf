"""The manual's page on the case file knows every key, and its example is a case."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from strapdown.config.crash_case import CaseSpec
from strapdown.config.spec import Spec, keys_of

PAGE = (Path(__file__).parents[3] / "docs" / "case.md").read_text(encoding="utf-8")


def tables(form: type[Spec]) -> list[type[Spec]]:
    """A table and all below it."""
    found = [form]
    for field in form.model_fields.values():
        for inner in Spec.__subclasses__():
            if inner.__name__ in str(field.annotation) and inner not in found:
                found += tables(inner)
    return found


@pytest.mark.parametrize("form", dict.fromkeys(tables(CaseSpec)), ids=lambda form: form.__name__)
def test_every_key_is_explained(form):
    told = set(re.findall(r"`\[*([a-z_0-9]+)\]*`", PAGE))
    told |= {word for row in re.findall(r"\[\[?([a-z_.]+)\]?\]", PAGE) for word in row.split(".")}
    for name in form.model_fields:
        if name not in form.unwritten:
            assert told & set(keys_of(name)), name


def test_no_key_is_explained_that_there_is_not():
    known = {
        key for form in tables(CaseSpec) for name in form.model_fields for key in keys_of(name)
    }
    rows = re.findall(r"^\| (`.*?) \|", PAGE, re.M)
    for row in rows:
        for key in re.findall(r"`([a-z_0-9]+)`", row):
            assert key in known, key


def test_the_example_has_the_form_of_a_case():
    table = tomllib.loads(re.findall(r"```toml\n(.*?)```", PAGE, re.S)[0])
    assert CaseSpec(**table).units[0].accelerometers[0].sensor == "lis302dlh"
