"""Figures of a diagnosis name and tell apart its drops, be they many, with long names, or from standstill."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.left_over import Spectrum, spectra
from tdbmon.figures.late_record import late_record
from tdbmon.figures.measured_against_simulated import PLAIN, measured_against_simulated
from tdbmon.figures.residual_force import force_against_place, force_against_time
from tdbmon.figures.residual_map import residual_map
from tdbmon.figures.residual_spectrum import residual_spectrum
from tdbmon.figures.slowing import slowing
from tdbmon.identify.slowing import Factors, Slowing
from tests.diagnosis.reported import late_of
from tests.figure_checks import faults, rendered, texts

ENDS = ("NDE", "DE")
LONG = [f"2024-05-11_Auslauf_Verdichter_Größe_7_Versuch_{k:02d}_ohne_Öl.tdms" for k in (7, 12)]


@pytest.fixture(scope="module")
def residuals(evidence: Evidence) -> list[Spectrum]:
    return [each for left in evidence.plain_left for each in spectra(left, evidence.diagnosis.machine)]


def _slowing(evidence: Evidence, names: Sequence[str]) -> Figure:
    time = np.linspace(0.05, 0.2, 4)
    values = dict.fromkeys(("time", "left", "lag", "drag", "held", "sigma"), time)
    made = [Slowing(**values, slips=time > 0) for _ in names]
    return slowing({PLAIN: (Factors(1.0), made)}, names, range(len(names)))


def _places(evidence: Evidence, names: Sequence[str]) -> Figure:
    forces = [replace(evidence.plain_force[0], drop=name) for name in names]
    return force_against_place(forces, ENDS, (2.5e-4, 2.5e-4), [97.0] * len(names))


def _spectra(residuals: Sequence[Spectrum], names: Sequence[str]) -> Figure:
    return residual_spectrum([replace(each, drop=name) for name in names for each in residuals[:2]])


def test_long_names_of_drops_have_room(evidence: Evidence, residuals: list[Spectrum]) -> None:
    """The names overlapped above the panels and ran off the page below them."""
    lefts = [replace(left, name=name) for left, name in zip(evidence.plain_left, LONG, strict=True)]
    forces = [replace(each, drop=name) for each, name in zip(evidence.plain_force, LONG, strict=True)]
    for drawing in (
        measured_against_simulated({PLAIN: lefts}, (0, 1)),
        force_against_time(forces, ENDS, (97.0, 148.0), PLAIN),
        _places(evidence, LONG),
        _spectra(residuals, LONG),
        late_record([late_of(name, 1.0) for name in LONG], (0, 1), "DE_A"),
        _slowing(evidence, LONG),
    ):
        assert faults(drawing) == []
        assert "…07…" in texts(drawing) and "…12…" in texts(drawing)


def test_long_names_of_ends_and_probes_have_room(evidence: Evidence, residuals: list[Spectrum]) -> None:
    """The names were higher than the panels beside which they stand."""
    ends = dict(zip(ENDS, ("Nichtantriebsseite", "Antriebsseite"), strict=True))
    lefts = [
        replace(left, probes=tuple(p.model_copy(update={"name": f"{ends[p.end]} {p.name[-1]}"}) for p in left.probes))
        for left in evidence.plain_left
    ]
    names = list(ends.values())
    for drawing in (
        measured_against_simulated({PLAIN: lefts}, (0, 1)),
        residual_map({PLAIN: lefts, "extended model": lefts}),
        force_against_time(evidence.plain_force, names, (97.0, 148.0), PLAIN),
        force_against_place(evidence.plain_force, names, (2.5e-4, 2.5e-4), (97.0, 148.0)),
        residual_spectrum([replace(each, end=ends[each.end]) for each in residuals]),
    ):
        assert faults(drawing) == []


def test_of_many_drops_each_has_a_look_of_its_own(evidence: Evidence, residuals: list[Spectrum]) -> None:
    """From the seventh on drops repeated the colours of the first, and their legend covered the axes."""
    names = [f"drop_{k:02d}.nc" for k in range(20)]
    for drawing in (_spectra(residuals, names), _places(evidence, names)):
        assert faults(drawing) == []
        shown = drawing.legends[0].get_lines()
        looks = {(line.get_color(), line.get_linestyle(), line.get_markerfacecolor()) for line in shown[:16]}
        assert len(shown) == 20 and len(looks) == 16


def test_a_drop_from_standstill_has_no_orders(residuals: list[Spectrum]) -> None:
    """Its frequencies were divided by zero."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        drawing = rendered(residual_spectrum([replace(each, speed=0.0) for each in residuals]))
        frequencies, orders = drawing.axes[:2]
    assert len(frequencies.lines) > len(orders.lines) == 1  # the one at zero


def test_the_key_of_the_arrows_stands_in_its_axes_and_tells_small_forces(evidence: Evidence) -> None:
    """The key stood on the frame, said 0 N for a tenth of a newton, and 40 arrows where there were fewer."""
    small = [replace(each, force=each.force * 1e-4, band=each.band * 1e-4) for each in evidence.plain_force]
    drawing = rendered(force_against_place(small, ENDS, (2.5e-4, 2.5e-4), (97.0, 148.0)))
    for ax, each in ((ax, end) for end, ax in enumerate(drawing.axes[::2])):
        (key,) = [artist for artist in ax.artists if hasattr(artist, "label")]
        inside, words = ax.get_window_extent(), key.text.get_window_extent()
        assert inside.y0 < words.y0 and words.y1 < inside.y1
        assert float(key.label.split()[0]) > 0
        beyond = sum(
            int(np.sum(np.any(np.abs([f.force[each].real, f.force[each].imag]) > f.band[each], axis=0))) for f in small
        )
        assert f"the {min(40, beyond)} strongest" in ax.get_title(loc="left")
        assert " 0 N" not in ax.get_title(loc="left")
