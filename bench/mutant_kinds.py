"""Which mutants of a file there are: the operators that `bench.mutants` tries, cosmic-ray's and two of ours, and where.

Not tried is what is no behaviour (annotations, decorators, what only type checkers see, `strict=` of zip, samples of
arguments that something is compiled for). Of what an operator may become one partner is tried that a reader might take
for it: - for +, / for *, and for < both <= and >=.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from typing import Any

from cosmic_ray import plugins
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.work_item import MutationSpec

SWAPPED = {
    **{"Add": ["Sub"], "Sub": ["Add"], "Mul": ["Div"], "Div": ["Mul"], "FloorDiv": ["Div"], "Mod": ["FloorDiv"]},
    **{"Pow": ["Mul"], "BitOr": ["BitAnd"], "BitAnd": ["BitOr"], "BitXor": ["BitAnd"], "LShift": ["RShift"]},
    **{"RShift": ["LShift"], "Lt": ["LtE", "GtE"], "LtE": ["Lt", "Gt"], "Gt": ["GtE", "LtE"], "GtE": ["Gt", "Lt"]},
    **{"Eq": ["NotEq"], "NotEq": ["Eq"], "Is": ["IsNot"], "IsNot": ["Is"]},
}
PLAIN = {
    *("ReplaceUnaryOperator_Delete_Not", "ReplaceUnaryOperator_Delete_USub", "ReplaceUnaryOperator_Delete_Invert"),
    *("AddNot", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd"),
    *("ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ExceptionReplacer", "NumberReplacer"),
    "ZeroIterationForLoop",
}


PAIRS = (("min", "max"), ("minimum", "maximum"), ("any", "all"), ("floor", "ceil"), ("sin", "cos"))
MISTAKEN = {one: two for pair in PAIRS for one, two in (pair, pair[::-1])}


class OtherFunction:
    """Calls the function that is easily mistaken for the one that is called."""

    def mutation_positions(self, node: Any) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
        following = node.get_next_leaf() if node.type == "name" and node.value in MISTAKEN else None
        if following is not None and following.value == "(":
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        node.value = MISTAKEN[node.value]
        return node


class LeftOut:
    """Leaves out a statement that calls something, adds to it, or assigns to an attribute or an item, where a block
    has others."""

    def mutation_positions(self, node: Any) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
        if node.type != "simple_stmt":
            return
        does = node.children[0]
        called = does.type in {"atom_expr", "power"} and does.children[-1].type == "trailer"
        assigned = does.type == "expr_stmt" and (
            does.children[0].type in {"atom_expr", "power"} or getattr(does.children[1], "value", "=") != "="
        )
        if called or assigned:
            yield does.start_pos, does.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        del node.children[0]
        return node


OURS = {"OtherFunction": OtherFunction, "LeftOut": LeftOut}
plugins.OPERATOR_PROVIDERS["ours"] = OURS


def operator_names() -> list[str]:
    """The operators that are tried, with the name of who provides them."""
    found = []
    for name in plugins.operator_names():
        plain = name.partition("/")[2]
        replaced = re.fullmatch(r"Replace(?:Binary|Comparison)Operator_(\w+)_(\w+)", plain)
        if plain in PLAIN or plain in OURS or (replaced and replaced[2] in SWAPPED.get(replaced[1], ())):
            found.append(name)
    return found


@dataclass(frozen=True)
class Mutant:
    """The `occurrence`-th place in a file at which the operator can change something; `rank` draws the sample."""

    file: str
    operator: str
    occurrence: int
    start: tuple[int, int]
    end: tuple[int, int]
    rank: str

    def job(self, source: str) -> str:
        """What its result is kept by: another source is another mutant."""
        return hashlib.sha256(f"{source}|{self.file}|{self.operator}|{self.occurrence}".encode()).hexdigest()[:32]

    def spec(self) -> MutationSpec:
        return MutationSpec(self.file, self.operator, self.occurrence, self.start, self.end)


def no_behaviour(source: str) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """From where to where in a source nothing happens that a test could see."""
    found: list[ast.AST | None] = []
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.arg():
                found.append(node.annotation)
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                found += [node.returns, *node.decorator_list]
            case ast.ClassDef():
                found += node.decorator_list
            case ast.AnnAssign():
                found.append(node.annotation)
            case ast.If(test=ast.Name(id="TYPE_CHECKING")):
                found.append(node)
            case ast.keyword(arg="strict") | ast.Call(func=ast.Attribute(attr="called_with")):
                found.append(node)
    spans = []
    for one in found:
        if isinstance(one, ast.expr | ast.keyword | ast.stmt):
            ends = one.end_lineno or one.lineno, one.end_col_offset or one.col_offset
            spans.append(((one.lineno, one.col_offset), ends))
    return spans


def mutants_of(file: str, source: str, seed: int) -> list[Mutant]:
    """All of a file. The rank is by what is changed, not by where: an edit leaves the sample elsewhere as it is."""
    tree, silent, lines = get_ast(source), no_behaviour(source), source.splitlines()
    nodes = list(ast_nodes(tree))
    times: dict[tuple[str, str], Iterator[int]] = {}
    found = []
    for name in operator_names():
        operator = plugins.get_operator(name)()
        places = ((node, place) for node in nodes for place in operator.mutation_positions(node))
        for occurrence, (node, (start, end)) in enumerate(places):
            line = lines[start[0] - 1].strip()
            nth = next(times.setdefault((name, line), count()))
            signature = node.parent is not None and node.parent.type == "parameters"  # its bare * or /
            if not signature and not any(begins <= start and end <= ends for begins, ends in silent):
                rank = hashlib.sha256(f"{seed}|{file}|{name}|{line}|{nth}".encode()).hexdigest()
                found.append(Mutant(file, name, occurrence, start, end, rank))
    return found


def compiles(mutant: Mutant, source: str) -> bool:
    """Whether it is a program at all: ** in a dict's display is none of the operators that it looks like."""
    changed_source = mutate_code(source, plugins.get_operator(mutant.operator)(), mutant.occurrence)
    try:
        return changed_source is not None and ast.dump(ast.parse(changed_source)) != ast.dump(ast.parse(source))
    except SyntaxError:
        return False
