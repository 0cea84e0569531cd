"""Material for reports of a diagnosis: two short synthetic drops with a slowly fading magnetic force, and a report's words."""

from __future__ import annotations

import numpy as np
from tdbsim.sensors import ProbeChain, SensorChain
from tdbsim.simulate import DropPlan, simulate
from tdbsim.stated_effects import parse

from tdbmon.diagnosis.contest import contest
from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.held_out import HeldOut
from tdbmon.diagnosis.late_record import LateRecord
from tdbmon.diagnosis.suspects import suspects
from tdbmon.diagnosis.verdict import Kind, Verdict
from tdbmon.estimate import Estimate
from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.problem import build_problem
from tdbmon.report.document import Document, Paragraph, Table
from tdbmon.report.document import Verdict as Tinted
from tests.identify import drops

HORIZONS = (0.006, 0.012)
DECAY_S = 0.003
CAUSE = "residual_magnetic_force@rotor"


def record_of(speed: float, seed: int):  # type: ignore[no-untyped-def]
    machine = drops.machine()
    plan = DropPlan(
        speed=speed,
        seconds=0.04,
        levitated=0.06,
        set_point=((1e-5, -5e-6), (-8e-6, 4e-6)),
        cage_angle=(0.1, 0.2),
        sensors=SensorChain(probe=ProbeChain(noise=drops.NOISE), speed_noise_hz=0.03),
        seed=seed,
    )
    record = simulate(machine, plan, effects=(parse(f"residual_magnetic_force:decay_time={DECAY_S} s"),), bending=12)
    record.attrs["source_file"] = f"drop_{speed:g}.nc"
    return record


def late_of(name: str, times: float) -> LateRecord:
    """The rest of a record whose whirl is `times` that of its simulations."""
    rng = np.random.default_rng(1)
    onces, places = (
        rng.uniform(1e-5, 2e-5, (12, 1, 4)) * np.ones((1, 2, 1), dtype=complex),
        rng.uniform(-1e-4, -9e-5, (12, 2, 4)),
    )
    probes = ("DE_A", "DE_B")
    return LateRecord(
        name, 0.04, 0.04 + 0.05 * np.arange(4), probes, times * np.median(onces, axis=0), onces, places[0], places
    )


def words_of(document: Document) -> str:
    """All text of the document, without drawing its figures."""
    out = [document.note]
    for block in (block for section in document.sections for block in section.blocks):
        if isinstance(block, Paragraph | Tinted):
            out.append(block.text)
        elif isinstance(block, Table):
            out += [block.caption, *(cell for row in block.rows for cell in row.cells)]
    return "\n".join(out)


def named_diagnosis(crew: Crew) -> Diagnosis:
    """A diagnosis that names the magnetic force, its only suspect."""
    machine = drops.machine()
    measured = tuple(measured_drop(record_of(speed, seed), machine) for speed, seed in ((97.0, 1), (148.0, 2)))
    problem = build_problem(machine, measured, crew)
    suspect = next(each for each in suspects(machine, machine.probes, ()) if each.name == CAUSE)
    found, plain = sorted(contest(problem, [suspect], HORIZONS, lambda _: None), key=lambda each: not each.causes)
    return Diagnosis(
        machine=machine,
        verdict=Verdict(Kind.NAMED, (found,), (0.97, 0.0), "it leaves less"),
        contenders=(found, plain),
        proof=HeldOut(("drop_97.nc",), 2.0e-6, 0.3e-6, 0.25e-6, 9e3, 1e3),
        parameters={found: {CAUSE: {"decay_time": Estimate(3.0e-3, 2.9e-3, 3.1e-3, "ms", "fit")}}},
        values={},
        late=(late_of("drop_97.nc", 1.0), late_of("drop_148.nc", 2.5)),
        late_before=None,
        mistaken=None,
        next_test="another drop",
        remarks=("probe 'DE_B' was noisy",),
        seconds=1.0,
    )
