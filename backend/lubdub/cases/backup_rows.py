"""The rows of all tables as lines of JSON, of any database: a case's own together, sealed under the case's key.

Whoever destroys the case's key makes its rows unreadable in every backup there is, as it does with its files.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterator
from datetime import datetime
from typing import Any, Literal

import sqlalchemy as sa

from lubdub.cases.errors import FileNotFound
from lubdub.cases.sealing import backup_rows_key, unwrap_key, wrap_key

LEFT_OUT = frozenset(
    {"alembic_version", "case_keys", "service_keys", "workers"}
    | {"drafts", "challenges", "attempts", "access_tokens", "clinician_sessions"}
)
"""Keys are in the keyring; the rest lasts minutes or hours, and whoever had it signs in or answers again."""
TRAIL = "audit"
"""Names cases by their ids, says nothing about people, and outlives them."""
AT_ONCE = 500

Row = dict[str, Any]
Line = dict[str, Any]
CaseKey = Callable[[str], bytes]


def reflected(connection: sa.Connection) -> sa.MetaData:
    """The tables as they are in this database, whatever its revision."""
    tables = sa.MetaData()
    tables.reflect(connection)
    for table in tables.tables.values():
        for column in table.columns:
            if isinstance(column.type, sa.JSON):
                column.type = sa.JSON(none_as_null=True)
    return tables


def lines(connection: sa.Connection, case_key: CaseKey) -> Iterator[tuple[Line, list[tuple[str, str]]]]:
    """Every line of a backup, and the (case, object) pairs it points at. Rows others depend on come first."""
    tables = reflected(connection).sorted_tables
    kept = [table for table in tables if table.name not in LEFT_OUT]
    of_cases = {table.name: case_column(table) for table in kept if table.name != TRAIL}
    for table in kept:
        if of_cases.get(table.name) is None:
            for row in connection.execute(sa.select(table).execution_options(yield_per=AT_ONCE)):
                yield {"table": table.name, "row": _encoded(row._asdict())}, []
    yield from _case_lines(connection, [table for table in kept if of_cases.get(table.name) is not None], case_key)


def case_column(table: sa.Table) -> sa.Column[Any] | None:
    """The column that says to which case a row belongs; of a table one step away for parts of uploads."""
    if table.name == "cases":
        return table.c.id
    if "case_id" in table.c:
        return table.c.case_id
    for key in table.foreign_keys:
        if "case_id" in key.column.table.c:
            return key.column.table.c.case_id
    return None


def sealed_rows(case_id: str, rows: list[tuple[str, Row]], data_key: bytes) -> Line:
    """A case's rows as one line."""
    plain = json.dumps([[name, _encoded(row)] for name, row in rows]).encode()
    sealed = wrap_key(backup_rows_key(data_key), plain, f"rows of {case_id}")
    return {"case": case_id, "sealed": base64.b64encode(sealed).decode()}


def opened_rows(line: Line, data_key: bytes) -> list[tuple[str, Row]]:
    """The rows back. Raises SealBroken."""
    plain = unwrap_key(backup_rows_key(data_key), base64.b64decode(line["sealed"]), f"rows of {line['case']}")
    return [(name, decoded(row)) for name, row in json.loads(plain)]


def decoded(row: Row) -> Row:
    """A row as the database takes it."""
    return {name: _from_json(value) for name, value in row.items()}


def _case_lines(
    connection: sa.Connection, tables: list[sa.Table], case_key: CaseKey
) -> Iterator[tuple[Line, list[tuple[str, str]]]]:
    walks = [_Walk(connection, table) for table in tables if table.name != "cases"]
    cases = next(table for table in tables if table.name == "cases")
    in_order = sa.select(cases).order_by(_bytewise(connection, cases.c.id)).execution_options(yield_per=AT_ONCE)
    for case in connection.execute(in_order):
        own: list[tuple[str, Row]] = []
        for walk in walks:
            for row in walk.before(case.id):
                yield {"table": walk.name, "row": _encoded(row)}, []
            own += [(walk.name, row) for row in walk.of(case.id)]
        if case.deleted_at is not None:
            for name, row in [("cases", case._asdict()), *own]:
                yield {"table": name, "row": _encoded(row)}, []
            continue
        try:
            line = sealed_rows(case.id, [("cases", case._asdict()), *own], case_key(case.id))
        except FileNotFound:  # deleted since this moment: the keyring will say so, and nothing more is kept
            yield {"case": case.id}, []
            continue
        yield line, [(case.id, row["object_key"]) for _, row in own if "object_key" in row]
    for walk in walks:
        for row in walk.before(None):
            yield {"table": walk.name, "row": _encoded(row)}, []


def _bytewise(connection: sa.Connection, text: sa.ColumnElement[Any]) -> sa.ColumnElement[Any]:
    """In an order that Python's comparison agrees with; PostgreSQL has its locale's otherwise."""
    return text if connection.dialect.name == "sqlite" else sa.collate(text, "C")


class _Walk:
    """One table's rows in the order of their cases, beside a walk through the cases themselves."""

    def __init__(self, connection: sa.Connection, table: sa.Table) -> None:
        self.name = table.name
        column = case_column(table)
        of_case = _bytewise(connection, sa.func.coalesce(column, ""))
        query = sa.select(table, of_case.label("of_case"))
        if column is not None and column.table is not table:
            query = query.join(column.table)
        ordered = query.order_by(of_case, *table.primary_key.columns)
        self._rows = iter(connection.execute(ordered.execution_options(yield_per=AT_ONCE)))
        self._next = next(self._rows, None)

    def before(self, case_id: str | None) -> Iterator[Row]:
        """Rows of no case that is here; all that are left for None."""
        while self._next is not None and (case_id is None or self._next.of_case < case_id):
            yield self._taken()

    def of(self, case_id: str) -> Iterator[Row]:
        """The case's own."""
        while self._next is not None and self._next.of_case == case_id:
            yield self._taken()

    def _taken(self) -> Row:
        assert self._next is not None  # nosec B101
        row = self._next._asdict()
        del row["of_case"]
        self._next = next(self._rows, None)
        return row


def _encoded(row: Row) -> Row:
    return {name: _to_json(value) for name, value in row.items()}


def _to_json(value: Any) -> Any:
    kind: Literal["time", "bytes", "value"]
    if isinstance(value, datetime):
        kind, value = "time", value.isoformat()
    elif isinstance(value, bytes | memoryview):
        kind, value = "bytes", base64.b64encode(value).decode()
    else:
        kind = "value"
    return value if kind == "value" and not isinstance(value, dict) else {kind: value}


def _from_json(value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    if "time" in value:
        return datetime.fromisoformat(value["time"])
    return base64.b64decode(value["bytes"]) if "bytes" in value else value["value"]
