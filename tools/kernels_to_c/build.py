"""Write the C of all kernels and of the Python module that holds them, and compile both."""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from strapdown.export import sources
from strapdown.export.translate import Function, Translator, holds_memory
from strapdown.export.types_of_c import SCALARS, Type, is_array, is_list

from . import signatures

HERE = Path(__file__).parent
PACKAGE = HERE.parents[1] / "src/strapdown/_kernels"
NAME = "_compiled.pyd" if os.name == "nt" else "_compiled.abi3.so"
NUMPY = {
    "f8": "NPY_DOUBLE",
    "f4": "NPY_FLOAT",
    "i8": "NPY_INT64",
    "u1": "NPY_UBYTE",
    "i1": "NPY_BYTE",
    "b1": "NPY_BOOL",
}
#: The oldest Python: the module serves all from it on.
ABI = "0x030b0000"
FLAGS = ["-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fPIC"]
FLAGS += ["-fvisibility=hidden", "-Wno-unused-function"]
# GCC vectorizes a loop over nine rows only if it may ask first whether they overlap.
FLAGS += ["--param=vect-max-version-for-alias-checks=300"]
#: Of x86-64: AVX2 and FMA, in processors since 2013.
LEVELS = {"base": [], "v3": ["-mavx2", "-mbmi", "-mbmi2"]}


class _Module:
    """The text of the Python module."""

    def __init__(self, translator: Translator) -> None:
        self.t, self.names = translator, translator.names
        self.getters: dict[Type, str] = {}
        self.makers: dict[Type, str] = {}
        self.helpers: list[str] = []

    def getter(self, kind: Type) -> str:
        """Name of the function that reads an argument of a type."""
        if isinstance(kind, str):
            return f"sd_get_{kind}"
        if kind in self.getters:
            return self.getters[kind]
        name = self.getters[kind] = f"get_{self.names(kind)}"
        if is_array(kind):
            _, scalar, n, layout = kind
            fields = [
                f"({SCALARS[scalar]} *)PyArray_DATA(a)",
                *(f"PyArray_DIM(a, {k})" for k in range(n)),
            ]
            if layout == "A":
                fields += [
                    f"PyArray_STRIDE(a, {k}) / (int64_t)sizeof({SCALARS[scalar]})" for k in range(n)
                ]
            body = (
                f"    PyArrayObject *a = sd_array(o, {NUMPY[scalar]}, sd_type_{scalar}, {n},\n"
                f"                                {int(layout == 'C')}, change, held);\n"
                f"    if (!a) return -1;\n"
                f"    *x = ({self.names(kind)}){{{', '.join(fields)}}};\n    return 0;\n"
            )
        else:
            body = f"    if (!PyTuple_Check(o) || PyTuple_Size(o) != {len(kind) - 1}) return -1;\n"
            for k, part in enumerate(kind[1:]):
                body += f"    if ({self.get(part, f'PyTuple_GetItem(o, {k})', f'&x->f{k}', 'change', 'held')}) return -1;\n"
            body += "    return 0;\n"
        self.helpers.append(
            f"static int {name}(PyObject *o, {self.names(kind)} *x, int change, sd_held *held) {{\n{body}}}\n"
        )
        return name

    def get(self, kind: Type, source: str, target: str, change: str, held: str) -> str:
        last = "" if isinstance(kind, str) else f", {change}, {held}"
        return f"{self.getter(kind)}({source}, {target}{last})"

    def maker(self, kind: Type) -> str:
        """Name of the function that makes a Python object of a result."""
        if isinstance(kind, str):
            return f"sd_py_{kind}"
        if kind in self.makers:
            return self.makers[kind]
        name = self.makers[kind] = f"py_{self.names(kind)}"
        if is_array(kind):
            n = kind[2]
            if kind[3] != "C":
                raise ValueError("a strided result")
            sizes = ", ".join(f"x.n{k}" for k in range(n))
            body = f"    npy_intp sizes[] = {{{sizes}}};\n    return sd_copied(x.data, {NUMPY[kind[1]]}, {n}, sizes);\n"
        elif is_list(kind):
            body = (
                "    PyObject *o = PyList_New(x.n0);\n    if (!o) return NULL;\n"
                "    for (int64_t k = 0; k < x.n0; k++) {\n"
                f"        PyObject *one = {self.maker(kind[1])}(x.data[k]);\n"
                "        if (!one) { Py_DECREF(o); return NULL; }\n"
                "        PyList_SetItem(o, k, one);\n    }\n    return o;\n"
            )
        else:
            n = len(kind) - 1
            body = f"    PyObject *o = PyTuple_New({n}), *one;\n    if (!o) return NULL;\n"
            for k, part in enumerate(kind[1:]):
                body += f"    if (!(one = {self.maker(part)}(x.f{k}))) {{ Py_DECREF(o); return NULL; }}\n"
                body += f"    PyTuple_SetItem(o, {k}, one);\n"
            body += "    return o;\n"
        self.helpers.append(f"static PyObject *{name}({self.names(kind)} x) {{\n{body}}}\n")
        return name

    def wrapper(self, name: str, functions: list[Function]) -> str:
        """Write the function of a kernel that Python calls."""
        label = name.replace(".", "_")
        count = len(functions[0].kinds)
        lines = [
            f"static PyObject *call_{label}(PyObject *self, PyObject *const *args, Py_ssize_t n) {{"
        ]
        lines += [
            "    (void)self;",
            f'    if (n != {count}) return sd_count("{name}", {count}, n);',
        ]
        lines.append("    int wrong = 0;")
        lines.append("    sd_held held;")
        lines.append("    held.n = 0;")
        for function in functions:
            lines.append("    {")
            for k, kind in enumerate(function.kinds):
                lines.append(f"        {self.names(kind)} a{k};")
            tests = [
                f"({self.get(kind, f'args[{k}]', f'&a{k}', str(int(k in function.changes)), '&held')} && (wrong = {k + 1}))"
                for k, kind in enumerate(function.kinds)
            ]
            joined = " ||\n              ".join(tests) or "0"
            lines.append(f"        if (!({joined})) {{")
            arguments = ", ".join(f"a{k}" for k in range(count))
            unlocked = function.kernel.nogil
            if unlocked:
                lines.append("            PyThreadState *volatile state = NULL;")
            leave = [
                "            int why = setjmp(*table->leave());",
                "            if (why) {",
                *["                if (state) PyEval_RestoreThread(state);"] * unlocked,
                "                sd_let_go(&held);",
                "                table->reset();",
                "                int line;",
                "                const char *file = table->where(&line);",
                f'                return sd_failed("{name}", why, file, line);',
                "            }",
            ]
            lines += leave if function.can_raise else ["#ifdef SD_BOUNDS", *leave, "#endif"]
            call = f"table->{function.name}({arguments})"
            if function.result is not None:
                lines.append(f"            {self.names(function.result)} x;")
                call = f"x = {call}"
            if unlocked:
                lines.append("            state = PyEval_SaveThread();")
                lines.append(f"            {call};")
                lines.append("            PyEval_RestoreThread(state);")
            else:
                lines.append(f"            {call};")
            lines.append("            sd_let_go(&held);")
            if function.result is None:
                lines.append("            Py_RETURN_NONE;")
            else:
                if holds_memory(function.result):
                    lines.append(f"            PyObject *o = {self.maker(function.result)}(x);")
                    lines += ["            table->reset();", "            return o;"]
                else:
                    lines.append(f"            return {self.maker(function.result)}(x);")
            lines += ["        }", "        sd_let_go(&held);", "    }"]
            if function is not functions[-1]:
                lines.append("    PyErr_Clear();")
        lines.append(f'    PyErr_Clear();\n    sd_wrong("{name}", wrong - 1, args[wrong - 1]);')
        lines += ["    return NULL;", "}", ""]
        return "\n".join(lines)


def generate(package: Path, listed: Path, out: Path, lines: bool = False) -> int:
    """Write the three files of C; return the number of functions.

    `lines`: whether each statement has the line of the kernel's source, for ``-DSD_BOUNDS``.
    """
    modules = sources.load(package)
    translator = Translator(lines=lines)
    public: dict[str, list[Function]] = {}
    for name, rows in signatures.read(listed).items():
        module, kernel = name.split(".")
        public[name] = [translator.function(modules[module][kernel], kinds, True) for kinds in rows]
    module = _Module(translator)
    wrappers = [module.wrapper(name, functions) for name, functions in public.items()]
    every = [f for functions in public.values() for f in functions]
    type_of = translator.names
    rows = [
        f"    {type_of(f.result)} (*{f.name})({', '.join(type_of(k) for k in f.kinds) or 'void'});"
        for f in every
    ]
    out.mkdir(parents=True, exist_ok=True)
    (out / "prelude.h").write_text((HERE / "prelude.h").read_text())
    (out / "kernels.h").write_text(
        "\n".join(
            [
                *type_of.text,
                "typedef struct {",
                "    jmp_buf *(*leave)(void);",
                "    void (*reset)(void);",
                "    const char *(*where)(int *line);",
                *rows,
                "} sd_table;",
                "",
            ]
        )
    )
    (out / "kernels.c").write_text(
        "\n".join(
            [
                '#include "prelude.h"',
                '#include "kernels.h"',
                "",
                *(f.text for f in translator.order),
                "static jmp_buf *sd_leave(void) { return &sd_exit; }",
                "static void sd_reset(void) { sd_end((sd_mark){0, 0}); }",
                "static const char *sd_where(int *line) { *line = sd_line; return sd_file; }",
                "const sd_table SD_TABLE = {",
                "    sd_leave, sd_reset, sd_where,",
                *(f"    {f.name}," for f in every),
                "};",
                "",
            ]
        )
    )
    digest = modules["compilation"]["sources_digest"]()
    methods = [
        f'    {{"{name.split(".")[0]}", {{"{name.split(".")[1]}", (PyCFunction)(void (*)(void))call_'
        f"{name.replace('.', '_')}, METH_FASTCALL, NULL}}}},"
        for name in public
    ]
    (out / "module.c").write_text(
        "\n".join(
            [
                f"#define Py_LIMITED_API {ABI}",
                "#include <Python.h>",
                '#include "prelude.h"',
                '#include "kernels.h"',
                (HERE / "module.h").read_text(),
                "extern const sd_table table_base;",
                "#ifdef SD_V3",
                "extern const sd_table table_v3;",
                "#endif",
                "static const sd_table *table = &table_base;",
                *module.helpers,
                *wrappers,
                "static struct { const char *module; PyMethodDef method; } kernels[] = {",
                *methods,
                "};",
                'static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, "_compiled", NULL, -1, NULL,',
                "                                        NULL, NULL, NULL, NULL};",
                "PyMODINIT_FUNC PyInit__compiled(void) {",
                "    import_array();",
                "#ifdef SD_V3",
                "    __builtin_cpu_init();",
                '    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&'
                ' __builtin_cpu_supports("bmi2") && !getenv("STRAPDOWN_BASELINE"))',
                "        table = &table_v3;",
                "#endif",
                "    PyObject *made = PyModule_Create(&definition), *all = PyDict_New();",
                "    if (!made || !all) return NULL;",
                "    for (size_t k = 0; k < sizeof kernels / sizeof *kernels; k++) {",
                f'        PyObject *name = PyUnicode_FromFormat("{sources.PACKAGE}.%s", kernels[k].module);',
                "        PyObject *call = name ? PyCFunction_NewEx(&kernels[k].method, NULL, name) : NULL;",
                '        PyObject *key = PyUnicode_FromFormat("%s.%s", kernels[k].module, kernels[k].method.ml_name);',
                "        if (!call || !key || PyDict_SetItem(all, key, call)) return NULL;",
                "        Py_DECREF(name);",
                "        Py_DECREF(call);",
                "        Py_DECREF(key);",
                "    }",
                '    PyModule_AddObject(made, "KERNELS", all);',
                f'    PyModule_AddStringConstant(made, "SOURCES", "{digest}");',
                '    PyModule_AddStringConstant(made, "COMPILER", __VERSION__);',
                '    PyModule_AddStringConstant(made, "LEVEL", table == &table_base ? "base" : "v3");',
                "    return made;",
                "}",
                "",
            ]
        )
    )
    return len(translator.order)


def system_compiler() -> list[str]:
    """Return the C compiler: that of the environment's CC, or the system's; empty if there is none."""
    if "CC" in os.environ:
        return os.environ["CC"].split()
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    return []


def compiler() -> list[str]:
    """Return `system_compiler`, or else that of the package `ziglang`."""
    found = system_compiler()
    if not found and find_spec("ziglang"):
        found = [sys.executable, "-m", "ziglang", "cc"]
    if not found:
        raise SystemExit("no C compiler: install one, or `pip install ziglang`")
    return found


def compile_(out: Path, command: list[str], flags: list[str], levels: list[str]) -> Path:
    """Compile what `generate` wrote into a folder, and link it; return the path of the module."""
    import numpy as np

    include = [f"-I{sysconfig.get_path('include')}", f"-I{np.get_include()}"]
    jobs = [("kernels.c", level, [f"-DSD_TABLE=table_{level}", *LEVELS[level]]) for level in levels]
    jobs.append(("module.c", "module", ["-DSD_V3"] if "v3" in levels else []))
    objects, running = [], []
    for source, label, more in jobs:
        objects.append(str(out / f"{label}.o"))
        line = [
            *command,
            *FLAGS,
            *flags,
            *more,
            *include,
            "-c",
            str(out / source),
            "-o",
            objects[-1],
        ]
        running.append((subprocess.Popen(line), line))
    for process, line in running:
        if process.wait():
            raise SystemExit(f"failed: {' '.join(line)}")
    made = out / NAME
    shared = (
        ["-bundle", "-undefined", "dynamic_lookup"] if sys.platform == "darwin" else ["-shared"]
    )
    subprocess.run([*command, *shared, *objects, "-o", str(made), "-lm"], check=True)
    return made


def build(folder: Path, flags: Sequence[str] = (), keep: Path | None = None) -> Path:
    """Write, compile and put the module into a folder; return its path.

    Parameters
    ----------
    folder : Path
        Where the module is put.
    flags : sequence of str
        Further flags of the compiler; ``-DSD_BOUNDS`` checks every index, and an IndexError names
        the kernel that was called, and file and line of the index.
    keep : Path
        Where the C is kept.
    """
    levels = ["base", "v3"] if platform.machine().lower() in ("x86_64", "amd64") else ["base"]
    if "-DSD_BOUNDS" in flags:  # for tests: one level suffices, as all give the same bits
        levels = levels[:1]
    with tempfile.TemporaryDirectory() as scratch:
        out = keep or Path(scratch)
        begin = time.perf_counter()
        bounds = "-DSD_BOUNDS" in flags
        count = generate(PACKAGE, HERE / "signatures.txt", out, bounds)
        middle = time.perf_counter()
        made = compile_(out, compiler(), list(flags), levels)
        print(
            f"{count} functions: written in {middle - begin:.1f} s, "
            f"compiled in {time.perf_counter() - middle:.1f} s, {made.stat().st_size / 1e6:.2f} MB",
            file=sys.stderr,
        )
        # Put there whole: another process may have the former one loaded.
        target = folder / NAME
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(made, target.with_suffix(".new"))
        target.with_suffix(".new").replace(target)
    return target


def main() -> None:
    """Build from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=PACKAGE, help="where the module is put")
    parser.add_argument("--keep", type=Path, help="a folder in which the C is kept")
    parser.add_argument("--flags", default="", help="further flags of the compiler")
    options = parser.parse_args()
    build(options.folder, options.flags.split(), options.keep)


if __name__ == "__main__":
    main()
