"""A value with its 95 % confidence interval: the type of every number in figures, JSON and reports."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

Z95 = 1.96  # half-width of a 95 % interval in standard deviations

# units in JSON, figures and reports, with their factor from SI
OUTSIDE = {
    "um": 1e6, "mm": 1e3, "m": 1.0, "s": 1.0, "ms": 1e3, "Hz": 1.0, "N": 1.0, "N/m": 1.0, "N s/m": 1.0, "kg": 1.0,
    "mm/s": 1e3, "MPa": 1e-6, "N m": 1.0, "1": 1.0, "deg": 180 / math.pi, "%": 100.0, "1/s": 1.0,
    "g mm": 1e6, "1/m": 1.0, "Hz/s": 1.0, "s/m": 1.0, "us": 1e6, "nm/J": 1e9, "m/s": 1.0, "N/m^3": 1.0,
    "N/m^(10/9)": 1.0, "N/m^1.5": 1.0, "GPa": 1e-9,
}  # fmt: skip


@dataclass(frozen=True)
class Estimate:
    """A quantity in SI with a 95 % confidence interval.

    Attributes
    ----------
    value, low, high : float or None
        In SI.  All are None if the quantity could not be estimated, `low` and `high` alone if a value has no interval; `why`
        then gives the reason.
    unit : str
        The unit in JSON, figures and reports, one of `OUTSIDE`.
    method : str
        The method of estimation, in a few words.
    why : str
        The reason why the value, or its interval, is missing.
    kind : str
        ``"0-pk"``, ``"pk-pk"``, ``"rms"`` for amplitudes; empty otherwise.
    scatter : Estimate or None
        The same without the systematic errors common to all records of a machine, which cancel in differences between records;
        None if the interval includes no such errors.
    """

    value: float | None
    low: float | None = None
    high: float | None = None
    unit: str = "1"
    method: str = ""
    why: str = ""
    kind: str = ""
    scatter: Estimate | None = None

    def __post_init__(self) -> None:
        if self.unit not in OUTSIDE:
            raise ValueError(f"unit '{self.unit}' has no factor in OUTSIDE; add it there")
        numbers = [x for x in (self.value, self.low, self.high) if x is not None]
        if any(not math.isfinite(x) for x in numbers):
            raise ValueError(f"an estimate must be finite, not {self.value}, {self.low}, {self.high} ({self.method})")
        if self.value is None and not self.why:
            raise ValueError("an estimate without a value must say why")

    @classmethod
    def missing(cls, unit: str, why: str) -> Estimate:
        """Return a quantity that could not be estimated, with the reason."""
        return cls(None, unit=unit, why=why)

    @classmethod
    def from_sigma(
        cls,
        value: float,
        sigma: float,
        unit: str,
        method: str,
        kind: str = "",
        quantile: float = Z95,
        least: float = -math.inf,
    ) -> Estimate:
        """Return a value with the interval ``value ± quantile * sigma`` (SI), truncated below at `least`."""
        low = max(value - quantile * sigma, min(least, value))
        return cls(value, low, value + quantile * sigma, unit, method, "", kind)

    def widened(self, by: float, holds: str = "", least: float = -math.inf) -> Estimate:
        """Return the estimate with the interval widened by a systematic error (SI) common to all records; `holds` names it.

        It has the same, unknown, sign in every record, and so is added linearly to both halves.
        """
        if self.value is None or self.low is None or self.high is None or by == 0.0:
            return self
        return replace(
            self,
            low=max(self.low - by, min(least, self.low)),
            high=self.high + by,
            method=f"{self.method}; interval: also {holds}" if holds else self.method,
            scatter=self.apart,
        )

    @property
    def apart(self) -> Estimate:
        """The estimate with the interval of the record-to-record scatter alone."""
        return self.scatter or self

    def later(self, by: float) -> Estimate:
        """Return an instant (s) relative to a time origin that is earlier by this much, s."""
        value, low, high = (None if each is None else each + by for each in (self.value, self.low, self.high))
        return replace(self, value=value, low=low, high=high, scatter=self.scatter and self.scatter.later(by))

    @property
    def shared(self) -> float:
        """The widening of the interval's upper half by errors common to all records, SI."""
        return 0.0 if self.high is None or self.apart.high is None else self.high - self.apart.high

    @property
    def known(self) -> bool:
        """True if there is a value."""
        return self.value is not None

    @property
    def width(self) -> float | None:
        """Width of the interval, SI; None without one."""
        return None if self.low is None or self.high is None else self.high - self.low

    @property
    def sigma(self) -> float | None:
        """Standard deviation implied by the interval's width; None without an interval.

        Taken from the upper half if the interval begins at zero, where the lower half may be truncated.
        """
        if self.value is None or self.low is None or self.high is None:
            return None
        half = self.high - self.value if self.low == 0.0 else (self.high - self.low) / 2
        return half / Z95

    @property
    def log_sigma(self) -> float | None:
        """Standard deviation of the logarithm implied by the interval; None unless the whole interval is positive."""
        if self.value is None or self.low is None or self.high is None or self.low <= 0:
            return None
        return math.log(self.high / self.low) / 2 / Z95

    @property
    def outside(self) -> tuple[float | None, float | None, float | None]:
        """Value, low and high in `unit`."""
        factor = OUTSIDE[self.unit]
        value, low, high = (None if x is None else x * factor for x in (self.value, self.low, self.high))
        return value, low, high

    def to_json(self) -> dict[str, Any]:
        """Return the quantity in the form of the JSON contract."""
        value, low, high = self.outside
        out: dict[str, Any] = {"value": value, "low": low, "high": high, "unit": self.unit, "method": self.method}
        if self.kind:
            out["kind"] = self.kind
        if self.why:
            out["why"] = self.why
        return out

    def __str__(self) -> str:
        from tdbmon.quantity import printed

        return printed(self)


def since(instant: Estimate, origin: Estimate | None, unit: str = "ms") -> Estimate:
    """Return the time from an origin (the release) to a later instant; the intervals of both are combined."""
    if instant.value is None:
        return Estimate.missing(unit, instant.why)
    if origin is None or origin.value is None:
        return Estimate.missing(unit, "the release is not known" if origin is None else origin.why)
    span = instant.value - origin.value
    if instant.low is None or instant.high is None or origin.low is None or origin.high is None:
        return Estimate(span, unit=unit, method=instant.method, why=instant.why or origin.why)
    low = span - math.hypot(instant.value - instant.low, origin.high - origin.value)
    high = span + math.hypot(instant.high - instant.value, origin.value - origin.low)
    return Estimate(span, max(low, min(span, 0.0)), high, unit, instant.method)
