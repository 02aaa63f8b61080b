"""The chart of a joint's error over the steps."""

from __future__ import annotations

import math

from .charts import BLUE, GREEN, axis, chart, plain, rounded


def staircase(
    name: str,
    joint: str,
    unit: str,
    names: list[str],
    made: list,
    expected: list,
    level: float | None,
    doubt: float | None,
) -> dict:
    """The held-out error of a joint over the steps, against its noise floor.

    Args:
        names: of the steps, the first is the start.
        made, expected: (steps,) RMS or None; expected ones are drawn broken.
    """
    at = list(range(len(names)))
    data = []
    if level is not None:
        ends = [-0.5, len(names) - 0.5]
        if doubt:
            data.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": ends + ends[::-1],
                    "y": rounded([level + 2 * doubt] * 2 + [max(level - 2 * doubt, 0.0)] * 2),
                    "fill": "toself",
                    "fillcolor": GREEN,
                    "opacity": 0.2,
                    "line": {"width": 0, "color": GREEN},
                    "hoverinfo": "skip",
                    "showlegend": False,
                }
            )
        data.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": ends,
                "y": rounded([level] * 2),
                "name": "noise floor",
                "line": {"color": GREEN, "width": 2, "dash": "dot"},
                "hovertemplate": f"noise floor %{{y:.4g}} {unit}",
            }
        )
    for values, word, dash, symbol in (
        (made, "held-out error", "solid", "circle"),
        (expected, "expected by the diagnosis", "dash", "circle-open"),
    ):
        if any(v is not None for v in values):
            shown = [v if v is not None and math.isfinite(v) else None for v in values]
            data.append(
                {
                    "type": "scatter",
                    "mode": "lines+markers",
                    "x": at,
                    "y": shown,
                    "name": word,
                    "line": {"color": BLUE, "width": 2, "shape": "hvh", "dash": dash},
                    "marker": {"size": 8, "symbol": symbol},
                    "text": [plain(n) for n in names],
                    "hovertemplate": f"%{{text}}, {word}: %{{y:.4g}} {unit}",
                }
            )
    layout = {
        "title": {
            "text": plain(joint),
            "x": 0.01,
            "y": 0.99,
            "yanchor": "top",
            "font": {"size": 14},
        },
        "xaxis": axis(
            "step",
            tickvals=at,
            ticktext=[plain(n) for n in names],
            range=[-0.5, len(names) - 0.5],
            showgrid=False,
        ),
        "yaxis": axis(f"held-out RMS [{unit}]", rangemode="tozero"),
        "margin": {"l": 62, "r": 14, "t": 36, "b": 46},
    }
    return chart(
        name,
        f"Held-out error of {joint} over the steps against its noise floor",
        data,
        layout,
        height=270,
    )
