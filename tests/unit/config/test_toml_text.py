"""How a file that is written names others."""

from __future__ import annotations

from pathlib import Path

import pytest

from strapdown.config.toml_text import Page, named_from


@pytest.mark.parametrize(
    ("log", "folder", "named"),
    [
        ("/a/b/log.csv", "/a/b", "log.csv"),
        ("/a/b/c/log.csv", "/a/b", "c/log.csv"),
        ("/a/log.csv", "/a/b/c", "../../log.csv"),
        ("/data/x/log.csv", "/home/y/z", "/data/x/log.csv"),
        ("/data/log.csv", "/", "data/log.csv"),
    ],
)
def test_a_file_is_named_from_the_folder_or_whole_where_they_share_none(
    tmp_path, log, folder, named
):
    assert named_from(Path(log), Path(folder)) == named


def test_what_follows_a_path_stands_on_the_same_line_however_long_the_path_is(tmp_path):
    pages = []
    for name in ("a", "a" * 120):
        page = Page()
        page.path("path", tmp_path / name, tmp_path)
        page.key("lat_deg", '"?"')
        pages.append(page)
    assert pages[0].asked == pages[1].asked
