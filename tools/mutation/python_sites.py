# SPDX-License-Identifier: MIT
"""Mistakes that can be planted in a Python module, found in its syntax tree. Used by tools/mutants. No I/O.

Not touched: annotations, strings, imports, the condition `if TYPE_CHECKING`, decorators, and `strict=` of zip.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from mutation.sites import Mutant

_COMPARE: dict[type[ast.cmpop], tuple[str, tuple[str, ...]]] = {
    ast.Lt: ("<", ("<=", ">=")),
    ast.LtE: ("<=", ("<", ">")),
    ast.Gt: (">", (">=", "<=")),
    ast.GtE: (">=", (">", "<")),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
    ast.Is: ("is", ("is not",)),
    ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)),
    ast.NotIn: ("not in", ("in",)),
}
_ARITHMETIC: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
    ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
}


class _Finder:
    """Walks one module and collects its mutants."""

    def __init__(self, path: str, source: str) -> None:
        self.path = path
        self.source = source
        self.found: list[Mutant] = []
        self.line_starts = [0]
        for line in source.splitlines(keepends=True):
            self.line_starts.append(self.line_starts[-1] + len(line))
        self.lines = source.splitlines(keepends=True)

    def offset(self, line: int, column: int) -> int:
        """The character offset of a place as ast counts it (columns in bytes of UTF-8)."""
        text = self.lines[line - 1].encode()[:column].decode()
        return self.line_starts[line - 1] + len(text)

    def start(self, node: ast.expr | ast.stmt) -> int:
        return self.offset(node.lineno, node.col_offset)

    def end(self, node: ast.expr | ast.stmt) -> int:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self.offset(node.end_lineno, node.end_col_offset)

    def add(self, node: ast.expr | ast.stmt, kind: str, start: int, end: int, text: str) -> None:
        self.found.append(Mutant(self.path, node.lineno, kind, start, end, text))

    def between(
        self, left: ast.expr, right: ast.expr, kind: str, old: str, news: tuple[str, ...]
    ) -> None:
        """Replaces the operator that stands between two operands."""
        begin, end = self.end(left), self.start(right)
        pattern = r"(?<![\w=<>!*/])" + re.escape(old).replace(r"\ ", r"\s+") + r"(?![\w=<>*/])"
        place = re.search(pattern, self.source[begin:end])
        if place is None:
            return
        for new in news:
            self.add(left, kind, begin + place.start(), begin + place.end(), new)

    def visit(self, node: ast.AST) -> None:
        method = getattr(self, f"visit_{type(node).__name__}", None)
        if method is not None and method(node) is False:
            return
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    self.visit(child)

    def visit_Import(self, _: ast.Import) -> bool:  # noqa: N802 (the names are those of ast)
        return False

    def visit_ImportFrom(self, _: ast.ImportFrom) -> bool:  # noqa: N802
        return False

    def visit_If(self, node: ast.If) -> bool:  # noqa: N802
        return not (isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING")

    def visit_keyword(self, node: ast.keyword) -> bool:
        return node.arg != "strict"  # of zip: itself a check that nothing is meant to reach

    def visit_Compare(self, node: ast.Compare) -> None:  # noqa: N802
        operands = [node.left, *node.comparators]
        for left, operator, right in zip(operands, node.ops, operands[1:], strict=False):
            old, news = _COMPARE[type(operator)]
            self.between(left, right, "compare", old, news)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:  # noqa: N802
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for left, right in zip(node.values, node.values[1:], strict=False):
            self.between(left, right, "logic", old, (new,))

    def visit_BinOp(self, node: ast.BinOp) -> None:  # noqa: N802
        known = _ARITHMETIC.get(type(node.op))
        text = isinstance(node.left, (ast.Constant, ast.JoinedStr)) and not _is_number(node.left)
        if known is not None and not text:
            self.between(node.left, node.right, "arithmetic", known[0], (known[1],))

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:  # noqa: N802
        if isinstance(node.op, (ast.Not, ast.USub)):
            self.add(node, "negation", self.start(node), self.start(node.operand), "")

    def visit_Constant(self, node: ast.Constant) -> None:  # noqa: N802
        value = node.value
        start, end = self.start(node), self.end(node)
        if isinstance(value, bool):
            self.add(node, "boolean", start, end, str(not value))
        elif isinstance(value, int):
            for other in (value + 1, value - 1):
                self.add(node, "constant", start, end, str(other) if other >= 0 else f"({other})")
        elif isinstance(value, float):
            self.add(node, "constant", start, end, repr(value * 1.25 or 1.0))

    def visit_JoinedStr(self, _: ast.JoinedStr) -> bool:  # noqa: N802 (positions within are not exact)
        return False

    def visit_Expr(self, node: ast.Expr) -> bool:  # noqa: N802
        if isinstance(node.value, ast.Constant):
            return False  # a docstring
        self.drop(node)
        return True

    def visit_AugAssign(self, node: ast.AugAssign) -> None:  # noqa: N802
        self.drop(node)

    def visit_Raise(self, node: ast.Raise) -> None:  # noqa: N802
        self.drop(node)

    def drop(self, node: ast.stmt) -> None:
        """Leaves a statement out; the lines stay, so later ones keep their numbers."""
        start, end = self.start(node), self.end(node)
        lines = self.source.count("\n", start, end)
        self.add(node, "statement", start, end, "pass" + "\n" * lines)


def _is_number(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, (int, float, complex))


def find(path: str, source: str) -> Iterator[Mutant]:
    """Every mistake that can be planted in the module."""
    finder = _Finder(path, source)
    finder.visit(ast.parse(source, path))
    yield from finder.found
