"""Charts as Plotly figure dictionaries: {id, label, height, link, figure: {data, layout}}.

Nothing of physics is computed.

The colours are Okabe and Ito's (2008), as in the printed figures; the page turns them for a dark
screen. Plotly reads markup in its texts: whatever comes from a file goes through `plain`.
"""

from __future__ import annotations

import html
import math

import numpy as np

INK, GREY, BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY = (
    "#000000",
    "#999999",
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#E69F00",
    "#CC79A7",
    "#56B4E9",
)
MIDDLE, EMPTY = "#FDFDFD", "#DCDCDC"  # of a map's scale; cells where no row is


_TENS = np.array([float(f"1e{k}") for k in range(23)])  # exact in binary


def plain(text) -> str:
    """A text as Plotly shows it letter by letter."""
    return html.escape(str(text), quote=False)


def rounded(values, digits: int = 5) -> list:
    """Numbers as JSON can hold them, to so many significant digits; None for NaN and infinity."""
    v = np.asarray(values, dtype=float).ravel()
    size = np.abs(v)
    usual = (size > 1e-9) & (size < 1e15)  # whose powers of ten, and products, are exact
    power = digits - 1 - np.floor(np.log10(size, where=usual, out=np.zeros_like(v))).astype(int)
    up, down = _TENS[np.maximum(power, 0)], _TENS[np.maximum(-power, 0)]
    with np.errstate(invalid="ignore", over="ignore"):
        out = (np.round(v * up / down) / up * down).tolist()
    for k in np.flatnonzero(~usual):
        out[k] = float(f"{v[k]:.{digits}g}") if math.isfinite(v[k]) else None
    return out


def chart(
    name: str, label: str, data: list, layout: dict, *, height: int, link: str | None = None
) -> dict:
    """A chart as the page embeds it.

    Args:
        name: of the element, letters and digits. label: for those who cannot see it. height: [px].
    """
    base = {
        "autosize": True,
        "height": height,
        "margin": {"l": 62, "r": 14, "t": 26, "b": 46},
        "showlegend": False,
        "font": {"size": 12},
        "uirevision": "kept",
    }
    return {
        "id": name,
        "label": label,
        "height": height,
        "link": link,
        "figure": {"data": data, "layout": base | layout},
    }


def axis(title: str, **more) -> dict:
    """An axis that says quantity and unit."""
    return {
        "title": {"text": title, "standoff": 6, "font": {"size": 12}},
        "automargin": True,
        "zeroline": False,
    } | more


LEGEND = {
    "orientation": "h",
    "x": 0,
    "y": 1.0,
    "yanchor": "bottom",
    "xanchor": "left",
    "itemwidth": 30,
    "font": {"size": 11},
}


def timeline(parts: dict) -> dict:
    """Where each log stands when all are laid end to end.

    Args:
        parts: {"train": (log (n,), t (n,), names), "test": ...}.

    Returns:
        {part: {"t": (n,), "breaks": indices, "spans": [(begin, end, name)],
        "starts": the logs' own first times [s]}}.
    """
    out, end = {}, 0.0
    for part, (log, t, names) in parts.items():
        log, t = np.asarray(log), np.asarray(t, dtype=float)
        moved, spans, lows = np.zeros(len(t)), [], []
        starts = np.append(0, np.flatnonzero(np.diff(log)) + 1) if len(t) else []
        for number, (a, b) in enumerate(zip(starts, [*starts[1:], len(t)])):
            low, high = float(t[a:b].min()), float(t[a:b].max())
            moved[a:b] = t[a:b] - low + end
            name = names[int(log[a])] if int(log[a]) < len(names) else f"log {number + 1}"
            spans.append((end, end + high - low, name))
            lows.append(low)
            end += (high - low) * 1.02 + 1e-9
        steps = np.diff(moved)
        usual = float(np.median(steps)) if len(steps) else 0.0
        out[part] = {
            "t": moved,
            "breaks": np.flatnonzero((steps > 1.5 * usual + 1e-12) | (steps < 0)) + 1,
            "spans": spans,
            "starts": lows,
        }
    return out


def joined(spans, least: float) -> list[tuple[float, float]]:
    """Spans of time in order, none shorter than `least`, those that then touch as one."""
    out: list[tuple[float, float]] = []
    for low, high in sorted(spans):
        middle, half = (low + high) / 2, max(high - low, least) / 2
        low, high = middle - half, middle + half
        if out and low <= out[-1][1]:
            out[-1] = out[-1][0], max(out[-1][1], high)
        else:
            out.append((low, high))
    return out


def scene(middle, size, eye: tuple[float, float, float], below: float) -> dict:
    """A box in space, to scale, with its axes in metres.

    Args:
        middle, size: (3,) [m]. eye: where it is looked at from; below: what height is looked at,
            both in units of the box.
    """
    power = 10.0 ** np.floor(np.log10(least := size.max() / 8.0))
    step = power * min(nice for nice in (1, 2, 5, 10) if nice * power >= least * (1 - 1e-9))
    axes = {}
    for k, key in enumerate("xyz"):
        # no number near the box's corners, where those of two axes would touch
        first, last = (
            f((middle[k] + side * 0.42 * size[k]) / step)
            for f, side in ((np.ceil, -1), (np.floor, 1))
        )
        at = (
            rounded(step * np.arange(first, last + 1) + 0.0, 6)
            if first <= last
            else rounded(middle[k : k + 1], 2)
        )  # + 0.0: no minus before a zero
        axes[f"{key}axis"] = {
            "title": {"text": f"{key} [m]", "font": {"size": 12}},
            "range": rounded(middle[k] + np.array([-0.5, 0.5]) * size[k]),
            "tickvals": at,
            "tickfont": {"size": 11},
        }
    ratio = {key: float(f"{size[k] / size.max():.4g}") for k, key in enumerate("xyz")}
    return {
        "aspectmode": "manual",
        "aspectratio": ratio,
        **axes,
        "camera": {"eye": dict(zip("xyz", eye)), "center": {"x": 0, "y": 0, "z": below}},
    }
