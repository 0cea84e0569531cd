"""Effects that a model of a dropdown may lack: their interface, and the catalogue.

An effect is one file in the folder ``effects``; the file's name is its identifier.  It holds one frozen dataclass
derived from `Effect`, whose fields are its parameters, each with unit, off value, bounds and meaning (`parameter`).
No registration is needed: the simulator, the catalogue and the tests find the file in the folder.

How an effect changes the model
    `Effect.modify`    changes the arrays of the model before the run.
    hooks              plain functions in the file, compiled into the right-hand side.  They only add, so their order
                       does not matter.  `Effect.coefficients` returns their coefficients ``p[i], p[i + 1] ...``, which are
                       all zero where the effect is not used.  ``HOOKS`` in `tdbsim.hooks` lists them.
    `Effect.sense`     changes the sensor chain (`tdbsim.sensors`), after the run.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar

from tdbsim.errors import InputError, did_you_mean
from tdbsim.machine import Machine
from tdbsim.units import is_bare, scale, to_si

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft
    from tdbsim.sensors import SensorChain


class Place(StrEnum):
    """Kind of place where an effect acts, which ``where`` must name."""

    ROTOR = "rotor"
    PLANE = "plane"
    BEARING = "bearing"
    BEARING_OR_BOTH = "bearing or both"
    PROBE = "probe"
    END = "end"


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect, in SI.

    Attributes
    ----------
    name, meaning : str
        Its name, and the meaning of value and sign.
    si, unit : str
        SI unit of the numbers here, and the unit of input and output.
    off : float or str
        Of the first parameter the value that switches the effect off (`Effect.is_off`); of the others the default.
    low, high : float
        Bounds, inclusive.
    typical : float
        A size that a good record shows; tests and score tests start there.
    whole : bool
        True for integers.
    choices : tuple of str
        The allowed words of a parameter that is not numeric.
    harmonic : int
        Of an angle: number of periods in a full turn.
    per_drop : bool
        True where it differs from drop to drop and is not measured: an angle on the inner ring or in the cage, whose angles at
        the release are arbitrary.
    held : bool
        True where a drop hardly determines it: fits keep it fixed.
    further : tuple of float
        Additional starting values of fits, which derivatives at the typical value do not lead to.
    """

    name: str
    si: str
    unit: str
    off: float | str
    low: float
    high: float
    typical: float
    meaning: str
    whole: bool = False
    choices: tuple[str, ...] = ()
    harmonic: int = 1
    per_drop: bool = False
    held: bool = False
    further: tuple[float, ...] = ()

    @property
    def goes_round(self) -> bool:
        """True for a periodic angle, whose bounds limit only the input."""
        return self.si == "rad" and self.high - self.low > 2 * math.pi - 1e-6

    def text(self, value: float | str) -> str:
        """Return a value as text, with its unit."""
        if isinstance(value, str):
            return value
        if math.isinf(value):
            return "infinite"
        number = value / scale(self.unit, self.si)
        return f"{number:.6g}" + ("" if self.unit == "1" else f" {self.unit}")

    def check(self, value: float | str, owner: str) -> None:
        """Raise InputError where a value is impossible."""
        if self.choices:
            if value not in self.choices:
                raise InputError(f"{owner}: {self.name} {value!r} is not one of {', '.join(self.choices)}")
            return
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError(f"{owner}: {self.name} {value!r} is not a number in {self.si}")
        if value == self.off:
            return
        slack = 1e-9 * max(abs(self.low), abs(self.high))  # rounding by conversion of units
        if not self.low - slack <= value <= self.high + slack:
            raise InputError(
                f"{owner}: {self.name} {self.text(value)} is out of bounds;"
                f" give {self.text(self.low)} to {self.text(self.high)}"
            )
        if self.whole and value != int(value):
            raise InputError(f"{owner}: {self.name} {value:g} is not a whole number")

    def read(self, value: Any, owner: str) -> float | str:
        """Convert input to SI, or to one of the choices."""
        if self.choices:
            return str(value).strip()
        try:
            number = to_si(value, self.si)
        except InputError as error:
            raise InputError(f"{owner}: {self.name}: {error}") from None
        if isinstance(value, str) and is_bare(value) and self.unit != "1" and 0 < abs(number) < math.inf:
            raise InputError(f'{owner}: {self.name} {value} has no unit; write e.g. "{value} {self.unit}"')
        return number


def parameter(
    unit: str,
    off: float,
    bounds: tuple[float, float],
    typical: float,
    meaning: str,
    *,
    si: str | None = None,
    whole: bool = False,
    harmonic: int = 1,
    per_drop: bool = False,
    held: bool = False,
    further: tuple[float, ...] = (),
) -> Any:
    """Declare a parameter as a dataclass field (see `Parameter`); off, bounds, typical and further are in `unit`."""
    si = unit if si is None else si
    raw = {"si": si, "unit": unit, "off": off, "bounds": bounds, "typical": typical, "meaning": meaning, "whole": whole}
    raw |= {"harmonic": harmonic, "per_drop": per_drop, "held": held, "further": further}
    return field(default=_si(off, unit, si), metadata=raw)


def choice(words: tuple[str, ...], meaning: str) -> Any:
    """Declare a parameter that is one of some words; the first is the default."""
    return field(default=words[0], metadata={"choices": words, "meaning": meaning})


def _si(value: float, unit: str, si: str) -> float:
    return float(f"{value if unit == si else value * scale(unit, si):.12g}")


@dataclass(frozen=True)
class Effect:
    """An effect with its place and parameter values in SI; each kind is a subclass.

    Attributes
    ----------
    where : str
        An end, ``both``, a plane, a probe or ``rotor``, according to the kind's `place`.
    """

    where: str

    title: ClassVar[str]  # in lower case, for use within a sentence
    what: ClassVar[str]
    place: ClassVar[Place]
    signature: ClassVar[str]
    on_the_machine: ClassVar[str]  # how to check for it on the machine without a drop
    slots: ClassVar[int] = 0  # coefficients that the compiled hooks need, per end (or for the rotor)
    most: ClassVar[int] = 1  # instances with hooks allowed at a place; more than one only with the hook ``ball``
    once: ClassVar[bool] = False  # without hooks, but a second one at its place would undo it, or not add to it
    fixed_by: ClassVar[Mapping[str, str]] = {}  # choices with which its angle is stationary, so that all drops share it
    slows: ClassVar[bool] = False  # shows in the slowing of the rotor after a drop, by its single size
    builds_up: ClassVar[bool] = False  # grows with the duration of rubbing, so it may show late
    adds_to_stated: ClassVar[bool] = False  # size and angle are added to a vector that the machine's file states there
    rise: ClassVar[float] = 1.5  # least factor by which `measure` grows from off to the typical size

    def __post_init__(self) -> None:
        for each in self.parameters():
            each.check(getattr(self, each.name), self.identifier())

    @classmethod
    def identifier(cls) -> str:
        """Return its identifier, the file's name."""
        return cls.__module__.rpartition(".")[2]

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """Return the declared parameters; the first one can switch the effect off."""
        known = _PARAMETERS.get(cls)
        if known is None:
            known = _PARAMETERS[cls] = _parameters(cls)
        return known

    @property
    def values(self) -> dict[str, float | str]:
        """Parameter values, SI, by name."""
        return {each.name: getattr(self, each.name) for each in self.parameters()}

    def __str__(self) -> str:
        """Return it in the form that `parse` reads; infinite values are defaults and omitted."""
        told = [(each, getattr(self, each.name)) for each in self.parameters()]
        values = [f"{each.name}={each.text(value)}" for each, value in told if value != math.inf]
        return f"{self.identifier()}:" + ",".join([f"where={self.where}", *values])

    @property
    def is_off(self) -> bool:
        """True where it changes nothing: the first parameter (or each size, where there are several) has its off value."""
        first = self.parameters()[0]
        return bool(getattr(self, first.name) == first.off)

    def ends(self, machine: Machine) -> tuple[int, ...]:
        """Return the indices of the ends on which it acts."""
        if self.place in (Place.BEARING, Place.BEARING_OR_BOTH, Place.END):
            return (0, 1) if self.where == "both" else (machine.ends.index(self.where),)
        return ()

    def standing_places(self, machine: Machine) -> tuple[int | str, ...]:
        """Return its single places: the indices of the ends on which it acts, or else ``where``."""
        return self.ends(machine) or (self.where,)

    @classmethod
    def stands_still(cls, values: Mapping[str, Any]) -> bool:
        """True where values, by name, have a choice with which its angle is stationary (`fixed_by`)."""
        return any(values.get(name) == word for name, word in cls.fixed_by.items())

    @classmethod
    def can_act(cls, machine: Machine) -> bool:
        """Return whether the machine has what the effect changes; if not, a model cannot lack it."""
        return True

    def check_place(self, machine: Machine) -> None:
        """Raise InputError where the machine has no such place, or no probe there to act on."""
        known = places(self.place, machine)
        if self.where not in known:
            raise InputError(
                f"{self.identifier()}: where = '{self.where}' is no {self.place} of this machine"
                f"{did_you_mean(self.where, known)}"
            )
        if self.place is Place.END and not machine.probes_at(self.where):
            raise InputError(
                f"{self.identifier()}: end '{self.where}' has no [[probe]], so it changes nothing; leave it out"
            )

    def modify(self, draft: Draft) -> None:
        """Change the model's arrays in place, before the run."""

    def reach(self, draft: Draft, end: int) -> float:
        """Return the greatest change of a distance, m, by its hooks ``gap``, ``bore`` and ``ball``; kernels skip them beyond."""
        return math.inf

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        """Return the coefficients of the compiled hooks at an end (0 or 1; for the rotor `ROTOR_ROW`)."""
        raise NotImplementedError

    def sense(self, chain: SensorChain, machine: Machine, sampling: float) -> SensorChain:
        """Return the sensor chain with this effect; `sampling` in Hz."""
        return chain

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the size of the declared signature in a simulated drop; it is greater with the effect."""
        raise NotImplementedError


_PARAMETERS: dict[type[Effect], tuple[Parameter, ...]] = {}


def _parameters(kind: type[Effect]) -> tuple[Parameter, ...]:
    found = []
    for each in fields(kind):
        data = each.metadata
        if not data:
            continue
        if "choices" in data:
            words = tuple(data["choices"])
            found.append(Parameter(each.name, "1", "1", words[0], 0.0, 0.0, 0.0, data["meaning"], choices=words))
            continue
        unit, si = data["unit"], data["si"]
        low, high = (_si(bound, unit, si) for bound in data["bounds"])
        off, typical = _si(data["off"], unit, si), _si(data["typical"], unit, si)
        kind_of = {name: data[name] for name in ("whole", "harmonic", "per_drop", "held")}
        further = tuple(_si(value, unit, si) for value in data["further"])
        found.append(
            Parameter(each.name, si, unit, off, low, high, typical, data["meaning"], further=further, **kind_of)
        )
    return tuple(found)


def planes(machine: Machine) -> dict[str, float]:
    """Return the positions of the rotor's planes by name: the wheels, then the unbalance planes; names are unique."""
    wheels = {disk.name: disk.position for disk in machine.rotor.disks}
    return wheels | {plane.name: plane.position for plane in machine.rotor.unbalance}


def places(place: Place, machine: Machine) -> tuple[str, ...]:
    """Return the values that ``where`` may have on a machine."""
    if place is Place.ROTOR:
        return ("rotor",)
    if place is Place.PLANE:
        return tuple(planes(machine))
    if place is Place.PROBE:
        return tuple(probe.name for probe in machine.probes)
    return (*machine.ends, "both") if place is Place.BEARING_OR_BOTH else machine.ends


@dataclass(frozen=True)
class EffectDeclaration:
    """Catalogue entry of an effect.

    Attributes
    ----------
    kind : type
        Its class, to be called as ``kind(where, amplitude=2e-5)``.
    module : module
        Its file.
    """

    kind: type[Effect]
    module: ModuleType

    @property
    def identifier(self) -> str:
        """Its identifier."""
        return self.kind.identifier()

    @property
    def title(self) -> str:
        """Its name within a sentence."""
        return self.kind.title

    @property
    def what(self) -> str:
        """What happens."""
        return self.kind.what

    @property
    def signature(self) -> str:
        """Its signature in a record."""
        return self.kind.signature

    @property
    def on_the_machine(self) -> str:
        """How to check for it on the machine without a drop."""
        return self.kind.on_the_machine

    @property
    def place(self) -> Place:
        """Where it acts."""
        return self.kind.place

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All declared parameters; the first one can switch it off."""
        return self.kind.parameters()

    @property
    def acts_on_sensors(self) -> bool:
        """True for an effect on the readings, not on the motion."""
        kind = self.kind
        return kind.sense is not Effect.sense and kind.modify is Effect.modify and not kind.slots

    def __reduce__(self) -> tuple[object, tuple[str]]:
        """Pickle by identifier."""
        return declaration, (self.identifier,)

    def parameter(self, name: str) -> Parameter:
        """Return a parameter by name."""
        for each in self.parameters:
            if each.name == name:
                return each
        known = [each.name for each in self.parameters]
        raise InputError(f"{self.identifier}: unknown parameter '{name}'{did_you_mean(name, known)}")

    def texts(self, values: Mapping[str, float | str]) -> list[str]:
        """Return parameter values (SI, or words) as text, each after its name."""
        return [f"{name.replace('_', ' ')} {self.parameter(name).text(value)}" for name, value in values.items()]

    def at(self, where: str, values: Mapping[str, Any]) -> Effect:
        """Return the effect at a place, with values as SI numbers or as text with a unit.

        Raises
        ------
        InputError
            If a parameter is unknown, of a wrong unit, or out of bounds.
        """
        read = {name: self.parameter(name).read(value, self.identifier) for name, value in values.items()}
        return self.kind(where, **read)

    def typical(self, where: str) -> Effect:
        """Return the effect at its typical size."""
        return self.at(where, {each.name: each.typical for each in self.parameters if not each.choices})


@cache
def catalogue() -> tuple[EffectDeclaration, ...]:
    """Return all effects, sorted by identifier: one per file in the folder ``effects``."""
    import tdbsim.effects as folder

    found = []
    for info in sorted(pkgutil.iter_modules(folder.__path__), key=lambda each: each.name):
        module = importlib.import_module(f"{folder.__name__}.{info.name}")
        found.append(EffectDeclaration(_only_kind(module), module))
    return tuple(found)


def _only_kind(module: ModuleType) -> type[Effect]:
    """Return the effect of a file (raises InputError if there is not exactly one, or it has hooks that are never called)."""
    kinds = [
        each
        for each in vars(module).values()
        if isinstance(each, type) and issubclass(each, Effect) and each.__module__ == module.__name__
    ]
    name = module.__name__.rpartition(".")[2]
    if len(kinds) != 1:
        raise InputError(f"effects/{name}.py holds {len(kinds)} effects; one file holds one")
    if kinds[0].slots and kinds[0].place in (Place.PLANE, Place.PROBE):
        raise InputError(
            f"effects/{name}.py has slots for hooks at a {kinds[0].place}, and kernels have such numbers for the ends and the"
            " rotor only; give it 'modify' or 'sense'"
        )
    return kinds[0]


def declaration(identifier: str) -> EffectDeclaration:
    """Return one effect of the catalogue.

    Raises
    ------
    InputError
        If there is none of that name; the message suggests the nearest.
    """
    known = _by_identifier()
    if identifier not in known:
        raise InputError(f"'{identifier}' is no effect{did_you_mean(identifier, list(known))}")
    return known[identifier]


@cache
def _by_identifier() -> dict[str, EffectDeclaration]:
    return {each.identifier: each for each in catalogue()}
