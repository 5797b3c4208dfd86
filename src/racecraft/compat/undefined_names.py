"""What stands in a script or a notebook and was never set: AWS's articles print such names. Begin with `unset_names`.

Facts: battlesnake-and-sagemaker-rl.md D.1. A name is looked for before anything runs, for cells that come first may
train for hours; it is said and not refused, because it may stand where nobody comes.
"""

from __future__ import annotations

import ast
import builtins
import symtable
from collections.abc import Collection, Iterator, Sequence

IMPORTS = "Write: from sagemaker.rl import RLEstimator, RLToolkit, RLFramework"
AN_IMAGE = "Any text will do: an image is written down and not used here"
IN_SECONDS = "Set it, in seconds"
NO_NETWORK = "Set it to []: there is no network to choose here"
HINTS = {
    "RLEstimator": IMPORTS,
    "RLToolkit": IMPORTS,
    "RLFramework": IMPORTS,
    "sagemaker": "Write: import sagemaker",
    "boto3": "Write: import boto3",
    "get_execution_role": "Write: from sagemaker import get_execution_role",
    "role": "Write: role = sagemaker.get_execution_role()",
    "sage_session": "Write: sage_session = sagemaker.session.Session()",
    "s3_output_path": "Write: s3_output_path = 's3://{}/'.format(sagemaker.session.Session().default_bucket())",
    "job_name_prefix": "Any text will do, such as 'rl-snake'",
    "image_name": AN_IMAGE,
    "custom_image_name": AN_IMAGE,
    "cpu_image_name": AN_IMAGE,
    "gpu_image_name": AN_IMAGE,
    "default_subnets": NO_NETWORK,
    "default_security_groups": NO_NETWORK,
    "estimator": "Run the cell that makes it first: estimator = RLEstimator(…)",
    "predictor": "Write: predictor = estimator.deploy(initial_instance_count=1, instance_type='local')",
    "secondary_cluster_instance_count": "The article's variable above is called secondary_instance_count",
    "secondary_max_run_tim": "The article means secondary_max_run_time; set that, in seconds",
    "secondary_max_run_time": IN_SECONDS,
    "primary_max_run_time": IN_SECONDS,
    "secondary_cpus_count": "Set it: cores of a secondary machine, times how many there are",
}
"""Names that AWS's articles print and do not set, and what to do about each."""
FROM_ELSEWHERE = {
    *dir(builtins),
    "__file__",
    "__name__",
    "__doc__",
    "__spec__",
    "display",
    "get_ipython",
    "In",
    "Out",
    "_",
}
"""Names that are there without anybody setting them, in a notebook too."""


def sentence(name: str) -> str:
    """Return the sentence about a name that nothing sets.

    >>> sentence("primary_max_run_time")
    'nothing sets primary_max_run_time. Set it, in seconds.'
    """
    return f"nothing sets {name}." + (f" {HINTS[name]}." if name in HINTS else "")


def unset_names(sources: Sequence[str | bytes], given: Collection[str] = ()) -> Iterator[tuple[int, str]]:
    """Yield (index of the source, name) for each name that one of them asks for and none sets, at its first place.

    Args:
        sources: A script, or a notebook's cells; they share their names. What is no Python is passed over, and where
            names come from a * or from `exec`, nothing can be said.
        given: Further names that are there.

    >>> list(unset_names(["x = 1", "def f(): return x + y", "print(f(), y)"]))
    [(1, 'y')]
    """
    trees = [_parsed(source) for source in sources]
    if any(_brings_any_name(node) for tree in trees for node in ast.walk(tree)):
        return
    tables = [symtable.symtable(ast.unparse(tree), "", "exec") for tree in trees]
    known = {name for table in tables for name in _set_by(table)} | FROM_ELSEWHERE | set(given)
    for index, tree in enumerate(trees):
        names = _global_names(tables[index])
        for node in ast.walk(tree):
            if isinstance(node, ast.Name) and node.id in names and node.id not in known:
                known.add(node.id)
                yield index, node.id


def _parsed(source: str | bytes) -> ast.Module:
    try:
        return ast.parse(source)
    except (SyntaxError, ValueError):
        return ast.Module([], [])


def _brings_any_name(node: ast.AST) -> bool:
    """Tell whether a piece of code may set names that cannot be read off it."""
    if isinstance(node, ast.ImportFrom):
        return any(one.name == "*" for one in node.names)
    return isinstance(node, ast.Name) and node.id in ("exec", "globals", "vars", "locals")


def _set_by(table: symtable.SymbolTable) -> set[str]:
    """Return the global names that a source sets, in functions by `global`, too."""
    top = table.get_type() == "module"
    found = {
        one.get_name()
        for one in table.get_symbols()
        if (top or one.is_declared_global()) and (one.is_assigned() or one.is_imported() or one.is_namespace())
    }
    return found.union(*map(_set_by, table.get_children()))


def _global_names(table: symtable.SymbolTable) -> set[str]:
    """Return the names that a source asks the module for, from within functions too."""
    top = table.get_type() == "module"
    found = {one.get_name() for one in table.get_symbols() if one.is_referenced() and (top or one.is_global())}
    return found.union(*map(_global_names, table.get_children()))
