"""Types of the names of a function for lanes, and differences from lane to lane."""

import ast
import builtins
from collections import Counter
from collections.abc import Callable
from typing import Any

from numba import types

from kernels.lanes import rows
from kernels.lanes.calls import named_by, plain_of
from kernels.lanes.rows import holds_lanes, is_named, is_tuple
from kernels.lanes.syntax import names_in, stores_in, tree_of
from kernels.lanes.vectors import WHOLE

SAME_IN_ALL: set[Callable[..., Any]] = set()
"""Functions with an equal result in all lanes, for any arguments."""
LIKE_FIRST: set[Callable[..., Any]] = set()
"""Functions that return the type of the first argument."""


class NotForLanesError(Exception):
    """Error of a function that cannot be written for lanes; with the reason."""


class Facts:
    """Knowledge about one plain function, for arguments of the types `kinds`.

    `varying` are the names that differ from lane to lane. In a loop, a read of a name
    may precede the assignment that makes the name varying. So a function is converted
    again until no name is new. `known` are the types of names with a single value, if
    the type can be determined.
    """

    def __init__(self, plain: Callable[..., Any], kinds: dict[str, Any]) -> None:
        self.kinds = kinds
        self.tree = tree_of(plain)
        self.globals: dict[str, Any] = dict(plain.__globals__)
        self.names = names_in(self.tree)
        stores = Counter(stores_in(self.tree))
        self.assigned = set(stores)
        elsewhere = vars(builtins) | self.globals
        for name in self.assigned | kinds.keys():
            elsewhere.pop(name, None)
        self._elsewhere = elsewhere
        self.once = {name for name, count in stores.items() if count == 1}
        self.varying = {name for name, kind in kinds.items() if holds_lanes(kind)}
        self.known = {
            name: kind for name, kind in kinds.items() if name not in self.assigned
        }

    def kind(self, node: ast.expr) -> Any:
        """Return the type of an expression, None if unknown."""
        match node:
            case ast.Name():
                return self.known.get(node.id)
            case ast.Attribute():
                return _kind_of_part(self.kind(node.value), node.attr)
            case ast.Subscript():
                container = self.kind(node.value)
                if isinstance(container, rows.Rows):
                    return container.vector
                if isinstance(container, types.Array) and not self.differs(node.slice):
                    return container.dtype
            case ast.Call(_, [first, *_]) if plain_of(self.called(node)) in LIKE_FIRST:
                return self.kind(first)
            case ast.IfExp() if not self.differs(node.test):
                kind = self.kind(node.body)
                return kind if kind == self.kind(node.orelse) else None
        return None

    def differs(self, node: ast.AST) -> bool:
        """Return whether an expression may differ from lane to lane."""
        if isinstance(node, ast.expr) and (known := self.kind(node)) is not None:
            return holds_lanes(known)
        if isinstance(node, ast.Name):
            return node.id in self.varying
        if isinstance(node, ast.Call):
            if plain_of(self.called(node)) in SAME_IN_ALL:
                return False
            return self.draws(node) or any(map(self.differs, node.args))
        return any(map(self.differs, ast.iter_child_nodes(node)))

    def called(self, node: ast.Call) -> Any:
        """Return the function of a call by `name` or by `module.name`.

        Returns None if the function is unknown.
        """
        return named_by(node.func, self._elsewhere)

    def holds(self, node: ast.expr, *classes: type[Any]) -> bool:
        """Return whether an expression is known to be a tuple of any of the classes."""
        kind = self.kind(node)
        return is_named(kind) and kind.instance_class in classes

    def counts(self, node: ast.expr) -> bool:
        """Return whether an expression is known to be the counted events of a model."""
        kind = self.kind(node)
        return isinstance(kind, rows.Rows) and kind.vector is WHOLE

    def draws(self, node: ast.Call) -> bool:
        """Return whether a call draws from the generators of the lanes."""
        method = node.func
        return isinstance(method, ast.Attribute) and self.is_random(method.value)

    def is_random(self, node: ast.expr) -> bool:
        """Return whether an expression is known to be the generators of the lanes."""
        return _holds_generators(self.kind(node))


def _kind_of_part(container: Any, name: str) -> Any:
    """Return the type of an attribute of an object of a type."""
    if is_named(container):
        return dict(zip(container.fields, container.types, strict=True)).get(name)
    return types.intp if isinstance(container, rows.Rows | types.Array) else None


def _holds_generators(kind: Any) -> bool:
    if is_tuple(kind):
        return any(map(_holds_generators, kind.types))
    return isinstance(kind, types.NumPyRandomGeneratorType)
