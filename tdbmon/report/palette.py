"""Reduction of images in figures to 256 colours, which suffice for a plot."""

from __future__ import annotations

import base64
import io
import re

_EMBEDDED = re.compile(rb'(href="data:image/png;base64,)\s*([^"]+)"')


def with_palettes(svg: bytes) -> bytes:
    """Return an SVG whose PNG images have a palette of 256 colours, if that is smaller."""

    def smaller(found: re.Match[bytes]) -> bytes:
        return found.group(1) + base64.b64encode(with_palette(base64.b64decode(found.group(2)))) + b'"'

    return _EMBEDDED.sub(smaller, svg)


def with_palette(png: bytes) -> bytes:
    """Return a PNG with a palette of 256 colours, or the PNG itself if that is no larger."""
    from PIL import Image

    out = io.BytesIO()
    Image.open(io.BytesIO(png)).quantize(256, method=Image.Quantize.FASTOCTREE).save(out, "PNG", optimize=True)
    return min(out.getvalue(), png, key=len)
