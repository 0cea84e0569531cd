"""The `ds.tdb` accessor: analysis of a record in a notebook, by the same functions as the command line.

import tdbmon.accessor
from tdbmon.record.read import read

record = read("drop.nc")                              # or your own Dataset: channels with units along time
record.tdb.analyse("machine.toml")                    # displayed as a table
record.tdb.analyse("machine.toml", forces=True)       # also contact forces and stresses
record.tdb.compare("archive", machine="machine.toml")
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine, load_machine

from tdbmon.analysis.result import Analysis
from tdbmon.history.compare import Comparison
from tdbmon.history.standing import Judged
from tdbmon.history.verdict import Verdict
from tdbmon.progress import silent
from tdbmon.quantity import words
from tdbmon.report.document import Document

if TYPE_CHECKING:
    from tdbmon.identify.fitted import FittedDrop


@dataclass(frozen=True)
class AnalysisView:
    """Result of an analysis, displayed as a table in a notebook.

    Attributes
    ----------
    result : Analysis
        The analysis itself.
    fitted : FittedDrop or None
        The simulation fitted to the drop, with forces and stresses, if requested.
    """

    result: Analysis
    fitted: FittedDrop | None = None

    @property
    def json(self) -> dict[str, Any]:
        """The content of the file that `tdbmon analyse --json` writes."""
        from tdbmon.analysis.contract import analysis_json

        content = analysis_json(self.result)
        if self.fitted is None:
            return content
        from tdbmon.identify.contract import with_fitted

        return with_fitted(content, self.fitted)

    @property
    def report(self) -> Document:
        """The report; `tdbmon.report.html.write_html` and `tdbmon.report.pdf.write_pdf` write it."""
        from tdbmon.report.drop_report import build_report

        return build_report(self.result, fitted=self.fitted)

    def __repr__(self) -> str:
        from tdbmon.analysis.summary import summary_lines

        lines = summary_lines(self.result, self.fitted is not None)
        if self.fitted is not None:
            from tdbmon.identify.contract import force_lines

            lines = [*lines, *force_lines(self.fitted.calibration, self.fitted.forces)]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        from tdbmon.report.sections.findings import all_findings

        found = all_findings(self.result)
        rows = [(f.name, f.end, words(f.estimate, f.unit) + f.beside) for f in found if f.estimate.known]
        missing = sum(not f.estimate.known for f in found)
        caption = f"{self.result.machine.name}: values with 95 % intervals; {missing} not estimated"
        if self.fitted is not None:
            from tdbmon.identify.model_share import FORCES_HOLD
            from tdbmon.report.sections.forces import hardest

            caption += "" if self.fitted.forces.withheld else f". {FORCES_HOLD}"
            ends = tuple(self.fitted.forces.ends)
            rows += [
                (name, e, cell)
                for name, *cells in (r.cells for r in hardest(self.fitted.forces))
                for e, cell in zip(ends, cells, strict=True)
            ]
        return _table(caption, ("Quantity", "End", "Value"), rows)


@dataclass(frozen=True)
class ComparisonView:
    """Result of a comparison, displayed as a table in a notebook, with its verdict and the standing alarms of earlier drops."""

    judged: Judged
    standing: tuple[Judged, ...]

    @property
    def result(self) -> Comparison:
        """The comparison itself."""
        return self.judged.comparison

    @property
    def verdict(self) -> Verdict:
        """The verdict on the drop."""
        return self.judged.verdict

    @property
    def json(self) -> dict[str, Any]:
        """The content of the file that `tdbmon compare --json` writes."""
        from tdbmon.history.contract import comparison_json

        return comparison_json(self.judged, self.standing)

    @property
    def report(self) -> Document:
        """The report; `tdbmon.report.html.write_html` and `tdbmon.report.pdf.write_pdf` write it."""
        from tdbmon.report.compare_report import build_compare_report

        return build_compare_report(self.judged, self.standing)

    def __repr__(self) -> str:
        from tdbmon.history.summary import comparison_lines

        return "\n".join(comparison_lines(self.judged, self.standing))

    def _repr_html_(self) -> str:
        from tdbmon.history.summary import difference_of

        rows = [
            ("changed" if c.flag else "", c.title, words(c.estimate), words(difference_of(c)))
            for c in self.result.changes
            if c.difference is not None
        ]
        all_told = (self.judged, *self.standing)
        said = [f"{each.verdict.word}: {'; '.join(each.verdict.reasons)}" for each in all_told]
        names = ["", *(f"an earlier alarm stands: {each.name}: " for each in self.standing)]
        caption = ". ".join(name + words for name, words in zip(names, said, strict=True))
        return _table(caption, ("", "Quantity", "This drop", "Difference (95 %)"), rows)


@xr.register_dataset_accessor("tdb")
class TouchdownAccessor:
    """Analysis and comparison of a record; the methods are those of the command line."""

    def __init__(self, record: xr.Dataset) -> None:
        self._record = record

    def analyse(
        self, machine: Machine | str | Path, forces: bool = False, also: Sequence[xr.Dataset] = (), workers: int = 1
    ) -> AnalysisView:
        """Return the results of `tdbmon analyse`.

        The dataset comes from `tdbmon.record.read.read` or is your own: each channel is a numeric variable along time with its
        unit in the attribute ``units``; time is in s or as dates.

        Parameters
        ----------
        machine : Machine, str or Path
            The machine or its file.
        forces : bool
            Also fit the simulation, as ``--forces`` does, and run it to the end of the record.
        also : sequence of Dataset
            Other drops of the machine in the same condition, fitted jointly (implies `forces`).
        workers : int
            Number of processes for the fit; a script that uses more than one needs the usual
            ``if __name__ == "__main__":``.

        Raises
        ------
        InputError
            As `tdbmon.analysis.analyse.analyse`.
        """
        from tdbmon.analysis.analyse import analyse

        plan = machine if isinstance(machine, Machine) else load_machine(machine)
        result = analyse(self._record, plan)
        if not (forces or also):
            return AnalysisView(result)
        from tdbmon.identify.fitted import fit_drop

        fitted = fit_drop(plan, self._record, silent, also, workers).beside(result)
        return AnalysisView(result, fitted.with_coast_down(result))

    def compare(self, archive: str | Path, machine: str | Path | None = None, forces: bool = False) -> ComparisonView:
        """Return the results of `tdbmon compare` for this record, without filing it.

        Parameters
        ----------
        archive : str or Path
            The archive's folder.
        machine : str or Path, optional
            The machine's file; by default that of the archive's last drop, if the archive holds one machine only.
        forces : bool
            Also fit the simulation.

        Raises
        ------
        InputError
            If the dataset was not read by `tdbmon.record.read`, was modified since although its file is filed, or as in
            `tdbmon.history.unfiled.drop_to_compare`.
        """
        from tdbmon.history.archive import open_archive
        from tdbmon.history.compare import compare
        from tdbmon.history.standing import standing_beside
        from tdbmon.history.unfiled import record_to_compare
        from tdbmon.record.read import read

        if "sha256" not in self._record.attrs:
            raise InputError("this dataset has no SHA-256 of a file; read it with tdbmon.record.read.read")
        opened = open_archive(Path(archive))
        filed = opened.drop_of(self._record.attrs["sha256"])
        if filed is not None and not read(opened.folder / filed.raw).equals(self._record):
            raise InputError(
                f"{filed.raw_name}: this dataset was changed after it was read, but the archive holds the unchanged drop"
                f" {filed.id}; write the dataset to a new file (tdbmon.record.read.write) and read that"
            )
        place = None if machine is None else Path(machine)
        judged = Judged(compare(opened, record_to_compare(opened, self._record, place, forces, silent)))
        return ComparisonView(judged, standing_beside(opened, judged))


def _table(caption: str, header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    """Return an HTML table; names that come from files are escaped."""
    from markupsafe import Markup

    cell, head = Markup("<td style='text-align:left'>{}</td>"), Markup("<th style='text-align:left'>{}</th>")
    lines = [Markup("<tr>{}</tr>").format(Markup("").join(cell.format(c) for c in row)) for row in rows]
    return str(
        Markup("<table><caption>{}</caption><thead><tr>{}</tr></thead><tbody>{}</tbody></table>").format(
            caption, Markup("").join(head.format(h) for h in header), Markup("").join(lines)
        )
    )
