"""The features of an analysed drop."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from tdbsim.errors import InputError

from tdbmon.analysis.free_fall import probe_ratio
from tdbmon.analysis.result import Analysis, EndResult
from tdbmon.estimate import Estimate, since
from tdbmon.history.fatigue import fatigue_of
from tdbmon.history.feature import KINDS, NO_FORCES, Feature
from tdbmon.history.severity import severity
from tdbmon.record.keyphasor import speed_over_pulses

if TYPE_CHECKING:
    from tdbmon.identify.fitted import FittedDrop


def features_of(analysis: Analysis, fitted: FittedDrop | None = None) -> tuple[Feature, ...]:
    """Return every feature of `KINDS` of one drop, missing ones with the reason.

    Their intervals exclude the errors common to all drops of the machine (`Estimate.scatter`), which cancel in differences
    between drops.

    Parameters
    ----------
    analysis : Analysis
    fitted : FittedDrop, optional
        The model fitted to this drop: forces, stresses, friction, support.
    """
    found = _of_rotor(analysis)
    for end in analysis.ends.values():
        found += _of_end(analysis, end)
        found += _of_fit(end.name, fitted)
    return tuple(replace(each, estimate=each.estimate.apart) for each in found)


def _of_rotor(analysis: Analysis) -> list[Feature]:
    rundown, release = analysis.rundown, analysis.release_time
    lower, higher = analysis.swings
    still = Estimate.missing("s", "the record has no speed") if rundown is None else rundown.standstill_time
    values = {
        "keyphasor_ratio": speed_over_pulses(analysis.record, analysis.machine),
        "settled_s": _in(analysis.settle_time, "s"),
        "standstill_time_s": since(still, release, "s"),
        "swing_1_hz": lower,
        "swing_2_hz": higher,
    }
    for name, attribute in (
        ("initial_hz", "initial"),
        ("decay_time_s", "decay_time"),
        ("drag_torque_n_m", "drag_torque"),
        ("lost_speed_hz", "lost_speed"),
    ):
        missing = Estimate.missing(KINDS[name].unit, "the record has no speed")
        values[name] = missing if rundown is None else getattr(rundown, attribute)
    return [Feature(name, "", estimate) for name, estimate in values.items()]


def _of_end(analysis: Analysis, end: EndResult) -> list[Feature]:
    circle, first = end.circle, end.first
    whirl = analysis.whirl.get(end.name)
    unwhirled = end.unsettled if whirl is None else whirl.hidden
    values = {
        "gap_um": circle.radius,
        "gap_from_swing_um": end.gap_from_swing,
        "gap_oval_um": circle.oval,
        "gap_centre_x_um": circle.centre[0],
        "gap_centre_y_um": circle.centre[1],
        "stiffness_n_per_m": end.stiffness,
        "fall_time_ms": since(first.touch, analysis.release_time, "ms"),
        "first_contact_duration_ms": _in(first.duration, "ms"),
        "rebound_um": first.rebound,
        "restitution": first.restitution,
        "contacts": end.contact_count,
        "deepest_um": end.deepest,
        "whirl_backward_s": _whirled(None if whirl is None else whirl.backward_longest_s, unwhirled),
        "whirl_full_s": _whirled(None if whirl is None else whirl.full_longest_s, unwhirled),
        **_levitated(analysis, end),
        "probe_ratio": _probe_ratio(analysis, end),
        **_severity(analysis, end),
    }
    return [Feature(name, end.name, estimate) for name, estimate in values.items()]


def _levitated(analysis: Analysis, end: EndResult) -> dict[str, Estimate]:
    names = ("levitated_x_um", "levitated_y_um", "levitated_1x_um", "levitated_noise_um", "levitated_share")
    why = "" if end.seen else "no orbit at this end"
    if analysis.planes is None or analysis.release is None or analysis.release.time.value is None:
        why = "the record shows no release"
    if why:
        return {name: Estimate.missing(KINDS[name].unit, why) for name in names}
    found = analysis.levitation[end.name]
    return dict(zip(names, (found.x, found.y, found.once, found.noise, found.share), strict=True))


def _probe_ratio(analysis: Analysis, end: EndResult) -> Estimate:
    if analysis.release is None:
        return Estimate.missing("1", "the record shows no release")
    return probe_ratio(analysis.release, analysis.machine, end.name)


def _severity(analysis: Analysis, end: EndResult) -> dict[str, Estimate]:
    if analysis.planes is None or analysis.release is None or analysis.release.time.value is None or end.gap is None:
        why = end.unsettled if end.gap is None else "it needs the time of the release"
        return dict.fromkeys(("v_peak", "v_rms"), Estimate.missing("1", why))
    initial = Estimate.missing("Hz", "the record has no speed")
    if analysis.rundown is not None:
        initial = analysis.rundown.initial
    try:  # errors of the radius common to all drops are common to V too
        found = severity(analysis.planes, end.name, analysis.release.time.value, initial.apart, end.gap.radius.apart)
    except InputError as error:
        return dict.fromkeys(("v_peak", "v_rms"), Estimate.missing("1", str(error)))
    return {"v_peak": found.peak, "v_rms": found.rms}


def _of_fit(end: str, fitted: FittedDrop | None) -> list[Feature]:
    names = [name for name, kind in KINDS.items() if kind.forces]
    if fitted is None or end not in fitted.forces.ends:
        return [Feature(name, end, Estimate.missing(KINDS[name].unit, NO_FORCES)) for name in names]
    if why := fitted.forces.withheld:  # the fitted values come from the same fit
        return [Feature(name, end, Estimate.missing(KINDS[name].unit, why)) for name in names]
    forces, values = fitted.forces.ends[end], fitted.calibration.values
    stated = "the machine file states it without a tolerance, so it was not fitted"
    stress = forces.stress
    rule = "mean while any ball is loaded" + (f"; {stress.assumption}" if stress.assumption else "")
    mean = Estimate(stress.mean, unit="MPa", method=rule, why="value of the fitted drop, without interval")
    found = {
        "peak_force_n": forces.peak,
        "stress_max_mpa": stress.greatest,
        "stress_mean_mpa": mean if stress.greatest.known else stress.greatest,
        "fatigue_cycles": fatigue_of(forces.fatigue, end),
        "ring_at_speed_s": forces.ring_at_speed,
        "air_gap_fitted_um": values.get(f"{end}.radial_gap", Estimate.missing("um", stated)),
        "ball_clearance_fitted_um": values.get(f"{end}.diametral_clearance", Estimate.missing("um", stated)),
        "ring_drag_fitted_n_m": values.get(f"{end}.inner_ring_drag", Estimate.missing("N m", stated)),
        "friction": values.get(f"{end}.friction", Estimate.missing("1", stated)),
        "support_stiffness_n_per_m": values.get(f"{end}.support_stiffness", Estimate.missing("N/m", stated)),
        "support_damping_n_s_per_m": values.get(f"{end}.support_damping", Estimate.missing("N s/m", stated)),
    }
    return [Feature(name, end, found[name]) for name in names]


def _in(estimate: Estimate, unit: str) -> Estimate:
    """Return the estimate with another unit of the same dimension."""
    e = estimate
    return Estimate(e.value, e.low, e.high, unit, e.method, e.why, e.kind)


def _whirled(longest: float | None, why: str) -> Estimate:
    if longest is None or not np.isfinite(longest):
        return Estimate.missing("s", why)
    return Estimate(longest, unit="s", method="longest whirl over one turn or more", why="resolved to one sample")
