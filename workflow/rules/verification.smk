"""Verification of a study, on request (`snakemake verification`): is each number to be trusted?"""

CHECK = STUDY.verification
START_UPS = [point_name(point.sp, point.sf, point.deborah) for point in CHECK.transient]
TRIPLETS = [
    geometry_name(triplet.sp, triplet.sf) for triplet in CHECK.convergence.geometries
]
CONVERGENCE = ["mesh", "order", "box", "time_step"] if TRIPLETS else []
REPORTS = [
    *(["start_up"] if START_UPS else []),
    *(["closure"] if CHECK.closure.deborah else []),
    *CONVERGENCE,
]


wildcard_constraints:
    kind="mesh|order|box|time_step",
    gap=r"[0-9.e+-]+",


rule verification:
    input:
        expand(f"{RESULTS}/verification/{{report}}.png", report=REPORTS),
        f"{RESULTS}/verification/accuracy.md",


rule start_up:
    input:
        **FITTED_FLUID,
        source=[f"{RESULTS}/transient/sp{{sp}}_sf{{sf}}_De{{deborah}}.nc"],
    output:
        f"{RESULTS}/verification/start_up/sp{{sp}}_sf{{sf}}_De{{deborah}}.nc",
    log:
        f"{RESULTS}/logs/verification/start_up_sp{{sp}}_sf{{sf}}_De{{deborah}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    threads: 1
    params:
        code=provenance.digest(provenance.START_UP),
        settings=STUDY.dns_settings(),
    message:
        "Comparing with quasi-steady velocities: sp = {wildcards.sp}, sf = {wildcards.sf}, "
        "De = {wildcards.deborah}"
    script:
        "../../scripts/verification.py"


rule closure_train:
    input:
        **FITTED_FLUID,
        source=[f"{RESULTS}/table/velocity_table.nc"],
    output:
        f"{RESULTS}/verification/closure/train_De{{deborah}}.nc",
    log:
        f"{RESULTS}/logs/verification/closure_train_De{{deborah}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    threads: 1
    params:
        physics=provenance.digest(provenance.CLOSURE_TRAIN),
        settings=STUDY.transient_settings() | CHECK.closure.model_dump(mode="json"),
    message:
        "Simulating a short train directly, De = {wildcards.deborah}"
    script:
        "../../scripts/verification.py"


rule closure_gap:
    input:
        **FITTED_FLUID,
    output:
        f"{RESULTS}/verification/closure/gap{{gap}}.csv",
    log:
        f"{RESULTS}/logs/verification/closure_gap{{gap}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    threads: 1
    params:
        physics=provenance.digest(provenance.CLOSURE_GAP),
        settings=STUDY.dns_settings() | CHECK.closure.model_dump(mode="json"),
    message:
        "Simulating equally spaced spheres with gaps of {wildcards.gap} d"
    script:
        "../../scripts/verification.py"


rule convergence:
    input:
        **FITTED_FLUID,
    output:
        f"{RESULTS}/verification/convergence/{{kind}}_sp{{sp}}_sf{{sf}}.csv",
    log:
        f"{RESULTS}/logs/verification/{{kind}}_sp{{sp}}_sf{{sf}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    threads: 1
    params:
        physics=provenance.digest(provenance.CONVERGENCE),
        settings=STUDY.transient_settings(),
    message:
        "Study of convergence: {wildcards.kind}, sp = {wildcards.sp}, sf = {wildcards.sf}"
    script:
        "../../scripts/verification.py"


rule verification_report:
    input:
        table=f"{RESULTS}/table/velocity_table.nc",
        start_up=expand(
            f"{RESULTS}/verification/start_up/{{point}}.nc", point=START_UPS
        ),
        closure_train=[
            f"{RESULTS}/verification/closure/train_De{number_name(De)}.nc"
            for De in CHECK.closure.deborah
        ],
        closure_gap=[
            f"{RESULTS}/verification/closure/gap{number_name(gap)}.csv"
            for gap in (CHECK.closure.gaps if CHECK.closure.deborah else ())
        ],
        convergence=expand(
            f"{RESULTS}/verification/convergence/{{kind}}_{{triplet}}.csv",
            kind=CONVERGENCE,
            triplet=TRIPLETS,
        ),
    output:
        expand(
            f"{RESULTS}/verification/{{report}}{{end}}",
            report=REPORTS,
            end=[".pdf", ".csv"],
        ),
        [
            report(
                f"{RESULTS}/verification/{name}.png",
                caption=f"../report/{'convergence' if name in CONVERGENCE else name}.rst",
                category="Verification",
                labels={"figure": name.replace("_", " ")},
            )
            for name in REPORTS
        ],
        accuracy=report(
            f"{RESULTS}/verification/accuracy.md",
            caption="../report/accuracy.rst",
            category="Verification",
            labels={"figure": "all errors"},
        ),
    log:
        f"{RESULTS}/logs/verification/report.log",
    conda:
        "../../envs/viscotrain.yaml"
    message:
        "Figures and tables of the verification"
    script:
        "../../scripts/verification_report.py"
