"""`help()` says what the stubs say."""

import ast
import inspect
from pathlib import Path

import metachron as mc


def test_the_docs_of_the_module_are_those_of_its_stubs() -> None:
    stubs = ast.parse(Path(mc.__file__).with_name("_metachron.pyi").read_text())
    checked = 0
    for entry in stubs.body:
        if not isinstance(entry, (ast.ClassDef, ast.FunctionDef)) or entry.name.startswith("_"):
            continue
        inner = [part for part in entry.body if isinstance(part, ast.FunctionDef) and not part.name.startswith("_")]
        for node in [entry, *inner]:
            owner = getattr(mc, entry.name)
            real = owner if node is entry else getattr(owner, node.name)
            told = ast.get_docstring(node)
            assert (inspect.getdoc(real) or None) == told, f"{entry.name}.{node.name}"
            checked += told is not None
    assert checked > 60
