"""Small files and functions, a small repository."""

from __future__ import annotations

import ast

import pytest

from tests.rules.source import ROOT, Module, modules, tracked_files

LINES_OF_FUNCTION = 60
LINES_OF_FILE = 300
MEGABYTES_OF_FILE = 10
MEGABYTES_OF_REPOSITORY = 60


# A migration is a list of tables, as long as there are tables.
WRITTEN = [module for module in modules() if "migrations/versions" not in str(module)]


@pytest.mark.parametrize("module", WRITTEN, ids=str)
def test_functions_and_files_stay_small(module: Module) -> None:
    assert len(module.path.read_text().splitlines()) <= LINES_OF_FILE
    long = {
        node.name: lines
        for node in ast.walk(module.tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and (lines := _lines_without_docstring(node)) > LINES_OF_FUNCTION
    }
    assert not long


def _lines_without_docstring(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    assert function.end_lineno is not None
    lines = function.end_lineno - function.lineno + 1
    first = function.body[0]
    if ast.get_docstring(function) is not None and first.end_lineno is not None:
        lines -= first.end_lineno - first.lineno + 1
    return lines


def test_no_file_is_large_and_the_repository_is_not_either() -> None:
    sizes = {str(path.relative_to(ROOT)): path.stat().st_size for path in tracked_files()}
    assert not {name: size for name, size in sizes.items() if size > MEGABYTES_OF_FILE * 10**6}
    assert sum(sizes.values()) < MEGABYTES_OF_REPOSITORY * 10**6
