"""Imports point down: one core, worlds as packages. Type-checking blocks, lazy imports and names in strings count.

The lists of known exceptions only shrink: an entry that is no longer needed fails, too.
"""

import ast
import re
from functools import cache
from pathlib import Path

import racecraft

PACKAGE = Path(racecraft.__file__).parent

LAYERS = (
    "contract", "isolation", "kernels", "settings", "pages", "web", "formats", "storage", "database",
    "files", "tracks",
    "algorithms", "adapters", "env", "adapter", "logs",
    "rollout", "players", "evaluation", "driving",
    "analysis", "export", "training", "notebooks",
    "accounts", "jobs", "league", "cluster",
    "sagemaker", "compat", "estimator",
    "serving", "actions", "lessons", "console", "cli",
    "kind",
)  # fmt: skip
"""From the lowest up, one order for the core's packages and for those inside a world."""

KNOWS_WORLDS = ("worlds", "sagemaker", "compat")
"""Packages of the core that may name a world."""

HEAVY = {
    "torch": {"algorithms", "rollout", "export", "analysis", "training", "compat"},
    "ray": {"cluster"},
    "mlflow": {"training"},
    "grpc": {"env"},
    "sqlalchemy": {"database", "jobs", "accounts", "console"},
    "argon2": {"accounts"},
    "alembic": {"database"},
    "optuna": {"jobs"},
    "matplotlib": {"analysis", "tracks"},
    "av": {"analysis"},
    "casadi": {"driving"},
    "onnx": {"export"},
    "onnxruntime": {"export"},
    "openvino": {"export"},
    "tensorflow": {"export"},
    "pandas": {"analysis", "jobs", "logs", "sagemaker"},
    "boto3": {"storage"},
    "starlette": {"web", "serving", "lessons", "console"},
    "uvicorn": {"web"},
    "jinja2": {"pages"},
}
"""What is slow to import, and the layers that may import it."""

KNOWN_UPWARD = {
    "worlds.gymnasium.evaluation -> compat.script_worlds",
}


def module_of(path):
    parts = ["racecraft", *path.relative_to(PACKAGE).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {
    module_of(path): path
    for path in sorted(PACKAGE.rglob("*.py"))
    if not {"names", "lent"} & set(path.relative_to(PACKAGE).parts)
}


def imported_names(node):
    """Yield every dotted name that an import statement imports."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        assert node.level == 0, "imports inside the package are written out in full"
        for alias in node.names:
            whole = f"{node.module}.{alias.name}"
            yield whole if whole in FILES else node.module


def named_in_strings(node):
    """Yield the "racecraft.a.b" that a string begins with: a module that is imported by name."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield from re.findall(r"^racecraft(?:\.\w+)+", node.value)


@cache
def imports():
    """Return what each finder (the two above) finds in every module: {finder: {module: names}}."""
    found = {imported_names: {}, named_in_strings: {}}
    for name, path in FILES.items():
        nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        for find, names in found.items():
            names[name] = {one for node in nodes for one in find(node)} - {name}
    return found


def pairs(*finders):
    """Yield (module, imported module) for every import between modules of the package."""
    for find in finders or (imported_names, named_in_strings):
        yield from ((name, one) for name, used in imports()[find].items() for one in sorted(used & FILES.keys()))


def world_of(name):
    parts = name.split(".")
    return parts[2] if parts[1:2] == ["worlds"] and len(parts) > 2 else None


def layer_of(name):
    """Return the layer of a module: its package, inside a world the world's package; None for what has no layer."""
    parts = name.split(".")[1:]
    inside = parts[2:] if parts[:1] == ["worlds"] else parts
    return inside[0] if inside else None


def shown(found):
    return {f"{name.removeprefix('racecraft.')} -> {used.removeprefix('racecraft.')}" for name, used in found}


def test_the_core_knows_no_world():
    crossing = {
        (name, used)
        for name, used in pairs()
        if world_of(used) and name.split(".")[1:2] not in [[known] for known in KNOWS_WORLDS]
    }
    assert shown(crossing) == set()


def test_worlds_do_not_import_each_other():
    crossing = {(name, used) for name, used in pairs() if world_of(name) and world_of(used)}
    assert shown((name, used) for name, used in crossing if world_of(name) != world_of(used)) == set()


def test_imports_point_down():
    order = {layer: height for height, layer in enumerate(LAYERS)}
    rising = set()
    for name, used in pairs():
        above, below = layer_of(name), layer_of(used)
        crossing = world_of(used) and world_of(name) != world_of(used)
        if above in (None, "__main__") or below is None or above == below or crossing:
            continue
        if order[below] > order[above]:
            rising.add((name, used))
    assert shown(rising) == KNOWN_UPWARD


def test_there_is_no_circle():
    """Modules that reach each other, lazy imports included; a package that gathers its own modules is no circle."""
    graph = {name: set() for name in FILES}
    for name, used in pairs(imported_names):
        if FILES[used].name != "__init__.py" and FILES[name].name != "__init__.py":
            graph[name].add(used)
    assert [sorted(circle) for circle in circles(graph)] == []


def circles(graph):
    """Yield the sets of two or more modules that reach each other, by Tarjan's algorithm."""
    index, low, stack, waiting = {}, {}, [], set()

    def visit(name):
        index[name] = low[name] = len(index)
        stack.append(name)
        waiting.add(name)
        for used in graph[name]:
            if used not in index:
                yield from visit(used)
                low[name] = min(low[name], low[used])
            elif used in waiting:
                low[name] = min(low[name], index[used])
        if low[name] == index[name]:
            circle = stack[stack.index(name) :]
            del stack[stack.index(name) :]
            waiting.difference_update(circle)
            if len(circle) > 1:
                yield circle

    for name in graph:
        if name not in index:
            yield from visit(name)


def test_heavy_packages_enter_at_few_places():
    strays = [
        f"{name} -> {used}"
        for name, imported in imports()[imported_names].items()
        for used in imported
        if (heavy := used.split(".")[0]) in HEAVY and layer_of(name) not in HEAVY[heavy]
    ]
    assert strays == []
