"""Paints, coatings, plastics, rubber, road markings, sign sheeting and paper: pigment mixtures under their coats."""

from __future__ import annotations

from fullwell.assets.materials.curves import reflectance_spectrum
from fullwell.assets.materials.model import MaterialKind, SpectralMaterial
from fullwell.assets.materials.pigments import PIGMENT_SOURCE, mixture_reflectance

__all__ = ["coating_materials"]

Mixture = dict[str, float]

_PAINT: dict[str, Mixture] = {
    "white": {"rutile": 1.0, "carbon_black": 0.0001, "iron_oxide_yellow": 0.004},
    "black": {"carbon_black": 1.0},
    "grey": {"rutile": 1.0, "carbon_black": 0.065, "phthalo_blue": 0.02},
    "silver": {"rutile": 1.0, "carbon_black": 0.009},
    "red": {"dpp_red": 1.0, "rutile": 0.012, "iron_oxide_red": 0.08},
    "blue": {"phthalo_blue": 1.0, "rutile": 0.22, "ultramarine": 0.6, "carbon_black": 0.005},
    "brown": {"iron_oxide_red": 1.0, "carbon_black": 0.09, "iron_oxide_yellow": 0.5},
    "green": {"phthalo_green": 0.6, "bismuth_vanadate": 0.35, "carbon_black": 0.02},
    "yellow": {"bismuth_vanadate": 1.0, "rutile": 0.15, "iron_oxide_yellow": 0.03},
    "orange": {"organic_orange": 1.0, "bismuth_vanadate": 0.05},
    "beige": {"rutile": 1.0, "iron_oxide_yellow": 0.16, "carbon_black": 0.004, "iron_oxide_red": 0.01},
}

_COATING: dict[str, Mixture] = {
    "white": {"rutile": 1.0, "carbon_black": 0.0003, "iron_oxide_yellow": 0.005},
    "black": {"carbon_black": 1.0, "rutile": 0.02},
    "grey": {"rutile": 1.0, "carbon_black": 0.022, "iron_oxide_yellow": 0.01},
    "green": {"chromium_oxide": 1.0, "phthalo_green": 0.12, "carbon_black": 0.01},
    "red": {"dpp_red": 1.0, "iron_oxide_red": 0.25, "rutile": 0.01},
    "yellow": {"bismuth_vanadate": 1.0, "iron_oxide_yellow": 0.08, "rutile": 0.1},
    "blue": {"phthalo_blue": 0.5, "rutile": 0.2, "ultramarine": 0.8, "carbon_black": 0.004},
    "orange": {"organic_orange": 1.0, "iron_oxide_red": 0.03, "bismuth_vanadate": 0.1},
}

_PLASTIC: dict[str, Mixture] = {
    "black": {"carbon_black": 1.0, "rutile": 0.03},
    "grey": {"rutile": 1.0, "carbon_black": 0.03},
    "white": {"rutile": 1.0, "carbon_black": 0.0002},
    "red": {"dpp_red": 1.0, "rutile": 0.02},
    "green": {"phthalo_green": 0.4, "bismuth_vanadate": 0.3, "rutile": 0.05},
    "blue": {"phthalo_blue": 0.4, "ultramarine": 0.6, "rutile": 0.25},
    "yellow": {"bismuth_vanadate": 0.6, "organic_yellow": 0.5, "rutile": 0.2},
    "orange": {"organic_orange": 1.0, "rutile": 0.01},
}

_SIGN: dict[str, Mixture] = {
    "white": {"rutile": 0.35, "chalk": 0.2, "carbon_black": 0.003},
    "yellow": {"bismuth_vanadate": 0.6, "organic_yellow": 0.6, "rutile": 0.08, "carbon_black": 0.003},
    "red": {"dpp_red": 1.0, "iron_oxide_red": 0.1, "carbon_black": 0.004},
    "blue": {"phthalo_blue": 0.5, "ultramarine": 1.0, "rutile": 0.12},
    "green": {"phthalo_green": 0.6, "rutile": 0.1, "organic_yellow": 0.15},
    "black": {"carbon_black": 1.0, "rutile": 0.03},
    "brown": {"iron_oxide_red": 0.6, "iron_oxide_yellow": 0.5, "carbon_black": 0.07},
}

_PAPER: dict[str, Mixture] = {
    "white": {"bleached_fibre": 1.0, "chalk": 0.5},
    "poster_blue": {"bleached_fibre": 1.0, "phthalo_blue": 0.25},
    "poster_red": {"bleached_fibre": 1.0, "dpp_red": 0.5},
    "poster_green": {"bleached_fibre": 1.0, "phthalo_blue": 0.10, "organic_yellow": 0.3},
    "poster_yellow": {"bleached_fibre": 1.0, "organic_yellow": 0.25},
}

_LINE: dict[str, Mixture] = {
    "white_thermoplastic": {"rutile": 0.5, "chalk": 1.0, "carbon_black": 0.004, "iron_oxide_yellow": 0.02},
    "yellow_thermoplastic": {"bismuth_vanadate": 0.6, "organic_yellow": 0.2, "chalk": 0.5, "carbon_black": 0.004},
}

_RUBBER: dict[str, Mixture] = {"tyre": {"carbon_black": 1.0, "chalk": 1.2, "iron_oxide_yellow": 0.05}}


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
