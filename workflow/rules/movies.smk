"""Movies of filmed trains: positions of spheres, movies of all cameras, a view of all stations."""


rule film:
    input:
        **DUCT,
        table=TABLE,
        trains=f"{RESULTS}/trains/De{{deborah}}_phi{{volume_fraction}}.nc",
    output:
        result=f"{RESULTS}/movies/De{{deborah}}_phi{{volume_fraction}}.nc",
    log:
        f"{LOGS}/movies/film_De{{deborah}}_phi{{volume_fraction}}.log",
    priority: 1  # movies take long, and short jobs last keep all cores busy to the end
    conda:
        ENVIRONMENT
    resources:
        **not_solving("film"),
    params:
        **given("film", stages.film(STUDY)),
    message:
        "Filming the train at De{wildcards.deborah}_phi{wildcards.volume_fraction}"
    script:
        "../../scripts/film.py"


rule movies:
    input:
        film=f"{RESULTS}/movies/De{{deborah}}_phi{{volume_fraction}}.nc",
        units=UNITS,
    output:
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
            f"{FIGURES}/stations_De{{deborah}}_phi{{volume_fraction}}.png",
            caption="../report/stations.rst",
            category="Trains",
            labels={
                "figure": "cameras",
                "De": "{deborah}",
                "phi": "{volume_fraction}",
            },
        ),
        data=multiext(
            f"{FIGURES}/stations_De{{deborah}}_phi{{volume_fraction}}",
            ".pdf",
            ".nc",
        ),
    log:
        f"{LOGS}/movies/De{{deborah}}_phi{{volume_fraction}}.log",
    priority: 1
    conda:
        ENVIRONMENT
    resources:
        **not_solving("movies"),
    params:
        **given("movies", stages.movies(STUDY)),
    message:
        "Movies of the train at De{wildcards.deborah}_phi{wildcards.volume_fraction}"
    script:
        "../../scripts/movies.py"
