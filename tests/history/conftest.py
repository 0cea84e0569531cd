"""Archives for the tests: the shipped drops of ten years filed once, and filings made up of numbers alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from tdbmon.history.archive import Archive, open_archive
from tdbmon.history.batch import add_all
from tdbmon.history.compare import Comparison
from tdbmon.history.machine_history import MachineHistory, machine_history
from tdbmon.history.study import Order
from tdbmon.shipped import shipped
from tests.history.made import HOSTILE, files, filing, latest

YEARS = shipped("years")


@pytest.fixture(scope="session")
def years(tmp_path_factory: pytest.TempPathFactory) -> Archive:
    """The ten shipped drops, filed; read it only."""
    archive = open_archive(tmp_path_factory.mktemp("years") / "archive", create=True)
    orders = [Order(YEARS / "machine.toml", record) for record in sorted(YEARS.glob("*.nc"))]
    assert [outcome.state for outcome in add_all(archive, orders)] == ["filed"] * 10
    return archive


@pytest.fixture(scope="session")
def comparison(years: Archive) -> Comparison:
    """The last of these drops against the others."""
    return latest(years)


@pytest.fixture(scope="session")
def history(years: Archive) -> MachineHistory:
    """The machine of these drops over the years."""
    return machine_history(years, years.machines()[0])


@pytest.fixture(scope="session")
def stressed(tmp_path_factory: pytest.TempPathFactory) -> Archive:
    """Drops of two speeds with stresses, of a machine with a hostile name; read it only."""
    folder = tmp_path_factory.mktemp("stressed")
    archive = open_archive(folder / "archive", create=True)
    for i in range(12):
        raw, machine = files(folder, i)
        made = filing(
            raw, machine, seed=i, name=HOSTILE, dropped=f"2020-01-{i + 1:02d}", speed=100.0 if i % 3 else 60.0,
            stress=2e9 + 2e7 * i,
        )  # fmt: skip
        archive.add(made, raw, machine)
    return archive


@pytest.fixture
def empty(tmp_path: Path) -> Archive:
    """An archive without drops."""
    return open_archive(tmp_path / "archive", create=True)
