"""Machines as their owner states them: three families of rotors, drawn from a seed, and their TOML text."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.blind.rotor import Disk


@dataclass(frozen=True)
class Known:
    """A value within a tolerance, SI; `percent` where the tolerance is relative, else `margin` (SI)."""

    nominal: float
    percent: float = 0.0
    margin: float = 0.0

    def drawn(self, rng: np.random.Generator, share: float = 0.85) -> float:
        """Return a true value, uniform within `share` of the tolerance."""
        return self.nominal + share * (abs(self.nominal) * self.percent / 100 + self.margin) * rng.uniform(-1, 1)

    def text(self, unit: str = "", per_si: float = 1.0) -> str:
        """Return the value as the machine file writes it."""
        number = f"{self.nominal * per_si:.9g}"
        tolerance = f'"{self.percent:g} %"' if self.percent else f'"{self.margin * per_si:g} {unit}"'
        nominal = f'"{number} {unit}"' if unit else number
        return f"{{ nominal = {nominal}, tolerance = {tolerance} }}"


@dataclass(frozen=True)
class Plane:
    """An unbalance plane."""

    name: str
    position: float
    amount: Known
    phase: Known


@dataclass(frozen=True)
class Magnet:
    """A radial magnetic bearing."""

    name: str
    position: float
    stiffness: Known
    damping: Known


@dataclass(frozen=True)
class Touchdown:
    """A touchdown bearing, from the drawing."""

    name: str
    position: float
    journal_radius: float
    gap: Known
    contact_stiffness: float
    contact_damping: Known
    friction: Known
    ring_mass: float
    ring_inertia: float
    ring_drag: Known
    balls: int
    ball_diameter: float
    pitch_diameter: float
    ball_clearance: Known
    ball_stiffness: float
    ball_damping: float
    support_mass: float
    support_stiffness: Known
    support_damping: Known


@dataclass(frozen=True)
class Probe:
    """A displacement probe."""

    name: str
    end: str
    position: float
    angle: float  # deg


@dataclass(frozen=True)
class Machine:
    """The machine as in its file, and the speeds of its drops (Hz)."""

    name: str
    sections: list[tuple[float, float]]
    disks: list[Disk]
    modal_damping: float
    planes: list[Plane]
    decay_time: Known
    magnets: tuple[Magnet, Magnet]
    touchdowns: tuple[Touchdown, Touchdown]
    probes: tuple[Probe, Probe, Probe, Probe]
    speeds: tuple[int, int, int, int]
    elastic_modulus: float = 200e9
    density: float = 7850.0
    poisson_ratio: float = 0.3


FAMILIES = ("generator", "compressor", "spindle")


def draw_machine(rng: np.random.Generator) -> Machine:
    """Draw a machine: half of them the generator as it stands, the others a family with dimensions of its own."""
    which = rng.uniform()
    if which < 0.5:
        return generator(lambda low, high: 1.0)

    def vary(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    return (generator, compressor, spindle)[int((which - 0.5) * 6)](vary)


def generator(vary) -> Machine:  # type: ignore[no-untyped-def]
    """Return the generator with an overhung impeller; `vary(low, high)` gives factors around 1."""
    lengths = [80, 60, 120, 150, 400, 150, 120, 60, 100]
    diameters = [60, 70, 80, 110, 150, 110, 80, 70, 60]
    nde, de = (
        Touchdown(
            name=name,
            position=position,
            journal_radius=0.035,
            gap=Known(_round(250e-6 * vary(0.8, 1.2), 5e-6), percent=20),
            contact_stiffness=1.3e9,
            contact_damping=Known(0.08, percent=50),
            friction=Known(0.12, percent=40),
            ring_mass=0.45,
            ring_inertia=0.00075,
            ring_drag=Known(0.015, percent=50),
            balls=11,
            ball_diameter=0.012303,
            pitch_diameter=0.09,
            ball_clearance=Known(18e-6, percent=30),
            ball_stiffness=1.06e10,
            ball_damping=400.0,
            support_mass=51.2,
            support_stiffness=Known(_round(stiffness * vary(0.7, 1.5), 1e6), percent=20),
            support_damping=Known(_round(damping * vary(0.8, 1.3), 10), percent=40),
        )
        for name, position, stiffness, damping in (("NDE", 0.11, 1.31e8, 3270.0), ("DE", 1.11, 4.03e8, 5740.0))
    )
    return Machine(
        name="Generator rotor on two radial magnetic bearings",
        sections=_sections(lengths, diameters, vary(0.96, 1.04)),
        disks=[Disk("impeller", 1.24, _round(12 * vary(0.7, 1.3), 0.1), 0.08, 0.05)],
        modal_damping=0.004,
        planes=_planes(("generator", 0.335, 40e-6), ("impeller", 1.24, 20e-6)),
        decay_time=Known(14.0, percent=25),
        magnets=_magnets(0.335, 0.885, 4e6, 4e3),
        touchdowns=(nde, de),
        probes=_probes(0.15, 1.07, 45.0),
        speeds=(60, 100, 150, 210),
    )


def compressor(vary) -> Machine:  # type: ignore[no-untyped-def]
    """Return a longer rotor with two wheels between its bearings."""
    lengths = [100, 100, 200, 300, 200, 300, 200, 100, 100]
    diameters = [80, 90, 110, 130, 140, 130, 110, 90, 80]
    stiffness = 2.2e8 * vary(0.6, 1.5)
    nde, de = (
        Touchdown(
            name=name,
            position=position,
            journal_radius=0.045,
            gap=Known(_round(300e-6 * vary(0.85, 1.15), 5e-6), percent=20),
            contact_stiffness=1.5e9,
            contact_damping=Known(0.1, percent=50),
            friction=Known(0.14, percent=40),
            ring_mass=0.8,
            ring_inertia=0.0021,
            ring_drag=Known(0.025, percent=50),
            balls=14,
            ball_diameter=0.014288,
            pitch_diameter=0.12,
            ball_clearance=Known(22e-6, percent=30),
            ball_stiffness=1.15e10,
            ball_damping=500.0,
            support_mass=60.0,
            support_stiffness=Known(_round(stiffness * vary(0.85, 1.2), 1e6), percent=20),
            support_damping=Known(_round(4500 * vary(0.7, 1.4), 10), percent=40),
        )
        for name, position in (("NDE", 0.15), ("DE", 1.45))
    )
    return Machine(
        name="Compressor rotor with two wheels",
        sections=_sections(lengths, diameters, vary(0.97, 1.05)),
        disks=[Disk("wheel 1", 0.55, 10.0, 0.09, 0.05), Disk("wheel 2", 1.05, 10.0, 0.09, 0.05)],
        modal_damping=0.005,
        planes=_planes(("wheel 1", 0.55, 60e-6), ("wheel 2", 1.05, 60e-6)),
        decay_time=Known(18.0, percent=25),
        magnets=_magnets(0.3, 1.3, 6e6, 7e3),
        touchdowns=(nde, de),
        probes=_probes(0.2, 1.4, 45.0 if vary(0, 1) < 0.5 else 0.0),
        speeds=(45, 75, 110, 150),
    )


def spindle(vary) -> Machine:  # type: ignore[no-untyped-def]
    """Return a small fast rotor."""
    lengths = [50, 60, 80, 260, 80, 60, 60]
    diameters = [40, 48, 64, 84, 64, 48, 40]
    nde, de = (
        Touchdown(
            name=name,
            position=position,
            journal_radius=0.024,
            gap=Known(_round(180e-6 * vary(0.85, 1.2), 5e-6), percent=20),
            contact_stiffness=1.0e9,
            contact_damping=Known(0.08, percent=50),
            friction=Known(0.13, percent=40),
            ring_mass=0.2,
            ring_inertia=0.00016,
            ring_drag=Known(0.006, percent=50),
            balls=12,
            ball_diameter=0.008731,
            pitch_diameter=0.0625,
            ball_clearance=Known(14e-6, percent=30),
            ball_stiffness=8.6e9,
            ball_damping=200.0,
            support_mass=14.0,
            support_stiffness=Known(_round(stiffness * vary(0.7, 1.4), 1e6), percent=20),
            support_damping=Known(_round(1500 * vary(0.7, 1.4), 10), percent=40),
        )
        for name, position, stiffness in (("NDE", 0.08, 0.9e8), ("DE", 0.57, 1.3e8))
    )
    return Machine(
        name="Small fast spindle",
        sections=_sections(lengths, diameters, vary(0.96, 1.05)),
        disks=[Disk("wheel", 0.62, 1.5, 0.0016, 0.0009)],
        modal_damping=0.004,
        planes=_planes(("core", 0.32, 6e-6), ("wheel", 0.62, 2e-6)),
        decay_time=Known(9.0, percent=25),
        magnets=_magnets(0.19, 0.46, 2.5e6, 1.2e3),
        touchdowns=(nde, de),
        probes=_probes(0.105, 0.545, 45.0 if vary(0, 1) < 0.5 else 30.0),
        speeds=(90, 150, 230, 320),
    )


def _round(value: float, step: float) -> float:
    return round(value / step) * step


def _sections(lengths: list[int], diameters: list[int], scale: float) -> list[tuple[float, float]]:
    return [
        (length * 1e-3, round(diameter * scale * 1e3) * 1e-6)
        for length, diameter in zip(lengths, diameters, strict=True)
    ]


def _planes(*planes: tuple[str, float, float]) -> list[Plane]:
    return [
        Plane(name, position, Known(amount, percent=50), Known(0.0, margin=np.radians(20)))
        for name, position, amount in planes
    ]


def _magnets(nde: float, de: float, stiffness: float, damping: float) -> tuple[Magnet, Magnet]:
    first, second = (
        Magnet(name, position, Known(stiffness, percent=20), Known(damping, percent=30))
        for name, position in (("NDE", nde), ("DE", de))
    )
    return first, second


def _probes(nde: float, de: float, angle: float) -> tuple[Probe, Probe, Probe, Probe]:
    return (
        Probe("NDE_A", "NDE", nde, angle),
        Probe("NDE_B", "NDE", nde, angle + 90),
        Probe("DE_A", "DE", de, angle),
        Probe("DE_B", "DE", de, angle + 90),
    )


def toml(m: Machine) -> str:
    """Return the machine file."""
    sections = "\n".join(
        f'  {{ length = "{length * 1e3:g} mm", outer_diameter = "{diameter * 1e3:.9g} mm" }},'
        for length, diameter in m.sections
    )
    disks = "\n".join(
        f'  {{ name = "{d.name}", position = "{d.position * 1e3:.9g} mm", mass = "{d.mass:.9g} kg",'
        f' polar_inertia = "{d.polar_inertia:.9g} kg m^2", diametral_inertia = "{d.diametral_inertia:.9g} kg m^2" }},'
        for d in m.disks
    )
    planes = "\n".join(
        f'  {{ name = "{p.name}", position = "{p.position * 1e3:.9g} mm", amount = {p.amount.text("g mm", 1e6)},'
        f" phase = {p.phase.text('deg', 180 / np.pi)} }},"
        for p in m.planes
    )
    parts = [
        f'name = "{m.name}"\nrotation = "ccw"',
        f"""[rotor]
elastic_modulus = "{m.elastic_modulus / 1e9:g} GPa"
density = "{m.density:g} kg/m^3"
poisson_ratio = {m.poisson_ratio:g}
modal_damping_ratio = {m.modal_damping:g}
sections = [                       # from the non-drive end
{sections}
]
disks = [
{disks}
]
unbalance = [                      # from the balancing sheet; phase against the keyphasor mark
{planes}
]
speed_decay_time = {m.decay_time.text("s")}""",
    ]
    parts += [
        f"""[[magnetic_bearing]]
name = "{b.name}"
position = "{b.position * 1e3:.9g} mm"
stiffness = {b.stiffness.text("N/m")}
damping = {b.damping.text("N s/m")}"""
        for b in m.magnets
    ]
    parts += [
        f"""[[touchdown_bearing]]
name = "{b.name}"
position = "{b.position * 1e3:.9g} mm"
journal_radius = "{b.journal_radius * 1e3:.9g} mm"
radial_gap = {b.gap.text("um", 1e6)}
contact_stiffness = {b.contact_stiffness:.9g}
contact_damping = {b.contact_damping.text("s/m")}
friction = {b.friction.text()}
inner_ring_mass = "{b.ring_mass:.9g} kg"
inner_ring_inertia = "{b.ring_inertia:.9g} kg m^2"
inner_ring_drag = {b.ring_drag.text("mN m", 1e3)}
balls = {{ count = {b.balls}, diameter = "{b.ball_diameter * 1e3:.9g} mm", pitch_diameter = "{b.pitch_diameter * 1e3:.9g} mm", diametral_clearance = {b.ball_clearance.text("um", 1e6)}, stiffness = {b.ball_stiffness:.9g} }}
ball_damping = "{b.ball_damping:.9g} N s/m"
support_mass = "{b.support_mass:.9g} kg"
support_stiffness = {b.support_stiffness.text("N/m")}
support_damping = {b.support_damping.text("N s/m")}"""  # noqa: E501
        for b in m.touchdowns
    ]
    parts += [
        f"""[[probe]]
name = "{p.name}"
end = "{p.end}"
position = "{p.position * 1e3:.9g} mm"
angle = "{p.angle:g} deg\""""
        for p in m.probes
    ]
    parts += ['[speed]\nchannel = "speed"', '[keyphasor]\nchannel = "keyphasor"']
    return "\n\n".join(parts) + "\n"
