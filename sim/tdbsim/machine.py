"""The machine file: data from the drawings as one TOML file, validated, in SI.

A value is a number in SI, a text with a unit, or ``{ nominal = ..., tolerance = ... }`` where it is not known exactly.  Unknown
keys, impossible dimensions and positions outside the shaft are errors that say where and what to do.
"""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from tdbsim.bearing_heat import BearingHeat
from tdbsim.errors import InputError, did_you_mean
from tdbsim.mistakes import explain
from tdbsim.plausible import check_plausible
from tdbsim.power_law import LINE_CONTACT
from tdbsim.quantity import (
    Acceleration,
    Angle,
    Density,
    Inertia,
    Length,
    Mass,
    Number,
    Part,
    Pressure,
    Sensitivity,
    Tolerant,
    TolerantAngle,
    TolerantContactDamping,
    TolerantDamping,
    TolerantLength,
    TolerantMoment,
    TolerantNumber,
    TolerantStiffness,
    TolerantTime,
    TolerantUnbalance,
    Voltage,
    quantity,
)
from tdbsim.units import si_unit_of

if TYPE_CHECKING:
    from tdbsim.hertz import BearingGeometry, Material

STANDARD_GRAVITY = 9.80665  # m/s^2
_PLACES = {"both": "both ends", "rotor": "the whole rotor"}  # of effects and findings, in addition to the file's names
_ONE_PLANE = 1e-6  # m; the same position in other units may differ by rounding
_DECIMAL_COMMA = re.compile(r"=\s*[-+]?\d+,\d")


class Section(Part):
    """A cylindrical shaft section; sections are listed from the non-drive end."""

    length: Length = Field(gt=0)
    outer_diameter: Length = Field(gt=0)
    inner_diameter: Length = Field(0.0, ge=0)

    @model_validator(mode="after")
    def _hollow(self) -> Section:
        if self.inner_diameter >= self.outer_diameter:
            raise InputError(
                f"inner diameter {self.inner_diameter * 1e3:g} mm is not smaller than outer {self.outer_diameter * 1e3:g} mm"
            )
        return self


class Disk(Part):
    """A wheel or disc: a point inertia on the shaft."""

    name: str
    position: Length
    mass: Mass = Field(gt=0)
    polar_inertia: Inertia = Field(ge=0)
    diametral_inertia: Inertia = Field(ge=0)


class Unbalance(Part):
    """An unbalance plane; the phase counts from the keyphasor mark."""

    name: str
    position: Length
    amount: TolerantUnbalance
    phase: TolerantAngle = Tolerant(nominal=0.0, low=0.0, high=0.0)


class Rotor(Part):
    """The shaft with disks and unbalance."""

    sections: tuple[Section, ...] = Field(min_length=1)
    disks: tuple[Disk, ...] = ()
    unbalance: tuple[Unbalance, ...] = ()
    elastic_modulus: Pressure = Field(gt=0)
    density: Density = Field(gt=0)
    poisson_ratio: Number = Field(0.3, gt=0, lt=0.5)
    modal_damping_ratio: Number = Field(0.0, ge=0, lt=1)
    speed_decay_time: TolerantTime | None = None

    @property
    def length(self) -> float:
        """Length of the shaft, m."""
        return math.fsum(section.length for section in self.sections)


class MagneticBearing(Part):
    """A radial magnetic bearing while it levitates: closed-loop spring and damper about the set-point."""

    name: str
    position: Length
    stiffness: TolerantStiffness
    damping: TolerantDamping


class Balls(Part):
    """The balls of a touchdown bearing, from its catalogue.

    `count` is that of one row; `inner_conformity` and `outer_conformity` are groove radius over ball diameter.  Rows with a
    `contact_angle` are axially located, like pairs in X or O arrangement, and share the radial load; the angle is taken as
    independent of load.  `diametral_clearance` is radial play at any contact angle, negative for preloaded rows.  Stiffness and
    stress follow from Hertz theory; a stated `stiffness`, of the balls of all rows at an azimuth for radial displacement,
    replaces the former.
    """

    count: int = Field(ge=3)
    diameter: Length = Field(gt=0)
    pitch_diameter: Length = Field(gt=0)
    diametral_clearance: TolerantLength
    rows: int = Field(1, ge=1)
    contact_angle: Angle = Field(0.0, ge=0, le=math.radians(60))
    inner_conformity: Number = Field(0.52, gt=0.5, lt=1)
    outer_conformity: Number = Field(0.52, gt=0.5, lt=1)
    material: Literal["steel", "silicon nitride"] = "steel"
    stated_stiffness: Annotated[float, quantity("N/m^1.5")] | None = Field(None, gt=0, alias="stiffness")

    @model_validator(mode="after")
    def _fits(self) -> Balls:
        if self.diameter * self.count > math.pi * self.pitch_diameter:
            raise InputError(
                f"{self.count} balls of {self.diameter * 1e3:g} mm do not fit on a pitch circle"
                f" of {self.pitch_diameter * 1e3:g} mm"
            )
        return self

    @property
    def play(self) -> float:
        """Free radial displacement of the inner ring, m: half of the clearance, zero where it is preloaded."""
        return max(self.diametral_clearance.nominal, 0.0) / 2

    @property
    def radial_share(self) -> float:
        """Contact load of one ball over the radial load of the balls of all rows at its azimuth."""
        return 1 / (self.rows * math.cos(self.contact_angle))

    def geometry(self, ball: Material | None = None, race: Material | None = None) -> BearingGeometry:
        """Return the contact geometry, with given materials in place of the file's."""
        from tdbsim.hertz import BEARING_STEEL, SILICON_NITRIDE, BearingGeometry

        return BearingGeometry(
            self.diameter,
            self.pitch_diameter,
            self.inner_conformity,
            self.outer_conformity,
            self.contact_angle,
            ball or {"steel": BEARING_STEEL, "silicon nitride": SILICON_NITRIDE}[self.material],
            race or BEARING_STEEL,
        )


class TouchdownBearing(Part):
    """A touchdown bearing with its support; its `name` is the name of the machine's end.

    The contact force of rotor and ring is `contact_stiffness` times the depth to the power 10/9; with another `contact_exponent`
    the force at a depth of 10 um stays the same.  `friction` is the coefficient at a load of the rotor's weight; it falls with
    the load to the power `friction_load_exponent`.
    """

    name: str
    position: Length
    journal_radius: Length = Field(gt=0)
    radial_gap: TolerantLength
    contact_stiffness: Annotated[float, quantity("N/m^(10/9)")] = Field(gt=0)
    contact_exponent: float = Field(default=LINE_CONTACT, ge=1, le=1.5)
    contact_damping: TolerantContactDamping
    friction: TolerantNumber
    friction_load_exponent: float = Field(default=0.0, ge=-0.5, le=0.5)
    inner_ring_mass: Mass = Field(gt=0)
    inner_ring_inertia: Inertia = Field(gt=0)
    inner_ring_drag: TolerantMoment
    balls: Balls
    ball_damping: TolerantDamping
    support_mass: Mass = Field(gt=0)
    support_stiffness: TolerantStiffness
    support_damping: TolerantDamping
    heat: BearingHeat | None = None

    @property
    def geometry(self) -> BearingGeometry:
        """Contact geometry of balls and races, with the materials of the heat table where there is one."""
        return self.balls.geometry() if self.heat is None else self.heat.geometry(self)

    @property
    def ball_stiffness(self) -> float:
        """Radial stiffness of the balls of all rows at an azimuth, N/m^1.5: as stated, else by Hertz theory.

        A radial displacement d compresses a ball at contact angle a by d cos(a); it carries K (d cos(a))^1.5, of which the
        part cos(a) is radial.
        """
        if self.balls.stated_stiffness is not None:
            return self.balls.stated_stiffness
        return self.balls.rows * self.geometry.stiffness * math.cos(self.balls.contact_angle) ** 2.5


class SlowRoll(Part):
    """Slow roll vector (1X) of a probe: mechanical and electrical runout of its track.

    As shown by vibration monitors: `phase_lag` is the rotation from the keyphasor's edge to the greatest reading.
    """

    peak_to_peak: Length = Field(gt=0)
    phase_lag: Angle = 0.0


class Probe(Part):
    """A displacement probe: its reading increases when the shaft moves along its axis, at `angle` from +x towards +y.

    Records in volts need `sensitivity` (a negative one inverts); `offset` is the voltage at the bearing's centre.  `unit` is the
    channel's unit where the record states no known one.
    """

    name: str
    end: str
    position: Length
    angle: Angle
    unit: str | None = None
    sensitivity: Sensitivity | None = None
    offset: Voltage = 0.0
    range: tuple[Length, Length] | None = None
    slow_roll: SlowRoll | None = None

    @model_validator(mode="after")
    def _usable(self) -> Probe:
        if self.unit is not None and (si_unit_of(self.unit) or ("", 1.0))[0] not in ("m", "V"):
            raise InputError(f"unit '{self.unit}' is neither a length nor a voltage; write e.g. unit = \"um\"")
        if self.sensitivity == 0:
            raise InputError('sensitivity 0 V/m gives no displacement; write e.g. "7.87 mV/um"')
        if self.range is not None and self.range[0] >= self.range[1]:
            raise InputError("range must be [smallest, largest] displacement")
        return self


class SpeedSignal(Part):
    """The channel of the speed signal; `unit` is used where the record states no known one."""

    channel: str
    unit: str | None = None
    sensitivity: Annotated[float, quantity("V s")] | None = None  # volts per Hz

    @model_validator(mode="after")
    def _usable(self) -> SpeedSignal:
        if self.unit is not None and (si_unit_of(self.unit) or ("", 1.0))[0] not in ("Hz", "V"):
            raise InputError(f"unit '{self.unit}' is neither a speed nor a voltage; write e.g. unit = \"rpm\"")
        if self.sensitivity == 0:
            raise InputError('sensitivity 0 V s gives no speed; write e.g. "1 mV/rpm"')
        return self


class Keyphasor(Part):
    """The channel of one pulse per revolution, whose edge marks shaft angle `angle`, or of several, as from a toothed wheel."""

    channel: str
    edge: Literal["rising", "falling"] = "rising"
    angle: Angle = 0.0
    pulses_per_revolution: int = Field(1, ge=1)


class EffectSetting(BaseModel):
    """An effect of the machine: identifier, place, and parameters as written."""

    model_config = ConfigDict(frozen=True, extra="allow")

    name: str
    where: str

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters as written, by name."""
        return dict(self.model_extra or {})


class Machine(Part):
    """A rotor with its magnetic and touchdown bearings and its sensors."""

    name: str
    rotation: Literal["ccw", "cw"] = "ccw"
    gravity: Acceleration = STANDARD_GRAVITY
    mains: Annotated[float, quantity("Hz")] = 50.0
    rotor: Rotor
    magnetic_bearings: tuple[MagneticBearing, ...] = Field((), alias="magnetic_bearing")
    touchdown_bearings: tuple[TouchdownBearing, ...] = Field(alias="touchdown_bearing")
    probes: tuple[Probe, ...] = Field((), alias="probe")
    speed: SpeedSignal | None = None
    keyphasor: Keyphasor | None = None
    channels: dict[str, str] = Field(default_factory=dict)
    effects: tuple[EffectSetting, ...] = Field((), alias="effect")

    @model_validator(mode="after")
    def _consistent(self) -> Machine:
        if len(self.touchdown_bearings) != 2:
            raise InputError(
                f"{len(self.touchdown_bearings)} [[touchdown_bearing]] given; a rotor drops onto two, one at each end"
            )
        for kind, parts in (
            ("magnetic_bearing", self.magnetic_bearings),
            ("touchdown_bearing", self.touchdown_bearings),
            ("probe", self.probes),
            ("disks", self.rotor.disks),
            ("unbalance", self.rotor.unbalance),
        ):
            names = [part.name for part in parts]
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise InputError(f"{kind} '{twice[0]}' is given twice; names must differ")
            for part in parts:
                if not 0 <= part.position <= self.rotor.length:
                    raise InputError(
                        f"{kind} '{part.name}': position {part.position * 1e3:g} mm lies outside the shaft"
                        f" (0 to {self.rotor.length * 1e3:g} mm); check its unit"
                    )
        if self.touchdown_bearings[0].position == self.touchdown_bearings[1].position:
            raise InputError("both touchdown bearings have the same position")
        self._check_names()
        check_plausible(self)
        self._check_probes()
        known = self.channel_names()
        for name in self.channels:
            if name not in known:
                raise InputError(f"[channels] '{name}' is no probe, 'speed' or 'keyphasor'{did_you_mean(name, known)}")
        return self

    def _check_names(self) -> None:
        for end in self.ends:
            if end.casefold() in _PLACES:
                raise InputError(
                    f"touchdown_bearing '{end}': as the name of a place this word means {_PLACES[end.casefold()]}; give the"
                    ' bearing another name, e.g. "NDE"'
                )
        planes = {plane.name: plane.position for plane in self.rotor.unbalance}
        for disk in self.rotor.disks:
            position = planes.get(disk.name, disk.position)
            if abs(position - disk.position) > _ONE_PLANE:
                raise InputError(
                    f"'{disk.name}' is a disk at {disk.position * 1e3:g} mm and an unbalance plane at {position * 1e3:g} mm,"
                    " so the place of effects there is ambiguous; rename one of them, or correct its position"
                )

    def _check_probes(self) -> None:
        for probe in self.probes:
            if probe.end not in self.ends:
                raise InputError(
                    f"probe '{probe.name}': end '{probe.end}' is no touchdown bearing{did_you_mean(probe.end, self.ends)}"
                )
        for end in self.ends:
            angles = [probe.angle for probe in self.probes if probe.end == end]
            if len(angles) >= 2 and max(abs(math.sin(a - angles[0])) for a in angles[1:]) < math.sin(math.radians(10)):
                raise InputError(
                    f"probes of end '{end}' are parallel to within 10 deg; two directions are needed to see the orbit:"
                    " check their angles"
                )
        for probe in self.probes:
            if probe.slow_roll is not None and (self.keyphasor is None or self.keyphasor.pulses_per_revolution > 1):
                raise InputError(
                    f"probe '{probe.name}': the phase of slow_roll needs a keyphasor with one pulse per revolution, and"
                    f" {'there is no [keyphasor]' if self.keyphasor is None else 'this one has several'}; leave slow_roll out"
                )

    @property
    def ends(self) -> tuple[str, ...]:
        """Names of the touchdown bearings, as in the file."""
        return tuple(bearing.name for bearing in self.touchdown_bearings)

    @property
    def has_heat(self) -> bool:
        """True where a touchdown bearing has a heat table."""
        return any(bearing.heat is not None for bearing in self.touchdown_bearings)

    def bearing(self, end: str) -> TouchdownBearing:
        """Return the touchdown bearing of an end."""
        for bearing in self.touchdown_bearings:
            if bearing.name == end:
                return bearing
        raise InputError(f"'{end}' is no touchdown bearing{did_you_mean(end, self.ends)}")

    def probes_at(self, end: str) -> tuple[Probe, ...]:
        """Return the probes of an end."""
        return tuple(probe for probe in self.probes if probe.end == end)

    def channel_names(self) -> tuple[str, ...]:
        """Channel names allowed in the [channels] table."""
        extra = (["speed"] if self.speed else []) + (["keyphasor"] if self.keyphasor else [])
        return (*(probe.name for probe in self.probes), *extra)

    def channel_in_file(self, name: str) -> str:
        """Return the file's name of a probe, of ``speed`` or of ``keyphasor``."""
        if name in self.channels:
            return self.channels[name]
        if name == "speed" and self.speed:
            return self.speed.channel
        if name == "keyphasor" and self.keyphasor:
            return self.keyphasor.channel
        return name

    @property
    def sense(self) -> int:
        """+1 where the rotor turns counter-clockwise (from +x towards +y), -1 where clockwise."""
        return 1 if self.rotation == "ccw" else -1


def load_machine(path: str | Path) -> Machine:
    """Read and validate a machine file.

    Raises
    ------
    InputError
        With the file, the place in it, what is wrong and what to do.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
        data = tomllib.loads(text)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; give the machine's TOML file") from None
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder; give the machine's TOML file") from None
    except UnicodeDecodeError:
        raise InputError(
            f"{path}: is not a text file in UTF-8; give the machine's TOML file, which comes before the records, or save it as"
            " UTF-8"
        ) from None
    except tomllib.TOMLDecodeError as error:
        cure = "" if path.suffix == ".toml" else "; give the machine's TOML file, which comes before the records"
        if _DECIMAL_COMMA.search(text):
            cure += "; a number has a decimal point, not a comma"
        raise InputError(f"{path}: is not valid TOML: {error}{cure}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    return parse_machine(data, str(path))


def parse_machine(data: dict[str, Any], source: str = "machine") -> Machine:
    """Validate a machine given as the dictionary of its TOML file (see `load_machine`)."""
    from tdbsim.stated_effects import all_effects  # here, since it imports this module

    try:
        machine = Machine.model_validate(data)
        all_effects(machine)
    except ValidationError as error:
        raise InputError(f"{source}: {explain(error, data, Machine)}") from None
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
    return machine
