"""Franka Emika Panda: seven joints with link-side torque sensors, about 1 kHz."""

import numpy as np

from ..errors import LogError
from ..readers.table import ArrayTable
from .dataset import Dataset

_JOINTS = tuple(f"panda_joint{k}" for k in range(1, 8))
_FILES = tuple(f"exciting_traj_{kind}.txt" for kind in ("torques", "positions", "velocity", "time"))


class _PandaTable(ArrayTable):
    """t [s], q_, qd_ (as the controller reports it), tau_ for each joint, from text files of stacked 7-vectors."""

    def __init__(self, path):
        self._arrays = {}
        for file, name in zip(_FILES, ("tau", "q", "qd", "t")):
            try:
                values = np.loadtxt(path.parent / file)
            except (OSError, ValueError) as error:
                raise LogError(f"{file} cannot be read ({error})", where=str(path.parent)) from None
            if name == "t":
                self._arrays["t"] = values
            else:
                self._arrays |= {f"{name}_{joint}": column for joint, column in zip(_JOINTS, values.reshape(-1, 7).T)}
        super().__init__(path, {name: array.shape for name, array in self._arrays.items()})

    def fetch(self, name):
        return self._arrays[name]


PANDA = Dataset(
    name="panda",
    title="Franka Emika Panda, exciting trajectory 1",
    citation="Gaz, Cognetti, Oliva, Robuffo Giordano, De Luca 2019, Dynamic Identification of the Franka Emika Panda Robot",
    licence="GPL-3.0",
    source="https://raw.githubusercontent.com/marcocognetti/FrankaEmikaPandaDynModel/24d85ce",
    files={
        file: (f"matlab/data/Exciting_Traj/Trajectory_1/rbt_log/{file}", sha256)
        for file, sha256 in zip(_FILES, (
            "11fda32785bb29ce444e14e0f45f4893aab7142dc6ee29576d828ab154852f9c",
            "50bf82a082c439aff8220e8142985c8dd783f7ddc1415987cd75c9efb88bcf69",
            "3340f299e926c501b66d540fa461ea0a7184b8dda32e505ebed062db57860d49",
            "031063612f297011dc005ab29830903e36f4bfeba77bce59c0fbde13620fb20d",
        ))
    },
    logs={"exciting_trajectory_1": _FILES},
    opener=_PandaTable,
)  # fmt: skip
