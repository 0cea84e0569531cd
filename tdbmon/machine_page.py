"""Writes docs/machine_file.md, every key of a machine file, from the models that read it (``python -m tdbmon.machine_page``)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from tdbsim.bearing_heat import BearingHeat, HeatMaterial
from tdbsim.machine import (
    Balls,
    Disk,
    Keyphasor,
    Machine,
    MagneticBearing,
    Probe,
    Rotor,
    Section,
    SlowRoll,
    SpeedSignal,
    Tolerant,
    TouchdownBearing,
    Unbalance,
)
from tdbsim.units import scale

from tdbmon.atomic import write_text
from tdbmon.machine_file import SI, UNITS

PAGE = Path(__file__).resolve().parents[1] / "docs" / "machine_file.md"


@dataclass(frozen=True)
class Key:
    """Description of a key: `used` is ``"analyse"``, or ``"forces"`` if a plain analysis does not need it."""

    used: str
    says: str
    unit: str = ""


_HEAD = """# The machine file

Made by `python -m tdbmon.machine_page` from the models that read the file; do not edit.

Start from [`datasets/machines/template.toml`](../datasets/machines/template.toml): it loads as it is, and says at each
table what a plain analysis needs and what may stay unchanged. `tdbmon analyse` lists everything that a file lacks.

## How values are written

A value is a number in SI, a text with a unit, or a value with a tolerance:

    journal_radius = 0.035                                        # m
    journal_radius = "35 mm"
    radial_gap = { nominal = "250 um", tolerance = "50 um" }      # 200 to 300 um
    radial_gap = { nominal = "250 um", tolerance = "20 %" }       # the same

Any unit of the quantity is accepted (`mil`, `lbf/in`, `rpm`, `ksi` ...). A tolerance is the half-width, taken as two
standard deviations. Fits (`--forces`, `diagnose`) change a value within its tolerance and no further, so give a tolerance to
each value that is not known well; ± in the tables marks the keys that accept one. A value without tolerance is not changed,
except those that are never known exactly: contact stiffness (may change by a quarter), ball stiffness (a tenth), ring and
support mass, the exponents, the elastic modulus.

## Directions

The shaft must be horizontal: the analysis of a drop is based on the fall, and a vertical shaft does not fall onto its radial
bearings (only its run-down can be analysed, with a machine file without probes).

Look at the rotor always from the same end: *x* to the right, *y* up, gravity along −*y*. Angles count from +*x* towards
+*y*; `rotation = "ccw"` is rotation in that sense. A probe's `angle` is the direction in which the shaft moves when the
reading, as displacement, increases: usually the direction of the probe as seen from the shaft (45° for the X probe 45° right
of the vertical, 135° for the Y probe 45° left of it, as in API 670). Readings in volts: a −24 V proximity probe of API 670,
whose voltage rises (gets less negative) as the shaft comes nearer, has a positive `sensitivity`; a sensor whose voltage rises
with the distance has a negative one. The two probes of an end may be at any angle of more than 10° to each other. Axial
positions count from one end of the shaft, usually the non-drive end, and the sections follow each other from there. In every
drop the shaft must come to rest at the bottom: `analyse` checks that and reports probe directions that contradict it.

## What is used where

- **analyse**: used by a plain `tdbmon analyse` (release, contacts, clearance, swing, run-down, lines) and by everything else.
- **forces**: used only when the machine is simulated: `analyse --forces`, `diagnose`, `simulate`, `identifiability`. The file
  must state the required ones in any case, but guessed values do not affect a plain analysis: those of the template suffice.
- **heading**: a name in reports.

Everything that a plain analysis needs is on drawings: shaft sections and wheels (which give mass, centre of gravity and the
share of the weight on each end), positions of bearings and probes, journal, air gap, and the touchdown bearing's catalogue
sheet. Values from the commissioning of the magnetic bearings and from the balancing sheet are needed only by the simulation.
"""

_TABLES: tuple[tuple[type[BaseModel], str, str], ...] = (
    (Machine, "Top of the file", ""),
    (Rotor, "`[rotor]`", "From the drawing of the rotor."),
    (Section, "`sections` of `[rotor]`", "Cylinders, in sequence from the end at which axial positions start."),
    (
        Disk,
        "`disks` of `[rotor]`",
        "Wheels, thrust discs, couplings: all that turns with the shaft and is not in `sections`. If a sleeve or laminations"
        " stiffen the shaft, they may be a section of greater diameter instead.",
    ),
    (
        Unbalance,
        "`unbalance` of `[rotor]`",
        "Planes of residual unbalance, from the balancing sheet. If left out, the simulated rotor has none.",
    ),
    (
        MagneticBearing,
        "`[[magnetic_bearing]]`",
        "The radial bearings during levitation: they determine position and whirl of the rotor at the release. Two are needed"
        " to simulate the machine; a plain analysis needs none.",
    ),
    (
        TouchdownBearing,
        "`[[touchdown_bearing]]`",
        "Two of them; their names are those of the machine's ends (NDE, DE).",
    ),
    (
        Balls,
        "`balls` of `[[touchdown_bearing]]`",
        "From the catalogue of the ball bearing. If it does not state the balls: makers' calculators give the ball pass"
        " frequencies of the inner and the outer race per revolution. Their sum is `count`; their difference over their"
        " sum is ball over pitch diameter times the cosine of the contact angle.",
    ),
    (
        BearingHeat,
        "`[touchdown_bearing.heat]`",
        "Optional: temperatures in the simulated drop ([the simulator](simulation.md#heat)). All dimensions from the"
        " bearing's drawing.",
    ),
    (HeatMaterial, "`race` and `ball` of `[touchdown_bearing.heat]`", ""),
    (Probe, "`[[probe]]`", "The displacement probes: four for all results, two at one end for the results of that end."),
    (
        SlowRoll,
        "`slow_roll` of `[[probe]]`",
        "Optional: run-out of the probe's track, mechanical and electrical, from a slow roll on the magnetic bearings. A"
        " plain analysis and fits subtract it from all readings by the angle of the keyphasor, which must give one pulse per"
        " revolution.",
    ),
    (SpeedSignal, "`[speed]`", "Optional; without it the keyphasor gives the speed."),
    (Keyphasor, "`[keyphasor]`", "Optional: one pulse per revolution, or the pulses of a toothed wheel."),
)

_ASK_MAKER = "housing drawing, FE model or a hammer test of the pedestal"

KEYS: dict[type[BaseModel], dict[str, Key]] = {
    Machine: {
        "name": Key("heading", "Name of the machine; drops are compared only with drops of a machine of the same name"),
        "rotation": Key("analyse", '`"ccw"`, from +*x* towards +*y*, or `"cw"`, the opposite'),
        "gravity": Key(
            "analyse",
            "Local gravity, for a horizontal shaft. For an inclined shaft its component across the shaft, 9.81 m/s² times the"
            " cosine of the inclination; less than 1 m/s² is refused: a vertical shaft does not fall onto its radial bearings",
        ),
        "mains": Key("analyse", "Mains frequency: its lines are distinguished from the rotor's"),
        "rotor": Key("analyse", "Table, below"),
        "magnetic_bearing": Key("forces", "Tables, below; two are needed to simulate the machine"),
        "touchdown_bearing": Key("analyse", "Two tables, below"),
        "probe": Key("analyse", "Tables, below; without probes only the run-down is analysed"),
        "speed": Key("analyse", "Table, below"),
        "keyphasor": Key("analyse", "Table, below"),
        "channels": Key("analyse", "Table, below: the names of the channels in the file"),
        "effect": Key("analyse", "Tables, below: known deviations from the plain machine"),
    },
    Rotor: {
        "sections": Key("analyse", "List, below; at least one"),
        "disks": Key("analyse", "List, below"),
        "unbalance": Key("forces", "List, below"),
        "elastic_modulus": Key("analyse", "Of the shaft. Steel 200 to 210 GPa"),
        "density": Key("analyse", "Of the shaft. Steel 7850 kg/m^3"),
        "poisson_ratio": Key("analyse", "Of the shaft"),
        "modal_damping_ratio": Key(
            "forces", "Of the free rotor's bending modes, from a ring test. Shafts with shrink-fitted parts: 0.002 to 0.005"
        ),
        "speed_decay_time": Key(
            "forces",
            "Time in which windage reduces the speed to 37 %, from a coast-down on the magnetic bearings. If left out: no drag."
            " The report of a plain analysis shows it beside the estimated time",
        ),
    },
    Section: {
        "length": Key("analyse", "Along the shaft"),
        "outer_diameter": Key("analyse", "Outside"),
        "inner_diameter": Key("analyse", "Bore, if any"),
    },
    Disk: {
        "name": Key("heading", "Unique; an unbalance plane at the same position may share it"),
        "position": Key("analyse", "Of its centre of gravity"),
        "mass": Key("analyse", "From the drawing, or weighed"),
        "polar_inertia": Key("analyse", "About the shaft. A plain disc: m D²/8"),
        "diametral_inertia": Key(
            "analyse", "About a diameter through its centre of gravity. A thin disc: half of the polar one"
        ),
    },
    Unbalance: {
        "name": Key("heading", "Differs from the others"),
        "position": Key("forces", "Of the plane"),
        "amount": Key(
            "forces",
            "Balancing sheet. API 617 allows 6350 W/N g mm per plane, W the static load of the journal in kg, N the maximum"
            " continuous speed in rpm. A rotor in service has rather more: give a tolerance of 50 % or more",
        ),
        "phase": Key("forces", 'From the keyphasor\'s mark; if not known: tolerance `"180 deg"`'),
    },
    MagneticBearing: {
        "name": Key("heading", "Differs from the others"),
        "position": Key("forces", "Of the actuator's middle"),
        "stiffness": Key(
            "forces",
            "Closed loop, at the rigid-body frequencies: dynamic stiffness in the commissioning report. If not given: m (2 π"
            " f)², with f the frequency of the parallel rigid mode and m this bearing's share of the rotor's mass",
        ),
        "damping": Key(
            "forces",
            "Closed loop. If not given: 2 ζ √(k m), ζ the damping ratio of the rigid modes in the commissioning report",
        ),
    },
    TouchdownBearing: {
        "name": Key("analyse", "Name of the end: `NDE`, `DE`; not `both` or `rotor`. Probes refer to it"),
        "position": Key("analyse", "Of the bearing's middle"),
        "journal_radius": Key("analyse", "Of the shaft, or of its landing sleeve, where it touches"),
        "radial_gap": Key(
            "analyse",
            "Radial air gap of shaft and inner ring (C_min of ISO 14839-2, if nothing touches earlier); half of the"
            " diametral clearance on the drawing. Usually half of the magnetic bearing's air gap (G. Schweitzer, E. H. Maslen,"
            " Magnetic Bearings, 2009, ch. 13)",
        ),
        "contact_stiffness": Key(
            "analyse",
            "K of F = K δ^(10/9), shaft on inner ring. Palmgren's δ = 3.84e-5 mm F^0.9 / l^0.8 (F in N, steel, a line contact"
            " of the length l in mm) is K = 1.3e9 for 10 mm, 2.0e9 for 16 mm, 2.7e9 for 22 mm. The [published"
            " machines](../datasets/machines) have 1.1e9 to 1.7e9 for rings 20 to 32 mm wide. Doubling it shifts the rest"
            " position by 1 µm",
            "N/m^(10/9)",
        ),
        "contact_exponent": Key(
            "analyse",
            "10/9 for a line contact; misaligned or crowned rings up to 1.5. With another exponent the force at a depth of"
            " 10 µm stays the same: `contact_stiffness` remains the K of 10/9",
        ),
        "contact_damping": Key(
            "forces",
            "α of Hunt and Crossley: restitution is about 1 − α v at an impact speed v. Published machines 0.08 s/m; steel,"
            " bronze and ivory 0.08 to 0.32 s/m (K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440)",
        ),
        "friction": Key(
            "forces",
            "Coefficient, shaft sliding on inner ring, at a load of the rotor's weight. Published machines 0.1; dry steel 0.1"
            " to 0.3",
        ),
        "friction_load_exponent": Key(
            "forces", "Friction decreases with the load to this power; between most metals 0 to 0.1"
        ),
        "inner_ring_mass": Key("forces", "Inner ring including its sleeve: π ρ (R² − r²) b"),
        "inner_ring_inertia": Key(
            "analyse",
            "Of the same about its axis: m (R² + r²)/2. It affects the swing of the shaft that rolls on the ring",
        ),
        "inner_ring_drag": Key(
            "forces",
            "Torque that brakes the inner ring. Bearing catalogues: 0.5 μ P d, μ = 0.0015 deep groove, 0.002 angular contact,"
            " P the end's share of the weight, d the bore: 24 mN m for 450 N on a bore of 70 mm. Grease or seals increase it",
        ),
        "balls": Key("analyse", "Table, below"),
        "ball_damping": Key(
            "forces",
            "Of the ball bearing, radially. 0.25e-5 to 2.5e-5 s times its stiffness (E. Krämer, Dynamics of Rotors and"
            " Foundations, 1993): some 250 to 2500 N s/m at 1e8 N/m; published machines 250 to 1000 N s/m. If it is not"
            " known, give it a tolerance: without one it is taken as exact",
        ),
        "support_mass": Key("forces", f"Mass that moves with the outer ring: housing, pedestal ({_ASK_MAKER})"),
        "support_stiffness": Key(
            "analyse",
            f"Under the outer ring, radially ({_ASK_MAKER}). Published machines 5e7 N/m (soft) to 2.7e9 N/m (stiff housing)",
        ),
        "support_damping": Key(
            "forces",
            "Under the outer ring: 2 ζ √(k m), k and m as above. Published machines have ζ = 0.004 to 0.02 on stiff housings,"
            " 0.16 on a soft damped support",
        ),
        "heat": Key("analyse", "Table, below"),
    },
    Balls: {
        "count": Key("analyse", "Balls of one row; full complement or with a cage"),
        "diameter": Key(
            "analyse", "Of a ball. If not given: 0.3 (outside diameter − bore) is usual for deep groove bearings"
        ),
        "pitch_diameter": Key("analyse", "Circle of the balls' centres. If not given: (outside diameter + bore)/2"),
        "diametral_clearance": Key(
            "analyse",
            "Radial internal clearance, mounted; negative if preloaded. ISO 5753-1 gives the classes (C3 at a bore of 65 to"
            " 80 mm: 25 to 51 µm); fits of the rings reduce it. Half of it adds to the rest position",
        ),
        "rows": Key("analyse", "2 for a pair in X or O"),
        "contact_angle": Key(
            "analyse", "0 for deep groove; catalogue (15°, 25° ...) for angular contact, held axially as a pair"
        ),
        "inner_conformity": Key("analyse", "Groove radius over ball diameter, 0.515 to 0.53"),
        "outer_conformity": Key("analyse", "The same for the outer ring"),
        "material": Key(
            "analyse",
            '`"steel"`, or `"silicon nitride"` for hybrid bearings; if `heat` is given, its materials are used',
        ),
        "stiffness": Key(
            "analyse",
            "Normally left out: Hertz's theory gives it from the numbers above (1.17e10 for a 6014 with 12.3 mm balls). If it"
            " is measured: of the balls of all rows at one azimuth, against radial displacement",
            "N/m^1.5",
        ),
    },
    BearingHeat: {
        "inner_race_radius": Key("forces", "Of the inner ring's wall where the balls run: mean of shoulder and groove"),
        "outer_race_radius": Key("forces", "The same for the outer ring"),
        "outer_radius": Key("forces", "Outside of the outer ring"),
        "housing_radius": Key("forces", "Outside of the housing"),
        "width": Key("forces", "Of all rows together"),
        "housing_width": Key("forces", "Of the housing"),
        "shaft_length": Key("forces", "Of the length of shaft that takes up heat"),
        "race": Key("analyse", "Material of rings, shaft and housing, below"),
        "ball": Key("analyse", "Material of the balls, below"),
        "load_factor": Key("forces", "f1 of Palmgren's torque; about 0.0003 to 0.001, by the bearing's kind and load"),
        "speed_factor": Key("forces", "f2 of Palmgren's torque; about 0.7 to 2 with grease or oil mist"),
        "viscosity": Key("forces", "Kinematic, of the lubricant"),
        "spin_friction": Key("forces", "Coefficient of the balls' spin on the races"),
    },
    HeatMaterial: {
        "elastic_modulus": Key("analyse", "Steel 200 to 210 GPa, silicon nitride 310 GPa"),
        "poisson_ratio": Key("analyse", "0.3, 0.26"),
        "density": Key("forces", "7800, 3200 kg/m^3"),
        "conductivity": Key("forces", "50, 35 W/(m K)"),
        "specific_heat": Key("forces", "500, 670 J/(kg K)"),
        "expansion": Key("forces", "11.8e-6, 3.2e-6 1/K"),
    },
    Probe: {
        "name": Key("analyse", "Name of the channel in the file, or as mapped in `[channels]`"),
        "end": Key("analyse", "Name of the touchdown bearing at its end"),
        "position": Key("analyse", "Of its plane. It may differ from the bearing's: readings are converted to that plane"),
        "angle": Key("analyse", "See Directions"),
        "unit": Key("analyse", 'Of the channel, if the file states no known unit: `"um"`, `"mil"`, `"V"`'),
        "sensitivity": Key(
            "analyse",
            "Needed for channels in volts: calibration sheet of the probe, 7.87 mV/um (200 mV/mil) by API 670; negative"
            " inverts",
        ),
        "offset": Key("analyse", "Voltage with the shaft in the bearing's centre"),
        "range": Key(
            "analyse",
            "`[smallest, largest]` displacement in the probe's linear range; readings beyond are reported. If left out: ± 3 gaps",
        ),
        "slow_roll": Key("analyse", "Below: its once-per-revolution (1X) reading of a slowly turning shaft"),
    },
    SlowRoll: {
        "peak_to_peak": Key("analyse", "Of the 1X reading at slow roll. API 670 allows 6 µm"),
        "phase_lag": Key(
            "analyse", "As monitors show it: angle of rotation from the keyphasor's edge to the greatest reading"
        ),
    },
    SpeedSignal: {
        "channel": Key("analyse", "Its name in the file"),
        "unit": Key("analyse", 'Of the channel, if the file states no known unit: `"rpm"`, `"Hz"`, `"rad/s"`'),
        "sensitivity": Key("analyse", 'Needed for a channel in volts: volts per speed, `"1 mV/rpm"`', "mV/rpm"),
    },
    Keyphasor: {
        "channel": Key("analyse", "Its name in the file; in volts or plain numbers"),
        "edge": Key("analyse", '`"rising"`, or `"falling"` if the mark is a groove that lowers the signal'),
        "angle": Key(
            "analyse",
            "Of the mark on the shaft at the instant of the edge, i.e. of the keyphasor probe, from +*x*. Phases of unbalance"
            " count from the mark",
        ),
        "pulses_per_revolution": Key(
            "analyse",
            "Of a toothed wheel. With more than one pulse the shaft's angle is not known: phases count from an arbitrary"
            " pulse, and the angle at the release is fitted in every drop",
        ),
    },
}

_TAIL = """
## `[channels]`

If the names in the record differ: `name in the machine file = "name in the record"`, for probes, `speed` and `keyphasor`, as
`tdbmon inspect` shows it. The group of a channel (TDMS, MDF4, HDF5, MAT) may precede its name, and must if the name occurs in
several groups. A channel with a label in the file is known by its label and by the name it is stored under (shown in brackets).

    [channels]
    NDE_A = "Ai0/Vib_X"
    speed = "Tacho"

## `[[effect]]`

Known deviations from the plain machine: an oval journal, a soft direction of a support, runout or a wrong gain of a
probe. `name` is an identifier of the [catalogue](effects.md), which also says what `where` names; the parameters follow. A plain
analysis corrects its readings for gain, angle, crosstalk and lag of probes, not for `probe_runout` (the `slow_roll` of a probe is
subtracted); the simulation includes all effects. If one is given twice at a place, or again with `--effect`, both
act: unbalances and bows add up as vectors, gains multiply. An effect that can act only once at a place is then refused.

    [[effect]]
    name = "support_anisotropy"
    where = "NDE"
    ratio = 0.73
    direction = "0 deg"
"""


def render() -> str:
    """Return the page as Markdown."""
    return _HEAD + "".join(_table(*table) for table in _TABLES) + _TAIL


def _table(part: type[BaseModel], title: str, says: str) -> str:
    rows = []
    for name, field in part.model_fields.items():
        key = field.alias or name
        told = KEYS[part][key]
        unit = told.unit or UNITS.get(part, {}).get(key, "")
        tolerance = " ±" if _takes_tolerance(field) else ""
        rows.append(f"| `{key}` | {unit}{tolerance} | {_default(field, unit)} | {told.used} | {told.says} |")
    head = "| key | unit | default | used by | what it is, and where it is found |\n|---|---|---|---|---|\n"
    return f"\n## {title}\n\n" + (f"{says}\n\n" if says else "") + head + "\n".join(rows) + "\n"


def _takes_tolerance(field: FieldInfo) -> bool:
    return field.annotation is Tolerant or Tolerant in getattr(field.annotation, "__args__", ())


def _default(field: FieldInfo, unit: str) -> str:
    if field.is_required():
        return "**required**"
    value: Any = field.get_default(call_default_factory=True)
    value = value.nominal if isinstance(value, Tolerant) else value
    if value is None or value == () or value == {}:
        return "none"
    if isinstance(value, str) or not unit:
        return f"{value:.6g}" if isinstance(value, float) else str(value)
    return f"{value / scale(unit, SI.get(unit, unit)):.6g} {unit}"


if __name__ == "__main__":
    write_text(PAGE, render())
