"""Depths in image_transport's packing come out of OpenCV's decoder as they went in, to a step of it."""

from __future__ import annotations

from struct import unpack_from

import cv2
import numpy as np

from twin.bridge.msgs import Header, stamp
from twin.nodes.cameras.messages import compressed_depth, depth_image

HEADER = Header(stamp(5), "eye")


def test_metres_are_packed_by_their_inverse() -> None:
    z = np.linspace(0.16, 9.99, 64 * 48, dtype=np.float32).reshape(48, 64)
    z[0, :4] = np.nan, 10.0, 12.0, 0.1
    message = compressed_depth(HEADER, depth_image(HEADER, z, "32FC1"))
    assert (message.format, message.header) == ("32FC1; compressedDepth png", HEADER)
    kind, a, b = unpack_from("<iff", message.data)
    assert (kind, a, b) == (0, 100.0 * 101.0, np.float32(1.0) - np.float32(1010.0))
    levels = cv2.imdecode(message.data[12:], cv2.IMREAD_UNCHANGED)
    assert levels.dtype == np.uint16
    assert (levels[0, :4] == 0).all()
    assert (levels.ravel()[4:] > 0).all()
    decoded = a / (levels.astype(np.float32) - b)
    off = (decoded - z).ravel()[4:]
    step = (z**2 / a).ravel()[4:]
    assert (off > -1e-4).all()  # cut off, not rounded: what is decoded is never nearer
    assert (off <= 1.1 * step + 1e-4).all()


def test_millimetres_stay_what_they_are() -> None:
    z = np.array([[0.5, 1.2345, np.nan], [9.5, 10.5, 0.1]], np.float32)
    plain = depth_image(HEADER, z, "16UC1")
    message = compressed_depth(HEADER, plain)
    assert message.format == "16UC1; compressedDepth png"
    assert unpack_from("<i", message.data) == (0,)
    levels = cv2.imdecode(message.data[12:], cv2.IMREAD_UNCHANGED)
    assert levels.tolist() == [[500, 1234, 0], [9500, 0, 100]]
