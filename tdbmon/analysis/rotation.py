"""Rotor speed and shaft angle from the speed signal and keyphasor of a record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.machine import Machine
from tdbsim.rotor import RotorModel

from tdbmon.analysis.result import NO_DROP
from tdbmon.analysis.rundown import RunDown, fit_rundown, speed_alone
from tdbmon.quantity import counted
from tdbmon.record.finding import Check
from tdbmon.record.held_speed import HELD
from tdbmon.record.keyphasor import Pulses, pulses, shaft_angle
from tdbmon.record.keyphasor import speed as pulse_speed
from tdbmon.record.samples import known_samples, times_of
from tdbmon.record.speed_checks import STANDSTILL_HZ, starting_speed

_FEWEST = 4  # least number of speed values
_HEAD_S = 0.01  # start of a record, which gives the initial speed if the release is unknown
_LEAD_S = 0.2  # stretch before a known release, which gives the initial speed


@dataclass(frozen=True, eq=False)
class Rotation:
    """Speed at its own sample times, from the speed channel, or by revolution from the keyphasor if that gives more values.

    Attributes
    ----------
    time, hz : (n,) arrays
        s and Hz; empty if the speed is unknown.
    pulses : Pulses or None
        Of the keyphasor.
    sampled : (m,) array or None
        Times of the keyphasor's samples, s, if the speed comes from it alone; None otherwise.
    held : float
        Time for which each value of the speed channel is held in the record, s.
    """

    time: np.ndarray
    hz: np.ndarray
    pulses: Pulses | None
    sampled: np.ndarray | None = None
    held: float = 0.0

    @classmethod
    def of(cls, record: xr.Dataset, machine: Machine) -> Rotation:
        """Return the rotation of a record with the channel names of its machine."""
        key = pulses(record, machine) if "keyphasor" in record else None
        time, hz, held = np.empty(0), np.empty(0), 0.0
        if "speed" in record:
            channel = record["speed"]
            held = float(channel.attrs.get(HELD, 0.0))
            time, hz = known_samples(channel)
        fewest = max(_FEWEST, len(time) + 1)  # a slow speed channel, say one value a second, gives fewer
        if key is not None and len(key.times) >= fewest:
            time, hz, _ = pulse_speed(key)
            return cls(time, hz, key, times_of(record["keyphasor"]))
        return cls(time, hz, key, held=held)

    @property
    def known(self) -> bool:
        """True if the speed is known at four times or more."""
        return len(self.time) >= _FEWEST

    def before(self, release: float | None) -> float | None:
        """Return the median speed up to the release (of the first 10 ms if that is unknown), Hz; None at standstill.

        Without a value in the 0.2 s before the release the last one before that is taken, or else the first of all.
        """
        if not self.known:
            return None
        if release is None:
            value = starting_speed(self.time, self.hz, _HEAD_S)
        else:
            first, stop = np.searchsorted(self.time, [release - _LEAD_S, release]).tolist()
            stop = max(stop, 1)
            value = float(np.median(self.hz[min(first, stop - 1) : stop]))
        return value if value is not None and value > STANDSTILL_HZ else None

    def angle(self, time: np.ndarray, machine: Machine) -> np.ndarray | None:
        """Return the shaft angle, rad, at times (k,), s; None without at least three pulses."""
        return (
            shaft_angle(self.pulses, time, machine) if self.pulses is not None and len(self.pulses.times) > 2 else None
        )

    def run_down(self, released: float | None, rotor: RotorModel, checks: list[Check]) -> RunDown | None:
        """Fit the run-down from the release, or else from the first value; if impossible, append a failed check saying why."""
        if not self.known:
            if self.time.size:
                few = f"{counted(self.time.size, 'value')} of the speed in the record; {_FEWEST} are needed for a run-down"
                few += ": record it more often"
                checks.append(Check("speed", "speed", False, few))
            return None
        time, hz = self._signal
        if released is not None and not time[0] <= released < time[-1]:
            known = f"known only from {time[0]:.4g} to {time[-1]:.4g} s, not at the release ({released:.4g} s)"
            checks.append(Check("speed", "", False, f"{known}: no run-down is evaluated"))
            return None
        return fit_rundown(
            time,
            hz,
            release_time=float(self.time[0]) if released is None else released,
            polar_inertia=rotor.polar_inertia,
            pulses=self.pulses,
            held=self.held,
        )

    def without_drop(self) -> RunDown | None:
        """Return the speed of a record that contains no drop; None if unknown."""
        return speed_alone(*self._signal, pulses=self.pulses, held=self.held, why=NO_DROP) if self.known else None

    @property
    def _signal(self) -> tuple[np.ndarray, np.ndarray | None]:
        """Times and speed signal for `fit_rundown`; no signal if the speed comes from the keyphasor alone."""
        return (self.time, self.hz) if self.sampled is None else (self.sampled, None)
