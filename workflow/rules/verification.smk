"""Verification of a study, on request (`snakemake verification`): is each number to be trusted?"""


rule verification:
    input:
        expand(f"{CHECKS}/{{report}}.png", report=REPORTS),
        f"{CHECKS}/accuracy.md",


rule start_up:
    input:
        **FITTED_FLUID,
        trajectory=f"{RESULTS}/transient/sp{{sp}}_sf{{sf}}_De{{deborah}}.nc",
    output:
        result=f"{CHECKS}/start_up/sp{{sp}}_sf{{sf}}_De{{deborah}}.nc",
    log:
        f"{LOGS}/verification/start_up_sp{{sp}}_sf{{sf}}_De{{deborah}}.log",
    conda:
        ENVIRONMENT
    threads: 1
    resources:
        **solving("transient"),
    params:
        **given("start_up", stages.start_up(STUDY)),
    message:
        "Comparing with quasi-steady velocities: sp = {wildcards.sp}, sf = {wildcards.sf}, "
        "De = {wildcards.deborah}"
    script:
        "../../scripts/start_up.py"


rule closure_train:
    input:
        **FITTED_FLUID,
    output:
        result=f"{CHECKS}/closure/train_De{{deborah}}.nc",
    log:
        f"{LOGS}/verification/closure_train_De{{deborah}}.log",
    conda:
        ENVIRONMENT
    threads: 1
    resources:
        **solving("closure_train"),
    params:
        **given("closure_train"),
        settings=closure_train_settings,
    message:
        "Simulating a short train directly, De = {wildcards.deborah}"
    script:
        "../../scripts/closure_train.py"


rule closure_gap:
    input:
        **FITTED_FLUID,
    output:
        result=f"{CHECKS}/closure/gap{{gap}}.csv",
    log:
        f"{LOGS}/verification/closure_gap{{gap}}.log",
    conda:
        ENVIRONMENT
    threads: 1
    resources:
        **solving("convergence"),
    params:
        **given("closure_gap", stages.closure_gap(STUDY)),
    message:
        "Simulating equally spaced spheres with gaps of {wildcards.gap} d"
    script:
        "../../scripts/closure_gap.py"


rule convergence:
    input:
        **FITTED_FLUID,
    output:
        result=f"{CHECKS}/convergence/{{kind}}_sp{{sp}}_sf{{sf}}.csv",
    log:
        f"{LOGS}/verification/{{kind}}_sp{{sp}}_sf{{sf}}.log",
    conda:
        ENVIRONMENT
    threads: 1
    resources:
        **solving("convergence"),
    params:
        **given("convergence", stages.convergence(STUDY)),
    message:
        "Study of convergence: {wildcards.kind}, sp = {wildcards.sp}, sf = {wildcards.sf}"
    script:
        "../../scripts/convergence.py"


rule verification_report:
    input:
        asked_for("verification"),
        table=TABLE,
        start_up=expand(f"{CHECKS}/start_up/{{point}}.nc", point=START_UPS),
        closure_train=expand(f"{CHECKS}/closure/train_De{{De}}.nc", De=CLOSURE_DEBORAHS),
        closure_gap=expand(f"{CHECKS}/closure/gap{{gap}}.csv", gap=CLOSURE_GAPS),
        convergence=expand(
            f"{CHECKS}/convergence/{{kind}}_{{triplet}}.csv",
            kind=CONVERGENCE,
            triplet=TRIPLETS,
        ),
    output:
        expand(f"{CHECKS}/{{report}}{{end}}", report=REPORTS, end=[".pdf", ".csv"]),
        [
            report(
                f"{CHECKS}/{name}.png",
                caption=f"../report/{'convergence' if name in CONVERGENCE else name}.rst",
                category="Verification",
                labels={"figure": name.replace("_", " ")},
            )
            for name in REPORTS
        ],
        accuracy=report(
            f"{CHECKS}/accuracy.md",
            caption="../report/accuracy.rst",
            category="Verification",
            labels={"figure": "all errors"},
        ),
    log:
        f"{LOGS}/verification/report.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("verification_report"),
    params:
        **given("verification_report"),
    message:
        "Figures and tables of the verification"
    script:
        "../../scripts/verification_report.py"
