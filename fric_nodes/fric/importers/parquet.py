"""``.parquet``: columns of Apache Arrow."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from .errors import ImportingError, one_line
from .table import Importer, Source, Table, TextOptions

__all__ = ["IMPORTER"]


def read(path: Path, options: TextOptions, wanted: Sequence[Source]) -> Table:
    """Read the columns that are numbers or times.

    Raises:
        ImportingError: not a readable file.
    """
    import pyarrow as pa  # slow to import, and only this needs it
    import pyarrow.parquet as pq

    table = Table(path)
    try:
        content = pq.read_table(path, partitioning=None)
        content.validate(full=True)
        for name in content.column_names:
            column = content.column(name)
            if pa.types.is_integer(column.type) and column.null_count:
                column = column.cast(pa.float64())
            if pa.types.is_decimal(column.type):
                column = column.cast(pa.float64())
            table.add(name, column.to_numpy())
    except Exception as error:  # Arrow's own, those of the operating system, and what numpy can't take
        raise ImportingError(path, f"is not a readable .parquet file ({one_line(error)})", "export it again") from error
    table.order = list(content.column_names)
    return table


IMPORTER = Importer("parquet", (".parquet",), read)
