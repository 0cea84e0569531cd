"""Features: the quantities of a drop kept in the archive, each an estimate by name and end."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from tdbmon.estimate import Estimate

Key = tuple[str, str]  # name and end of a quantity

NO_FORCES = "needs the fitted simulation: file the drop with --forces"  # reason for a missing fitted feature


@dataclass(frozen=True)
class Feature:
    """One quantity of one drop.

    Attributes
    ----------
    name : str
        Key of `KINDS`; includes the unit of output (``gap_um``).
    end : str
        The machine's end; empty for the whole rotor.
    estimate : Estimate
    """

    name: str
    end: str
    estimate: Estimate

    @property
    def key(self) -> Key:
        """Name and end."""
        return self.name, self.end


@dataclass(frozen=True)
class FeatureKind:
    """Definition of a feature, and how its changes are judged.

    Attributes
    ----------
    name : str
    title : str
        For reports.
    unit : str
        Key of `tdbmon.estimate.OUTSIDE`.
    least : float
        Lower bound of the scatter between drops (standard deviation), SI, or relative if `relative`: about the 10th percentile
        over the synthetic machines of `docs/history.md`, since the scatter of few drops may be small by chance.
    relative : bool
        `least` is relative to the value.
    meaning : str
        Possible causes of a change.
    less : str
        Possible causes of a decrease, if different; wear never makes a clearance smaller.
    both_ends : bool
        The impact at the other end adds energy to it or takes energy from it, so that a change may come from there.
    two_forms : bool
        It depends on how the bounces of both ends coincide, and so has a rare form beside the usual one on some machines.
    carried : bool
        A position extrapolated to the bearing along the line through the probes of both ends, so that a probe at the other end
        affects it.
    forces : bool
        It needs the fitted simulation (``--forces``).
    judged : bool
        A change counts towards the verdict; changes of features unrelated to the fall and its contacts are reported beside it.
    """

    name: str
    title: str
    unit: str
    least: float
    meaning: str
    less: str = ""
    relative: bool = False
    both_ends: bool = False
    two_forms: bool = False
    carried: bool = False
    forces: bool = False
    judged: bool = True

    def title_at(self, end: str) -> str:
        """Return title and end for reports; an empty end stands for the whole rotor."""
        return f"{self.title}, {end}" if end else self.title

    def causes(self, difference: float) -> str:
        """Return the possible causes of a change, given its difference."""
        return self.less if self.less and difference < 0 else self.meaning


_NARROWER = "sensitivity or angle of the probes, heat, dirt between journal and ring"

_KINDS = (
    FeatureKind("gap_um", "Radius at rest", "um", 1.5e-6,
                "wear of journal or inner ring, worn or dented balls and races, a support that gave way", less=_NARROWER),
    FeatureKind("gap_from_swing_um", "Radius at rest from the swing", "um", 1e-6,
                "wear of journal or inner ring, worn or dented balls and races, a support that gave way", less=_NARROWER),
    FeatureKind("gap_oval_um", "Out-of-roundness of the clearance", "um", 8e-6, "uneven wear of ring or housing"),
    FeatureKind("gap_centre_x_um", "Clearance centre x", "um", 0.2e-6,
                "bearing or probes moved sideways, sensitivity of a probe", carried=True),
    FeatureKind("gap_centre_y_um", "Clearance centre y", "um", 2e-6,
                "bearing or probes moved up or down, sensitivity of a probe", carried=True),
    FeatureKind("stiffness_n_per_m", "Single-mass stiffness", "N/m", 0.016,
                "a support that became looser or stiffer, or a worn or opened gap, which makes the impact harder",
                relative=True),
    FeatureKind("fall_time_ms", "Fall, release to first touch", "ms", 1.2e-5,
                "gap or set-point changed", less=f"set-point lower, {_NARROWER}"),
    FeatureKind("first_contact_duration_ms", "First contact, duration", "ms", 2.7e-5,
                "stiffness of bearing and support, a worn or opened gap", both_ends=True, two_forms=True),
    FeatureKind("rebound_um", "Rebound after the first contact", "um", 2.7e-6,
                "damping of bearing and support", both_ends=True, two_forms=True),
    FeatureKind("restitution", "Restitution of the first contact", "1", 0.01,
                "damping", both_ends=True, two_forms=True),
    FeatureKind("contacts", "Contacts before settling", "1", 0.15,
                "damping, gap or friction", relative=True, both_ends=True, two_forms=True),
    FeatureKind("deepest_um", "Deepest excursion", "um", 2.8e-6,
                "wear of journal or inner ring, stiffness of bearing and support, whirl",
                less=f"stiffness of bearing and support, {_NARROWER}"),
    FeatureKind("whirl_backward_s", "Longest backward whirl", "s", 1e-3, "friction between journal and ring"),
    FeatureKind("whirl_full_s", "Longest whirl right round", "s", 1e-3, "friction, unbalance"),
    FeatureKind("v_peak", "Rotor-centre velocity V, peak", "1", 0.02, "severity of the drop", relative=True),
    FeatureKind("v_rms", "Rotor-centre velocity V, rms", "1", 0.025, "severity of the drop", relative=True),
    FeatureKind("peak_force_n", "Greatest force on the ring", "N", 0.02,
                "stiffness, gap, set-point", relative=True, forces=True),
    FeatureKind("stress_max_mpa", "Greatest Hertz stress of a ball", "MPa", 0.01,
                "load and its share among the balls", relative=True, forces=True),
    FeatureKind("stress_mean_mpa", "Mean Hertz stress while loaded", "MPa", 0.01,
                "load and its share among the balls", relative=True, forces=True),
    FeatureKind("fatigue_cycles", "Fatigue of the worst ball, in cycles of 2000 MPa", "1", 0.2,
                "load and its share among the balls", relative=True, forces=True, judged=False),
    FeatureKind("ring_at_speed_s", "Inner ring at shaft speed after", "s", 1e-3,
                "friction, drag of the bearing", forces=True),
    FeatureKind("air_gap_fitted_um", "Air gap (fitted)", "um", 1e-6,
                "wear of journal or inner ring", less=_NARROWER, forces=True),
    FeatureKind("ball_clearance_fitted_um", "Ball clearance (fitted)", "um", 1.5e-6,
                "worn or dented balls and races", forces=True),
    FeatureKind("ring_drag_fitted_n_m", "Drag of the inner ring (fitted)", "N m", 0.02,
                "grease, damage of the bearing", relative=True, forces=True),
    FeatureKind("friction", "Friction of journal on ring (fitted)", "1", 0.02,
                "surface of journal and ring, lubricant", relative=True, forces=True),
    FeatureKind("support_stiffness_n_per_m", "Support stiffness (fitted)", "N/m", 0.02,
                "support became looser", relative=True, forces=True),
    FeatureKind("support_damping_n_s_per_m", "Support damping (fitted)", "N s/m", 0.02,
                "support", relative=True, forces=True),
    FeatureKind("decay_time_s", "Decay time of the speed", "s", 0.001, "windage, drag of the bearings", relative=True),
    FeatureKind("drag_torque_n_m", "Torque of constant drag", "N m", 0.01,
                "drag of the touchdown bearings, grease", relative=True),
    FeatureKind("lost_speed_hz", "Speed lost to contacts, ring spin-up", "Hz", 0.003, "friction, inertia of the rings"),
    FeatureKind("standstill_time_s", "Standstill after the release", "s", 0.005, "drag", relative=True),
    FeatureKind("swing_1_hz", "Lower swing in the clearance", "Hz", 0.02, "gap"),
    FeatureKind("swing_2_hz", "Higher swing in the clearance", "Hz", 0.02, "gap"),
    FeatureKind("settled_s", "Settled on both rings after", "s", 0.4,
                "damping, friction", relative=True, two_forms=True),
    FeatureKind("levitated_x_um", "Levitated position, x", "um", 1e-6, "set-point, probes", judged=False),
    FeatureKind("levitated_y_um", "Levitated position, y", "um", 1e-6, "set-point, probes", judged=False),
    FeatureKind("levitated_1x_um", "Once per revolution in levitation", "um", 0.05,
                "unbalance, run-out, control", relative=True, judged=False),
    FeatureKind("levitated_noise_um", "Noise in levitation", "um", 0.05,
                "probes, recorder, control", relative=True, judged=False),
    FeatureKind("keyphasor_ratio", "Stated speed over that of the keyphasor", "1", 1e-3,
                "keyphasor, recorder", judged=False),
    FeatureKind("initial_hz", "Speed at the release", "Hz", 0.01, "how the drop was made", judged=False),
    FeatureKind("probe_ratio", "Free fall by one probe over the other's", "1", 0.01,
                "sensitivity or angle of a probe, or a channel that is late", relative=True, judged=False),
    FeatureKind("levitated_share", "Farthest from the clearance centre in levitation, over C_min (ISO 14839-2)", "1", 0.05,
                "set-point, unbalance, run-out, control, or a clearance whose centre moved", relative=True, judged=False),
)  # fmt: skip

KINDS = {kind.name: kind for kind in _KINDS}
_RANKS = {name: rank for rank, name in enumerate(KINDS)}


def in_order(features: Iterable[Key], ends: Sequence[str]) -> list[Key]:
    """Return features (name and end) in the order of `KINDS`, then in that of the ends."""
    return sorted(features, key=lambda feature: (_RANKS[feature[0]], place_of(feature[1], ends)))


def place_of(end: str, ends: Sequence[str]) -> tuple[int, str]:
    """Return the sort key of an end: its place in the machine file; ends not named there follow by name."""
    return (ends.index(end) if end in ends else len(ends)), end
