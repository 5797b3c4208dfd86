"""Run a stranger's notebook as it stands, as Jupyter would: `python notebook_runner.py NOTEBOOK --bucket FOLDER`.

What a notebook takes for granted and a plain interpreter lacks: lines that begin with ! or %, `display`, and a bucket.
Whatever bucket and prefix are asked for, `boto3` finds the files of FOLDER there. The last line printed is one JSON
object: which code cells ran, and which were left out because they hold one of the --without texts.
"""

import argparse
import ast
import builtins
import json
import re
import subprocess
import sys
from pathlib import Path

OVER_THE_NETWORK = ("pip ", "aws ")


class Bucket:
    """A folder as boto3 shows a bucket: every prefix has the folder's files."""

    folder: Path

    def __init__(self, bucket, key=None):
        self.key, self.objects = key, self

    def filter(self, Prefix):  # noqa: N803 - boto3's word
        files = sorted(path for path in self.folder.rglob("*") if path.is_file())
        return [Bucket("", f"{Prefix.rstrip('/')}/{path.relative_to(self.folder).as_posix()}") for path in files]

    def download_fileobj(self, into):
        parts = self.key.split("/")
        (path,) = [path for k in range(len(parts)) if (path := self.folder.joinpath(*parts[k:])).is_file()][:1]
        into.write(path.read_bytes())


class Resource:
    Bucket = Object = Bucket


def plain(source, names):
    """Return a cell's Python; shell lines become calls, magics go."""
    lines = []
    for line in source.split("\n"):
        word = line.lstrip()
        indent = line[: len(line) - len(word)]
        lines.append(
            f"{indent}_shell({word[1:]!r})" if word[:1] == "!" else indent + "pass" if word[:1] == "%" else line
        )
    names["_shell"] = lambda command: shell(command, names)
    return "\n".join(lines)


def shell(command, names):
    told = re.sub(r"\$(\w+)|\{(\w+)\}", lambda match: str(names.get(match[1] or match[2], match[0])), command)
    if not told.startswith(OVER_THE_NETWORK):
        subprocess.run(told, shell=True, check=False)


def run(path, without):
    """Run the code cells in order; return the numbers of those that ran and of those left out."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    builtins.display = print
    names, ran, left = {"__name__": "__main__"}, [], []
    for number, cell in enumerate(json.loads(path.read_text(encoding="utf-8"))["cells"]):
        source = "".join(cell["source"])
        if cell["cell_type"] != "code" or not source.strip():
            continue
        if any(text in source for text in without):
            left.append(number)
            continue
        where = f"{path.name}, cell {number}"
        tree = ast.parse(plain(source, names), where)
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, where, "exec"), names)
        if last is not None and (value := eval(compile(ast.Expression(last.value), where, "eval"), names)) is not None:
            shown = getattr(value, "_repr_html_", None)
            shown() if shown else repr(value)
        for figure in map(plt.figure, plt.get_fignums()):
            figure.canvas.draw()
        plt.close("all")
        ran.append(number)
    return ran, left


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("notebook", type=Path)
    parser.add_argument("--bucket", type=Path)
    parser.add_argument("--without", action="append", default=[])
    asked = parser.parse_args()
    if asked.bucket:
        import boto3

        Bucket.folder = asked.bucket
        boto3.resource = lambda *_, **__: Resource
    sys.path.insert(0, str(Path.cwd()))
    ran, left = run(asked.notebook, asked.without)
    print("\n" + json.dumps({"ran": ran, "left": left}))


if __name__ == "__main__":
    main()
