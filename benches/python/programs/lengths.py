import ast, io, tokenize, sys
from pathlib import Path
LAYOUT = {tokenize.ENCODING, tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
def length(path):
    text = path.read_text(); tree = ast.parse(text)
    first = tree.body[1].lineno if ast.get_docstring(tree) else 1
    toks = [t for t in tokenize.generate_tokens(io.StringIO(text).readline) if t.type not in LAYOUT and t.start[0] >= first]
    lines = {r for t in toks for r in range(t.start[0], t.end[0]+1)}
    return len(lines), len(toks), sum(len(t.string) for t in toks)
R = Path(__file__).resolve().parents[3]
for p in sorted((R/"benches/python/programs").glob("*_mujoco.py")):
    o = R/"examples"/(p.stem[:-7]+".py")
    print(f"{o.stem:22} {length(o)} {length(p)}")
