"""Studies of many records, one task per record, on worker processes or a dask cluster; one process writes the archive."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import cache
from multiprocessing import get_context
from pathlib import Path

from tdbsim.errors import InputError

from tdbmon.history import catalogue
from tdbmon.history.archive import Archive, Filed
from tdbmon.history.catalogue import Entry
from tdbmon.history.filing import Filing, satisfying_names
from tdbmon.history.loss import losses
from tdbmon.history.study import Order, study
from tdbmon.identify.crew import attend_parent
from tdbmon.progress import Progress, silent
from tdbmon.sha256 import sha256_of

_REACH_S = 20.0  # timeout for reaching a scheduler


@dataclass(frozen=True)
class Outcome:
    """Outcome of adding a record.

    Attributes
    ----------
    record : Path
    drop : str
        Its identifier; empty if it failed before that was known.
    state : str
        "filed", "analysed again", "already filed", or "failed".
    why : str
        Why it failed.
    otherwise : tuple of str
        Differences in the provenance of an already filed result (version, machine file) that may warrant a new analysis.
    lost : tuple of str
        Items of the previous result that the new one lacks.
    machine_before : str
        SHA-256 of the previous result's machine file; empty if unchanged.
    """

    record: Path
    drop: str
    state: Filed | str
    why: str = ""
    otherwise: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    machine_before: str = ""

    @property
    def failed(self) -> bool:
        """True if the record was not filed, or not as requested."""
        return self.state == "failed"


def add_all(
    archive: Archive,
    orders: Sequence[Order],
    workers: int = 1,
    scheduler: str = "",
    progress: Progress = silent,
    again: bool = False,
) -> Iterator[Outcome]:
    """Study records and file each when done; filed ones are skipped, and a failed one does not stop the rest.

    Parameters
    ----------
    archive : Archive
    orders : sequence of Order
    workers : int
        Number of processes; with 1 the studies run in this process.
    scheduler : str
        Address of a dask scheduler; its workers read the records by the same absolute paths.
    progress : callable
        Called with the current step of a record, and with the number of records done.
    again : bool
        Analyse again drops filed by another program version or with another machine file; the new result becomes current.

    Yields
    ------
    Outcome
        In order of completion.

    Raises
    ------
    InputError
        If the scheduler cannot be reached, or the archive cannot be written.
    """
    todo: list[Order] = []
    begun = datetime.now(UTC)
    name_of = cache(_machine_name)
    for number, order in enumerate(orders):
        wanted = _prepared(archive, order, again, name_of)
        if isinstance(wanted, Outcome):
            yield wanted
            continue
        # workers finish in any order; drops without a time are ordered as given
        filed = (begun + timedelta(microseconds=number)).isoformat(timespec="microseconds")
        todo.append(replace(wanted, machine=wanted.machine.resolve(), record=order.record.resolve(), filed=filed))
    for done, (order, found) in enumerate(_studies(todo, workers, scheduler, progress), start=1):
        progress(f"{done} of {len(todo)} drops analysed")
        if isinstance(found, Filing):
            try:
                yield _filed(archive, found, order)
            except InputError as error:
                yield Outcome(order.record, found.drop, "failed", str(error))
        else:
            yield Outcome(order.record, "", "failed", found)


def _prepared(archive: Archive, order: Order, again: bool, name_of: Callable[[Path], str]) -> Order | Outcome:
    """Return the order completed from the filed drop, or the outcome if there is nothing to do.

    Assembly and time are those filed; an order that states other ones fails.  A filed drop is skipped: a folder added every
    night, or with another machine file, must not replace its results.  It is analysed only with `again`, if forces are wanted
    that it lacks, or if its files are damaged (then with its filed machine file).  Forces filed are computed again unless the
    order declines them, since otherwise its stresses would drop out of the history.
    """
    from tdbmon import __version__

    try:
        sha256, machine = sha256_of(order.record), sha256_of(order.machine)
        entry = archive.drop_of(sha256)
        name = "" if entry is None else name_of(order.machine)
    except (OSError, InputError):
        return order  # the study reports the error
    if entry is None:
        return order
    try:
        archive.check_same(entry, sha256, name, order.record)
    except InputError as error:
        return Outcome(order.record, entry.id, "failed", str(error))
    if why := _restated(archive, entry, order):
        return Outcome(order.record, entry.id, "failed", why)
    result = archive.result(entry.id)
    forces = result.forces if order.forces is None else order.forces
    wanted = replace(order, forces=forces, assembly=entry.assembly, dropped=entry.dropped)
    if again:
        filed = any(archive.has(entry, each) for each in satisfying_names(__version__, machine, forces))
        passed_over = filed and not result.overtakes(__version__, machine)
        return Outcome(order.record, entry.id, "already filed") if passed_over else wanted
    if not archive.sound(entry):
        place = archive.machine_file(entry.id)
        return (
            replace(wanted, machine=place) if place.exists() and sha256_of(place) == result.machine_sha256 else wanted
        )
    other_machine = result.machine_sha256 != machine
    if forces and not result.forces and not other_machine:
        return wanted
    otherwise = ["with another machine file"] * other_machine
    otherwise += [f"by tdbmon {result.version}"] * (result.version != __version__)
    return Outcome(order.record, entry.id, "already filed", otherwise=tuple(otherwise))


def _restated(archive: Archive, entry: Entry, order: Order) -> str:
    """Return the error if an order states another assembly or time than the filed drop has; "" otherwise."""
    other = []
    if order.assembly and order.assembly != entry.assembly:
        other.append(_not("assembly", entry.assembly, order.assembly))
    # the same instant may be stated in two time zones
    if order.dropped and catalogue.seconds(order.dropped) != catalogue.seconds(entry.dropped):
        other.append(_not("time", entry.dropped, order.dropped))
    if not other:
        return ""
    return (
        f"{order.record}: is already filed, with {' and '.join(other)}; remove it first"
        f" (tdbmon archive remove --archive {archive.folder} {entry.id}), then add it again"
        + ("" if entry.dropped or order.dropped else " with --dropped TIME, which sets its position among the drops")
    )


def _not(name: str, before: str, stated: str) -> str:
    return f"the {name} '{before}', not '{stated}'" if before else f"no {name} stated, not '{stated}'"


def _filed(archive: Archive, found: Filing, order: Order) -> Outcome:
    """File a drop and list what a new result lacks against the previous one."""
    entry = archive.drop_of(found.sha256)
    before, own = None, ""
    if entry is not None:
        own = archive.result(entry.id).machine_sha256
        with suppress(InputError):  # its result file is damaged
            before = archive.filing(entry.id)
    state = archive.add(found, order.record, order.machine)
    lost = () if before is None else losses(before, found)
    return Outcome(order.record, found.drop, state, lost=lost, machine_before=own * (own != found.machine_sha256))


def _machine_name(path: Path) -> str:
    from tdbsim.machine import load_machine

    return load_machine(path).name


def _studies(
    orders: list[Order], workers: int, scheduler: str, progress: Progress
) -> Iterator[tuple[Order, Filing | str]]:
    if scheduler:
        yield from _on_cluster(orders, scheduler)
    elif workers <= 1 or len(orders) <= 1:
        for order in orders:

            def tell(step: str, name: str = order.record.name) -> None:
                progress(f"{name}: {step}")

            yield order, _attempt(order, tell)
    else:
        # spawned, not forked: workers must not inherit threads and open files
        with ProcessPoolExecutor(min(workers, len(orders)), get_context("spawn"), attend_parent) as pool:
            waiting = {pool.submit(_attempt, order): order for order in orders}
            for future in as_completed(waiting):
                order = waiting.pop(future)
                try:
                    yield order, future.result()
                except BrokenProcessPool:
                    yield (
                        order,
                        f"{order.record}: a worker process died (out of memory?); add it again with fewer workers",
                    )


def _attempt(order: Order, progress: Progress = silent) -> Filing | str:
    """Study a record; an `InputError` is returned as its message, so that the other records go on."""
    try:
        return study(order, progress)
    except InputError as error:
        return str(error)


def _on_cluster(orders: list[Order], scheduler: str) -> Iterator[tuple[Order, Filing | str]]:
    try:
        from distributed import Client
        from distributed import as_completed as completed
    except ImportError:
        raise InputError(
            "--scheduler needs the package 'distributed'; install it with: pip install 'tdbmon[cluster]'"
        ) from None
    try:
        client = Client(scheduler, timeout=_REACH_S)
    except (OSError, ValueError) as error:
        raise InputError(f"scheduler {scheduler}: cannot be reached ({error}); check the address") from None
    with client:
        waiting = {client.submit(_attempt, order, pure=False): order for order in orders}
        for future in completed(list(waiting)):
            order = waiting.pop(future)
            if future.status == "finished":
                yield order, future.result()
            else:
                yield order, f"{order.record}: the worker failed ({future.exception()}); add it again"
            future.release()
