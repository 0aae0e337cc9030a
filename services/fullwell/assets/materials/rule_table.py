"""The rules by which parts of model files get materials, as data: read from top to bottom, the first that fits decides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["BODY_WORDS", "MATERIAL_RULES", "MaterialRule"]


@dataclass(frozen=True, slots=True)
class MaterialRule:
    """One rule.

    Attributes
    ----------
    reason
        The sentence for people.
    materials
        What it may be; the nearest in colour is taken.
    words
        Any of these in the part's name; an entry of two words needs both. Empty: the rule is about the class alone.
    classes
        Classes or groups of classes (see `assets.classes`) that it holds for; empty: all.
    without
        Words that forbid it.
    over_texture
        Whether it decides even where the file has a texture there.
    metallic, lit
        Whether the surface must be metallic, or emit, in the file.
    largest_distance
        In colour (`rules.colour_distance`), beyond which it does not decide.
    """

    reason: str
    materials: tuple[str, ...]
    words: tuple[str, ...] = ()
    classes: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    over_texture: bool = False
    metallic: bool = False
    lit: bool = False
    largest_distance: float | None = None


def _words(listed: str) -> tuple[str, ...]:
    return tuple(entry.strip() for entry in listed.split(","))


def _all(family: str, *members: str) -> tuple[str, ...]:
    return tuple(f"{family}/{member}" for member in members)


_COLOUR_WORDS: Final = (
    "white", "black", "grey", "gray", "silver", "red", "blue", "brown", "green", "yellow", "orange", "beige", "gold", "purple",
    "pink", "color", "colour",
)  # fmt: skip
BODY_WORDS: Final = (
    "body", "paint", "carpaint", "bodywork", "chassis", "hood", "bonnet", "door", "fender", "mudguard", "carmaterial", "shell",
    "livery", "tank", "fairing", "coachwork", "tailgate", "wing", "cab", "trunk lid",
)  # fmt: skip

_PAINTS: Final = _all("paint", "white", "black", "grey", "silver", "red", "blue", "brown", "green", "yellow", "orange", "beige")
_COATINGS: Final = _all("coating", "white", "black", "grey", "green", "red", "yellow", "blue", "orange")
_PLASTICS: Final = _all("plastic", "black", "grey", "white", "red", "green", "blue", "yellow", "orange")
_SIGNS: Final = _all("sign", "white", "yellow", "red", "blue", "green", "black", "brown")
_CLOTHS: Final = _all(
    "cloth", "white", "black", "grey", "navy", "denim", "red", "green", "yellow", "beige", "brown", "hi_vis_yellow",
    "hi_vis_orange",
)  # fmt: skip
_SKINS: Final = _all("skin", "light", "medium", "dark", "deep")
_HAIRS: Final = _all("hair", "black", "brown", "blond", "grey")
_FURS: Final = _all("fur", "deer", "dog_brown", "dog_black", "white")
_LEAVES: Final = _all("foliage", "broadleaf", "birch", "hedge", "autumn", "dry")
_BARKS: Final = _all("bark", "oak", "birch", "pine")
_PLASTERS: Final = _all("plaster", "white", "cream", "ochre", "grey", "rose")
_BRICKS: Final = _all("brick", "red", "yellow", "dark")
_STONES: Final = _all("stone", "sandstone", "granite", "limestone")
_CONCRETES: Final = _all("concrete", "light", "grey")
_ROOFS: Final = _all("roof", "tile_red", "tile_dark", "slate", "metal")
_WOODS: Final = _all("wood", "oak", "pine", "painted_white", "weathered")
_WALLS: Final = (*_PLASTERS, *_BRICKS, *_CONCRETES, *_STONES)
_BARE_METALS: Final = _all("metal", "chrome", "aluminium", "steel", "steel_galvanised", "copper", "brass")
_SIGNALS: Final = _all("lamp", "traffic_red", "traffic_amber", "traffic_green")
_CAR_LAMPS: Final = _all("lamp", "headlight_led", "tail", "indicator")

_DRAWN: Final = 18.0
"""Farthest colour at which a rule about the class alone still decides: beyond it the thing is of another kind."""

MATERIAL_RULES: Final[tuple[MaterialRule, ...]] = (
    # Lamps, the more special first.
    MaterialRule(
        "Traffic lights shine red.", ("lamp/traffic_red",), words=_words("red"), classes=("traffic_light",), over_texture=True
    ),
    MaterialRule(
        "Traffic lights shine amber.",
        ("lamp/traffic_amber",),
        words=_words("amber, yellow, orange"),
        classes=("traffic_light",),
        over_texture=True,
    ),
    MaterialRule(
        "Traffic lights shine green.",
        ("lamp/traffic_green",),
        words=_words("green"),
        classes=("traffic_light",),
        over_texture=True,
    ),
    MaterialRule(
        "Lenses and lamps of a traffic light are its signals.",
        _SIGNALS,
        words=_words("lens, light, lamp, signal, bulb"),
        classes=("traffic_light",),
        without=_words("pole, mast, housing, body, case"),
    ),
    MaterialRule(
        "Brake lights, named so.",
        ("lamp/brake",),
        words=_words("brakelight, brake light, stoplight, stop light, stoplamp"),
        classes=("vehicle",),
        over_texture=True,
    ),
    MaterialRule(
        "Indicators, named so.",
        ("lamp/indicator",),
        words=_words("indicator, blinker, turnsignal, turn signal, turn light, light orange, light amber, lamp amber"),
        classes=("vehicle",),
        over_texture=True,
    ),
    MaterialRule(
        "Reversing lights, named so.",
        ("lamp/reverse",),
        words=_words("reverse light, reversing, reverselight, backup light"),
        classes=("vehicle",),
        over_texture=True,
    ),
    MaterialRule(
        "Tail lights, named so.",
        ("lamp/tail",),
        words=_words("taillight, tail light, taillamp, tail lamp, backlight, back light, rear light, rearlight, light red"),
        classes=("vehicle",),
        over_texture=True,
    ),
    MaterialRule(
        "Daytime running lights, named so.",
        ("lamp/daytime_running",),
        words=_words("drl, daytime, position light, fog light"),
        classes=("vehicle",),
        over_texture=True,
    ),
    MaterialRule(
        "Headlights, named so.",
        ("lamp/headlight_led",),
        words=_words("headlight, headlamp, head light, front light, frontlight, front lamp, light white, lowbeam, highbeam"),
        classes=("vehicle",),
        over_texture=True,
    ),
    MaterialRule(
        "Lights of a vehicle; the colour tells which.",
        _CAR_LAMPS,
        words=_words("light, lamp"),
        classes=("vehicle",),
        without=_words("grey, gray, blue, bracket, frame, housing"),
    ),
    MaterialRule(
        "The lamp of a street light is taken as a LED luminaire.",
        ("lamp/street_led",),
        words=_words("lamp, lantern, bulb, luminaire, light, led, lens"),
        classes=("street_light",),
        without=_words("pole, mast, arm, base, post, housing, body, head"),
        over_texture=True,
    ),
    MaterialRule(
        "A lit panel.",
        ("lamp/sign_panel",),
        words=_words("panel, display, poster, screen"),
        classes=("billboard", "bus_stop"),
        lit=True,
    ),
    MaterialRule(
        "A lit window.",
        ("lamp/window_warm", "lamp/window_cool"),
        words=_words("window, glass, pane"),
        classes=("building",),
        over_texture=True,
        lit=True,
    ),
    # Vehicles.
    MaterialRule("Tyres are rubber.", ("rubber/tyre",), words=_words("tyre, tire"), without=_words("rim"), over_texture=True),
    MaterialRule(
        "Mirror glass.",
        ("mirror/silver",),
        words=_words("mirror glass, mirrorglass, mirror surface"),
        classes=("vehicle", "furniture"),
        over_texture=True,
    ),
    MaterialRule(
        "Panes of a vehicle look dark from outside.",
        ("glass/tinted",),
        words=_words("window, glass, windscreen, windshield, pane, sunroof, windscreens"),
        classes=("vehicle",),
        without=_words("frame, fibre, fiber, wiper, trim"),
        over_texture=True,
    ),
    MaterialRule(
        "Rims are aluminium alloy or painted plastic.",
        ("metal/rim_alloy", "plastic/black", "rubber/tyre"),
        words=_words("rim, hub, hubcap, spoke, felge, alloy"),
        classes=("vehicle", "cyclist"),
    ),
    MaterialRule(
        "A wheel: dark parts are the tyre, light ones the rim.",
        ("rubber/tyre", "metal/rim_alloy"),
        words=_words("wheel"),
        classes=("vehicle", "cyclist", "other"),
        without=_words("steering, wheelchair, arch, wheelhouse"),
        largest_distance=15.0,
    ),
    MaterialRule("Chrome, named so.", ("metal/chrome",), words=_words("chrome, exhaust, tailpipe, muffler"), over_texture=True),
    MaterialRule(
        "Number plates are retroreflective sheeting.",
        ("sign/white", "sign/yellow"),
        words=_words("plate, numberplate, licenseplate, licenceplate, license, licence"),
        classes=("vehicle",),
        without=_words("skid, base, floor, kick"),
    ),
    MaterialRule(
        "Trim below and around a vehicle is black plastic.",
        ("plastic/black", "plastic/grey"),
        words=_words(
            "bumper, trim, grille, grill, underside, underbody, undercarriage, wiper, dashboard, "
            "interior, cockpit, undertray, sill, cladding, seat, steering, arch, floor, handle, "
            "gasket"
        ),
        classes=("vehicle",),
    ),
    MaterialRule(
        "Forks, frames and engines of two-wheelers are painted or bare metal.",
        (*_COATINGS, "metal/aluminium", "metal/steel", "metal/chrome"),
        words=_words("fork, frame, engine, handlebar, crank, pedal, chain, kickstand"),
        classes=("motorcycle", "bicycle", "cyclist"),
    ),
    MaterialRule(
        "Saddles are leather.",
        ("leather/black", "leather/brown"),
        words=_words("saddle, seat"),
        classes=("bicycle", "cyclist", "motorcycle"),
    ),
    MaterialRule(
        "The body of a vehicle has the car paint of the nearest colour.", _PAINTS, words=BODY_WORDS, classes=("vehicle",)
    ),
    # People and animals. Hair before head, shoes before feet.
    MaterialRule("Hair, named so.", _HAIRS, words=_words("hair, beard, eyebrow, moustache"), classes=("person", "cyclist")),
    MaterialRule(
        "Shoes, belts and bags are leather.",
        ("leather/black", "leather/brown", "cloth/white"),
        words=_words("shoe, boot, belt, bag, handbag, glove, sneaker"),
        classes=("person", "cyclist"),
    ),
    MaterialRule("Helmets are plastic.", _PLASTICS, words=_words("helmet"), classes=("person", "cyclist", "motorcycle")),
    MaterialRule(
        "Skin, named so.",
        _SKINS,
        words=_words("skin, face, head, hand, arm, leg, neck, foot, feet, ear, nose"),
        classes=("person", "cyclist"),
        without=_words("sleeve, warmer, band, light"),
        largest_distance=45.0,
    ),
    MaterialRule(
        "Clothes, named so.",
        _CLOTHS,
        words=_words(
            "cloth, shirt, jacket, coat, trouser, pant, jean, skirt, dress, sock, hat, cap, scarf, "
            "sweater, hoodie, vest, sleeve, tie, suit, top, bottom, clothing, arm, leg, torso"
        ),
        classes=("person", "cyclist"),
    ),
    MaterialRule(
        "Fur, named so.", _FURS, words=_words("fur, body, coat, hide, torso, head, leg, tail, ear"), classes=("animal",)
    ),
    MaterialRule(
        "Antlers and hooves are like bone and horn.",
        ("wood/weathered", "leather/black"),
        words=_words("antler, horn, hoof, hooves, claw, nose"),
        classes=("animal",),
    ),
    # Plants.
    MaterialRule(
        "Birch leaves.", ("foliage/birch",), words=_words("birch leaf, birch leaves, birch foliage"), over_texture=True
    ),
    MaterialRule("Birch bark.", ("bark/birch",), words=_words("birch bark, birch trunk"), over_texture=True),
    MaterialRule(
        "Needles of conifers.",
        ("foliage/conifer",),
        words=_words("needle, conifer, spruce, fir, pine leaf, pine leaves"),
        classes=("vegetation",),
        without=_words("bark, trunk, stem"),
    ),
    MaterialRule("Bark, named so.", _BARKS, words=_words("bark, trunk, stem, branch, twig, log"), classes=("vegetation",)),
    MaterialRule("Hedges.", ("foliage/hedge",), words=_words("hedge"), classes=("vegetation",)),
    MaterialRule(
        "Leaves, named so.",
        _LEAVES,
        words=_words("leaf, leave, foliage, crown, canopy, bush, shrub, frond"),
        classes=("vegetation",),
        without=_words("bark, trunk"),
    ),
    MaterialRule(
        "Grass, named so.", _all("grass", "green", "dry"), words=_words("grass, lawn, blade, turf"), without=_words("cutter")
    ),
    MaterialRule("Leaves in planters and beds.", _LEAVES, words=_words("leaf, leave, foliage, hedge, bush, shrub, plant")),
    MaterialRule("Soil, named so.", ("soil/earth",), words=_words("soil, earth, dirt, mud, mulch")),
    MaterialRule("Rocks are stone.", _STONES, words=_words("rock, stone, boulder"), classes=("rock", "vegetation")),
    # Roads and buildings.
    MaterialRule(
        "Road markings are thermoplastic.",
        _all("line", "white_thermoplastic", "yellow_thermoplastic"),
        words=_words("marking, roadmarking, line, stripe, crosswalk, zebra"),
        classes=("road",),
    ),
    MaterialRule(
        "Roads are asphalt.",
        _all("asphalt", "worn", "new"),
        words=_words("asphalt, tarmac, road, street, lane, bitumen"),
        classes=("road", "other", "building"),
    ),
    MaterialRule(
        "Kerbs and pavements are concrete.",
        _CONCRETES,
        words=_words("kerb, curb, sidewalk, pavement, concrete, cement, footpath, walkway, foundation, plinth"),
    ),
    MaterialRule(
        "Windows of buildings look dark by day.",
        ("glass/window",),
        words=_words("window, glass, pane, glazing, skylight"),
        classes=("building", "furniture", "other"),
        without=_words("frame, sill, fibre, fiber, shutter, trim, wall"),
        over_texture=True,
    ),
    MaterialRule("Bricks, named so.", _BRICKS, words=_words("brick")),
    MaterialRule(
        "Roofs of tiles, slate or sheet.",
        _ROOFS,
        words=_words("roof, tile, shingle, ridge"),
        classes=("building", "furniture"),
        without=_words("wall"),
    ),
    MaterialRule(
        "Gutters and drainpipes are zinc.",
        ("roof/metal", "metal/copper"),
        words=_words("gutter, downpipe, drainpipe, flashing"),
        classes=("building",),
    ),
    MaterialRule(
        "Walls of plaster, brick, concrete or stone.",
        _WALLS,
        words=_words("wall, facade, plaster, stucco, render, gable, chimney"),
        classes=("building", "other"),
    ),
    MaterialRule(
        "Frames, doors and shutters are wood or painted.",
        (*_WOODS, *_COATINGS),
        words=_words("frame, door, shutter, sill, fence, balcony, railing"),
        classes=("building",),
    ),
    MaterialRule(
        "Stairs and steps are concrete or stone.",
        (*_CONCRETES, *_STONES),
        words=_words("stair, step, stone"),
        classes=("building", "other"),
    ),
    # Street furniture.
    MaterialRule(
        "Faces of signs are retroreflective sheeting.",
        _SIGNS,
        words=(*_words("face, sign, panel, board, front, sheet"), *_COLOUR_WORDS),
        classes=("traffic_sign",),
        without=_words("pole, post, back, bracket"),
    ),
    MaterialRule(
        "Backs of signs are aluminium.", ("metal/aluminium",), words=_words("back, bracket, clamp"), classes=("traffic_sign",)
    ),
    MaterialRule(
        "Posters are printed paper.",
        _all("paper", "white", "poster_blue", "poster_red", "poster_green", "poster_yellow"),
        words=_words("poster, paper, advert, advertisement, placard, newspaper"),
    ),
    MaterialRule(
        "Poles are galvanised or painted steel.",
        ("metal/steel_galvanised", *_COATINGS),
        words=_words("pole, post, mast, arm, rail, pipe, bracket, column"),
        classes=("furniture", "building", "other"),
    ),
    MaterialRule(
        "Housings of traffic lights are dark plastic or coated.",
        ("plastic/black", "coating/black", "coating/green", "coating/yellow"),
        words=_words("housing, visor, case, body, backplate, hood"),
        classes=("traffic_light",),
    ),
    MaterialRule(
        "Cones are plastic with reflective bands.",
        ("plastic/orange", "plastic/red", "sign/white", "plastic/black"),
        words=(*_words("cone, band, base, body, stripe"), *_COLOUR_WORDS),
        classes=("cone",),
    ),
    MaterialRule("Planks are wood.", _WOODS, words=_words("wood, wooden, plank, slat, timber, board, crate, pallet")),
    # Materials by their own name, anywhere.
    MaterialRule("Rubber, named so.", ("rubber/tyre",), words=_words("rubber")),
    MaterialRule("Rust, named so.", ("metal/rust",), words=_words("rust, rusty, rusted")),
    MaterialRule("Copper, named so.", ("metal/copper",), words=_words("copper")),
    MaterialRule("Brass, named so.", ("metal/brass",), words=_words("brass, bronze")),
    MaterialRule("Aluminium, named so.", ("metal/aluminium",), words=_words("aluminium, aluminum, alu")),
    MaterialRule("Cast iron, named so.", ("metal/cast_iron",), words=_words("iron, manhole, grate, drain")),
    MaterialRule("Galvanised steel, named so.", ("metal/steel_galvanised",), words=_words("galvanised, galvanized, zinc")),
    MaterialRule("Steel, named so.", ("metal/steel", "metal/steel_brushed"), words=_words("steel, inox, stainless")),
    MaterialRule(
        "Metal, named so.",
        ("metal/steel", "metal/aluminium", "metal/steel_galvanised", "metal/cast_iron"),
        words=_words("metal, metallic"),
    ),
    MaterialRule("Plastic, named so.", _PLASTICS, words=_words("plastic, pvc, polymer")),
    MaterialRule("Leather, named so.", ("leather/black", "leather/brown"), words=_words("leather")),
    MaterialRule("Cloth, named so.", _CLOTHS, words=_words("cloth, fabric, textile, canvas, tarp, tarpaulin, awning")),
    MaterialRule("Clear glass, named so.", ("glass/window",), words=_words("glass"), without=_words("fibre, fiber")),
    MaterialRule("Plaster, named so.", _PLASTERS, words=_words("plaster, stucco")),
    MaterialRule("Stone, named so.", _STONES, words=_words("stone, granite, marble, sandstone, limestone")),
    # By class alone, for parts without a texture that no word tells about.
    MaterialRule("The file says that it is metal.", _BARE_METALS, classes=("furniture", "building", "other"), metallic=True),
    MaterialRule("A lit part of a vehicle; the colour tells which lamp.", _CAR_LAMPS, classes=("vehicle",), lit=True),
    MaterialRule("A lit part of a traffic light.", _SIGNALS, classes=("traffic_light",), lit=True),
    MaterialRule("A lit part of a street light.", ("lamp/street_led",), classes=("street_light",), lit=True),
    MaterialRule("What is not named on a vehicle is taken as its painted body.", _PAINTS, classes=("vehicle",)),
    MaterialRule(
        "What is not named on a person is taken as clothing or skin.",
        (*_CLOTHS, *_SKINS),
        classes=("person", "cyclist"),
        largest_distance=28.0,
    ),
    MaterialRule("What is not named on an animal is taken as fur.", _FURS, classes=("animal",), largest_distance=_DRAWN),
    MaterialRule(
        "What is not named on a plant is taken as leaves or bark.",
        (*_LEAVES, *_BARKS),
        classes=("tree", "bush"),
        largest_distance=_DRAWN,
    ),
    MaterialRule(
        "What is not named on a lawn is taken as grass.",
        _all("grass", "green", "dry"),
        classes=("grass",),
        largest_distance=_DRAWN,
    ),
    MaterialRule("Rocks are stone.", _STONES, classes=("rock",), largest_distance=_DRAWN),
    MaterialRule(
        "What is not named on street furniture is taken as painted or galvanised steel.",
        ("metal/steel_galvanised", *_COATINGS),
        classes=("furniture",),
        largest_distance=_DRAWN,
    ),
    MaterialRule(
        "What is not named on a building is taken as a wall.", _WALLS, classes=("building",), largest_distance=_DRAWN / 2
    ),
)
