"""Paints, coatings, plastics, rubber, road markings, sign sheeting and paper: pigment mixtures under their coats."""

from __future__ import annotations

from fullwell.assets.materials.curves import reflectance_spectrum
from fullwell.assets.materials.model import MaterialKind, SpectralMaterial
from fullwell.assets.materials.pigments import PIGMENT_SOURCE, mixture_reflectance

__all__ = ["coating_materials"]

Mixture = dict[str, float]

_PAINT: dict[str, Mixture] = {
    "white": {"rutile": 1.0, "carbon_black": 0.00006},
    "black": {"carbon_black": 1.0},
    "grey": {"rutile": 1.0, "carbon_black": 0.05, "phthalo_blue": 0.012},
    "silver": {"rutile": 1.0, "carbon_black": 0.0045},
    "red": {"dpp_red": 1.0, "organic_orange": 0.6, "iron_oxide_red": 0.03},
    "blue": {"phthalo_blue": 0.6, "rutile": 0.25, "ultramarine": 0.2, "carbon_black": 0.002},
    "brown": {"iron_oxide_red": 1.0, "carbon_black": 0.07, "iron_oxide_yellow": 0.6},
    "green": {"phthalo_green": 0.6, "bismuth_vanadate": 0.4, "carbon_black": 0.01},
    "yellow": {"bismuth_vanadate": 1.0, "rutile": 0.15, "iron_oxide_yellow": 0.04},
    "orange": {"organic_orange": 1.0, "bismuth_vanadate": 0.25},
    "beige": {"rutile": 1.0, "iron_oxide_yellow": 0.12, "carbon_black": 0.003, "iron_oxide_red": 0.008},
}

_COATING: dict[str, Mixture] = {
    "white": {"rutile": 1.0, "carbon_black": 0.0004, "iron_oxide_yellow": 0.001},
    "black": {"carbon_black": 0.3, "rutile": 0.5},
    "grey": {"rutile": 1.0, "carbon_black": 0.016, "iron_oxide_yellow": 0.005},
    "green": {"chromium_oxide": 1.0, "phthalo_green": 0.1},
    "red": {"dpp_red": 1.0, "iron_oxide_red": 0.12, "organic_orange": 0.6},
    "yellow": {"bismuth_vanadate": 1.0, "iron_oxide_yellow": 0.12, "rutile": 0.05},
    "blue": {"phthalo_blue": 0.5, "rutile": 0.35, "ultramarine": 0.2, "carbon_black": 0.002},
    "orange": {"organic_orange": 1.0, "iron_oxide_red": 0.02, "bismuth_vanadate": 0.3},
}

_PLASTIC: dict[str, Mixture] = {
    "black": {"carbon_black": 0.3, "rutile": 0.4},
    "grey": {"rutile": 1.0, "carbon_black": 0.03},
    "white": {"rutile": 1.0, "carbon_black": 0.0003},
    "red": {"dpp_red": 1.0, "organic_orange": 0.5, "rutile": 0.01},
    "green": {"phthalo_green": 0.35, "bismuth_vanadate": 0.5, "rutile": 0.05},
    "blue": {"phthalo_blue": 0.3, "ultramarine": 0.3, "rutile": 0.35},
    "yellow": {"bismuth_vanadate": 0.6, "organic_yellow": 0.3, "rutile": 0.2},
    "orange": {"organic_orange": 1.0, "bismuth_vanadate": 0.15},
}

_SIGN: dict[str, Mixture] = {
    "white": {"rutile": 0.5, "chalk": 0.2, "carbon_black": 0.0022},
    "yellow": {"bismuth_vanadate": 1.0, "iron_oxide_yellow": 0.08, "carbon_black": 0.003},
    "red": {"dpp_red": 1.0, "organic_orange": 0.4, "carbon_black": 0.001},
    "blue": {"phthalo_blue": 0.5, "ultramarine": 0.4, "rutile": 0.16},
    "green": {"phthalo_green": 0.5, "rutile": 0.12, "bismuth_vanadate": 0.1},
    "black": {"carbon_black": 0.3, "rutile": 0.5},
    "brown": {"iron_oxide_red": 0.6, "iron_oxide_yellow": 0.9, "carbon_black": 0.05},
}

_PAPER: dict[str, Mixture] = {
    "white": {"bleached_fibre": 1.0, "chalk": 0.5},
    "poster_blue": {"bleached_fibre": 1.0, "phthalo_blue": 0.5},
    "poster_red": {"bleached_fibre": 1.0, "dpp_red": 1.5},
    "poster_green": {"bleached_fibre": 1.0, "phthalo_blue": 0.3, "organic_yellow": 0.8},
    "poster_yellow": {"bleached_fibre": 1.0, "organic_yellow": 0.6},
}

_LINE: dict[str, Mixture] = {
    "white_thermoplastic": {"rutile": 0.5, "chalk": 1.0, "carbon_black": 0.004, "iron_oxide_yellow": 0.02},
    "yellow_thermoplastic": {"bismuth_vanadate": 0.6, "organic_yellow": 0.2, "chalk": 0.5, "carbon_black": 0.004},
}

_RUBBER: dict[str, Mixture] = {"tyre": {"carbon_black": 0.3, "chalk": 2.8, "iron_oxide_yellow": 0.05}}


def coating_materials() -> tuple[SpectralMaterial, ...]:
    """Return paint, coating, plastic, rubber, line, sign and paper."""
    return (
        *_family("paint", "car paint", _PAINT, kind="coated", roughness=0.03, tags=("car", "vehicle")),
        *_family(
            "coating", "painted steel, matte", _COATING, kind="coated", roughness=0.35, tags=("steel", "powder", "painted")
        ),
        *_family("plastic", "plastic", _PLASTIC, kind="coated", roughness=0.2, tags=()),
        *_family("rubber", "rubber", _RUBBER, kind="diffuse", roughness=0.0, tags=("tire",)),
        *_family("sign", "sign sheeting", _SIGN, kind="coated", roughness=0.12, tags=("retroreflective", "sheeting")),
        *_family("paper", "paper", _PAPER, kind="diffuse", roughness=0.0, tags=("print",)),
        *_family("line", "road marking", _LINE, kind="diffuse", roughness=0.0, tags=("marking", "road")),
    )


def _family(
    family: str, words: str, mixtures: dict[str, Mixture], *, kind: MaterialKind, roughness: float, tags: tuple[str, ...]
) -> tuple[SpectralMaterial, ...]:
    return tuple(
        SpectralMaterial(
            name=f"{family}/{name}",
            title=f"{words}, {name.replace('_', ' ')}",
            kind=kind,
            basis="model",
            source=PIGMENT_SOURCE,
            reflectance=reflectance_spectrum(mixture_reflectance(mixture), PIGMENT_SOURCE),
            roughness=roughness,
            tags=(family, *name.split("_"), *tags),
            retroreflective=family == "sign",
        )
        for name, mixture in mixtures.items()
    )
