"""Starts the program as a separate process."""

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
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

if TYPE_CHECKING:
    from fretwear._folder import Run

#: Value of a key of a scene: a text with its unit ("20 kN"), a word, a number, a truth value, or a list or table of these. Numbers and
#: arrays of NumPy are accepted.
Value = Union[str, bool, int, float, "os.PathLike[str]", Sequence["Value"], Mapping[str, "Value"]]

#: Scene: the path of its file, or a mapping of its sections such as `{"joint": {"grid": [64, 48], …}, …}`.
Scene = Union[str, "os.PathLike[str]", Mapping[str, Value]]

#: One milestone of `when`, or several.
Milestone = Union[str, Sequence[str]]

#: Exit codes of the program: failure, and a stopped run that can be continued.
FAILED = 1
STOPPED = 75

#: The first line of scenes that this module writes.
WRITTEN = "# Written by the Python module from a mapping; the next call may replace it.\n"


class Error(Exception):
    """Failure of the program, with its message.

    The attribute `code` is the exit code of the program: 1 failure, 2 wrong usage or scene, 3 not converged (the last commit is kept),
    4 damaged or mismatched run, 75 stopped (`Stopped`). The code is None if the module finds no program, run, table or column.
    """

    def __init__(self, message: str, code: int | None = None) -> None:
        super().__init__(message)
        self.code = code


class Stopped(Error):
    """A run stopped before its end, because of `max_wall` or a signal, and can be continued.

    The attribute `run` is the run with its committed iterations. Repeat the same call to continue the run.
    """

    def __init__(self, message: str, run: Run) -> None:
        super().__init__(message, STOPPED)
        self.run = run

    def __reduce__(self) -> tuple[Any, ...]:
        return Stopped, (str(self), self.run)


def program() -> str:
    """Returns the path of the program.

    The environment variable FRETWEAR has priority over the installed program, and the installed program over PATH.
    """
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


def version() -> str:
    """Returns the version of the installed package. Without an installed package, returns the version of the program."""
    try:
        return metadata.version("fretwear")
    except metadata.PackageNotFoundError:
        return call("--version").split()[1]


def _listen(child: subprocess.Popen[str], said: list[str], show: bool) -> None:
    """Collects the lines that the program prints on stderr until the program ends. With `show`, also prints them."""
    assert child.stderr
    for line in child.stderr:
        said.append(line)
        if show:
            sys.stderr.write(line)
            sys.stderr.flush()
    child.wait()


def call(*arguments: str, show: bool = False, codes: Collection[int] = (0,)) -> str:
    """Returns the text that the program prints on stdout. With `show`, prints the progress on stderr.

    Raises Error if the exit code is not in `codes`, or if the program prints nothing and its exit code is not 0. A KeyboardInterrupt
    stops the program like Ctrl-C, and is raised again after the program has ended. A second KeyboardInterrupt ends the program at once;
    all commits are kept.
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
    if child.returncode == 0 or (child.returncode in codes and printed):
        return printed
    # Notices may stand before the error; what `verify` finds is a result.
    text = "".join(said)
    error_at = re.search(r"^error: ", text, re.MULTILINE)
    message = (text[error_at.end() :] if error_at else text or printed).strip()
    if child.returncode < 0:
        raise Error(message or f"ended by signal {-child.returncode}", 128 - child.returncode)
    raise Error(message, child.returncode)


def toml(value: Value) -> str:
    """Returns a value as TOML. A text stays a text, even if it looks like a number."""
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


def scene_text(scene: Mapping[str, Value]) -> str:
    """Returns a scene as TOML. Makes paths of type `os.PathLike` absolute, from the working folder; keeps texts unchanged."""

    def absolute(value: Any) -> Any:
        if isinstance(value, os.PathLike):
            return os.path.abspath(value)
        if isinstance(value, Mapping):
            return {key: absolute(inner) for key, inner in value.items()}
        if isinstance(value, (list, tuple)):
            return [absolute(inner) for inner in value]
        return value

    def key(name: Any) -> str:
        if "." in str(name):
            raise Error(f'{name}: no key of a mapping has a dot; write {{"contact": {{"normal_load": …}}}} for contact.normal_load', 2)
        return str(name) if re.fullmatch(r"[A-Za-z0-9_-]+", str(name)) else toml(str(name))

    keys, sections = [], []
    for name, value in absolute(scene).items():
        if isinstance(value, Mapping):
            sections.append("\n".join([f"[{key(name)}]", *(f"{key(inner)} = {toml(each)}" for inner, each in value.items())]))
        else:
            keys.append(f"{key(name)} = {toml(value)}")
    return "\n\n".join([*(["\n".join(keys)] if keys else []), *sections]) + "\n"


@contextmanager
def _scene_beside(scene: Mapping[str, Value], run: Path) -> Iterator[str]:
    """Yields the path of a scene as TOML beside the folder of its run. Raises Error if another file has that name.

    The scene is in a temporary file until the program has accepted it. So a rejected scene replaces no file, and two simultaneous calls
    do not share a scene.
    """
    run = Path(os.path.abspath(run))
    if not run.name:
        raise Error(f"{run} cannot be the folder of a run: the scene has no place beside it")
    path = run.with_name(f"{run.name}.toml")
    if path.exists() and not path.read_text(encoding="utf-8", errors="replace").startswith(WRITTEN):
        raise Error(f"{path} was not written by this module and stays; choose another folder for the run")
    text = (WRITTEN + scene_text(scene)).encode()
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, written = tempfile.mkstemp(".toml", f".{run.name}-", path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(text)
        yield written
        os.replace(written, path)
    except Error as error:
        if error.code == STOPPED:
            os.replace(written, path)
        error.args = (str(error).replace(written, str(path)),)
        raise
    finally:
        Path(written).unlink(missing_ok=True)


@contextmanager
def _scene_file(scene: Scene) -> Iterator[str]:
    """Yields the path of a scene. Writes a mapping to a temporary file."""
    if not isinstance(scene, Mapping):
        yield os.fspath(scene)
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(scene_text(scene), encoding="utf-8")
        yield str(path)


def _execution(threads: int | None, max_wall: str | float | None, quiet: bool) -> list[str]:
    """Returns the options that runs and campaigns share."""
    options = []
    if threads is not None:
        options.append(f"--threads={threads}")
    if max_wall is not None:
        options.append(f"--max-wall={max_wall if isinstance(max_wall, str) else f'{max_wall} s'}")
    if quiet:
        options.append("--quiet")
    return options


def _sets(changes: Mapping[str, Value] | None) -> list[str]:
    return [f"--set={key}={toml(value)}" for key, value in (changes or {}).items()]


def run(
    scene: Scene | None = None,
    *,
    run: str | os.PathLike[str] | None = None,
    set: Mapping[str, Value] | None = None,
    threads: int | None = None,
    max_wall: str | float | None = None,
    quiet: bool = True,
) -> Run:
    """Computes a scene, or continues its run, and returns the run. A finished run is returned at once.

    - `scene`: path of the scene, or a mapping of its sections. The module writes a mapping as TOML beside the run. Without a scene, the
      run continues with the scene in its folder.
    - `run`: folder of the run. The default is `runs/NAME` in the working folder, where NAME is the name of the scene's file; for a
      mapping, `runs/scene`.
    - `set`: keys of the scene to change, such as `{"contact.normal_load": "20 kN", "joint.grid": [64, 48], "wear.cycles": 10**6}`.
    - `threads`: number of threads. The default is the number of cores. Results do not depend on it.
    - `max_wall`: time after which the run stops, in s or as a text such as "8 h". The run stops at the end of the iteration if that is
      within 2 s, else within the iteration.
    - `quiet`: False prints the progress on stderr.

    Raises Stopped if the run ends before its last cycle, and Error with the message of the program if the run fails. A KeyboardInterrupt
    stops the run, and the commits are kept; repeat the call to continue. If another thread than the main one calls the function, Ctrl-C in
    the terminal stops the program, and the function raises Stopped.
    """
    from fretwear._folder import Run

    if run is None:
        if scene is None:
            raise TypeError("run() wants a scene, a run, or both")
        run = Path("runs") / ("scene" if isinstance(scene, Mapping) else Path(scene).stem)
    arguments = ["run", f"--run={os.fspath(run)}", *_sets(set), *_execution(threads, max_wall, quiet)]
    try:
        if isinstance(scene, Mapping):
            with _scene_beside(scene, Path(run)) as path:
                call(*arguments, "--", path, show=not quiet)
        else:
            call(*arguments, *([] if scene is None else ["--", os.fspath(scene)]), show=not quiet)
    except Error as error:
        if error.code == STOPPED:
            raise Stopped(str(error), Run(run)) from None
        raise
    return Run(run)


def plan(scene: Scene, *, set: Mapping[str, Value] | None = None, rehearsal: bool = True) -> dict[str, Any]:
    """Plans a scene without computing it: returns its `recipe`, the `decisions` with reasons, the `warnings` and the `cost`.

    - `scene`, `set`: as in `run`. Give paths in a mapping as `pathlib.Path`, because a mapping has no folder.
    - `rehearsal`: False skips the coarse run, which takes a few seconds, and returns no cost of the whole run.

    The entry `cost` has memory and disk per iteration [B], and ranges of wear iterations, FFT pairs and total disk [B]. The entry
    `seconds["run"]` is the range of the time on this machine. A range is None if the coarse run gives no estimate, and
    `cost["not_known"]` has the reason. Raises Error if the program rejects the scene.
    """
    without = [] if rehearsal else ["--no-rehearsal"]
    with _scene_file(scene) as path:
        planned: dict[str, Any] = json.loads(call("plan", "--json", *without, *_sets(set), "--", path))
    return planned


def campaign(
    file: str | os.PathLike[str],
    *,
    folder: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    threads: int | None = None,
    max_wall: str | float | None = None,
    retry: bool = False,
    quiet: bool = True,
) -> dict[str, Any]:
    """Plans a campaign, runs its rows and collects their tables. Repeat the same call to continue the campaign.

    - `file`: path of the campaign (TOML).
    - `folder`: folder of the campaign. The default is `campaigns/NAME` in the working folder, where NAME is the name of the file.
    - `jobs`: number of simultaneous runs. By default, cores and memory limit it.
    - `threads`, `max_wall`, `quiet`: as in `run`.
    - `retry`: True runs failed rows again.

    Returns the object of `fretwear campaign run --json` (`rows`, `done`, `left`, `failed`, `stopped`, `in_use`) and the entry `folder`. A
    failed row does not stop the other rows; a warning names the failed rows and the folder with the reasons. The tables of all rows are in
    `folder/collected`. Raises Error if the campaign cannot be planned or run.
    """
    folder = Path("campaigns") / Path(file).stem if folder is None else Path(folder)
    directory = f"--dir={folder.absolute()}"
    call("campaign", "plan", "--no-rehearsal", directory, "--", os.fspath(file))
    arguments = ["campaign", "run", "--json", directory, *_execution(threads, max_wall, quiet)]
    if jobs is not None:
        arguments.append(f"--jobs={jobs}")
    if retry:
        arguments.append("--retry")
    ended: dict[str, Any] = json.loads(call(*arguments, show=not quiet, codes=(0, FAILED, STOPPED)))
    if failed := ended["failed"]:
        reasons = f"{folder / 'failed'} has the reasons"
        warnings.warn(f"{len(failed)} of {ended['rows']} rows of {folder} failed ({failed}); {reasons}", stacklevel=2)
    if ended["done"]:
        call("campaign", "collect", directory)
    return ended | {"folder": str(folder)}


def when(
    run: Run | str | os.PathLike[str],
    *,
    preload: Milestone = (),
    resonance: Milestone = (),
    stiffness: Milestone = (),
    depth: Milestone = (),
    depth_99: Milestone = (),
    volume: Milestone = (),
) -> dict[str, Any]:
    """Returns the numbers of cycles after which a run, or the runs of a campaign, reach milestones.

    - `run`: a run, or the folder of a run or of a campaign.
    - `preload`, `resonance`, `stiffness`, `depth`, `depth_99`, `volume`: milestones, each a text or a list of texts, such as
      `preload="90%"`, `resonance="+1Hz"`, `stiffness="kn+10%"`, `depth="10um"`, `volume="1mm3"`. One hundredth of the cells are
      deeper than `depth_99`. A percentage refers to the unworn joint.

    Returns the object of `fretwear when --json`. For a run, each entry of `milestones` has the numbers of cycles `earliest`, `nominal` and
    `latest`, by the error bars of the run. A number is None if the run does not reach the milestone. The entry `done` is False if the run
    is not finished. For a campaign, each entry has quantiles over the runs. Raises Error if a milestone is not valid.
    """
    asked = {"preload": preload, "resonance": resonance, "stiffness": stiffness, "depth": depth, "depth-99": depth_99, "volume": volume}
    options = [f"--{name}={each}" for name, texts in asked.items() for each in ([texts] if isinstance(texts, str) else texts or ())]
    if not options:
        raise TypeError('when() wants a milestone, as preload="90%"')
    found: dict[str, Any] = json.loads(call("when", "--json", *options, "--", os.fspath(run), codes=(0, STOPPED)))
    return found


def explain(key: str) -> dict[str, Any]:
    """Returns the meaning, type, default and an example of a key of a scene; for a section such as "contact", of all its keys.

    Raises Error if no key or section has the name.
    """
    about: dict[str, Any] = json.loads(call("schema", "--json", "--", key))
    if "section" in about:
        # The program also returns the table of the same name.
        return {name: about[name] for name in ("section", "meaning", "keys")}
    if "key" not in about:
        raise Error(f"{key}: there is no such key or section of a scene", 2)
    return about
