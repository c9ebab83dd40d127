"""Figures, each as PNG and PDF with its data beside it; one job per input.

Those of movies and design map are drawn where these are made."""


rule study_figures:
    input:
        **DUCT,
        **FITTED_FLUID,
        **FIT,
    output:
        png=[
            report(
                f"{FIGURES}/schematic.png",
                caption="../report/schematic.rst",
                category="Study",
                labels={"figure": "schematic"},
            ),
            report(
                f"{FIGURES}/rheology.png",
                caption="../report/rheology.rst",
                category="Study",
                labels={"figure": "fluid"},
            ),
        ],
        data=multiext(f"{FIGURES}/schematic", ".pdf", ".nc")
        + multiext(f"{FIGURES}/rheology", ".pdf", ".csv"),
    log:
        f"{LOGS}/figures/study.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("figures"),
    params:
        **given("figures", stages.figures(STUDY, "schematic")),
    message:
        "Figures: schematic of the triplet and of the train; moduli and viscosity of the fluid"
    script:
        "../../scripts/figures.py"


use rule study_figures as velocity_figures with:
    input:
        **({"field": f"{RESULTS}/dns/field.nc"} if STUDY.field_point() else {}),
        source=TABLE,
    output:
        png=[
            *[
                report(
                    f"{FIGURES}/{name}.png",
                    caption="../report/relative_velocities.rst",
                    category="Velocities",
                    labels={"figure": "relative velocities", "De": De},
                )
                for name, De in RELATIVE_VELOCITIES.items()
            ],
            report(
                f"{FIGURES}/pair_velocity.png",
                caption="../report/pair_velocity.rst",
                category="Velocities",
                labels={"figure": "pair", "De": "all"},
            ),
            *[
                report(
                    f"{FIGURES}/stress_field.png",
                    caption="../report/stress_field.rst",
                    category="Velocities",
                    labels={"figure": "change of the stress", "De": "several"},
                )
                for point in [STUDY.field_point()]
                if point
            ],
        ],
        data=[
            *expand(
                f"{FIGURES}/{{name}}{{end}}",
                name=[
                    *RELATIVE_VELOCITIES,
                    *(["stress_field"] if STUDY.field_point() else []),
                ],
                end=[".pdf", ".nc"],
            ),
            *multiext(f"{FIGURES}/pair_velocity", ".pdf", ".csv"),
        ],
    log:
        f"{LOGS}/figures/velocities.log",
    params:
        **given("figures", stages.figures(STUDY)),
    message:
        "Figures: relative velocities over both distances, of a pair, and a stress field"


use rule study_figures as train_figures with:
    input:
        **(
            {"measured": f"{RESULTS}/measured/De{{deborah}}_phi{{volume_fraction}}.nc"}
            if MEASURED_SPACINGS
            else {}
        ),
        source=f"{RESULTS}/trains/De{{deborah}}_phi{{volume_fraction}}.nc",
        units=UNITS,
    output:
        png=[
            report(
                f"{FIGURES}/{figure}_De{{deborah}}_phi{{volume_fraction}}.png",
                caption=f"../report/{figure}.rst",
                category="Trains",
                labels={
                    "figure": figure,
                    "De": "{deborah}",
                    "phi": "{volume_fraction}",
                },
            )
            for figure in TRAIN_FIGURES
        ],
        data=[
            f"{FIGURES}/{figure}_De{{deborah}}_phi{{volume_fraction}}{end}"
            for figure in TRAIN_FIGURES
            for end in (".pdf", ".nc")
        ],
    log:
        f"{LOGS}/figures/De{{deborah}}_phi{{volume_fraction}}.log",
    params:
        **given("figures", stages.figures(STUDY)),
    message:
        "Figures: spacing, strings and train, De{wildcards.deborah}_phi{wildcards.volume_fraction}"
