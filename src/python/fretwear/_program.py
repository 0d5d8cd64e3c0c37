"""The program, called as a process of its own."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

if TYPE_CHECKING:
    from fretwear._folder import Run

#: What a key of a scene may be set to: a text with its unit ("20 kN"), a word, a number, a truth value, a list of them, a table of
#: them. What NumPy makes of these is taken too.
Value = Union[str, bool, int, float, "os.PathLike[str]", Sequence["Value"], Mapping[str, "Value"]]

#: The exit code of a run that stopped and can be continued.
STOPPED = 75


class Error(Exception):
    """What the program refused or failed at, in its own words.

    `code` is its exit code: 1 failure, 2 usage or scene, 3 not converged (the last commit is kept), 4 damaged or mismatched run,
    75 stopped (`Stopped`). It is None where this module itself found no program, run, table or column.
    """

    def __init__(self, message: str, code: int | None = None) -> None:
        super().__init__(message)
        self.code = code


class Stopped(Error):
    """A run ended before its goal, and can be continued: by `max_wall`, or by a signal to the program.

    `run` holds what is committed. The same call again goes on.
    """

    def __init__(self, message: str, run: Run) -> None:
        super().__init__(message, STOPPED)
        self.run = run

    def __reduce__(self) -> tuple[Any, ...]:
        return Stopped, (str(self), self.run)


def program() -> str:
    """The path of the program: what the variable FRETWEAR names, else what was installed with this module, else that of PATH."""
    named = os.environ.get("FRETWEAR")
    if named:
        return named
    schemes = [sysconfig.get_default_scheme(), sysconfig.get_preferred_scheme("user")]
    folders = [sysconfig.get_path("scripts", scheme) for scheme in schemes]
    for folder in [*folders, None]:
        found = shutil.which("fretwear", path=folder)
        if found:
            return found
    raise Error("the program fretwear is neither beside Python nor on PATH; name it by the variable FRETWEAR")


def _listen(child: subprocess.Popen[str], said: list[str], show: bool) -> None:
    """Waits for the end of the program, and keeps what it says on stderr; with `show`, passes it on."""
    assert child.stderr
    for line in child.stderr:
        said.append(line)
        if show:
            sys.stderr.write(line)
            sys.stderr.flush()
    child.wait()


def call(*arguments: str, show: bool = False) -> str:
    """What the program prints; with `show`, what it says meanwhile goes to stderr.

    Raises Error where it ends with another code than 0. KeyboardInterrupt stops the program as Ctrl-C does, and is raised again when the
    program has ended; a second one ends it at once, which costs no commit.
    """
    # In a session of its own the program does not see the Ctrl-C of the terminal, only that which is forwarded here: two would end it at
    # once. Other threads than the main one see no KeyboardInterrupt, and Windows forwards none: there the terminal's is the only one.
    apart = os.name != "nt" and threading.current_thread() is threading.main_thread()
    said: list[str] = []
    with tempfile.TemporaryFile() as results:
        try:
            child = subprocess.Popen(
                [program(), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=results,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
                start_new_session=apart,
            )
        except OSError as error:
            raise Error(f"the program does not start: {error}") from error
        with child:
            try:
                _listen(child, said, show)
            except BaseException as error:
                interrupted = isinstance(error, KeyboardInterrupt)
                if apart or not interrupted:
                    child.send_signal(signal.SIGINT if os.name != "nt" else signal.SIGTERM)
                try:
                    _listen(child, said, show and interrupted)
                except BaseException:
                    child.kill()
                raise
        results.seek(0)
        printed = results.read().decode("utf-8", errors="replace")
    if child.returncode == 0:
        return printed
    # Notices may stand before the error; what `verify` finds is a result.
    text = "".join(said)
    error_at = re.search(r"^error: ", text, re.MULTILINE)
    message = (text[error_at.end() :] if error_at else text or printed).strip()
    if child.returncode < 0:
        raise Error(message or f"ended by signal {-child.returncode}", 128 - child.returncode)
    raise Error(message, child.returncode)


def toml(value: Value) -> str:
    """A value as TOML writes it; a text stays a text, also where it looks like a number."""
    if hasattr(value, "tolist"):  # NumPy's numbers and arrays
        value = value.tolist()
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{toml(str(key))} = {toml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, Sequence) and not isinstance(value, (bytes, bytearray)):
        return "[" + ", ".join(map(toml, value)) + "]"
    raise TypeError(f"a key cannot be set to {value!r}: text with a unit, number, bool, list or table")


def _sets(changes: Mapping[str, Value] | None) -> list[str]:
    return [f"--set={key}={toml(value)}" for key, value in (changes or {}).items()]


def run(
    scene: str | os.PathLike[str] | None = None,
    *,
    run: str | os.PathLike[str] | None = None,
    set: Mapping[str, Value] | None = None,
    threads: int | None = None,
    max_wall: str | float | None = None,
    quiet: bool = True,
) -> Run:
    """Computes a scene, or continues its run; a finished run is returned at once.

    - `scene`: path of the scene. Without it, `run` goes on with the scene that it keeps.
    - `run`: folder of the run; without it `runs/NAME` in the working directory, with the name of the scene's file.
    - `set`: keys of the scene to change, as `{"contact.normal_load": "20 kN", "joint.grid": [64, 48], "wear.cycles": 10**6}`.
    - `threads`: threads of the run, all cores by default; the results are the same bits.
    - `max_wall`: time after which to stop, in s or as "8 h"; within a stage if its iteration takes 2 s longer.
    - `quiet`: False shows the progress on stderr.

    Raises Stopped if the run ends before its goal, Error if it fails, with the words of the program. On KeyboardInterrupt the program
    gets SIGINT and ends with what is committed; the same call again goes on. Called from another thread than the main one, the
    terminal's Ctrl-C stops the program, and Stopped is raised.
    """
    from fretwear._folder import Run

    if run is None:
        if scene is None:
            raise TypeError("run() wants a scene, a run, or both")
        run = Path("runs") / Path(scene).stem
    arguments = ["run", f"--run={os.fspath(run)}", *_sets(set)]
    if threads is not None:
        arguments.append(f"--threads={threads}")
    if max_wall is not None:
        arguments.append(f"--max-wall={max_wall if isinstance(max_wall, str) else f'{max_wall} s'}")
    if quiet:
        arguments.append("--quiet")
    if scene is not None:
        arguments += ["--", os.fspath(scene)]
    try:
        call(*arguments, show=not quiet)
    except Error as error:
        if error.code == STOPPED:
            raise Stopped(str(error), Run(run)) from None
        raise
    return Run(run)


def plan(scene: str | os.PathLike[str], *, set: Mapping[str, Value] | None = None, rehearsal: bool = True) -> dict[str, Any]:
    """What a scene will compute (`recipe`), why (`decisions`), what speaks against it (`warnings`), and what it costs (`cost`).

    `cost` contains the counted memory and disk per iteration [B], and ranges of wear iterations, FFT pairs and total disk [B].
    `seconds["run"]` is the range of the time on this machine. A range is None if the coarse run gives no estimate; `cost["not_known"]`
    has the reason. The coarse run takes a few seconds; `rehearsal=False` skips it and returns no cost. `set` as in `run`. Raises Error.
    """
    without = [] if rehearsal else ["--no-rehearsal"]
    planned: dict[str, Any] = json.loads(call("plan", "--json", *without, *_sets(set), "--", os.fspath(scene)))
    return planned


def explain(key: str) -> dict[str, Any]:
    """What a key of a scene means, with its type, default and an example; of a section ("contact"), all of its keys. Raises Error."""
    about: dict[str, Any] = json.loads(call("schema", "--json", "--", key))
    if "section" in about:
        # The program also returns the table of the same name.
        return {name: about[name] for name in ("section", "meaning", "keys")}
    if "key" not in about:
        raise Error(f"{key}: there is no such key or section of a scene", 2)
    return about
