"""Channel codes of ISO MME: sixteen characters, decoded field by field.

The fields are test object (1), position (1), main location (4), fine locations 1, 2 and 3 (2 each),
physical dimension (2), direction (1) and filter class (1). Codes and meanings are those of RED B
1.6.2 of ISO/TS 13499 (2020). Codes that are not in the tables are shown unchanged, never guessed.

Directions X, Y and Z follow SAE J211 and SAE J1733: X forward, Y from left to right, Z down, and
right-handed rotations, as our axes. RED B reserves directions 1, 2 and 3 for signs that differ from
SAE J211: their axis is not known.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = [
    "BODY_PARTS",
    "CRITERIA",
    "DIMENSIONS",
    "FILTERS",
    "FINE",
    "FINE_1",
    "FINE_2",
    "FINE_3",
    "LENGTH",
    "NO_CLASS",
    "OTHER_PLACES",
    "VEHICLE_PARTS",
    "MmeCode",
    "decode_mme",
]


LENGTH = 16
OBJECTS = {
    "0": "test object not defined",
    **{str(k): f"vehicle {k}" for k in range(1, 10)},
    "B": "fixed barrier",
    "C": "component",
    "D": "dummy or impactor",
    "H": "linear impactor",
    "M": "mobile barrier",
    "P": "pendulum",
    "S": "sled",
    "T": "test rig",
}
POSITIONS = {
    "0": "",
    "1": "front left",
    "2": "front middle",
    "3": "front right",
    "4": "second row left",
    "5": "second row middle",
    "6": "second row right",
    "7": "third row left",
    "8": "third row middle",
    "9": "third row right",
    **{letter: f"seat {letter}" for letter in "ABCDEFGHIJKLMNOPQRSTUVWXYZ"},
}
#: Physical dimension: in words, and as a quantity of a crash record.
DIMENSIONS: dict[str, tuple[str, str]] = {
    "00": ("dimension not defined", "other"),
    "AA": ("angular acceleration", "other"),
    "AC": ("acceleration", "acceleration"),
    "AN": ("angle", "other"),
    "AV": ("angular velocity", "rate"),
    "CU": ("current", "other"),
    "DC": ("distance", "displacement"),
    "DS": ("displacement", "displacement"),
    "DV": ("displacement, integrated from velocity", "displacement"),
    "EN": ("energy", "other"),
    "EV": ("event", "other"),
    "FO": ("force", "force"),
    "FR": ("frequency", "other"),
    "IM": ("impulse", "other"),
    "JE": ("jerk", "other"),
    "LE": ("lever arm", "other"),
    "MA": ("mass", "other"),
    "MO": ("moment", "other"),
    "PO": ("power", "other"),
    "PR": ("pressure", "other"),
    "QU": ("quaternion", "other"),
    "RE": ("resistance", "other"),
    "SE": ("sensitivity", "other"),
    "SR": ("mechanical stress", "other"),
    "ST": ("strain", "other"),
    "TE": ("temperature", "other"),
    "TI": ("time", "time"),
    "VA": ("velocity, integrated from acceleration", "velocity"),
    "VD": ("velocity, differentiated from displacement", "velocity"),
    "VE": ("velocity", "velocity"),
    "VO": ("voltage", "other"),
}
DIRECTIONS = {
    "0": "direction not defined",
    "R": "resultant",
    "X": "longitudinal, positive forward",
    "Y": "lateral, positive to the right",
    "Z": "vertical, positive down",
    "1": "longitudinal, sign not that of SAE J211",
    "2": "lateral, sign not that of SAE J211",
    "3": "vertical, sign not that of SAE J211",
}
#: Filter class of the samples. E to H are filters of the edition of 1987 of ISO 6487.
FILTERS: dict[str, str] = {
    "0": "unfiltered",
    "1": "FIR 100",
    "2": "CFC 1000 and CFC 600 combined",
    "3": "CFC 600 and CFC 180 combined",
    "A": "CFC 1000",
    "B": "CFC 600",
    "C": "CFC 180",
    "D": "CFC 60",
    "E": "CFC 1000 (ISO 6487:1987)",
    "F": "CFC 600 (ISO 6487:1987)",
    "G": "CFC 180 (ISO 6487:1987)",
    "H": "CFC 60 (ISO 6487:1987)",
    "L": "CFC 20",
    "P": "filtered before the sampler, above CFC 1000",
    "Q": "filtered before the sampler, below CFC 60",
    "S": "special filter",
    "V": "from film or video",
    "X": "no filter class",
}
#: Letter of a channel without a filter class.
NO_CLASS = "X"
# Parts fixed to the body as long as it is rigid; all others move on their own.
_FIXED = (
    "VEHC APIL BPIL CPIL DPIL CRME SECM SILB TUNN ROOF ROFR FORA FRAM FOWE CEUN CTUN ABSE SERM "
    "SUDO WARC TRCM CCBE DASH SIME"
)
_VEHICLES = "123456789"


@dataclass(frozen=True)
class MmeCode:
    """A decoded channel code.

    Attributes
    ----------
    code : str
        As given, in capitals.
    test_object, position, location, dimension, direction, filter : str
        In words; a code that is not in the tables is quoted.
    fine : tuple of str
        Fine locations in words, without unused ones.
    quantity : str
        A key of `crash_record.QUANTITIES`.
    axis : str
        ``x y z`` for the directions X, Y, Z; else empty.
    body : str
        Body that the sensor is fixed to, if the object is vehicle 1 and the only one:
        ``vehicle``, ``front left occupant's head``, ``engine of the vehicle``.
    unknown : tuple of str
        Fields not in the tables, as ``main location 'QQQQ'``.
    """

    code: str
    test_object: str
    position: str
    location: str
    fine: tuple[str, ...]
    dimension: str
    direction: str
    filter: str
    quantity: str
    axis: str
    body: str
    unknown: tuple[str, ...]

    @property
    def place(self) -> str:
        """Position, main location and fine locations."""
        return ", ".join(p for p in (self.position, self.location, *self.fine) if p)


def decode_mme(code: str, *, objects: int = 1) -> MmeCode | None:
    """Decode a channel code.

    `objects`: number of test objects: with more than one, the body names the object. Returns none
    unless the code has sixteen letters and digits.
    """
    text = code.strip().upper()
    if len(text) != LENGTH or not (text.isascii() and text.isalnum()):
        return None
    unknown: list[str] = []

    def words(field: str, part: str, *tables: dict[str, str]) -> str:
        for table in tables:
            if part in table:
                return table[part]
        unknown.append(f"{field} '{part}'")
        return f"'{part}'"

    main = text[2:6]
    test_object = words("test object", text[0], OBJECTS)
    position = words("position", text[1], POSITIONS)
    owner = {"1": "customer's", "2": "laboratory's"}.get(main[0], "")
    if owner:
        location = f"the {owner} own place '{main[1:]}'"
    else:
        location = words("main location", main, BODY_PARTS, VEHICLE_PARTS, CRITERIA, OTHER_PLACES)
    fine = tuple(
        words(f"fine location {k}", text[4 + 2 * k : 6 + 2 * k], FINE, own)
        for k, own in ((1, FINE_1), (2, FINE_2), (3, FINE_3))
    )
    dimension, quantity = DIMENSIONS.get(text[12:14], ("", "other"))
    if not dimension:
        unknown.append(f"physical dimension '{text[12:14]}'")
        dimension = f"'{text[12:14]}'"
    direction = text[14]
    return MmeCode(
        code=text,
        test_object=test_object,
        position=position,
        location="" if main == "0000" else location,
        fine=tuple(f for f in fine if f),
        dimension=dimension,
        direction=words("direction", direction, DIRECTIONS),
        filter=words("filter class", text[15], FILTERS),
        quantity=quantity,
        axis=direction.lower() if direction in "XYZ" else "",
        body=_body(text, test_object, position, location, objects),
        unknown=tuple(unknown),
    )


def _body(text: str, test_object: str, position: str, location: str, objects: int) -> str:
    main = text[2:6]
    vehicle = text[0] in _VEHICLES
    whole = "vehicle" if vehicle and objects == 1 else test_object
    if main in BODY_PARTS and vehicle:
        who = f"{position} occupant" if position else "occupant"
        return f"{who}'s {location}" + ("" if objects == 1 else f", {whole}")
    if main in BODY_PARTS:
        return f"{location} of the {whole}"
    if main in _FIXED or main == "0000" or location == test_object:
        return whole
    return f"{location} of the {whole}" if vehicle and objects == 1 else f"{location}, {whole}"


# Fine locations of ISO MME channel codes in our words, as far as they matter for a crash, from RED
# B 1.6.2 of ISO/TS 13499 (2020).


#: Same meaning in each of the three fields.
FINE: dict[str, str] = {
    "00": "",
    "BO": "bottom",
    "FR": "front",
    "IN": "inner",
    "LE": "left",
    "LO": "lower",
    "MI": "middle",
    "OU": "outer",
    "RE": "rear",
    "RI": "right",
    "TP": "top",
    "UP": "upper",
    "CG": "centre of gravity",
    "CX": "centre in x",
    "CY": "centre in y",
    "CZ": "centre in z",
    "PR": "before the test",
    "RD": "redundant",
    **{f"{k:02d}": f"no. {k}" for k in range(1, 100)},
}
#: First field.
FINE_1: dict[str, str] = {
    "AV": "mean",
    "SU": "sum",
    "LL": "left lower",
    "LR": "left and right",
    "LU": "left upper",
    "RL": "right lower",
    "RU": "right upper",
    "LA": "left anterior",
    "LM": "left middle",
    "LP": "left posterior",
    "RA": "right anterior",
    "RM": "right middle",
    "RP": "right posterior",
    "CS": "crash sensor",
    "IS": "impact sound sensor",
    "OR": "origin",
    "AD": "adult",
    "CH": "child",
    "IP": "in position",
    "OP": "out of position",
}
#: Second field.
FINE_2: dict[str, str] = {
    "AV": "mean",
    "SU": "sum",
    "DI": "difference",
    "NE": "negative",
    "PO": "positive",
    "SF": "scale factor",
    "L1": "left redundant",
    "L2": "lower redundant",
    "M1": "middle redundant",
    "R1": "right redundant",
    "U1": "upper redundant",
    "HS": "high-speed sampling",
    "RW": "raw data",
    "OR": "origin",
    "3C": "3 ms value, cumulative",
    "3S": "3 ms value, single peak",
}
#: Third field: dummies.
FINE_3: dict[str, str] = {
    "PO": "after the test",
    "BR": "BioRID",
    "BS": "BioSID",
    "E1": "EuroSID-1",
    "E2": "ES-2",
    "ER": "ES-2 with rib extension",
    "H2": "Hybrid II, mid-sized male",
    "H3": "Hybrid III, mid-sized male",
    "HF": "Hybrid III, small female",
    "HM": "Hybrid III, large male",
    "Q0": "Q0 dummy",
    "Q1": "Q1 dummy",
    "Q2": "Q1.5 dummy",
    "Q3": "Q3 dummy",
    "Q4": "Q3 dummy for side impact",
    "Q6": "Q6 dummy",
    "QA": "Q10 dummy",
    "QB": "Q10 dummy (Euro NCAP)",
    "S2": "SID-IIs",
    "SH": "SID-H3",
    "SI": "SID",
    "TF": "THOR, small female",
    "TH": "THOR",
    "TM": "THOR, large male",
    "T3": "THOR with Hybrid III legs",
    "WF": "WorldSID, small female",
    "WS": "WorldSID",
    "Y6": "Hybrid III, 3 years",
    "Y7": "Hybrid III, 6 years",
    "YA": "Hybrid III, 10 years",
}


# Main locations of ISO MME channel codes in our words, from RED B 1.6.2 of ISO/TS 13499 (2020).
#
# Codes that begin with 1 or 2 belong to a customer or a laboratory, which defines them.


#: Persons and dummies.
BODY_PARTS: dict[str, str] = {
    "ACHI": "Achilles tendon",
    "ACRO": "acromion",
    "FIBU": "fibula",
    "LLEG": "lower leg",
    "RADI": "radius",
    "SCAP": "scapula",
    "SKUL": "skull",
    "ULEG": "upper leg",
    "ULNA": "ulna",
    "BRAI": "brain",
    "HUMS": "humerus",
    "HEAD": "head",
    "CESP": "cervical spine",
    "NECK": "neck",
    "SHLD": "shoulder",
    "CLAV": "clavicle",
    "UPAR": "upper arm",
    "ELBJ": "elbow joint",
    "FOAR": "forearm",
    "WRIS": "wrist",
    "SHRI": "shoulder rib",
    "TRRI": "thorax rib",
    "RIBS": "ribs",
    "CHRI": "chest-rib",
    "TRSP": "thorax rib to spine",
    "SPIN": "spine",
    "THSP": "thoracic spine",
    "BAPL": "backplate",
    "MUSU": "muscle substitute",
    "CHST": "chest",
    "STRN": "sternum",
    "CHBA": "chest band",
    "ABRI": "abdominal-rib",
    "ABSP": "abdominal-spine",
    "ABDO": "abdomen",
    "LUSP": "lumbar spine",
    "PELV": "pelvis",
    "ACTB": "acetabulum",
    "HPNT": "H-point",
    "ILUM": "ilium",
    "ILAC": "iliac",
    "PUBC": "pubic",
    "CROB": "crotch belt",
    "SACR": "sacrum",
    "FEAC": "femur to acetabulum",
    "FEMR": "femur",
    "KNEE": "knee",
    "CLEV": "clevis",
    "KNSL": "knee slider",
    "TIRA": "tibia ratio",
    "TIBI": "tibia",
    "ANKL": "ankle",
    "FOOT": "foot",
    "HEEL": "heel",
    "TOES": "toes",
    "DAMP": "damper",
    "OCCU": "occupant",
    "SUMA": "submarining",
}

#: Vehicles.
VEHICLE_PARTS: dict[str, str] = {
    "ABSE": "airbag sensor",
    "AIRB": "airbag",
    "APIL": "A-pillar",
    "AXLE": "axle",
    "BAFI": "belt anchor fitting",
    "BATT": "battery",
    "BCKL": "buckle",
    "BLOK": "belt lock",
    "BLOP": "belt loop",
    "BPIL": "B-pillar",
    "BRBO": "brake booster",
    "BUMP": "bumper",
    "BUSY": "bumper system",
    "CASH": "cardan shaft",
    "CCBE": "cross car beam",
    "CEUN": "central unit",
    "CHAR": "battery charger",
    "CPIL": "C-pillar",
    "CRAN": "child restraint anchor",
    "CRME": "crossmember",
    "CRSB": "child restraint seatbelt",
    "CTAN": "child tether anchorages",
    "CTUN": "control unit",
    "DASB": "dashboard",
    "DASH": "dash panel",
    "DIFF": "differential",
    "DOOR": "door",
    "DOPA": "door panel",
    "DPIL": "D-pillar",
    "ENGN": "engine",
    "FEND": "fender",
    "FORA": "floor over rear axle",
    "FOWE": "footwell",
    "FRAM": "frame",
    "FREN": "frontend",
    "FUL2": "second fuel tank",
    "FULT": "fuel tank",
    "GEAR": "gearbox",
    "GENR": "generator",
    "HEPL": "heel plate",
    "HERE": "head restraint",
    "HOOD": "hood",
    "INSW": "inertia switch",
    "KNBO": "knee bolster",
    "LAMP": "lamp",
    "LOCK": "lock",
    "LOLI": "load limiter",
    "LOSY": "lock system",
    "MSME": "main side member",
    "OILS": "oil sump",
    "PEAC": "pedal accelerator",
    "PEBR": "pedal brake",
    "PECL": "pedal clutch",
    "POCA": "power cable",
    "POEL": "power electronics",
    "PRET": "pretensioner",
    "RACM": "radiator cross member",
    "RETR": "retractor",
    "ROFR": "roof frame",
    "ROOF": "roof",
    "ROPS": "rollover protection system",
    "RORA": "roof rack",
    "RVMB": "rear view mirror base",
    "RVMR": "rear view mirror",
    "SBAD": "seat back adjuster",
    "SBHA": "seat belt height adjuster",
    "SEAD": "seat adjuster",
    "SEAT": "seat",
    "SEBA": "seat back",
    "SEBE": "seat belt",
    "SECM": "seat cross member",
    "SEFR": "seat frame",
    "SEPN": "seat pan",
    "SERM": "seat rail mount",
    "SETR": "seat track",
    "SILB": "sill beam",
    "SIME": "side member",
    "SLMB": "slam beam",
    "STAR": "starter",
    "STBR": "strut brace",
    "STCM": "steering column mount",
    "STCO": "steering column",
    "STCS": "steering column suspension",
    "STEP": "step",
    "STWH": "steering wheel hub",
    "STWL": "steering wheel",
    "SUBF": "subframe",
    "SUDO": "suspension dome",
    "SUHO": "suspension housing",
    "SUSM": "suspension mount",
    "SUUN": "suspension unit",
    "TAIG": "tailgate",
    "TAIL": "tail",
    "TBAT": "traction battery",
    "TOPT": "top tether",
    "TRAN": "transmission",
    "TRCM": "transmission cross member",
    "TUNN": "tunnel",
    "VEHC": "vehicle",
    "WARC": "wheel arch",
    "WHBC": "wheel brake caliper",
    "WHEL": "wheel",
    "WIND": "window",
}

#: Results, not locations.
CRITERIA: dict[str, str] = {
    "HICR": "head injury criterion",
    "BRIC": "brain injury criterion BrIC",
    "HACR": "head acceptability criterion",
    "HPCR": "head protection criterion",
    "HECD": "head contact duration",
    "NICF": "NIC load duration",
    "NICR": "neck injury criterion, rear impact",
    "NIEF": "neck injury criterion of Euro NCAP",
    "NKMC": "Nkm criterion",
    "NIJC": "Nij criterion",
    "TMON": "total moment neck",
    "VCCR": "viscous criterion",
    "VCAR": "viscous criterion of an abdominal rib",
    "THPC": "thoracic performance criterion",
    "TTIN": "thoracic trauma index",
    "THAC": "thoracic acceptability criterion",
    "CTIN": "combined thoracic index",
    "THCC": "thoracic compression criterion",
    "CHSI": "chest severity index",
    "RDCR": "rib deflection criterion",
    "RDAR": "rib deflection criterion, abdomen",
    "APFC": "abdominal peak force",
    "ADRA": "abdominal deflection rate",
    "CDRA": "chest deflection rate",
    "PSPF": "pubic symphysis peak force",
    "FFCE": "femur force criterion",
    "FFCR": "femur force criterion",
    "FACR": "femur acceptability criterion",
    "TIIN": "tibia index",
    "TCFC": "tibia compression criterion",
    "NCAP": "new car assessment programme",
    "AACP": "mean acceleration during compression",
}

#: Barriers, rigs and simulations.
OTHER_PLACES: dict[str, str] = {
    "0000": "place not defined",
    "ACTU": "actuator",
    "DEFO": "deformable element",
    "DTIM": "time step",
    "EHOU": "hourglass energy",
    "EINT": "internal energy",
    "EKIN": "kinetic energy",
    "ESLI": "sliding interface energy",
    "ETOT": "total energy",
    "EXWO": "total external work",
    "FBAR": "fixed barrier",
    "GRND": "ground, sand bed or embankment",
    "IMPA": "impactor",
    "LOMA": "load cell matrix",
    "LUGG": "luggage",
    "MBAR": "mobile barrier",
    "MINC": "mass increase",
    "PLAF": "platform",
    "POLE": "pole",
    "RAMP": "ramp",
    "SENS": "sensor",
    "SFAD": "static force application device",
    "SLED": "sled",
    "SUBJ": "subject",
    "TDCG": "traction device, centre of gravity",
    "TDLB": "traction device lap belt",
    "TDSB": "traction device shoulder belt",
    "TEST": "test signal",
    "TIRS": "time reference signal",
    "ZERO": "time zero",
}
