"""Report section: the decay of the speed, with all drag laws tried, the chosen one and its torque."""

from __future__ import annotations

from functools import partial

from tdbmon.analysis.coast_down_times import HALF, TENTH, how_told
from tdbmon.analysis.result import NO_DROP, Analysis
from tdbmon.analysis.rundown import RunDown
from tdbmon.analysis.stated_drag import against_stated, drag_on_rotor, load_torque, stated_ring_drag
from tdbmon.estimate import Estimate
from tdbmon.quantity import number, rpm, short, words
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table, sentence

_NOUGHT = 0.1  # of the interval's width: a smaller parameter has no significant digit
_NAMES = {
    "decay_time_s": "decay time",
    "constant_drag_hz_per_s": "constant drag",
    "quadratic_loss_per_revolution": "loss per revolution",
}


def section(analysis: Analysis) -> Section:
    """Return the section on the run-down."""
    title = "Decay of the speed"
    rundown = analysis.rundown
    if rundown is None:
        return Section(title, (Paragraph("The record contains neither a speed signal nor a keyphasor."),))
    if not analysis.falls:
        return Section(title, (sentence(NO_DROP),))
    rows = [
        Row(("Source of the speed", rundown.source)),
        Row(("Speed signal over keyphasor", words(rundown.pulse_ratio))),
        Row(("Speed at the release", rpm(rundown.initial))),
        Row(("Speed lost to contacts and ring spin-up beyond the drag", words(rundown.lost_speed))),
        *_spun_up(analysis, rundown),
        Row(("Decay time of the linear term", words(rundown.decay_time))),
        Row(
            (
                "Torque of the constant drag",
                words(rundown.drag_torque),
            )
        ),
        *_stated(analysis, rundown),
        Row(("Drag torque at the release", _torque(rundown))),
        *_coasted(analysis, rundown),
        Row(("Standstill, from the record's first sample", words(rundown.standstill_time))),
        Row(("Part of the record to which the laws are fitted", _stretch(rundown))),
    ]
    blocks: list[Block] = [Table(f"The run-down (95 % intervals{_REST})", ("Quantity", "Value"), tuple(rows))]
    if rundown.models:
        blocks += [Paragraph(_CHOICE), _laws(rundown)]
    if analysis.has_speed:
        from tdbmon.figures.speed_decay import speed_decay

        caption = "The speed; no law is drawn, for the reason in the table."
        alt = "Speed against time."
        if rundown.law is not None:
            caption = (
                "Above: the speed and the chosen law; below: its residual. If the law lacks a term, the residual has a trend in"
                " the fitted part, however small its rms. A scale or zero error of the speed signal appears below as an offset."
            )
            alt = "Speed against time, with the fitted law, and the residual below."
        blocks.append(Figure("speed-decay", caption, alt, partial(speed_decay, analysis)))
    return Section(title, tuple(blocks))


_REST = (
    "; constant drag: with the machine file's polar inertia, noise of the speed only"
    "; standstill: from the last certain rotation to the first certain rest, or by the law"
)
_CHOICE = (
    "The rotor slows by ω′ = −(a + ω/τ + q ω²): a is dry friction, 1/τ viscous drag and windage, q turbulent windage. Every"
    " combination of the terms is fitted to the same stretch with the same noise; a term is kept only where the criterion"
    " (BIC, lower is better) and the misfit on parts left out of the fit both require it."
)


def _coasted(analysis: Analysis, rundown: RunDown) -> list[Row]:
    """Return the times to half and to a tenth of the speed at the release, with that speed, and how they were obtained."""
    found, initial = analysis.coast_down, rundown.initial
    rows = []
    for name, share, time in (("a half", HALF, found.half), ("a tenth", TENTH, found.tenth)):
        reached = "" if initial.value is None else f" ({short(Estimate(share * initial.value, unit='Hz'))})"
        told = f"{words(time)}, {how_told(time)}" if time.known else words(time)
        rows.append(Row((f"From the release to {name} of the initial speed{reached}", told)))
    return rows


def _laws(rundown: RunDown) -> Table:
    header = ("Law", "Parameters", "Rms misfit / on parts left out", "BIC", "Verdict")
    rows, chosen = [], any(model.chosen for model in rundown.models)
    for model in rundown.models:
        written = partial(_parameter, rundown) if model.chosen else _unused
        parameters = "; ".join(
            f"{_NAMES.get(key, key)} {written(key, value) if value.known else 'negative'}"
            for key, value in model.parameters.items()
        )
        verdict = "chosen" if model.chosen else (model.refused or ("worse" if chosen else "not used"))
        cells = (
            model.name,
            parameters,
            f"{_millihertz(model.rms)} / {_millihertz(model.held_out_rms)}",
            number(model.bic, 10.0),
            verdict,
        )
        rows.append(Row(cells, "good" if model.chosen else "plain"))
    caption = (
        "Laws tried; the chosen one with 95 % intervals, which here include only the noise of the speed"
        if chosen
        else f"Laws tried; none is used: {rundown.decay_time.why}"
    )
    return Table(caption, header, tuple(rows))


def _parameter(rundown: RunDown, key: str, value: Estimate) -> str:
    """Return a parameter of the chosen law as text.

    The decay time's interval in the table above includes the model error of the law, and sets the digits.
    """
    width = rundown.decay_time.width
    if key == "decay_time_s" and width is not None:
        return f"{short(value, width)} (interval above)"
    return words(value)


def _unused(_: str, value: Estimate) -> str:
    """Return a parameter of a rejected law as text without interval: noise alone would understate its uncertainty."""
    return "zero within its noise" if abs(value.value or 0.0) < _NOUGHT * (value.width or 0.0) else short(value)


def _millihertz(value: float) -> str:
    return f"{value * 1e3:.3g} mHz" if value < 1 else f"{value:.3g} Hz"


def _torque(rundown: RunDown) -> str:
    """Return the drag torque of the chosen law at the speed of the release as text."""
    if rundown.law is None or rundown.polar_inertia is None or rundown.initial.value is None:
        return "not estimated: it needs a law and the rotor's polar inertia"
    if rundown.doubt and not rundown.lost_speed.known:
        return "not estimated: the chosen law does not hold in the first seconds"
    return f"{float(rundown.torque_at(rundown.initial.value)):.3g} N m (chosen law, polar inertia of the machine file)"


def _spun_up(analysis: Analysis, rundown: RunDown) -> list[Row]:
    """Return the speed lost to spinning up the inner rings, computed from the machine file, if the lost speed is known."""
    if rundown.initial.value is None or not rundown.lost_speed.known:
        return []
    rings = sum(bearing.inner_ring_inertia for bearing in analysis.machine.touchdown_bearings)
    taken = rundown.initial.value * rings / (rings + analysis.rotor.polar_inertia)
    return [Row(("Speed lost to spinning up the inner rings, by the machine file", short(Estimate(taken, unit="Hz"))))]


def _stated(analysis: Analysis, rundown: RunDown) -> list[Row]:
    """Return the inner rings' drag of the machine file, and the measured constant drag relative to it, if that is known."""
    if not rundown.drag_torque.known or rundown.polar_inertia is None:
        return []
    stated = stated_ring_drag(analysis.machine)
    width = None if stated.is_exact else stated.high - stated.low
    drag = short(Estimate(stated.nominal, unit="N m"), width)
    if not stated.is_exact:
        drag += " (tolerance: {} to {})".format(
            *(short(Estimate(x, unit="N m"), width) for x in (stated.low, stated.high))
        )
    whirled = any(whirl.worst is not None for whirl in analysis.whirl.values())
    on_rotor = drag_on_rotor(analysis.machine, rundown.polar_inertia)
    load = load_torque(analysis.machine, analysis.rotor)
    said = f"{drag}; the measured constant drag lies {against_stated(rundown.drag_torque, on_rotor, whirled, load)}"
    return [Row(("Drag of all inner rings, by the machine file", said))]


def _stretch(rundown: RunDown) -> str:
    if rundown.fitted_from is None or rundown.fitted_to is None:
        return "none"
    return f"{rundown.fitted_from:.3f} s to {rundown.fitted_to:.3f} s"
