"""The pictures of a sealed bench are drawn again to the same bytes, whoever draws them."""

from __future__ import annotations

from strapdown import bench_attitude, verify, write_attitude


def test_pictures_of_the_second_form_verify_too(tmp_path):
    seal = write_attitude(bench_attitude("alexiev-fig2a"), tmp_path / "out", png=True)
    assert (seal.path / "figures" / "gyro.png").is_file()
    assert verify(seal.path).verdict == "identical"


def test_the_pictures_do_not_follow_the_style_of_whoever_runs_it(tmp_path, monkeypatch):
    import matplotlib as mpl

    seals = []
    for size in (9.0, 30.0):
        with mpl.rc_context({"font.size": size, "lines.linewidth": size}):
            seals.append(write_attitude(bench_attitude("alexiev-fig2a"), tmp_path / str(size)))
    assert seals[0].digest == seals[1].digest
