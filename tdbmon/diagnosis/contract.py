"""The JSON of `tdbmon diagnose`, and its lines on a terminal."""

from __future__ import annotations

import math
from typing import Any

from tdbsim.effect import Effect, declaration

from tdbmon.diagnosis.contender import Contender
from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.held_out import rms
from tdbmon.diagnosis.named_cause import named_causes
from tdbmon.diagnosis.unexplained import unexplained
from tdbmon.estimate import Estimate
from tdbmon.identify.free_effect import effect_in_words
from tdbmon.quantity import percent, plain, printed, why_no_interval
from tdbmon.remarks import alike


def diagnosis_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the content of the JSON."""
    verdict, proof = diagnosis.verdict, diagnosis.proof
    plain, best = diagnosis.plain, diagnosis.best
    left = unexplained(best)
    shared, _ = plain.problem.values(plain.fit.point, 0)
    return {
        "verdict": str(verdict.kind),
        "why": verdict.why,
        "causes": causes_json(diagnosis),
        "standing": [standing_json(each) for each in plain.problem.standing],
        "candidates": _candidates(diagnosis),
        "baseline": {
            "fit_rms_um": _fit_rms(plain) * 1e6,
            "held_out_rms_um": proof.plain * 1e6 if proof else None,
            "noise_um": _noise(plain) * 1e6,
            "probability": verdict.probabilities[diagnosis.contenders.index(plain)],
            "calibrated": {
                p.name: Estimate(shared[p.name], unit=p.unit, why="no interval: a value of the plain model").to_json()
                for p in plain.problem.shared
            },
        },
        "extended": {
            "fit_rms_um": _fit_rms(best) * 1e6 if best.causes else None,
            "held_out_rms_um": proof.extended * 1e6 if proof and best.causes else None,
        },
        "held_out": list(proof.drops) if proof else [],
        "held_out_judge": proof.judge.name.lower() if proof else None,
        "gain": proof.gain if proof and verdict.believes else None,
        "horizon_s": best.horizon,
        "unexplained": {
            "misfit_ratio": left.ratio,
            "drop": left.drop,
            "probe": left.probe,
            "rms_um": left.rms * 1e6,
            "noise_um": left.noise * 1e6,
            "loudest_from_s": left.since,
            "loudest_until_s": left.until,
            "frequency_hz": left.frequency,
            "frequency_resolution_hz": left.resolution,
        },
        "next_test": diagnosis.next_test,
        "remarks": [*diagnosis.remarks, *diagnosis.aside],
        "seconds": diagnosis.seconds,
    }


def diagnosis_lines(diagnosis: Diagnosis) -> list[str]:
    """Return the command's lines."""
    verdict, out = diagnosis.verdict, []
    out.append(f"verdict: {verdict.kind} - {verdict.why}")
    for cause in named_causes(diagnosis):
        sizes = [f"{name} {value_and_interval(size)}" for name, size in cause.parameters.items() if size.known]
        values = ", ".join([*(sizes or ["not fitted"]), *declaration(cause.effect).texts(cause.held)]).replace(
            "_", " "
        )
        out.append(f"  {cause.effect} at {cause.where}, probability {cause.probability:.2f}: {values}")
    if verdict.doubt is not None:
        out.append(f"  {verdict.doubt}")
    if diagnosis.plain.problem.standing:
        out.append(f"  already in the plain model: {'; '.join(map(effect_in_words, diagnosis.plain.problem.standing))}")
    told = verdict.accused[0] if verdict.accused else diagnosis.plain
    out.append(
        f"residual of the {told.words} to {told.horizon * 1e3:g} ms: {_fit_rms(told) * 1e6:.2g} um rms, noise"
        f" {_noise(told) * 1e6:.2g} um"
    )
    proof = diagnosis.proof
    if proof is not None and proof.gain is not None and verdict.believes:
        out.append(
            f"held out {proof.drop}, {proof.judge}: plain {proof.plain * 1e6:.2f} um, extended {proof.extended * 1e6:.2f} um,"
            f" noise {proof.noise * 1e6:.2f} um; gain {percent(proof.gain, 1)}"
        )
    drops = [drop.name for drop in diagnosis.plain.problem.drops]
    out += [f"remark: {each}" for each in (*alike(diagnosis.remarks, drops), *diagnosis.aside)]
    out.append(f"next test: {diagnosis.next_test}")
    return [plain(line) for line in out]


def value_and_interval(estimate: Estimate) -> str:
    """Return a known value as text, with its interval or the reason why there is none."""
    return printed(estimate) + why_no_interval(estimate)


def causes_json(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return the causes of a diagnosis as in the JSON, the likeliest first."""
    return [
        {
            "effect": cause.effect,
            "where": cause.where,
            "probability": cause.probability,
            "parameters": {f"{name}{_suffix(q.unit)}": q.to_json() for name, q in cause.parameters.items()},
            "held": dict(cause.held),
        }
        for cause in named_causes(diagnosis)
    ]


def standing_json(effect: Effect) -> dict[str, Any]:
    """Return an effect that stands in the model, in the form of `causes_json`."""
    values = {each: getattr(effect, each.name) for each in effect.parameters()}
    sizes = {
        f"{each.name}{_suffix(each.unit)}": Estimate(value, unit=each.unit, why="as stated in the model")
        if math.isfinite(value)
        else Estimate.missing(each.unit, "infinite: the effect is off")
        for each, value in values.items()
        if not each.choices
    }
    return {
        "effect": effect.identifier(),
        "where": effect.where,
        "parameters": {name: size.to_json() for name, size in sizes.items()},
        "held": {each.name: value for each, value in values.items() if each.choices},
    }


def _candidates(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    least = min(each.bic for each in diagnosis.contenders)
    out = []
    for each, probability in zip(diagnosis.contenders, diagnosis.verdict.probabilities, strict=True):
        if not each.causes:
            continue
        proved = diagnosis.proof is not None and each is diagnosis.extended
        out.append(
            {
                "effect": " + ".join(c.declared.identifier for c in each.causes),
                "where": " + ".join(c.where for c in each.causes),
                "probability": probability,
                "delta_bic": each.bic - least,
                "held_out_gain": diagnosis.proof.gain if proved and diagnosis.proof else None,
            }
        )
    return out


def _fit_rms(contender: Contender) -> float:
    return rms(contender.problem, contender.fit.point, range(len(contender.problem.drops)), contender.horizon)


def _noise(contender: Contender) -> float:
    """Return the rms of the noise of all probes in all drops, m."""
    levels = [probe.sigma for drop in contender.problem.drops for probe in drop.noise]
    return math.sqrt(sum(level**2 for level in levels) / len(levels))


def _suffix(unit: str) -> str:
    """Return the suffix of a parameter's name by its unit: ``_um``, ``_n_per_m``."""
    if unit == "1":
        return ""
    return "_" + unit.lower().replace("^", "").replace("/", "_per_").replace(" ", "_")
