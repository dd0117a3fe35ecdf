"""A document of every kind of block, with texts that want to be more than text."""

from __future__ import annotations

import numpy as np

from strapdown.report.chart import (
    BLUE,
    GREEN,
    ORANGE,
    VERMILLION,
    Band,
    Bars,
    Chart,
    Fill,
    Level,
    Line,
    Mark,
    Panel,
)
from strapdown.report.document import (
    Animation,
    Document,
    Facts,
    Items,
    KeyFigure,
    KeyFigures,
    Paragraph,
    Picture,
    Section,
    TableBlock,
)
from strapdown.report.scene import Scene, SceneBody, SceneLine, SceneWord

EVIL = (
    "<script>alert(1)</script>",
    "</script><img src=x onerror=alert(2)>",
    '#eval("1")',
    "$x$ *b* _i_ `c` @ref <label> \\u{41}",
    "\u202eright to left",
    "nul \x00 bell \x07 surrogate \ud800",
    "\U0001f697 \u8eca \u05e8\u05db\u05d1 \u200bz\u0337\u0336\u0335\u0334\u0333",
    "a" * 20_000,
)
DIGEST = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"
WORDS = (
    "The change of velocity is the integral of the acceleration over the impact, in the axes that "
    "the vehicle had at the trigger. Its bound holds the errors of the sensors, of their mounting "
    "and of the instant at which the recorder says that it was triggered; it does not hold that a "
    "record belongs to another crash."
)


def picture(slug="plan", text="north", width_mm=170.0, height=220):
    safe = text.replace("&", "&amp;").replace("<", "&lt;")
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 600 {height}" width="600" '
        f'height="{height}"><rect x="1" y="1" width="598" height="{height - 2}" fill="#f7f8fa" '
        f'stroke="#c9d0d7"/><circle cx="300" cy="{height / 2}" r="{height / 3}" fill="none" '
        f'stroke="#0072B2" stroke-width="2"/><path d="M300 {height / 2} L420 40" stroke="#D55E00" '
        f'stroke-width="4"/><text x="310" y="{height / 2 + 20}" font-size="16" '
        f'font-family="Helvetica, Arial, sans-serif" fill="#1b1f24">{safe}</text></svg>'
    )
    return Picture(slug, svg, f"A plan ({text})", "Seen from above.", "An arrow.", width_mm)


def speed_chart(slug, text="unit 1"):
    t = np.linspace(-0.1, 0.3, 400)
    y = 50.0 * (1.0 - np.exp(-np.clip(t, 0.0, None) / 0.05))
    return Chart(
        slug,
        f"Change of velocity of {text}",
        "The band holds the truth with 95 %. The dotted line is the trigger.",
        "time, s",
        (
            Panel(
                "delta-V, km/h",
                (Line(text, t, y, BLUE), Line("recorder", t, 1.03 * y, ORANGE, "dash")),
                fills=(Fill("95 %", t, y - 3 - 8 * t, y + 3 + 8 * t, BLUE),),
            ),
            Panel("yaw, deg", (Line("yaw", t, 150.0 * t, VERMILLION),), step=30.0),
        ),
        marks=(Mark(0.0, "trigger"),),
        bands=(Band(0.0, 0.08, "impact"),),
    )


def budget_chart(slug="budget"):
    names = ("scale factor", "mounting angles", "bias", "trigger", "sampling")
    sizes = np.array([0.9, 0.55, 0.31, 0.2, 0.04])
    labels = tuple(f"{size:.2f} km/h" for size in sizes)
    bars = Bars("part", np.arange(5.0), sizes, BLUE, labels=labels, legend=False)
    return Chart(
        slug,
        "Budget of the change of velocity",
        "Standard deviations; their squares add.",
        "standard deviation, km/h",
        (Panel("", (), categories=names, bars=(bars,)),),
    )


def plan_chart(slug="plan-live"):
    s = np.linspace(0.0, 1.0, 200)
    x, y = 18.0 * s, 4.0 * s**2
    car = np.array([[-2.2, 2.2, 2.2, -2.2, -2.2], [-0.9, -0.9, 0.9, 0.9, -0.9]])
    outline = Line("vehicle", x[-1] + car[0], y[-1] + car[1], GREEN, inside=0.12)
    lines = (Line("path", x, y, BLUE), outline)
    return Chart(
        slug,
        "The path on the ground",
        "Equal scales.",
        "time, s",
        (
            Panel("y, m", lines, x_label="x, m", height=1.6, levels=(Level(0.0, "kerb"),)),
            Panel("speed, km/h", (Line("path", s, 50 - 20 * s, BLUE),)),
        ),
    )


def animation(slug="motion", text="0.00 s"):
    t = np.linspace(0.0, 1.0, 21)
    level = np.tile([1.0, 0.0, 0.0, 0.0], (t.size, 1))
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
    path = np.column_stack([18.0 * t, 4.0 * t**2, 0.0 * t])
    scene = Scene(
        (SceneBody(corners, faces, (BLUE,) * 6, level, path),),
        (SceneLine(text, path, ORANGE),),
        (SceneWord(text, (1.0, 5.0, 0.0), GREEN),),
        tuple(f"{v:.2f} s" for v in t),
        np.array([-2.0, -2.0, -2.0]),
        np.array([20.0, 6.0, 2.0]),
        trail=(text, BLUE),
    )
    stills = picture(f"{slug}-stills", "four instants")
    return Animation(slug, "The motion", "Play it, or move it by hand.", scene, stills)


def table(rows, columns=5, words=(0,), caption="Answers of each unit", strong=()):
    names = ("unit", "delta-V, km/h", "standard deviation, km/h", "PDOF, deg", "yaw rate, deg/s")
    head = tuple(names[k] if k < 5 else f"quantity {k}, m/s" for k in range(columns))
    body = tuple(
        (f"unit {r}", *(f"{r * 1.37 + c:.2f}" for c in range(columns - 1))) for r in range(rows)
    )
    return TableBlock(head, body, words, caption, strong)


def rich_document(evil=(), charts=8):
    """Twelve sections; texts of `evil` stand in every kind of block."""
    bad = [*evil] or ["ordinary"]

    def one(k):
        return bad[k % len(bad)]

    evil_rows = tuple((text, *(text for _ in range(3))) for text in evil)
    sections = [
        Section("summary", "What was found", (Paragraph(WORDS), Paragraph(WORDS))),
        Section(
            "inputs",
            "Inputs, and what they are worth",
            (
                Facts((("record", f"crash/{DIGEST}.csv"), ("sha-256", DIGEST))),
                Paragraph("Two records were read.", "note"),
                Paragraph("Unit 2 clips at 50 g from 0.031 s to 0.038 s.", "warning"),
                Paragraph(f"strapdown verify FOLDER\nsha256 {DIGEST}", "mono"),
            ),
        ),
        Section("velocity", "Change of velocity", (speed_chart("dv"), table(6))),
        Section("budget", "Where the bound comes from", (budget_chart(),)),
        Section("path", "Path", (plan_chart(), picture(), animation())),
        Section("long", "A long table", (table(90, strong=(89,)), Paragraph(WORDS))),
        Section("wide", "A wide table", (table(8, columns=12, caption="Everything"),)),
        Section(
            "steps",
            "How it was computed",
            (
                Items((("First", WORDS), ("", "without a head"), ("Third", "")), numbered=True),
                Items((("Clock", "One for all."), ("Axes", "Forward, right, down."))),
            ),
        ),
        *(
            Section(f"unit-{k}", f"Unit {k}", (Paragraph(WORDS), speed_chart(f"u{k}")))
            for k in range(max(0, charts - 3))
        ),
        Section(
            "hostile",
            f"Texts {one(0)}",
            (
                *(Paragraph(text, kind) for text in evil for kind in ("plain", "mono")),
                Items(tuple((text, text) for text in evil)),
                Facts(tuple((text, text) for text in evil)),
                TableBlock(("a", one(1), one(3), "d"), evil_rows, (0, 1), one(2)),
                speed_chart(f"evil {one(0)}", one(3)),
                picture(f"../{one(1)}", one(1)),
                animation(f"x{one(2)}", one(1) + '<a href="http://example.org">a</a>'),
            ),
        ),
        Section("end", f"Limits {one(4)}", (Paragraph(WORDS),)),
    ]
    front = (
        KeyFigures(
            (
                KeyFigure("Change of velocity", "51.3 km/h", "\u00b1 2.1 km/h (95 %)", "14.3 m/s"),
                KeyFigure(
                    "Direction of force", "\u221212\u00b0", "\u00b1 4\u00b0 (95 %)", "front left"
                ),
                KeyFigure("Speed at impact", "48 km/h", "44 to 52 km/h (95 %)"),
                KeyFigure("Duration", "0.104 s", "\u00b1 0.006 s (95 %)"),
            ),
            (picture("key-1", "delta-V", 80.0, 300), picture("key-2", "PDOF", 80.0, 300)),
        ),
        Paragraph(
            "The vehicle changed its velocity by 51.3 km/h within 0.104 s; the force came from the "
            "front, 12\u00b0 to the left. Two recorders that know nothing of each other agree.",
            "lead",
        ),
    )
    return Document(
        "Crash against a pole" if not evil else f"Crash {one(0)} {one(4)}",
        f"Reconstruction from two recorders {one(2) if evil else ''}",
        (("case", "pole-29"), ("vehicle", f"sedan, {one(3)}"), ("made with", "strapdown 0.1.0")),
        front,
        tuple(sections),
        f"pole-29, reconstruction {one(5) if evil else ''}",
    )
