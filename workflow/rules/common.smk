"""What rules share: the study, paths, names, constraints, settings, resources; none is here."""

import functools
import itertools
import math
import os
import re
import sys

sys.path.insert(0, f"{workflow.basedir}/scripts")

from snakemake.exceptions import WorkflowError

from viscotrain.config import stages
from viscotrain.config.geometries import diameter_ratios, simulated
from viscotrain.config.names import (
    fraction_name,
    geometry_name,
    number_name,
    parse_fraction,
    point_name,
    sphere_name,
    train_name,
)
from viscotrain.config.reading import fitted_fluid_file
from viscotrain.config.sweep import beta_name, config_of
from viscotrain.errors import ConfigError
from viscotrain.jobs import grouping, intake, on_request, resources
from viscotrain.jobs.digests import digest

# ------------------------------------------------------------------------------------ the study

try:
    # Work in a job of several geometries: a matter of the machine, so its profile says it.
    JOB_MINUTES = intake.minutes_of_a_job(config, grouping.MINUTES)
    config.pop("job_minutes", None)
    STUDIES, MEASURED, GIVEN_TABLE, MEASURED_SPACINGS = intake.read(
        config, workflow.configfiles, first=workflow.is_main_process
    )
    # The only one; or the first of a sweep, for what they share.
    STUDY = STUDIES[0]
except ConfigError as error:
    raise WorkflowError(str(error)) from None

NAME = config["study"]
RESULTS = f"results/{NAME}"
LOGS = f"{RESULTS}/logs"
FIGURES = f"{RESULTS}/figures"
TABLE = f"{RESULTS}/table/velocity_table.nc"
UNITS = f"{RESULTS}/units.nc"
CHANNEL_FLOW = f"{RESULTS}/channel_flow.nc"
CONDITIONS = f"{RESULTS}/operating_conditions.nc"
CHECKS = f"{RESULTS}/verification"
ENVIRONMENT = "../../envs/viscotrain.yaml"
# What every job needs whose fluid is fitted, and nothing for a config that writes its fluid.
FITTED_FLUID = {"fluid": fitted_fluid_file(STUDY)} if MEASURED else {}
# What moves spheres of a duct on, and nothing for a tube, which is what is simulated.
DUCT = {"duct": CHANNEL_FLOW} if STUDY.channel.section.is_duct else {}
FIT = {"source": f"{RESULTS}/fluid_fit/fit.nc"} if MEASURED else {}
NUMBER_OF_DRAWS = STUDY.fluid.fit.draws if MEASURED else 0
SPREAD = [f"{RESULTS}/fit_spread/fit_spread.nc"] if NUMBER_OF_DRAWS else []
# A given table is of one fluid: draws of it have no simulations to run.
DRAWS = [
    f"{RESULTS}/fit_spread/draw_{number:02d}.yaml"
    for number in range(1, 1 + NUMBER_OF_DRAWS * (GIVEN_TABLE is None))
]

# --------------------------------------------------------------------------------- constraints


wildcard_constraints:
    sp=r"[0-9.e+-]+|inf",
    sf=r"[0-9.e+-]+|inf",
    deborah=r"[0-9.e+-]+",
    volume_fraction=r"(_feed)?[0-9.e+-]+",
    kind="mesh|order|box|time_step",
    gap=r"[0-9.e+-]+",


# ---------------------------------------------------------------------------------- what there is

if STUDY.dns.method == "transient":
    SIMULATIONS = [
        ("transient", point_name(*geometry, De))
        for geometry, deborahs in simulated(STUDY).items()
        for De in deborahs
    ]
else:
    SIMULATIONS = [("dns", geometry_name(*geometry)) for geometry in simulated(STUDY)]

RATIOS = [] if GIVEN_TABLE else diameter_ratios(STUDY)
SINGLE_SPHERES = [("dns", sphere_name(ratio)) for ratio in RATIOS]
DNS_JOBS = grouping.jobs(STUDY, JOB_MINUTES)

TRAINS = [
    train_name(De, phi, STUDY.trains.feed)
    for De in STUDY.train_deborahs
    for phi in STUDY.trains.fractions
]
MOVIES = [train_name(*train, STUDY.trains.feed) for train in STUDY.movie_conditions()]
MAP = [train_name(*train, STUDY.map_feed) for train in STUDY.map_conditions()]
MAP_FRACTIONS = list(dict.fromkeys(phi for _, phi in STUDY.map_conditions()))

# Names of what a design tries at each De: mean spacings, and the rate of beads that is wanted.
DESIGN_DEBORAHS = [number_name(De) for De in STUDY.deborah.values if De > 0]
DESIGN_TRAINS = [f"s{number_name(s)}" for s in STUDY.design.spacing] + (
    ["rate"] if stages.encapsulation(STUDY).bead_rate else []
)

TRAIN_FIGURES = ["spacing", "strings", "train"]
RELATIVE_VELOCITIES = {
    f"relative_velocities_De{number_name(De)}": number_name(De)
    for De in STUDY.deborah.values
}
ALL_FIGURES = [
    "schematic",
    "rheology",
    "pair_velocity",
    *(["stress_field"] if STUDY.field_point() else []),
    *RELATIVE_VELOCITIES,
    *[f"{figure}_{train}" for figure in TRAIN_FIGURES for train in TRAINS],
    *[f"stations_{train}" for train in MOVIES],
    *(["spacing_law", "design_map"] if MAP else []),
    "order",
    "diameter_variation",
    "encapsulation",
]

CHECK = STUDY.verification
START_UPS = [point_name(point.sp, point.sf, point.deborah) for point in CHECK.transient]
CLOSURE_DEBORAHS = [number_name(De) for De in STUDY.closure_deborahs]
CLOSURE_GAPS = [number_name(gap) for gap in CHECK.closure.gaps if CLOSURE_DEBORAHS]
TRIPLETS = [
    geometry_name(triplet.sp, triplet.sf) for triplet in CHECK.convergence.geometries
]
CONVERGENCE = ["mesh", "order", "box", "time_step"] if TRIPLETS else []
REPORTS = [
    *(["start_up"] if START_UPS else []),
    *(["closure"] if CLOSURE_DEBORAHS else []),
    *CONVERGENCE,
]

# ----------------------------------------------------------------------------- several diameters

# In the report, what is of one diameter among several stands under it. (At the beginning of a line
# Snakemake would take the name of this function for a directive.)
if "/" in NAME:
    OF_ONE = {"subcategory": f"d/D = {STUDY.confinement:g}"}
    globals()["report"] = functools.partial(report, **OF_ONE)

# The config of each diameter by the name of its module, with which its rules begin: beta0_2_.
MODULES = {
    re.sub(r"\W", "_", f"{beta_name(study)}_"): study.model_dump()
    | {"job_minutes": JOB_MINUTES}
    for study in STUDIES
}


# Figures that compare diameters.
COMPARING = [
    "confinement",
    "confinement_length",
    "confinement_order",
    *(["confinement_design_map"] if MAP else []),
]


def made_by(rule, key):
    """What a rule makes at each diameter."""
    return [getattr(rules, module + rule).output[key] for module in MODULES]


def common_targets(rules):
    """Files of all diameters by the name of the rule that makes or asks for them at each."""
    named, found = {rule.name: rule for rule in rules}, {}
    own = [name for name in named if not name.startswith(tuple(MODULES))]
    for module, name in itertools.product(MODULES, named):
        target = name.removeprefix(module)
        if target != name and target not in own and not named[name].has_wildcards():
            files = named[name].output or named[name].input
            found.setdefault(target, []).extend(files)
    return found | {
        "all": [file for name in own for file in named[name].output] + found["all"]
    }


# Files of rules that are asked for by name or by other rules, if at all.
ON_REQUEST = [
    "verification.smk",
    "design.smk",
    "dns.smk" if STUDY.dns.method == "transient" else "transient.smk",
    *([] if MAP else ["design_map.smk"]),
]
TRAIN = "De{deborah}_phi{volume_fraction}"


def everything(rules):
    """All that the stages of a run make, so that whatever is missing is made again.

    The rules may be those of several diameters; each has a folder of its own.
    """
    return [
        file
        for rule in rules
        if os.path.basename(str(rule.snakefile)) not in ON_REQUEST
        for pattern in rule.output
        if str(pattern).startswith(f"{RESULTS}/")
        for file in instances(rule.name, str(pattern))
    ]


def instances(rule, pattern):
    """The files that a pattern of an output stands for; it has the constraints of wildcards."""
    pattern = re.sub(r"{(\w+),[^}]*}", r"{\1}", pattern)
    if TRAIN in pattern:
        trains = MOVIES if rule.endswith(("film", "movies")) else TRAINS
        return [pattern.replace(TRAIN, train) for train in trains]
    if "{sp}" in pattern:
        point = "sp{sp}_sf{sf}_De{deborah}"
        return [pattern.replace(point, name) for _, name in SIMULATIONS]
    if "{deborah}" in pattern:
        values = dict.fromkeys(De for De, _ in STUDY.map_conditions())
        return [pattern.replace("{deborah}", number_name(De)) for De in values]
    return [pattern]


# ------------------------------------------------------------------------ what a job is given


def given(script, settings=None):
    """Parameters of all rules with scripts: what numbers follow from, besides the input."""
    own = {} if settings is None else {"settings": settings.stated()}
    return {"study": NAME, "code": digest(script), **own}


def transient_settings(wildcards):
    return stages.transient(STUDY, float(wildcards.deborah)).stated()


def closure_train_settings(wildcards):
    return stages.closure_train(STUDY, float(wildcards.deborah)).stated()


# ---------------------------------------------------------------------------- several in a job


def kept(path):
    """An output that a job does not make again if it is there and current."""
    return update(path) if os.path.exists(path) else path


def simulating(names, most=8):
    """A message that names geometries, only those that are not there if some are."""
    new = [name for name in names if not os.path.exists(f"{RESULTS}/dns/{name}.nc")]
    shown = new or names
    more = f" and {len(shown) - most} more" if len(shown) > most else ""
    return f"Simulating {', '.join(shown[:most])}{more}"


def asked_for(name):
    """No file; an error if what is asked for by name cannot be made, or takes too long."""

    def check(wildcards):
        try:
            source = ", ".join(map(str, workflow.configfiles))
            intake.check_request(name, STUDIES, source)
        except ConfigError as error:
            raise WorkflowError(str(error)) from None
        return []

    return check


# ----------------------------------------------------------------------------------- resources


def largest_deborah(wildcards):
    """In the definition that decides on meshes and costs, as far as it is known."""
    De = float(wildcards.get("deborah", max(STUDY.deborah.values)))
    return De if STUDY.fluid.modes is None else STUDY.deborah_longest_mode(De)


def solving(stage, geometries=1):
    """Resources of what solves flows, of several geometries one after the other."""
    return {
        "mem_mb": lambda wildcards, attempt: resources.megabytes(
            largest_deborah(wildcards), attempt
        ),
        "runtime": lambda wildcards, attempt: resources.minutes(
            stage, largest_deborah(wildcards), attempt, geometries
        ),
    }


def not_solving(stage):
    """Resources of what does not."""
    seconds, resident = resources.OTHERS[stage]
    return {
        "mem_mb": lambda wildcards, attempt: resources.megabytes_for(resident, attempt),
        "runtime": lambda wildcards, attempt: resources.minutes_for(seconds, attempt),
    }


def simulating_trains(runs, feed, fractions=()):
    """Resources of all repeats of a section of the config at some volume fractions."""

    def runtime(wildcards, attempt):
        wanted = fractions or [parse_fraction(wildcards.volume_fraction)]
        seconds = sum(resources.train_seconds(STUDY, phi, runs, feed) for phi in wanted)
        return resources.minutes_for(seconds, attempt)

    return not_solving("trains") | {"runtime": runtime}


def designing():
    """Resources of all trains of a design at one Deborah number, about the mean."""

    def runtime(wildcards, attempt):
        trains = [
            job for job in on_request.of_design(STUDY) if job.stage == "design_trains"
        ]
        longest = max((job.seconds for job in trains), default=0.0)
        return resources.minutes_for(longest, attempt)

    return not_solving("trains") | {"runtime": runtime}


def varying_diameters():
    """Resources of trains at several variations of diameters."""

    def runtime(wildcards, attempt):
        return resources.minutes_for(resources.variation_seconds(STUDY), attempt)

    return not_solving("trains") | {"runtime": runtime}
