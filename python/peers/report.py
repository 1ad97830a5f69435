"""What the scripts of this folder share: the file that a benchmark of `metachron bench … --peers FILE` reads.

In: the engine's name, rows. Out: JSON. Never here: a scene, an engine's steps.
"""

import importlib
import importlib.metadata
import json
import platform
import sys


def processor():
    """The processor's name, as the benchmarks give it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            for line in lines:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def load(name):
    """An engine's Python module; without it the script ends with the way to it."""
    try:
        return importlib.import_module(name)
    except ImportError:
        sys.exit(f"this needs the Python module {name}, which is not installed: pip install {name}")


def version(name):
    """The version of an engine's package."""
    return importlib.metadata.version(name)


def write(engine, rows, path):
    """Writes `rows`, one a line, to the file `path`, or to standard output where that is None."""
    lines = ",\n".join(f"    {json.dumps(row)}" for row in rows)
    heads = f'  "engine": {json.dumps(engine)},\n  "machine": {json.dumps(processor())},\n'
    text = "{\n" + heads + f'  "rows": [\n{lines}\n  ]\n}}\n'
    if path is None:
        sys.stdout.write(text)
        return
    try:
        with open(path, "w", encoding="utf-8") as out:
            out.write(text)
    except OSError as error:
        sys.exit(f"{path} cannot be written: {error.strerror}")
