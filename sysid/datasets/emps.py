"""EMPS: electro-mechanical positioning system, one prismatic joint, 1 kHz, force from motor voltage."""

from ..readers.mat import Mat5Table
from .dataset import Dataset


class _EmpsTable(Mat5Table):
    """t [s], q_slider motor position [m], tau_slider = gtau vir [N]; also the reference qg [m] and vir [V]."""

    def __init__(self, path):
        super().__init__(path)
        gain = float(self._arrays["gtau"])  # N/V, stored beside the signals
        arrays = {"t": self._arrays["t"], "q_slider": self._arrays["qm"], "tau_slider": gain * self._arrays["vir"]}
        arrays |= {key: self._arrays[key] for key in ("qg", "vir")}
        if "pulses_N" in self._arrays:
            arrays["pulses"] = self._arrays["pulses_N"].astype(float)
        self._arrays = arrays
        super(Mat5Table, self).__init__(path, {name: array.shape for name, array in arrays.items()})


EMPS = Dataset(
    name="emps",
    title="Electro-mechanical positioning system",
    citation="Janot, Gautier, Brunot 2019, Data set and reference models of EMPS, Nonlinear System Identification Benchmarks",
    licence="not stated at the source; use, do not redistribute",
    source="https://raw.githubusercontent.com/wmkouw/NSI-EMPS/d1137b8/data",
    files={
        "DATA_EMPS.mat": ("DATA_EMPS.mat", "6cf6814ae14618795da0101aae2bb97ff0c6351b0501b5492751b02b07facf7e"),
        "DATA_EMPS_PULSES.mat": ("DATA_EMPS_PULSES.mat", "0eab75bb1f6b16228ee78791343a88bf9bfd9a51036ac9807d7b5fc11c0e1704"),
    },
    logs={"DATA_EMPS": ("DATA_EMPS.mat",), "DATA_EMPS_PULSES": ("DATA_EMPS_PULSES.mat",)},
    opener=_EmpsTable,
)
