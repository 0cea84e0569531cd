"""Report section: provenance of the results, the file, the program, and the method of each quantity."""

from __future__ import annotations

import numpy as np

from tdbmon import __version__
from tdbmon.analysis.result import Analysis
from tdbmon.analysis.summary import weight
from tdbmon.record.timebase import usual_rate
from tdbmon.report.document import Row, Section, Table
from tdbmon.report.sections.findings import all_findings


def section(analysis: Analysis) -> Section:
    """Return the section on provenance and methods."""
    attributes = analysis.record.attrs
    dimension = next(iter(analysis.record.sizes))
    time = analysis.record[dimension].to_numpy()
    missing = ", ".join(str(name) for name in np.atleast_1d(attributes.get("missing", []))) or "none"
    unread = attributes.get("drop_time_unread")
    untold = f"stated as '{unread}', which is not understood" if unread else "not stated"
    rows = [
        Row(("File", str(attributes.get("source_file", "not known")))),
        Row(("SHA-256 of the file", str(attributes.get("sha256", "not known")))),
        Row(("Title in the file", str(attributes.get("title") or "none"))),
        Row(("Machine in the file", str(attributes.get("machine") or "not stated"))),
        Row(("Time of the drop", str(attributes.get("drop_time") or untold))),
        Row(("Reader", str(attributes.get("reader", "not known")))),
        Row(("Sampling", f"{usual_rate(time):.6g} Hz, {len(time)} samples, {time[-1] - time[0]:.4f} s")),
        Row(("Channels of the machine file that the record lacks", missing)),
        Row(("Machine", analysis.machine.name)),
        Row(("Rotor", weight(analysis))),
        Row(("Rotation", "counter-clockwise" if analysis.machine.sense > 0 else "clockwise")),
        Row(("Program", f"tdbmon {__version__}")),
    ]
    findings = all_findings(analysis)
    methods = dict.fromkeys((f.name, f.estimate.method) for f in findings if f.estimate.known and f.estimate.method)
    return Section(
        "Source and methods",
        (
            Table("Source", ("What", "Value"), tuple(rows)),
            Table("Methods", ("Quantity", "Method"), tuple(Row(pair) for pair in methods)),
        ),
    )
