"""Records with much missing or cut off: the whole report is drawn, and says what could not be told."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from tdbsim.machine import Machine, load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.analysis.summary import summary_lines
from tdbmon.record.read import read
from tdbmon.report import build_report
from tdbmon.report.html import render_html
from tdbmon.report.typeset import typeset
from tdbmon.shipped import shipped

PROBES = ("NDE_A", "NDE_B", "DE_A", "DE_B")
Sick = Callable[[np.ndarray], np.ndarray]


def _missing(first: float, last: float) -> Sick:
    """Return what takes the values away from one share of the samples to another."""

    def take(values: np.ndarray) -> np.ndarray:
        out = values.copy()
        out[int(first * len(out)) : int(last * len(out))] = np.nan
        return out

    return take


def _scattered(values: np.ndarray) -> np.ndarray:
    return np.where(np.random.default_rng(len(values)).uniform(size=len(values)) < 0.1, np.nan, values)


SICK: dict[str, tuple[tuple[str, ...], Sick]] = {
    "cut off at rest": (PROBES, lambda values: np.clip(values, -250e-6, 250e-6)),
    "cut off in levitation": (PROBES, lambda values: np.clip(values, -30e-6, 30e-6)),
    "one probe cut off": (("NDE_A",), lambda values: np.clip(values, -20e-6, 20e-6)),
    "the middle missing": (PROBES, _missing(0.3, 0.7)),
    "the fall missing": (PROBES, _missing(0.19, 0.23)),
    "scattered": (PROBES, _scattered),
}


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load_machine(shipped("short/machine.toml"))


@pytest.mark.parametrize("which", SICK)
def test_a_sick_record_has_a_whole_report(which: str, machine: Machine) -> None:
    probes, sick = SICK[which]
    record: xr.Dataset = read(shipped("short/drop_100.nc"))
    for probe in probes:
        record[probe] = record[probe].copy(data=sick(record[probe].values))
    analysis = analyse(record, machine)
    failed = {check.check for check in analysis.checks if not check.passed}
    assert failed & {"clipping", "nan"}
    content = analysis_json(analysis)
    assert set(content["ends"]) == set(machine.ends)
    assert summary_lines(analysis)
    html = render_html(build_report(analysis))
    words = re.sub(r'"data:[^"]*"', "", "".join(part.split("</script>")[-1] for part in html.split("<script")))
    assert "NaN" not in words  # letters of an encoded picture may be anything
    for check in analysis.checks:
        if not check.passed:
            assert typeset(check.detail.split(";")[0].split(":")[0])[:30] in html
