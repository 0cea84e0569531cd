"""Messages about mistakes in a machine file: where, what, and the cure."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from tdbsim.errors import did_you_mean
from tdbsim.quantity import Tolerant

_TEMPLATE = "docs/machine_file.md explains every key, datasets/machines/template.toml is a file to fill in"
_NAMED = 8  # most mistakes named in one message


def explain(error: ValidationError, data: dict[str, Any], whole: type[BaseModel]) -> str:
    """Return the first finding of a validation as one line: place, mistake, cure.

    Parameters
    ----------
    error : ValidationError
    data : dict
        The validated data.
    whole : type
        The model that it violates.
    """
    findings = error.errors()
    finding = min(findings, key=lambda f: f["type"] != "extra_forbidden")  # a misspelt key explains the missing one
    place = _place(finding["loc"], data)
    more = _more([each for each in findings if each is not finding], data)
    if finding["type"] == "extra_forbidden":
        name = str(finding["loc"][-1])
        return f"{place}unknown key '{name}'{did_you_mean(name, _known_keys(finding['loc'][:-1], whole))}{more}"
    if finding["type"] == "missing":
        return _missing([each["loc"] for each in findings if each["type"] == "missing"], data, len(findings), whole)
    if finding["type"] == "tuple_type" and isinstance(finding["input"], dict):
        name = str(finding["loc"][-1])
        return f"{place}[{name}] may come more than once: write [[{name}]], in two brackets{more}"
    if finding["type"] == "model_type" and isinstance(finding["loc"][-1], str):
        name, model = str(finding["loc"][-1]), _model_at(finding["loc"], whole)
        keys = ", ".join(f"{field.alias or key} = ..." for key, field in model.model_fields.items())
        return f"{place}{name} is a table: write {name} = {{ {keys} }}, not {finding['input']!r}{more}"
    message = finding["msg"].removeprefix("Value error, ")
    where = f"{place}{finding['loc'][-1]}: " if finding["loc"] and isinstance(finding["loc"][-1], str) else place
    if finding["type"] != "value_error":
        message += f", not {finding['input']!r}"
    return f"{where}{message}{more}"


def _more(others: list[ErrorDetails], data: dict[str, Any]) -> str:
    """Return the other mistakes, briefly, so that a file can be corrected in one go."""
    what = {"extra_forbidden": "unknown", "missing": "missing"}
    words = []
    for other in others:
        loc, place = other["loc"], _place(other["loc"], data)
        key = "the whole" if not loc else f"'{loc[-1]}'" if isinstance(loc[-1], str) else ""
        words.append(f"{place if key else place.removesuffix(': ')}{key} is {what.get(other['type'], 'wrong')}")
    left = f"; and {len(words) - _NAMED} more" if len(words) > _NAMED else ""
    return f" (also {'; '.join(words[:_NAMED])}{left})" if words else ""


def _missing(places: list[tuple[int | str, ...]], data: dict[str, Any], findings: int, whole: type[BaseModel]) -> str:
    """Return all missing keys, table by table; of missing tables, the keys that they need."""
    tables: dict[str, list[str]] = {}
    for loc in places:
        tables.setdefault(_place(loc, data), []).append(_missing_key(loc, whole))
    lacking = [
        f"{table}{', '.join(keys)} {'is' if len(keys) == 1 else 'are'} missing" for table, keys in tables.items()
    ]
    more = f" (and {findings - len(places)} more to correct)" if findings > len(places) else ""
    cure = "" if len(places) == 1 else f"; {_TEMPLATE}"
    return f"{'; '.join(lacking)}{more}{cure}"


def _missing_key(loc: tuple[int | str, ...], whole: type[BaseModel]) -> str:
    model = _model_at(loc, whole)
    if model in (None, Tolerant):
        return f"'{loc[-1]}'"
    needs = [field.alias or name for name, field in model.model_fields.items() if field.is_required()]
    return f"'{loc[-1]}' (with {', '.join(needs)})"


def _place(loc: tuple[int | str, ...], data: Any) -> str:
    words: list[str] = []
    node = data
    for key in loc if loc and isinstance(loc[-1], int) else loc[:-1]:  # of several tables one may be wrong as a whole
        try:
            node = node[key]
        except (KeyError, IndexError, TypeError):
            break
        if isinstance(key, int):
            label = node.get("name") if isinstance(node, dict) else None
            words.append(f"'{label}'" if label else f"number {key + 1}")
        else:
            words.append(f"[{key}]")
    return " ".join(words) + ": " if words else ""


def _known_keys(loc: tuple[int | str, ...], whole: type[BaseModel]) -> list[str]:
    return [field.alias or name for name, field in _model_at(loc, whole).model_fields.items()]


def _model_at(loc: tuple[int | str, ...], whole: type[BaseModel]) -> Any:
    model: Any = whole
    for key in loc:
        if not isinstance(key, int):
            model = _model_in(_field(model, key).annotation)
    return model


def _field(model: Any, key: str) -> Any:
    return next(field for name, field in model.model_fields.items() if key in (name, field.alias))


def _model_in(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        found = _model_in(argument)
        if found is not None:
            return found
    return None
