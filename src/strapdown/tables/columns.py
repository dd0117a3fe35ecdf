"""Names of the columns."""

from __future__ import annotations

GYRO = ["gyro_x", "gyro_y", "gyro_z"]
ACCEL = ["accel_x", "accel_y", "accel_z"]
MAG = ["mag_x", "mag_y", "mag_z"]
THETA = ["theta_x", "theta_y", "theta_z"]
DTHETA = ["dtheta_x", "dtheta_y", "dtheta_z"]
PHI = ["phi_x", "phi_y", "phi_z"]
DV = ["dv_x", "dv_y", "dv_z"]
DR = ["dr_x", "dr_y", "dr_z"]
QUATERNION = ["q_w", "q_x", "q_y", "q_z"]
EULER = ["roll", "pitch", "heading"]
GEODETIC = ["lat", "lon", "alt"]
VELOCITY = ["VN", "VE", "VD"]
NED = ["north", "east", "down"]
POSITION_SD = ["north_sd", "east_sd", "down_sd"]
VELOCITY_SD = ["VN_sd", "VE_sd", "VD_sd"]
REFERENCE = ["time", "kind", "since", *EULER, "turns", "axis", "sd"]
