"""SDFormat's `<lens>` of a wide-angle camera as data."""

from __future__ import annotations

import math

import numpy as np

from twin.models.urdf.document import Element, Report, text_of
from twin.models.urdf.gazebo import flag_in, number_in
from twin.models.urdf.sensors import add_fault
from twin.models.wide_lens import HIGHEST, LENSES, Mapping, WideLens

_TYPES = (*LENSES, "custom")
_USUAL = "stereographic"
"""SDFormat's, and below its other values for what a lens does not say."""
_CUTOFF, _TEXTURE, _TEXTURES = 1.5707, 256.0, (4, 2048)

_ROUNDED = 1e-3
"""Files round pi [rad]."""


def fov_fault(camera: Element, fov: float) -> str:
    """Return why a wide-angle camera cannot see so much [rad]; empty if it can."""
    widest = _widest(camera)
    if 0.0 < fov <= widest + _ROUNDED:
        return ""
    return (
        f"horizontal_fov {fov:g} rad; a wide-angle camera of this lens has more than 0, at most {widest:.4g}"
    )


def read_wide_lens(
    sensor: Element, camera: Element, size: tuple[int, int], fov: float, report: Report
) -> WideLens:
    """Return the lens of a camera; what is wrong with it goes to the report.

    Args:
        sensor: That it is of.
        camera: Its `<camera>`, without a fault of `fov_fault`.
        size: Width and height of its image [pixels].
        fov: Horizontal, the full angle [rad].
        report: Where problems go.
    """
    mapping = _mapping(camera)
    if mapping is None or not mapping.grows:
        add_fault(report, sensor, f" has a <lens> {_wrong(camera)}")
        mapping = LENSES[_USUAL]
    cutoff = _at(camera, "cutoff_angle", _CUTOFF)
    if not 0.0 < cutoff <= math.pi + _ROUNDED:
        add_fault(
            report, sensor, f" has a <cutoff_angle> of {cutoff:g} rad; valid is more than 0, at most pi"
        )
    texture = _at(camera, "env_texture_size", _TEXTURE)
    if texture != int(texture) or not _TEXTURES[0] <= texture <= _TEXTURES[1]:
        valid = f"whole numbers from {_TEXTURES[0]} to {_TEXTURES[1]}"
        add_fault(report, sensor, f" has an <env_texture_size> of {texture:g}; valid are {valid}")
        texture = _TEXTURE
    radius = float(mapping.radius(np.array(min(fov, _widest(camera)) / 2.0))) if _scales(camera) else 1.0
    scale = (size[0] / 2.0 / radius,) * 2
    centre = (size[0] - 1) / 2.0, (size[1] - 1) / 2.0
    if camera.find("lens/intrinsics") is not None:
        fx, fy, skew = (_at(camera, f"intrinsics/{name}", 0.0) for name in ("fx", "fy", "s"))
        if skew or min(fx, fy) <= 0.0:
            add_fault(report, sensor, " has <intrinsics> with fx and fy not both positive, or s not 0")
        else:
            scale = fx, fy
        centre = _at(camera, "intrinsics/cx", centre[0]), _at(camera, "intrinsics/cy", centre[1])
    return WideLens(
        width=size[0],
        height=size[1],
        mapping=mapping,
        scale=scale,
        centre=centre,
        cutoff_angle=min(cutoff, math.pi),
        texture_size=int(texture),
    )


def _widest(camera: Element) -> float:
    """Return the widest field of view of a lens [rad]; of a faulty one that is told elsewhere, all around."""
    mapping = _mapping(camera)
    if mapping is None or not mapping.grows or not _scales(camera):
        return 2.0 * math.pi
    return min(2.0 * math.pi, 2.0 * mapping.widest)


def _mapping(camera: Element) -> Mapping | None:
    """Return how a lens maps angles; None: it is of no type, or its function of none."""
    kind = _kind(camera)
    if kind != "custom":
        return LENSES.get(kind)
    fun = text_of(camera, "lens/custom_function/fun") or "tan"
    if fun not in HIGHEST:
        return None
    c1, c2, c3, f = (
        _at(camera, f"custom_function/{name}", default)
        for name, default in (("c1", 1.0), ("c2", 1.0), ("c3", 0.0), ("f", 1.0))
    )
    return Mapping(c1 * f, c2, c3, fun)


def _wrong(camera: Element) -> str:
    if _kind(camera) not in _TYPES:
        return f"of type '{_kind(camera)}'; valid are {', '.join(_TYPES)}"
    fun = text_of(camera, "lens/custom_function/fun") or "tan"
    if fun not in HIGHEST:
        return f"whose <fun> is '{fun}'; valid are {', '.join(HIGHEST)}"
    return "whose function does not grow; c1, c2 and f are positive, c3 is not negative and below pi / 2"


def _kind(camera: Element) -> str:
    return text_of(camera, "lens/type") or _USUAL


def _scales(camera: Element) -> bool:
    """Whether the image is as wide as the field of view."""
    stretched = flag_in(camera.find("lens/scale_to_hfov")) is not False
    return stretched and camera.find("lens/intrinsics") is None


def _at(camera: Element, path: str, default: float) -> float:
    value = number_in(camera.find(f"lens/{path}"))
    return default if value is None else value
