"""The chart of parameters with their standard deviations and their priors."""

from __future__ import annotations

import math

import numpy as np

from ..units import behind
from .charts import BLUE, LEGEND, ORANGE, axis, chart, plain, rounded


def whiskers(name: str, label: str, groups: list[dict]) -> dict:
    """Values with two standard deviations beside their priors, one panel a unit.

    Args:
        groups: [{"unit", "names", "values", "stds", "priors", "shares"}], priors None where there
            is none.
    """
    # the legend's dot is not pale, whatever the first value is
    data: list[dict] = [
        {
            "type": "scatter",
            "mode": "markers",
            "x": [None],
            "y": [None],
            "name": "identified, ± 2 std",
            "marker": {"color": BLUE, "size": 8},
            "showlegend": True,
            "hoverinfo": "skip",
        }
    ]
    layout: dict = {}
    sizes = [len(g["names"]) + 1.6 for g in groups]
    total, gap, top = sum(sizes) + 2.2 * (len(groups) - 1), 2.2, 0.0
    for k, (group, size) in enumerate(zip(groups, sizes)):
        number = "" if k == 0 else str(k + 1)
        names = [plain(n) for n in group["names"]]
        stds = [2 * s if s is not None and math.isfinite(s) else 0.0 for s in group["stds"]]
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": rounded(group["values"]),
                "y": names,
                "name": "identified, ± 2 std",
                "showlegend": False,
                "error_x": {
                    "type": "data",
                    "array": rounded(stds),
                    "thickness": 1.4,
                    "width": 3,
                    "color": BLUE,
                },
                "marker": {
                    "color": BLUE,
                    "size": 8,
                    "opacity": [round(0.25 + 0.75 * float(s or 0.0), 2) for s in group["shares"]],
                },
                "xaxis": f"x{number}",
                "yaxis": f"y{number}",
                "customdata": rounded([100 * (s or 0.0) for s in group["shares"]], 3),
                "hovertemplate": f"%{{x:.4g}} {group['unit']}, %{{customdata:.0f}} % from data",
            }
        )
        if any(p is not None for p in group["priors"]):
            data.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": rounded([np.nan if p is None else p for p in group["priors"]]),
                    "y": names,
                    "name": "prior",
                    "legendgroup": "prior",
                    "showlegend": k == 0,
                    "marker": {
                        "color": ORANGE,
                        "size": 9,
                        "symbol": "diamond-open",
                        "line": {"width": 1.6},
                    },
                    "xaxis": f"x{number}",
                    "yaxis": f"y{number}",
                    "hovertemplate": f"prior %{{x:.4g}} {group['unit']}",
                }
            )
        unit = behind(group["unit"], " [{}]")
        layout[f"xaxis{number}"] = axis(
            f"{group.get('quantity', 'value')}{unit}", anchor=f"y{number}", zeroline=True, nticks=6
        )
        layout[f"yaxis{number}"] = {
            "type": "category",
            "domain": [max(1 - (top + size) / total, 0.0), 1 - top / total],
            "anchor": f"x{number}",
            "autorange": "reversed",
            "automargin": True,
            "showgrid": True,
        }
        top += size + gap
    layout |= {"showlegend": True, "legend": LEGEND, "margin": {"l": 60, "r": 14, "t": 34, "b": 46}}
    return chart(name, label, data, layout, height=int(80 + 24 * total))
