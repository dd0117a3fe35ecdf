"""Two recorders of one crash, mounted in two ways."""

from __future__ import annotations

from pathlib import Path

import numpy as np

HEAD = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"
#: Sensor axes from those of the vehicle: z up in both; x forward, and x to the right.
TURNS = {
    "one.csv": np.diag([1.0, -1.0, -1.0]),
    "other.csv": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
}


def write_two_recorders(folder: Path) -> list[str]:
    """Write the logs of a minute at 100 Hz with a pulse from the front; return their names."""
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 60.0, 0.01)
    body = np.zeros((time.size, 6))
    body[:, 2] = 0.3 * np.sin(0.5 * time) * (time > 20.0)
    body[:, 5] = -9.8
    body += 1e-3 * rng.standard_normal(body.shape)
    body[:, 3:5] += np.outer((time > 30.0) & (time < 30.1), [-100.0, 50.0])
    for name, turn in TURNS.items():
        rows = np.column_stack([time, body[:, :3] @ turn.T, body[:, 3:] @ turn.T])
        np.savetxt(folder / name, rows, "%.9g", ",", header=HEAD, comments="")
    return list(TURNS)
