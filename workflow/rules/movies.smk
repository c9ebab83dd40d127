"""Movies: one job per filmed train, which makes those of all cameras, and a view of all stations."""

MOVIES = [train_name(De, phi) for De, phi in STUDY.movie_conditions()]


rule movies:
    input:
        **FITTED_FLUID,
        table=f"{RESULTS}/table/velocity_table.nc",
        trains=f"{RESULTS}/trains/De{{deborah}}_phi{{volume_fraction}}.nc",
    output:
        film=f"{RESULTS}/movies/De{{deborah}}_phi{{volume_fraction}}.nc",
        movies=report(
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
        stations=report(
            f"{RESULTS}/figures/stations_De{{deborah}}_phi{{volume_fraction}}.png",
            caption="../report/stations.rst",
            category="Trains",
            labels={
                "figure": "cameras",
                "De": "{deborah}",
                "phi": "{volume_fraction}",
            },
        ),
        data=multiext(
            f"{RESULTS}/figures/stations_De{{deborah}}_phi{{volume_fraction}}",
            ".pdf",
            ".nc",
        ),
    log:
        f"{RESULTS}/logs/movies/De{{deborah}}_phi{{volume_fraction}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        code=provenance.digest(provenance.MOVIES),
        settings=STUDY.film_settings()
        | STUDY.movies.model_dump(include={"width", "frame_rate"}),
    message:
        "Movies of the train at De = {wildcards.deborah}, phi = {wildcards.volume_fraction}"
    script:
        "../../scripts/movies.py"
