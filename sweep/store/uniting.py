"""Union of the tables of several parts: columns by name, with widened types."""

from collections.abc import Sequence

import pyarrow as pa


def united(
    tables: Sequence[pa.Table], columns: Sequence[str] | None = None
) -> pa.Table:
    """Return the rows of tables in order, with the metadata of the last nonempty table.

    Without tables the result has no rows, and has the columns `columns` and `trial_id`.
    """
    if not tables:
        empty = {name: pa.null() for name in columns or []} | {"trial_id": pa.string()}
        return pa.schema(empty).empty_table()
    tables = sorted(tables, key=lambda table: table.num_rows > 0)
    newest = tables[-1].schema
    if all(table.schema.equals(newest, check_metadata=True) for table in tables):
        return pa.concat_tables(tables)
    schema = pa.unify_schemas(
        [table.schema for table in reversed(tables)], promote_options="permissive"
    )
    return pa.concat_tables(
        [schema.empty_table(), *tables], promote_options="permissive"
    )
