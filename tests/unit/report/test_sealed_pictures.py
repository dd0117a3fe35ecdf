"""The pictures of a sealed bench are drawn again to the same bytes, whoever draws them."""

from __future__ import annotations

from strapdown import verify
from strapdown.api.attitude import compare_attitude
from strapdown.report.attitude import write_attitude

FEW = ("euler", "quaternion")


def test_pictures_of_the_second_form_verify_too(tmp_path):
    seal = write_attitude(
        compare_attitude("alexiev-fig2a", algorithms=FEW), tmp_path / "out", png=True
    )
    figures = seal.path / "figures"
    assert {p.stem for p in figures.glob("*.png")} == {p.stem for p in figures.glob("*.svg")}
    png = (figures / "gyro.png").read_bytes()
    assert png.startswith(b"\x89PNG")
    assert verify(seal.path).verdict == "identical"
