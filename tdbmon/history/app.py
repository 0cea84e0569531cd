"""Command-line arguments of `tdbmon archive` and `tdbmon compare`; `tdbmon.history.command` executes them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tdbmon.arguments import JsonFile, MachineFile, Reports

archive_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="File drops over years, and look them up.")
DropID = Annotated[
    str, typer.Argument(metavar="ID", help="identifier of a drop, its first digits, or the name of its record")
]
ArchiveFolder = Annotated[Path, typer.Option("--archive", metavar="DIR", help="the archive's folder")]
FailOn = Annotated[str, typer.Option(metavar="alarm", help="exit with code 3 if an alarm stands")]
Forces = Annotated[
    bool, typer.Option("--forces/--no-forces", help="fit the simulation: forces and stresses (much slower)")
]


@archive_app.command("add")
def archive_add(
    machine: MachineFile,
    records: Annotated[list[Path], typer.Argument(metavar="RECORD...", help="dropdown records")],
    archive: ArchiveFolder,
    forces: Annotated[
        bool | None,
        typer.Option(
            "--forces/--no-forces",
            help="fit the simulation: forces and stresses (much slower); by default if the drop is filed with them",
            show_default=False,
        ),
    ] = None,
    assembly: Annotated[str, typer.Option(help="a word for this assembly, e.g. after an overhaul")] = "",
    dropped: Annotated[str, typer.Option(metavar="TIME", help="time of the drop, ISO 8601, if the record's is wrong")] = "",
    again: Annotated[
        bool,
        typer.Option(
            "--again", help="analyse already filed drops again, with this version and this machine file"
        ),
    ] = False,
    workers: Annotated[int, typer.Option(min=1, help="number of processes")] = 1,
    scheduler: Annotated[str, typer.Option(metavar="ADDRESS", help="dask scheduler (extra 'cluster')")] = "",
    json_file: JsonFile = None,
) -> None:
    """Analyse drops and file them; drops already filed are skipped."""
    from tdbmon.history import adding

    code = adding.add(
        archive,
        machine,
        records,
        forces=forces,
        assembly=assembly,
        dropped=dropped,
        again=again,
        workers=workers,
        scheduler=scheduler,
        json_file=json_file,
    )
    raise typer.Exit(code)


@archive_app.command("list")
def archive_list(
    archive: ArchiveFolder,
    machine: Annotated[str, typer.Option(metavar="NAME", help="list one machine only")] = "",
    json_file: JsonFile = None,
) -> None:
    """List the drops in chronological order."""
    from tdbmon.history import command

    command.list_drops(archive, machine, json_file)


@archive_app.command("show")
def archive_show(drop: DropID, archive: ArchiveFolder, json_file: JsonFile = None) -> None:
    """Show the filed results of one drop."""
    from tdbmon.history import command

    command.show(archive, drop, json_file)


@archive_app.command("verify")
def archive_verify(
    archive: ArchiveFolder,
    rebuild: Annotated[bool, typer.Option("--rebuild", help="rebuild the catalogue from the result files")] = False,
    json_file: JsonFile = None,
) -> None:
    """Verify every file against its checksum, and the catalogue against the files."""
    from tdbmon.history import command

    command.verify(archive, rebuild, json_file)


@archive_app.command("remove")
def archive_remove(drop: DropID, archive: ArchiveFolder) -> None:
    """Remove a drop with its raw file and results."""
    from tdbmon.history import command

    command.remove(archive, drop)


@archive_app.command("export")
def archive_export(
    archive: ArchiveFolder,
    out: Annotated[Path, typer.Option(metavar="F.csv|F.parquet", help="the table to write")],
) -> None:
    """Write the features of all drops as a table for other tools."""
    from tdbmon.history import command

    command.export(archive, out)


@archive_app.command("report")
def archive_report(
    archive: ArchiveFolder,
    report: Reports = None,
    drop: Annotated[str, typer.Option(metavar="ID", help="report one drop")] = "",
    machine: Annotated[
        str, typer.Option(metavar="NAME", help="report one machine; by default the only one, or the fleet")
    ] = "",
    fail_on: FailOn = "",
    json_file: JsonFile = None,
) -> None:
    """Report a machine over all its drops, or the fleet, worst first."""
    from tdbmon.history import command

    code = command.report(archive, drop, machine, fail_on=fail_on, json_file=json_file, reports=report or [])
    raise typer.Exit(code)


def compare(
    archive: ArchiveFolder,
    drop: Annotated[str, typer.Argument(metavar="[RECORD or ID]", help="by default the archive's last drop")] = "",
    machine: Annotated[Path | None, typer.Option(metavar="MACHINE", help="machine file of a record that is not filed")] = None,
    forces: Forces = False,
    fail_on: FailOn = "",
    json_file: JsonFile = None,
    report: Reports = None,
) -> None:
    """Compare a drop with earlier ones: whether it differs, in which quantities, and what that means."""
    from tdbmon.history import command

    code = command.compare(
        archive, drop, machine=machine, forces=forces, fail_on=fail_on, json_file=json_file, reports=report or []
    )
    raise typer.Exit(code)
