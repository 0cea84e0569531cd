"""The command line.  Commands parse, call the library and write; nothing is computed here."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

# small matrices: threads of the linear algebra library only get in each other's way; must precede numpy
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Measurement analysis and condition monitoring of rotor dropdowns on touchdown bearings.",
)

MachineFile = Annotated[Path, typer.Argument(metavar="MACHINE", help="the machine's TOML file")]
JsonFile = Annotated[Path | None, typer.Option("--json", metavar="F.json", help="write the results as JSON")]

DropID = Annotated[str, typer.Argument(metavar="ID", help="a drop's identifier, or the first digits of it")]


def _version(wanted: bool) -> None:
    if wanted:
        from tdbmon import __version__

        typer.echo(f"tdbmon {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version")
    ] = False,
) -> None:
    pass


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="folder for the reports")] = Path("demo-output"),
) -> None:
    """Analyse the synthetic drops that ship with tdbmon and write their reports."""
    from tdbmon.demo import run_demo

    with _progress() as tell:
        written = run_demo(out, tell)
    for line in written:
        typer.echo(line)


@app.command()
def inspect(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="a record in any format that tdbmon reads")],
    json_file: JsonFile = None,
) -> None:
    """Show what is in a file: channels, units, rates, duration, gaps.  Needs no machine."""
    from tdbmon.record.inspect import inspect as look

    found = look(file)
    for line in found.lines():
        typer.echo(line)
    _write_json(json_file, found.to_json)


@app.command()
def analyse(
    machine: MachineFile,
    record: Annotated[Path, typer.Argument(metavar="RECORD", help="a dropdown record")],
    json_file: JsonFile = None,
    report: Annotated[
        list[Path] | None, typer.Option(metavar="F.html|F.pdf", help="write a report; may be given twice")
    ] = None,
    forces: Annotated[
        bool,
        typer.Option("--forces", help="fit the simulation to the first contacts: forces, stresses (some ten seconds)"),
    ] = False,
    calibrated: Annotated[
        Path | None,
        typer.Option(metavar="F.toml", help="write the machine file with the fitted values (implies --forces)"),
    ] = None,
) -> None:
    """Analyse one dropdown record."""
    writers = [_report_writer(path) for path in report or []]
    from tdbsim.machine import load_machine

    if calibrated is not None:
        from tdbmon.machine_file import calibration_head, check_new_file, write_machine

        check_new_file(calibrated, machine)
    from tdbmon.analysis.analyse import analyse as run
    from tdbmon.analysis.contract import analysis_json
    from tdbmon.analysis.summary import summary_lines
    from tdbmon.record.read import read

    with _progress() as tell:
        tell("reading the machine and the record")
        plan = load_machine(machine)
        channels = read(record)
        result = run(channels, plan, tell)
        fitted = None
        if forces or calibrated is not None:
            from tdbmon.identify.fitted import fit_drop

            fitted = fit_drop(plan, channels, tell)
        if writers:
            from tdbmon.report.drop_report import build_report

            tell("drawing the figures")
            document = build_report(result, fitted=fitted)
            for write in writers:
                write(document)
    for line in summary_lines(result):
        typer.echo(line)
    content = analysis_json(result)
    if fitted is not None:
        from tdbmon.identify.contract import calibration_json, end_json, force_lines

        for end, found in fitted.forces.ends.items():
            content["ends"].setdefault(end, {}).update(end_json(fitted.calibration, found))
        content["calibration"] = calibration_json(fitted.calibration)
        for line in force_lines(fitted.calibration, fitted.forces):
            typer.echo(line)
        if calibrated is not None:
            write_machine(fitted.calibration.calibrated, calibrated, calibration_head(fitted.calibration, machine))
            typer.echo(f"machine: {calibrated}")
    _write_json(json_file, lambda: content)
    for path in report or []:
        typer.echo(f"report: {path}")


@app.command()
def simulate(
    machine: MachineFile,
    speed: Annotated[str, typer.Option(help='speed at the release, e.g. "100 Hz" or "6000 rpm"')],
    out: Annotated[Path, typer.Option(metavar="F.nc", help="the record to write (netCDF)")],
    seconds: Annotated[str, typer.Option(help="time after the release, s")] = "0.2",
    effect: Annotated[
        list[str] | None,
        typer.Option(metavar="ID:name=value,...", help="an effect of the catalogue with its place; may be repeated"),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="of the sensors' noise")] = 0,
    json_file: JsonFile = None,
) -> None:
    """Simulate a drop: a record as the machine's sensors would see it, and what they do not see."""
    from tdbsim.errors import InputError
    from tdbsim.machine import load_machine

    from tdbmon.simulation import simulate_drop, simulation_json, simulation_lines

    if out.suffix.lower() != ".nc":
        raise InputError(f"{out}: a simulated record is netCDF; name it {out.with_suffix('.nc').name}")
    with _progress() as tell:
        tell("reading the machine and compiling the model")
        drop = simulate_drop(load_machine(machine), speed, seconds, effect or [], seed, tell)
        from tdbmon.record.read import write

        write(drop, out)
    for line in simulation_lines(drop):
        typer.echo(line)
    _write_json(json_file, lambda: simulation_json(drop))
    typer.echo(f"record: {out}")


@app.command()
def diagnose(
    machine: MachineFile,
    records: Annotated[list[Path], typer.Argument(metavar="RECORD...", help="drops of the machine in one condition")],
    json_file: JsonFile = None,
    report: Annotated[
        list[Path] | None, typer.Option(metavar="F.html|F.pdf", help="write a report; may be given twice")
    ] = None,
    extended: Annotated[
        Path | None, typer.Option(metavar="F.toml", help="write the machine file with the effects that were found")
    ] = None,
) -> None:
    """Find what the model of a machine lacks: name the effect, its place and size, and prove the gain."""
    from tdbsim.machine import load_machine

    from tdbmon.diagnosis.contract import diagnosis_json, diagnosis_lines
    from tdbmon.diagnosis.diagnose import diagnose as run
    from tdbmon.record.read import read

    writers = [_report_writer(path) for path in report or []]
    if extended is not None:
        from tdbmon.machine_file import check_new_file

        check_new_file(extended, machine)
    with _progress() as tell:
        tell("reading the machine and the records")
        channels = [read(path) for path in records]
        result = run(load_machine(machine), channels, tell)
        if writers:
            from tdbmon.report.compare_report import SYNTHETIC
            from tdbmon.report.diagnosis_report import build_diagnosis_report

            tell("drawing the figures")
            computed = any("synthetic" in str(each.attrs).lower() for each in channels)
            document = build_diagnosis_report(result, note=SYNTHETIC if computed else "")
            for write in writers:
                write(document)
    for line in diagnosis_lines(result):
        typer.echo(line)
    _write_json(json_file, lambda: diagnosis_json(result))
    for path in report or []:
        typer.echo(f"report: {path}")
    if extended is not None:
        from tdbmon.diagnosis.extended_machine import extended_head, extended_machine
        from tdbmon.machine_file import write_machine

        wider = extended_machine(result)
        if wider is None:
            typer.echo(f"no {extended} written: nothing was named")
        else:
            write_machine(wider, extended, extended_head(result))
            typer.echo(f"extended machine file: {extended}")


@app.command()
def identifiability(
    machine: MachineFile,
    speed: Annotated[list[str], typer.Option(help='speed at a release, e.g. "100 Hz"; once a drop')],
    noise: Annotated[str, typer.Option(help="of each probe, rms")] = "0.3 um",
    json_file: JsonFile = None,
) -> None:
    """Say before any record what drops could tell: how small effects show, which look alike, which drop to add."""
    from tdbsim.machine import load_machine

    from tdbmon.diagnosis.identifiability import identifiability as run
    from tdbmon.diagnosis.identifiability_contract import identifiability_json, identifiability_lines, read_noise
    from tdbmon.simulation import read_speed

    with _progress() as tell:
        tell("reading the machine and compiling the model")
        found = run(load_machine(machine), [read_speed(text) for text in speed], read_noise(noise), tell)
    for line in identifiability_lines(found):
        typer.echo(line)
    _write_json(json_file, lambda: identifiability_json(found))


@app.command()
def effects(
    identifier: Annotated[str | None, typer.Argument(metavar="ID", help="one effect, with its parameters")] = None,
) -> None:
    """Show the catalogue of effects that a simulation or a machine file may carry."""
    from tdbsim.effect import catalogue, declaration

    if identifier is None:
        for each in catalogue():
            typer.echo(f"{each.identifier:<26}{each.place:<18}{each.what}")
        return
    found = declaration(identifier)
    typer.echo(f"{found.identifier}: {found.title}\n{found.what}\nsignature: {found.signature}\nwhere: {found.place}")
    for one in found.parameters:
        if one.choices:
            typer.echo(f"  {one.name}: {one.meaning}; {' or '.join(one.choices)}")
        else:
            bounds = f"{one.text(one.low)} to {one.text(one.high)}"
            typer.echo(f"  {one.name}: {one.meaning}; {bounds}, off or default {one.text(one.off)}")


archive_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="File drops over years, and look them up.")
app.add_typer(archive_app, name="archive")
ArchiveFolder = Annotated[Path, typer.Option("--archive", metavar="DIR", help="the archive's folder")]
Forces = Annotated[
    bool, typer.Option("--forces/--no-forces", help="fit the simulation: forces and stresses (much slower)")
]
Reports = Annotated[
    list[Path] | None, typer.Option("--report", metavar="F.html|F.pdf", help="write a report; may be given twice")
]


@archive_app.command("add")
def archive_add(
    machine: MachineFile,
    records: Annotated[list[Path], typer.Argument(metavar="RECORD...", help="dropdown records")],
    archive: ArchiveFolder,
    forces: Forces = False,
    assembly: Annotated[str, typer.Option(help="a word for this assembly, e.g. after an overhaul")] = "",
    dropped: Annotated[str, typer.Option(metavar="TIME", help="ISO 8601; where the record's own is wrong")] = "",
    workers: Annotated[int, typer.Option(min=1, help="processes")] = 1,
    scheduler: Annotated[str, typer.Option(metavar="ADDRESS", help="of a dask scheduler (extra 'cluster')")] = "",
    json_file: JsonFile = None,
) -> None:
    """Analyse drops and file them; what is filed already is passed over."""
    from tdbmon.history import command

    with _progress() as tell:
        code = command.add(archive, machine, records, forces, assembly, dropped, workers, scheduler, json_file, tell)
    raise typer.Exit(code)


@archive_app.command("list")
def archive_list(
    archive: ArchiveFolder,
    machine: Annotated[str, typer.Option(metavar="NAME", help="of one machine only")] = "",
    json_file: JsonFile = None,
) -> None:
    """List the drops in the order of their fall."""
    from tdbmon.history import command

    command.list_drops(archive, machine, json_file)


@archive_app.command("show")
def archive_show(drop: DropID, archive: ArchiveFolder, json_file: JsonFile = None) -> None:
    """Show what is filed of one drop."""
    from tdbmon.history import command

    command.show(archive, drop, json_file)


@archive_app.command("verify")
def archive_verify(
    archive: ArchiveFolder,
    rebuild: Annotated[bool, typer.Option("--rebuild", help="make the catalogue anew from the result files")] = False,
    json_file: JsonFile = None,
) -> None:
    """Check every file against what was filed, and the catalogue against the files."""
    from tdbmon.history import command

    with _progress() as tell:
        command.verify(archive, rebuild, json_file, tell)


@archive_app.command("remove")
def archive_remove(drop: DropID, archive: ArchiveFolder) -> None:
    """Take a drop out, with its raw file and results."""
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
    machine: Annotated[str, typer.Option(metavar="NAME", help="report one machine; by default the fleet")] = "",
) -> None:
    """Report a machine over all its drops, or the fleet, worst first."""
    writers = [_report_writer(path) for path in report or []]
    from tdbmon.history import command

    with _progress() as tell:
        command.report(archive, drop, machine, writers, tell)
    for path in report or []:
        typer.echo(f"report: {path}")


@app.command()
def compare(
    archive: ArchiveFolder,
    drop: Annotated[str, typer.Argument(metavar="[RECORD or ID]", help="by default the archive's last drop")] = "",
    machine: Annotated[Path | None, typer.Option(metavar="MACHINE", help="of a record that is not filed")] = None,
    forces: Forces = False,
    fail_on: Annotated[str, typer.Option(metavar="alarm", help="exit with 3 where an alarm stands")] = "",
    json_file: JsonFile = None,
    report: Reports = None,
) -> None:
    """Say whether a drop differs from those before it, in what, and what that means."""
    writers = [_report_writer(path) for path in report or []]
    from tdbmon.history import command

    with _progress() as tell:
        code = command.compare(archive, drop, machine, forces, fail_on, json_file, writers, tell)
    for path in report or []:
        typer.echo(f"report: {path}")
    raise typer.Exit(code)


def _report_writer(path: Path) -> Callable[[Any], None]:
    """Return what writes a document to this path; the suffix decides."""
    from tdbsim.errors import InputError

    suffix = path.suffix.lower()
    if suffix not in (".html", ".pdf"):
        raise InputError(f"{path}: a report is .html or .pdf, not '{suffix}'; name it {path.with_suffix('.html').name}")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; make it first")

    def write(document: Any) -> None:
        if suffix == ".html":
            from tdbmon.report.html import write_html

            write_html(document, path)
        else:
            from tdbmon.report.pdf import write_pdf

            write_pdf(document, path)

    return write


def _write_json(path: Path | None, content: Callable[[], dict[str, Any]]) -> None:
    if path is None:
        return
    from tdbmon.atomic import write_text

    write_text(path, json.dumps(content(), indent=1, allow_nan=False) + "\n")
    typer.echo(f"json: {path}")


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Show the current step on a terminal; say nothing in a pipe."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    with Console(stderr=True).status("starting") as status:
        yield lambda step: status.update(step)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; an input that cannot be used is one line on standard error and exit code 2."""
    try:
        code = app(arguments, standalone_mode=False)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:
        message = _cause(error)
        if message is None:
            raise
        sys.stderr.write("tdbmon: " + " ".join(message.split()) + "\n")
        sys.exit(2)
    sys.exit(code if isinstance(code, int) else 0)


def _cause(error: Exception) -> str | None:
    """Return the line to show for an error of the input, None for a defect of the program."""
    if hasattr(error, "format_message"):  # a wrong option or argument
        return str(error.format_message()) + " (see --help)"
    if type(error).__name__ == "Abort":
        sys.exit(130)
    from tdbsim.errors import InputError

    if isinstance(error, InputError):
        return str(error)
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}; check the path and the permissions"
    return None
