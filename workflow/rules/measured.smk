"""Measured spacings beside those of the trains, for a config that names a file of them."""

if MEASURED_SPACINGS:

    rule measured:
        input:
            spacings=MEASURED_SPACINGS,
            trains=f"{RESULTS}/trains/De{{deborah}}_phi{{volume_fraction}}.nc",
        output:
            result=f"{RESULTS}/measured/De{{deborah}}_phi{{volume_fraction}}.nc",
        log:
            f"{LOGS}/measured/De{{deborah}}_phi{{volume_fraction}}.log",
        conda:
            ENVIRONMENT
        resources:
            **not_solving("measured"),
        params:
            **given("measured", stages.measured(STUDY)),
        message:
            "Measured spacings beside those at De{wildcards.deborah}_phi{wildcards.volume_fraction}"
        script:
            "../../scripts/measured.py"
