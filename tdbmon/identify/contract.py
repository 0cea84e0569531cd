"""The JSON of calibration and forces: what `tdbmon analyse` adds once a model has been fitted."""

from __future__ import annotations

from typing import Any

from tdbmon.analysis.contact_events import Contact
from tdbmon.estimate import OUTSIDE
from tdbmon.identify.agreement import Agreement
from tdbmon.identify.calibration import Calibration
from tdbmon.identify.coast_down import CoastDown
from tdbmon.identify.coast_down_comparison import course, paired_lines, resonances, scalars
from tdbmon.identify.fitted import FittedDrop
from tdbmon.identify.forces import DropForces, EndForces
from tdbmon.identify.friction_choice import FrictionChoice
from tdbmon.identify.model_share import FORCES_HOLD
from tdbmon.identify.natural_frequencies import ORDERS, NaturalFrequencies
from tdbmon.identify.stress import Stress
from tdbmon.quantity import plain, printed, short, why_no_interval

_IMPULSE = "of the fitted drop; interval of the simulations that the peak comes from"


def with_fitted(content: dict[str, Any], fitted: FittedDrop) -> dict[str, Any]:
    """Return the JSON of an analysis with the results of the fitted model added, to each end and beside the ends."""
    ends = dict(content["ends"])
    for end, found in fitted.forces.ends.items():
        ends[end] = ends.get(end, {}) | end_json(fitted.calibration, found, fitted.calibration.drops[0].release.value)
    return content | {"ends": ends} | fitted_json(fitted)


def end_json(calibration: Calibration, forces: EndForces, release: float | None) -> dict[str, Any]:
    """Return ``support``, ``peak_force_n``, ``stress_mpa``, ``ring_at_speed_s``, ``contact_forces`` of one end in one drop.

    Times count from the record's first sample, as all times in that JSON do; so does `release`, the instant of the release, s.

    Peak and stress are the greatest within `tdbmon.identify.forces.SECONDS` after the release, as their method states.
    Contacts are listed until the ensemble's members have diverged.  All entries replace those of the same name under ``ends``
    in the JSON of `tdbmon analyse`.
    """
    end, bearing, begins = forces.end, calibration.machine.bearing(forces.end), release or 0.0
    mass = calibration.value(f"{end}.support_mass", bearing.support_mass, "kg")
    stiffness = calibration.value(f"{end}.support_stiffness", bearing.support_stiffness.nominal, "N/m")
    damping = calibration.value(f"{end}.support_damping", bearing.support_damping.nominal, "N s/m")
    return {
        "support": {
            "mass_kg": mass.to_json(),
            "stiffness_n_per_m": stiffness.to_json(),
            "damping_n_s_per_m": damping.to_json(),
        },
        "peak_force_n": forces.peak.to_json(),
        "stress_mpa": _stress_json(forces.stress),
        "ring_at_speed_s": forces.ring_at_speed.later(begins).to_json(),
        "contact_forces": [
            {
                "start_s": begins + contact.start,
                "seconds": contact.seconds,
                "peak_n": contact.peak.to_json(),
                "impulse_n_s": {
                    "value": contact.impulse,
                    "low": contact.impulse_low,
                    "high": contact.impulse_high,
                    "unit": "N s",
                    "method": _IMPULSE,
                },
            }
            for contact in forces.contacts
        ],
    }


def calibration_json(calibration: Calibration, forces: tuple[DropForces, ...] = ()) -> dict[str, Any]:
    """Return the JSON of a calibration, with the forces of its drops where they were simulated."""
    return {
        "values": {name: value.to_json() for name, value in calibration.values.items()},
        "at_bound": [{"name": name, "si": calibration.values[name].value} for name in calibration.at_bound],
        "undetermined": [
            {"name": u.name, "share": u.share, "partners": [{"name": n, "correlation": c} for n, c in u.partners]}
            for u in calibration.undetermined
        ],
        "horizon_s": calibration.horizon,
        "residual_over_noise": calibration.misfit,
        "remarks": list(calibration.remarks),
        "seconds": calibration.seconds,
        "drops": [
            {
                "file": fit.name,
                "speed_hz": fit.speed,
                "release_time_s": fit.release.to_json(),
                "residual_over_noise": [{"horizon_s": r.horizon, "ratio": r.ratio} for r in fit.residuals if r.rms],
                "ends": {name: end_json(calibration, end, fit.release.value) for name, end in found.items()},
            }
            for fit, found in _with_forces(calibration, forces)
        ],
    }


def fitted_json(fitted: FittedDrop) -> dict[str, Any]:
    """Return the JSON that `tdbmon analyse --forces` adds beside the ends."""
    whole = fitted.coast_down
    return {
        "calibration": calibration_json(fitted.calibration, fitted.all_forces),
        "measured_against_simulated": agreement_json(fitted.agreement, fitted.friction),
        "natural_frequencies": natural_frequencies_json(fitted.natural_frequencies),
        "coast_down": None if whole is None else coast_down_json(whole, fitted.natural_frequencies),
    }


def coast_down_json(whole: CoastDown, natural: NaturalFrequencies) -> dict[str, Any]:
    """Return the features of a whole coast-down, measured and simulated; times in s after the release."""
    found = course(whole)
    return {
        "quantities": [
            {"name": name, "measured": a.to_json(), "simulated": b.to_json()} for name, a, b in scalars(whole)
        ],
        "lines": [
            {
                "name": name,
                "measured_hz": None if a is None else a.frequency.to_json(),
                "simulated_hz": None if b is None else b.frequency.to_json(),
            }
            for name, a, b in paired_lines(whole)
        ],
        "resonances": [
            {
                "order": each.order,
                "mode": each.mode + 1,
                "critical_speed_hz": each.critical,
                "measured": _peak(each.measured),
                "simulated": _peak(each.simulated),
            }
            for each in resonances(whole, natural)
        ],
        "speed_parts_s": found.speed_parts,
        "motion_parts_s": found.motion_parts,
    }


def _peak(found: tuple[float, float] | None) -> dict[str, float] | None:
    return None if found is None else {"speed_hz": found[0], "amplitude_um": found[1] * OUTSIDE["um"]}


def agreement_json(found: Agreement, friction: FrictionChoice | None) -> dict[str, Any]:
    """Return measured against simulated: residuals to increasing horizons, contact times, friction chosen by sensitivity.

    Times in s after the release.
    """
    out: dict[str, Any] = {
        "fitted_to_s": found.fitted_to,
        "residual": [
            {
                "horizon_s": each.horizon,
                "over_noise": each.ratio,
                "rms_um": {probe: value * OUTSIDE["um"] for probe, value in each.rms.items()},
            }
            for each in found.residuals
        ],
        "contacts": {
            name: [
                {
                    "measured_s": _span(pair.measured),
                    "simulated_s": _span(pair.simulated),
                    "force_s": None if pair.force is None else list(pair.force),
                }
                for pair in end.contacts
            ]
            for name, end in found.ends.items()
        },
    }
    if friction is not None:
        out["friction_by_sensitivity"] = {
            "value": friction.chosen,
            "seconds": friction.seconds,
            "fitted": {end: value.to_json() for end, value in friction.fitted.items()},
        }
    return out


def natural_frequencies_json(found: NaturalFrequencies) -> list[dict[str, Any]]:
    """Return the natural frequencies of the rotor at rest on its calibrated touchdown bearings."""
    return [
        {
            "frequency_hz": mode.frequency.to_json(),
            "direction": mode.direction,
            "massless_supports_hz": mode.massless,
            "critical_speed_hz": {f"{order:g}X": speed for order, speed in zip(ORDERS, mode.critical, strict=True)},
        }
        for mode in found.modes
    ]


def _span(contact: Contact | None) -> list[float] | None:
    return None if contact is None else [contact.start, contact.end]


def _stress_json(stress: Stress) -> dict[str, Any]:
    """Return the box of a stress in MPa."""
    factor = OUTSIDE["MPa"]
    if not stress.greatest.known:
        box = dict.fromkeys(
            ("mean", "median", "q1", "q3", "outliers", "outliers_tukey", "outlier_level", "outlier_level_tukey")
        )
        return {"max": stress.greatest.to_json(), **box, "assumption": stress.assumption, "why": stress.greatest.why}
    return {
        "max": stress.greatest.to_json(),
        "mean": factor * stress.mean,
        "median": factor * stress.median,
        "q1": factor * stress.q1,
        "q3": factor * stress.q3,
        "outliers": [factor * value for value in stress.outliers],
        "outliers_tukey": [factor * value for value in stress.tukey],
        "outlier_level": factor * stress.outlier_level,
        "outlier_level_tukey": factor * stress.tukey_level,
        "assumption": stress.assumption,
    }


def _with_forces(calibration: Calibration, forces: tuple[DropForces, ...]) -> list[tuple[Any, dict[str, EndForces]]]:
    if not forces:
        return [(fit, {}) for fit in calibration.drops]
    return [(fit, found.ends) for fit, found in zip(calibration.drops, forces, strict=True)]


def force_lines(calibration: Calibration, forces: DropForces) -> list[str]:
    """Return the forces and stresses of a drop as lines of text."""
    lines = [f"fitted model: residual of the first contacts {calibration.misfit:.2f} times the noise"]
    if forces.withheld:
        lines.append(f"forces and stresses: not estimated ({forces.withheld})")
    for name, end in () if forces.withheld else forces.ends.items():
        lines.append(f"{name}  (fitted model, first {forces.seconds:g} s)")
        lines.append(f"  {'peak force on the ring':<24}{printed(end.peak)}")
        lines.append(f"  {'peak stress of a ball':<24}{printed(end.stress.greatest)}")
        lines.append(f"  {'ring at speed after':<24}{printed(end.ring_at_speed)}{why_no_interval(end.ring_at_speed)}")
    if not forces.withheld:
        lines.append(f"  {plain(FORCES_HOLD)}")
    if calibration.at_bound:
        # without intervals, which do not hold for values at a bound
        told = ", ".join(f"{name} {plain(short(calibration.values[name]))}" for name in calibration.at_bound)
        lines.append(f"  at the limit of their range, so the true value may lie beyond: {told}")
    return lines + [f"  remark: {remark}" for remark in calibration.remarks]
