#!/usr/bin/env python3
"""Counts the public items of the library in the output of `cargo doc --no-deps`: types and functions, their methods, fields and variants.

    tools/count_public_items.py [target/doc/teachtree]

Methods of traits are not counted. Only the standard library of Python is needed.
"""

import re
import sys
from pathlib import Path

ITEM = re.compile(r"(struct|enum|fn|trait|type|constant|macro|union)\.\w+\.html")
MEMBER = re.compile(r'id="((?:method|variant|structfield|tymethod|associatedconstant)\.[\w.]+)"')

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "target/doc/teachtree")
items = [page for page in sorted(folder.glob("*.html")) if ITEM.fullmatch(page.name)]
if not items:
    sys.exit(f"{folder}: found no pages; run `cargo doc --no-deps`")
members = 0
for page in items:
    own = re.split(r'id="(?:deref-methods|trait-implementations|synthetic-implementations|blanket-implementations)', page.read_text())[0]
    members += len(set(MEMBER.findall(own)))
print(f"{len(items)} types and functions, {members} members, {len(items) + members} public items")
