"""The rules of judging, the statistics of the page, and that a written case is read as a record."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tdbsim.machine import load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.cli import app
from tdbmon.record.read import read
from tests.blind.case import draw_case, write
from tests.blind.judge import SIZE, judge
from tests.blind.outcome import Outcome, load, with_ledger
from tests.blind.table import calibration_error, page, wilson


def answer(**hidden: str) -> dict[str, Any]:
    return {
        "hidden": {
            name: {"where": where, "parameters": {f"{SIZE.get(name, 'size')}_m": 20e-6, "into": 1.0}}
            for name, where in hidden.items()
        }
        or {"none": {"where": "rotor", "parameters": {}}}
    }


def result(verdict: str, **causes: str) -> dict[str, Any]:
    size = {"value": 21.0, "low": 18.0, "high": 23.0, "unit": "um"}
    return {
        "verdict": verdict,
        "causes": [
            {"effect": name, "where": where, "probability": 0.9, "parameters": {f"{SIZE[name]}_um": size}}
            for name, where in causes.items()
        ],
    }


@pytest.mark.parametrize(
    ("hidden", "said", "right", "place"),
    [
        ({}, result("none"), True, True),
        ({}, result("unknown"), False, False),
        ({}, result("named", oval_clearance="NDE"), False, False),
        ({"x_fluid_film": "DE"}, result("unknown"), True, True),
        ({"x_fluid_film": "DE"}, result("ambiguous", oval_clearance="DE"), False, False),
        ({"oval_clearance": "DE"}, result("named", oval_clearance="DE"), True, True),
        ({"oval_clearance": "DE"}, result("named", oval_clearance="NDE"), True, False),
        ({"oval_clearance": "DE"}, result("named", oval_clearance="DE", loose_support="DE"), False, False),
        ({"oval_clearance": "DE"}, result("ambiguous", oval_clearance="DE", loose_support="DE"), True, True),
        ({"oval_clearance": "DE"}, result("ambiguous", probe_runout="DE", loose_support="DE"), False, False),
        ({"oval_clearance": "DE"}, result("unknown"), False, False),
        ({"hardening_support": "both"}, result("named", hardening_support="NDE"), True, True),
        ({"hardening_support": "NDE"}, result("named", hardening_support="both"), True, False),
        ({"probe_gain": "DE_A", "shaft_bow": "rotor"}, result("named", shaft_bow="rotor"), False, False),
        (
            {"probe_gain": "DE_A", "shaft_bow": "rotor"},
            result("named", shaft_bow="rotor", probe_gain="DE_A"),
            True,
            True,
        ),
        (
            {"probe_gain": "DE_A", "shaft_bow": "rotor"},
            result("named", shaft_bow="rotor", probe_gain="DE_B"),
            True,
            False,
        ),
    ],
)
def test_rules(hidden: dict[str, str], said: dict[str, Any], right: bool, place: bool) -> None:
    judged = judge(answer(**hidden), said)
    assert (judged.right, judged.place) == (right, place)
    assert judged.ambiguous == (said["verdict"] == "ambiguous")


def test_sizes_are_compared_in_si() -> None:
    (size,) = judge(answer(oval_clearance="DE"), result("named", oval_clearance="DE")).sizes
    assert (size.true, size.value) == pytest.approx((20e-6, 21e-6))
    assert size.inside
    away = result("named", oval_clearance="DE")
    away["causes"][0]["parameters"]["amplitude_um"] |= {"low": 20.5}
    assert not judge(answer(oval_clearance="DE"), away).sizes[0].inside


def test_the_parameter_of_a_size_is_not_its_phase() -> None:
    hidden = {"hidden": {"probe_runout": {"where": "DE", "parameters": {"first_phase_rad": 1.0, "first_m": 9e-6}}}}
    phase = {"value": 20.0, "low": 10.0, "high": 30.0, "unit": "deg"}
    size = {"value": 9.5, "low": 9.1, "high": 9.9, "unit": "um"}
    said = result("named", probe_runout="DE")
    said["causes"][0]["parameters"] = {"first_phase_deg": phase, "first_um": size}
    (found,) = judge(hidden, said).sizes
    assert (found.true, found.value) == pytest.approx((9e-6, 9.5e-6))
    assert not found.inside


def test_wilson_holds_the_truth_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    for count, true in ((20, 0.9), (100, 0.5), (60, 0.05)):
        holds = [low <= true <= high for low, high in (wilson(int(h), count) for h in rng.binomial(count, true, 2000))]
        assert 0.92 < np.mean(holds) < 0.985
    assert wilson(0, 10)[0] == 0.0
    assert wilson(10, 10)[1] == pytest.approx(1.0)


def test_calibration_error_of_true_and_of_boasting_probabilities() -> None:
    rng = np.random.default_rng(2)
    stated = rng.uniform(0.05, 1, 20_000)
    honest = [(float(p), bool(rng.uniform() < p)) for p in stated]
    boasting = [(float(p), bool(rng.uniform() < p - 0.05)) for p in stated]
    assert calibration_error(honest) < 0.015
    assert calibration_error(boasting) == pytest.approx(0.05, abs=0.015)


def test_the_page_counts_what_it_was_given(tmp_path: Path) -> None:
    outcomes = []
    cases: tuple[tuple[dict[str, str], dict[str, Any]], ...] = (
        ({}, result("none")),
        ({}, result("named", oval_clearance="NDE")),
        ({"oval_clearance": "DE"}, result("named", oval_clearance="DE")),
        ({"x_fluid_film": "DE"}, result("none")),
        ({"probe_gain": "DE_A", "shaft_bow": "rotor"}, result("named", shaft_bow="rotor")),
    )
    for seed, (hidden, said) in enumerate(cases):
        outcomes.append(
            Outcome(
                seed=seed, strangeness=0.0, levels=(0.6,) * len(hidden), signal=200.0, machine="m",
                where=tuple(hidden.values()), seconds=10.0, processor_seconds=9.0, gain=0.8,
                judgement=judge(answer(**hidden), said), error="", result=said,
            )
        )  # fmt: skip
    failed = Outcome(9, 0.0, (), 0.0, "m", (), 1.0, 1.0, None, None, "exit code 2: no such file", {})
    text = page([*outcomes, failed], "python -m tests.blind")
    assert "6 cases, seeds 0 to 9; the command failed on 1" in text
    assert "- seed 9: exit code 2: no such file" in text
    assert "| nothing hidden | 1/2 = 50 % (9 to 91) |" in text
    assert "a cause named: 1/2 = 50 %" in text
    assert "at least one among the causes: 1/1" in text
    assert "| `x_fluid_film` | 0/1 = 0 % (0 to 79) | 0 | 0 | none 1 |" in text
    assert "| 100 to 300 | 1/1" in text
    assert "contains the true size in 1/1" in text
    assert "Strange laws" not in text


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("case")
    write(draw_case(6, kind="none", strangeness=1.0), folder)
    return folder


def test_a_written_case_is_read_as_a_record(written: Path) -> None:
    from typer.testing import CliRunner

    truth = json.loads((written / "answer.json").read_text())["true"]
    machine = load_machine(written / "machine.toml")
    drops = sorted(written.glob("drop_*.nc"))
    assert len(drops) == 4
    shown = CliRunner().invoke(app, ["inspect", str(drops[0])])
    assert shown.exit_code == 0
    for name in (*(probe.name for probe in machine.probes), "keyphasor", "speed"):
        assert name in shown.output
    analysis = analyse(read(drops[1]), machine)
    assert analysis.release is not None
    # found, and in the right units; accuracy is for the tests of the analysis
    assert analysis.release.time.value == pytest.approx(truth["release_time_s"], abs=5e-3)
    assert [check.check for check in analysis.checks if not check.passed] == []


def test_an_outcome_is_kept_and_read_again(tmp_path: Path) -> None:
    from dataclasses import asdict

    said = result("named", oval_clearance="DE")
    outcome = Outcome(
        3, 1.0, (0.5,), 120.0, "m", ("DE",), 10.0, 9.0, 0.8, judge(answer(oval_clearance="DE"), said), "", said
    )
    path = tmp_path / "case_0000003.json"
    path.write_text(json.dumps(asdict(outcome)))
    assert load(path) == outcome


def test_a_ledger_keeps_cases_of_earlier_folders_and_takes_a_case_met_again_anew(tmp_path: Path) -> None:
    said, ledger = result("named", oval_clearance="DE"), tmp_path / "blind.jsonl"

    def met(seed: int, seconds: float) -> Outcome:
        judged = judge(answer(oval_clearance="DE"), said)
        return Outcome(seed, 1.0, (0.5,), 120.0, "m", ("DE",), seconds, 9.0, 0.8, judged, "", said)

    assert [each.seed for each in with_ledger(ledger, [met(5, 10.0), met(3, 10.0)])] == [3, 5]
    kept = with_ledger(ledger, [met(5, 20.0), met(4, 10.0)])
    assert [(each.seed, each.seconds) for each in kept] == [(3, 10.0), (4, 10.0), (5, 20.0)]
    assert with_ledger(ledger, []) == [replace(each, result={}) for each in kept]
    assert "said" in ledger.read_text() and "result" not in ledger.read_text()


def test_the_page_lists_each_case_that_was_wrong() -> None:
    hidden = answer(oval_clearance="DE", ring_drag="NDE")
    wrong, right = result("named", oval_clearance="DE"), result("named", oval_clearance="DE", ring_drag="NDE")
    outcomes = [
        Outcome(seed, 0.0, (0.5, 0.7), 120.0, "m", ("DE", "NDE"), 10.0, 9.0, 0.8, judge(hidden, said), "", said)
        for seed, said in ((4, wrong), (6, right))
    ]
    listed = page(outcomes, "command").split("### Cases that were wrong")[1]
    assert "| 4 | `oval_clearance` at DE, `ring_drag` at NDE | 0.50, 0.70 | 120 | oval_clearance |" in listed
    assert "| 6 |" not in listed
