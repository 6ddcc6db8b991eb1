"""Makes the stubs of the package: type checkers and editors see the arguments of each function by their names.

    make_stubs.py SOURCES FOLDER

Functions of the package take most of their arguments as ``**arguments``, which one class describes for all of them, a
TypedDict. Type checkers understand that as an experiment at most, and mypy of Debian 12 would let misspelt names pass.
A stub `name.pyi`, beside the module `name.py`, has each argument in its place, and the docstring with the descriptions.
Modules with such functions have one; of others, whose signatures are whole, checkers read the code.

It reads the sources and imports nothing, so that a build needs neither numpy nor gRPC.
"""

from __future__ import annotations

import ast
import copy
import inspect
import pathlib
import sys
from collections.abc import Iterator
from typing import Union

MODULES = ("__init__", "_client", "_sessions", "aio")
_HEAD = "# Made of {name}.py by make_stubs.py.\n"
Function = Union[ast.FunctionDef, ast.AsyncFunctionDef]
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
# Names that a stub has no use for.
_RUNTIME_ONLY = {"Unpack"}


class Module:
    """One module of the package: its tree, and the places of the names that it imports."""

    def __init__(self, path: pathlib.Path) -> None:
        self.name = path.stem
        self.tree = ast.parse(path.read_text(encoding="utf-8"))
        self.imports: dict[str, ast.stmt] = {}
        for node in ast.walk(self.tree):
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                for alias in node.names:
                    one = copy.copy(node)
                    one.names = [alias]
                    self.imports[alias.asname or alias.name.partition(".")[0]] = one
        self.classes = {node.name: node for node in self.tree.body if isinstance(node, ast.ClassDef)}
        self.own = set(self.classes) | {node.name for node in self.tree.body if isinstance(node, _FUNCTIONS)}
        for node in self.tree.body:
            if isinstance(node, ast.Assign):
                self.own |= {target.id for target in node.targets if isinstance(target, ast.Name)}

    def import_of(self, name: str) -> ast.stmt | None:
        """The statement by which another module of the package has `name`; None for a builtin."""
        if name in self.imports:
            return self.imports[name]
        if name in self.own:
            return ast.ImportFrom(module=self.name, names=[ast.alias(name=name)], level=1)
        return None


class Package:
    """The modules of the package, and the classes that describe arguments."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.modules = {path.stem: Module(path) for path in sorted(folder.glob("*.py"))}
        self.home = {name: module for module in self.modules.values() for name in module.classes}

    def kinds_of(self, kind: str) -> list[str]:
        """A TypedDict and its bases, which come first; each once."""
        bases = [_name(base) for base in self.home[kind].classes[kind].bases]
        found = [one for base in bases if base in self.home for one in self.kinds_of(base)]
        return list(dict.fromkeys([*found, kind]))

    def arguments_of(self, kind: str) -> Iterator[tuple[Module, ast.AnnAssign]]:
        """The keys of a TypedDict, those of its bases first, and the module of each."""
        for name in self.kinds_of(kind):
            for one in self.home[name].classes[name].body:
                if isinstance(one, ast.AnnAssign):
                    yield self.home[name], one

    def methods_of(self, module: Module, of_class: str, name: str) -> tuple[Module, list[Function]]:
        """The methods `name` of a class, or else of a base of it, and the module that has them."""
        node = module.classes[of_class]
        found = [one for one in node.body if isinstance(one, _FUNCTIONS) and one.name == name]
        for base in (_name(one) for one in node.bases if not found):
            if not found and base in self.home:
                module, found = self.methods_of(self.home[base], base, name)
        return module, found

    def description_of(self, kind: str) -> str:
        """The docstrings of a TypedDict and of its bases, which describe its keys."""
        documents = (ast.get_docstring(self.home[name].classes[name]) for name in self.kinds_of(kind))
        return "\n".join(inspect.cleandoc(one) for one in documents if one is not None and " : " in one)


class Stub:
    """The stub of a module."""

    def __init__(self, package: Package, name: str) -> None:
        self._package = package
        self._module = package.modules[name]
        self._body: list[ast.stmt] = []
        self._needed: dict[str, ast.stmt] = {}  # imports of other modules, for annotations that come from there

    def text(self) -> str:
        """The source of the stub."""
        for node in self._module.tree.body:
            self._add(node)
        used = {node.id for one in self._body for node in ast.walk(one) if isinstance(node, ast.Name)}
        used |= self._exported()
        imports = [*self._own_imports(used), *map(ast.unparse, self._needed.values())]
        body = "\n\n".join(ast.unparse(ast.fix_missing_locations(one)) for one in self._body)
        return _HEAD.format(name=self._module.name) + "\n".join(dict.fromkeys(imports)) + "\n\n" + body + "\n"

    def _exported(self) -> set[str]:
        for node in self._module.tree.body:
            if isinstance(node, ast.Assign) and _name(node.targets[0]) == "__all__":
                return set(ast.literal_eval(node.value))
        return set()

    def _own_imports(self, used: set[str]) -> Iterator[str]:
        for name, node in self._module.imports.items():
            if name in used and name not in _RUNTIME_ONLY:
                yield ast.unparse(node)

    def _add(self, node: ast.stmt) -> None:
        """Takes a statement of the module over, if it is one for others."""
        if isinstance(node, _FUNCTIONS) and not node.name.startswith("_"):
            self._body += self._functions([node])
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            self._body.append(self._class(node))
        elif isinstance(node, ast.Assign) and not _is_variable_of_types(node):
            name = _name(node.targets[0])
            if _is_public(name) or name == "__all__":
                self._body.append(node)

    def _class(self, node: ast.ClassDef) -> ast.ClassDef:
        known = {_name(one.target) for one in node.body if isinstance(one, ast.AnnAssign)}
        methods = [one for one in node.body if isinstance(one, _FUNCTIONS)]
        for attribute in sorted({name for method in methods for name in _public_attributes(method)} - known):
            raise SystemExit(f"make_stubs: {self._module.name}.{node.name}.{attribute} has no type in the class")
        body: list[ast.stmt] = [one for one in node.body if isinstance(one, ast.AnnAssign)]
        for name in dict.fromkeys(one.name for one in methods if _is_public(one.name) or one.name.endswith("__")):
            body += self._functions([one for one in methods if one.name == name], node.name)
        document = ast.get_docstring(node)
        if document is not None:
            init = next((one for one in methods if one.name == "__init__"), None)
            kind = None if init is None else _kind_of_arguments(init)
            body.insert(0, _expression(self._whole(document, kind, 4)))
        made = ast.ClassDef(name=node.name, bases=node.bases, keywords=node.keywords, decorator_list=[], body=body)
        made.body = made.body or [ast.Expr(ast.Constant(...))]
        return made

    def _functions(self, nodes: list[Function], of_class: str = "") -> list[Function]:
        """The stubs of a function: one, or one for each of its overloads, of which the first has the docstring."""
        document = ast.get_docstring(nodes[-1])
        if of_class and nodes[-1].args.kwarg is not None and _name(nodes[-1].args.kwarg.annotation) == "Any":
            return self._stubs_of_models(nodes[-1], of_class)
        overloads = nodes[:-1] or nodes
        return [self._function(node, of_class, document if node is overloads[0] else None) for node in overloads]

    def _function(self, node: Function, of_class: str, document: str | None) -> Function:
        made = copy.deepcopy(node)
        kept = ("property", "classmethod", "overload")
        made.decorator_list = [one for one in made.decorator_list if _name(one) in kept]
        kind = _kind_of_arguments(node)
        if kind is not None:
            made.args.kwarg = None
            for module, one in self._package.arguments_of(kind):
                name, annotation = _name(one.target), _optional(one.annotation)
                self._append_argument(made.args, name, annotation, ast.Constant(None), module)
        made.body = [ast.Expr(ast.Constant(...))]
        if document is not None:
            made.body.insert(0, _expression(self._whole(document, kind, 8 if of_class else 4)))
        return made

    def _stubs_of_models(self, node: Function, of_class: str) -> list[Function]:
        """A method that hands ``**options`` on has the arguments of the one of `Session` that it awaits."""
        name = "__init__" if node.name == "create" else node.name
        module, models = self._package.methods_of(self._package.modules["_sessions"], of_class, name)
        found = []
        for model in Stub(self._package, module.name)._functions(models, of_class):
            made = copy.deepcopy(node)
            made.args.kwarg = None
            for argument, default in zip(model.args.kwonlyargs, model.args.kw_defaults):
                homes = (at for at, one in self._arguments_of(models[-1]) if _name(one.target) == argument.arg)
                self._append_argument(made.args, argument.arg, argument.annotation, default, next(homes, module))
            document = ast.get_docstring(node if name == "__init__" else model)
            made.body = [ast.Expr(ast.Constant(...))]
            if document is not None:
                made.body.insert(0, _expression(self._whole(document, None, 8)))
            if len(models) > 1:
                made.decorator_list.append(ast.Name("overload", ast.Load()))
                made.returns = model.returns
                self._need(ast.Name("overload", ast.Load()), module)
                self._need(model.returns, module)
            found.append(made)
        return found

    def _arguments_of(self, node: Function) -> list[tuple[Module, ast.AnnAssign]]:
        kind = _kind_of_arguments(node)
        return [] if kind is None else list(self._package.arguments_of(kind))

    def _append_argument(
        self, arguments: ast.arguments, name: str, annotation: ast.expr | None, default: ast.expr | None, home: Module
    ) -> None:
        assert annotation is not None
        arguments.kwonlyargs.append(ast.arg(arg=name, annotation=annotation))
        arguments.kw_defaults.append(default)
        self._need(annotation, home)

    def _need(self, expression: ast.expr | None, home: Module) -> None:
        """Has the names of an expression of another module imported."""
        for node in ast.walk(expression) if expression is not None and home is not self._module else ():
            if isinstance(node, ast.Name) and node.id not in self._module.imports:
                found = home.import_of(node.id)
                if found is not None:
                    self._needed[node.id] = found

    def _whole(self, document: str, kind: str | None, indent: int) -> str:
        """A docstring in the place of whose "**arguments" the descriptions of the arguments stand."""
        if kind is not None:
            document = document.replace("**arguments", self._package.description_of(kind))
        lines = document.splitlines()
        return "\n".join([*lines[:1], *(" " * indent + line if line else "" for line in lines[1:])]) + (
            "\n" + " " * indent if len(lines) > 1 else ""
        )


def _name(node: ast.AST | None) -> str:
    """The name that a node is, or the last part of one with points; empty for others."""
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


def _is_variable_of_types(node: ast.Assign) -> bool:
    return isinstance(node.value, ast.Call) and _name(node.value.func) == "TypeVar"


def _is_public(name: str) -> bool:
    return bool(name) and not name.startswith("_")


def _public_attributes(method: Function) -> Iterator[str]:
    """The attributes that a method sets on its object, as other code may read them."""
    for node in ast.walk(method):
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            if _name(node.value) == "self" and _is_public(node.attr):
                yield node.attr


def _kind_of_arguments(node: Function) -> str | None:
    """The TypedDict of the ``**arguments`` of a function."""
    keywords = node.args.kwarg
    if keywords is None or not isinstance(keywords.annotation, ast.Subscript):
        return None
    return _name(keywords.annotation.slice)


def _optional(annotation: ast.expr) -> ast.expr:
    """The annotation of an argument for which None stands for nothing."""
    if _name(annotation) == "Any":
        return annotation
    return ast.BinOp(left=annotation, op=ast.BitOr(), right=ast.Constant(None))


def _expression(text: str) -> ast.Expr:
    return ast.Expr(ast.Constant(text))


def make_stubs(sources: pathlib.Path, folder: pathlib.Path) -> None:
    """Writes the stubs of the package `sources` to `folder`."""
    package = Package(sources)
    folder.mkdir(parents=True, exist_ok=True)
    for name in MODULES:
        (folder / f"{name}.pyi").write_text(Stub(package, name).text(), encoding="utf-8")


if __name__ == "__main__":
    make_stubs(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
