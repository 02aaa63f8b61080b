"""UR10e: six joints, nominally 100 Hz with steps of 2 to 16 ms, motor currents [A]."""

from ..readers.csv import CsvTable
from .dataset import Dataset

_JOINTS = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint")


class _Ur10eTable(CsvTable):
    """t [s], q_, qd_ (as the controller reports it), i_ and i_desired_ [A], tau_desired_ [N m] for each joint."""

    def __init__(self, path):
        super().__init__(path)
        kinds = ("q", "qd", "i", "i_desired", "tau_desired")
        self.names = ["t"] + [f"{kind}_{joint}" for kind in kinds for joint in _JOINTS]


UR10E = Dataset(
    name="ur10e",
    title="Universal Robots UR10e, exciting trajectories with and without a payload of 2.805 kg",
    citation="Mamedov & Mikhel 2020, Practical Aspects of Model-Based Collision Detection, 10.3389/frobt.2020.571574",
    licence="not stated at the source; use, do not redistribute",
    source="https://raw.githubusercontent.com/shamilmamedov/dynamic_calibration/11af40e",
    files={
        **{
            name: (f"dataset_ur10e/identification_data/{name}", sha256)
            for name, sha256 in {
                "ur-20_02_10-30sec_12harm.csv": "341fff80f177be564c8720ea898165addfd46d7cbe6f3ffd8923eeaae0eef000",
                "ur-20_02_12-50sec_12harm.csv": "bb48cca42716a88f8b255d2d1b3eb3fa4a6eac4a9a52b694d4c1066ce8b4ca51",
                "ur-20_02_19_14harm50sec.csv": "cd503afc985c41a6ad8fbe47d443c961eadbde4822a87ff3e17adcb2a24fa103",
                "ur-20_02_19_14harm50secLoad.csv": "e689a99e5ff00ac38d03a2b9302e77688de0db8388b1d9c0e6aad3f77962758c",
            }.items()
        },
        "ur10e.urdf": ("URe/urdf/ur10e.urdf", "0d2abc6ebc70725c691a35aa6c2d03fd6e8158017a1b7da7a10a3ef52de7b821"),
    },
    logs={
        "30sec_12harm": ("ur-20_02_10-30sec_12harm.csv",),
        "50sec_12harm": ("ur-20_02_12-50sec_12harm.csv",),
        "14harm50sec": ("ur-20_02_19_14harm50sec.csv",),
        "14harm50secLoad": ("ur-20_02_19_14harm50secLoad.csv",),
    },
    opener=_Ur10eTable,
)
