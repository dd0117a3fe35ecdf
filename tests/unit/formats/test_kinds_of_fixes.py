"""Fixes that state no standard deviations, but their kind: as field 6 of NMEA 0183 GGA."""

from __future__ import annotations

import json
from functools import reduce
from operator import xor

import numpy as np
import pytest

import strapdown as sd
from strapdown.formats.gnss_files import GnssOptions, read_gnss
from strapdown.tables.checks import POSITION_SD

TAKEN = "position_sd_taken"


def written(folder, qualities, name="fixes.csv", head="", cells=None):
    """Fixes a second apart, with a column of their kinds, and further cells."""
    rows = [f"time_s,lat_deg,lon_deg,height_ellipsoid_m,fix_quality{head}"]
    for k, quality in enumerate(qualities):
        further = "" if cells is None else cells[k]
        rows.append(f"{k},{45.0 + k * 1e-6:.6f},9.0,300.0,{quality}{further}")
    path = folder / name
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def sds(table):
    sd = table[POSITION_SD].to_numpy()
    assert np.array_equal(sd, np.repeat(sd[:, :1], 3, axis=1))
    return sd[:, 0].tolist()


def by_quality(table):
    return [f for f in table.attrs["findings"] if f.code == "io.sd-by-quality"]


@pytest.mark.parametrize(
    ("stated", "qualities", "expected"),
    [
        # RTK: the statement is of fixed solutions, however few, and the others have their own.
        (0.02, [4, 5, 2, 1], [0.02, 0.5, 1.0, 5.0]),
        (0.02, [1] * 99 + [4], [5.0] * 99 + [0.02]),
        (0.03, [4, 5, 3, 6], [0.03, 0.5, 1.0, 5.0]),
        # More than is usual of some kinds: of the nearest, and no better of a worse one.
        (0.4, [4, 5, 1], [0.4, 0.4, 5.0]),
        (0.7, [5, 2, 1], [0.7, 1.0, 5.0]),
        (0.8, [5, 2, 1], [0.8, 0.8, 5.0]),
        # That of a code receiver says nothing of the few that it fixed, nor of its corrections.
        (1.5, [1, 1, 1, 4], [1.5] * 4),
        (2.0, [2, 1], [2.0, 5.0]),
        (2.5, [2, 1], [2.5, 2.5]),
        (9.0, [4, 5, 1], [9.0] * 3),
        # No fix, one by hand and one simulated have none of their own.
        (0.02, [4, 0, 7, 8, 5], [0.02, 0.02, 5.0, 5.0, 0.5]),
        # Of one kind: as stated.
        (0.037, [1, 1], [0.037] * 2),
        (0.037, [5, 5], [0.037] * 2),
        (0.037, [8, 8, 0], [0.037] * 3),
        (0.037, [3, 2], [0.037] * 2),
    ],
)
def test_a_statement_is_of_the_kind_that_it_suits(tmp_path, stated, qualities, expected):
    table = sd.read_gnss(written(tmp_path, qualities), position_sd_m=stated)
    assert sds(table) == pytest.approx(expected, rel=1e-15)
    kept = np.array(expected) == stated
    assert (np.array(sds(table))[kept] == stated).all()
    assert len(by_quality(table)) == (not kept.all())


def test_a_worse_kind_keeps_the_ratios_of_the_components(tmp_path):
    table = sd.read_gnss(written(tmp_path, [4, 5, 4]), position_sd_m=(0.02, 0.04, 0.06))
    fixed = [0.02, 0.04, 0.06]
    wanted = [fixed, [0.5, 1.0, 1.5], fixed]
    np.testing.assert_allclose(table[POSITION_SD], wanted, rtol=1e-15)


def test_what_each_kind_got_is_said(tmp_path):
    (found,) = by_quality(sd.read_gnss(written(tmp_path, [1, 5, 4, 5, 0]), position_sd_m=0.02))
    assert found.severity == "note" and found.remedy
    kinds = found.data["kinds"]
    told = [(k.data["kind"], k.data["quality_code"], k.data["count"], k.data["sd"]) for k in kinds]
    assert told == [("fixed", 4, 1, 0.02), ("float", 5, 2, 0.5), ("autonomous", 1, 1, 5.0)]
    assert found.sentence().endswith("1 fixed ± 0.02 m; 2 float ± 0.5 m; 1 autonomous ± 5 m")


@pytest.mark.parametrize(
    ("given", "qualities", "taken", "expected"),
    [
        (5.0, [4, 4], 0.02, [0.02, 0.02]),
        (5.0, [4, 5, 1, 2], 0.02, [0.02, 0.5, 5.0, 1.0]),
        (5.0, [1] * 9 + [4], 0.02, [5.0] * 9 + [0.02]),
        (5.0, [5, 5], 0.5, [0.5, 0.5]),
        (5.0, [1, 2], 1.0, [5.0, 1.0]),
        (5.0, [1, 6], 5.0, [5.0, 5.0]),
        (5.0, [7, 8], 5.0, [5.0, 5.0]),
        # Never more than is given.
        (1.0, [1, 1], 1.0, [1.0, 1.0]),
        (0.01, [4, 5], 0.01, [0.01, 0.5]),
    ],
)
def test_what_is_taken_is_that_of_the_best_kind(tmp_path, given, qualities, taken, expected):
    path = written(tmp_path, qualities)
    table = read_gnss(path, GnssOptions(unstated_position_sd=given))
    assert table.attrs[TAKEN] == taken
    assert sds(table) == pytest.approx(expected, rel=1e-15)
    assert len(by_quality(table)) == (set(sds(table)) != {given})
    # The same number, as a statement and as what is taken, gives each fix the same.
    for again in ({"position_sd": taken}, {"unstated_position_sd": taken}):
        assert sds(read_gnss(path, GnssOptions(**again))) == sds(table)


def test_an_unknown_standard_deviation_stays_unknown(tmp_path):
    path = written(tmp_path, [4, 5, 1])
    table = read_gnss(path, GnssOptions(unstated_position_sd=np.inf))
    assert sds(table) == [np.inf] * 3 and table.attrs[TAKEN] == np.inf
    assert not by_quality(table)


def test_without_a_column_of_kinds_nothing_is_told_apart(tmp_path):
    path = tmp_path / "fixes.csv"
    path.write_text("time_s,lat_deg,lon_deg,height_ellipsoid_m\n0,45,9,300\n1,45,9,300\n")
    table = read_gnss(path, GnssOptions(unstated_position_sd=7.0))
    assert sds(table) == [7.0, 7.0] and table.attrs[TAKEN] == 7.0


def test_a_statement_replaces_those_of_the_file(tmp_path):
    """Who has them in columns tells the kinds apart by them."""
    sd_names, cells = ",north_sd_m,east_sd_m,down_sd_m", [",0.01,0.01,0.02", ",0.3,0.3,0.6"]
    path = written(tmp_path, [4, 5], head=sd_names, cells=cells)
    assert sds(sd.read_gnss(path, position_sd_m=0.05)) == [0.05, 0.05]
    table = read_gnss(path, GnssOptions(unstated_position_sd=5.0))
    assert table["north_sd"].tolist() == [0.01, 0.3] and TAKEN not in table.attrs


def test_rows_that_are_left_out_are_of_no_kind(tmp_path):
    path = written(tmp_path, [1, 4, 1])
    text = path.read_text().splitlines()
    path.write_text("\n".join([*text[:2], text[2].replace("1,45", "0,45", 1), text[3]]) + "\n")
    table = read_gnss(path, GnssOptions(unstated_position_sd=5.0, repair=True))
    assert table["quality"].tolist() == [1.0, 1.0]
    assert sds(table) == [5.0, 5.0] and table.attrs[TAKEN] == 5.0


def test_a_stated_height_is_as_uncertain_by_any_kind(tmp_path):
    path = tmp_path / "fixes.csv"
    path.write_text("time_s,lat_deg,lon_deg,fix_quality\n0,45,9,4\n1,45,9,1\n")
    table = sd.read_gnss(path, datum_height_m=300.0, position_sd_m=(0.02, 0.02, 3.0))
    wanted = [[0.02, 0.02, 3.0 * np.sqrt(2.0)], [5.0, 5.0, 3.0 * np.sqrt(2.0)]]
    np.testing.assert_allclose(table[POSITION_SD], wanted, rtol=1e-15)


def test_sentences_of_a_receiver(tmp_path):
    lines = []
    for k, quality in enumerate([4, 5, 1]):
        body = f"GNGGA,00000{k}.00,4500.0,N,00900.0,E,{quality},12,0.9,300.0,M,46.9,M,1.0,0"
        lines.append(f"${body}*{reduce(xor, body.encode(), 0):02X}")
    path = tmp_path / "rover.nmea"
    path.write_text("\r\n".join(lines) + "\r\n")
    assert sds(sd.read_gnss(path, position_sd_m=0.02)) == [0.02, 0.5, 5.0]


def test_points_of_a_track(tmp_path):
    points = "".join(
        f'<trkpt lat="45.00000{k}" lon="9.0"><ele>300</ele><time>2026-05-01T12:00:0{k}Z</time>'
        f"<geoidheight>47</geoidheight><fix>{fix}</fix></trkpt>"
        for k, fix in enumerate(["dgps", "3d", "dgps"])
    )
    path = tmp_path / "track.gpx"
    path.write_text(
        '<?xml version="1.0"?><gpx version="1.1" creator="x" '
        'xmlns="http://www.topografix.com/GPX/1/1">'
        f"<trk><trkseg>{points}</trkseg></trk></gpx>"
    )
    assert sds(read_gnss(path, GnssOptions(unstated_position_sd=5.0))) == [1.0, 5.0, 1.0]


def test_a_clean_log_keeps_the_kinds_and_not_what_is_assumed(tmp_path):
    path, clean = written(tmp_path, [4, 5, 4, 1]), tmp_path / "clean.csv"
    sd.doctor(path, fix=clean)  # reads it back, and compares every number
    names = next(row for row in clean.read_text().splitlines() if not row.startswith("#"))
    assert "quality" in names and "north_sd" not in names
    assert sds(sd.read_gnss(clean, position_sd_m=0.02)) == [0.02, 0.5, 0.02, 5.0]
    codes = [f["code"] for f in json.loads((tmp_path / "clean.json").read_text())["findings"]]
    assert "io.sd-by-quality" in codes
