"""Shares, ranges, lists and tables as the benchmark's page writes them."""

from __future__ import annotations

import numpy as np


def span(entry: dict) -> str:
    low, high = 100 * entry["from"], 100 * entry["to"]
    return f"< {high:g} %" if low < 0 else f"> {low:g} %" if high > 100 else f"{low:g}–{high:g} %"


def percent(entry: dict) -> str:
    if not entry["of"]:
        return "–"
    return f"{100 * entry['share']:.1f} % ({entry['count']} of {entry['of']}; {100 * entry['low']:.0f} to {100 * entry['high']:.0f} %)"


def table(heads: list[str], rows: list[list]) -> str:
    lines = [
        "| " + " | ".join(heads) + " |",
        "|" + "|".join("---" if k == 0 else "---:" for k in range(len(heads))) + "|",
    ]
    return "\n".join(
        lines
        + [
            "| "
            + " | ".join(
                "·" if value == 0 and not isinstance(value, str) else str(value) for value in row
            )
            + " |"
            for row in rows
        ]
    )


def spelled(nuisances: dict | None) -> str:
    return ", ".join(f"{word} {value}" for word, value in (nuisances or {}).items()) or "–"


def page_name(under: str) -> str:
    return "blind_benchmark" + ("" if under == "clean" else f"_{under}")


def quantiles(values: list[float]) -> str:
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return f"median {middle:.2f}, 5 to 95 % {low:.2f} to {high:.2f}, largest {max(values):.2f}"


def listed(words) -> str:
    *most, last = (f"`{word}`" for word in words)
    return f"{', '.join(most)} and {last}"


def lowered_by(row: dict) -> str:
    return "–" if row["lowered"] is None else f"{100 * row['lowered']:.0f} %"
