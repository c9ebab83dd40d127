"""Movies: one job per filmed train, which makes those of all cameras."""

MOVIES = [train_name(De, phi) for De, phi in STUDY.movie_conditions()]


rule film:
    input:
        **FITTED_FLUID,
        table=f"{RESULTS}/table/velocity_table.nc",
        trains=f"{RESULTS}/trains/De{{deborah}}_phi{{volume_fraction}}.nc",
    output:
        f"{RESULTS}/movies/De{{deborah}}_phi{{volume_fraction}}.nc",
    log:
        f"{RESULTS}/logs/movies/De{{deborah}}_phi{{volume_fraction}}_film.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        code=provenance.digest(provenance.MOVIES),
        settings=STUDY.film_settings(),
    message:
        "Filming the train at De = {wildcards.deborah}, phi = {wildcards.volume_fraction}"
    script:
        "../../scripts/film.py"


rule movies:
    input:
        f"{RESULTS}/movies/De{{deborah}}_phi{{volume_fraction}}.nc",
        **FITTED_FLUID,
    output:
        report(
            directory(f"{RESULTS}/movies/De{{deborah}}_phi{{volume_fraction}}"),
            patterns=["{name}.mp4"],
            caption="../report/movies.rst",
            category="Trains",
            labels={
                "figure": "movie, {name}",
                "De": "{deborah}",
                "phi": "{volume_fraction}",
            },
        ),
    log:
        f"{RESULTS}/logs/movies/De{{deborah}}_phi{{volume_fraction}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        code=provenance.digest(provenance.MOVIES),
        settings=STUDY.movies.model_dump(include={"width", "frame_rate"}),
    message:
        "Movies of the train at De = {wildcards.deborah}, phi = {wildcards.volume_fraction}"
    script:
        "../../scripts/movies.py"
