"""An alignment from its specification: axes, spans, stages, and what is carried and compared."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.alignment.alignment import Site
from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.alignment.readiness import carried_attitude, carry
from strapdown.config.alignment import AlignmentSpec
from strapdown.errors import ConfigError
from strapdown.report.alignment_document import answer_error, trust
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.simulation import Origin, StationaryMotion, simulate_imu
from strapdown.systems.alignment_run import run_alignment
from strapdown.systems.alignment_source import read_alignment_source
from strapdown.tables import ACCEL, GYRO, QUATERNION

SITE = {"lat_deg": 55.0, "lon_deg": 37.0, "alt_m": 100.0}
COLUMNS = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]


def body(duration=60.0, rate=20.0, seed=1):
    motion = StationaryMotion(duration, Origin(55.0, 37.0, 100.0), 1.0, 2.0, 40.0)
    sensor = load_sensor("fog-1000").draw(seed)
    return simulate_imu(motion, sensor, rate=rate, sampling="mean", seed=seed)


def write(path, time, gyro, accel):
    lines = ["# sampling: mean", ",".join(["time_s", *COLUMNS])]
    rows = np.column_stack([time, gyro, accel])
    lines += [",".join(repr(float(x)) for x in row) for row in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


def spec_of(path, **tables):
    table = {
        "log": {"path": str(path)},
        "site": SITE,
        "sensors": {"sensor": "fog-1000"},
        "fine": {"kind": "none"},
    }
    return AlignmentSpec.checked(table | tables)


def sensed(imu, gyro, accel):
    """Samples along a sensor's own axes, from matrices sensor to body."""
    return imu[GYRO].to_numpy() @ gyro, imu[ACCEL].to_numpy() @ accel


@pytest.mark.parametrize(
    "axes",
    [
        {"axes": "right-forward-up"},
        {"axes": "y,x,-z"},
        {"matrix": [[0, 1, 0], [1, 0, 0], [0, 0, -1]]},
    ],
)
def test_letters_words_and_matrix_say_the_same(tmp_path, axes):
    imu, _ = body()
    m = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
    path = write(tmp_path / "log.csv", imu.index, *sensed(imu, m, m))
    read = read_alignment_source(spec_of(path, axes=axes)).imu
    assert np.array_equal(read[[*GYRO, *ACCEL]], imu[[*GYRO, *ACCEL]])


def test_any_mounting_is_taken_off_to_rounding(tmp_path):
    imu, _ = body()
    gyro = rotation.dcm_from_euler(np.array([10.0, -95.0 + 90.0, 160.0]))
    accel = rotation.dcm_from_euler(np.array([-80.0, 5.0, 33.0]))
    path = write(tmp_path / "log.csv", imu.index, *sensed(imu, gyro, accel))
    axes = {"gyro_matrix": gyro.tolist(), "accel_matrix": accel.tolist()}
    source = read_alignment_source(spec_of(path, axes=axes))
    # Products of matrices of size 1: some roundings of the largest component.
    assert source.imu[GYRO].to_numpy() == pytest.approx(imu[GYRO].to_numpy(), abs=1e-18)
    assert source.imu[ACCEL].to_numpy() == pytest.approx(imu[ACCEL].to_numpy(), abs=1e-14)
    assert sum("rotated by the mounting" in f.what for f in source.findings) == 2


def test_a_part_of_a_log_is_used(tmp_path):
    imu, _ = body()
    path = write(tmp_path / "log.csv", imu.index, imu[GYRO], imu[ACCEL])
    log = {"path": str(path), "from_s": 10.0, "to_s": 40.0}
    axes = {"axes": "x,y,z"}
    read = read_alignment_source(spec_of(path, log=log, axes=axes)).imu
    assert (read.index[0], read.index[-1], len(read)) == (10.0, 40.0, 601)
    log |= {"from_s": 100.0, "to_s": 140.0}
    with pytest.raises(ConfigError, match="between 100 and 140 s; the log covers 0 to 60 s"):
        read_alignment_source(spec_of(path, log=log, axes=axes))


def simulated(**tables):
    table = {
        "simulation": {"duration_s": 120.0, "rate_hz": 20.0, "heading_deg": 40.0, "seed": 5},
        "site": SITE,
        "sensors": {"sensor": "fog-1000"},
    }
    return run_alignment(AlignmentSpec.checked(table | tables))


def test_stages_follow_each_other():
    result = simulated(coarse={"duration_s": 40.0}, fine={"kind": "filter", "duration_s": 60.0})
    assert result.coarse.time == pytest.approx(40.0)
    assert result.fine is not None
    history = result.fine.history
    assert history.index[0] == pytest.approx(40.0)
    assert history.index[-1] == pytest.approx(100.0)
    # The answer is carried on to the end of the record, and back to its start.
    assert (result.start.time, result.end.time) == (0.0, 120.0)
    assert answer_error(result)[0] == "the truth"


def test_without_a_fine_alignment_the_coarse_one_is_the_answer():
    result = simulated(fine={"kind": "none"})
    assert result.fine is None and result.readiness.fine.empty
    assert np.array_equal(result.end.q_nb, result.coarse.q_nb)
    assert result.manoeuvres == ()
    assert trust(result).short[-1].code == "alignment.not-contradicted"


def test_a_reference_that_is_far_off_is_held_against_it(tmp_path):
    imu, _ = body(120.0)
    path = write(tmp_path / "log.csv", imu.index, imu[GYRO], imu[ACCEL])
    near, far = (
        run_alignment(spec_of(path, axes={"axes": "x,y,z"}, reference=reference))
        for reference in (
            {"heading_deg": 40.0, "sd_deg": 0.1},
            {"heading_deg": 35.0, "sd_deg": 0.1, "source": "a compass"},
        )
    )
    assert trust(near).verdict == "trusted"
    assert trust(far).verdict == "distrusted"
    assert trust(far).against[0].data["reference"] == "a compass"
    assert near.readiness.against == "reference"
    # The whole record's difference is that of the answer itself.
    last = near.readiness.coarse["heading_off"].iloc[-1]
    assert last == pytest.approx(answer_error(near)[1][2], abs=1e-9)


def test_uneven_stamps_need_no_prefilter(tmp_path):
    imu, _ = body(120.0)
    keep = np.delete(np.arange(len(imu)), [100, 400, 401])
    gyro, accel = imu[GYRO].to_numpy()[keep], imu[ACCEL].to_numpy()[keep]
    path = write(tmp_path / "log.csv", imu.index[keep], gyro, accel)
    result = run_alignment(spec_of(path, axes={"axes": "x,y,z"}))
    assert result.end.roll_pitch_heading[2] == pytest.approx(40.0, abs=0.5)


def test_a_prefilter_stands_before_the_alignment():
    plain = simulated(fine={"kind": "none"})
    result = simulated(fine={"kind": "none"}, prefilter={"kind": "robust_fir", "rate_hz": 10.0})
    assert len(result.imu) < 0.6 * len(plain.imu)
    assert result.prefilter is not None
    off = result.end.roll_pitch_heading - plain.end.roll_pitch_heading
    # The same samples, smoothed: white noise of 120 s is 0.03° of heading.
    assert abs(off[2]) < 0.2


def test_what_is_carried_over_a_record_is_carried_to_each_instant():
    imu, _ = body()
    site = Site(55.0, 37.0, 100.0)
    known = ImuUncertainty.of_sensor(load_sensor("fog-1000"))
    found = COARSE_ALIGNMENTS["inertial_frame"]().align(imu, site, known)
    table = carried_attitude(found, imu, site)
    for time in (0.0, 17.5, 42.0, 60.0):
        one = carry(imu, found, time, site).q_nb
        row = table.loc[time, QUATERNION].to_numpy()
        # Two ways to sum the same increments: 1e-9 deg is a millionth of any bound here.
        assert np.degrees(rotation.rotation_angle(one, row)) < 1e-9
