"""Where lidars look that never look twice at the same place."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from twin.geometry import Array
from twin.sensors.clouds.patterns import PATTERNS, read_table

RATE_HZ = 100_000.0


def angles(directions: Array) -> tuple[Array, Array]:
    """Return azimuth and elevation [deg]."""
    x, y, z = directions.T
    return np.degrees(np.arctan2(y, x)), np.degrees(np.arcsin(z))


def covered(name: str, seconds: float) -> int:
    """Return how many squares of half a degree are hit."""
    azimuth, elevation = angles(PATTERNS[name].directions(np.arange(seconds * RATE_HZ), RATE_HZ))
    return len(np.unique(1000.0 * np.floor(2.0 * azimuth) + np.floor(2.0 * elevation)))


@pytest.mark.parametrize("name", PATTERNS)
def test_the_longer_it_looks_the_more_it_covers(name: str) -> None:
    tenth, half, whole = (covered(name, seconds) for seconds in (0.1, 0.5, 1.0))
    assert 1.5 * tenth < half
    assert half < whole


def test_a_mid40_covers_a_part_of_its_field_of_view_with_a_cloud_and_nearly_all_in_a_second() -> None:
    whole = np.pi * 38.4**2
    assert 0.15 < covered("mid40", 0.1) / whole < 0.45
    assert covered("mid40", 1.0) / whole > 0.85


@pytest.mark.parametrize(("name", "half_deg"), [("mid40", 19.2), ("mid70", 35.2)])
def test_a_rosette_fills_the_cone_of_the_data_sheet_and_often_passes_its_middle(
    name: str, half_deg: float
) -> None:
    directions = PATTERNS[name].directions(np.arange(RATE_HZ), RATE_HZ)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    away = np.degrees(np.arccos(directions[:, 0].clip(-1.0, 1.0)))
    assert away.max() == pytest.approx(half_deg, abs=0.01)
    rings = np.histogram(away, bins=4, range=(0.0, half_deg))[0] / np.array([1, 3, 5, 7])
    assert rings[0] > 2.0 * rings[2]


def test_a_mid360_looks_all_around_and_up() -> None:
    directions = PATTERNS["mid360"].directions(np.arange(200_000.0), 200_000.0)
    azimuth, elevation = angles(directions)
    assert (np.histogram(azimuth, bins=36, range=(-180.0, 180.0))[0] > 5000).all()
    assert (elevation.min(), elevation.max()) == pytest.approx((-7.0, 52.0), abs=0.1)


@pytest.mark.parametrize("name", PATTERNS)
def test_directions_depend_on_the_time_alone_and_are_as_exact_after_a_day(name: str) -> None:
    pattern, day = PATTERNS[name], 24 * 3600 * RATE_HZ
    shots = np.arange(1000.0)
    whole = pattern.directions(shots, RATE_HZ)
    np.testing.assert_array_equal(pattern.directions(shots[300:400], RATE_HZ), whole[300:400])
    assert np.abs(pattern.directions(shots + 10_000, RATE_HZ) - whole).max() > 0.1
    late = pattern.directions(day + np.arange(0.0, 400.0, pattern.lines), RATE_HZ)
    early = pattern.directions(np.arange(0.0, 400.0, pattern.lines), RATE_HZ)
    steps = [np.linalg.norm(np.diff(each, n=2, axis=0), axis=1).max() for each in (late, early)]
    assert steps[0] < 3.0 * steps[1]


def test_a_file_s_rows_come_in_turns_over_and_over_again(tmp_path: Path) -> None:
    file = tmp_path / "own.csv"
    file.write_text("Time/s,Azimuth/deg,Zenith/deg\n0,0,90\n1,90,90\r\n2,180,45\n\n")
    table = read_table(file)
    azimuth, elevation = angles(table.directions(np.arange(5.0), 1.0))
    np.testing.assert_allclose(azimuth, [0.0, 90.0, 180.0, 0.0, 90.0], atol=1e-9)
    np.testing.assert_allclose(elevation, [0.0, 0.0, 45.0, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "has no rows below its title"),
        ("time,azimuth,zenith\n", "has no rows below its title"),
        ("t,a,z\n0,1,2\n0,one,2\n", "has '0,one,2' in line 3; valid are three numbers"),
        ("t,a,z\n0,1\n0,2\n", "has '0,1' in line 2"),
        ("t,a,z\n0,1,2\n\n0,1,2\n", "has '' in line 3"),
        ("t,a,z\n0,1,2\n0,nan,2\n", "has '0,nan,2' in line 3"),
        ("t,a,z\n0,1,2\n0,1e300,2\n", "has '0,1e300,2' in line 3"),
        ("t,a,z\n0,1,2,3\n", "has '0,1,2,3' in line 2"),
        ("t,a,z\n" + "9" * 5000 + "\n", "has '9999999999"),
        ("t,a,z\n0,1,\u00b2\n", "cannot be read as text"),
    ],
)
def test_a_file_that_is_no_pattern_is_told(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "own.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=re.escape(said)) as caught:
        read_table(file)
    assert len(str(caught.value)) < 120
