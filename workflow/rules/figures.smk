"""Figures, each as PNG and PDF with its data beside it; one job per input.

Those of movies and design map are drawn where these are made."""

FIGURES = [
    "schematic",
    "rheology",
    "pair_velocity",
    "stress_field",
    *[f"relative_velocities_De{number_name(De)}" for De in STUDY.deborah.values],
    *[
        f"{figure}_{train_name(De, phi)}"
        for figure in ("spacing", "train")
        for De in STUDY.trains.deborah
        for phi in STUDY.trains.volume_fraction
    ],
    *[f"stations_{train}" for train in MOVIES],
    *(["spacing_law", "design_map"] if MAP else []),
]


rule study_figures:
    input:
        **(FITTED_FLUID | {"fit": f"{RESULTS}/fluid_fit/fit.nc"} if MEASURED else {}),
    output:
        report(
            f"{RESULTS}/figures/schematic.png",
            caption="../report/schematic.rst",
            category="Study",
            labels={"figure": "schematic"},
        ),
        report(
            f"{RESULTS}/figures/rheology.png",
            caption="../report/rheology.rst",
            category="Study",
            labels={"figure": "fluid"},
        ),
        multiext(f"{RESULTS}/figures/schematic", ".pdf", ".nc"),
        multiext(f"{RESULTS}/figures/rheology", ".pdf", ".csv"),
    log:
        f"{RESULTS}/logs/figures/study.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        schematic=STUDY.schematic_settings(),
        rheology=STUDY.rheology_settings(),
    message:
        "Figures: schematic of the triplet and of the train; moduli and viscosity of the fluid"
    script:
        "../../scripts/figures.py"


rule velocity_figures:
    input:
        **FITTED_FLUID,
        table=f"{RESULTS}/table/velocity_table.nc",
        field=f"{RESULTS}/dns/field.nc",
    output:
        [
            report(
                f"{RESULTS}/figures/relative_velocities_De{De}.png",
                caption="../report/relative_velocities.rst",
                category="Velocities",
                labels={"figure": "relative velocities", "De": De},
            )
            for De in map(number_name, STUDY.deborah.values)
        ],
        report(
            f"{RESULTS}/figures/pair_velocity.png",
            caption="../report/pair_velocity.rst",
            category="Velocities",
            labels={"figure": "pair", "De": "all"},
        ),
        report(
            f"{RESULTS}/figures/stress_field.png",
            caption="../report/stress_field.rst",
            category="Velocities",
            labels={
                "figure": "mesh and stress",
                "De": f"{STUDY.field_point().deborah:g}",
            },
        ),
        [
            f"{RESULTS}/figures/relative_velocities_De{number_name(De)}{end}"
            for De in STUDY.deborah.values
            for end in (".pdf", ".nc")
        ],
        multiext(f"{RESULTS}/figures/pair_velocity", ".pdf", ".csv"),
        multiext(f"{RESULTS}/figures/stress_field", ".pdf", ".nc"),
    log:
        f"{RESULTS}/logs/figures/velocities.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        confinement=STUDY.confinement,
    message:
        "Figures: relative velocities over both distances, of a pair, and a stress field"
    script:
        "../../scripts/figures.py"


rule train_figures:
    input:
        **FITTED_FLUID,
        train=f"{RESULTS}/trains/De{{deborah}}_phi{{volume_fraction}}.nc",
    output:
        report(
            f"{RESULTS}/figures/spacing_De{{deborah}}_phi{{volume_fraction}}.png",
            caption="../report/spacing.rst",
            category="Trains",
            labels={
                "figure": "spacing",
                "De": "{deborah}",
                "phi": "{volume_fraction}",
            },
        ),
        report(
            f"{RESULTS}/figures/train_De{{deborah}}_phi{{volume_fraction}}.png",
            caption="../report/train.rst",
            category="Trains",
            labels={"figure": "train", "De": "{deborah}", "phi": "{volume_fraction}"},
        ),
        multiext(
            f"{RESULTS}/figures/spacing_De{{deborah}}_phi{{volume_fraction}}",
            ".pdf",
            ".nc",
        ),
        multiext(
            f"{RESULTS}/figures/train_De{{deborah}}_phi{{volume_fraction}}",
            ".pdf",
            ".nc",
        ),
    log:
        f"{RESULTS}/logs/figures/De{{deborah}}_phi{{volume_fraction}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    message:
        "Figures: spacing and train, De = {wildcards.deborah}, phi = {wildcards.volume_fraction}"
    script:
        "../../scripts/figures.py"
