#!/usr/bin/python3
"""Draws seconds and memory against decoration voxels.

    pavel_benchmark ... > run.txt;  python3 benchmarks/plot.py run.txt plot.svg
"""
import json
import math
import sys

WIDTH, HEIGHT, LEFT, TOP, GAP = 380, 300, 60, 40, 80
COLOURS = {50: "#b0785c", 400: "#3f6f8f", 2000: "#7d9490", 20000: "#8a5a9e"}


def panel(x0, title, unit, points, key):
    values = [(p["decoration_voxels"], key(p), p["elements"]) for p in points]
    lo_x, hi_x = (f(math.log10(v[0]) for v in values) for f in (min, max))
    lo_y, hi_y = (f(math.log10(v[1]) for v in values) for f in (min, max))
    lo_x, hi_x, lo_y, hi_y = math.floor(lo_x), math.ceil(hi_x), math.floor(lo_y), math.ceil(hi_y)

    def place(x, y):
        return (x0 + WIDTH * (math.log10(x) - lo_x) / (hi_x - lo_x),
                TOP + HEIGHT * (1 - (math.log10(y) - lo_y) / (hi_y - lo_y)))

    out = [f'<text x="{x0 + WIDTH / 2}" y="{TOP - 14}" text-anchor="middle" font-weight="bold">{title}</text>']
    for e in range(lo_x, hi_x + 1):
        x, _ = place(10**e, 10**lo_y)
        out.append(f'<path d="M{x:.1f} {TOP}v{HEIGHT}" stroke="#ddd"/>'
                   f'<text x="{x:.1f}" y="{TOP + HEIGHT + 18}" text-anchor="middle">{10**(e - 6):g} M</text>')
    for e in range(lo_y, hi_y + 1):
        _, y = place(10**lo_x, 10**e)
        out.append(f'<path d="M{x0} {y:.1f}h{WIDTH}" stroke="#ddd"/>'
                   f'<text x="{x0 - 6}" y="{y + 4:.1f}" text-anchor="end">{10**e:g} {unit}</text>')
    for n in sorted({v[2] for v in values}):
        line = sorted(v for v in values if v[2] == n)
        places = [place(x, y) for x, y, _ in line]
        colour = COLOURS.get(n, "#555")
        out.append(f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in places)}" fill="none" '
                   f'stroke="{colour}" stroke-width="2"/>')
        out += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>' for x, y in places]
        x, y = places[-1]
        out.append(f'<text x="{x - 8:.1f}" y="{y - 8:.1f}" text-anchor="end" fill="{colour}">{n}</text>')
    return out


def main():
    text = open(sys.argv[1], encoding="utf-8").read()
    points = [p for p in json.loads(text[text.index("[\n"):]) if "error" not in p]
    width, height = 2 * WIDTH + LEFT + GAP + 30, TOP + HEIGHT + 50
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" '
           'font-size="12"><rect width="100%" height="100%" fill="white"/>']
    out += panel(LEFT, "wall time against decoration voxels, by elements", "s", points, lambda p: p["seconds"])
    out += panel(LEFT + WIDTH + GAP, "peak memory against decoration voxels", "GB", points,
                 lambda p: p["peak_rss_bytes"] / 1e9)
    out.append(f'<text x="{LEFT}" y="{height - 8}" fill="#555">pearls on a sphere, coverage 1.43; 2 cores</text></svg>')
    with open(sys.argv[2], "w", encoding="utf-8") as f:
        f.write("\n".join(out) + "\n")


main()
