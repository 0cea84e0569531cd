"""From drops to a verdict: the steps of the diagnosis in their order."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import xarray as xr
from tdbsim.machine import Machine, Probe

from tdbmon.diagnosis.contender import PLAIN_LEAD, SLOPES, Contender, plain_of, settled
from tdbmon.diagnosis.contest import contest
from tdbmon.diagnosis.drifting_probe import drifting_probe
from tdbmon.diagnosis.held_out import LEAST_DROPS, HeldOut, proof_of
from tdbmon.diagnosis.late_cause import LateCause, departs, explains_the_rest, with_late_causes
from tdbmon.diagnosis.late_record import LateRecord, acts_later, departure_of, late_records, rest_lacks, untold
from tdbmon.diagnosis.moved_mark import moved_mark
from tdbmon.diagnosis.next_test import APART, DRIFT, ONE_MARK, PUT_RIGHT, next_test, of_one_speed
from tdbmon.diagnosis.sizes import Sizes, sizes_of
from tdbmon.diagnosis.slowing_cause import Slowed, with_slowing
from tdbmon.diagnosis.slows_otherwise import SlowsOtherwise, slowing_beside
from tdbmon.diagnosis.standing import standing_in_all_drops
from tdbmon.diagnosis.stated_exactly import exact_remarks
from tdbmon.diagnosis.suspects import Suspect, suspects
from tdbmon.diagnosis.verdict import Kind, Verdict, clear_of_nothing, doubted, outside, strained, verdict
from tdbmon.estimate import Estimate
from tdbmon.identify.crew import Crew
from tdbmon.identify.divergence import followable, parting_remarks, with_divergence
from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.machine_doubt import machine_doubt
from tdbmon.identify.measured_drops import measured_drops
from tdbmon.identify.problem import Problem, build_problem, check_start
from tdbmon.identify.stages import stages_of
from tdbmon.identify.stated_values import stated_remarks
from tdbmon.identify.unlike_drops import unlike_drops
from tdbmon.progress import Progress, silent


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The result of a diagnosis.

    Attributes
    ----------
    machine : Machine
    verdict : Verdict
    contenders : tuple of Contender
        The models of the contest, the best first; the plain model among them.
    proof : HeldOut or None
        Of the best model with a cause; None without such a model, or with one drop only.
    parameters : dict
        Estimates by accused model, cause and parameter.
    values : dict
        Estimates of the machine's values to which its file gives a tolerance, in the model that the verdict believes.
    late : tuple of LateRecord or None
        The rest of each drop's record against simulations of the believed model; None if it cannot be compared, or no model is
        believed.
    late_before : tuple of LateRecord or None
        The same without the cause that the rest of the record showed, if there is one.
    mistaken : str or None
        The error of set-up (mark, cables, machine file) that kept causes from being sought.
    next_test : str
        The drop or measurement that would teach most.
    remarks : tuple of str
        Faults of the records, and what they cost.
    seconds : float
    wanted : mapping of float
        Values (SI, by name) that fit the drops, of entries of the machine file which they contradict.
    changed : str or None
        Those of them that changed since earlier drops that fit the file, if nothing else is missing.
    aside : tuple of str
        Further findings on which the verdict does not rest.
    """

    machine: Machine
    verdict: Verdict
    contenders: tuple[Contender, ...]
    proof: HeldOut | None
    parameters: dict[Contender, dict[str, dict[str, Estimate]]]
    values: dict[str, Estimate]
    late: tuple[LateRecord, ...] | None
    late_before: tuple[LateRecord, ...] | None
    mistaken: str | None
    next_test: str
    remarks: tuple[str, ...]
    seconds: float
    wanted: Mapping[str, float] = field(default_factory=dict)
    changed: str | None = None
    aside: tuple[str, ...] = ()

    @property
    def extended(self) -> Contender | None:
        """The best model with causes."""
        return _best_with_cause(self.contenders)

    @property
    def plain(self) -> Contender:
        """The model without causes."""
        return plain_of(self.contenders)

    @property
    def best(self) -> Contender:
        """The first accused model, or the likeliest of all if none is accused."""
        return self.verdict.leading(self.contenders)


def diagnose(
    machine: Machine, records: Sequence[xr.Dataset], progress: Progress = silent, workers: int = 1
) -> Diagnosis:
    """Find what the model of a machine lacks.

    Parameters
    ----------
    machine : Machine
    records : sequence of Dataset
        Drops of the machine in one condition, as from `tdbmon.record.read.read`.
    progress : callable, optional
        Called with the name of each step as it begins.
    workers : int
        Processes that take part (see `tdbmon.identify.crew.Crew`).

    Raises
    ------
    InputError
        If there is no record, one cannot be used, or the machine file does not fit: then the plain model cannot even
        follow the fall before the first contact, or not be simulated.
    """
    began = time.monotonic()
    machine, left_out = standing_in_all_drops(machine)
    progress("reading levitation and noise")
    drops = measured_drops(records, machine)
    horizons = [h for h in stages_of(machine).diagnosis if h <= min(drop.seconds for drop in drops)]
    with Crew(workers) as crew:
        problem = build_problem(machine, drops, crew)
        check_start(problem, horizons[0])
        problem = with_divergence(problem)
        asked, horizons = horizons, followable(problem, horizons)
        progress("comparing the machine file with the first contacts")
        mistaken = _mistake(drops, problem)
        # after an error of set-up no cause is sought: some effect would fit what is not there
        suspected = suspects(machine, _common(drops), problem.standing) if mistaken is None else ()
        compared = horizons if mistaken is None else problem.stages.until_touched(horizons)
        field = contest(problem, suspected, compared, progress)
        progress("evaluating how the rotor slows")
        field, slowed = with_slowing(field, suspected)
        found = _first_judged(field, slowed, suspected, progress)
        obstacle = mistaken or _drift(found, horizons)
        late, late_before, otherwise = None, None, None
        unseen: list[str] = []
        incomplete: Sequence[MeasuredDrop] = ()
        if obstacle is None and found.verdict.kind is not Kind.UNKNOWN and not found.verdict.alike:
            found, late, late_before = _beside_the_rest(found, suspected, progress)
            otherwise = acts_later(late) if late is not None else None
            if late is None:
                unseen = [untold(found.believed)]
                incomplete = rest_lacks(found.believed) or found.believed.problem.drops
        believed = found.believed
        unlike = _unlike(believed) if obstacle is None else []
        slows = slowing_beside(believed) if mistaken is None else SlowsOtherwise()
        judged, remarked = _against(found, obstacle, otherwise)
    return Diagnosis(
        machine=machine,
        verdict=judged,
        contenders=found.field,
        proof=found.proof,
        parameters={each: found.sizes[each].causes for each in judged.accused},
        values=found.sizes[believed].machine,
        late=late,
        late_before=late_before,
        mistaken=mistaken.why if mistaken is not None else None,
        next_test=obstacle.next_test
        if obstacle is not None
        else next_test(judged, found.field, slows.driven, incomplete),
        remarks=(
            *left_out,
            *exact_remarks(machine),
            *(remark for drop in drops for remark in (*drop.faults, *drop.remarks)),
            *_remarks(drops),
            *_ending_remarks(drops, problem.stages.diagnosis),
            *unseen,
            *parting_remarks(problem, asked, horizons),
            *unlike,
            *stated_remarks(believed.problem, believed.fit.point),
        ),
        seconds=time.monotonic() - began,
        aside=(*slows.remarks, *remarked),
        wanted=mistaken.wanted if mistaken is not None else {},
    )


def _unlike(believed: Contender) -> list[str]:
    """Return remarks on drops that do not go with the others, if they show at the first contacts too, before paths diverge."""
    found = unlike_drops(believed.problem, believed.fit)
    if not found:
        return []
    early = settled(believed, min(believed.problem.stages.bounced, believed.horizon), SLOPES)
    return unlike_drops(early.problem, early.fit)


@dataclass(frozen=True)
class _Obstacle:
    """An error of drops or machine file because of which no model can be believed, and the next test."""

    why: str
    next_test: str
    wanted: Mapping[str, float] = field(default_factory=dict)


def _mistake(drops: Sequence[MeasuredDrop], problem: Problem) -> _Obstacle | None:
    """Return an error of set-up, if there is one: another machine, a moved mark, exchanged cables, a wrong machine file."""
    if foreign := next((drop.foreign for drop in drops if drop.foreign), ""):
        return _Obstacle(foreign, PUT_RIGHT)
    if moved := moved_mark(drops):
        return _Obstacle(moved, ONE_MARK)
    doubt = machine_doubt(problem)
    if doubt is None:
        return None
    return _Obstacle(doubt.why, APART if doubt.of_two_machines else PUT_RIGHT, doubt.wanted)


@dataclass(frozen=True, eq=False)
class _Judged:
    """Models with their verdict.

    Attributes
    ----------
    field : tuple of Contender
        The best first; the plain model among them.
    proof : HeldOut or None
    verdict : Verdict
    likeliest : Contender
    sizes : dict
        Of the believed and the accused models.
    """

    field: tuple[Contender, ...]
    proof: HeldOut | None
    verdict: Verdict
    likeliest: Contender
    sizes: dict[Contender, Sizes]

    @property
    def plain(self) -> Contender:
        """The model without causes."""
        return plain_of(self.field)

    @property
    def believed(self) -> Contender:
        """The model whose values are reported: plain for none and unknown, since a wrong cause bends the other values."""
        return self.plain if self.verdict.kind in (Kind.NONE, Kind.UNKNOWN) else self.likeliest


def _first_judged(
    field: Sequence[Contender], slowed: Slowed | None, suspected: Sequence[Suspect], progress: Progress
) -> _Judged:
    """Return the models judged by the readings and the slowing."""
    best, proof = _best_with_cause(field), None
    if best is not None and len(best.problem.drops) >= LEAST_DROPS:
        progress("holding out a drop")
        proof = slowed.proof() if slowed is not None and not slowed.base.causes else proof_of(plain_of(field), best)
    progress("estimating sizes")
    # slowing has three suspects, a ring at either end or both: no lead against a hundred of which one always fits
    lead = PLAIN_LEAD if slowed is None else 0.0
    return _judged(field, proof, lead, suspected, slowed.proof() if slowed is not None and slowed.base.causes else None)


def _drift(found: _Judged, horizons: Sequence[float]) -> _Obstacle | None:
    """Return a drift of a probe; not sought beside accused causes outside contacts, whose laws are exact."""
    doubtful = found.verdict.kind is Kind.UNKNOWN or any(each.in_contacts for each in found.verdict.accused)
    drifts = drifting_probe(found.plain, found.likeliest, horizons) if doubtful else None
    return _Obstacle(drifts, DRIFT) if drifts is not None else None


def _against(found: _Judged, obstacle: _Obstacle | None, otherwise: str | None) -> tuple[Verdict, list[str]]:
    """Return the verdict, `unknown` if something speaks against every model, and a remark on what only doubts a named one.

    `otherwise` says how the rest of the record departs from simulations.
    """
    if obstacle is not None:
        return outside(found.verdict, obstacle.why), []
    if otherwise is None:
        return found.verdict, []
    if found.verdict.kind is Kind.NONE:
        explained = f"the plain model explains the first {found.plain.horizon * 1e3:g} ms"
        return outside(found.verdict, f"{explained}, but {otherwise}"), []
    return found.verdict, [f"{otherwise}. The verdict does not rest on it"]


def _beside_the_rest(
    found: _Judged, suspected: Sequence[Suspect], progress: Progress
) -> tuple[_Judged, tuple[LateRecord, ...] | None, tuple[LateRecord, ...] | None]:
    """Return the models, with a late cause if one explains the rest of the records; and that rest with and without the cause."""
    progress("comparing the rest of the record with simulations")
    late = late_records(found.believed)
    if found.verdict.kind is Kind.AMBIGUOUS or late is None or not departs(late):
        return found, late, None
    progress("looking for what would explain the rest of the record")
    told = _with_late_cause(found, late, suspected)
    return (found, late, None) if told is None else (*told, late)


def _with_late_cause(
    found: _Judged, late: tuple[LateRecord, ...], suspected: Sequence[Suspect]
) -> tuple[_Judged, tuple[LateRecord, ...]] | None:
    """Return the models with a late cause that explains the rest of the records, and that rest with it; None without one."""
    believed = found.believed
    field, causes = with_late_causes(believed, found.field, late, suspected)
    if not causes:
        return None
    # three effects at either end or both: few suspects here too, so no lead
    proof = proof_of(found.plain, field[0]) if believed.causes else causes[field[0]].proof()
    wider = _judged(field, proof, 0.0, suspected, late=causes)
    accused = next((each for each in wider.verdict.accused if each in causes), None)
    if accused is None:
        return None
    added = causes[accused].suspect
    # if the drops disagree on its size, they have no such cause in common
    if not clear_of_nothing(added, wider.sizes[accused].causes[added.name]):
        return None
    after = late_records(accused)
    if after is None:
        return None
    # a wider spread of simulations does not bring them nearer to the drop
    after = tuple(each.in_spread_of(wide) for each, wide in zip(after, late, strict=True))
    if not explains_the_rest(late, after):
        return None
    why = (
        f"{wider.verdict.why}; {added.words} is inferred from the rest of the record, whose squared deviations"
        f" from simulations sum to {departure_of(after):.1f} with this cause and to {departure_of(late):.1f} without"
    )
    return replace(wider, verdict=replace(wider.verdict, why=why)), after


def _judged(
    field: Sequence[Contender],
    proof: HeldOut | None,
    lead: float,
    suspected: Sequence[Suspect],
    other: HeldOut | None = None,
    late: Mapping[Contender, LateCause] | None = None,
) -> _Judged:
    """Return models with their verdict.

    Intervals of sizes also use the `other` proof of the best model with a cause, and the trials of late causes.
    """
    judged = verdict(field, proof, lead, suspected)
    likeliest = judged.leading(field)
    best = _best_with_cause(field)

    def sized(each: Contender) -> Sizes:
        proofs = [proof, other] if each is best else []
        cause = late.get(each) if late is not None else None
        rest = {}
        if cause is not None:
            proofs.append(cause.proof())
            rest = {f"{cause.suspect.name}.{name}": sigma for name, sigma in cause.sigmas.items()}
        without = tuple(values for proof in proofs if proof is not None for values in proof.without)
        return sizes_of(each, without, rest)

    sizes = {each: sized(each) for each in judged.accused}
    if judged.accused:
        judged = strained(doubted(judged, plain_of(field), sizes[judged.accused[0]].causes, proof))
    found = _Judged(tuple(field), proof, judged, likeliest, sizes)
    if found.believed not in sizes:
        sizes[found.believed] = sized(found.believed)
    return found


def _best_with_cause(field: Sequence[Contender]) -> Contender | None:
    return next((each for each in field if each.causes), None)


def _common(drops: Sequence[MeasuredDrop]) -> list[Probe]:
    """Return the probes that all drops have."""
    names = set.intersection(*({p.name for p in drop.probes} for drop in drops))
    return [p for p in drops[0].probes if p.name in names]


def _ending_remarks(drops: Sequence[MeasuredDrop], horizons: Sequence[float]) -> list[str]:
    """Say which records end before the last of the horizons, so that no model is compared that far."""
    short = [drop for drop in drops if drop.seconds < horizons[-1]]
    if not short:
        return []
    first = min(drop.seconds for drop in short)
    reached = max(horizon for horizon in horizons if horizon <= first)
    others = ". Without these records the other drops are compared further" if len(short) < len(drops) else ""
    return [
        f"{', '.join(drop.name for drop in short)}: only {first * 1e3:.0f} ms were recorded after the release. Models are"
        f" compared in the first {reached * 1e3:g} ms instead of {horizons[-1] * 1e3:g} ms, which distinguishes causes less"
        f" well{others}"
    ]


def _remarks(drops: Sequence[MeasuredDrop]) -> list[str]:
    out = []
    if len(drops) == 1:
        out.append(
            "one drop only: it cannot be held out, so no gain is proved, and a cause outside the catalogue may look like one in"
            " it; unbalance, bow and runout can hardly be distinguished, since they differ only in how they change with speed;"
            " later deviations of a single drop from simulations are not used; and intervals are too narrow, since no other drop"
            " shows how far errors of the model shift the values. Drop from two more speeds"
        )
    if len(drops) > 1 and of_one_speed(drops):
        out.append(
            "all drops are from one speed: unbalance, bow and runout can hardly be distinguished, nor can the laws of windage;"
            " drop from another speed too"
        )
    return out
