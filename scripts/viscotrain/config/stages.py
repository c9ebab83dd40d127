"""From a study to the settings of its stages: the one place where it is said what each depends on.

A fluid that is still to be fitted is left out; see `settings`.
"""

import math
from collections.abc import Sequence
from functools import lru_cache

from viscotrain.config.design_settings import DesignSettings, DesignTrainsSettings
from viscotrain.config.device_settings import (
    FiguresSettings,
    FitSpreadSettings,
    OperatingConditionsSettings,
    RheologySettings,
    SchematicSettings,
    UnitsSettings,
)
from viscotrain.config.geometries import pair_distances, simulated_deborahs
from viscotrain.config.models import Resolution
from viscotrain.config.settings import (
    CaseSettings,
    ChannelFlowSettings,
    ClosureGapSettings,
    ClosureTrainSettings,
    ConfinementSettings,
    DesignMapSettings,
    DiameterVariationSettings,
    EncapsulationSettings,
    FieldSettings,
    FilmSettings,
    FlowSettings,
    FluidFitSettings,
    MeasuredSettings,
    MoviesSettings,
    OrderSettings,
    StudyConfigSettings,
    TableSettings,
    TrainsSettings,
    TransientSettings,
    longest_mode,
)
from viscotrain.config.study import Study
from viscotrain.fluid.parameters import DimensionlessFluid

DRAWN = (1.2, 1.6, 2.5, math.inf)  # distances in d, of a study that has none
OF_THE_STUDY = ("schematic", "rheology")  # figures that show the config itself


def study_config(study: Study) -> StudyConfigSettings:
    """All of it, for the record that a run leaves."""
    return StudyConfigSettings(config=study.model_dump())


def fluid_fit(study: Study) -> FluidFitSettings:
    """The fit of the fluid to measured data."""
    fit = study.fluid.fit
    return FluidFitSettings(
        modes=fit.modes,
        solvent_viscosity=study.fluid.solvent_viscosity,
        relaxation_times=fit.relaxation_times,
        mobilities=fit.mobilities,
    )


@lru_cache(maxsize=8)
def flow(study: Study) -> FlowSettings:
    """Flows around spheres at all Deborah numbers of the study."""
    return _flow(study, study.deborah.values)


def _flow(study: Study, deborahs: tuple[float, ...]) -> FlowSettings:
    fluid = _scaled(study)
    mean = _is_mean(study)
    unknown = mean and fluid is None
    longest = None if unknown else tuple(longest_mode(De, fluid, mean) for De in deborahs)
    resolution = study.dns.model_dump(include=set(Resolution.model_fields))
    return FlowSettings(
        confinement=study.confinement,
        dimensionless_fluid=fluid,
        deborah=deborahs,
        longest_modes=longest,
        dns=Resolution.model_validate(resolution),
    )


def dns(study: Study, sp: float, sf: float) -> FlowSettings:
    """One geometry, (sp, sf) in d, at the Deborah numbers at which the study needs it.

    These are all, or all but 0 where the mirror image is solved; see `triplets`.
    """
    return flow(study).at(simulated_deborahs(study, sp, sf))


def single_sphere(study: Study, diameter_ratio: float) -> FlowSettings:
    """One sphere of another diameter, over that of the study, at all Deborah numbers."""
    own = flow(study)
    return own.model_copy(update={"confinement": diameter_ratio * own.confinement})


def field(study: Study) -> FieldSettings:
    """The triplet of the table whose fields are drawn."""
    point = study.field_point()
    assert point is not None  # or no rule asks for it
    own = flow(study).at(point.deborah)
    return FieldSettings(**dict(own), sp=point.sp, sf=point.sf)


def start_up(study: Study) -> FlowSettings:
    """Quasi-steady velocities beside a start-up, at its De and those on the way there."""
    return flow(study)


def transient(study: Study, deborah: float) -> TransientSettings:
    """The start-up at one Deborah number."""
    own = _flow(study, (deborah,))
    return TransientSettings(**dict(own), transient=study.dns.transient)


def convergence(study: Study) -> TransientSettings:
    """Other resolutions and time steps, at all Deborah numbers."""
    return TransientSettings(**dict(flow(study)), transient=study.dns.transient)


def closure_train(study: Study, deborah: float) -> ClosureTrainSettings:
    """A short train that is simulated directly."""
    closure = study.verification.closure
    return ClosureTrainSettings(
        flow=transient(study, deborah), distances=closure.distances, duration=closure.duration
    )


def closure_gap(study: Study) -> ClosureGapSettings:
    """Equally spaced spheres at the Deborah numbers of the closure, and those on the way there."""
    highest = max(study.closure_deborahs, default=0.0)
    return ClosureGapSettings(
        flow=flow(study).at([De for De in study.deborah.values if De <= highest]),
        spheres=len(study.verification.closure.distances) + 1,
        deborah=study.closure_deborahs,
    )


def table(study: Study) -> TableSettings:
    """The table of all velocities."""
    return TableSettings(
        sp=study.table.sp,
        sf=study.table.sf,
        pair=pair_distances(study),
        deborah=study.deborah.values,
        line_spacing=study.table.line_spacing,
        accuracy=study.dns.accuracy,
        relative_accuracy=study.dns.relative_accuracy,
        max_holes=study.table.max_holes,
    )


def given_table(study: Study) -> CaseSettings:
    """What a finished table must be of."""
    own = flow(study)
    return CaseSettings(
        confinement=own.confinement,
        dimensionless_fluid=own.dimensionless_fluid,
        deborah=own.deborah,
        longest_modes=own.longest_modes,
    )


def trains(study: Study) -> TrainsSettings:
    """Trains as the section `trains` asks for them."""
    return TrainsSettings(
        closure=study.trains.closure,
        injection=study.trains.injection,
        feed=study.trains.feed,
        memory=study.trains.memory,
        diameter_variation=study.particle.diameter_variation,
        confinement=study.confinement,
        section=study.channel.section,
        length=study.channel.length,
        stations=study.stations,
        repeats=study.trains.repeats,
        passages=study.trains.passages,
        seed=study.trains.seed,
    )


def measured(study: Study) -> MeasuredSettings:
    """What measured spacings are compared with."""
    return MeasuredSettings(
        station=study.stations,
        deborah=study.train_deborahs,
        volume_fraction=study.trains.fractions,
    )


def design_points(study: Study) -> TrainsSettings:
    """Trains of the design map, recorded evenly from inlet to outlet."""
    length, intervals = study.channel.length, study.design_map.stations - 1
    return trains(study).model_copy(
        update={
            "stations": tuple(length * n / intervals for n in range(intervals + 1)),
            "repeats": study.design_map.repeats,
            "passages": study.design_map.passages,
            "feed": study.map_feed,
        }
    )


def order(study: Study) -> OrderSettings:
    """Stability and ordering length of equally spaced trains."""
    return OrderSettings(
        closure=study.trains.closure,
        injection=study.trains.injection,
        feed=study.trains.feed,
        confinement=study.confinement,
        section=study.channel.section,
        length=study.channel.length,
        deborah=study.train_deborahs,
        fractions=study.trains.fractions,
        ordered_variation=study.design_map.ordered_variation,
    )


def diameter_variation(study: Study) -> DiameterVariationSettings:
    """Trains of the section `trains`, recorded at the outlet only, fewer of them."""
    own = trains(study).model_copy(
        update={
            "stations": (study.channel.length,),
            "repeats": 1,
            "passages": min(study.trains.passages, study.design_map.passages),
        }
    )
    return DiameterVariationSettings(
        trains=own,
        deborah=study.train_deborahs,
        fractions=study.trains.fractions,
        ordered_variation=study.design_map.ordered_variation,
    )


def confinement(studies: Sequence[Study]) -> ConfinementSettings:
    """The studies of all diameters beside each other."""
    return ConfinementSettings(
        diameters=tuple(study.study.rpartition("/")[2] for study in studies),
        length=studies[0].channel.length,
        accuracy=studies[0].dns.accuracy,
    )


def film(study: Study) -> FilmSettings:
    """Films of trains."""
    return FilmSettings(
        field_of_view=study.movie_field_of_view(),
        interval=study.movies.interval,
        frames=study.movies.frames,
        section=study.channel.section,
    )


def movies(study: Study) -> MoviesSettings:
    """Movies of films."""
    return MoviesSettings(width=study.movies.width, frame_rate=study.movies.frame_rate)


def design_map(study: Study) -> DesignMapSettings:
    """The map of all conditions."""
    return DesignMapSettings(
        closure=study.trains.closure,
        section=study.channel.section,
        ordered_variation=study.design_map.ordered_variation,
    )


def encapsulation(study: Study) -> EncapsulationSettings:
    """Beads in droplets."""
    own = study.encapsulation
    wanted = own.droplet_frequency if own.bead_rate is None else own.bead_rate
    return EncapsulationSettings(droplet_frequency=own.droplet_frequency, bead_rate=wanted)


def design_trains(study: Study) -> DesignTrainsSettings:
    """Trains that a design tries, recorded at the inlet, half-way and at the outlet."""
    length, own = study.channel.length, study.design
    recorded = {"stations": (0.0, length / 2, length), "feed": False}
    return DesignTrainsSettings(
        trains=trains(study).model_copy(
            update=recorded | {"repeats": own.repeats, "passages": own.passages}
        ),
        spacing=own.spacing,
        bead_rate=encapsulation(study).bead_rate,
    )


def design(study: Study) -> DesignSettings:
    """The answer of a design."""
    wanted = encapsulation(study)
    return DesignSettings(
        trains=design_trains(study).trains,
        conditions=operating_conditions(study),
        ordered_variation=study.design_map.ordered_variation,
        bead_rate=wanted.bead_rate,
        droplet_frequency=wanted.droplet_frequency,
    )


def figures(study: Study, name: str = "") -> FiguresSettings:
    """Figures that show data; with the `name` of one of the study itself, those."""
    if name not in OF_THE_STUDY:
        return FiguresSettings(confinement=study.confinement, section=study.channel.section)
    return FiguresSettings(
        confinement=study.confinement,
        section=study.channel.section,
        schematic=schematic(study),
        rheology=rheology(study),
    )


def schematic(study: Study) -> SchematicSettings:
    """The drawing of triplet and train."""
    return SchematicSettings(
        confinement=study.confinement,
        section=study.channel.section,
        sp=study.table.sp or DRAWN,
        sf=study.table.sf or DRAWN,
        margin=study.dns.margin,
        volume_fraction=study.trains.fractions[0],
        feed=study.trains.feed,
        deborah=study.train_deborahs[0],
        channel_length=study.channel.length,
    )


def rheology(study: Study) -> RheologySettings:
    """The curves of the fluid."""
    written = study.fluid.modes is not None
    return RheologySettings(
        fluid=study.fluid.physical() if written else None,
        deborah=study.deborah.values,
        mean=_is_mean(study),
    )


def units(study: Study) -> UnitsSettings:
    """What physical units follow from."""
    return UnitsSettings(
        **dict(rheology(study)),
        channel_diameter=study.channel.inscribed_diameter,
        section=study.channel.section,
        particle_diameter=study.particle.diameter,
    )


def channel_flow(study: Study) -> ChannelFlowSettings:
    """The flow without spheres, at all Deborah numbers."""
    return ChannelFlowSettings(**dict(given_table(study)), section=study.channel.section)


def operating_conditions(study: Study) -> OperatingConditionsSettings:
    """What the validity of conditions follows from, besides their files."""
    return OperatingConditionsSettings(
        **dict(rheology(study)),
        fluid_density=study.fluid.density,
        particle_density=study.particle.density,
        section=study.channel.section,
    )


def fit_spread(study: Study) -> FitSpreadSettings:
    """Fluids drawn from the fit, at the study's flow rates."""
    return FitSpreadSettings(
        **dict(rheology(study)),
        draws=study.fluid.fit.draws,
        channel_diameter=study.channel.inscribed_diameter,
        section=study.channel.section,
        channel_length=study.channel.length,
        config=study.model_dump(),
    )


def _scaled(study: Study) -> DimensionlessFluid | None:
    return None if study.fluid.modes is None else study.dimensionless_fluid


def _is_mean(study: Study) -> bool:
    return study.deborah.definition == "mean_relaxation_time"
