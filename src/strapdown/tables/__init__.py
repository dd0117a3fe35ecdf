"""Tables passed between processing stages: columns, units, checks.

Each is a pandas DataFrame with fixed columns. A table made by the functions here is valid; a
table from elsewhere is checked by ``check_*`` before use. Inputs are never modified in place.

======================  =====================  ===================================================
table                   index                  columns
======================  =====================  ===================================================
Imu                     ``time`` s             ``gyro_x..z`` rad/s, and where there is an
                                               accelerometer ``accel_x..z`` m/s² (specific force),
                                               where there is a magnetometer ``mag_x..z`` µT;
                                               body axes forward-right-down;
                                               ``attrs["sampling"]``: ``instantaneous`` at the
                                               stamp, or ``mean`` over the interval that ends there
Increments              ``time`` s, its end    ``dt`` s, ``theta_x..z`` rad, ``dtheta_x..z`` rad
                                               (change of the rate over the step times `dt`)
MotionIncrements        ``time`` s, its end    ``dt`` s, ``phi_x..z`` rad (rotation vector),
                                               ``dv_x..z`` m/s, ``dr_x..z`` m (specific force
                                               integrated, body axes at the start of the step)
Trajectory              ``time`` s             ``lat lon`` deg, ``alt`` m (ellipsoidal), ``VN VE
                                               VD`` m/s, ``roll pitch heading`` deg
TrajectoryError         ``time`` s             ``north east down`` m, ``VN VE VD`` m/s, ``roll pitch
                                               heading`` deg: errors (estimate minus truth), or
                                               standard deviations
Gnss                    ``time`` s             ``lat lon`` deg, ``alt`` m, ``VN VE VD`` m/s, of the
                                               antenna; ``north_sd east_sd down_sd`` m, ``VN_sd
                                               VE_sd VD_sd`` m/s: inf where not measured;
                                               ``quality``: 0 no fix, else as NMEA 0183 GGA
Odometer                ``time`` s             ``speed speed_sd`` m/s, forward positive
Barometer               ``time`` s             ``height height_sd`` m
Heading                 ``time`` s             ``heading heading_sd`` deg
BodyVelocity            ``time`` s             ``vx vy vz vx_sd vy_sd vz_sd`` m/s, axes of the
                                               instrument
Attitude                ``time`` s             ``q_w q_x q_y q_z`` (body to local level) and
                                               ``roll pitch heading`` deg
References              none                   ``time`` s, ``kind`` (``known``, ``tilt``,
                                               ``same``, ``turns``), ``since`` s, ``roll pitch
                                               heading`` deg, ``turns``, ``axis``, ``sd`` deg
======================  =====================  ===================================================
"""

from __future__ import annotations

from strapdown.tables.aiding import (
    barometer_from_pressure,
    barometer_table,
    body_velocity_table,
    check_odometer,
    heading_table,
    odometer_table,
)
from strapdown.tables.checks import (
    ACCEL,
    DR,
    DTHETA,
    DV,
    EULER,
    GEODETIC,
    GYRO,
    MAG,
    NED,
    PHI,
    POSITION_SD,
    QUATERNION,
    THETA,
    VELOCITY,
    VELOCITY_SD,
    find_gaps,
    values_of,
)
from strapdown.tables.gnss import GNSS, check_gnss, gnss_table, usable
from strapdown.tables.imu import (
    MOTION,
    SAMPLINGS,
    check_imu,
    check_motion_increments,
    check_sampling_kind,
    check_table_sampling,
    imu_of_columns,
    imu_table,
    increments_table,
    motion_increments_table,
)
from strapdown.tables.trajectory import (
    TRAJECTORY,
    TRAJECTORY_ERROR,
    attitude_table,
    check_attitude,
    check_trajectory,
    check_trajectory_error,
    places_of,
    references_table,
    trajectory_error_table,
    trajectory_table,
)

__all__ = [
    "ACCEL",
    "DR",
    "DTHETA",
    "DV",
    "EULER",
    "GEODETIC",
    "GNSS",
    "GYRO",
    "MAG",
    "MOTION",
    "NED",
    "PHI",
    "POSITION_SD",
    "QUATERNION",
    "SAMPLINGS",
    "THETA",
    "TRAJECTORY",
    "TRAJECTORY_ERROR",
    "VELOCITY",
    "VELOCITY_SD",
    "attitude_table",
    "barometer_from_pressure",
    "barometer_table",
    "body_velocity_table",
    "check_attitude",
    "check_gnss",
    "check_imu",
    "check_motion_increments",
    "check_odometer",
    "check_sampling_kind",
    "check_table_sampling",
    "check_trajectory",
    "check_trajectory_error",
    "find_gaps",
    "gnss_table",
    "heading_table",
    "imu_of_columns",
    "imu_table",
    "increments_table",
    "motion_increments_table",
    "odometer_table",
    "places_of",
    "references_table",
    "trajectory_error_table",
    "trajectory_table",
    "usable",
    "values_of",
]
