"""Drag law of a coasting rotor, and its least-squares fit to a stretch of record.

ω' = −(a + b ω + q ω²) with ω in Hz: a is dry friction (Coulomb), b = 1/τ viscous drag and windage, q turbulent windage.
With ω = x/y it is the linear system x' = −(b/2) x − a y, y' = q x + (b/2) y, whose matrix squares to (b²/4 − a q) times
unity; its exponential is therefore a (hyperbolic) sine and cosine, and one formula serves for every set of terms
(Riccati's equation; e.g. W. T. Reid, Riccati Differential Equations, 1972, ch. 1).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tdbmon.analysis.autoregression import Noise

TERMS = ("linear", "constant", "quadratic")
_NODE = 0.5 / np.sqrt(3.0)  # two-point Gauss-Legendre quadrature: the error over a span h is of order (b h)^4


def slowing_time(rows: np.ndarray, slower: np.ndarray | float) -> np.ndarray:
    """Return the time, s, in which laws (n, 4) of speed, linear, constant and quadratic term slow a rotor to a lower speed, Hz.

    With z = (ω₀ − ω₁)/(a + b (ω₀ + ω₁)/2 + q ω₀ ω₁) and r² = b²/4 − a q it is artanh(r z)/r, or arctan for negative r²;
    infinite if the drag vanishes before that speed.
    """
    speed, linear, constant, quadratic = rows.T
    root2 = 0.25 * linear**2 - constant * quadratic
    root = np.sqrt(np.maximum(np.abs(root2), 1e-18))
    fall = speed - slower
    reach = constant + 0.5 * linear * (speed + slower) + quadratic * speed * slower
    share = root * fall / np.maximum(reach, 1e-200)
    bounded = np.minimum(share, 1 - 1e-16)
    time = np.where(root2 < 0, np.arctan2(root * fall, reach), np.arctanh(bounded)) / root
    drag = constant + slower * (linear + quadratic * slower)
    never = (drag <= 0) | ((root2 >= 0) & (share >= 1))
    return np.where(never, np.inf, time)


@dataclass(frozen=True)
class DragLaw:
    """Speed of a coasting rotor, on which only drag acts.

    Attributes
    ----------
    start : float
        Time at which the speed is `speed`, s.
    speed : float
        Hz, positive.
    linear, constant, quadratic : float
        b in 1/s, a in Hz/s, q dimensionless (fraction of the speed lost per revolution).
    """

    start: float
    speed: float
    linear: float = 0.0
    constant: float = 0.0
    quadratic: float = 0.0

    @property
    def standstill(self) -> float:
        """Time at which the rotor stops, s; infinite if the law has no constant drag."""
        return self.slowed_to(0.0) if self.constant > 0 else float("inf")

    def slowed_to(self, slower: float) -> float:
        """Return the time, s, at which the speed has fallen to a lower one, Hz; infinite if it never does."""
        row = np.array([[self.speed, self.linear, self.constant, self.quadratic]])
        return self.start + float(slowing_time(row, slower)[0])

    def speed_at(self, time: np.ndarray | float) -> np.ndarray:
        """Return the speed, Hz, at times of any shape, s; zero after standstill."""
        t = np.asarray(time, dtype=float) - self.start
        root2 = 0.25 * self.linear**2 - self.constant * self.quadratic
        root = np.sqrt(abs(root2))
        far = float(np.abs(t).max()) if t.size else 0.0
        if root * far < 1e-7:
            cosine, sine = np.ones_like(t), t
        elif root2 < 0:
            cosine, sine = np.cos(root * t), np.sin(root * t) / root
        else:  # both scaled by exp(-|root t|) to avoid overflow: only their ratio counts
            fade = np.exp(-2 * root * np.abs(t))
            cosine, sine = 0.5 * (1 + fade), 0.5 * np.sign(t) * (1 - fade) / root
        half = 0.5 * self.linear * sine
        over = self.speed * (cosine - half) - self.constant * sine
        under = cosine + half + self.quadratic * self.speed * sine
        moving = np.maximum(over, 0.0) / np.maximum(under, 1e-4)  # bounded if the law drives the rotor
        return moving if root2 >= 0 else np.where(time < self.standstill, moving, 0.0)  # the sine turns positive again

    def mean_between(self, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Return the mean speed, Hz, over spans of time (n,), s."""
        middle, reach = 0.5 * (begin + end), _NODE * (end - begin)
        both = self.speed_at(np.concatenate([middle - reach, middle + reach]))
        return 0.5 * (both[: len(middle)] + both[len(middle) :])

    def sensitivity(self, begin: np.ndarray, end: np.ndarray, terms: tuple[str, ...]) -> np.ndarray:
        """Return derivatives (n, k) of the mean speed over spans (n,) by the speed at `start` (= begin[0]) and the terms.

        From ω' = −f(ω): ∂ω/∂ω₀ = f(ω)/f(ω₀) and ∂ω/∂p = −f(ω) ∫ (∂f/∂p)/f dt, by the trapezoidal rule over successive spans.
        """
        middle = 0.5 * (begin + end)
        speed = self.speed_at(np.append(self.start, middle))
        drag = self.deceleration(speed)
        drag = np.where(np.abs(drag) > 1e-30, drag, 1e-30)
        turning = (speed[1:] > 0).astype(float)
        columns = [turning * drag[1:] / drag[0]]
        half = 0.5 * np.diff(np.append(self.start, middle))
        for term in terms:
            rate = speed ** {"constant": 0, "linear": 1, "quadratic": 2}[term] / drag
            columns.append(-turning * drag[1:] * np.cumsum((rate[1:] + rate[:-1]) * half))
        return np.column_stack(columns)

    def deceleration(self, speed: np.ndarray | float) -> np.ndarray:
        """Return the deceleration, Hz/s, at speeds of any shape, Hz."""
        w = np.asarray(speed, dtype=float)
        return self.constant + self.linear * w + self.quadratic * w**2


@dataclass(frozen=True)
class Coast:
    """Mean speeds over successive spans of time: averaged blocks of a speed signal, or revolutions between pulses.

    Attributes
    ----------
    begin, end : ndarray (n,)
        Spans, s.
    mean : ndarray (n,)
        Mean speed over them, Hz.
    pulsed : bool
        True if revolutions are timed by pulses: then the errors are those of the pulse times, and do not accumulate.
    offset_sigma : float
        Standard deviation of the zero offset of a speed signal, Hz, as determined from the rotor at rest.
    """

    begin: np.ndarray
    end: np.ndarray
    mean: np.ndarray
    pulsed: bool = False
    offset_sigma: float = 0.0

    @property
    def middle(self) -> np.ndarray:
        """Middle of the spans, s."""
        return 0.5 * (self.begin + self.end)

    def at(self, some: np.ndarray | slice) -> Coast:
        """Return the selected spans."""
        return replace(self, begin=self.begin[some], end=self.end[some], mean=self.mean[some])

    def between(self, low: float, high: float) -> Coast:
        """Return the spans that lie entirely between two times, s."""
        return self.at((self.begin >= low - 1e-9) & (self.end <= high + 1e-9))

    def grouped(self, size: int) -> Coast:
        """Return means over groups of `size` successive spans, without an incomplete group at the end."""
        whole = len(self) // size * size
        first, last = slice(0, whole, size), slice(size - 1, whole, size)
        mean = self.mean[:whole].reshape(-1, size).mean(axis=1)
        return replace(self, begin=self.begin[first], end=self.end[last], mean=mean)

    def __len__(self) -> int:
        return len(self.mean)

    def measured(self, mean: np.ndarray) -> np.ndarray:
        """Convert a change of mean speed (n, ...), Hz, to one of the measured quantity: speed, Hz, or pulse times, s."""
        if not self.pulsed:
            return mean
        span, weight = self.end - self.begin, 1 / self.mean
        if mean.ndim == 2:
            span, weight = span[:, None], weight[:, None]
        return np.cumsum(mean * span, axis=0) * weight

    def zero(self) -> np.ndarray | None:
        """Return the derivative of the measured quantity by its zero (first pulse, or offset); None if that is known."""
        if self.pulsed:
            return 1.0 / self.mean
        return np.full(len(self), self.offset_sigma) if self.offset_sigma else None


@dataclass(frozen=True)
class LawFit:
    """Drag law with a given set of terms, fitted to a coast-down.

    Attributes
    ----------
    law : DragLaw
        The fitted law; a coefficient may have come out negative.
    terms : tuple of str
        Which of `TERMS` were free.
    covariance : ndarray (k, k)
        Of the speed at `law.start` and the terms, in this order.
    residual : ndarray (n,)
        Residual, Hz or s (see `Coast.measured`).
    white, sensitivity : ndarray (m,), (m, j)
        Whitened residual, and its Jacobian by the parameters (the zero last; see `Coast.zero`).  If the zero has a prior,
        that is the last row.
    measured : int
        Number of rows that are data.
    """

    law: DragLaw
    terms: tuple[str, ...]
    covariance: np.ndarray
    residual: np.ndarray
    white: np.ndarray
    sensitivity: np.ndarray
    measured: int

    @property
    def parameters(self) -> int:
        """Number of free parameters."""
        return self.sensitivity.shape[1]

    @property
    def bic(self) -> float:
        """Bayesian information criterion (Schwarz), for comparison between fits to the same data with the same noise."""
        n = len(self.white)
        return float(n * np.log(max(self.white @ self.white, 1e-300) / n) + self.parameters * np.log(n))

    def sigma(self, term: str) -> float:
        """Return the standard deviation of the coefficient of a term."""
        i = 1 + self.terms.index(term)
        return float(np.sqrt(max(self.covariance[i, i], 0.0)))

    def draw(self, count: int) -> np.ndarray:
        """Return laws (count, 4) as for `slowing_time`, drawn from the fit's normal distribution with a fixed seed."""
        centre = [self.law.speed, *(getattr(self.law, term) for term in self.terms)]
        drawn = np.random.default_rng(20).multivariate_normal(centre, self.covariance, count, method="eigh")
        rows = np.zeros((count, 4))
        rows[:, [0, *(1 + TERMS.index(term) for term in self.terms)]] = drawn
        return rows

    def speed_sigma(self, time: float) -> float:
        """Return the standard deviation of the fitted speed, Hz, at a time, s."""
        step = 1e-3 * np.sqrt(np.maximum(np.diag(self.covariance), 0.0)) + 1e-15
        slope = [
            float(
                _moved(self.law, self.terms, i, h).speed_at(time) - _moved(self.law, self.terms, i, -h).speed_at(time)
            )
            / (2 * h)
            for i, h in enumerate(step)
        ]
        return float(np.sqrt(max(slope @ self.covariance @ slope, 0.0)))


def _moved(law: DragLaw, terms: tuple[str, ...], i: int, step: float) -> DragLaw:
    name = "speed" if i == 0 else terms[i - 1]
    return replace(law, **{name: getattr(law, name) + step})


def fit_law(coast: Coast, terms: tuple[str, ...], noise: Noise, guess: DragLaw | None = None) -> LawFit:
    """Fit a drag law to a coast-down by least squares on whitened residuals; coefficients may become negative.

    Parameters
    ----------
    coast : Coast
        At least as many spans as parameters.
    terms : tuple of str
        Free terms, of `TERMS`; the others are zero.
    noise : Noise
        Of the measured quantity.
    guess : DragLaw, optional
        Start of the iteration.
    """
    from scipy.optimize import leastsq

    start, duration = float(coast.begin[0]), float(coast.end[-1] - coast.begin[0])
    first = _guess(coast) if guess is None else replace(guess, start=start, speed=float(guess.speed_at(start)))
    top = max(abs(first.speed), 1e-12)
    unit = {"linear": 1 / duration, "constant": top / duration, "quadratic": 1 / (top * duration)}
    scale = np.array([top, *(unit[term] for term in terms)])
    share = float(first.deceleration(first.speed)) / max(len(terms), 1)
    rate = {"linear": share / top, "constant": share, "quadratic": share / top**2}
    begin = [first.speed, *((getattr(guess, term) if guess else 0.0) or rate[term] for term in terms)]
    zero, k = coast.zero(), len(scale)
    prior = zero is not None and not coast.pulsed  # the offset has a prior of its sigma: one more observation

    def law_of(p: np.ndarray) -> DragLaw:
        return DragLaw(start, float(p[0] * top), **dict(zip(terms, (p * scale)[1:].tolist(), strict=True)))

    def misfit(p: np.ndarray) -> np.ndarray:
        e = coast.measured(coast.mean - law_of(p[:k]).mean_between(coast.begin, coast.end))
        return e if zero is None else e - p[k] * zero

    def white(p: np.ndarray) -> np.ndarray:
        e = noise.whiten(misfit(p))
        return np.append(e, -p[k]) if prior else e

    def slopes(p: np.ndarray) -> np.ndarray:
        change = coast.measured(law_of(p[:k]).sensitivity(coast.begin, coast.end, terms) * scale)
        if zero is not None:
            change = np.column_stack([change, zero])
        out = noise.whiten(-change)
        return np.vstack([out, -np.eye(k + 1)[k]]) if prior else out

    p0 = np.append(np.array(begin) / scale, np.zeros(0 if zero is None else 1))
    with np.errstate(over="ignore"):  # leastsq's own covariance, which is not used, may overflow for a steady speed
        p, *_ = leastsq(white, p0, Dfun=slopes, xtol=1e-8, ftol=1e-7, maxfev=100, full_output=True)
    sensitivity = slopes(p)
    covariance = np.linalg.pinv(sensitivity.T @ sensitivity)[:k, :k] * np.outer(scale, scale)
    return LawFit(law_of(p[:k]), terms, covariance, misfit(p), white(p), sensitivity, len(coast) - len(noise.ar))


def _guess(coast: Coast) -> DragLaw:
    """Return an exponential fitted to the upper part of the curve: weighted straight line through the logarithm of the speed."""
    head = float(np.median(coast.mean[: max(1, len(coast) // 50)]))
    use = coast.mean > 0.1 * abs(head)
    if np.count_nonzero(use) < 3:
        return DragLaw(float(coast.begin[0]), head, 0.0)
    t, w = coast.middle[use] - coast.begin[0], coast.mean[use]
    slope, level = np.polyfit(t, np.log(w), 1, w=w)
    return DragLaw(float(coast.begin[0]), float(np.exp(level)), float(-slope))
