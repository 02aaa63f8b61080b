"""A diagnosis at a Python prompt: a line that says what it is, a table, a picture."""

from __future__ import annotations

from functools import cached_property

from .tried_formula import falls_with


class ShownDiagnosis:
    """What `Diagnosis` shows of itself; its data stand there."""

    def falls_with(self, joint: str, options: dict) -> bool:
        """Whether the test error of a joint falls with a formula on it, beside all claims; each is
        fitted once."""
        key = joint, *options.items()
        if key not in self._formulas:
            last = self.claims[-1].after if self.claims else self.fit
            self._formulas[key] = falls_with(last, joint, options)
        return self._formulas[key]

    @cached_property
    def _formulas(self) -> dict[tuple, bool]:
        return {}

    def __repr__(self) -> str:
        told = [
            f"{v['joint']} {v['status']}" + (f" {v['effect']}" if v.get("effect") else "")
            for v in self._document()["verdict"]
        ]
        return f"<Diagnosis of {self.fit.experiment.name}: {', '.join(told)}>"

    def to_dataframe(self):
        """The verdicts as a polars data frame, a row a joint: status, the effect and what it
        explains, RMS on the test logs [N m or N], noise floor, the command that adds it."""
        import polars

        said = self._document()
        rows = [
            {
                "joint": v["joint"],
                "status": v["status"],
                "effect": v.get("effect"),
                "explained": v.get("explained"),
                "rms_test": said["joints"][v["joint"]]["rms"]["test"],
                "noise_floor": said["joints"][v["joint"]]["noise_floor"],
                "command": v.get("command"),
            }
            for v in said["verdict"]
        ]
        return polars.DataFrame(rows, infer_schema_length=None)

    def plot(self):
        """RMS on the test logs and noise floor of every joint, as a Matplotlib figure."""
        from .picture import Picture

        table = self.to_dataframe()
        figure = Picture(1.5 + 1.2 * len(table), 3.5)
        axes = figure.subplots()
        for k, (column, label) in enumerate((("rms_test", "RMS"), ("noise_floor", "noise floor"))):
            values = [value or 0.0 for value in table[column]]
            axes.bar([n + 0.4 * k for n in range(len(table))], values, width=0.4, label=label)
        axes.set_xticks([n + 0.2 for n in range(len(table))], self._labels(table))
        axes.set_ylabel("torque on the test logs [N m or N]")
        axes.legend()
        return figure

    @staticmethod
    def _labels(table) -> list[str]:
        rows = zip(table["joint"], table["status"], table["effect"])
        return [f"{joint}\n{effect or status}" for joint, status, effect in rows]

    def _document(self) -> dict:
        from .statement.document import document

        return document(self, laws=False)  # of which each is a fit
