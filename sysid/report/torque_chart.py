"""The chart of measured and predicted torque over time."""

from __future__ import annotations

import numpy as np

from .charts import BLUE, GREY, LEGEND, ORANGE, SKY, VERMILLION, axis, chart, joined, rounded
from .decimate import broken

_MOST, _BUDGET = 2000, 150_000  # points a trace; points of all torque traces together


def torque(
    name: str, joint: str, unit: str, line: dict, series: dict, joints: int, events=()
) -> dict:
    """Measured and predicted torque over the logs end to end, the residual below on the same axis.

    Args:
        line: of `timeline`. series: {part: (measured (n,), predicted (n,), residual (n,))}.
        events: (begin, end) on the same axis of what disturbed this joint's log, shaded.
    """
    quantity = "torque" if unit == "N m" else "force"
    most = int(np.clip(_BUDGET // (6 * max(joints, 1)), 300, _MOST))
    data = []
    for number, (part, columns) in enumerate(series.items()):
        for what, values, colour, width, place in zip(
            ("measured", "predicted", "residual"),
            columns,
            (GREY, BLUE, VERMILLION),
            (1.6, 1.1, 0.9),
            ("y", "y", "y2"),
        ):
            t, y = broken(line[part]["t"], values, line[part]["breaks"], most)
            data.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": rounded(t, 6),
                    "y": rounded(y, 4),
                    "name": what,
                    "legendgroup": what,
                    "showlegend": number == 0,
                    "line": {"color": colour, "width": width},
                    "yaxis": place,
                    "xaxis": "x",
                    "connectgaps": False,
                    "hovertemplate": f"{part}, {what}: %{{y:.4g}} {unit}",
                }
            )
    shapes, notes = [], []
    for part, own in line.items():
        for begin, end, _ in own["spans"]:
            if part == "test":
                shapes.append(
                    {
                        "type": "rect",
                        "xref": "x",
                        "yref": "paper",
                        "x0": begin,
                        "x1": end,
                        "y0": 0,
                        "y1": 1,
                        "fillcolor": SKY,
                        "opacity": 0.13,
                        "line": {"width": 0},
                        "layer": "below",
                    }
                )
        if own["spans"]:
            word = "train" if part == "train" else "test (held out)"
            notes.append(
                {
                    "text": word,
                    "xref": "x",
                    "yref": "paper",
                    "x": own["spans"][0][0],
                    "y": 0.995,
                    "xanchor": "left",
                    "yanchor": "top",
                    "showarrow": False,
                    "font": {"size": 11, "weight": "bold"},
                }
            )
    end = max((span[1] for own in line.values() for span in own["spans"]), default=1.0)
    shapes += [
        {
            "type": "rect",
            "xref": "x",
            "yref": "paper",
            "x0": float(f"{low:.6g}"),
            "x1": float(f"{high:.6g}"),
            "y0": 0,
            "y1": 1,
            "fillcolor": ORANGE,
            "opacity": 0.35,
            "line": {"width": 0},
            "layer": "below",
        }
        for low, high in joined(events, 0.002 * end)
    ]
    layout = {
        "xaxis": axis("time, logs end to end [s]", anchor="y2", range=[0.0, float(f"{end:.6g}")]),
        "yaxis": axis(
            f"torque [{unit}]" if unit == "N m" else f"force [{unit}]", domain=[0.38, 1.0]
        ),
        "yaxis2": axis(f"residual [{unit}]", domain=[0.0, 0.30], zeroline=True),
        "shapes": shapes,
        "annotations": notes,
        "showlegend": True,
        "legend": LEGEND,
        "hovermode": "x",
        "dragmode": "zoom",
        "margin": {"l": 66, "r": 14, "t": 34, "b": 46},
    }
    return chart(
        name,
        f"Measured and predicted {quantity} of {joint} over time, and the residual",
        data,
        layout,
        height=380,
        link="time",
    )
