"""Names and choices that are loaded on first use."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, MutableMapping
from importlib import import_module
from types import ModuleType
from typing import Any


def load_on_first_use(package: str, homes: Mapping[str, str]) -> None:
    """Let a package export names of its modules without importing these.

    `package`: ``__name__`` of the package that calls this. `homes`: module within the package, and
    the names that it gives, separated by spaces; they are its ``__all__``, if it states none, with
    its version, if it states that.
    """
    module = sys.modules[package]
    module.__dict__["_homes"] = {
        name: home for home, names in homes.items() for name in names.split()
    }
    given = {*module.__dict__["_homes"], *({"__version__"} & module.__dict__.keys())}
    module.__dict__.setdefault("__all__", sorted(given))
    module.__class__ = _Lazy


class _Lazy(ModuleType):
    def __getattr__(self, name: str) -> Any:
        if name not in self.__dict__["_homes"]:
            raise AttributeError(f"module '{self.__name__}' has no attribute '{name}'")
        home = import_module(f"{self.__name__}.{self.__dict__['_homes'][name]}")
        value = self.__dict__[name] = getattr(home, name)
        return value

    def __setattr__(self, name: str, value: object) -> None:
        # An import binds each module to its name in the package. Where a public name is spelled
        # alike, as the function delta_v of the module delta_v, the public name is meant.
        if not (isinstance(value, ModuleType) and name in self.__dict__["_homes"]):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*self.__dict__, *self.__dict__["_homes"]})


def named(home: str) -> Any:
    """Return what a module defines, imported now: ``module:name``."""
    module, _, name = home.partition(":")
    return getattr(import_module(module), name)


class Choices(MutableMapping[str, Any]):
    """A literal table of choices, of which a run loads those that it takes.

    `homes`: by name, ``module:attribute``.
    """

    def __init__(self, homes: Mapping[str, str]) -> None:
        self._homes, self._loaded = dict(homes), dict[str, Any]()

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            self._loaded[name] = named(self._homes[name])
        return self._loaded[name]

    def __setitem__(self, name: str, entry: Any) -> None:
        self._homes.setdefault(name, "")
        self._loaded[name] = entry

    def __delitem__(self, name: str) -> None:
        del self._homes[name]
        self._loaded.pop(name, None)

    def __contains__(self, name: object) -> bool:
        return name in self._homes

    def __iter__(self) -> Iterator[str]:
        return iter(self._homes)

    def __len__(self) -> int:
        return len(self._homes)
