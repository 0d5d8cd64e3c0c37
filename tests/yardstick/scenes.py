"""Scenes for both programs: the shipped scenes (at reduced size by default), and random scenes of every kind."""

import math
import random
import shutil
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path

import structures

REPOSITORY = Path(__file__).resolve().parents[2]
# Seed of the random numbers. Another seed changes the numbers, but not the kinds of scenes.
SEED = 2019

# The coarsest mesh of the resonator outside its contact elements.
CELLS = {"half_depth": 2, "block": 3, "stub": 1, "gap": 1, "leaf": 1, "window": 3, "wall": 2, "inner": 2, "rim": 1, "head": 1}
COARSE = [f"structure.{name}_cells={cells}" for name, cells in CELLS.items()]
# Vibration with few unknowns, in a frequency range around the resonance of the coarse resonator.
VIBRATION = [
    "dynamics.harmonics=[0, 1]",
    "dynamics.modes=10",
    "dynamics.points=3",
    'dynamics.frequency=["900 Hz", "1100 Hz"]',
    "fidelity.aft_samples=32",
]
# Keys that reduce a shipped scene. The first matching pattern applies. A scene without a matching pattern runs at full size.
SHRINK = [
    ("lap_joint", [*COARSE, *VIBRATION, "joint.grid=[57, 57]", "wear.cycles=300_000"]),
    (
        "lap_joint_*",
        [
            *COARSE,
            *VIBRATION,
            # With 9 x 9 elements, the hole of 21 absent elements has this width.
            "joint.elements=[9, 9]",
            'joint.hole.diameter="23 mm"',
            "joint.grid=[45, 45]",
            "wear.cycles=300_000",
        ],
    ),
    ("prescribed_fretting*", ["joint.grid=[96, 96]", "wear.cycles=2_000_000"]),
    ("measured_surface", ["joint.grid=[64, 48]", "wear.cycles=300_000"]),
    ("lap_of_bars", ["joint.grid=[60, 45]", "dynamics.harmonics=[0, 1, 2, 3]", "dynamics.points=3", "wear.cycles=300_000"]),
    ("resonator_springs", [*COARSE, *VIBRATION]),
    ("hertz_fretting", ["joint.grid=[80, 60]"]),
    ("static_contact", ["joint.grid=[128, 128]"]),
]


@dataclass
class Case:
    """Starts of the program in a separate folder, and the files in this folder."""

    name: str
    starts: list
    files: dict = field(default_factory=dict)
    # Paths of files in the repository.
    copied: tuple = ()
    # Folders in addition to the runs. The script compares all tables in these folders.
    folders: tuple = ()

    def prepare(self, folder):
        for name in ("", *self.folders):
            (folder / name).mkdir(parents=True)
        for path in self.copied:
            source, target = REPOSITORY / path, folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if source.is_dir() else shutil.copy)(source, target)
        for name, content in self.files.items():
            (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())


def run(scene, *more, run="a", sets=()):
    """Returns the arguments of one start. Every run goes into the folder `runs`."""
    arguments = ["run", scene] if scene else ["run"]
    arguments += ["--run", f"runs/{run}", "--json", "--quiet", *more]
    return arguments + [word for key in sets for word in ("--set", key)]


def shipped(full):
    """Yields a case for every scene of `pipelines`."""
    for path in sorted((REPOSITORY / "pipelines").glob("*.toml")):
        sets = [] if full else next((sets for pattern, sets in SHRINK if fnmatch(path.stem, pattern)), [])
        yield Case(
            f"pipelines/{path.stem}",
            [run(f"pipelines/{path.name}", sets=sets)],
            copied=("pipelines", "data/ground_face.x3p", "data/lap_of_bars.inp"),
        )


def toml(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {toml(each)}' for key, each in value.items())} }}"
    return repr(value)


def text(keys):
    """Returns a scene from its dotted keys, without keys of value None."""
    return "".join(f"{key} = {toml(value)}\n" for key, value in keys.items() if value is not None)


class Draw(random.Random):
    """Random numbers of one case. The numbers depend only on the name of the case, so a new case does not change other cases."""

    def __init__(self, name):
        super().__init__(f"{SEED} {name}")

    def between(self, least, most):
        """Returns a number from a log-uniform distribution."""
        return float(f"{least * (most / least) ** self.random():.4g}")

    def rough(self):
        """Returns a rough joint of some hundred cells, with partial slip and wear in a few iterations."""
        self.size = [self.between(2.5, 5.0), self.between(2.5, 5.0)]  # mm
        self.load = float(f"{self.between(10.0, 30.0) * math.prod(self.size):.4g}")  # N
        self.friction = self.between(0.3, 0.8)
        return {
            "title": "Drawn",
            "joint.size": [f"{side} mm" for side in self.size],
            "joint.grid": [self.randint(18, 28), self.randint(18, 28)],
            "material.youngs_modulus": f"{self.between(70, 210)} GPa",
            "material.poisson_ratio": self.between(0.2, 0.4),
            "surface.kind": "gaussian",
            "surface.rq": f"{self.between(0.3, 2.0)} um",
            "surface.correlation_length": [f"{self.between(0.3, 0.8)} mm", f"{self.between(0.3, 0.8)} mm"],
            "surface.seed": self.randint(1, 1000),
            "contact.friction_coefficient": self.friction,
            "contact.normal_load": f"{self.load} N",
            "motion.amplitude": f"{self.between(0.6, 2.0)} um",
            "wear.coefficient": "2e3 um^3/J",
            "wear.cycles": self.randint(200_000, 500_000),
            "wear.tolerance": self.between(2e-3, 1e-2),
            "output.curves_every": 2,
        }

    def amplitudes(self):
        """Returns the amplitudes along x and y."""
        return [f"{self.between(0.5, 1.5)} um", f"{self.between(0.3, 1.0)} um"]

    def force(self):
        """Returns a force below the friction limit, with partial slip."""
        return f"{self.between(0.4, 0.7) * self.friction * self.load:.4g} N"

    def moment(self):
        """Returns a moment below the friction limit. The limit is at least a third of the friction force times the length."""
        return f"{self.between(0.05, 0.1) * self.friction * self.load * max(self.size) * 1e-3:.4g} N m"

    def history(self):
        """Returns one cycle of motion along both axes under a varying load."""
        rows = ["# drawn", "time, displacement_x, displacement_y, normal_load"]
        x, y, load, lead = self.between(0.5, 1.5), self.between(0.2, 0.8), self.between(0.05, 0.2), self.between(0.1, 1.0)
        for k in range(13):
            turn = 2.0 * math.pi * k / 12
            # The last row equals the first row bit by bit.
            turn = turn if k < 12 else 0.0
            rows.append(
                f"{k / 12!r}, {1e-6 * x * math.cos(turn)!r}, {1e-6 * y * math.sin(turn + lead)!r}, "
                f"{self.load * (1.0 + load * math.cos(turn))!r}"
            )
        return "\n".join(rows) + "\n"

    def heights(self):
        """Returns a map in micrometres as CSV with one missing point."""
        nx, ny = 30, 26
        waves = [(self.randint(1, 6), self.randint(1, 6), self.between(0.1, 0.8), self.random()) for _ in range(12)]
        rows = []
        for i in range(nx):
            row = [
                sum(h * math.cos(2.0 * math.pi * (a * i / nx + b * j / ny + lead)) for a, b, h, lead in waves)
                for j in range(ny)
            ]
            rows.append(["nan" if (i, j) == (4, 7) else f"{height:.6f}" for j, height in enumerate(row)])
        return "\n".join(",".join(row) for row in rows) + "\n"

    def resonator(self):
        """Returns a resonator of few cells. Its vibration wears the joint in some iterations."""
        return {
            "title": "Drawn resonator",
            "joint.size": ["40 mm", "36 mm"],
            "joint.grid": [27, 27],
            "joint.elements": [9, 9],
            "material.youngs_modulus": "198.4 GPa",
            "material.poisson_ratio": 0.3,
            "material.density": "7949 kg/m^3",
            "surface.kind": "gaussian",
            "surface.rq": f"{self.between(1.0, 4.0)} um",
            "surface.correlation_length": ["5 mm", "4 mm"],
            "surface.seed": self.randint(1, 1000),
            "contact.friction_coefficient": 0.6,
            "contact.normal_load": f"{self.between(20.0, 40.0)} kN",
            "structure.kind": "resonator",
            **{f"structure.{name}_cells": cells for name, cells in CELLS.items()},
            "dynamics.force": {"amplitude": f"{self.between(200.0, 400.0)} N", "at": "far_wall", "direction": "x"},
            "dynamics.harmonics": [0, 1],
            "dynamics.modes": 10,
            "dynamics.damping_ratio": 0.01,
            "dynamics.frequency": ["900 Hz", "1100 Hz"],
            "dynamics.points": 3,
            "wear.coefficient": "2e5 um^3/J",
            "wear.cycles": 200_000,
            "wear.tolerance": 0.05,
            "update.stiffness_change": 0.01,
            "fidelity.aft_samples": 32,
            "output.curves_every": 0,
        }

    def bars(self, structure, tip):
        """Returns two bars (structures.py). Their bending wears the joint in some iterations."""
        return {
            "title": "Drawn bars",
            "joint.size": ["12 mm", "15 mm"],
            "joint.grid": [24, 20],
            "material.youngs_modulus": "210 GPa",
            "material.poisson_ratio": 0.3,
            "surface.kind": "gaussian",
            "surface.rq": f"{self.between(0.3, 0.6)} um",
            "surface.correlation_length": ["1.5 mm", "2 mm"],
            "surface.seed": self.randint(1, 1000),
            "contact.friction_coefficient": self.between(0.4, 0.7),
            "contact.normal_load": f"{self.between(2.0, 3.0)} kN",
            **{f"structure.{key}": value for key, value in structure.items()},
            "structure.unit": {"length": "mm", "mass": "t", "time": "s"},
            "dynamics.force": {"amplitude": f"{self.between(1.0, 1.5)} N", "at": tip, "direction": "z"},
            "dynamics.harmonics": [0, 1, 2, 3],
            "dynamics.modes": 6,
            "dynamics.damping_ratio": 0.01,
            "dynamics.frequency": ["1 kHz", "4 kHz"],
            "dynamics.points": 3,
            "wear.coefficient": "2e5 um^3/J",
            "wear.cycles": 200_000,
            "wear.tolerance": 0.05,
            "update.iterations": 2,
            "fidelity.aft_samples": 32,
            "output.curves_every": 0,
        }

    def oscillator(self):
        """Returns a mass on springs without contact."""
        return {
            "title": "Drawn oscillator",
            "structure.kind": "oscillator",
            "structure.mass": "1 kg",
            "structure.damping": f"{self.between(10.0, 40.0)} N s/m",
            "structure.stiffness": "4 N/um",
            "dynamics.force": {"amplitude": f"{self.between(50.0, 120.0)} N", "at": "mass", "direction": "x"},
            "dynamics.harmonics": [0, 1, 3],
            "dynamics.frequency": ["160 Hz", "750 Hz"],
            "dynamics.points": 9,
        }

    def slider(self):
        """Returns a mass on springs with a friction contact."""
        return self.oscillator() | {
            "contact.kn": f"{self.between(6.0, 10.0)} N/um",
            "contact.kt": f"{self.between(4.0, 8.0)} N/um",
            "contact.friction_coefficient": 0.3,
            "contact.normal_load": "1000 N",
        }


def without(keys, *sections):
    """Returns a scene without some sections."""
    return {key: value for key, value in keys.items() if key.partition(".")[0] not in sections}


# Changes of a random rough joint, one case each. A function gets the random numbers of the case.
ROUGH = {
    "straight": {},
    "exponential": {"surface.kind": "exponential"},
    "self_affine_periodic": {
        "surface.kind": "self_affine",
        "surface.correlation_length": None,
        "surface.hurst": 0.8,
        "surface.rolloff_wavelength": "1.5 mm",
        "surface.cutoff_wavelength": "0.4 mm",
        "contact.boundary": "periodic",
    },
    "flat": {"surface.kind": "flat", "surface.rq": None, "surface.correlation_length": None, "surface.seed": None},
    "sphere_transverse_absent": {
        "surface.kind": "sphere",
        "surface.radius": "60 mm",
        "surface.rq": None,
        "surface.correlation_length": None,
        "surface.seed": None,
        "contact.transverse": "absent",
    },
    "transverse_free": {"contact.transverse": "free"},
    "capped": {"contact.pressure_cap": "300 MPa"},
    "hole_stepped": lambda d: {
        "joint.hole.diameter": f"{0.3 * min(d.size):.3g} mm",
        "fidelity.cycle": "stepped",
        "fidelity.steps_per_cycle": 16,
    },
    "orbit": lambda d: {"motion.amplitude": d.amplitudes(), "motion.phase": ["0 deg", "90 deg"], "fidelity.steps_per_cycle": 24},
    "varying_load": lambda d: {
        "motion.normal_load_amplitude": f"{0.3 * d.load:.4g} N",
        "motion.phase": f"{d.randint(10, 80)} deg",
        "fidelity.steps_per_cycle": 24,
    },
    "not_extrapolated": lambda d: {
        "motion.amplitude": d.amplitudes(),
        "motion.phase": ["0 deg", "60 deg"],
        "fidelity.steps_per_cycle": 16,
        "fidelity.cycle_extrapolation": False,
    },
    "superposition": {"fidelity.cycle": "superposition"},
    "force": lambda d: {"motion.amplitude": None, "motion.force": d.force()},
    "force_transverse_free": lambda d: {
        "motion.amplitude": None,
        "motion.force": d.force(),
        "contact.transverse": "free",
        "fidelity.cycle": "stepped",
        "fidelity.steps_per_cycle": 16,
    },
    "rotation": lambda d: {"motion.amplitude": "0 um", "motion.rotation": f"{d.between(0.2, 0.5)} mrad"},
    "moment": lambda d: {
        "motion.amplitude": "0 um",
        "motion.moment": d.moment(),
        "fidelity.cycle": "stepped",
        "fidelity.steps_per_cycle": 16,
    },
    "shift_and_rotation": lambda d: {"motion.rotation": f"{d.between(0.1, 0.3)} mrad", "fidelity.steps_per_cycle": 16},
    "tilting": {"contact.rotation": "free"},
    "tilting_under_moments": lambda d: {
        "contact.rotation": "free",
        "contact.moment": [f"{2e-5 * d.load:.3g} N m", f"{-3e-5 * d.load:.3g} N m"],
    },
    "explicit": {"wear.scheme": "explicit", "wear.depth_step": "0.02 um", "wear.tolerance": None},
    "semi_implicit": {"wear.scheme": "semi_implicit", "wear.depth_step": "0.03 um", "wear.tolerance": None},
    "preset_paper": {"fidelity.preset": "paper", "wear.tolerance": None, "wear.cycles": 100_000},
    "preset_fast": {"fidelity.preset": "fast", "wear.tolerance": None},
    "preset_reference": {"fidelity.preset": "reference", "wear.tolerance": None, "wear.cycles": 150_000},
    "tolerance": {"fidelity.tolerance": 0.02, "wear.tolerance": None},
    "tight_solvers": {"fidelity.normal_tolerance": 1e-9, "fidelity.tangential_tolerance": 1e-6},
    "frictionless": {"contact.friction_coefficient": 0},
    "to_a_volume": {"wear.cycles": None, "wear.volume": "3e-5 mm^3"},
    "bolt": {"contact.bolt_stiffness": "200 N/um"},
    "pruned": {"output.keep": {"every": 4, "last": 2}, "output.curves_every": 3, "wear.tolerance": 1e-3},
}

# Changes of a random resonator.
RESONATOR = {
    "resonator": {},
    "resonator_every_second": {"update.stiffness_change": None, "update.iterations": 2},
    "resonator_by_volume": {"update.stiffness_change": None, "update.wear_volume": "0.02 mm^3"},
    "resonator_never": {"update.stiffness_change": None, "update": "never"},
    "resonator_roughness": {"contact.stiffness": "roughness", "wear.cycles": 100_000},
    "resonator_tangent": {"contact.stiffness": "tangent", "wear.cycles": 100_000},
    "resonator_by_load": {"contact.stiffness": "total", "contact.distribution": "by_load", "wear.cycles": 100_000},
    "resonator_bolt": {"contact.bolt_stiffness": "500 N/um"},
    "resonator_responses_kept": {
        "output.response_at": [60_000, 120_000],
        "output.keep": {"every": 5, "last": 1, "updates": True},
        "output.curves_every": 2,
    },
    "resonator_fast_grown_harmonics": {"fidelity.preset": "fast", "dynamics.harmonics": None, "wear.cycles": 100_000},
    "resonator_stepped": {"fidelity.cycle": "stepped", "fidelity.steps_per_cycle": 16, "wear.cycles": 100_000},
}

GIVEN = {"kn": "4000 N/um", "kt": "3300 N/um", "friction_coefficient": 0.6, "normal_load": "30 kN"}


def alone(draw, contact):
    """Returns a resonator without a rough surface."""
    keys = without(draw.resonator(), "surface", "contact", "wear", "update", "output") | {"joint.grid": None}
    return keys | {f"contact.{key}": value for key, value in contact.items()}


# Complete scenes from random numbers.
WHOLE = {
    "static_approach": lambda d: without(d.rough(), "motion", "wear")
    | {"contact.normal_load": None, "contact.friction_coefficient": None, "contact.approach": "0.5 um"},
    "static_unlike_bodies": lambda d: without(d.rough(), "motion", "wear")
    | {"material.upper.youngs_modulus": "50 GPa", "contact.friction_coefficient": 0.2, "fidelity.load_steps": 6},
    "single_pass": lambda d: without(d.rough(), "wear"),
    "resonator_on_springs": lambda d: alone(d, GIVEN),
    "resonator_bonded": lambda d: alone(d, {}),
    "oscillator_alone": Draw.oscillator,
    "oscillator_slider": lambda d: d.slider() | {"dynamics.points": None, "fidelity.aft_samples": 128},
    "oscillator_box_orbit": lambda d: d.slider()
    | {
        "dynamics.force": [
            {"amplitude": "90 N", "at": "mass", "direction": "x"},
            {"amplitude": "60 N", "at": "mass", "direction": "y", "phase": "90 deg"},
            {"amplitude": "20 N", "at": "mass", "direction": "z", "harmonic": 0},
        ],
        "dynamics.friction_law": "box",
        "dynamics.damping_ratio": 0.01,
        "dynamics.damping_basis": "free",
    },
    "oscillator_gap": lambda d: d.slider()
    | {"contact.normal_load": None, "contact.gap": "10 um", "dynamics.force": {"amplitude": "80 N", "at": "mass", "direction": "z"}},
}

# Errors in a random rough joint. Both programs must reject the scene with the same message.
WRONG = {
    "wrong_key": {"contact.nomal_load": "3 N"},
    "wrong_unit": {"contact.normal_load": "3 um"},
    "wrong_file": {
        "surface.kind": "file",
        "surface.path": "none.csv",
        "surface.rq": None,
        "surface.correlation_length": None,
        "surface.seed": None,
    },
    "beyond_friction": lambda d: {"motion.amplitude": None, "motion.force": f"{2.0 * d.friction * d.load:.4g} N"},
    "no_such_sample": {"output.cycle_fields": {"samples": [2000000]}},
    "worn_in_a_cycle": {"wear.coefficient": "2e9 um^3/J"},
    "moved_unlike_bodies": {"material.upper.youngs_modulus": "50 GPa"},
}


def changed(draw, keys, change):
    return keys | (change(draw) if callable(change) else change)


def drawn():
    """Yields cases for every kind of surface, motion, wear, vibration and start, with random numbers."""
    for changes, base in ((ROUGH, Draw.rough), (RESONATOR, Draw.resonator), (WRONG, Draw.rough)):
        for name, change in changes.items():
            draw = Draw(name)
            yield Case(name, [run("scene.toml")], {"scene.toml": text(changed(draw, base(draw), change))})
    for name, scene in WHOLE.items():
        yield Case(name, [run("scene.toml")], {"scene.toml": text(scene(Draw(name)))})

    draw = Draw("history")
    keys = draw.rough() | {"motion.amplitude": None, "motion.history": "history.csv"}
    yield Case("history", [run("scene.toml")], {"scene.toml": text(keys), "history.csv": draw.history()})

    draw = Draw("map")
    keys = without(draw.rough(), "surface") | {
        "surface.kind": "file",
        "surface.path": "heights.csv",
        "surface.unit": "um",
        "surface.detrend": "plane",
        "surface.fill": "mask",
    }
    yield Case("map", [run("scene.toml")], {"scene.toml": text(keys), "heights.csv": draw.heights()})

    for name in structures.KINDS:
        yield Case(name, [run("scene.toml")], brought(name))
    yield from several_starts()
    yield from of_many_runs()


def brought(name):
    """Returns the files of a structure from a user."""
    files, keys, tip = structures.KINDS[name]
    return {"scene.toml": text(Draw(name).bars(keys, tip)), **files()}


CAMPAIGN = """\
scene = "scene.toml"
keep = "history"
[grid]
contact.friction_coefficient = [0.4, 0.6]
[random]
n = 2
seed = 7
surface.seed = { distribution = "integers", low = 1, high = 1000 }
wear.coefficient = { distribution = "log_normal", median = "2e3 um^3/J", factor = 1.3 }
"""


def of_many_runs():
    """Yields cases of commands that create or read several runs."""
    scene = {"scene.toml": text(Draw("many").rough())}

    def campaign(command, *more):
        return ["campaign", command, *more, "--dir", "campaign"]

    yield Case(
        "campaign",
        [
            campaign("plan", "campaign.toml", "--no-rehearsal", "--json"),
            campaign("run", "--quiet", "--json"),
            campaign("status", "--json"),
            campaign("collect", "--json"),
            campaign("report"),
        ],
        {**scene, "campaign.toml": CAMPAIGN},
        folders=("campaign",),
    )
    knobs = ["--knob", "preset", "--knob", "wear_tolerance"]
    yield Case("trade", [["trade", "scene.toml", *knobs, "--dir", "trade", "--quiet", "--json"]], scene, folders=("trade",))
    worn = ["runs/a@0", "runs/a@2", "--levels", "4"]
    load = ["scene.toml", "--over", "contact.normal_load", "--from", "3 kN", "--to", "2 kN", "--levels", "3"]
    yield Case(
        "backbone",
        [
            run("scene.toml"),
            ["backbone", *worn, "-o", "backbone/worn.parquet", "--quiet", "--json"],
            ["backbone", *load, "-o", "backbone/load.parquet", "--quiet", "--json"],
        ],
        brought("mesh"),
        folders=("backbone",),
    )
    yield Case(
        "compare",
        [
            run("scene.toml"),
            run("scene.toml", run="b", sets=["contact.friction_coefficient=0.5"]),
            ["compare", "runs/a", "runs/b", "--csv", "table/last.csv"],
            ["compare", "runs/a", "runs/b", "--all", "--parquet", "table/all.parquet"],
        ],
        scene,
        folders=("table",),
    )


def several_starts():
    """Yields cases of interrupted and continued runs, of sibling runs, and of rejected starts."""
    scene = {"scene.toml": text(Draw("starts").rough() | {"wear.cycles": 600_000, "wear.tolerance": 2e-4})}
    instant = ["--max-wall", "1 us"]
    yield Case("stopped", [run("scene.toml", *instant), run(None, *instant), run("scene.toml")], scene)
    yield Case(
        "until",
        [
            run("scene.toml", "--until", "static_contact"),
            run("scene.toml", "--until", "fretting_cycle"),
            run("scene.toml", "--until", "wear"),
            run("scene.toml"),
        ],
        scene,
    )
    yield Case("extended", [run("scene.toml"), run("scene.toml", sets=["wear.cycles=900_000"])], scene)
    yield Case(
        "sibling",
        [
            run("scene.toml"),
            run(None, "--from", "runs/a@1", run="b", sets=["wear.tolerance=0.01", "contact.friction_coefficient=0.5"]),
            # The iteration does not exist.
            run(None, "--from", "runs/a@99", run="c"),
        ],
        scene,
    )
    yield Case(
        "changed",
        [
            run("scene.toml", *instant),
            # The program rejects the start, because the run belongs to another scene.
            run("scene.toml", sets=["surface.rq=3 um"]),
            run("scene.toml", "--until", "polish"),
        ],
        scene,
    )
    resonator = {"scene.toml": text(Draw("resonator_starts").resonator())}
    yield Case(
        "resonator_stopped_and_sibling",
        [
            run("scene.toml", "--until", "dynamic_response"),
            run("scene.toml", *instant),
            run("scene.toml"),
            run(None, "--from", "runs/a@1", run="b", sets=["dynamics.force.amplitude=240 N"]),
        ],
        resonator,
    )
