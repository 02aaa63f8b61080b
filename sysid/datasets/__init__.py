"""Public logs: each a module that knows its source, licence, SHA-256 and conversion."""

from .dataset import Dataset, DatasetLog, data_folder
from .emps import EMPS
from .panda import PANDA
from .ur10e import UR10E

DATASETS: dict[str, Dataset] = {dataset.name: dataset for dataset in (EMPS, UR10E, PANDA)}


def reference(text: str) -> DatasetLog | None:
    """What `dataset:log` names, or None where the text names no dataset (then it is a path).

    Raises:
        LogError: the dataset has no such log.
    """
    name, colon, log = text.partition(":")
    return DATASETS[name].log(log) if colon and name in DATASETS else None


__all__ = ["DATASETS", "Dataset", "DatasetLog", "data_folder", "reference"]
