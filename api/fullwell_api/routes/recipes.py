"""Recipes: check one without running it."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel

from fullwell.core import FieldError
from fullwell.jobs.files import check_files
from fullwell.schema import RecipeError
from fullwell_api.checks import checked_document
from fullwell_api.models import Submission
from fullwell_api.problems import FieldProblem
from fullwell_api.services import ServiceParts

__all__ = ["router"]

router = APIRouter(tags=["recipes"])


class Verdict(BaseModel):
    """Whether a recipe can be submitted; every problem with its field."""

    valid: bool
    name: str | None = None
    frames: int | None = None
    outputs: list[str] = []
    errors: list[FieldProblem] = []


@router.post("/recipes/validate", summary="Check a recipe")
def validate(submission: Submission, parts: ServiceParts) -> Verdict:
    """Check a submission as `POST /jobs` would, without storing it. An illegal recipe is an answer here, not an error."""
    try:
        files = check_files(submission.files)
        document = checked_document(submission.recipe, submission.overrides, files, library=parts.library)
    except RecipeError as error:
        problems = [FieldProblem(path=item.path, message=item.message, value=_text(item.value)) for item in error.errors]
        return Verdict(valid=False, errors=problems)
    except FieldError as error:
        return Verdict(valid=False, errors=[FieldProblem(path=error.path, message=error.message, value=_text(error.value))])
    return Verdict(valid=True, name=document.name, frames=document.frame_count(), outputs=list(document.outputs))


def _text(value: object) -> str | None:
    return None if value is None else str(value).encode("utf-8", "replace").decode()[:200]
