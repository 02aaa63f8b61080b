"""What a fit says of its own numbers: a joint that stands in the test logs, an error that is another in each log."""

import shutil

import polars as pl
import pytest

from sysid import pipeline


@pytest.fixture
def folder(simulated, tmp_path):
    return shutil.copytree(simulated("three logs", seed=12, duration=8.0, logs=3), tmp_path / "case")


def changed(folder, file: str, **columns):
    table = pl.read_csv(folder / file)
    table.with_columns(**{name: make(table[name]) for name, make in columns.items()}).write_csv(folder / file)


def said(folder) -> list[str]:
    return [text for text in pipeline.fit(pipeline.load(folder)).notices if "another in some logs" in text or "in motion" in text or "implausible" in text]


@pytest.mark.long
def test_logs_that_differ_in_nothing_are_not_said_to(folder):
    assert said(folder) == []


def test_an_offset_that_one_log_has_is_said_with_its_log(folder):
    changed(folder, "train_2.csv", tau_elbow=lambda tau: tau + 0.5)
    (text,) = said(folder)
    assert "elbow is another" in text and "N m in train_2.csv" in text and "shoulder" not in text


def test_a_joint_that_stands_in_the_test_log_is_not_called_wrong(folder):
    """Its torque is what friction at rest holds: any number up to the greatest."""
    table = pl.read_csv(folder / "test.csv")
    rest = 0.8 * (1.0 - 2.0 * (pl.Series(range(len(table))) // 500 % 2))
    changed(folder, "test.csv", q_elbow=lambda q: 0.0 * q + 0.3, tau_elbow=lambda tau: 0.0 * tau + rest)
    texts = said(folder)
    assert any(text.startswith("the test logs do not show elbow in motion") for text in texts)
    assert not any("worse than none" in text and "elbow" in text for text in texts)
