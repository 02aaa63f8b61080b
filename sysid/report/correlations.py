"""The chart of which parameters' errors go together."""

from __future__ import annotations

import numpy as np

from .charts import BLUE, MIDDLE, VERMILLION, chart, plain, rounded


def correlation_map(name: str, names: list[str], found: np.ndarray) -> dict:
    """A small map of correlations.

    Args:
        names: of the parameters. found: (k, k), from -1 to 1.
    """
    shown = [plain(n) for n in names]
    values = np.where(np.eye(len(names), dtype=bool), np.nan, found)
    data = [{
        "type": "heatmap", "x": shown, "y": shown, "z": [rounded(row, 3) for row in values],
        "zmin": -1.0, "zmax": 1.0, "xgap": 1, "ygap": 1, "hoverongaps": False,
        "colorscale": [[0, BLUE], [0.5, MIDDLE], [1, VERMILLION]],
        "colorbar": {
            "title": {"text": "correlation", "side": "right", "font": {"size": 12}},
            "thickness": 10, "outlinewidth": 0,
        },
        "hovertemplate": "%{x}\n%{y}\ncorrelation %{z:.2f}",
    }]  # fmt: skip
    layout = {
        "xaxis": {
            "type": "category",
            "tickangle": -60,
            "tickfont": {"size": 10},
            "automargin": True,
        },
        "yaxis": {
            "type": "category",
            "tickfont": {"size": 10},
            "automargin": True,
            "autorange": "reversed",
        },
        "margin": {"l": 10, "r": 10, "t": 10, "b": 10},
    }
    label = "Correlations of the parameters whose errors go together most"
    return chart(name, label, data, layout, height=420)
