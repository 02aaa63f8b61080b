"""The terms that formulas are drawn from, and true values for their inner values."""

from __future__ import annotations

import numpy as np

# A term, with what each inner value is drawn as: a place on the angle or the speed, a share of
# their span or size, a count of cycles, a phase, a power, a sign. `#` numbers the names of a second
# term.
TERMS = {
    "h#*exp(-((q-c#)/w#)**2)": {"c": "place q", "w": "width q"},
    "h#*exp(-((qd-c#)/w#)**2)": {"c": "place qd", "w": "width qd"},
    "h#*exp(-abs(qd)/v#)*s": {"v": "width qd"},
    "h#*exp(-abs(qd/v#)**n#)*s": {"v": "width qd", "n": "power"},
    "h#*exp(r#*q)": {"r": "rate q"},
    "h#*tanh(qd/v#)": {"v": "width qd"},
    "h#*tanh((q-c#)/w#)": {"c": "place q", "w": "width q"},
    "h#*tanh(k#*qd+m#)": {"k": "steep qd", "m": "shift"},
    "h#*atan(k#*(q-c#))": {"k": "steep q", "c": "place q"},
    "h#*sin(k#*q+p#)": {"k": "cycles q", "p": "phase"},
    "h#*cos(k#*(q-c#))": {"k": "cycles q", "c": "place q"},
    "h#*sin(k#*t+p#)": {"k": "cycles t", "p": "phase"},
    "h#*exp(-t/T#)*qd": {"T": "width t"},
    "h#*abs(qd)**n#*s": {"n": "power"},
    "h#*qd/(v#+abs(qd))": {"v": "width qd"},
    "h#/(1+((q-c#)/w#)**2)": {"c": "place q", "w": "width q"},
    "h#/(1+exp(-(q-c#)/w#))": {"c": "place q", "w": "signed width q"},
    "h#*max(q-c#,0)": {"c": "place q"},
    "h#*min(max(qd,l#),u#)": {"l": "low qd", "u": "high qd"},
    "h#*q/sqrt(q**2+w#**2)": {"w": "width q"},
    "h#*log(b#+abs(qd))*s": {"b": "width qd"},
    "h#*exp(-((q-c#)/w#)**2)*tanh(qd/v#)": {"c": "place q", "w": "width q", "v": "width qd"},
    "h#*exp(-r#*q**2)*sin(k#*q+p#)": {"r": "steep q", "k": "cycles q", "p": "phase"},
    "h#*(q-c#)**2*s": {"c": "place q"},
}


def drawn(rng: np.random.Generator, kind: str, signals: dict) -> float:
    """A true value."""
    words = kind.split()
    x = signals[words[-1] if len(words) > 1 else "q"]
    low, high = float(x.min()), float(x.max())
    span, size = high - low, max(abs(low), abs(high))
    sign = float(rng.choice([-1.0, 1.0]))
    width = float(np.exp(rng.uniform(np.log(0.05), np.log(0.6)))) * span
    drawers = {
        "place": lambda: rng.uniform(low, high),
        "width": lambda: width,
        "signed": lambda: sign * width,
        "rate": lambda: sign * rng.uniform(0.5, 4.0) / size,
        "steep": lambda: rng.uniform(1.0, 20.0) / size,
        "shift": lambda: rng.uniform(-3.0, 3.0),
        "cycles": lambda: 2.0 * np.pi * rng.uniform(1.5, 12.0) / span,
        "phase": lambda: rng.uniform(-np.pi, np.pi),
        "power": lambda: rng.uniform(0.3, 3.0),
        "low": lambda: rng.uniform(0.1, 0.8) * low,
        "high": lambda: rng.uniform(0.1, 0.8) * high,
    }
    return drawers[words[0]]()


def formula(rng: np.random.Generator, signals: dict) -> tuple[str, dict[str, float]]:
    """A formula's text and its true inner values: one drawn term, or with even chance two."""
    parts, values = [], {}
    for k, term in enumerate(rng.choice(list(TERMS), size=int(rng.integers(1, 3)), replace=False)):
        letter = "ab"[k]
        parts.append(term.replace("#", letter))
        values |= {
            f"{name}{letter}": float(drawn(rng, kind, signals))
            for name, kind in TERMS[term].items()
        }
    return " + ".join(parts), values
