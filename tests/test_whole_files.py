"""Tables that are written as they are made."""

import polars as pl
import pytest

from sysid.errors import SysidError
from sysid.whole_files import sunk, write_together


def tables(count: int, made: list[int], rows: int = 50_000):
    for k in range(count):
        made.append(k)
        yield pl.select(
            part=pl.lit(str(k)),
            row=pl.int_range(k * rows, (k + 1) * rows),
            even=pl.int_range(rows) % 2 == 0,
        )


def test_tables_are_written_in_their_order_and_all_of_them(tmp_path):
    place = tmp_path / "all.parquet"
    write_together({place: sunk(lambda: tables(7, []))})
    assert pl.read_parquet(place).equals(pl.concat(tables(7, [])))


def test_a_table_is_made_when_it_is_asked_for(tmp_path):
    """No hundred tables wait to be written: of these each is as large as what stands in memory."""
    made, seen, behind = [], [], []

    def watched():
        for table in tables(200, made):
            if (path := tmp_path / "all.parquet").exists():
                seen.append(path.stat().st_size)
            yield table
        behind.append(seen[-1] if seen else 0)

    sunk(watched)(tmp_path / "all.parquet")
    whole = (tmp_path / "all.parquet").stat().st_size
    assert behind[-1] > 0.6 * whole  # when the last one is made most are in the file


def test_a_table_that_cannot_be_made_leaves_no_half_file(tmp_path):
    def broken():
        yield from tables(2, [])
        raise OSError("gone")

    with pytest.raises(SysidError):
        write_together({tmp_path / "all.parquet": sunk(broken)})
    assert not list(tmp_path.iterdir())
