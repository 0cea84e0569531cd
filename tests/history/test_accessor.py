"""`ds.tdb` and the example notebook: the same results as the command line, shown richly, names from files harmless."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tdbsim.errors import InputError

import tdbmon.accessor  # noqa: F401  registers ds.tdb
from tdbmon.history.compare import compare, filed_drop
from tdbmon.history.contract import comparison_json
from tdbmon.history.standing import Judged
from tdbmon.record.read import read
from tests.history.conftest import YEARS

NOTEBOOK = Path(__file__).parents[2] / "docs" / "notebooks" / "drops_over_years.ipynb"


def test_the_accessor_says_what_the_command_line_says(years):
    view = read(YEARS / "drop_08.nc").tdb.compare(years.folder)
    direct = compare(years, filed_drop(years, years.entries()[7].id))
    assert view.json == comparison_json(Judged(direct))
    assert "changed" in view._repr_html_()
    assert "verdict: changed" in repr(view)
    assert view.report.title == "Comparison with earlier drops"


def test_a_filed_record_that_was_changed_is_not_told_as_the_filed_one(years):
    record = read(YEARS / "drop_08.nc")
    with pytest.raises(InputError, match=r"drop_08.nc: this dataset was changed .*\(tdbmon.record.read.write\)"):
        record.assign(NDE_A=2 * record["NDE_A"]).tdb.compare(years.folder)


def test_the_analysis_shows_itself():
    view = read(YEARS / "drop_08.nc").tdb.analyse(YEARS / "machine.toml")
    assert view.json["machine"] == view.result.machine.name
    assert "Air gap" in view._repr_html_()
    assert "first contact" in repr(view)
    assert view.report.sections[0].title == "Summary"


def test_names_from_files_stay_text(machine):
    hostile = machine.model_copy(update={"name": "<script>alert(1)</script>"})
    view = read(YEARS.parent / "short" / "drop_100.nc").tdb.analyse(hostile)
    assert "<script>" not in view._repr_html_()
    assert "&lt;script&gt;" in view._repr_html_()


def test_a_dataset_of_no_file_is_told(years):
    with pytest.raises(InputError, match="no SHA-256"):
        xr.Dataset({"a": ("time", np.zeros(3))}).tdb.compare(years.folder)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning:jupyter_client", "ignore::DeprecationWarning:zmq")
def test_the_example_notebook_runs():
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(notebook, timeout=240, kernel_name="python3").execute()
    shown = [out for cell in notebook.cells if cell.cell_type == "code" for out in cell.outputs]
    assert not any(out.output_type == "error" for out in shown)
    pages = "".join(out.data.get("text/html", "") for out in shown if out.output_type == "execute_result")
    assert pages.count("<table>") >= 2
    assert "('changed'" in "".join(out.data["text/plain"] for out in shown if out.output_type == "execute_result")
