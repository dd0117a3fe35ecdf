"""Public names of a package that are loaded on first use."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import Any

__all__ = ["load_on_first_use"]


def load_on_first_use(package: str, homes: Mapping[str, str]) -> None:
    """Let a package export names of its modules without importing these.

    `package`: ``__name__`` of the package that calls this. `homes`: module within the package, and
    the names that it gives, separated by spaces.
    """
    module = sys.modules[package]
    module.__dict__["_homes"] = {
        name: home for home, names in homes.items() for name in names.split()
    }
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
