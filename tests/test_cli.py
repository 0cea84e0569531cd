"""The command line as a user meets it: exit codes, one line for a wrong input, JSON by the contract."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from tdbsim.effect import catalogue

from tdbmon.cli import main
from tdbmon.record.read import read, write
from tdbmon.shipped import shipped

MACHINE = str(shipped("short/machine.toml"))
RECORD = str(shipped("short/drop_100.nc"))


def run(capsys, *arguments):
    """Run a command in this process; return exit code, output and errors."""
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    out, err = capsys.readouterr()
    return stop.value.code, out, err


def test_help_imports_nothing_heavy():
    code = (
        "import sys\nfrom tdbmon.cli import main\n"
        "try: main(['--help'])\nexcept SystemExit: pass\n"
        "heavy = {'numpy', 'pandas', 'xarray', 'scipy', 'matplotlib', 'numba', 'pint'} & set(sys.modules)\n"
        "sys.exit(f'imported {heavy}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "analyse" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["analyse", MACHINE, "nowhere.nc"], "nowhere.nc"),
        (["analyse", "nowhere.toml", RECORD], "nowhere.toml"),
        (["analyse", RECORD, MACHINE], "not a text file in UTF-8; give the machine's TOML file, which comes before"),
        (["analyse", MACHINE, MACHINE], "machine.toml"),
        (["analyse", MACHINE, RECORD, "--report", "drop.docx"], "drop.html"),
        (["analyse", MACHINE, RECORD, "--report", "/no/such/folder/r.pdf"], "does not exist"),
        (["analyze", MACHINE, RECORD], "analyse"),
        (["analyse", MACHINE], "RECORD"),
        (["inspect", "nowhere.nc"], "nowhere.nc"),
        (["effects", "oval_clearence"], "oval_clearance"),
        (["simulate", MACHINE, "--speed", "100 um", "--out", "x.nc"], "not a frequency"),
        (["simulate", MACHINE, "--speed", "-10 Hz", "--out", "x.nc"], "-10 Hz"),
        (["simulate", MACHINE, "--speed", "10 Hz", "--out", "x.csv"], "x.nc"),
        (["simulate", MACHINE, "--speed", "6000", "--out", "x.nc"], "has no unit"),
        (["simulate", MACHINE, "--speed", "6000 rpm", "--seconds", "3 kg", "--out", "x.nc"], "--seconds 3 kg"),
        (["simulate", MACHINE, "--speed", "10 Hz", "--out", "x.nc", "--effect", "ring_drag:end=DE"], "does nothing"),
        (["simulate", MACHINE, "--speed", "10 Hz", "--out", "x.nc", "--effect", "ring_drag:end=XX"], "ring_drag"),
    ],
)
def test_a_wrong_input_is_one_line_and_exit_code_two(capsys, arguments, says):
    code, out, err = run(capsys, *arguments)
    assert code == 2
    assert out == ""
    assert err.startswith("tdbmon: ")
    assert err.count("\n") == 1
    assert says in err


def test_no_command_shows_the_page_of_commands_as_it_is_laid_out(capsys):
    code, out, err = run(capsys)
    assert (code, out) == (2, "")
    assert any(line.strip().startswith("analyse ") for line in err.splitlines())


def test_results_are_written_before_anything_is_printed(monkeypatch, tmp_path):
    """Whoever reads the output may close it, as `head` does."""
    import typer

    def closed(*_, **__):
        raise BrokenPipeError

    monkeypatch.setattr(typer, "echo", closed)
    with pytest.raises((BrokenPipeError, SystemExit)):
        main(["inspect", RECORD, "--json", str(tmp_path / "i.json")])
    assert json.loads((tmp_path / "i.json").read_text())["channels"]


def test_inspect_needs_no_machine(capsys, tmp_path):
    code, out, _ = run(capsys, "inspect", RECORD, "--json", str(tmp_path / "i.json"))
    assert code == 0
    assert "NDE_A" in out
    assert "20000 Hz" in out
    assert json.loads((tmp_path / "i.json").read_text())["channels"]


def quantity(q, unit):
    assert set(q) >= {"value", "low", "high", "unit", "method"}
    assert q["unit"] == unit
    if q["value"] is None:
        assert q["why"]
    elif q["low"] is not None:
        assert q["low"] <= q["value"] <= q["high"]


def test_analyse_writes_what_the_contract_promises(capsys, tmp_path):
    files = [tmp_path / name for name in ("a.json", "a.html", "a.pdf")]
    code, out, _ = run(
        capsys,
        "analyse",
        MACHINE,
        RECORD,
        "--json",
        str(files[0]),
        "--report",
        str(files[1]),
        "--report",
        str(files[2]),
    )
    assert code == 0
    assert "release" in out
    assert all(f.stat().st_size > 1000 for f in files)
    result = json.loads(files[0].read_text())
    assert result["record"]["sampling_hz"] == pytest.approx(20000)
    assert len(result["record"]["sha256"]) == 64
    quantity(result["release_time_s"], "s")
    assert result["release_time_s"]["value"] == pytest.approx(0.1, abs=2e-4)
    for end in ("NDE", "DE"):
        state = result["release"][end]
        for name, unit in (("x_um", "um"), ("y_um", "um"), ("vx_mm_s", "mm/s"), ("vy_mm_s", "mm/s")):
            quantity(state[name], unit)
        found = result["ends"][end]
        for name, unit in (
            ("gap_lower_um", "um"), ("gap_upper_um", "um"), ("gap_from_swing_um", "um"), ("swing_hz", "Hz"),
            ("first_contact_s", "s"), ("first_contact_duration_s", "s"), ("rebound_um", "um"), ("restitution", "1"),
            ("stiffness_n_per_m", "N/m"), ("peak_force_n", "N"), ("ring_at_speed_s", "s"),
        ):  # fmt: skip
            quantity(found[name], unit)
        quantity(found["gap_centre_um"][0], "um")
        quantity(found["support"]["mass_kg"], "kg")
        quantity(found["stress_mpa"]["max"], "MPa")
        assert isinstance(found["contacts"], int)
        assert found["contacts_low"] <= found["contacts"] <= found["contacts_high"] and found["contacts_why"] is None
    speed = result["speed"]
    for name, unit in (
        ("initial_hz", "Hz"),
        ("decay_time_s", "s"),
        ("standstill_time_s", "s"),
        ("drag_torque_n_m", "N m"),
    ):
        quantity(speed[name], unit)
    assert sum(model["chosen"] for model in speed["models"]) <= 1
    assert {"kind", "order", "frequency_hz", "direction", "end", "name"} <= set(result["lines"][0] if result["lines"] else
        {"kind", "order", "frequency_hz", "direction", "end", "name"})  # fmt: skip
    assert {"backward", "full"} <= set(result["whirl"])
    assert all({"check", "channel", "passed", "detail"} <= set(row) for row in result["quality"])


def test_every_number_that_is_missing_says_why(capsys, tmp_path):
    why = "still lifts off by more than 25 um at 0.4567 s"
    report, cut = tmp_path / "r.html", tmp_path / "cut.nc"
    write(read(shipped("short/drop_150.nc")).sel(time=slice(0, 0.5)), cut)
    code, out, _ = run(capsys, "analyse", MACHINE, str(cut), "--report", str(report))
    assert code == 0
    lost, kept = out.split("NDE  (bearing plane)")[1].split("DE  (bearing plane)")
    assert why in lost and lost.count(why) == 1
    for label in ("radius at rest", "first contact", "duration", "rebound", "single-mass stiffness"):
        assert f"{label} " in lost and f"{label} " in kept
    assert "first contact           not estimated (as radius at rest)" in lost
    said = report.read_text()
    assert "those at NDE are not known" in said
    printed = said.split("The first contact at NDE is not estimated:")[1].split("</p>")[0]
    assert why.replace(" um", " µm") in printed


@pytest.mark.slow
def test_forces_come_from_a_fitted_model(capsys, tmp_path):
    """The rig program's own peak forces (synthetic) lie in the intervals that displacement alone gives."""
    files = [tmp_path / "f.json", tmp_path / "f.html"]
    code, out, _ = run(
        capsys, "analyse", MACHINE, RECORD, "--forces", "--json", str(files[0]), "--report", str(files[1])
    )
    assert code == 0
    assert "peak force on the ring" in out
    assert "Forces and stresses" in files[1].read_text()
    result = json.loads(files[0].read_text())
    truth = json.loads(shipped("short/answer.json").read_text())["true"]["peak_force_n"]["100"]
    for end, peak in zip(("NDE", "DE"), truth, strict=True):
        found = result["ends"][end]
        assert found["peak_force_n"]["low"] <= peak <= found["peak_force_n"]["high"]
        assert found["peak_force_n"]["value"] == pytest.approx(peak, rel=0.05)
        quantity(found["support"]["stiffness_n_per_m"], "N/m")
        quantity(found["stress_mpa"]["max"], "MPa")
    assert result["calibration"]["residual_over_noise"] < 3


def test_nothing_is_left_of_a_run_that_fails(capsys, tmp_path):
    broken = tmp_path / "broken.nc"
    broken.write_bytes(shipped("short/drop_100.nc").read_bytes()[:5000])
    code, _, err = run(capsys, "analyse", MACHINE, str(broken), "--json", str(tmp_path / "a.json"))
    assert code == 2
    assert "broken.nc" in err
    assert [f.name for f in tmp_path.iterdir()] == ["broken.nc"]


def test_a_simulated_drop_is_a_record_that_analyse_takes(capsys, tmp_path):
    drop = tmp_path / "drop.nc"
    code, out, _ = run(
        capsys, "simulate", MACHINE, "--speed", "6000 rpm", "--seconds", "0.1", "--out", str(drop),
        "--effect", "oval_clearance:end=NDE,amplitude=20 um", "--json", str(tmp_path / "s.json"),
    )  # fmt: skip
    assert code == 0
    assert "oval_clearance" in out
    forces = json.loads((tmp_path / "s.json").read_text())["ends"]["NDE"]["peak_force_n"]
    assert forces["value"] > 500  # it came down on the ring
    code, out, _ = run(capsys, "analyse", MACHINE, str(drop), "--json", str(tmp_path / "a.json"))
    assert code == 0
    found = json.loads((tmp_path / "a.json").read_text())
    assert found["release_time_s"]["value"] == pytest.approx(0.1, abs=2e-4)


def test_a_ring_follows_no_shaft_that_stands(capsys, tmp_path):
    code, out, _ = run(
        capsys, "simulate", MACHINE, "--speed", "0 Hz", "--seconds", "0.02", "--out", str(tmp_path / "d.nc")
    )
    assert code == 0
    assert out.count("the shaft does not turn") == 2


def test_effects_lists_the_catalogue(capsys):
    code, out, _ = run(capsys, "effects")
    assert code == 0
    assert [line.split()[0] for line in out.strip().splitlines()] == [each.identifier for each in catalogue()]
    code, out, _ = run(capsys, "effects", "loose_support")
    assert "play" in out
    code, out, _ = run(capsys, "effects", "race_waviness")
    assert "inner or outer, default inner" in out
