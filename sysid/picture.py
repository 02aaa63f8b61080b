"""Pictures of results: a Matplotlib figure without a window, which notebooks show as it is."""

from __future__ import annotations

import io

from matplotlib.figure import Figure


class Picture(Figure):
    """A Matplotlib figure; `savefig` writes it."""

    def __init__(self, width: float, height: float):
        """Width and height in inches."""
        super().__init__(figsize=(width, height), layout="constrained")

    def _repr_png_(self) -> bytes:
        out = io.BytesIO()
        self.savefig(out, format="png")
        return out.getvalue()
