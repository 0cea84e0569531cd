"""Preparation of matplotlib's SVG for a page that forbids inline styles and contains many figures."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

_SVG = "http://www.w3.org/2000/svg"
_XLINK = "http://www.w3.org/1999/xlink"
_DRAWN = {"svg", "g", "path", "use", "text", "tspan", "image", "rect", "clipPath", "defs"}


def inline_svg(data: bytes, name: str, description: str) -> str:
    """Return an SVG element for the body of an HTML page.

    Styles become presentation attributes (a strict content security policy forbids style attributes), identifiers are
    prefixed with the figure's name (they must be unique on the page), and elements that draw nothing are removed.

    Parameters
    ----------
    data : bytes
        The SVG file as matplotlib writes it.
    name : str
        Name of the figure; unique on the page.
    description : str
        Alternative text for readers who cannot see the figure.
    """
    root = ET.fromstring(data)  # our own drawing, not a file from outside
    ET.register_namespace("", _SVG)
    ET.register_namespace("xlink", _XLINK)
    _prune(root)
    for element in root.iter():
        for property_, value in _properties(element.attrib.pop("style", "")):
            element.set(property_, value)
        identifier = element.get("id")
        if identifier is not None:
            element.set("id", f"{name}-{identifier}")
        clip = element.get("clip-path")
        if clip is not None:
            element.set("clip-path", re.sub(r"url\(#(.+?)\)", rf"url(#{name}-\1)", clip))
        link = element.get(f"{{{_XLINK}}}href")
        if link is not None and link.startswith("#"):
            element.set(f"{{{_XLINK}}}href", f"#{name}-{link[1:]}")
    for size in ("width", "height", "version"):
        root.attrib.pop(size, None)
    # matplotlib's style sheet sets these for every element
    root.attrib.update({"stroke-linejoin": "round", "stroke-linecap": "butt", "role": "img", "aria-label": description})
    return ET.tostring(root, encoding="unicode", short_empty_elements=True)


def _prune(element: ET.Element) -> None:
    """Remove elements that draw nothing (metadata, style sheets), unreferenced group identifiers, and white space."""
    for child in list(element):
        tag = str(child.tag).removeprefix(f"{{{_SVG}}}")
        if tag not in _DRAWN:
            element.remove(child)
            continue
        _prune(child)
        child.tail = None
    if str(element.tag).removeprefix(f"{{{_SVG}}}") not in ("text", "tspan"):
        element.text = None
    if str(element.tag) == f"{{{_SVG}}}g":
        element.attrib.pop("id", None)
    path = element.get("d")
    if path is not None:
        element.set("d", " ".join(path.split()))


def _properties(style: str) -> list[tuple[str, str]]:
    pairs = [part.partition(":") for part in style.split(";") if ":" in part]
    return [(name.strip(), value.strip()) for name, _, value in pairs]
