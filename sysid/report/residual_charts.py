"""The charts of where a model fails: the residual over angle and speed, time, and frequency."""

from __future__ import annotations

import numpy as np

from .charts import (
    BLUE,
    EMPTY,
    GREEN,
    LEGEND,
    MIDDLE,
    ORANGE,
    PURPLE,
    VERMILLION,
    axis,
    chart,
    rounded,
)


def _titled(text: str, top: int = 34) -> dict:
    """A small title in the corner, and the margins that leave it `top` pixels."""
    font = {"size": 13}
    title = {"text": text, "x": 0.01, "y": 0.99, "yanchor": "top", "font": font}
    return {"title": title, "margin": {"l": 60, "r": 10, "t": top, "b": 46}}


def residual_map(name: str, joint: str, unit: str, base: str, found: dict) -> dict:
    """The mean residual over angle (or position) and speed."""
    quantity = "angle" if base == "rad" else "position"
    mean = np.array(
        [[np.nan if v is None else v for v in row] for row in found["mean"]], dtype=float
    ).reshape(len(found["q"]) - 1, -1)
    rows = np.array(found["rows"], dtype=float)
    known = np.sort(np.abs(mean[np.isfinite(mean) & (rows >= 3)]))
    most = float(known[int(0.95 * (len(known) - 1))]) if len(known) else 1.0
    middle = lambda edges: rounded(
        (np.asarray(edges[1:], float) + np.asarray(edges[:-1], float)) / 2
    )  # noqa: E731
    data = [
        {
            "type": "heatmap",
            "x": middle(found["q"]),
            "y": middle(found["qd"]),
            "z": [rounded(row, 3) for row in mean.T],
            "zmin": -most or -1.0,
            "zmax": most or 1.0,
            "customdata": [[int(v) for v in row] for row in rows.T.tolist()],
            "colorscale": [[0, BLUE], [0.5, MIDDLE], [1, VERMILLION]],
            "hoverongaps": False,
            "xgap": 1,
            "ygap": 1,
            "colorbar": {
                "title": {"text": f"mean residual [{unit}]", "side": "right", "font": {"size": 12}},
                "thickness": 10,
                "len": 1.0,
                "outlinewidth": 0,
            },
            "hovertemplate": f"{quantity} %{{x:.3g}} {base}\nspeed %{{y:.3g}} {base}/s\n"
            f"mean residual %{{z:.3g}} {unit}\n%{{customdata}} rows",
        }
    ]
    layout = {
        "xaxis": axis(f"{quantity} q [{base}]", showgrid=False),
        "yaxis": axis(f"speed qd [{base}/s]", showgrid=False),
        "plot_bgcolor": EMPTY,
        **_titled(f"over {quantity} and speed"),
    }
    return chart(
        name, f"Mean residual of {joint} over {quantity} and speed", data, layout, height=300
    )


def residual_time(name: str, joint: str, unit: str, found: dict) -> dict:
    """The residual's RMS over time, a line for each log."""
    data = []
    numbers = sorted(set(found["log"]))
    for k, number in enumerate(numbers):
        own = [
            (t, v) for log, t, v in zip(found["log"], found["start"], found["rms"]) if log == number
        ]
        if len(own) > 1:  # the last window is as wide as the others
            own.append((own[-1][0] + float(np.median(np.diff([t for t, _ in own]))), own[-1][1]))
        data.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": rounded([t for t, _ in own]),
                "y": rounded([np.nan if v is None else v for _, v in own], 4),
                "name": f"test log {int(number) + 1}",
                "line": {
                    "shape": "hv",
                    "width": 1.6,
                    "color": (VERMILLION, BLUE, GREEN, ORANGE, PURPLE)[k % 5],
                },
                "hovertemplate": f"%{{x:.3g}} s: %{{y:.3g}} {unit}",
            }
        )
    layout = {
        "xaxis": axis("time in the test log [s]"),
        "yaxis": axis(f"low-passed RMS [{unit}]", rangemode="tozero"),
        "showlegend": len(numbers) > 1,
        "legend": LEGEND,
        **_titled("over time", 34 if len(numbers) < 2 else 58),
    }
    return chart(name, f"RMS residual of {joint} over time", data, layout, height=300)


def residual_bands(name: str, joint: str, found: dict) -> dict:
    """The share of the squared residual in each band of frequency."""
    edges = found["edges"]
    names = [f"{a:g}–{b:g}" for a, b in zip(edges, edges[1:])]
    data = [
        {
            "type": "bar",
            "x": names,
            "y": rounded([100.0 * (v or 0.0) for v in found["share"]], 4),
            "marker": {"color": VERMILLION},
            "hovertemplate": "%{x} Hz: %{y:.3g} %",
        }
    ]
    layout = {
        "xaxis": axis("frequency [Hz]", type="category", tickangle=-45, showgrid=False),
        "yaxis": axis("squared residual [%]", rangemode="tozero"),
        **_titled("over frequency"),
    }
    return chart(
        name,
        f"Share of the squared residual of {joint} in bands of frequency",
        data,
        layout,
        height=300,
    )
