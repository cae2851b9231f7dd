"""The page's camera in a browser."""

from __future__ import annotations

import pytest

from tests.web.hall import hall, opened
from tests.web.test_cameras import Camera
from tests.web.test_page import CHROMIUM, eventually, violations

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no browser at {CHROMIUM}"),
]
RED = """() => {
    const image = document.querySelector('img.camera'), canvas = document.createElement('canvas');
    if (!image?.naturalWidth) return null;
    canvas.width = image.naturalWidth;
    canvas.height = image.naturalHeight;
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    return context.getImageData(10, 40, 1, 1).data[0];
}"""


@pytest.mark.parametrize("way", ["stream", "topic"])
def test_the_camera_moves_and_draws_only_while_it_is_seen(way: str) -> None:
    camera = Camera()
    with hall(more=lambda bus, robot: camera(bus)) as (address, _), opened(address) as page:
        if way == "topic":  # a server that has none, as one of ROS's own
            page.route("**/stream?*", lambda route: route.fulfill(status=404))
        page.wait_for_timeout(500)
        assert camera.drawn == 0
        page.click("#tab-camera")
        page.wait_for_selector(f"img.camera[data-by={way}]")
        eventually(lambda: page.evaluate(RED) is not None, "there is a picture")
        before = page.evaluate(RED)
        eventually(lambda: page.evaluate(RED) != before, "it moves")
        for _language in range(2):
            assert violations(page) == []
            page.click("#language")
        page.click("#tab-log")
        eventually(lambda: not camera.is_wanted, "nobody looks any more")
