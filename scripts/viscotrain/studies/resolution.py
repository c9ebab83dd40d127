"""Resolution: the settings of a simulation with other sizes of elements."""

from viscotrain.config.models import Resolution


def with_sizes(dns: Resolution, factor: float) -> dict[str, float]:
    """Settings of a mesh whose elements have the sizes of the config times a factor."""
    return {
        "sphere_elements": round(dns.sphere_elements / factor),
        "axis_size": dns.axis_size * factor,
        "wall_size": dns.wall_size * factor,
    }
