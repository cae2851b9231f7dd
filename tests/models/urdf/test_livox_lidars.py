"""Lidars of Livox in robot files, in the words of its plugin, and the method by which any lidar measures."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.errors import ModelError
from twin.models import load
from twin.models.description import RobotDescription
from twin.sensors.lidar import LidarSpec
from twin.sensors.livox_lidar import LivoxLidarSpec
from twin.sensors.multi_layer_lidar import MultiLayerLidarSpec

CSV = "<csv_file_name>package://livox_laser_simulation/scan_mode/mid360.csv</csv_file_name>"
SHOTS = "<samples>24000</samples><downsample>2</downsample>"
LAYERS = "<vertical><samples>16</samples><min_angle>-0.26</min_angle><max_angle>0.26</max_angle></vertical>"


def robot(tmp_path: Path, sensor: str) -> RobotDescription:
    path = tmp_path / "robot.urdf"
    path.write_text(
        f"<robot name='r'><link name='lidar'/><gazebo reference='lidar'>\n{sensor}\n</gazebo></robot>"
    )
    return load(path)


def livox(tmp_path: Path, words: str, more: str = "") -> RobotDescription:
    ray = f"<ray><range><min>0.1</min><max>70</max></range>{more}</ray>"
    topic = "<ros_topic>/livox/lidar</ros_topic>"
    plugin = f"<plugin filename='liblivox_laser_simulation.so'>{ray}{words}{topic}</plugin>"
    return robot(tmp_path, f"<sensor name='livox' type='ray'><update_rate>10</update_rate>{plugin}</sensor>")


def scanner(tmp_path: Path, method: str, layers: str = "") -> RobotDescription:
    scan = (
        "<horizontal><samples>360</samples><min_angle>-3.1</min_angle><max_angle>3.1</max_angle></horizontal>"
    )
    ray = f"<scan>{scan}{layers}</scan><range><min>0.3</min><max>30</max></range><method>{method}</method>"
    return robot(tmp_path, f"<sensor name='lidar' type='gpu_lidar'><lidar>{ray}</lidar></sensor>")


def test_livox_s_plugin_names_its_pattern_by_a_file_that_need_not_be_there(tmp_path: Path) -> None:
    noise = "<noise><type>gaussian</type><stddev>0.01</stddev></noise>"
    (spec,) = livox(tmp_path, SHOTS + CSV, noise).sensors
    assert isinstance(spec, LivoxLidarSpec)
    assert (spec.pattern, spec.samples, spec.downsample, spec.rays) == ("mid360", 24000, 2, 12000)
    assert (spec.topic, spec.link, spec.driver, spec.rate_hz) == ("livox/lidar", "lidar", "livox", 10.0)
    assert (spec.range_min, spec.range_max, spec.noise_stddev) == (0.1, 70.0, 0.01)
    assert (spec.groups, spec.period) == (10, 10_000_000)


def test_a_file_that_is_there_goes_before_what_is_built_in(tmp_path: Path) -> None:
    file = tmp_path / "mid40.csv"
    file.write_text("t,azimuth,zenith\n0,0,90\n")
    (spec,) = livox(tmp_path, "<csv_file_name>mid40.csv</csv_file_name>").sensors
    assert isinstance(spec, LivoxLidarSpec)
    assert (Path(spec.pattern), spec.samples) == (file, 24000)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("", r"has no <csv_file_name>; valid is a file, or one of mid40.csv, mid70.csv, mid360.csv"),
        ("<csv_file_name>avia.csv</csv_file_name>", r"'avia.csv' does not exist; built in are mid40.csv"),
        ("<csv_file_name>/etc/passwd</csv_file_name>", r"'/etc/passwd' is outside of the file's folder"),
        ("<csv_file_name>bad.csv</csv_file_name>", r"'bad.csv' has 'a,b,c' in line 2; valid are three"),
        (CSV + "<samples>1e9</samples>", r"has 1e\+09 samples; valid is a whole number from 1 to 300000"),
        (CSV + "<samples>-4</samples>", r"has -4 samples; valid is a whole number"),
        (CSV + "<samples>0</samples>", r"has 0 samples; valid is a whole number"),
        (CSV + "<samples>100</samples><downsample>200</downsample>", r"has downsample 200; valid is a whole"),
        (CSV + "<downsample>0.5</downsample>", r"has downsample 0.5; valid is a whole number"),
    ],
)
def test_patterns_that_are_none_are_told_with_their_line(words: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("t,azimuth,zenith\na,b,c\n")
    with pytest.raises(ModelError, match=said) as caught:
        livox(tmp_path, words)
    assert caught.value.problems[0].line == 2


def test_scans_are_of_one_time_and_clouds_are_not_unless_the_file_says_so(tmp_path: Path) -> None:
    for method, expected in (
        ("instant", ("instant", "instant")),
        ("rolling", ("rolling", "rolling")),
        ("depth_images", ("instant", "depth_images")),
    ):
        scan, cloud = scanner(tmp_path, method, LAYERS).sensors
        assert isinstance(scan, LidarSpec)
        assert isinstance(cloud, MultiLayerLidarSpec)
        assert (scan.method, cloud.method) == expected
        assert (scan.groups, cloud.groups) == tuple(10 if each == "rolling" else 1 for each in expected)


def test_depth_images_have_pixels_no_wider_than_a_step_and_hold_all_layers(tmp_path: Path) -> None:
    _, cloud = scanner(tmp_path, "depth_images", LAYERS).sensors
    assert isinstance(cloud, MultiLayerLidarSpec)
    width, height = cloud.image_size
    assert 2.0 / width <= cloud.step == pytest.approx(6.2 / 359)
    assert height / width >= 2.0**0.5 * 0.266
    assert width < 120


@pytest.mark.parametrize(
    ("method", "layers", "said"),
    [
        ("lidar", "", r"has <method>lidar</method>; valid is instant or rolling"),
        ("depth_images", "", r"has <method>depth_images</method>; valid is instant or rolling"),
        ("", LAYERS, r"has <method></method>; valid is instant, rolling or depth_images"),
        (
            "depth_images",
            LAYERS.replace("0.26<", "1.57<"),
            r"needs depth images of 116 x \d+ pixels; valid are",
        ),
        (
            "depth_images",
            LAYERS.replace("0.26<", "3.0<"),
            r"needs depth images of 116 x \d+ pixels; valid are",
        ),
        ("depth_images", LAYERS.replace("0.26<", "0.0001<"), r"needs depth images of \d+ x \d+ pixels"),
    ],
)
def test_methods_that_are_none_are_told(method: str, layers: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=said) as caught:
        scanner(tmp_path, method, layers)
    assert caught.value.problems[0].line == 2
