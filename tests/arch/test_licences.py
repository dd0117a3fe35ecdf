"""What strapdown can import is under licences that a closed product may use, too."""

from __future__ import annotations

from importlib.metadata import distribution

from strapdown.bundle import environment

#: The LGPL allows what we do: an import, in an extra that nothing else needs.
LGPL = {"pymavlink"}
#: In the public domain but for an editor's mode, which is not imported.
IN_PART = {"docutils"}


def licence(name):
    about = distribution(name).metadata
    classes = [c for c in about.get_all("Classifier") or [] if c.startswith("License")]
    # A whole text of a licence may speak of others.
    own = [about.get("License-Expression") or "", (about.get("License") or "").split("\n")[0]]
    return " ".join([*own, *classes])


def test_no_dependency_is_under_the_gpl_or_agpl():
    names = [line.partition("==")[0] for line in environment()]
    assert {"numpy", "h5py", "cryptography", "pypdf"} <= set(names)
    told = {name: licence(name) for name in names}
    assert [name for name, text in told.items() if not text.strip()] == []
    general = {n for n, text in told.items() if "GPL" in text or "General Public" in text}
    assert general <= LGPL | IN_PART, {n: told[n] for n in general}
