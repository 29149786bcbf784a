"""Turns pydantic's findings into Clearway's one-sentence errors."""

from __future__ import annotations

from typing import Any, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from clearway.errors import ClearwayError, nearest, shown, unknown


class Table(BaseModel):
    """A table of a file that a user writes: frozen, without keys that nobody knows."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def first_problem(error: ValidationError, model: type[BaseModel], *, file: object = None) -> ClearwayError:
    """The first finding of `error` as a `ClearwayError` that names file, field, value and what would be right."""
    return problems(error, model, file=file)[0]


def problems(error: ValidationError, model: type[BaseModel], *, file: object = None) -> list[ClearwayError]:
    """Every finding of `error`, each as a `ClearwayError`; unknown keys first, as a misspelt one causes a missing one."""
    findings = sorted(error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")
    return [_translate(e, model, file) for e in findings if not (_follows(e) or _is_no_name(e, findings))]


_KINDS = ("function-", "tuple[", "list[", "literal[", "constrained-")
"""How the steps of a path begin that name no field, but what a value might have been."""


def _is_no_name(finding: Any, findings: list[Any]) -> bool:
    """Whether it only says that a value is no text, where something else is wrong with what it is."""
    *where, last = finding["loc"] or ("",)
    others = (e["loc"] for e in findings if e is not finding)
    return (
        last == "str" and finding["type"] == "string_type" and any(list(loc[: len(where)]) == where for loc in others)
    )


def _follows(finding: Any) -> bool:
    """Whether a list is only short because items of it were wrong, which are found on their own."""
    return bool(finding["type"] == "too_short" and finding["ctx"]["actual_length"] < len(finding["input"]))


def _translate(finding: Any, model: type[BaseModel], file: object) -> ClearwayError:
    where = [p for p in finding["loc"] if not (isinstance(p, str) and p.startswith(_KINDS))]
    field = ".".join(str(p) for p in _keys_of(model, where))
    value = finding["input"]
    match finding["type"]:
        case "extra_forbidden":
            models = _models_at(model, where[:-1])
            key = str(where[-1])
            renamed = {old: new for m in models for old, new in getattr(m, "RENAMED", {}).items()}
            if key in renamed:
                return ClearwayError(f"unknown key; it is called {renamed[key]!r} now", file=file, field=field)
            known = sorted({name for m in models for name in _keys(m)})
            close = nearest(key, known, 0.55)
            hint = f"did you mean {close!r}?" if close else f"known: {', '.join(known)}"
            return ClearwayError(f"unknown key; {hint}", file=file, field=field)
        case "missing":
            return ClearwayError("is missing", file=file, field=field)
        case "value_error":
            return ClearwayError(finding["msg"].removeprefix("Value error, "), file=file, field=field)
        case "union_tag_invalid" | "union_tag_not_found":
            name = str(finding["ctx"]["discriminator"]).strip("'")
            tags = [tag for m in _models_at(model, where) for tag in get_args(_keys(m).get(name))]
            field = f"{field}.{name}".lstrip(".")
            if finding["type"] == "union_tag_invalid":
                return unknown(name, str(finding["ctx"]["tag"]), tags, file=file, field=field)
            return ClearwayError(f"is missing; one of {', '.join(tags)}", file=file, field=field)
        case _:
            message = finding["msg"][0].lower() + finding["msg"][1:]
            message = message.replace("tuple", "list").replace(" after validation", "")  # as a file has it
            return ClearwayError(f"{shown(value)} is wrong: {message}", file=file, field=field)


def _keys_of(model: type[BaseModel], where: list[Any]) -> list[Any]:
    """The path `where` without the tags of unions, which name no field."""
    named: list[Any] = []
    for k, step in enumerate(where):
        models = _models_at(model, where[:k])
        tag = any(step in get_args(_keys(m).get("kind")) for m in models) and not any(step in _keys(m) for m in models)
        named += [] if tag else [step]
    return named


def _models_at(model: type[BaseModel], where: list[Any]) -> list[type[BaseModel]]:
    """The (sub)models that the path `where` may lead to."""
    candidates: list[type[BaseModel]] = [model]
    for step in where:
        if isinstance(step, int):
            continue
        found = [m for c in candidates if step in _keys(c) for m in _models_in(_keys(c)[step])]
        tagged = [c for c in candidates if step in get_args(_keys(c).get("kind"))]
        candidates = found or tagged or candidates  # a union's tag is a step that names no field
    return candidates


def _keys(model: type[BaseModel]) -> dict[str, Any]:
    """Annotations of a model's fields by the keys that a file has for them."""
    return {field.alias or name: field.annotation for name, field in model.model_fields.items()}


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for part in get_args(annotation) for m in _models_in(part)]
