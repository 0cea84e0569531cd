"""Archives for the tests: the shipped drops of ten years filed once, and filings made up of numbers alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from tdbmon.history.archive import Archive, open_archive
from tdbmon.history.batch import add_all
from tdbmon.history.study import Order
from tdbmon.shipped import shipped

YEARS = shipped("years")


@pytest.fixture(scope="session")
def years(tmp_path_factory: pytest.TempPathFactory) -> Archive:
    """The ten shipped drops, filed; read it only."""
    archive = open_archive(tmp_path_factory.mktemp("years") / "archive", create=True)
    orders = [Order(YEARS / "machine.toml", record) for record in sorted(YEARS.glob("*.nc"))]
    assert [outcome.state for outcome in add_all(archive, orders)] == ["filed"] * 10
    return archive


@pytest.fixture
def empty(tmp_path: Path) -> Archive:
    """An archive without drops."""
    return open_archive(tmp_path / "archive", create=True)
