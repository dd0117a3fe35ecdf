"""A real crash: NHTSA test 10146, a 2018 Camry into a rigid wall at 57.09 km/h, 10 kHz."""

import numpy as np
import pytest

from strapdown.crash.acceleration import Acceleration
from strapdown.crash.crash_type import classify_crash
from strapdown.crash.delta_v import delta_v
from strapdown.crash.events import EventRule, detect_events
from strapdown.crash.pdof import pdof

# The four accelerometers of the rear crossmember, forward; left and right, and their doubles.
CHANNELS = ["093", "094", "099", "100"]


def channel(recordings, number):
    table = np.loadtxt(recordings("crash_nhtsa_10146") / f"v10146.{number}")
    time, ahead = table[:, 0], 9.80665 * table[:, 1]
    values = np.zeros((len(time), 3))
    values[:, 0] = ahead - ahead[time < -0.005].mean()
    return Acceleration(time, values, source=f"v10146.{number}")


@pytest.mark.parametrize("number", CHANNELS)
def test_one_event_from_contact_to_the_end_of_the_rebound(recordings, number):
    made = channel(recordings, number)
    search = detect_events(made)
    (event,) = search.events
    assert search.findings == ()
    # The trigger of the test is the contact, t = 0. A vehicle at 57 km/h into a wall reaches
    # 0.8 km/h within the first 20 ms, so that their first point is before the contact.
    assert -0.020 < event.time_zero < 0.0 < event.woken < 0.020
    # It stands still against the wall at 73 ms and has rebounded by 115 ms.
    assert 0.073 < event.end < 0.115
    # 18.35 to 18.72 m/s at 115 ms for the four, by others; the stretch over which the resting
    # value is taken moves it by up to 0.2 m/s² times 115 ms.
    change = delta_v(made, 0.0, 0.115)
    assert 18.35 - 0.023 < -change.vector[0] < 18.72 + 0.023
    # Outside of the event less than the threshold changes, twice.
    whole = delta_v(made, event.time_zero, event.end)
    assert whole.vector[0] == pytest.approx(change.vector[0], abs=0.45)
    assert classify_crash(change, 0.04 * np.eye(3)).name == "front"
    assert pdof(change).clock == 12


def test_the_four_channels_agree_on_their_times(recordings):
    events = [detect_events(channel(recordings, c)).first for c in CHANNELS]
    late = [
        detect_events(channel(recordings, c), EventRule(zero_at="threshold")).first
        for c in CHANNELS
    ]
    # One rigid member: the same contact within a millisecond, the same end within two.
    assert np.ptp([e.time_zero for e in events]) < 1e-3
    assert np.ptp([e.time_zero for e in late]) < 1e-3
    assert np.ptp([e.end for e in events]) < 2e-3
