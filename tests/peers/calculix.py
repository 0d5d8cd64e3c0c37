#!/usr/bin/env python3
"""Compares the natural frequencies of the resonator, and of two bonded bars from a mesh, with CalculiX on the same mesh.

    python3 tests/peers/calculix.py --program target/release/fretwear [--ccx ccx] [FOLDER]

`fretwear export` writes the input deck, `ccx` solves the deck, and the script compares the elastic frequencies: with tied contact
nodes, and with springs on the mean relative displacements of the 340 contact elements. The script then compares the bonded lap of bars:
a deck whose bars share the nodes of their joint, and a scene without [contact]. The script needs only Python and ccx. Decks and results
of ccx go into FOLDER, or into a temporary folder.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# Both programs solve the same problem but take the gradients of the incompatible modes at different points. The mesh makes this difference
# small: 0.03 % in the highest compared modes. A plain hexahedron locks and differs by 3 %.
TOLERANCE = 1e-3
ELASTIC_MODES = 8
RIGID_MODES = 6
# Largest frequency of a rigid mode [Hz]. Rounding moves the eigenvalues of rigid modes away from zero. The first elastic frequency is 471
# Hz.
RIGID_BELOW_HZ = 0.1

# The bonded bars consist of plain hexahedra, which are equal in both programs.
BONDED_TOLERANCE = 1e-4
BARS = dict(cell=(4, 3, 2), cells=(30, 9, 4), lap=10)
# Frequency ranges with one mode each that the force along z excites to a resonance [Hz].
RANGES = [(100, 300), (800, 1500)]
BONDED = """
[structure]
kind = "mesh"
file = "lap.inp"
unit = {{ length = "mm", mass = "t", time = "s" }}
interface = {{ upper = "TOP", lower = "BOTTOM" }}
[dynamics]
force = {{ amplitude = "1 N", at = "TIP", direction = "z" }}
response = {{ at = "SENSOR", direction = "z" }}
harmonics = [0, 1]
damping_ratio = 1e-4
frequency = ["{0} Hz", "{1} Hz"]
"""

JOINTS = {
    "tied": [],
    "springs": ["--kt", "1e4 N/um", "--kn", "1.2e4 N/um"],
}


def eigenvalue_table(path):
    """Returns the frequencies of a .dat file [Hz]. An imaginary frequency counts with its magnitude."""
    frequencies = []
    table = False
    for line in path.read_text(encoding="ascii").splitlines():
        if "E I G E N V A L U E   O U T P U T" in line:
            table = True
        elif "P A R T I C I P A T I O N" in line:
            break
        elif table and len(fields := line.split()) == 5 and fields[0].isdigit():
            assert int(fields[0]) == len(frequencies) + 1, line
            # Columns: number, eigenvalue, rad per second, cycles per second, imaginary part in rad per second.
            real, imaginary = float(fields[3]), float(fields[4]) / 6.283185307179586
            frequencies.append(max(real, imaginary, key=abs))
    return frequencies


def compare(joint, options, arguments, folder):
    """Solves one joint with both programs and returns the largest relative difference of the elastic frequencies."""
    command = [arguments.program, "export", "--output", f"{joint}.inp", "--modes", str(ELASTIC_MODES), "--frequencies"]
    started = time.monotonic()
    done = subprocess.run(command + options, cwd=folder, check=True, stdout=subprocess.PIPE, text=True)
    ours = json.loads(done.stdout)
    middle = time.monotonic()
    # One thread, as for fretwear.
    environment = dict(os.environ, OMP_NUM_THREADS="1")
    with open(folder / f"{joint}.log", "w", encoding="utf-8") as log:
        code = subprocess.run([arguments.ccx, "-i", joint], cwd=folder, env=environment, stdout=log, stderr=log).returncode
    table = folder / f"{joint}.dat"
    theirs = eigenvalue_table(table) if table.exists() else []
    if code != 0 or len(theirs) < RIGID_MODES + ELASTIC_MODES:
        tail = (folder / f"{joint}.log").read_text(encoding="utf-8", errors="replace")[-2000:]
        sys.exit(f"ccx failed on {joint}.inp (exit code {code}, {len(theirs)} modes):\n{tail}")
    ended = time.monotonic()

    print(f"{joint}: fretwear {middle - started:.1f} s, ccx {ended - middle:.1f} s; mass {ours['mass']:.4f} kg")
    print("  mode  fretwear [Hz]  CalculiX [Hz]  difference")
    assert ours["rigid_modes"] == RIGID_MODES, ours
    rigid = max(abs(frequency) for frequency in theirs[:RIGID_MODES])
    assert rigid < RIGID_BELOW_HZ, f"ccx has {rigid} Hz among the rigid modes"
    largest = 0.0
    for number, (our, their) in enumerate(zip(ours["elastic_frequencies"], theirs[RIGID_MODES:], strict=True), RIGID_MODES + 1):
        difference = our / their - 1.0
        largest = max(largest, abs(difference))
        print(f"  {number:4d}  {our:13.3f}  {their:13.3f}  {100 * difference:+9.4f} %")
    return largest


def compare_bonded(arguments, folder):
    """Bonds two bars in a deck and in a scene, and returns the largest relative difference of the frequencies."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "data"))
    from make_lap_of_bars import deck, two_bars

    write = lambda name, text: (folder / name).write_text(text.replace("C3D8I", "C3D8"), encoding="utf-8")
    write("lap.inp", deck(*two_bars(**BARS)))
    (lower, upper), sets = two_bars(**BARS)
    rounded = lambda bar, node: tuple(round(along, 6) for along in bar.positions[node])
    below = {rounded(lower, node): node for node in sets["BOTTOM"]}
    shared = {node: below[rounded(upper, node)] for node in sets.pop("TOP")}
    upper.elements = {element: [shared.get(node, node) for node in nodes] for element, nodes in upper.elements.items()}
    for node in shared:
        del upper.positions[node]
    write("bonded.inp", deck([lower, upper], sets, ["*STEP", "*FREQUENCY", "6", "*END STEP"]))
    with open(folder / "bonded.log", "w", encoding="utf-8") as log:
        subprocess.run([arguments.ccx, "-i", "bonded"], cwd=folder, check=True, stdout=log, stderr=log)
    theirs = eigenvalue_table(folder / "bonded.dat")
    largest = 0.0
    print("bonded bars\n  mode  fretwear [Hz]  CalculiX [Hz]  difference")
    for least, most in RANGES:
        (folder / "bonded.toml").write_text(BONDED.format(least, most), encoding="utf-8")
        done = subprocess.run([arguments.program, "plan", "bonded.toml", "--json"], cwd=folder, check=True, stdout=subprocess.PIPE, text=True)
        ours = json.loads(done.stdout)["resonances"]["linear"]
        their = theirs[ours["mode"] - 1]
        difference = ours["frequency"] / their - 1.0
        largest = max(largest, abs(difference))
        print(f"  {ours['mode']:4d}  {ours['frequency']:13.4f}  {their:13.4f}  {100 * difference:+9.5f} %")
    return largest


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="the fretwear program")
    parser.add_argument("--ccx", default="ccx", help="the CalculiX solver [default: %(default)s]")
    parser.add_argument("folder", nargs="?", metavar="FOLDER", help="folder of the decks and results")
    arguments = parser.parse_args()
    arguments.program = str(Path(arguments.program).resolve())
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments.folder or temporary)
        folder.mkdir(parents=True, exist_ok=True)
        largest = max(compare(joint, options, arguments, folder) for joint, options in JOINTS.items())
        bonded = compare_bonded(arguments, folder)
    print(f"largest difference {100 * largest:.4f} %, {100 * TOLERANCE} % allowed")
    print(f"largest difference of bonded bars {100 * bonded:.5f} %, {100 * BONDED_TOLERANCE} % allowed")
    if largest > TOLERANCE or bonded > BONDED_TOLERANCE:
        sys.exit("CalculiX and fretwear disagree")


if __name__ == "__main__":
    main()
