"""A bundle that was changed and sealed again: what `verify` says, here and as if from elsewhere."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest
from tests.coded import coded

from strapdown import bundle, verify
from strapdown.bundle import MANIFEST, sha256, to_json
from strapdown.bundle.signature import new_key, sign, signatures, signer_of
from strapdown.errors import ConfigError, DataError
from strapdown.report import verify as module
from strapdown.report.content import compare_files, same_text
from strapdown.report.verify import verification_page


@pytest.fixture(scope="module")
def sealed(sealed_crash, tmp_path_factory, run_cli):
    """One bundle of each of four kinds: those with pages, PDF, pictures, maps and tables."""
    root = tmp_path_factory.mktemp("kinds")
    flags = ("--quiet", "--out")
    attitude = ("attitude", "alexiev-fig4", "--png", "--algorithms", "quaternion")
    assert run_cli(*attitude, *flags, root / "attitude").code == 0
    text = Path("docs/examples/navigate_drive.toml").read_text(encoding="utf-8")
    drive = tmp_path_factory.mktemp("drive") / "drive.toml"
    for long, short in (("duration_s = 40.0", "duration_s = 12.0"), ("80.0, 110.0", "52.0, 60.0")):
        text = text.replace(long, short)
    drive.write_text(text, encoding="utf-8")
    assert run_cli("navigate", drive, *flags, root / "navigate").code == 0
    shutil.copytree(sealed_crash.folder, root / "crash")
    simulated = ("simulate", "alexiev-fig2f", "--format", "all", "--rate", "20")
    assert run_cli(*simulated, *flags, root / "simulate").code == 0
    return root


@pytest.fixture
def again(sealed, monkeypatch):
    """The second run is stood in for by what was sealed: the comparison is what is tested."""

    def of(kind):
        monkeypatch.setattr(
            module, "_rerun", lambda c, configuration, out, s: shutil.copytree(sealed / kind, out)
        )

    return of


def seal_again(folder, *, elsewhere=True, change=None):
    """Write the digests of all files anew, as a forger would; `elsewhere`: another processor."""
    manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    for item in [*manifest["inputs"], *manifest["outputs"]]:
        path = folder / item["name"]
        item |= {"sha256": sha256(path), "bytes": path.stat().st_size}
    if elsewhere:
        manifest["platform"]["cpu"] = "another"
    if change is not None:
        change(manifest)
    (folder / MANIFEST).write_text(to_json(manifest), encoding="utf-8")


slow = pytest.mark.slow


@pytest.mark.parametrize(
    "kind", ["attitude", "simulate", *(pytest.param(k, marks=slow) for k in ("navigate", "crash"))]
)
@pytest.mark.parametrize("elsewhere", [False, True])
def test_one_byte_in_each_file_of_each_kind_is_found(sealed, again, tmp_path, kind, elsewhere):
    again(kind)
    copy = shutil.copytree(sealed / kind, tmp_path / kind)
    manifest = json.loads((copy / MANIFEST).read_text(encoding="utf-8"))
    before = (copy / MANIFEST).read_bytes()
    for item in manifest["outputs"]:
        path = copy / item["name"]
        whole = path.read_bytes()
        # Among the last digits of a number one byte may be a rounding: two places.
        for place in (len(whole) // 3, len(whole) // 2):
            changed = whole[:place] + bytes([whole[place] ^ 0x02]) + whole[place + 1 :]
            path.write_bytes(changed)
            seal_again(copy, elsewhere=elsewhere)
            found = verify(copy)
            path.write_bytes(whole)
            (copy / MANIFEST).write_bytes(before)
            if found.verdict == "numerically equal":
                # A rounding, or a byte between the arrays of a binary file that says nothing.
                binary = path.suffix in (".h5", ".mat", ".npz", ".parquet")
                assert elsewhere and (binary or chr(whole[place]).isdigit()), (item["name"], place)
                assert found.files != () and found.within <= 1e-6
                continue
            assert found.verdict == "changed", (item["name"], place, found.details)
            assert item["name"] in {f.file for f in found.findings}
    assert verify(copy).verdict == "identical"


def forged(sealed, tmp_path, kind, name, change, stated=None):
    copy = shutil.copytree(sealed / kind, tmp_path / "forged", dirs_exist_ok=True)
    path = copy / name
    before = path.read_bytes()
    path.write_bytes(change(before))
    assert path.read_bytes() != before
    seal_again(copy, change=stated)
    return verify(copy)


def swapped(old, new):
    return lambda data: data.replace(old, new, 1)


def moved(data):
    """The first coordinates of a map by some ten kilometres."""
    return re.sub(
        rb"(\d+\.)(\d)(\d+,)", lambda m: m[1] + bytes([m[2][0] ^ 1]) + m[3], data, count=1
    )


FORGED = [
    ("crash", "report.html", swapped(b"25.89", b"15.89")),
    ("crash", "report.html", swapped(b"</body>", b"<script>document.title=1</script></body>")),
    ("crash", "report.html", swapped(b"</style>", b"h1::after{content:'guilty'}</style>")),
    ("crash", "report.pdf", lambda data: data.replace(b"%%EOF", b"%%EOF\n%%EOF")[:-200]),
    ("crash", "figures/path.svg", swapped(b'x1="', b'x1="9')),
    ("navigate", "trajectory.kml", moved),
    ("navigate", "trajectory.kml", swapped(b"<name>", b"<name>not ")),
    ("navigate", "trajectory.geojson", moved),
    ("navigate", "trajectory.csv", swapped(b"# ", b"# not ")),
    ("simulate", "log.h5", swapped(b"rad/s", b"deg/s")),
    ("navigate", "verdict.json", swapped(b"true", b"false")),
    ("navigate", "verdict.json", swapped(b'"horizontal_position": {', b'"vertical_velocity2": {')),
    ("attitude", "figures/cost.png", lambda data: data[:-30] + b"\0" + data[-29:]),
]


@pytest.mark.parametrize(("kind", "name", "change"), FORGED)
def test_a_forgery_is_found_where_another_platform_is_stated(
    sealed, again, tmp_path, kind, name, change
):
    again(kind)
    found = forged(sealed, tmp_path, kind, name, change)
    assert found.verdict == "changed"
    assert name in {f.file for f in found.findings if f.code == "verify.content"} | {
        f.file for f in found.findings if f.code == "verify.numbers"
    }


@pytest.mark.parametrize(("kind", "name", "change"), FORGED)
def test_and_is_never_confirmed_where_another_version_is_stated(
    sealed, again, tmp_path, kind, name, change
):
    """Another version draws in another way: then what was not compared is said, by exit code 7."""
    again(kind)

    def version(manifest):
        manifest["versions"] |= {"strapdown source": "0" * 64, "typst": "0.1"}

    found = forged(sealed, tmp_path, kind, name, change, version)
    assert found.verdict in ("equal in part", "changed")
    assert name in {f.file for f in found.findings}


@pytest.mark.parametrize(("kind", "verdict"), [("navigate", "identical"), ("crash", "changed")])
def test_another_typst_is_another_condition_where_it_laid_something_out(
    sealed, again, tmp_path, kind, verdict
):
    again(kind)
    copy = shutil.copytree(sealed / kind, tmp_path / "copy")
    # A page with other letters has other bytes, which the same conditions do not excuse.
    if kind == "crash":
        (copy / "report.pdf").write_bytes((copy / "report.pdf").read_bytes() + b"%")
    seal_again(copy, elsewhere=False, change=lambda m: m["versions"].pop("typst"))
    found = verify(copy)
    assert found.verdict == verdict
    named = {f.data["name"] for f in found.findings if f.code == "verify.condition"}
    assert named == ({"typst"} if kind == "crash" else set())


def test_an_honest_bundle_of_another_version_is_confirmed(sealed, again, tmp_path):
    again("crash")
    copy = shutil.copytree(sealed / "crash", tmp_path / "copy")
    seal_again(copy, change=lambda m: m["versions"].update({"strapdown source": "0" * 64}))
    found = verify(copy)
    assert (found.verdict, found.within) == ("numerically equal", 0.0)
    codes = [f.code for f in found.findings]
    assert codes.count("verify.same-bytes") == 1
    # The page in other words of style; its PDF with a line more of drawing.
    page = copy / "report.html"
    page.write_text(page.read_text(encoding="utf-8").replace("<style>", "<style>/* other */"))
    seal_again(copy, change=lambda m: m["versions"].update({"strapdown source": "0" * 64}))
    found = verify(copy)
    assert found.verdict == "equal in part"
    assert [f.file for f in found.findings if f.code == "verify.drawing"] == ["report.html"]


@slow
def test_the_text_of_a_pdf_is_compared_where_other_versions_drew_it(sealed, tmp_path):
    import pypdf

    one = sealed / "crash" / "report.pdf"
    writer = pypdf.PdfWriter(clone_from=one)
    # As another version would: other objects, the same words.
    writer.write(tmp_path / "other.pdf")
    assert compare_files(one, tmp_path / "other.pdf", drawn_alike=False).drawing
    assert compare_files(one, tmp_path / "other.pdf", drawn_alike=True).within == float("inf")
    writer.remove_text()
    writer.write(tmp_path / "forged.pdf")
    found = compare_files(one, tmp_path / "forged.pdf", drawn_alike=False)
    assert (found.within, found.drawing) == (float("inf"), False)


@pytest.mark.parametrize(
    ("one", "two", "same"),
    [
        ("v 12.3 m", "v 12.4 m", True),
        ("v 12.3 m", "v 12.5 m", False),
        ("9.99", "10.0", True),
        ("3 rests", "4 rests", False),
        ("3 rests", "3.0 rests", True),
        ("2e-16", "3e-16", True),
        ("1.5e3", "1.6e3", True),
        ("1.5e3", "1.7e3", False),
        ("1.0000000000", "1.0000000009", True),
        ("55.000000000", "55.000000900", False),
        ("-0.1", "0.1", False),
        ("0.0", "-0.0", True),
        ("1e999", "1e998", False),
        ("a 1", "b 1", False),
        ("strapdown 0.1.0 2", "strapdown 1.2.3.dev0 2", True),
        ("data:image/svg+xml;base64,MS4y", "data:image/svg+xml;base64,MS4z", True),
        ("data:image/svg+xml;base64,MS4y", "data:image/svg+xml;base64,MS44", False),
    ],
)
def test_printed_numbers_may_differ_in_their_last_digit(one, two, same):
    assert same_text(one, two) is same
    assert same_text(two, one) is same


def test_a_route_that_moved_is_no_rounding(sealed, again, tmp_path):
    """By six meters, relative to degrees within 1e-6; and small numbers that all turned round."""
    again("navigate")

    def route(data):
        head, rows = data.split(b"heading_deg\n")
        lines = [line.split(b",") for line in rows.splitlines()]
        for line in lines:
            line[1] = repr(float(line[1]) + 5e-5).encode()
        return head + b"heading_deg\n" + b"".join(b",".join(line) + b"\n" for line in lines)

    assert forged(sealed, tmp_path, "navigate", "trajectory.csv", route).verdict == "changed"
    shutil.rmtree(tmp_path / "forged")
    small = re.compile(rb"(?<=,)\d\.\d+e-[89](?=,)")

    def turned(data):
        # All that are below the tolerance of a number of one.
        return small.sub(lambda m: b"-" + m[0], data)

    found = forged(sealed, tmp_path, "navigate", "sensor_errors.csv", turned)
    assert found.verdict == "changed"


def doubled(data):
    text = json.loads(data)
    key = next(iter(text))
    return data.replace(b"{", b'{"' + key.encode() + b'": "forged",', 1)


ADDED = [
    ("crash", "crash.json", doubled),
    ("navigate", "trajectory.geojson", doubled),
    ("navigate", "trajectory.csv", lambda data: data + b"# the recorder was faulty\n"),
    ("navigate", "trajectory.csv", lambda data: data[:-1] + b",\n"),
    ("navigate", "trajectory.csv", lambda data: data.replace(b"\n", b"\r\n")),
    ("simulate", "log.npz", lambda data: data + b"x"),
    ("simulate", "log.npz", lambda data: b"#!/bin/sh\n" + data),
    ("simulate", "log.mat", lambda data: b"FORGED" + data[6:]),
    ("simulate", "log.h5", lambda data: data + b"x"),
    ("crash", "report.pdf", lambda data: data + b"x"),
    ("crash", "report.pdf", lambda data: data + data[data.rindex(b"startxref") :]),
]


@pytest.mark.parametrize(("kind", "name", "change"), ADDED)
def test_what_is_added_to_a_file_is_found(sealed, again, tmp_path, kind, name, change):
    again(kind)
    found = forged(sealed, tmp_path, kind, name, change)
    assert (found.verdict, [f.file for f in found.findings if f.code == "verify.content"]) == (
        "changed",
        [name],
    )


def test_arrays_and_attributes_that_are_added_are_found(sealed, again, tmp_path):
    import h5py
    import pyarrow.parquet as pq

    again("simulate")

    def of_hdf5(data):
        path = tmp_path / "x.h5"
        path.write_bytes(data)
        with h5py.File(path, "a") as file:
            file.attrs["forged"] = "yes"
        return path.read_bytes()

    def of_parquet(data):
        path = tmp_path / "x.parquet"
        path.write_bytes(data)
        table = pq.read_table(path)
        pq.write_table(table.replace_schema_metadata({"forged": "yes"}), path)
        return path.read_bytes()

    for name, change in (("log.h5", of_hdf5), ("log.parquet", of_parquet)):
        assert forged(sealed, tmp_path, "simulate", name, change).verdict == "changed", name
        shutil.rmtree(tmp_path / "forged")


def test_a_page_or_a_run_inside_the_bundle_would_change_it(sealed, run_cli):
    folder = sealed / "simulate"
    for option in ("--page", "--again"):
        done = run_cli("verify", folder, option, folder / "x.html")
        assert (done.code, "inside the bundle" in done.err) == (4, True)


def test_links_are_no_files_of_a_bundle(sealed, tmp_path):
    copy = shutil.copytree(sealed / "attitude", tmp_path / "copy")
    elsewhere = tmp_path / "elsewhere.html"
    page = copy / "report.html"
    page.rename(elsewhere)
    page.symlink_to(elsewhere)
    assert verify(copy).details == ("report.html: a link, and a bundle has only files",)
    page.unlink()
    elsewhere.rename(page)
    (copy / "figures").rename(tmp_path / "figures")
    (copy / "figures").symlink_to(tmp_path / "figures")
    assert {f.code for f in verify(copy).findings} == {"bundle.a-link", "bundle.not-in-manifest"}
    (copy / "figures").unlink()
    (tmp_path / "figures").rename(copy / "figures")
    (copy / "timing.json").unlink(missing_ok=True)
    (copy / "timing.json").symlink_to("/dev/zero")
    assert verify(copy).details == ("timing.json: a link, and a bundle has only files",)


def test_a_manifest_that_says_something_twice_or_more_is_not_ours(sealed, tmp_path):
    copy = shutil.copytree(sealed / "simulate", tmp_path / "copy")
    text = (copy / MANIFEST).read_text(encoding="utf-8")
    twice = text.replace('"command": "simulate"', '"command": "x",\n  "command": "simulate"')
    more = to_json(json.loads(text) | {"verdict": "guilty"})
    beside = json.loads(text)
    beside["outputs"][0]["note"] = "guilty"
    for other in (twice, more, to_json(beside)):
        (copy / MANIFEST).write_text(other, encoding="utf-8")
        assert [f.code for f in verify(copy).findings] == ["verify.form"]
    missing = json.loads(text)
    del missing["environment"]
    (copy / MANIFEST).write_text(to_json(missing), encoding="utf-8")
    with pytest.raises(DataError, check=coded("bundle.unknown-form")):
        verify(copy)


def test_the_seal_may_be_given_as_it_was_printed(sealed, again, run_cli, tmp_path):
    again("simulate")
    folder = sealed / "simulate"
    digest = sha256(folder / MANIFEST)
    for given in (digest, digest.upper(), f"sha256 {digest}", f"Seal  sha256 {digest}"):
        assert verify(folder, seal=given).verdict == "identical"
    other = verify(folder, seal="0" * 64)
    assert other.verdict == "changed"
    assert [f.code for f in other.findings] == ["verify.other-seal"]
    with pytest.raises(ConfigError, check=coded("verify.no-digest")):
        verify(folder, seal=digest[:16])
    done = run_cli("verify", folder, "--seal", "0" * 64)
    assert (done.code, done.out.splitlines()[0]) == (6, "changed")


# Signatures.


@pytest.fixture
def copy(sealed, again, tmp_path):
    again("simulate")
    return shutil.copytree(sealed / "simulate", tmp_path / "copy")


def test_a_signed_bundle_is_of_its_signer_alone(copy, tmp_path):
    name = new_key(tmp_path / "me.pem")
    other = new_key(tmp_path / "other.pem")
    if bundle.atomic_folder.os.name != "nt":
        assert (tmp_path / "me.pem").stat().st_mode & 0o777 == 0o600
    assert signer_of(tmp_path / "me.pem.pub") == name != other
    with pytest.raises(ConfigError, check=coded("bundle.key-exists")):
        new_key(tmp_path / "me.pem")
    unsigned = verify(copy, signer=tmp_path / "me.pem.pub")
    assert (unsigned.verdict, unsigned.findings[0].code) == ("changed", "verify.not-signed")
    before = sha256(copy / MANIFEST)
    made = sign(copy, tmp_path / "me.pem")
    assert (made.signer, made.valid) == (name, True)
    assert sha256(copy / MANIFEST) == before
    for signer in (tmp_path / "me.pem.pub", name, name.upper()):
        found = verify(copy, signer=signer)
        assert (found.verdict, found.findings[0].code) == ("identical", "verify.signed")
    assert verify(copy, signer=tmp_path / "other.pem.pub").verdict == "changed"
    sign(copy, tmp_path / "other.pem")
    assert {s.signer for s in signatures(copy)} == {name, other}
    assert verify(copy, signer=other).verdict == "identical"


def test_a_signature_does_not_survive_a_change(copy, tmp_path):
    new_key(tmp_path / "me.pem")
    made = sign(copy, tmp_path / "me.pem")
    path = copy / made.file
    good = path.read_bytes()
    seal_again(copy)
    found = verify(copy)
    assert (found.verdict, found.findings[0].code) == ("changed", "verify.signature-wrong")
    with pytest.raises(DataError, check=coded("bundle.changed-not-signed")):
        (copy / "log.csv").write_text("1")
        sign(copy, tmp_path / "me.pem")
    for bad in (b"", b"{}", b"[1]", good[:-9], good.replace(b'"signature": "', b'"signature": "?')):
        path.write_bytes(bad)
        found = verify(copy)
        assert "bundle.no-signature" in {f.code for f in found.findings}, bad
        assert found.verdict == "changed"


def test_keys_are_refused_by_what_is_wrong_with_them(copy, tmp_path):
    new_key(tmp_path / "locked.pem", "secret")
    new_key(tmp_path / "open.pem")
    (tmp_path / "text").write_text("no key")
    cases = [
        ("text", None, "bundle.no-secret-key"),
        ("missing", None, "bundle.no-key-file"),
        ("open.pem.pub", None, "bundle.no-secret-key"),
        ("locked.pem", None, "bundle.key-needs-password"),
        ("locked.pem", "wrong", "bundle.wrong-password"),
        ("open.pem", "secret", "bundle.key-has-no-password"),
    ]
    for file, password, code in cases:
        with pytest.raises(ConfigError, check=coded(code)):
            sign(copy, tmp_path / file, password)
    assert sign(copy, tmp_path / "locked.pem", "secret").valid
    for signer in ("text", "missing", "open.pem"):
        with pytest.raises(ConfigError, check=coded("bundle.no-public-key")):
            signer_of(tmp_path / signer)


def test_a_key_of_openssh_signs_and_any_program_checks(copy, tmp_path):
    from cryptography.hazmat.primitives import serialization as form
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    key = Ed25519PrivateKey.generate()
    private = key.private_bytes(form.Encoding.PEM, form.PrivateFormat.OpenSSH, form.NoEncryption())
    (tmp_path / "id").write_bytes(private)
    public = key.public_key()
    (tmp_path / "id.pub").write_bytes(
        public.public_bytes(form.Encoding.OpenSSH, form.PublicFormat.OpenSSH)
    )
    made = sign(copy, tmp_path / "id")
    assert verify(copy, signer=tmp_path / "id.pub").verdict == "identical"
    import base64

    content = json.loads((copy / made.file).read_text())
    public.verify(base64.b64decode(content["signature"]), (copy / MANIFEST).read_bytes())


def test_the_commands_sign_verify_and_write_a_page(copy, run_cli, tmp_path):
    key, page = tmp_path / "me.pem", tmp_path / "page.html"
    made = run_cli("sign", "--new-key", key)
    assert made.code == 0, made.err
    name = made.out.split()[-1]
    assert run_cli("sign", copy, "--key", key).code == 0
    done = run_cli("verify", copy, "--signer", f"{key}.pub", "--page", page, "--json")
    assert done.code == 0, done.err
    told = json.loads(done.out)
    assert told["verdict"] == "identical"
    assert set(told["files"].values()) == {"same bytes"}
    text = page.read_text(encoding="utf-8")
    assert told["digest"] in text and name in text
    assert run_cli("verify", copy, "--page", page).code == 4
    assert run_cli("sign", copy).code == 4
    assert run_cli("sign").code == 4


def test_the_page_says_what_differs(sealed, again, tmp_path):
    again("attitude")
    found = forged(sealed, tmp_path, "attitude", "attitude.json", swapped(b": 0.", b": 1."))
    text = verification_page(found, tmp_path / "forged")
    assert "The result is not confirmed" in text
    assert "another" in text
    assert "numbers differ by up to" in text or "differs in more than numbers" in text
