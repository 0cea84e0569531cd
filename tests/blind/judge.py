"""Rules that decide whether a diagnosis is right, and comparison of its sizes with the true ones.

Nothing hidden: the verdict must be "none".  An effect outside the catalogue: "unknown".  Effects of the catalogue: all of them
named and nothing else; "ambiguous" is right if its set contains them, and is counted separately.  So is the place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

# the size parameter of each effect, by the catalogue's name; effects not listed have no single one
SIZE = {
    "residual_magnetic_force": "decay_time",
    "unbalance": "amount",
    "shaft_bow": "bow",
    "cross_coupled_stiffness": "stiffness",
    "stribeck_friction": "static_excess",
    "oval_clearance": "amplitude",
    "ring_out_of_round": "amplitude",
    "race_waviness": "amplitude",
    "off_sized_ball": "deviation",
    "support_anisotropy": "ratio",
    "loose_support": "play",
    "hardening_support": "cubic",
    "foundation_mode": "stiffness",
    "ring_drag": "torque",
    "quadratic_windage": "share",
    "thermal_growth": "growth",
    "probe_gain": "gain",
    "probe_angle": "error",
    "probe_runout": "first",
    "probe_crosstalk": "factor",
    "channel_lag": "delay",
}
TO_SI = {
    "": 1.0, "1": 1.0, "m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "s": 1.0, "ms": 1e-3, "us": 1e-6, "rad": 1.0,
    "deg": math.pi / 180, "Hz": 1.0, "N": 1.0, "N/m": 1.0, "N m": 1.0, "mN m": 1e-3, "N s/m": 1.0, "N/m^3": 1.0, "kg": 1.0,
    "kg m": 1.0, "g mm": 1e-6, "m/s": 1.0, "m/J": 1.0, "nm/J": 1e-9, "um/J": 1e-6, "%": 0.01,
}  # fmt: skip


@dataclass(frozen=True)
class Size:
    """The size of a hidden effect as found, SI."""

    effect: str
    true: float
    value: float
    low: float
    high: float

    @property
    def inside(self) -> bool:
        """True if the 95 % interval contains the true size."""
        return self.low <= self.true <= self.high


@dataclass(frozen=True)
class Judgement:
    """The judgement of a diagnosis: `kind` of the case, and what was `said` (effects, or the verdict itself)."""

    kind: str
    hidden: tuple[str, ...]
    said: tuple[str, ...]
    verdict: str
    right: bool
    place: bool
    ambiguous: bool
    sizes: tuple[Size, ...]
    stated: tuple[tuple[float, bool], ...]  # probability of each cause at its place, and whether it was hidden there


def judge(answer: dict[str, Any], result: dict[str, Any]) -> Judgement:
    """Compare a result of `tdbmon diagnose` with a case's answer."""
    hidden = {name: each for name, each in answer["hidden"].items() if name != "none"}
    causes = list(result.get("causes") or [])
    named = {cause["effect"] for cause in causes}
    verdict = str(result["verdict"])
    ambiguous = verdict == "ambiguous"
    if not hidden:
        kind, right = "none", verdict == "none"
    elif any(name.startswith("x_") for name in hidden):
        kind, right = "outside", verdict == "unknown"
    else:
        kind = "effect" if len(hidden) == 1 else "pair"
        right = named >= set(hidden) if ambiguous else verdict == "named" and named == set(hidden)
    place, sizes = right, []
    if right and kind in ("effect", "pair"):
        for name, each in hidden.items():
            there = [cause for cause in causes if cause["effect"] == name and _same_place(each["where"], cause)]
            place = place and bool(there)
            sizes += [size for cause in there[:1] if (size := _size(name, each["parameters"], cause)) is not None]
    said = tuple(sorted(named)) if verdict in ("named", "ambiguous") else (verdict,)
    stated = tuple(
        (
            float(cause["probability"]),
            cause["effect"] in hidden and _same_place(hidden[cause["effect"]]["where"], cause),
        )
        for cause in causes
        if cause.get("probability") is not None
    )
    return Judgement(kind, tuple(sorted(hidden)), said, verdict, right, place, ambiguous, tuple(sizes), stated)


def _same_place(true: str, cause: dict[str, Any]) -> bool:
    found = cause.get("where")
    return found == true or (true == "both" and found in ("NDE", "DE"))


def _size(name: str, parameters: dict[str, float], cause: dict[str, Any]) -> Size | None:
    """The size as found; None unless the result gives it with an interval in a known unit."""
    stem = SIZE[name]
    true = parameters[_named(stem, parameters)]
    found_all = cause.get("parameters") or {}
    key = _named(stem, found_all)
    found = found_all.get(key)
    if not isinstance(found, dict) or found.get("low") is None or found.get("value") is None:
        return None
    scale = TO_SI.get(str(found.get("unit", "")).replace("µ", "u"))
    if scale is None:
        return None
    if name == "support_anisotropy" and found["value"] > 1 > true:
        true = 1 / true  # stiffer across is softer along
    return Size(name, true, scale * found["value"], scale * found["low"], scale * found["high"])


def _named(stem: str, parameters: dict[str, Any]) -> str:
    """The key of a parameter with any unit as suffix; the shortest one, since "first_phase_deg" is not "first_um"."""
    return min((key for key in parameters if key == stem or key.startswith(stem + "_")), key=len, default="")
