"""The hand motions of the scenarios, pose by pose."""

from __future__ import annotations

from strapdown.simulation.gesture import Gesture, gesture
from strapdown.simulation.minimum_jerk import Track

# Lies for 5 s, is turned about as fast as a hand can, and lies again from 9 s on. The three
# angles change at different times, so that the axis of the turn never stays.
TABLE_TO_TABLE = Gesture(
    11.0,
    roll=Track((5.0, 5.5, 6.1, 6.8, 7.4, 8.2, 9.0), (0, 110, -80, 140, -60, 90, 0)),
    pitch=Track((5.0, 5.4, 6.0, 6.5, 7.2, 7.8, 8.5, 9.0), (0, -60, 70, -40, 60, -75, 30, 0)),
    heading=Track((5.0, 5.7, 6.3, 7.0, 7.6, 8.4, 9.0), (0, 130, -70, 160, 330, 270, 360)),
    north=Track((5.0, 6.2, 7.5, 9.0), (0, 0.15, -0.1, 0)),
    east=Track((5.0, 6.6, 8.0, 9.0), (0, -0.2, 0.15, 0)),
    down=Track((5.0, 5.6, 8.3, 9.0), (0, -0.3, -0.25, 0)),
)

# Ten turns of roll and two of heading there and one beyond back, with the pitch thrown about.
INTENSIVE = Gesture(
    10.0,
    roll=Track((2.0, 8.0), (0, 3600)),
    pitch=Track((2.0, 3.0, 4.2, 5.0, 6.1, 7.0, 8.0), (0, -75, 60, -80, 70, -50, 0)),
    heading=Track((2.5, 5.0, 7.5), (0, 720, -360)),
)

# Time s; roll, pitch, heading deg; north, east, down m.
PHONE = gesture(
    [
        (0.0, 0, 0, 0, 0, 0, 0),
        # Taken up, looked at, put back.
        (2.0, 0, 0, 0, 0, 0, 0),
        (3.0, 10, 50, -20, -0.15, 0.05, -0.30),
        (4.0, -5, 60, -10, -0.20, 0.05, -0.35),
        (5.2, 0, 0, 0, 0, 0, 0),
        # Taken up and turned to the long side and back.
        (7.2, 0, 0, 0, 0, 0, 0),
        (8.2, 0, 45, 0, -0.10, 0, -0.30),
        (9.0, -40, 30, 80, -0.10, 0.05, -0.30),
        (10.0, -40, 30, 80, -0.10, 0.05, -0.30),
        (10.7, 5, 45, 0, -0.10, 0, -0.30),
        (11.8, 0, 0, 0, 0, 0, 0),
        # Laid a quarter turn to the right, half a metre on, and back.
        (14.0, 0, 0, 0, 0, 0, 0),
        (14.8, 0, 20, 40, 0.20, 0.20, -0.15),
        (15.8, 0, 0, 90, 0.30, 0.40, 0),
        (17.8, 0, 0, 90, 0.30, 0.40, 0),
        (18.6, -15, 15, 50, 0.20, 0.20, -0.15),
        (19.6, 0, 0, 0, 0, 0, 0),
        # Turned over, face down and on round: a whole turn of roll.
        (21.6, 0, 0, 0, 0, 0, 0),
        (22.4, 90, 10, 0, 0, 0.05, -0.20),
        (23.0, 180, 0, 0, 0, 0.05, -0.20),
        (23.7, 270, -10, 5, 0, 0.05, -0.20),
        (24.6, 360, 0, 0, 0, 0, 0),
        # To the ear and back.
        (26.6, 360, 0, 0, 0, 0, 0),
        (27.8, 290, 65, -60, -0.30, 0.20, -0.50),
        (29.0, 295, 60, -55, -0.30, 0.20, -0.50),
        (30.4, 360, 0, 0, 0, 0, 0),
    ],
    33.0,
)
