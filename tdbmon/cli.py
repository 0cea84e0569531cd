"""The command line.  Commands parse, call the library and write; nothing is computed here."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from tdbmon.arguments import JsonFile, MachineFile, Reports, one_by_one
from tdbmon.history.app import archive_app, compare
from tdbmon.json_file import say, write_json
from tdbmon.output_file import check_outputs
from tdbmon.progress import on_terminal

# small matrices: threads of the linear algebra library only get in each other's way; must precede numpy
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Measurement analysis and condition monitoring of rotor dropdowns on touchdown bearings.",
)


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

    with on_terminal() as tell:
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

    check_outputs([json_file], [file])
    found = look(file)
    written = write_json(json_file, found.to_json())
    say([*found.lines(), *written])


@app.command()
def analyse(
    machine: MachineFile,
    record: Annotated[Path, typer.Argument(metavar="RECORD", help="a dropdown record")],
    json_file: JsonFile = None,
    report: Reports = None,
    forces: Annotated[
        bool,
        typer.Option(
            "--forces",
            help="fit the simulation to the first contacts: forces, stresses (half a minute; whole coast-downs take longer)",
        ),
    ] = False,
    calibrated: Annotated[
        Path | None,
        typer.Option(metavar="F.toml", help="write the machine file with the fitted values (implies --forces)"),
    ] = None,
    also: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="RECORD",
            help="another drop of the machine in this condition, fitted jointly (implies --forces); repeatable",
        ),
    ] = None,
) -> None:
    """Analyse one dropdown record."""
    from tdbmon.analysis import command

    command.analyse(machine, record, json_file, report, forces, calibrated, also)


@app.command()
def simulate(
    machine: MachineFile,
    speed: Annotated[str, typer.Option(help='speed at the release, e.g. "100 Hz" or "6000 rpm"')],
    out: Annotated[Path, typer.Option(metavar="F.nc", help="the record to write (netCDF)")],
    seconds: Annotated[str, typer.Option(help="time after the release, s")] = "0.2",
    effect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID:name=value,...",
            help="an effect with its place, in addition to those of the machine file; repeatable",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="seed of the sensors' noise")] = 0,
    sampling: Annotated[
        str | None,
        typer.Option(help='sampling rate, e.g. "50 kHz"; default 20 kHz, or more if the keyphasor needs it'),
    ] = None,
    json_file: JsonFile = None,
) -> None:
    """Simulate a drop: the record that the machine's sensors would give, and quantities that no sensor measures."""
    from tdbsim.errors import InputError
    from tdbsim.machine import load_machine

    from tdbmon.simulation import simulate_drop, simulation_json, simulation_lines

    if out.suffix.lower() != ".nc":
        raise InputError(f"{out}: a simulated record is netCDF; name it {out.with_suffix('.nc').name}")
    check_outputs([out, json_file], [machine])
    with on_terminal() as tell:
        tell("reading the machine and compiling the model")
        loaded = load_machine(machine)
        drop = simulate_drop(loaded, speed, seconds, effect or [], seed, tell, sampling)
        from tdbmon.record.read import write

        write(drop, out)
    written = write_json(json_file, simulation_json(drop, loaded))
    say([*simulation_lines(drop, loaded, effect or []), *written, f"record: {out}"])


@app.command()
def diagnose(
    machine: MachineFile,
    records: Annotated[list[Path], typer.Argument(metavar="RECORD...", help="drops of the machine in one condition")],
    json_file: JsonFile = None,
    report: Reports = None,
    extended: Annotated[
        Path | None, typer.Option(metavar="F.toml", help="write the machine file with the effects that were found")
    ] = None,
    reference: Annotated[
        list[Path] | None,
        typer.Option(metavar="RECORD", help="earlier drops: report what has changed since"),
    ] = None,
) -> None:
    """Find the effect that the model of a machine lacks: its kind, place and size, verified on a held-out drop."""
    from tdbmon.diagnosis import command

    command.diagnose(machine, records, json_file, report, extended, reference)


@app.command()
def identifiability(
    machine: MachineFile,
    speed: Annotated[list[str], typer.Option(help='speed at the release, e.g. "100 Hz"; once for each drop')],
    noise: Annotated[str, typer.Option(help="rms noise of each probe")] = "0.3 um",
    json_file: JsonFile = None,
) -> None:
    """Predict before any measurement what drops can identify: detectable sizes, effects that look alike, best next drop."""
    from tdbsim.machine import load_machine

    from tdbmon.diagnosis.identifiability import identifiability as run
    from tdbmon.diagnosis.identifiability_contract import identifiability_json, identifiability_lines
    from tdbmon.option_quantity import noise_of, speed_of

    check_outputs([json_file], [machine])
    with on_terminal() as tell:
        tell("reading the machine and compiling the model")
        found = run(load_machine(machine), [speed_of(text) for text in speed], noise_of(noise), tell)
    written = write_json(json_file, identifiability_json(found))
    say([*identifiability_lines(found), *written])


@app.command()
def effects(
    identifier: Annotated[str | None, typer.Argument(metavar="ID", help="show one effect with its parameters")] = None,
) -> None:
    """List the catalogue of effects that a simulation or a machine file may include."""
    from tdbmon.effects_page import catalogue_lines, effect_lines

    for line in catalogue_lines() if identifier is None else effect_lines(identifier):
        typer.echo(line)


app.add_typer(archive_app, name="archive")
app.command()(compare)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; an input error prints one line on standard error and exits with code 2."""
    try:
        code = app(one_by_one(sys.argv[1:] if arguments is None else arguments), standalone_mode=False)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:
        message = _cause(error)
        if message is None:
            raise
        if type(error).__name__ == "NoArgsIsHelpError":  # no command given: show the help page unchanged
            sys.stderr.write(str(error.format_message()) + "\n")  # type: ignore[attr-defined]
        else:
            sys.stderr.write("tdbmon: " + " ".join(message.split()) + "\n")
        sys.exit(2)
    sys.exit(code if isinstance(code, int) else 0)


def _cause(error: Exception) -> str | None:
    """Return the message for an input error; None for a defect of the program."""
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
