# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes type stubs of the wrapped classes: make_stubs.py OUT.pyi

VTK's wrappers begin each docstring with its signatures in Python's terms:
"SetLevel(self, level:int) -> None", then the C++ declaration and the documentation.
"""
import inspect
import re
import sys

import teravox.vtkRenderingOutOfCore as module

# Of VTK's own types, what isn't one of Python's.
PLAIN = {"int", "float", "str", "bool", "bytes", "None", "object", "Buffer", "Callback"}


def split_arguments(text):
    """Splits at commas that aren't inside of brackets."""
    parts, depth, part = [], 0, ""
    for c in text:
        depth += c in "(["
        depth -= c in ")]"
        if c == "," and depth == 0:
            parts.append(part.strip())
            part = ""
        else:
            part += c
    return parts + ([part.strip()] if part.strip() else [])


class Stubs:
    def __init__(self):
        self.foreign = {}

    def type_of(self, text):
        """A type of VTK's docstrings as one of Python's."""
        text = text.strip()
        if text.startswith("(") and text.endswith(")"):
            inner = [self.type_of(t) for t in split_arguments(text[1:-1])]
            return f"tuple[{', '.join(inner)}]" if inner else "tuple[()]"
        if text.startswith("[") and text.endswith("]"):
            inner = sorted({self.type_of(t) for t in split_arguments(text[1:-1])})
            return f"MutableSequence[{' | '.join(inner)}]"
        if text in PLAIN:
            return "Any" if text in ("object", "Buffer", "Callback") else text
        if hasattr(module, text):
            return text
        if re.fullmatch(r"vtk\w+", text):
            import vtkmodules.all  # what stands in the signatures is known there

            found = getattr(vtkmodules.all, text, None)
            if found is not None:
                self.foreign[text] = found.__module__
                return text
        return "Any"

    def argument(self, text):
        match = re.fullmatch(r"(\w+):\s*(.*?)(?:=(.*))?", text)
        if not match:
            return text
        name, kind, default = match.groups()
        kind = self.type_of(kind)
        # Sequences that are read only may be tuples or lists.
        kind = re.sub(r"^tuple\[(\w+)(, \1)+\]$", r"Sequence[\1]", kind)
        return f"{name}: {kind}" + (" = ..." if default is not None else "")

    def signatures(self, name, doc):
        """[(arguments, result, static)] of a docstring."""
        found = []
        for line in re.sub(r"\n\s+", " ", doc.split("\n\n")[0]).split("\n") + doc.split("\n"):
            match = re.match(rf"^(?:V\.)?{name}\((.*)\) -> (.*?)(?:\s*C\+\+:.*)?$", line.strip())
            if not match:
                match = re.match(rf"^(?:V\.)?{name}\((.*)\)(?:\s*C\+\+:.*)?$", line.strip())
            if not match:
                continue
            arguments = split_arguments(match.group(1))
            result = match.group(2) if match.lastindex == 2 else "None"
            signature = (
                tuple(self.argument(a) for a in arguments if a != "self"),
                self.type_of(result),
                "self" not in arguments,
            )
            if signature not in found:
                found.append(signature)
        return found

    def method(self, name, method):
        signatures = self.signatures(name, method.__doc__ or "")
        if not signatures:
            return [f"    def {name}(self, *args: Any) -> Any: ..."]
        lines = []
        for arguments, result, static in signatures:
            if len(signatures) > 1:
                lines.append("    @overload")
            if static:
                lines.append("    @staticmethod")
            every = ([] if static else ["self"]) + list(arguments)
            lines.append(f"    def {name}({', '.join(every)}) -> {result}: ...")
        return lines

    def class_of(self, name, wrapped):
        base = wrapped.__bases__[0]
        base_name = base.__name__
        if hasattr(module, base_name):
            pass
        elif base is object:
            base_name = ""
        else:
            self.foreign[base_name] = base.__module__
        lines = [f"class {name}({base_name}):" if base_name else f"class {name}:"]
        for key, value in sorted(vars(wrapped).items()):
            if key.startswith("_"):
                continue
            if isinstance(value, int):
                lines.append(f"    {key}: int")
            elif inspect.isclass(value):
                lines.append(f"    class {key}(int): ...")
            elif callable(value) or isinstance(value, staticmethod):
                lines += self.method(key, getattr(wrapped, key))
        return lines if len(lines) > 1 else lines + ["    ..."]

    def write(self, out):
        classes = {n: c for n, c in vars(module).items() if inspect.isclass(c)}
        # Bases first.
        ordered = sorted(classes.items(), key=lambda item: (len(item[1].__mro__), item[0]))
        bodies = []
        for name, wrapped in ordered:
            bodies.append("\n".join(self.class_of(name, wrapped)))
        head = [
            "# Made from the docstrings of the wrapped classes by make_stubs.py.",
            "from typing import Any, MutableSequence, Sequence, overload",
            "",
        ]
        for name, home in sorted(self.foreign.items()):
            head.append(f"from {home} import {name}")
        out.write("\n".join(head) + "\n\n" + "\n\n".join(bodies) + "\n")


if __name__ == "__main__":
    import teravox  # VTK's superclasses are known then

    with open(sys.argv[1], "w", encoding="ascii") as stream:
        Stubs().write(stream)
