"""The four recorders of the crash test of Tadic and Vukajlovic (2016)."""

from __future__ import annotations

import math

from strapdown.constants import GYRO_UNITS
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.crash_unit import Mounting
from strapdown.sensors.sensor_uncertainty import uncertainty_of
from strapdown.sensors.triad_errors import Triad
from strapdown.simulation.recorder_design import RecorderDesign, TriadDesign, WarmUp

# Section 3 of the paper: the worst bias that was found in a high-g part; the warm-up; Table 1.
HIGH_G_BIAS = 11.91  # m/s²
ELAPSED = 600.0  # s
IMU_RATE, LAB_RATE = 200.0, 10_000.0  # Hz
# Chosen: the paper has no positions. From the vehicle's origin, which is taken 0.5 m above the
# ground in the middle of the car: on the floor before the front seats, and half up the B-pillars.
FLOOR: Triad = (0.6, 0.5, 0.2)
PILLAR: Triad = (-0.3, 0.7, -0.3)
# Chosen: a converter of 12 bits over 3.3 V behind 20, 40 and 40 mV/g.
HIGH_G_STEP: Triad = (0.4, 0.2, 0.2)  # m/s²


def paper_units(scale_sd: float = 0.02) -> tuple[RecorderDesign, ...]:
    """Give the platforms of the paper: LAB1, LAB2, IMU1, IMU2; 1 is left, 2 is right.

    Parameters
    ----------
    scale_sd : float
        Of every MEMS triad, after a calibration; the data sheets alone leave more, up to ±10 %.

    Returns
    -------
    tuple of RecorderDesign
        Of the paper: parts, rates and ranges (but see the catalogue's word on ±100 g), the
        high-g bias of up to 11.91 m/s², the low-g bias of 0.2 m/s², 10 minutes of warm-up, the
        common trigger, laboratory units without gyros (here they borrow IMU1's), B-pillars and
        floor. Chosen here: positions and how well they are known, converters, clocks, warm-up
        drift, and that a trigger is stamped with the sample in which it falls.

    Raises
    ------
    ConfigError
        The scale factor's standard deviation is negative or not finite.
    """
    return (
        _lab("LAB1", -1.0),
        _lab("LAB2", 1.0),
        _imu("IMU1", -1.0, scale_sd, 3.7, 18.0),
        _imu("IMU2", 1.0, scale_sd, -1.3, -25.0),
    )


def _imu(name: str, side: float, scale: float, offset: float, drift: float) -> RecorderDesign:
    low, high, gyro = (
        load_sensor(part) for part in ("lis302dlh", "mma3202-mma1213", "idg-500-isz-500")
    )
    return RecorderDesign(
        name,
        (
            TriadDesign(low.name, uncertainty_of(low, "accel", scale=scale), IMU_RATE),
            TriadDesign(
                high.name,
                uncertainty_of(high, "accel", scale=scale, quantization=HIGH_G_STEP),
                IMU_RATE,
            ),
        ),
        TriadDesign(gyro.name, uncertainty_of(gyro, "gyro", scale=scale), IMU_RATE),
        Mounting(_beside(FLOOR, side), position_sd=0.01, angles_sd_deg=1.0),
        warm_up=WarmUp(0.5, 1.0 * GYRO_UNITS["deg/s"], 150.0, ELAPSED),
        trigger_sd=_one_sample(IMU_RATE),
        clock_offset=offset,
        clock_drift_ppm=drift,
        high_g_bias=HIGH_G_BIAS,
    )


def _lab(name: str, side: float) -> RecorderDesign:
    part = load_sensor("endevco-7264b-500")
    return RecorderDesign(
        name,
        (TriadDesign(part.name, uncertainty_of(part, "accel"), LAB_RATE),),
        mounting=Mounting(_beside(PILLAR, side), position_sd=0.005, angles_sd_deg=0.5),
        gyro_from="IMU1",
        trigger_sd=_one_sample(LAB_RATE),
        clock_drift_ppm=2.0 * side,
    )


def _beside(position: Triad, side: float) -> Triad:
    return (position[0], side * position[1], position[2])


def _one_sample(rate: float) -> float:
    """Standard deviation of an instant anywhere in an interval between samples, s."""
    return 1.0 / rate / math.sqrt(12.0)
