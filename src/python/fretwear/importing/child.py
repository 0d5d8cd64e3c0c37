"""Runs third-party readers in a child process with limits on memory and time: `python -m fretwear.importing.child`.

The child process writes arrays as NPZ and other results as JSON. The parent process therefore executes no code from its results.
"""

from __future__ import annotations

import importlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

from fretwear.importing import Rejected

#: Memory limit of the child process in bytes: a constant part, and a part per byte of its files.
MEMORY, MEMORY_PER_BYTE = 4 << 30, 64
#: Time limit of the child process in s: a constant part, and a part per MB of its files.
SECONDS, SECONDS_PER_MB = 120.0, 5.0
#: Largest number of characters of an error text in a message.
SHOWN = 300


def _limits(files: list[Path]) -> tuple[int, float]:
    size = sum(file.stat().st_size for file in files if file.is_file())
    memory = float(os.environ.get("FRETWEAR_IMPORT_MEMORY", 0)) * (1 << 30)
    seconds = float(os.environ.get("FRETWEAR_IMPORT_SECONDS", 0))
    return int(memory or MEMORY + MEMORY_PER_BYTE * size), seconds or SECONDS + SECONDS_PER_MB * size / 1e6


def call(function: str, arguments: dict[str, Any], *, files: list[Path], library: str, extra: str) -> dict[str, Any]:
    """Calls a function ("module:name") in a child process. Returns its result, a dictionary of JSON values and NumPy arrays.

    - `files`: the files that the function reads.
    - `library`: the third-party package that reads the files.
    - `extra`: the extra of the package fretwear that installs `library`.

    Raises Rejected if the function fails or exceeds a limit.
    """
    import numpy as np

    names = ", ".join(str(file) for file in files)
    memory, seconds = _limits(files)
    package = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
    # One thread per library, because each thread reserves memory.
    quiet = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    environment = os.environ | quiet | {"PYTHONPATH": path, "MPLBACKEND": "agg"}
    with tempfile.TemporaryDirectory(prefix="fretwear-import-") as folder, tempfile.TemporaryFile() as said:
        task = {"function": function, "arguments": arguments, "memory": memory}
        Path(folder, "task.json").write_text(json.dumps(task), encoding="utf-8")
        command = [sys.executable, "-m", "fretwear.importing.child", folder]
        try:
            code = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=said, stderr=said, env=environment, timeout=seconds).returncode
        except subprocess.TimeoutExpired:
            raise Rejected(
                f"{names}: {library} did not finish within {seconds:.0f} s; the file may be damaged; "
                "if the file is not damaged, set FRETWEAR_IMPORT_SECONDS to a longer time in seconds"
            ) from None
        answer: dict[str, Any] = {}
        if Path(folder, "answer.json").is_file():
            answer = json.loads(Path(folder, "answer.json").read_text(encoding="utf-8"))
        if missing := answer.get("missing"):
            raise Rejected(f"{names}: the import needs {library} ({missing}); install it with: pip install 'fretwear[{extra}]'")
        if answer.get("memory"):
            raise Rejected(
                f"{names}: {library} needs more than {memory / (1 << 30):.1f} GB of memory; the file may be damaged; "
                "if the file is not damaged, set FRETWEAR_IMPORT_MEMORY to a larger memory in GB"
            )
        if rejected := answer.get("rejected"):
            raise Rejected(rejected)
        if error := answer.get("error"):
            raise Rejected(
                f"{names}: {library} cannot read the file: {error}; the file may be damaged, or may have an unsupported version"
            )
        if code < 0:
            ended = signal.Signals(-code).name if -code in set(signal.Signals) else str(-code)
            raise Rejected(f"{names}: the signal {ended} ended {library}; the file may be damaged")
        if code or "result" not in answer:
            said.seek(0, os.SEEK_END)
            said.seek(max(0, said.tell() - SHOWN))
            words = " ".join(said.read().decode("utf-8", "replace").split())
            raise Rejected(f"{names}: {library} ended with the exit code {code} and returned nothing: {words}")
        result: dict[str, Any] = answer["result"]
        with np.load(Path(folder, "arrays.npz"), allow_pickle=False) as arrays:
            result |= {name: arrays[name] for name in arrays.files}
        return result


def _serve(folder: Path) -> dict[str, Any]:
    import numpy as np

    warnings.simplefilter("ignore")
    task = json.loads((folder / "task.json").read_text(encoding="utf-8"))
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (task["memory"], task["memory"]))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, ValueError, OSError):
        pass  # Windows does not support these limits. A lower limit of the system remains valid.
    module, name = task["function"].split(":")
    try:
        result = getattr(importlib.import_module(module), name)(**task["arguments"])
        arrays: dict[str, Any] = {key: value for key, value in result.items() if isinstance(value, np.ndarray)}
        np.savez(folder / "arrays.npz", **arrays)
        return {"result": {key: value for key, value in result.items() if not isinstance(value, np.ndarray)}}
    except ImportError as error:
        return {"missing": str(error)[:SHOWN]}
    except MemoryError:
        return {"memory": True}
    except Rejected as error:
        return {"rejected": str(error)}
    except (Exception, SystemExit) as error:
        return {"error": f"{type(error).__name__}: {' '.join(str(error).split())}"[:SHOWN]}


if __name__ == "__main__":
    here = Path(sys.argv[1])
    answer = _serve(here)
    (here / "answer.json").write_text(json.dumps(answer), encoding="utf-8")
