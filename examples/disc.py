#!/usr/bin/env python3
"""A function for `traceur minimise`: the lowest point of a slope that lies in a disc.

    traceur minimise --var x=-2:2 --var y=-2:2 --constraint outside -- python3 examples/disc.py
"""
import sys

for line in sys.stdin:
    x, y = map(float, line.split())
    outside = x * x + y * y > 1
    print(x + y, "outside" if outside else "", flush=True)
