"""Run-down of a rotor after a dropdown: drag law, decay time, and time of standstill, fitted to the speed.

The first stretch after the release is excluded, as contacts and spin-up of the inner rings brake the rotor there.  Near
standstill the last stretch is excluded if dry friction is no longer constant.  Both limits are found from the data: the
fitted stretch is extended step by step until the next step would need an offset or a slope of its own.
Candidate laws (see `drag_law`) are nested; one is preferred for a better BIC on whitened residuals together with a smaller
cross-validation error (see `law_choice`).

No law is exact, and the residuals need not show its model error: bearing drag that varies in proportion to the speed is
indistinguishable from the linear term.  The interval of the decay time includes that, and the range of richer laws.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from tdbsim.errors import InputError

from tdbmon.analysis.autoregression import Noise
from tdbmon.analysis.coast_down_times import CoastDownTimes, coast_down_times
from tdbmon.analysis.decay_time import decay_time_of, richer_than, widened_by_law
from tdbmon.analysis.drag_law import Coast, DragLaw, LawFit
from tdbmon.analysis.law_choice import FEWEST, NO_LAW, Candidate, choose_law, find_stretch, misfit_of, noise_in
from tdbmon.analysis.lost_speed import gained_in, lost_to_law, lost_to_level
from tdbmon.analysis.observed_speed import Observed, between, from_pulses, from_signal, tick_of
from tdbmon.analysis.slip import FALLING, coasting, is_short, slip_in
from tdbmon.analysis.speed_at_release import AGE, levitated_law, speed_at_release
from tdbmon.analysis.speed_model import SpeedModel, speed_model, term_of
from tdbmon.analysis.standstill import stop_seen, stop_time
from tdbmon.analysis.unbroken import without_holes
from tdbmon.estimate import Z95, Estimate
from tdbmon.record.keyphasor import Pulses

_TELLING = 0.5  # share of the total drag: an upper limit of the constant part above it carries no information
_TURNS_HZ = 1.0  # a steady reading below is not taken for rotation, and no lost speed is computed from it
_PLAINLY = 1e-3  # apparent gain of speed, relative to that at the release, above which a drive is suspected
_BY_INERTIA = (
    ", times 2π and the polar inertia of the machine file; the interval includes only the noise of the speed, no error of"
    " that inertia or of the law"
)


@dataclass(frozen=True, kw_only=True)
class RunDown:
    """Results of the run-down after a drop.

    Attributes
    ----------
    initial : Estimate
        Speed at the release, or at the end of a record without a drop, Hz.
    lost_speed : Estimate
        Speed lost to contacts and ring spin-up beyond the fitted drag, Hz.
    decay_time : Estimate
        Time constant of the chosen law's linear term, s; its interval is wider than that of the fitted parameter by the
        possible model error.
    drag_torque : Estimate
        Torque of the constant drag, N m, with the polar inertia as given; its interval covers only the noise of the speed.
    standstill_time : Estimate
        From the record's first sample, s.
    coast_down : CoastDownTimes
        Times at which the speed has fallen to a half and to a tenth.
    models : tuple of SpeedModel
        All candidates; empty if there is no run-down.
    fitted_from, fitted_to : float or None
        Limits of the stretch to which the laws are fitted, s.
    source : str
        Signal from which the speed was taken.
    pulse_ratio : Estimate
        Revolutions in the speed signal over revolutions counted by the pulses.
    law : DragLaw or None
        The chosen law; `speed_at` and `torque_at` evaluate it.
    polar_inertia : float or None
        kg m^2.
    doubt : str
        Behaviour that no coasting rotor shows, so that a drive may be braking; empty if there is none.
    """

    initial: Estimate
    lost_speed: Estimate
    decay_time: Estimate
    drag_torque: Estimate
    standstill_time: Estimate
    coast_down: CoastDownTimes
    models: tuple[SpeedModel, ...]
    fitted_from: float | None
    fitted_to: float | None
    source: str
    pulse_ratio: Estimate
    law: DragLaw | None
    polar_inertia: float | None
    doubt: str = ""

    @classmethod
    def missing(
        cls,
        why: str,
        *,
        initial: Estimate,
        source: str,
        pulse_ratio: Estimate,
        polar_inertia: float | None = None,
        lost_speed: Estimate | None = None,
        models: tuple[SpeedModel, ...] = (),
    ) -> RunDown:
        """Return a run-down of which at most the initial and the lost speed are known, for the reason `why`."""
        hz, s, torque = (Estimate.missing(unit, why) for unit in ("Hz", "s", "N m"))
        return cls(
            initial=initial,
            lost_speed=lost_speed or hz,
            decay_time=s,
            drag_torque=torque,
            standstill_time=s,
            coast_down=CoastDownTimes.missing(why),
            models=models,
            fitted_from=None,
            fitted_to=None,
            source=source,
            pulse_ratio=pulse_ratio,
            law=None,
            polar_inertia=polar_inertia,
        )

    def speed_at(self, time: np.ndarray | float) -> np.ndarray:
        """Return the speed by the chosen law, Hz, at times of any shape, s; extrapolated outside `fitted_from` to `fitted_to`.

        Raises
        ------
        InputError
            If no law was fitted.
        """
        return self._law().speed_at(time)

    def torque_at(self, speed: np.ndarray | float) -> np.ndarray:
        """Return the drag torque by the chosen law, N m, at speeds of any shape, Hz: 2π I_p (a + ω/τ + q ω²).

        Raises
        ------
        InputError
            If no law was fitted or the polar inertia is unknown.
        """
        if self.polar_inertia is None:
            raise InputError("the drag torque needs the rotor's polar inertia; give it in kg m^2")
        return 2 * np.pi * self.polar_inertia * self._law().deceleration(speed)

    def _law(self) -> DragLaw:
        if self.law is None:
            raise InputError(f"no law was fitted to the speed: {self.decay_time.why}")
        return self.law


def fit_rundown(
    time: np.ndarray,
    speed: np.ndarray | None,
    *,
    release_time: float,
    polar_inertia: float | None,
    pulses: Pulses | None = None,
    held: float = 0.0,
) -> RunDown:
    """Fit the run-down of a rotor from the release on.

    Parameters
    ----------
    time : ndarray (n,)
        Uniformly sampled, s.
    speed : ndarray (n,) or None
        Speed signal, Hz; NaN where missing.  None if there is only a keyphasor.
    release_time : float
        s.
    polar_inertia : float or None
        kg m^2.
    pulses : Pulses, optional
        Of the keyphasor, with the revolutions counted.  They calibrate the speed signal, or are used alone.
    held : float, optional
        Largest age of the speed signal's values at their time stamps, s.

    Returns
    -------
    RunDown
        With missing estimates and their reason if the record shows no run-down.

    Raises
    ------
    InputError
        If the data are inconsistent: lengths differ, times do not increase, neither speed nor pulses are given, the release
        lies outside the record, or the polar inertia is not positive.
    """
    time = np.asarray(time, dtype=float)
    signal = None if speed is None else np.asarray(speed)
    _check(time, signal, pulses, release_time, polar_inertia)
    turns = None if pulses is None else without_holes(between(pulses), time)
    if signal is not None:
        observed = from_signal(time, signal, turns, release_time, held)
    elif turns is not None:
        observed = from_pulses(turns, time, release_time, tick_of(pulses, time))
    else:
        raise InputError("neither a speed signal nor keyphasor pulses are given; the run-down needs one of them")
    return _delayed(_run(observed, float(time[-1]), release_time, polar_inertia), observed.delay)


def speed_alone(time: np.ndarray, speed: np.ndarray | None, *, pulses: Pulses | None, held: float, why: str) -> RunDown:
    """Return the speed at the end of a record without a drop; the rest is missing for the reason `why`.

    Parameters
    ----------
    time, speed, pulses, held
        As in `fit_rundown`.
    why : str
    """
    found = fit_rundown(time, speed, release_time=float(time[-2]), polar_inertia=None, pulses=pulses, held=held)
    initial = (
        replace(found.initial, method=f"{found.source}, at the end of the record") if found.initial.known else found.initial
    )
    return RunDown.missing(why, initial=initial, source=found.source, pulse_ratio=found.pulse_ratio)


def _run(observed: Observed, last: float, release: float, polar_inertia: float | None) -> RunDown:
    """Return the run-down from the measured speed of a record that ends at `last`, s."""
    lead, after, rest = observed.lead, observed.after, observed.rest
    source, ratio = observed.source, observed.ratio
    before: LawFit | None = None

    def without(why: str, models: tuple[SpeedModel, ...] = (), level: LawFit | None = None) -> RunDown:
        levitated = before or levitated_law(lead, release, None)
        initial = speed_at_release(levitated, lead, release, source, None, _unsure(observed, levitated), observed.delay)
        return RunDown.missing(
            why,
            initial=initial,
            source=source,
            pulse_ratio=ratio,
            polar_inertia=polar_inertia,
            lost_speed=None if level is None else lost_to_level(initial, level, release),
            models=models,
        )

    if len(after) < FEWEST:
        return without(f"{len(after)} usable mean values of the speed after the release; {FEWEST} are needed")
    scatter = float(np.std(np.diff(after.mean)))
    head = float(np.median(after.mean[:FEWEST]))
    if head <= max(6 * scatter, 0.0) / np.sqrt(FEWEST):
        return without(f"the speed after the release is {head:.3g} Hz: the rotor does not turn forward in this record")
    stretch = find_stretch(after, release, rest.lost_from)
    if stretch is None:
        return without("too few mean values of the speed before standstill")
    reached = bool(stretch.end[-1] >= min(rest.turning_until, after.end[-1]) - 1e-9)
    if reached:  # a law with constant drag holds down to zero, as the rotor comes to rest
        stretch = replace(stretch, offset_sigma=rest.level_sigma)
    noise = noise_in(stretch)
    # the run-down determines the autocorrelation of the noise better than the few samples of levitation
    share = 1.0 if lead.pulsed or not len(lead) else float(np.sqrt(_span(stretch) / _span(lead)))
    before = levitated_law(lead, release, Noise(np.empty(0), noise.slow * share))
    candidates, chosen = choose_law(stretch, noise)
    plain = next(c for c in candidates if c.name == "exponential").fit
    slope, error = -plain.law.linear * plain.law.speed, plain.sigma("linear") * plain.law.speed
    if chosen is None or plain.law.linear < FALLING * plain.sigma("linear"):
        why = f"the speed does not fall after the contacts: it changes by {slope:.3g} ± {Z95 * error:.2g} Hz/s"
        return without(why, level=plain if plain.law.speed > _TURNS_HZ else None)
    fit = chosen.fit
    models = tuple(speed_model(c, c is chosen) for c in candidates)
    levitated = coasting(stretch, before)
    slip = slip_in(stretch, fit, levitated) if levitated else ""
    misfit = misfit_of(chosen, candidates, stretch)
    if slip or misfit:
        if not slip:
            before = None  # without a law the noise is estimated from the levitated stretch itself
        run = without(slip or NO_LAW, tuple(replace(m, chosen=False) for m in models))
        return run if slip else _seen(run, observed, release, last, misfit)
    initial = speed_at_release(before, lead, release, source, Z95, _unsure(observed, before), observed.delay)
    decay = decay_time_of(chosen, levitated, stretch)
    # reason why the law must not be extrapolated
    slips = decay.why if levitated is None and is_short(stretch) else ""
    hidden = slips if reached else "the fitted law does not hold down to the lowest measured speed"
    lost = lost_to_law(initial, fit, release, decay, stretch)
    gained = gained_in(lost, float(stretch.begin[0]))
    # if rings may still slip, the law already contains part of the speed lost to them
    untold = gained or slips
    return RunDown(
        initial=initial,
        lost_speed=Estimate.missing("Hz", untold) if untold else lost,
        decay_time=widened_by_law(decay, candidates, chosen, stretch),
        drag_torque=_torque(candidates, chosen, polar_inertia),
        standstill_time=stop_time(fit, rest, reached, last, release),
        coast_down=coast_down_times(
            initial, observed, [chosen.fit, *richer_than(candidates, chosen)], hidden, release, last
        ),
        models=models,
        fitted_from=float(stretch.begin[0]),
        fitted_to=float(stretch.end[-1]),
        source=source,
        pulse_ratio=ratio,
        law=fit.law,
        polar_inertia=polar_inertia,
        # a smaller gain is a model error of the law rather than a drive
        doubt=gained if -float(lost.high or 0.0) > _PLAINLY * float(initial.value or 0.0) else "",
    )


def _seen(run: RunDown, observed: Observed, release: float, last: float, misfit: str) -> RunDown:
    """Return a run-down that no law fits, completed by the measured times of half and a tenth of the speed and of standstill."""
    return replace(
        run,
        standstill_time=stop_seen(observed.rest, NO_LAW),
        coast_down=coast_down_times(run.initial, observed, (), NO_LAW, release, last),
        doubt=misfit,
    )


def _delayed(run: RunDown, delay: float) -> RunDown:
    """Widen the intervals of a run-down by the timing error of the speed signal, `delay` either way, s."""
    if not delay:
        return run
    slowing = 0.0 if run.law is None else float(run.law.deceleration(run.law.speed))
    times = run.coast_down
    return replace(
        run,
        lost_speed=run.lost_speed.widened(delay * slowing, AGE),
        standstill_time=run.standstill_time.widened(delay, AGE),
        coast_down=replace(times, half=times.half.widened(delay, AGE), tenth=times.tenth.widened(delay, AGE)),
    )


def _unsure(observed: Observed, levitated: LawFit | None) -> float:
    """Return the relative half-width of the speed at the release that is not due to noise.

    If a revolution lasts nearly a whole number of samples, the rounding of the pulse times is not random but may drift by up to
    one `tick` over the pulse train.
    """
    if levitated is None:
        return 0.0
    return float(np.hypot(observed.tick / (observed.lead.end[-1] - levitated.law.start), observed.scale_half))


def _span(coast: Coast) -> float:
    """Return the usual duration of the spans over which the speed is averaged, s."""
    return float(np.median(coast.end - coast.begin))


def _torque(candidates: list[Candidate], chosen: Candidate, polar_inertia: float | None) -> Estimate:
    """Return the torque of the constant drag, N m; if the law has none, missing with its upper confidence limit."""
    if polar_inertia is None:
        return Estimate.missing("N m", "the rotor's polar inertia is not known")
    factor = 2 * np.pi * polar_inertia
    if "constant" in chosen.fit.terms:
        torque = term_of(chosen, "constant", lambda a: factor * a, "N m")
        return replace(torque, method=f"{torque.method}{_BY_INERTIA}") if torque.known else torque
    wider = {*chosen.fit.terms, "constant"}
    fit = next(c.fit for c in candidates if set(c.fit.terms) == wider)
    most = factor * (max(fit.law.constant, 0.0) + 1.645 * fit.sigma("constant"))
    whole = factor * float(chosen.fit.law.deceleration(chosen.fit.law.speed))
    if most > _TELLING * whole:
        why = (
            f"no constant drag is seen; in so short a run-down it could not be separated from the total drag of {whole:.2g} N m"
        )
        return Estimate.missing("N m", why)
    return Estimate.missing("N m", f"no constant drag is seen; with 95 % confidence it is below {most:.2g} N m")


def _check(
    time: np.ndarray,
    speed: np.ndarray | None,
    pulses: Pulses | None,
    release: float,
    polar_inertia: float | None,
) -> None:
    if time.ndim != 1 or len(time) < 2 or not np.all(np.diff(time) > 0):
        raise InputError("the times of the speed signal do not increase from sample to sample; give them in s, in order")
    if speed is not None and speed.shape != time.shape:
        raise InputError(f"{speed.size} values of speed for {time.size} times; give one speed per sample")
    if pulses is not None and not np.all(np.diff(pulses.times) > 0):
        raise InputError("the pulse times do not increase from pulse to pulse; give them in s, in order")
    if not time[0] <= release < time[-1]:
        raise InputError(f"the release at {release:g} s lies outside the record ({time[0]:g} to {time[-1]:g} s)")
    if polar_inertia is not None and not polar_inertia > 0:
        raise InputError(
            f"polar inertia {polar_inertia:g} kg m^2 is not positive; compute it from the rotor's sections"
        )
