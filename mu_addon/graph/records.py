"""Records of evaluations in a folder, by the keys of nodes, for a refresh, which starts no run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import write_json
from ..reading import file_bytes, is_number, parse_json
from .evaluation import CACHED, State

FOLDER = "nodes"
"""Folder of the runs within that of the tree."""
NAME = "records.json"
# No file of records is longer, in bytes; of more records the oldest are dropped.
LONGEST, MOST_RECORDS = 1 << 24, 5000


def read_records(folder: Path) -> dict[str, State]:
    """States of nodes by key of a tree's folder, without those whose run is missing or that are invalid."""
    try:
        found = parse_json(file_bytes(folder / FOLDER / NAME, LONGEST), NAME)
    except (OSError, InputError):
        return {}
    tables = found.get("records") if isinstance(found, dict) else None
    if not isinstance(tables, dict):
        return {}
    records = {key: _record(table, folder) for key, table in tables.items()}
    return {key: record for key, record in records.items() if record is not None}


def write_records(folder: Path, records: Mapping[str, State]) -> None:
    """Write records by key into a tree's folder, the latest last. Raises OutputError."""
    latest = list(records.items())[-MOST_RECORDS:]
    tables = {
        key: {
            "remark": record.remark,
            "cost_s": round(record.cost_s, 4),
            "numbers": dict(record.numbers),
            **({"run": record.folder.name} if record.folder is not None else {}),
        }
        for key, record in latest
    }
    write_json(folder / FOLDER / NAME, {"format": 1, "records": tables})


def _record(table: Any, folder: Path) -> State | None:
    if not isinstance(table, dict):
        return None
    remark, numbers, run = table.get("remark", ""), table.get("numbers", {}), table.get("run")
    cost = table.get("cost_s", 0.0)
    if not (isinstance(remark, str) and isinstance(numbers, dict) and all(map(is_number, numbers.values()))):
        return None
    if not is_number(cost):
        return None
    if run is None:
        return State(CACHED, cost_s=cost, remark=remark, numbers=numbers)
    # A name alone: a path out of the folder is no run of this tree.
    if not isinstance(run, str) or Path(run).name != run or not (folder / FOLDER / run).is_dir():
        return None
    return State(CACHED, cost_s=cost, remark=remark, folder=folder / FOLDER / run, numbers=numbers)
