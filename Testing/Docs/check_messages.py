# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Each message in the tables of a page must stand in the sources: check_messages.py PAGE.md FOLDER...

A message is the code in the first cell of a row; its pieces between ellipses (U+2026) must each be in one text of the sources, where
neighbouring literals are one text, as compilers have it.
"""
import pathlib
import re
import sys

page = pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")
sources = []
for folder in sys.argv[2:]:
    for path in sorted(pathlib.Path(folder).rglob("*")):
        if path.suffix in (".cxx", ".h", ".py"):
            sources.append(re.sub(r'"\s*\n\s*"', "", path.read_text(encoding="utf-8")))
text = "\n".join(sources)

messages = re.findall(r"^\| `([^`]+)` \|", page, re.MULTILINE)
missing = []
for message in messages:
    for piece in message.split("\u2026"):
        # Quotes around a name belong to another literal than the sentence.
        piece = piece.strip(" '")
        if len(piece) > 3 and piece not in text:
            missing.append(f"{piece!r} of {message!r}")
print(f"{len(messages)} messages")
if missing or len(messages) < 20:
    sys.exit("Not in the sources: " + "; ".join(missing))
