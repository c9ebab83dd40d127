"""Figures, each as PNG and PDF with its data beside it."""

FIGURES = [
    "schematic",
    "rheology",
    "pair_velocity",
    "stress_field",
    *[f"relative_velocities_De{number_name(De)}" for De in STUDY.deborah.values],
    *[
        f"{kind}_{train_name(De, phi)}"
        for kind in ("spacing", "train")
        for De in STUDY.trains.deborah
        for phi in STUDY.trains.volume_fraction
    ],
    *[f"stations_{train}" for train in MOVIES],
    *(["spacing_law", "design_map"] if MAP else []),
]


rule schematic:
    output:
        report(
            f"{RESULTS}/figures/schematic.png",
            caption="../report/schematic.rst",
            category="Study",
            labels={"figure": "schematic"},
        ),
        multiext(f"{RESULTS}/figures/schematic", ".pdf", ".nc"),
    log:
        f"{RESULTS}/logs/figures/schematic.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        settings=STUDY.schematic_settings(),
    message:
        "Figure: schematic of the triplet and of the train"
    script:
        "../../scripts/schematic.py"


rule relative_velocities:
    input:
        f"{RESULTS}/table/velocity_table.nc",
        **FITTED_FLUID,
    output:
        report(
            f"{RESULTS}/figures/relative_velocities_De{{deborah}}.png",
            caption="../report/relative_velocities.rst",
            category="Velocities",
            labels={"figure": "relative velocities", "De": "{deborah}"},
        ),
        multiext(f"{RESULTS}/figures/relative_velocities_De{{deborah}}", ".pdf", ".nc"),
    log:
        f"{RESULTS}/logs/figures/relative_velocities_De{{deborah}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        confinement=STUDY.confinement,
    message:
        "Figure: relative velocities over both distances, De = {wildcards.deborah}"
    script:
        "../../scripts/figures.py"


rule pair_velocity:
    input:
        f"{RESULTS}/table/velocity_table.nc",
        **FITTED_FLUID,
    output:
        report(
            f"{RESULTS}/figures/pair_velocity.png",
            caption="../report/pair_velocity.rst",
            category="Velocities",
            labels={"figure": "pair", "De": "all"},
        ),
        multiext(f"{RESULTS}/figures/pair_velocity", ".pdf", ".csv"),
    log:
        f"{RESULTS}/logs/figures/pair_velocity.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        confinement=STUDY.confinement,
    message:
        "Figure: relative velocity of a pair against its distance, all De"
    script:
        "../../scripts/figures.py"


rule stress_field:
    input:
        f"{RESULTS}/dns/field.nc",
        **FITTED_FLUID,
    output:
        report(
            f"{RESULTS}/figures/stress_field.png",
            caption="../report/stress_field.rst",
            category="Velocities",
            labels={
                "figure": "mesh and stress",
                "De": f"{STUDY.field_point().deborah:g}",
            },
        ),
        multiext(f"{RESULTS}/figures/stress_field", ".pdf", ".nc"),
    log:
        f"{RESULTS}/logs/figures/stress_field.log",
    conda:
        "../../envs/viscotrain.yaml"
    message:
        "Figure: mesh and polymer stress around one triplet"
    script:
        "../../scripts/figures.py"


rule spacing_or_train:
    input:
        f"{RESULTS}/trains/De{{deborah}}_phi{{volume_fraction}}.nc",
        **FITTED_FLUID,
    output:
        report(
            f"{RESULTS}/figures/{{kind}}_De{{deborah}}_phi{{volume_fraction}}.png",
            caption="../report/spacing_or_train.rst",
            category="Trains",
            labels={"figure": "{kind}", "De": "{deborah}", "phi": "{volume_fraction}"},
        ),
        multiext(
            f"{RESULTS}/figures/{{kind}}_De{{deborah}}_phi{{volume_fraction}}",
            ".pdf",
            ".nc",
        ),
    log:
        f"{RESULTS}/logs/figures/{{kind}}_De{{deborah}}_phi{{volume_fraction}}.log",
    wildcard_constraints:
        kind="spacing|train",
    conda:
        "../../envs/viscotrain.yaml"
    message:
        "Figure: {wildcards.kind}, De = {wildcards.deborah}, phi = {wildcards.volume_fraction}"
    script:
        "../../scripts/figures.py"


rule stations:
    input:
        f"{RESULTS}/movies/De{{deborah}}_phi{{volume_fraction}}.nc",
        **FITTED_FLUID,
    output:
        report(
            f"{RESULTS}/figures/stations_De{{deborah}}_phi{{volume_fraction}}.png",
            caption="../report/stations.rst",
            category="Trains",
            labels={
                "figure": "cameras",
                "De": "{deborah}",
                "phi": "{volume_fraction}",
            },
        ),
        multiext(
            f"{RESULTS}/figures/stations_De{{deborah}}_phi{{volume_fraction}}",
            ".pdf",
            ".nc",
        ),
    log:
        f"{RESULTS}/logs/figures/stations_De{{deborah}}_phi{{volume_fraction}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    message:
        "Figure: all stations, De = {wildcards.deborah}, phi = {wildcards.volume_fraction}"
    script:
        "../../scripts/figures.py"


rule map_figure:
    input:
        f"{RESULTS}/design_map/design_map.nc",
        **FITTED_FLUID,
    output:
        report(
            f"{RESULTS}/figures/{{name}}.png",
            caption="../report/map_figure.rst",
            category="Design",
            labels={"figure": "{name}"},
        ),
        multiext(f"{RESULTS}/figures/{{name}}", ".pdf", ".csv"),
    log:
        f"{RESULTS}/logs/figures/{{name}}.log",
    wildcard_constraints:
        name="spacing_law|design_map",
    conda:
        "../../envs/viscotrain.yaml"
    message:
        "Figure: {wildcards.name}"
    script:
        "../../scripts/figures.py"
