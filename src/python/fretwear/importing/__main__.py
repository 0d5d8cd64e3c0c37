"""The command: `fretwear-import FILE... -o FOLDER`, `fretwear-import --surface FILE -o map.parquet`, or `python -m fretwear.importing`."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import subprocess
import sys
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path

from fretwear.importing import Rejected
from fretwear.importing.scene import LENGTHS, MASSES, TIMES, scale

#: Extensions of the files of each program.
FAMILIES = {
    "gmsh": {".msh"},
    "nastran": {".op4", ".pch", ".pch1", ".dmig", ".bdf", ".nas", ".asm"},
    "ansys": {".full", ".cdb", ".csv"},
    "matlab": {".mat", ".csv"},
    "abaqus": {".inp", ".mtx", ".dat"},
}
REJECTED = {
    ".unv": "I-DEAS universal files; write a .msh by Gmsh, or a deck",
    ".med": "Salome's MED; write a .msh by Gmsh, or a deck",
    ".op2": "Nastran's OUTPUT2; write OUTPUT4 or DMIG",
    ".sti": "CalculiX's matrices, which the program reads itself: structure.file",
    ".mas": "CalculiX's matrices, which the program reads itself: structure.file",
}


class _Once(argparse.Action):
    """Stores what an option gives. Raises Rejected where the option is given twice."""

    def __call__(self, parser: object, options: argparse.Namespace, values: object, option: str | None = None) -> None:
        if option and getattr(options, self.dest) is not None:
            raise Rejected(f"{option} is given twice; once would be right")
        setattr(options, self.dest, values)


def _arguments(given: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="fretwear-import",
        description="Writes the structure of other programs into one folder that fretwear reads, or a measured surface into one table.",
    )
    parser.register("action", None, _Once)
    parser.add_argument(
        "files", nargs="*", type=Path, metavar="FILE", help="files of Gmsh, Nastran, ANSYS, MATLAB or Abaqus, all of one structure"
    )
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FOLDER", help="the folder to write; of a surface the table, as map.parquet"
    )
    parser.add_argument("--upper", metavar="SET", help="the set of nodes of the upper body at the joint")
    parser.add_argument("--lower", metavar="SET", help="that of the lower body")
    parser.add_argument(
        "--pairs", type=Path, metavar="FILE", help="pairs of nodes at the joint: CSV with the columns upper_node, lower_node"
    )
    parser.add_argument("--fixed", metavar="SET", help="the set of nodes that is held in all directions")
    parser.add_argument(
        "--unit",
        metavar="LENGTH,MASS,TIME",
        help="the units of the files, as mm,t,s, or '25.4 mm,175.1268 kg,s'; of a surface what one unit of height is, as um or '12.5 nm'",
    )
    parser.add_argument(
        "--material",
        action="append",
        default=[],
        metavar="SET=E,nu,rho",
        help="material of a physical group of Gmsh, in the units of the file",
    )
    parser.add_argument("--labels", type=Path, metavar="FILE", help="nodes of Abaqus' matrices: CSV with the columns label, instance, node")
    parser.add_argument("--axes", choices=["global"], help="an ANSYS .full without its .cdb: all displacements are along the global axes")
    parser.add_argument("--force", action="store_true", help="replace the folder, or the table, of an earlier import")
    surface = parser.add_argument_group("surfaces", "A measured topography in a binary format that fretwear does not read itself.")
    surface.add_argument("--surface", type=Path, metavar="FILE", help="the file of the instrument, in place of those of a structure")
    surface.add_argument("--format", metavar="NAME", help="its reader, if the extension does not say it; a wrong name lists them")
    surface.add_argument("--channel", metavar="NAME", help="the channel, if several are heights; a wrong name lists them")
    surface.add_argument("--size", metavar="X,Y", help="the sides of the map, if the file states none or false ones, as '1.2 mm,0.9 mm'")
    options = parser.parse_args(given)
    options.units = None
    structural = ["files", "upper", "lower", "pairs", "fixed", "material", "labels", "axes"]
    others = structural if options.surface else ["format", "channel", "size"]
    if strange := [name for name in others if getattr(options, name)]:
        name = "FILE..." if strange[0] == "files" else f"--{strange[0]}"
        raise Rejected(f"{name} is of a {'structure and does not go with' if options.surface else 'surface and wants'} --surface")
    if options.surface:
        return options
    if not options.files:
        raise Rejected("there is no file to read; give those of a structure, or --surface FILE")
    if options.unit:
        parts = [part.strip() for part in options.unit.split(",")]
        try:
            for part, units in zip(parts, (LENGTHS, MASSES, TIMES), strict=True):
                scale(part, units)
        except ValueError:
            known = "; ".join(", ".join(units) for units in (LENGTHS, MASSES, TIMES))
            raise Rejected(
                f"--unit {options.unit}: a length, a mass and a time of {known}, or numbers of them, would be right, as mm,t,s"
            ) from None
        options.units = dict(zip(("length", "mass", "time"), parts, strict=True))
    if bool(options.upper) != bool(options.lower) or (options.upper and options.pairs):
        raise Rejected("the joint is either --upper SET with --lower SET, or --pairs FILE")
    return options


@contextlib.contextmanager
def _reading(files: list[Path]) -> Iterator[None]:
    """Ignores warnings of libraries, and names the files in every rejection."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except Rejected as error:
        if any(file.name in str(error) for file in files):
            raise
        raise Rejected(f"{', '.join(map(str, files))}: {error}") from None


def _family(files: list[Path]) -> str:
    for file in files:
        if file.suffix.lower() in REJECTED:
            raise Rejected(f"{file}: {file.suffix.lower()} is not imported: {REJECTED[file.suffix.lower()]}")
        if not file.is_file():
            raise Rejected(f"{file}: there is no such file")
        if files.count(file) > 1:
            raise Rejected(f"{file} is given twice; once would be right")
    found = {name for name, suffixes in FAMILIES.items() if any(file.suffix.lower() in suffixes - {".csv"} for file in files)}
    if len(found) > 1:
        raise Rejected(f"the files are of several programs ({', '.join(sorted(found))}); one structure of one program at a time")
    known = ", ".join(sorted(suffix for suffixes in FAMILIES.values() for suffix in suffixes))
    strange = [file for file in files if not found or file.suffix.lower() not in FAMILIES[next(iter(found))]]
    if strange:
        raise Rejected(
            f"{strange[0]}: its extension says nothing that is read beside the others; known are {known}; "
            "a measured surface is given by --surface"
        )
    return found.pop()


def convert(options: argparse.Namespace) -> str:
    """Reads the files, writes the folder or the table, and returns what to print. Raises Rejected."""
    if options.surface:
        from fretwear.importing import surface

        return surface.convert(options)
    from fretwear.importing import folder, mesh, scene

    folder.check_new(options.output, options.force)
    family = _family(options.files)
    with _reading(options.files):
        if options.material and family != "gmsh":
            raise Rejected("--material is for meshes of Gmsh, which have no materials; other files say theirs")
        structure = importlib.import_module(f"fretwear.importing.{family}").read(options.files, options)
        for option in ("upper", "lower", "fixed"):
            if name := getattr(options, option):
                setattr(options, option, structure.set_named(name, f"--{option}"))
        if options.pairs:
            folder.read_pairs(structure, options.pairs)
        if options.fixed and structure.is_mesh:
            structure.held |= {(node, direction) for node in structure.sets[options.fixed] for direction in (1, 2, 3)}
        if structure.is_mesh:
            mesh.check_constraints(structure)
    if options.units is None:
        structure.left_out.append("The units: no file says them, and --unit was not given.")
    folder.write(structure, options.output, scene.write(structure, options), options.units, force=options.force)
    return f"Wrote {options.output}{os.sep}"


def _look(folder: Path) -> None:
    """Calls the program on what was written, or names the command."""
    from fretwear import _program

    try:
        program = _program.program()
    except _program.Error:
        print(f"Next: fretwear inspect {folder}, and fretwear check {folder / 'scene.toml'}")
        return
    for arguments in (["inspect", str(folder)], ["check", str(folder / "scene.toml")]):
        print(f"fretwear {' '.join(arguments)}", flush=True)
        try:
            subprocess.run([program, *arguments], stdin=subprocess.DEVNULL, check=False)
        except OSError as error:
            print(f"{program} does not start: {error}")
            return


def main(given: list[str] | None = None) -> int:
    """The exit code: 0, 2 with a sentence on stderr, or 1 for a fault of this program."""
    try:
        options = _arguments(given)
        written = convert(options)
    except Rejected as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except ImportError as error:
        print(f"error: {error}: pip install 'fretwear[{'surface' if options.surface else 'abaqus'}]'", file=sys.stderr)
        return 2
    except (RecursionError, OverflowError) as error:
        print(
            f"error: entries refer to each other too deeply, or a number is too large: {error}; the files may be damaged", file=sys.stderr
        )
        return 2
    except (MemoryError, OSError) as error:
        print(f"error: {error or 'there is not enough memory for these files'}", file=sys.stderr)
        return 2
    except Exception as error:
        at = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(at.filename).name}:{at.lineno}"
        print(
            f"error: a fault of fretwear-import at {where}: {type(error).__name__}: {error}; please report it with the files",
            file=sys.stderr,
        )
        return 1
    try:
        print(written)
        if not options.surface:
            _look(options.output)
    except BrokenPipeError:
        # Nobody reads on; what is still to be printed goes nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


if __name__ == "__main__":
    sys.exit(main())
